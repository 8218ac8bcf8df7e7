"""Runs that end before their time and are resumed: is the result that of the run that nothing stopped?

    python benchmarks/resume.py [STOPS] [SEED] [killed,memory,disk]

50 stops of each kind unless given, at random moments, the first second of the process among them: SIGKILL; memory that
from some moment on may not grow; a largest size of files, which stands for a full disk. Prints a line for each: when it
came, after the start of the process, or at which size of a file; up to which time of the motion the checkpoint went
that it left; the steps that were saved and those that the resumed process made, of all; and whether the result is
right: times, positions, velocities, accelerations and all counts of work are those of the uninterrupted run, bit for
bit, no saved step was made again, and the process that ended by itself said why in one line and left no other file.
"""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from erls.run.checkpoints import read_checkpoint
from erls.run.file import load_run

DATA = Path(__file__).parents[1] / "data"
SCENES = (
    (DATA / "slider_crank/flexible.toml", ["simulation.duration=500"]),
    (DATA / "l_shape/steel_tall.toml", ["simulation.duration=150"]),
    (DATA / "l_shape/steel_tall.toml", ["simulation.duration=150", "simulation.output_step=0.01"]),
    (DATA / "slider_crank/flexible.toml", ["simulation.duration=10", "simulation.step=2e-4"]),
)
KINDS = ("killed", "memory", "disk")
_ROOM = 2**22  # bytes that memory may still grow by
_LONGEST = 60.0  # s: a library that is refused memory may wait for it for ever; then the process is killed
PROCESS = """
import sys, threading, time
import erls.integrate.driver as driver
from erls.cli.main import main

def squeeze():
    import os, resource
    time.sleep(squeezed)
    pages = int(open("/proc/self/statm").read().split()[0])
    room = pages * os.sysconf("SC_PAGE_SIZE") + {room}
    resource.setrlimit(resource.RLIMIT_AS, (room, resource.getrlimit(resource.RLIMIT_AS)[1]))

squeezed, largest = {squeezed}, {largest}
if squeezed is not None:
    threading.Thread(target=squeeze, daemon=True).start()
if largest is not None:
    import resource
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
made, add, accept = [0], driver.Recorder._add, driver.Recorder.accept

def added(self, t, rows, steps):
    made[0] += steps
    add(self, t, rows, steps)

def accepted(self, t):
    made[0] += 1
    accept(self, t)

driver.Recorder._add, driver.Recorder.accept = added, accepted
code = main()
print("steps made:", made[0], file=sys.stderr)
sys.exit(code)
"""


class Ended(NamedTuple):
    """A process: exit code (None: it was killed), what it said, steps that it made, wall time [s]."""

    code: int | None
    said: list[str]
    made: int
    wall: float


class Stop(NamedTuple):
    """How a run is stopped: by a kill, or a squeeze of memory, at a time [s]; or by the largest size of a file."""

    kind: str
    at: float

    def __str__(self) -> str:
        return f"{self.at / 1e6:.2f} MB" if self.kind == "disk" else f"{self.at:.2f} s"


def simulated(scene: Path, changes: list[str], output: Path, *more: str, stop: Stop | None = None) -> Ended:
    """One ``erls simulate``."""
    kind = None if stop is None else stop.kind
    at = 0.0 if stop is None else stop.at
    limits = {"squeezed": at if kind == "memory" else None, "largest": int(at) if kind == "disk" else None}
    sets = [part for change in changes for part in ("--set", change)]
    code = PROCESS.format(room=_ROOM, **limits)
    arguments = [sys.executable, "-c", code, "simulate", str(scene), *sets, "--no-verdict", *more, "-o", str(output)]
    begun = time.perf_counter()
    running = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, encoding="utf-8")
    try:
        said = running.communicate(timeout=at if kind == "killed" else _LONGEST)[1].splitlines()
    except subprocess.TimeoutExpired:
        running.kill()
        running.communicate()
        return Ended(None, [], 0, at)
    made = [int(line.split()[-1]) for line in said if line.startswith("steps made:")]
    return Ended(running.returncode, said, sum(made), time.perf_counter() - begun)


def same(one: Path, other: Path) -> bool:
    """Whether two runs are equal in every bit of their knots, and took equal work."""
    a, b = load_run(one).solution, load_run(other).solution
    return a.work == b.work and all(np.array_equal(getattr(a, name), getattr(b, name)) for name in "tyva")


class Whole(NamedTuple):
    """A run that nothing stopped: its scene, file, wall time of its process [s], and steps."""

    scene: Path
    changes: list[str]
    output: Path
    wall: float
    steps: int

    @property
    def name(self) -> str:
        return f"{self.scene.parent.name}/{self.scene.stem}"


def whole_run(scene: Path, changes: list[str], output: Path) -> Whole:
    """The second of two: the first one compiles."""
    for _ in range(2):
        found = simulated(scene, changes, output)
        if found.code:
            raise SystemExit("\n".join(found.said))
    print(f"{scene.parent.name}/{scene.stem}, {', '.join(changes)}: {found.wall:.1f} s, {found.made} steps", flush=True)
    return Whole(scene, changes, output, found.wall, found.made)


def stopped(whole: Whole, stop: Stop, folder: Path) -> bool | None:
    """Whether a run that is stopped and resumed comes out right; None where it ended before."""
    output = folder / "stopped.h5"
    partial = output.with_name(f"{output.name}.partial")
    for file in folder.iterdir():
        file.unlink()
    ended = simulated(whole.scene, whole.changes, output, stop=stop)
    if ended.code == 0:
        return None
    wrong = []
    if ended.code is not None:
        errors = [line for line in ended.said if line.startswith("error: ")]
        wrong += [] if len(errors) == 1 and "Traceback" not in "".join(ended.said) else ["said"]
        wrong += [] if {file.name for file in folder.iterdir()} <= {output.name, partial.name} else ["files"]
    left, known, saved, made = "none", whole.changes, 0, 0
    if partial.exists():
        (part,) = read_checkpoint(partial).parts.values()
        left, known = f"{float(part.memory['time'][0]):.4g} s", []
        saved = int(part.memory["recorder.work"][-1])
    if ended.code is None and output.exists():  # it was over, but for leaving
        left, made = "written", whole.steps
    else:
        resumed = simulated(whole.scene, known, output, "--resume", str(output))
        made = resumed.made
        wrong += ["resumed"] if resumed.code else []
        wrong += [] if saved + made == whole.steps else ["steps"]
        wrong += ["partial"] if partial.exists() else []
    wrong += [] if output.exists() and same(whole.output, output) else ["bits"]
    told = "right" if not wrong else f"WRONG: {', '.join(wrong)}"
    steps = f"{saved:9d}{made:9d}{whole.steps:9d}"
    print(f"{whole.name:24}{stop.kind:>8}{stop!s:>10}{left:>12}{steps}  {told}", flush=True)
    if wrong:
        print(*(f"    {line}" for line in ended.said[-5:]), sep="\n")
    return not wrong


def main(stops: int = 50, seed: int = 1, kinds: tuple[str, ...] = KINDS) -> int:
    """Stop and resume; 1 where a run came out wrong."""
    draw = random.Random(seed)
    failed = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "stopped").mkdir()
        wholes = [whole_run(*scene, folder / f"whole{number}.h5") for number, scene in enumerate(SCENES)]
        head = f"{'checkpoint':>12}{'saved':>9}{'made':>9}{'of all':>9}"
        print(f"{'scene':24}{'':>8}{'stopped':>10}{head}")
        for kind in kinds:
            done = right = tried = 0
            while done < stops:
                whole, tried = wholes[tried % len(wholes)], tried + 1
                at = draw.uniform(0.0, whole.wall)
                at = draw.uniform(1e4, whole.output.stat().st_size) if kind == "disk" else at
                found = stopped(whole, Stop(kind, at), folder / "stopped")
                done, right = done + (found is not None), right + (found is True)
                if tried > 10 * stops:
                    print(f"only {done} of {tried} runs were stopped")
                    break
            failed += done - right
            print(f"{right} of {done} that were stopped ({kind}) came out right", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    given = sys.argv[1:]
    chosen = tuple(given[2].split(",")) if len(given) > 2 else KINDS
    raise SystemExit(main(*map(int, given[:2]), kinds=chosen))

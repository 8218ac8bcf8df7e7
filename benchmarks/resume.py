"""Runs that are killed (SIGKILL) at random moments and resumed: is the result that of the run that nothing stopped?

    python benchmarks/resume.py [KILLS] [SEED]

50 kills unless given. Prints a line for each kill: when it came, after the start of the process; up to which time of
the motion the checkpoint went that it left; and whether times, positions, velocities, accelerations and all counts of
work of the resumed run are those of the uninterrupted one, bit for bit.
"""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from erls.run.checkpoints import read_checkpoint
from erls.run.file import load_run

DATA = Path(__file__).parents[1] / "data"
SCENES = (
    (DATA / "slider_crank/flexible.toml", ["simulation.duration=500"]),
    (DATA / "l_shape/steel_tall.toml", ["simulation.duration=100", "simulation.output_step=0.01"]),
    (DATA / "slider_crank/flexible.toml", ["simulation.duration=20", "simulation.step=2e-4"]),
)
COMMAND = "import sys; from erls.cli.main import main; sys.exit(main())"


def process(scene: Path, changes: list[str], output: Path, *more: str) -> subprocess.Popen[bytes]:
    """One ``erls simulate``."""
    sets = [part for change in changes for part in ("--set", change)]
    arguments = [sys.executable, "-c", COMMAND, "simulate", str(scene), *sets, "--no-verdict", *more]
    return subprocess.Popen([*arguments, "-o", str(output)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def finished(running: subprocess.Popen[bytes]) -> float:
    """Time that a process takes to end well [s]."""
    begun = time.perf_counter()
    _, told = running.communicate()
    if running.returncode:
        raise SystemExit(told.decode())
    return time.perf_counter() - begun


def same(one: Path, other: Path) -> bool:
    """Whether two runs are equal in every bit of their knots, and took equal work."""
    a, b = load_run(one).solution, load_run(other).solution
    return a.work == b.work and all(np.array_equal(getattr(a, name), getattr(b, name)) for name in "tyva")


def main(kills: int = 50, seed: int = 1) -> None:
    """Kill and resume."""
    draw = random.Random(seed)
    equal = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole = []
        for number, (scene, changes) in enumerate(SCENES):
            output = folder / f"whole{number}.h5"
            finished(process(scene, changes, output))  # compiles
            whole.append((output, finished(process(scene, changes, output))))
            print(f"{scene.parent.name}/{scene.stem}, {', '.join(changes)}: {whole[-1][1]:.1f} s", flush=True)
        print(f"{'scene':30}{'killed at':>10}{'checkpoint':>12}{'equal':>8}")
        kill = 0
        while kill < kills:
            number = kill % len(SCENES)
            scene, changes = SCENES[number]
            reference, wall = whole[number]
            output = folder / f"killed{kill}.h5"
            running, at = process(scene, changes, output), draw.uniform(0.0, wall)
            try:
                running.communicate(timeout=at)
                output.unlink()
                continue  # it was faster than that: no kill
            except subprocess.TimeoutExpired:
                running.kill()
                running.communicate()
            partial, kill = output.with_name(f"{output.name}.partial"), kill + 1
            left, known = "none", changes
            if partial.exists():
                (part,) = read_checkpoint(partial).parts.values()
                left, known = f"{float(part.memory['time'][0]):.4g} s", []
            if output.exists():  # it was over, but for leaving
                left = "written"
            else:
                finished(process(scene, known, output, "--resume", str(output)))
            right = same(reference, output) and (left == "written" or not partial.exists())
            equal += right
            print(f"{scene.parent.name + '/' + scene.stem:30}{at:8.2f} s{left:>12}{right!s:>8}", flush=True)
    print(f"{equal} of {kills} equal the run that nothing stopped")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))

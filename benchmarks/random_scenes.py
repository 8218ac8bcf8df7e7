"""Random scenes: what their runs state of their accuracy against what they are off.

    python benchmarks/random_scenes.py [--seeds 0:2000] [--json rows.jsonl] [--workers 2] [--again]
        [--parts all|integration|statement] [--references FOLDER] [--nodal-every 0] [--write-references]
        [--only-table] [--missing] [--stored] [--commands]

Scenes, references and what parts of an error are: tests/erls/random_scenes.py and random_references.py. Rows go to the
file as they come, one JSON object a line; seeds that stand there are not run again, so that Ctrl-C loses nothing. A
worker that does not answer for ``--hang`` seconds is ended, and its seed is a finding: all runs are limited by their
work, and end long before.

Prints coverage (stated total at least the actual one, up to the stated horizon), the median and 90th percentile of
stated over actual (floor 1e-7 m), verdicts, refusals and failures by cause, the cost of the statement; by part and by
class of scene; of each integrator the actual error of integration over the tolerance. ``--write-references`` writes
the actual errors to tests/data/random_scenes.csv, by which tests judge the first seeds; ``--nodal-every 10`` judges
each tenth scene by beam elements too, in up to ``--nodal-budget`` seconds. References take nearly all of the time:
with ``--references`` their places are kept in a folder, and ``--again`` runs the scenes alone, and holds them against
what is there; ``--again --parts statement`` holds what is stated now against the actual errors in the file of the rows,
``--stored`` against those in tests/data/random_scenes.csv, with no references at all: a second a scene. ``--missing``
takes seeds that are not in that table, so that it can be filled in parts.

What the statement costs is printed against the run within one process, which knows its links and has its kernels; with
``--commands``, which does nothing else, against what a user waits for: `erls simulate SCENE` as a process of its own,
with and without ``--no-verdict`` in turns, the least of three each.
"""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), *(str(ROOT / "tests" / part) for part in ("", "erls"))]  # before this file's own folder

STORED = ROOT / "tests/data/random_scenes.csv"
_ERLS = "import sys; from erls.cli.main import main; sys.exit(main())"
_LONGEST = 30.0  # s: longer commands tell nothing of most
SUBJECTS = ("kind", "mechanism", "links", "formulation", "integrator", "effects", "sag", "size", "friction", "limit")


def serve() -> None:
    """Judge seeds that come on standard input; a line for each goes to standard output."""
    from random_references import judge

    answers, sys.stdout = sys.stdout, sys.stderr
    for line in sys.stdin:
        print(json.dumps(judge(**json.loads(line))), file=answers, flush=True)


class Worker:
    """A process that judges one seed after the other; a new one where it hangs or dies."""

    def __init__(self, hang_s: float) -> None:
        self._hang_s, self._process = hang_s, None
        self._lines: SimpleQueue[str] = SimpleQueue()

    def _ready(self) -> subprocess.Popen[str]:
        if self._process is None:
            command = [sys.executable, __file__, "--serve"]
            pipe = subprocess.PIPE
            new = subprocess.Popen(command, stdin=pipe, stdout=pipe, encoding="utf-8", start_new_session=True)
            self._process, self._lines = new, SimpleQueue()  # type: ignore[assignment]
            threading.Thread(target=self._read, args=(new, self._lines), daemon=True).start()
        return self._process  # type: ignore[return-value]

    @staticmethod
    def _read(process: subprocess.Popen[str], lines: SimpleQueue[str]) -> None:
        assert process.stdout is not None
        for line in process.stdout:
            lines.put(line)
        lines.put("")

    def judge(self, task: dict[str, Any]) -> dict[str, Any]:
        """The row of a seed."""
        from random_scenes import random_scene  # that of the tests

        process = self._ready()
        assert process.stdin is not None
        failed = {"seed": task["seed"], "labels": random_scene(task["seed"]).labels, "judged_s": self._hang_s}
        try:
            process.stdin.write(json.dumps(task) + "\n")
            process.stdin.flush()
            line = self._lines.get(timeout=self._hang_s)
        except (Empty, OSError):
            self.end()
            return {**failed, "outcome": "BUG: hang"}
        if not line:
            self.end()
            return {**failed, "outcome": "BUG: the process died"}
        return json.loads(line)  # type: ignore[no-any-return]

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()  # type: ignore[unreachable]
            self._process.wait()
        self._process = None


def judge_all(
    tasks: list[dict[str, Any]], known: dict[int, dict[str, Any]], file: Path, workers: int, hang_s: float
) -> None:
    """Judge seeds in several processes; rows, with what was known and stays, are added to the file as they come."""
    todo, lock, begun, done = SimpleQueue[dict[str, Any]](), threading.Lock(), time.monotonic(), Counter[str]()
    for task in tasks:
        todo.put(task)
    stopped = threading.Event()
    crew = [Worker(hang_s) for _ in range(workers)]

    def work(worker: Worker) -> None:
        while not stopped.is_set():
            try:
                task = todo.get_nowait()
            except Empty:
                return
            row = {**known.get(task["seed"], {}), **worker.judge(task)}
            if stopped.is_set():
                return
            with lock, file.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(row) + "\n")
                done[row["outcome"].partition(":")[0]] += 1
                spent = time.monotonic() - begun
                left = spent / done.total() * (len(tasks) - done.total())
                text = f"\r{done.total()} of {len(tasks)}, {dict(done)}, {left / 60:.0f} min left  "
                print(text, end="", file=sys.stderr, flush=True)

    threads = [threading.Thread(target=work, args=(worker,), daemon=True) for worker in crew]
    try:
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            time.sleep(0.2)
    except KeyboardInterrupt:
        print("\nstopped; what was judged is kept", file=sys.stderr)
    finally:
        stopped.set()
        for worker in crew:
            worker.end()
    print(file=sys.stderr)


def rows_of(file: Path) -> dict[int, dict[str, Any]]:
    """Rows by seed; a line that was cut off is left out."""
    found: dict[int, dict[str, Any]] = {}
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else []:
        try:
            row = json.loads(line)
        except ValueError:
            continue
        found[row["seed"]] = row
    return found


def stored_rows() -> dict[int, dict[str, str]]:
    """Rows of tests/data/random_scenes.csv."""
    if not STORED.exists():
        return {}
    with STORED.open(encoding="utf-8", newline="") as stream:
        return {int(row["seed"]): row for row in csv.DictReader(stream)}


def write_references(rows: dict[int, dict[str, Any]]) -> None:
    """Actual errors by seed: of each part at each tenth of the run, and what its reference is in doubt by.

    What the file holds of other seeds stays; those that hung or ended as none may are left out.
    """
    from random_statements import REFERENCE_COLUMNS, reference_row

    ended = {seed: row for seed, row in rows.items() if not row["outcome"].startswith("BUG")}
    stored: dict[int, dict[str, Any]] = {**stored_rows()}
    stored |= {seed: reference_row(row) for seed, row in ended.items()}
    with STORED.open("w", encoding="utf-8", newline="") as stream:
        table = csv.DictWriter(stream, REFERENCE_COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(stored[seed] for seed in sorted(stored))


def command_cost(seed: int) -> float | None:
    """Time of `erls simulate` over that of `erls simulate --no-verdict`, less one; None of scenes that do not run."""
    from random_scenes import random_scene

    spent: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        scene = str(random_scene(seed).write(Path(folder)))
        for turn in range(4):  # the first one makes modal files and kernels
            for option in ("--verdict", "--no-verdict"):
                command = [sys.executable, "-c", _ERLS, "simulate", scene, option, "--json"]
                begun = time.perf_counter()
                try:
                    made = subprocess.run(command, capture_output=True, timeout=_LONGEST, check=False)
                except subprocess.TimeoutExpired:
                    return None
                if made.returncode:
                    return None
                if turn:
                    spent[option] = min(spent.get(option, np.inf), time.perf_counter() - begun)
    return spent["--verdict"] / spent["--no-verdict"] - 1


def print_command_costs(seeds: range) -> None:
    """One line a scene, and their percentiles."""
    found = []
    for seed in seeds:
        cost = command_cost(seed)
        print(f"  seed {seed}: " + ("does not run to its end" if cost is None else f"{cost:.0%}"), flush=True)
        found += [] if cost is None else [cost]
    middle, high = np.percentile(found, (50, 90))
    print(f"cost over the command of {len(found)} scenes: median {middle:.0%}, 90th percentile {high:.0%}")


def main() -> int:
    """Judge what is not judged yet, print the table; 1 where a run ended as none may."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0:2000", help="the first one, and the one behind the last")
    parser.add_argument("--json", type=Path, default=Path("random_scenes.jsonl"), help="file of the rows")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--parts", choices=("all", "integration", "statement"), default="all", help="which references")
    parser.add_argument("--again", action="store_true", help="also seeds that stand in the file")
    parser.add_argument("--references", type=Path, help="folder in which places of references are kept")
    parser.add_argument("--nodal-every", type=int, default=0, help="of so many scenes one is judged by beam elements")
    parser.add_argument("--nodal-budget", type=float, default=120.0, help="for each of these, in seconds")
    parser.add_argument("--hang", type=float, default=900.0, help="seconds without an answer")
    parser.add_argument("--write-references", action="store_true", help="write tests/data/random_scenes.csv")
    parser.add_argument("--only-table", action="store_true", help="of the rows that there are")
    parser.add_argument("--missing", action="store_true", help="seeds whose errors are not stored yet")
    parser.add_argument("--stored", action="store_true", help="what is stated now against stored errors")
    parser.add_argument("--commands", action="store_true", help="what the statement costs of erls simulate")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.serve:
        serve()
        return 0
    first, _, last = given.seeds.partition(":")
    seeds = range(int(first), int(last))
    if given.commands:
        print_command_costs(seeds)
        return 0
    from random_statements import print_table, row_of

    known = rows_of(given.json)
    by_beams = set(seeds[:: given.nodal_every]) if given.nodal_every else set()
    same = {"parts": given.parts, "kept": None if given.references is None else str(given.references)}
    stored = stored_rows()
    wanted = [k for k in seeds if (given.again or k not in known) and not (given.missing and k in stored)]
    if given.stored:
        wanted, same = [k for k in wanted if stored.get(k, {}).get("total")], {"parts": "none", "kept": None}
        known = {k: row_of(stored[k]) for k in wanted}
    tasks = [{"seed": k, **same, "nodal_s": given.nodal_budget if k in by_beams else 0.0} for k in wanted]
    if tasks and not given.only_table:
        judge_all(tasks, known, given.json, given.workers, given.hang)
    rows = {seed: row for seed, row in rows_of(given.json).items() if seed in seeds}
    if given.write_references:
        write_references(rows)
    return print_table([rows[seed] for seed in sorted(rows)], SUBJECTS)


if __name__ == "__main__":
    np.seterr(all="ignore")
    raise SystemExit(main())

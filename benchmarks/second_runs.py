"""How much a second run must cost to tell the error of the first: runs at 8, 64 and 512 times the tolerance.

    python benchmarks/second_runs.py [--seeds 444:900] [--times 8 64 512]

Random scenes (tests/erls/random_scenes.py) whose steps follow a tolerance, without points that touch and joints that
stick, for which `erls.accuracy.second_run` takes smaller tolerances; their actual errors of integration stand in
tests/data/random_scenes.csv. Prints, for each factor on the tolerance, evaluations of the second run in those of the
first (quartiles), the share of the distance between both that the first was off by (median, 90th percentile), the share
that would have to be stated to cover 98 %, and how much larger than the actual error that is then (median, 90th
percentile). Errors below 1e-7 m are left out.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), *(str(ROOT / "tests" / part) for part in ("", "erls"))]

FLOOR = 1e-7  # m
WORK = 0.2  # of the evaluations that a random scene may take
COVERED = 98  # percent


def measured(seed: int, actual: float, times: list[float]) -> list[tuple[float, float]]:
    """Of each factor on the tolerance, evaluations of the second run in those of the first, and the actual error over
    the distance; NaN where the second run fails, or takes the same steps. Nothing of scenes that it does not judge.
    """
    from random_references import limited_run
    from random_scenes import random_scene

    from erls.accuracy.judged_integration import CONSTRAINED
    from erls.accuracy.judged_places import judged_nodes
    from erls.accuracy.other_run import distance_from
    from erls.accuracy.second_run import LIKE, run_at
    from erls.equations.registry import system_of
    from erls.equations.substructures import solved
    from erls.scene.integrators import FIXED_STEP
    from erls.scene.read import load_chain

    with tempfile.TemporaryDirectory() as folder:
        run = limited_run(load_chain(random_scene(seed).write(Path(folder))), WORK)
        mechanism, settings = run.formulation.mechanism, run.scene.record.simulation
        if system_of(mechanism, settings) in CONSTRAINED or settings.integrator == FIXED_STEP:
            return []
        if mechanism.sticks or mechanism.touches:
            return []
        watched, formulation, found = judged_nodes(run), solved(run.formulation), []
        for factor in times:
            other = run_at(run, factor)
            if other is None or other.work.steps > LIKE * run.solution.work.steps:
                found.append((np.nan, np.nan))
                continue
            apart = float(distance_from(run, watched, formulation, other)[1][-1])
            found.append((other.work.rhs_calls / run.solution.work.rhs_calls, actual / max(apart, 1e-12)))
    return found


def main() -> int:
    """Print the table."""
    from fe_import.errors import ReportedError

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="444:900", help="the first one, and the one behind the last")
    parser.add_argument("--times", type=float, nargs="+", default=[8.0, 64.0, 512.0], help="the tolerance")
    given = parser.parse_args()
    first, _, last = given.seeds.partition(":")
    with (ROOT / "tests/data/random_scenes.csv").open(encoding="utf-8", newline="") as stream:
        rows = {int(row["seed"]): row["integration"].split() for row in csv.DictReader(stream)}
    found: dict[float, list[tuple[float, float]]] = defaultdict(list)
    for seed in range(int(first), int(last)):
        if not rows.get(seed) or float(rows[seed][-1]) <= FLOOR:
            continue
        try:
            for factor, pair in zip(given.times, measured(seed, float(rows[seed][-1]), given.times), strict=False):
                found[factor].append(pair)
        except ReportedError as problem:
            print(f"  seed {seed}: {problem.cause}", file=sys.stderr)
    for factor, pairs in found.items():
        known = np.array([pair for pair in pairs if np.isfinite(pair).all()])
        if not len(known):
            print(f"{factor:5g} times the tolerance: none of {len(pairs)} runs tells anything")
            continue
        cost, share = known.T
        stated = np.percentile(share, COVERED)
        middle, high = np.percentile(share, (50, 90))
        over, far = np.percentile(stated / share, (50, 90))
        quarters = ", ".join(f"{value:.2f}" for value in np.percentile(cost, (25, 50, 75)))
        print(
            f"{factor:5g} times the tolerance: {len(known)} of {len(pairs)} runs, evaluations {quarters}; "
            f"off by {middle:.2g} (90th percentile {high:.2g}) of the distance; "
            f"{COVERED} % covered by {stated:.2g} of it, {over:.2g} times the error (90th percentile {far:.2g})"
        )
    return 0


if __name__ == "__main__":
    np.seterr(all="ignore")
    raise SystemExit(main())

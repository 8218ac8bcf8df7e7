"""What a sweep costs beside the integrations that it makes: variants of the flat steel L, 12 modes, 2 s.

    python benchmarks/sweep.py [POINTS] [--sections] [--get QUANTITY ...] [--workers N]

Load at the tip and initial angle are varied; with ``--sections`` the thickness of the legs, 40 values each of which
many angles share, so that links are reduced once for each. Compared are

- *the sweep*: ``erls study sweep`` from nothing to its closed store, started workers and their end included; and
- *the integrations*: the same variants one by one in this process, warm, with the links of the one before. Of each only
  the integrator counts, with the watches that see its steps: from its first step to its last one, no reading, packing,
  judging nor numbers of runs. 100 of them, evenly spread, stand for all (all where there are fewer).

Wall time is compared with the sum of wall times of the integrations (two cores: at most 0.55 is asked), CPU time of all
processes with the sum of CPU times of the integrations (at most 1.1 is asked). Beside other work on the same cores only
the second says something. Memory is the largest resident set of this process and of one worker.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import erls
from erls.parallel.workers import IDLE
from erls.run.record import Run
from erls.simulation import chains
from erls.studies.sweep.evaluate import Task, run_point
from erls.studies.sweep.points import Grid
from fe_import.solver.threads import one_thread_each

SCENE = Path(__file__).parents[1] / "data/l_shape/steel_flat.toml"
COMMON = (
    "simulation.duration=2.0",
    "links.l.elastic_modes=12",
    'loads=[{point="tip", force=[0.0, 0.0, -0.1]}]',
)
ANGLE, LOAD = "joints.shoulder.initial.position_deg", "loads.0.force"
HEIGHT = "links.l.model.sections.leg.height"
ALONE = 100


def grid(count: int, sections: bool) -> Grid:
    """About so many points, the square root of them for either key."""
    side = max(1, round(np.sqrt(count)))
    if sections:
        heights = np.linspace(0.009, 0.011, min(40, side))
        return Grid({HEIGHT: tuple(heights.tolist()), ANGLE: spread(30.0, -(-count // len(heights)))})
    loads = tuple([0.0, 0.0, -float(push)] for push in 0.1 + np.array(spread(2.0, side)))
    return Grid({LOAD: loads, ANGLE: spread(30.0, -(-count // side))})


def spread(most: float, count: int) -> tuple[float, ...]:
    """From 0 on."""
    return tuple(np.linspace(0.0, most, count).tolist())


class Clocked:
    """Wall and CPU time within integrators [s]."""

    def __init__(self) -> None:
        self.wall = self.cpu = 0.0
        self._integrator = chains.integrator

    def __call__(self, *asked: Any) -> Any:
        integrate = self._integrator(*asked)

        def integrated(*given: Any) -> Any:
            wall, cpu = time.perf_counter(), time.process_time()
            try:
                return integrate(*given)
            finally:
                self.wall += time.perf_counter() - wall
                self.cpu += time.process_time() - cpu

        return integrated


def alone(points: Grid, get: tuple[str, ...]) -> tuple[float, float]:
    """Wall and CPU time of the integrations of all points [s]."""
    task = Task(SCENE, COMMON, points.keys, [], get, False)
    some = np.unique(np.linspace(0, len(points) - 1, ALONE).astype(int)).tolist()
    for number in some[:2]:  # reads, reduces, compiles
        assert isinstance(found := run_point(task, number, points.row(number)), Run), found
    clock = Clocked()
    chains.integrator = clock  # type: ignore[assignment]
    try:
        with one_thread_each():  # as in workers: threads that wait for work count as processor time
            for number in some:
                assert isinstance(run_point(task, number, points.row(number)), Run)
    finally:
        chains.integrator = clock._integrator
    return clock.wall * len(points) / len(some), clock.cpu * len(points) / len(some)


def cpu_s() -> float:
    """Of this process and of its children that have ended [s]."""
    took = os.times()
    return took.user + took.system + took.children_user + took.children_system


def memory_mb(who: int) -> float:
    """Largest resident set."""
    return resource.getrusage(who).ru_maxrss / (1024 if sys.platform != "darwin" else 1024**2)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser()
    parser.add_argument("points", type=int, nargs="?", default=100)
    parser.add_argument("--sections", action="store_true")
    parser.add_argument("--get", nargs="+", default=["tip.z@end"])
    parser.add_argument("--workers", type=int)
    asked = parser.parse_args()
    points, get = grid(asked.points, asked.sections), tuple(asked.get)
    wall_alone, cpu_alone = alone(points, get)
    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder) / "r.sweep"
        wall, cpu = time.perf_counter(), cpu_s()
        found = erls.sweep(SCENE, points, get, overrides=COMMON, store=store, workers=asked.workers)
        wall = time.perf_counter() - wall
        IDLE.dismiss()  # their time counts once they have ended
        cpu, size = cpu_s() - cpu, store.stat().st_size
    assert not found.failed
    n = len(points)
    print(f"{n} points over {' and '.join(points.keys)}; {', '.join(get)}; {os.cpu_count()} cores")
    print(f"integrations alone: {1e3 * wall_alone / n:.2f} ms wall, {1e3 * cpu_alone / n:.2f} ms CPU a point")
    print(f"sweep:              {1e3 * wall / n:.2f} ms wall, {1e3 * cpu / n:.2f} ms CPU a point")
    print(f"ratios:             {wall / wall_alone:.2f} wall, {cpu / cpu_alone:.2f} CPU")
    here, there = memory_mb(resource.RUSAGE_SELF), memory_mb(resource.RUSAGE_CHILDREN)
    print(f"memory: {here:.0f} MB here, {there:.0f} MB in a worker; store {size / n:.0f} bytes a point")


if __name__ == "__main__":
    main()

"""A sweep by whoever may compute it: the same numbers, bit for bit, also where a worker is killed on the way.

    python benchmarks/executors.py [POINTS]

Angles and tolerances of the tall steel L over 0.2 s, by the crew of this program with two workers; by processes of
``concurrent.futures``; by loky, joblib's; and by a Dask scheduler of its own process with two worker processes on
loopback, of which one is killed when a quarter of the points is there. Each is compared with one process alone.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

import erls
from erls.studies.sweep.executors import dask_client

SCENE = Path(__file__).parents[1] / "data/l_shape/steel_tall.toml"
ANGLE, TOLERANCE = "joints.shoulder.initial.position_deg", "simulation.tolerance"
GET = ("tip.x@end", "max(tip.distance)", "energy.total@end")
ADDRESS = "tcp://127.0.0.1:18786"


def grid(count: int) -> dict[str, tuple[float, ...]]:
    """About so many points."""
    return {ANGLE: tuple(np.linspace(0.0, 30.0, max(1, count // 2)).tolist()), TOLERANCE: (1e-3, 1e-4)}


def swept(points: dict[str, tuple[float, ...]], **more: Any) -> erls.Sweep:
    """The sweep."""
    return erls.sweep(SCENE, points, GET, overrides=("simulation.duration=0.2",), **more)


@contextmanager
def started(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    """A Dask process, ended in the end."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen([sys.executable, "-m", "distributed.cli.dask_" + words[0], *words[1:]], **quiet)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def by_dask(points: dict[str, tuple[float, ...]]) -> erls.Sweep:
    """By two workers, of which one is killed."""
    worker = ("worker", ADDRESS, "--nthreads", "1", "--no-nanny", "--no-dashboard")
    scheduler = ("scheduler", "--host", "127.0.0.1", "--port", ADDRESS.rpartition(":")[2], "--no-dashboard")
    with started(*scheduler):
        time.sleep(3.0)
        with started(*worker) as victim, started(*worker), dask_client(ADDRESS) as client:
            client.wait_for_workers(2, timeout=60)
            killed = []

            def tell(done: float, total: float) -> None:
                if done >= total / 4 and not killed:
                    os.kill(victim.pid, signal.SIGKILL)
                    killed.append(done)

            found = swept(points, executor=client, progress=tell)
            print(f"dask: a worker was killed after {killed[0]:.0f} of {found.points} points; {found.wall_s:.1f} s")
            return found


def main() -> None:
    """Compare them."""
    points = grid(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
    alone = swept(points, workers=1)
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        found = {"concurrent.futures": swept(points, executor=pool)}
    found["crew"] = swept(points, workers=2)
    from joblib.externals.loky import get_reusable_executor

    found["loky (joblib)"] = swept(points, executor=get_reusable_executor(2))
    found["dask"] = by_dask(points)
    for name, each in found.items():
        same = each.ran == len(each.rows) == alone.points and not each.failed and (each.numbers == alone.numbers).all()
        print(f"{name}: {len(each.rows)} of {alone.points} points, {'equal' if same else 'NOT EQUAL'}")


if __name__ == "__main__":
    main()

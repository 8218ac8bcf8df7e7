"""Nodal solver beside exudyn, in one process, on one thread: cost per step and error on the same steps and meshes.

    pip install '.[benchmarks]'
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/nodal.py [--elements 8 16 32] [--repeat 3]

The heavy top (Lie-group generalized-α, ρ∞ = 0.8, 2 s) and the L pendulum of geometrically exact beams on SE(3) (2 s at
1 ms; exudyn with modified Newton and its tolerance of 1e-6, its best setting). Times are the least processor times of
several runs, all preparation from a built system on included, compilation not. Acceptance: at least as fast as exudyn
at equal error; aim: three times; cost linear in the number of elements.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "erls"))

import heavy_top  # the systems of the tests
import test_nodal_dynamics as l_shape

from erls.integrate.base import hermite
from erls.integrate.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha


def least(repeat: int, run: Callable[[], tuple[Any, float]]) -> tuple[Any, float]:
    """Result and least time of several runs."""
    found = [run() for _ in range(repeat)]
    return found[0][0], min(spent for _, spent in found)


def timed(run: Callable[[], ConstrainedSolution]) -> tuple[ConstrainedSolution, float]:
    """Solution and processor time."""
    begun = time.process_time()
    found = run()
    return found, time.process_time() - begun


def tops(steps: list[float], repeat: int, exudyn: Any) -> None:
    """Largest error of the fast top over 2 s, and microseconds per step."""
    print("heavy top      step [s]   error [m]   µs/step")
    exact, alike = heavy_top.reference(), (np.inf, np.inf)
    for step in steps:
        for group in heavy_top.GROUPS:
            options = ConstrainedOptions(step=step)
            found, spent = least(repeat, partial(timed, partial(heavy_top.spin, group, 2.0, options)))
            cost = 1e6 * spent / found.work.steps
            print(f"{group:12s}  {step:.2e}  {heavy_top.errors(found)[0]:.3e}  {cost:8.2f}", flush=True)
        if exudyn is None:
            continue
        for name, modified in (("full", False), ("modified", True)):
            run = partial(exudyn.heavy_top, heavy_top.SPINS["fast"], heavy_top.ARM, 2.0, step, modified)
            try:
                rows, spent = least(repeat, run)
            except exudyn.FAILURE:
                print(f"exudyn {name:8s} {step:.2e}  does not converge", flush=True)
                continue
            near = np.searchsorted(rows[:, 0], exact["t"] - 1e-9).clip(max=len(rows) - 1)
            met = np.abs(rows[near, 0] - exact["t"]) < 1e-9
            error = np.linalg.norm(rows[near[met], 1:4] - exact["fast_x"][met], axis=1).max()
            print(f"exudyn {name:8s} {step:.2e}  {error:.3e}  {1e6 * spent * step / 2.0:8.2f}", flush=True)
            alike = min(alike, (spent, error), key=lambda x: x[0])
    if exudyn is not None and alike[0] < np.inf:
        _equal_error(repeat, *alike)


def _equal_error(repeat: int, spent: float, error: float) -> None:
    """R³×SO(3) with the step that gives exudyn's error, from 1.07 mm at 0.25 ms with second order."""
    step = 2.5e-4 * np.sqrt(error / 1.071e-3)
    options = ConstrainedOptions(step=step, start_from="last", newton_tolerance=1e-9)
    found, own = least(repeat, partial(timed, partial(heavy_top.spin, "R³×SO(3)", 2.0, options)))
    print(
        f"R³×SO(3)      {step:.2e}  {heavy_top.errors(found)[0]:.3e}  {1e6 * own / found.work.steps:8.2f}   "
        f"2 s in {1e3 * own:.1f} ms, exudyn at that error {1e3 * spent:.1f} ms: {spent / own:.1f} times",
        flush=True,
    )


def pendulums(elements: list[int], repeat: int, exudyn: Any) -> None:
    """Distance of the tip from the reference over 2 s, and milliseconds per step."""
    print("L pendulum     elements per leg   distance [m]   ms/step   iterations   factorizations")
    for count in elements:
        system = l_shape._l_shape(count)
        options = ConstrainedOptions(step=1e-3, newton_tolerance=1e-13, start_from="last")
        rest = np.zeros(system.size)
        run = partial(lie_generalized_alpha, system, (0, 2.0), system.start, rest, options)
        found, spent = least(repeat, partial(timed, run))
        work = found.work
        cost = 1e3 * spent / work.steps
        print(
            f"erls           {count:16d}   {l_shape._distance(found):.3e}   {cost:10.3f}   "
            f"{work.newton_iterations / work.steps:10.2f}   {work.factorizations}",
            flush=True,
        )
        if exudyn is None:
            continue
        rows, spent = least(repeat, partial(exudyn.l_pendulum, count, 2.0, 1e-3, 1e-6))
        other = 1e3 * spent / 2000
        print(
            f"exudyn         {count:16d}   {_tip_distance(rows):.3e}   {other:10.3f}   {other / cost:.1f} times",
            flush=True,
        )


def _tip_distance(rows: np.ndarray) -> float:
    text = l_shape.DATA.read_text(encoding="utf-8")
    names = [x for x in text.splitlines() if x.startswith("#")][-1].lstrip("# ").split(",")
    table = dict(zip(names, np.loadtxt(l_shape.DATA, delimiter=",").T, strict=True))
    exact = np.stack([table[f"steel_tall_{axis}"] for axis in "xyz"], axis=1)
    v = np.gradient(rows[:, 1:4], rows[:, 0], axis=0)
    places, _ = hermite(rows[:, 0], rows[:, 1:4], v, np.gradient(v, rows[:, 0], axis=0), table["t"])
    return float(np.linalg.norm(places - exact, axis=1).max())


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--elements", type=int, nargs="+", default=[8, 16, 32], help="of each leg of the L")
    parser.add_argument("--steps", type=float, nargs="+", default=[1e-3, 5e-4, 2.5e-4], help="of the heavy top [s]")
    parser.add_argument("--repeat", type=int, default=3)
    given = parser.parse_args()
    try:
        import exudyn_beams as exudyn
    except ImportError:
        exudyn = None
        print("exudyn is not installed (pip install 'erls[benchmarks]'): this program alone")
    heavy_top.spin("SE(3)", 0.01, ConstrainedOptions(step=1e-3))  # compiles or loads the kernels
    tops(given.steps, given.repeat, exudyn)
    pendulums(given.elements, given.repeat, exudyn)


if __name__ == "__main__":
    main()

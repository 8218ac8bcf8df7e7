"""Nodal solver beside exudyn, in one process, on one thread: cost per step and error on the same steps and meshes.

    pip install '.[benchmarks]'
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/nodal.py [--elements 8 16 32] [--repeat 3]

The heavy top (Lie-group generalized-α, ρ∞ = 0.8, 2 s) and the L pendulum of geometrically exact beams on SE(3) (2 s at
1 ms; exudyn with modified Newton and its tolerance of 1e-6, its best setting). Times are the least processor times of
several runs, all preparation from a built system on included, compilation not. Acceptance: at least as fast as exudyn
at equal error; aim: three times; cost linear in the number of elements.

With `--shells` instead strips and square plates on a hinge, links of shells, 50 steps of 1 ms beside beams along the
strip: velocities, cost per step and velocity, the time of derivatives, and of one factorization in a band, in fronts
and by SuperLU, with the numbers that each holds.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "fe_import"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "erls"))

import heavy_top  # the systems of the tests
import test_nodal_dynamics as l_shape
import test_shell_chains as shell_chains
from link_files import write_toml
from shell_meshes import shell_grid

from erls.equations.nodal import assembly, elimination
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.blocks import blocks
from erls.equations.nodal.equations import Nodal
from erls.equations.nodal.matrix import factor
from erls.equations.nodal.nodes import numbers_of
from erls.integrate.base import hermite
from erls.integrate.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.maths.so3 import Array
from erls.scene.build import build_mechanism
from erls.scene.read import load_chain


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


def shells(repeat: int) -> None:
    """Cost of links of shells and of beams, and what a band of their matrices takes beside fronts and SuperLU."""
    heads = f"{'velocities':>11}{'ms/step':>9}{'µs/step/vel.':>14}{'factored':>10}{'takes':>8}{'derivatives ms':>16}"
    kinds = "".join(f"{f'{name} MB':>9}{f'{name} ms':>9}" for name in ("", "f.", "SLU"))
    print(f"{'link':<16}{heads}{'band':>6}{kinds}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for elements in (16, 64):
            section = {"shape": "rectangular", "width": 0.06, "height": 0.003}
            frame = {
                "nodes": {"root": [0, 0, 0], "tip": [0.6, 0, 0]},
                "members": [{"from": "root", "to": "tip", "section": "s", "material": "m", "elements": elements}],
            }
            ends = [{"name": end, "node": end} for end in ("root", "tip")]
            write_toml(folder / "link.toml", {"materials": {"m": shell_chains.ALU}, "sections": {"s": section},
                                              "frame": frame, "interfaces": ends})  # fmt: skip
            _cost(f"{elements} beams", folder, repeat)
        for across, *counts in ((0.06, (8, 2), (16, 4), (32, 8)), (0.6, (8, 8), (16, 16), (24, 24))):
            for nx, ny in counts:
                place = partial(_place, across)
                shell_chains.described(folder, shell_grid(nx, ny, place, "quad4"))
                _cost(f"{'strip' if across < 0.1 else 'plate'}, {nx} x {ny}", folder, repeat)


def _place(across: float, a: float, b: float) -> tuple[float, float, float]:
    return 0.6 * a, across * (b - 0.5), 0.0


def _cost(name: str, folder: Path, repeat: int) -> None:
    """A row of `shells`."""
    scene = load_chain(shell_chains.arm(folder, "nodal"))
    mechanism = build_mechanism(scene).mechanism
    system = Nodal(mechanism).system
    rest, step = np.zeros(system.size), 1e-3
    options = ConstrainedOptions(step=step)
    found, spent = least(repeat, partial(timed, partial(lie_generalized_alpha, system, (0, 0.05), system.start, rest,
                                                        options)))  # fmt: skip
    mass = system.mass_matrix(0.0, system.start)
    multipliers = np.zeros(system.constraints)
    stiffness, _ = system.stiffness_and_damping(0.0, system.start, rest, rest, multipliers)
    rows = sp.coo_array(system.constraint_matrix(0.0, system.start))
    whole = sp.block_array([[mass + 0.3 * step**2 * stiffness, rows.T], [rows, None]]).tocoo()
    cost = 1e3 * spent / found.work.steps
    print(f"{name:<16}{system.size:11d}{cost:9.3f}{1e3 * cost / system.size:14.2f}", end="")
    print(f"{found.work.factorizations / 50:10.2f}{'band' if system.elimination.width >= 0 else 'fronts':>8}", end="")
    chosen = assembly.elimination
    for way in (elimination.banded, elimination.fronted):
        assembly.elimination = lambda *given, way=way: way(*given[:3])
        own = Nodal(mechanism).system
        derivatives, factors = _factored(own, rest, 0.3 * step**2, 2 * repeat)
        stored = 8e-6 * (own.elimination.entries + own.elimination.stack)
        if own.elimination.width >= 0:
            print(f"{derivatives:16.1f}{own.elimination.width:6d}", end="")
        print(f"{stored:9.1f}{factors:9.1f}", end="")
    assembly.elimination = chosen
    begun = time.process_time()
    settings = {"SymmetricMode": True, "DiagPivotThresh": 0.01}
    sparse = sla.splu(whole.tocsc(), permc_spec="MMD_AT_PLUS_A", options=settings)
    print(f"{(sparse.L.nnz + sparse.U.nnz) * 12e-6:9.1f}{1e3 * (time.process_time() - begun):9.1f}", flush=True)


def _factored(system: NodalSystem, rest: Array, beta: float, repeat: int) -> tuple[float, float]:
    """Least milliseconds of processor time for derivatives, and for factors without them."""
    factors, memory = np.zeros(system.flat.factors), (system.flat.reals, system.flat.integers, system.flat.scratch)
    system.residual(0.0, system.start, rest, rest)
    start, times = numbers_of(system.start), np.zeros((repeat + 1, 2))
    for row in times:
        begun = time.process_time()
        blocks(*memory, 0)
        row[0] = time.process_time() - begun
        factor(*memory, 0.0, start, rest, 0.0, beta, factors)
        row[1] = time.process_time() - begun - row[0]
    derivatives, both = 1e3 * times.min(axis=0)
    return derivatives, both - derivatives


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
    parser.add_argument("--shells", action="store_true", help="cost of links of shells, and their bands")
    given = parser.parse_args()
    if given.shells:
        shells(given.repeat)
        return
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

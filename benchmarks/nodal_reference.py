"""Nodal formulation: distance to trajectories of geometrically exact beams made with a public package (tests/data).

    python benchmarks/nodal_reference.py [--elements 16 32 64] [--step 2.5e-4] [--extrapolate]

Prints, for the L pendulums over 2 s and the two-link robot over 1.5 s, the largest distance of the reported points from
the reference with each number of elements in a member, and what the run cost; with --extrapolate also Richardson's
extrapolation of the last two meshes. The references are extrapolated over mesh and step, accurate to 1e-6 m (tall),
3e-6 m (flat), 1e-5 m (aluminium), 2e-5 m (robot). Acceptance, with 64 elements: 3e-5 m tall and flat, 5e-5 m aluminium,
6e-5 m robot. Errors of mesh and step have opposite signs: with 16 elements the robot comes nearer at 5e-4 s (7e-5 m)
than at 2.5e-4 s (1e-4 m); with 32 it is 3e-5 m away.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from erls.scene.read import load_scene
from erls.simulation.simulate import simulate

ROOT = Path(__file__).parents[1]
CASES = (
    ("l_shape/steel_flat.toml", "l_shape_nonlinear_beam.csv", {"tip": "steel_flat"}, 3e-5),
    ("l_shape/steel_tall.toml", "l_shape_nonlinear_beam.csv", {"tip": "steel_tall"}, 3e-5),
    ("l_shape/aluminium.toml", "l_shape_nonlinear_beam.csv", {"tip": "aluminium"}, 5e-5),
    ("robot/two_link.toml", "two_link_nonlinear_beam.csv", {"end1": "end1", "end2": "end2"}, 6e-5),
)


def table(path: Path) -> dict[str, np.ndarray]:
    """Columns of a CSV file whose last comment line names them."""
    names = [line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("#")][-1]
    columns = np.loadtxt(path, delimiter=",").T
    return dict(zip(names.lstrip("# ").split(","), columns, strict=True))


def farthest(found: dict[str, np.ndarray], exact: dict[str, np.ndarray]) -> str:
    """Largest distance of each point [m]."""
    away = {p: np.linalg.norm(found[p] - exact[p], axis=1).max() for p in exact}
    return ", ".join(f"{point} {distance:.2e} m" for point, distance in away.items())


def judge(case: tuple[str, str, dict[str, str], float], meshes: list[int], step: float, extrapolate: bool) -> None:
    """Simulate one scene with all meshes, and print."""
    scene, reference, points, limit = case
    known = table(ROOT / "tests" / "data" / reference)
    paths: list[dict[str, np.ndarray]] = []
    for elements in meshes:
        changes = [
            'simulation.formulation="nodal"',
            f"simulation.elements_per_member={elements}",
            f"simulation.step={step}",
        ]
        begun = time.process_time()
        run = simulate(load_scene(ROOT / "data" / scene, changes), verdict=False)
        cost = time.process_time() - begun
        times = known["t"][known["t"] <= run.end + 1e-12]
        exact = {
            point: np.stack([known[f"{name}_{axis}"][: len(times)] for axis in "xyz"], axis=1)
            for point, name in points.items()
        }
        paths.append({point: run.position(point, times) for point in points})
        work = run.solution.work
        print(
            f"{scene:24s} {elements:3d} elements: {farthest(paths[-1], exact)} (limit {limit:.0e}); "
            f"{1e3 * cost / work.steps:.3f} ms per step, {work.newton_iterations / work.steps:.2f} iterations, "
            f"{work.factorizations} factorizations",
            flush=True,
        )
    if extrapolate and len(meshes) > 1:
        ratio = (meshes[-1] / meshes[-2]) ** 2
        both = {p: paths[-1][p] + (paths[-1][p] - paths[-2][p]) / (ratio - 1) for p in points}
        print(f"{scene:24s} extrapolated: {farthest(both, exact)} (limit {limit:.0e})")


def main() -> None:
    """Print all cases."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--elements", type=int, nargs="+", default=[16], help="of each member, rising")
    parser.add_argument("--step", type=float, default=2.5e-4, help="s")
    parser.add_argument("--extrapolate", action="store_true", help="from the last two meshes")
    given = parser.parse_args()
    for case in CASES:
        judge(case, given.elements, given.step, given.extrapolate)


if __name__ == "__main__":
    main()

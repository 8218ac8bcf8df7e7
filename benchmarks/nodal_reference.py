"""Nodal formulation: distance to trajectories of geometrically exact beams made with a public package (tests/data).

    python benchmarks/nodal_reference.py [ELEMENTS [STEP]]

Prints, for the L pendulums over 2 s and the two-link robot over 1.5 s, the largest distance of the reported points from
the reference with ELEMENTS (16) in each member and steps of STEP (5e-4) s, and what the run cost. The references are
extrapolated over mesh and step, accurate to 1e-6 m (tall), 3e-6 m (flat), 1e-5 m (aluminium), 2e-5 m (robot).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from erls.scene import load_scene
from erls.simulation import simulate

ROOT = Path(__file__).parents[1]
CASES = (
    ("l_shape/steel_flat.toml", "l_shape_nonlinear_beam.csv", {"tip": "steel_flat"}),
    ("l_shape/steel_tall.toml", "l_shape_nonlinear_beam.csv", {"tip": "steel_tall"}),
    ("l_shape/aluminium.toml", "l_shape_nonlinear_beam.csv", {"tip": "aluminium"}),
    ("robot/two_link.toml", "two_link_nonlinear_beam.csv", {"end1": "end1", "end2": "end2"}),
)


def table(path: Path) -> dict[str, np.ndarray]:
    """Columns of a CSV file whose last comment line names them."""
    names = [line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("#")][-1]
    columns = np.loadtxt(path, delimiter=",").T
    return dict(zip(names.lstrip("# ").split(","), columns, strict=True))


def main(elements: int, step: float) -> None:
    """Simulate and print."""
    for scene, reference, points in CASES:
        known = table(ROOT / "tests" / "data" / reference)
        changes = [
            'simulation.formulation="nodal"',
            f"simulation.elements_per_member={elements}",
            f"simulation.step={step}",
        ]
        run = simulate(load_scene(ROOT / "data" / scene, changes))
        times = known["t"][known["t"] <= run.end + 1e-12]
        apart = {}
        for point, name in points.items():
            exact = np.stack([known[f"{name}_{axis}"][: len(times)] for axis in "xyz"], axis=1)
            apart[point] = np.linalg.norm(run.position(point, times) - exact, axis=1).max()
        work = run.solution.work
        distances = ", ".join(f"{point} {distance:.2e} m" for point, distance in apart.items())
        print(
            f"{scene:26s} {distances}; {1e3 * run.wall_s / work.steps:.2f} ms per step, "
            f"{work.newton_iterations / work.steps:.2f} iterations, {work.factorizations} factorizations"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 16, float(sys.argv[2]) if len(sys.argv) > 2 else 5e-4)

"""Beck's column: the follower force at which a cantilever flutters, by every formulation, and in time.

    python benchmarks/follower_flutter.py

Roots are those of the equations linearized about the loaded column at rest: of M ẍ + K x with K by differences of the
forces out of balance, on the coordinates that joints leave free. They are imaginary up to the load at which two of them
meet, 20.05 E I / L² (M. Beck, Z. Angew. Math. Phys. 3 (1952) 225-228). Motions start with a short push from the side;
told is by what factor they are larger in the last fifth of the run than in the second.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg as la

import erls
from erls.equations.registry import formulate
from erls.scene.build import build_mechanism

ROOT = Path(__file__).parents[1]
SCENE = ROOT / "data/beck/column.toml"
BENDING = 7e10 * 0.02 * 0.01**3 / 12  # N m², length 1 m
BECK = 20.0509  # E I / L²
CASES: dict[str, tuple[str, ...]] = {
    "erls": (),
    "ffr": ("simulation.formulation=ffr",),
    "nodal": ("simulation.formulation=nodal", "simulation.elements_per_member=24"),
}
_FAINT = "loads.1.force=[0.0, 0.0, 1e-5]"  # a push of which flutter makes no large deflection in the run
_STEP = 1e-6  # m, of differences
_REAL = 1e-3  # share of a root's size that counts as a real part


def loaded(load: float, *changes: str) -> list[str]:
    """Overrides of the scene with a follower force of so many E I / L²."""
    return [f"loads.0.force=[{-load * BENDING!r}, 0.0, 0.0]", *changes]


def linearized(load: float, *changes: str) -> np.ndarray:
    """Squares of the roots under a load, by size."""
    scene = erls.load_scene(SCENE, loaded(load, *changes))
    equations: Any = formulate(build_mechanism(scene).mechanism, scene.record.simulation)
    y, v = equations.initial_state()
    mass, stiffness = _of_nodes(equations, y, v) if hasattr(equations, "chain") else _of_modes(equations, y)
    squares = -la.eigvals(stiffness, mass)
    return squares[np.argsort(np.abs(squares))]


def _of_modes(equations: Any, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """M and K in independent coordinates."""
    zero, stiffness = np.zeros(equations.size), np.empty((equations.size,) * 2)
    for k, step in enumerate(_STEP / np.asarray(equations.length_scales)):
        moved = np.array([y, y])
        moved[:, k] += step, -step
        forces = [equations.residual(0.0, place, zero, zero) for place in moved]
        stiffness[:, k] = (forces[0] - forces[1]) / (2 * step)
    return equations.mass_matrix(0.0, y), stiffness


def _of_nodes(equations: Any, y: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same on what conditions of joints leave free; they are constant here."""
    system, (q, _) = equations.system, equations.configuration(y, v)
    zero, stiffness = np.zeros(system.size), np.empty((system.size,) * 2)
    for k, step in enumerate(_STEP / np.asarray(system.length_scales)):
        increments = np.zeros((2, system.size))
        increments[:, k] = step, -step
        forces = [system.residual(0.0, system.compose(q, change), zero, zero) for change in increments]
        stiffness[:, k] = (forces[0] - forces[1]) / (2 * step)
    free = la.null_space(_dense(system.constraint_matrix(0.0, q)))
    return free.T @ _dense(system.mass_matrix(0.0, q)) @ free, free.T @ stiffness @ free


def _dense(matrix: Any) -> np.ndarray:
    return np.asarray(matrix.todense() if hasattr(matrix, "todense") else matrix)


def flutters(squares: np.ndarray) -> bool:
    """Whether the lowest roots, given by their squares, have left the imaginary axis."""
    lowest = np.sqrt(squares[:4].astype(complex))
    return bool((np.abs(lowest.real) > _REAL * np.abs(lowest)).any())


def critical(*changes: str, low: float = 18.0, high: float = 22.0, bisections: int = 12) -> float:
    """Load in E I / L² at which the roots meet."""
    for _ in range(bisections):
        middle = (low + high) / 2
        low, high = (low, middle) if flutters(linearized(middle, *changes)) else (middle, high)
    return (low + high) / 2


def growth(load: float, *changes: str) -> float:
    """By what factor the sway of the tip is larger in the last fifth of a run than in the second."""
    scene = erls.load_scene(SCENE, loaded(load, "simulation.duration=0.25", "simulation.step=2.5e-4", _FAINT, *changes))
    run = erls.simulate(scene)
    sway = np.abs(run.position("tip", np.linspace(0.0, run.end, 1001))[:, 2])
    return float(sway[800:].max() / sway[200:400].max())


if __name__ == "__main__":
    print("formulation   load [E I / L²]   off        growth at 0.9   at 1.1")
    for name, changes in CASES.items():
        load = critical(*changes)
        factors = [growth(share * BECK, *changes) for share in (0.9, 1.1)]
        print(f"{name:12}  {load:.4f}           {load / BECK - 1:+.2%}     {factors[0]:.3g}           {factors[1]:.3g}")

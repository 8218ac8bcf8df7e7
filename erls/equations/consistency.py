"""Starts that fulfil the constraints: positions, velocities, accelerations and multipliers; redundant constraints."""

from __future__ import annotations

import numpy as np

from erls.equations.constrained_system import Configuration, ConstrainedSystem
from erls.equations.system import metre_scales
from erls.errors import Cause, SimulationError
from erls.maths.saddle import Matrix, Saddle, Scales, dense
from erls.maths.so3 import Array

_DEPENDENT = 1e-9  # of a row's size; rounding is far below, a loop that does not close far above
_POSITION_ITERATIONS = 20
_CLOSED = 1e-13  # of the size of the mechanism
_WORTH_TELLING = 1e-9  # metres, and of the fastest velocity


def redundant_constraints(rows: Array, scale: Array) -> list[int]:
    """Numbers of the rows of B (m, n), in metres per metre by ``scale`` (n,), that follow from those before them."""
    matrix = rows * scale
    kept = np.zeros((min(matrix.shape), matrix.shape[1]))
    count, found = 0, []
    for k, row in enumerate(matrix):
        rest = row.copy()
        for _ in range(2):  # once more against rounding
            rest -= kept[:count].T @ (kept[:count] @ rest)
        size = float(np.linalg.norm(rest))
        if size <= _DEPENDENT * float(np.linalg.norm(row)):
            found.append(k)
        else:
            kept[count] = rest / size
            count += 1
    return found


def refuse_redundant(system: ConstrainedSystem, t: float, q: Configuration) -> None:
    """Raise when constraints depend on each other.

    Raises
    ------
    SimulationError
        With cause REDUNDANT_CONSTRAINTS, naming them.
    """
    found = redundant_constraints(dense(system.constraint_matrix(t, q)), 1 / metre_scales(system))
    if found:
        names = [system.constraint_names[k] for k in found]
        raise SimulationError(
            Cause.REDUNDANT_CONSTRAINTS,
            f"{len(names)} constraints say nothing that others do not say: {'; '.join(names)}",
            value=len(names),
            limit=0,
            remedy="give one of the joints of the loop more freedom, or let a link of it be flexible",
        )


def consistent_position(system: ConstrainedSystem, t: float, q: Configuration) -> tuple[Configuration, float]:
    """Nearest configuration, in metres, with Φ = 0, and the largest displacement [m] that it takes.

    Raises
    ------
    SimulationError
        With cause INCONSISTENT_START when there is none nearby.
    """
    metres = metre_scales(system)
    weight = _diagonal(metres**2, system.constraint_matrix(t, q))
    moved, worst, left = np.zeros(system.size), 0, 0.0
    for _ in range(_POSITION_ITERATIONS):
        violation, rows = system.constraint(t, q), system.constraint_matrix(t, q)
        scales = Scales(metres, weight, rows)
        scaled = violation * scales.constraint
        left = float(np.abs(scaled).max(initial=0.0))
        if left <= _CLOSED * float(metres.max(initial=1.0)):
            return q, float(np.abs(moved * metres).max(initial=0.0))
        worst = int(np.abs(scaled).argmax())
        saddle = Saddle(weight, rows.T, rows, scales, 1.0)
        if saddle.singular is not None or not np.isfinite(left):
            break
        step, _ = saddle.unscaled(saddle.solve(saddle.scaled(np.zeros(system.size), -violation)))
        q, moved = system.compose(q, step), moved + step
    raise SimulationError(
        Cause.INCONSISTENT_START,
        f"no configuration near the start closes the joints; {system.constraint_names[worst]} stays open",
        where=f"t = {t:.9g} s",
        value=f"{left:.3g} m",
        limit=f"{_POSITION_ITERATIONS} iterations",
        remedy="check the dimensions of the loop and the initial joint coordinates",
    )


def consistent_velocity(system: ConstrainedSystem, t: float, q: Configuration, v: Array) -> Array:
    """(n,) velocity with B v + Φ_t = 0 that an impulse of the constraints makes of ``v``."""
    saddle = _masses(system, t, q)
    wrong = system.constraint_matrix(t, q) @ v + system.constraint_rate(t, q)
    change, _ = saddle.unscaled(saddle.solve(saddle.scaled(np.zeros(system.size), -wrong)))
    result: Array = v + change
    return result


def consistent_acceleration(system: ConstrainedSystem, t: float, q: Configuration, v: Array) -> tuple[Array, Array]:
    """Acceleration (n,) and multipliers (m,) from the equations of motion and Φ̈ = 0."""
    saddle = _masses(system, t, q)
    forces = -system.residual(t, q, v, np.zeros(system.size))
    return saddle.unscaled(saddle.solve(saddle.scaled(forces, -system.constraint_bias(t, q, v))))


def consistent_start(
    system: ConstrainedSystem, t: float, q: Configuration, v: Array, warnings: list[str]
) -> tuple[Configuration, Array]:
    """Configuration and velocity that fulfil the constraints; what had to change is added to ``warnings``."""
    q, shift = consistent_position(system, t, q)
    metres = metre_scales(system)
    if shift > _WORTH_TELLING:
        warnings.append(f"the start did not fulfil the constraints; it was moved by {shift:.3g} m")
    better = consistent_velocity(system, t, q, v)
    change = float(np.abs((better - v) * metres).max(initial=0.0))
    if change > _WORTH_TELLING * max(1.0, float(np.abs(v * metres).max(initial=0.0))):
        warnings.append(f"the initial velocities did not fulfil the constraints; they were changed by {change:.3g} m/s")
    return q, better


def _masses(system: ConstrainedSystem, t: float, q: Configuration) -> Saddle:
    rows, mass = system.constraint_matrix(t, q), system.mass_matrix(t, q)
    metres = metre_scales(system)
    saddle = Saddle(mass, rows.T, rows, Scales(metres, mass, rows), 1.0)
    if saddle.singular is not None:
        k = saddle.singular
        n = system.size
        what = f"coordinate {k} (counted from 0)" if k < n else f"the constraint {system.constraint_names[k - n]}"
        raise SimulationError(
            Cause.SINGULAR_MASS,
            f"no acceleration follows from the forces: {what} has neither mass nor a constraint of its own",
            remedy="give every moving part a mass and a moment of inertia, and remove redundant joints",
        )
    return saddle


def _diagonal(values: Array, like: Matrix) -> Matrix:
    if isinstance(like, np.ndarray):
        return np.diag(values)
    import scipy.sparse as sp

    return sp.csc_array(sp.diags_array(values))

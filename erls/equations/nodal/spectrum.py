"""Natural frequencies and buckling loads about an equilibrium.

At an equilibrium (q, λ) under the load parameter t, with the tangent K (joint forces included), the mass M and the
constraint matrix B, small motions obey M ẍ + K x + Bᵀ δλ = 0, B x = 0. Natural frequencies are those of K on the null
space of B. Loads that follow the mechanism make K unsymmetric there: eigenvalues may then be complex, which is
flutter, and is refused.

Buckling: along the path of equilibria K changes at the rate K' = dK/dt, so that (K + μ K') φ = 0 gives the load
parameters t + μ at which K becomes singular, as far as the path is straight. The path's direction follows from the
rate of the imbalance, and K' from differences along it, with steps of `_STEP` of the size of the mechanism.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy.sparse.linalg import LinearOperator, eigs

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.bordered import Point, load_rate
from erls.equations.nodal.statics import Equilibrium
from erls.equations.system import metre_scales
from erls.errors import Cause, SimulationError
from erls.maths.saddle import Matrix, Saddle, Scales, dense
from erls.maths.so3 import Array

DENSE_UP_TO = 300  # velocities
_STEP = 1e-5
_REAL = 1e-6  # imaginary over real part that rounding leaves
_NONE = 1e-12  # of the largest: an infinite eigenvalue


@dataclass(frozen=True)
class Modes:
    """Eigenvalues (k,) in rising order, and shapes (k, n): increments of the nodes, the largest displacement 1 m."""

    values: Array
    shapes: Array


def natural_frequencies(system: NodalSystem, at: Equilibrium, count: int = 6) -> Modes:
    """The lowest natural frequencies [Hz]; those of unstable modes are negative, for growth as exp(2π |f| t).

    Parameters
    ----------
    system : NodalSystem
        On SE(3).
    at : Equilibrium
    count : int
        At most; there are no more than freedoms with mass.

    Raises
    ------
    SimulationError
        NO_EQUILIBRIUM: follower loads make the equilibrium flutter, or nothing has mass.
    """
    stiffness, rows, _ = _linearized(system, at)
    mass = system.mass_matrix(at.t, at.q)
    found = _eigen(system, stiffness, mass, rows, count, at.t)
    omega = np.sqrt(np.abs(found.values)) * np.sign(found.values)
    return Modes(omega / (2 * np.pi), found.shapes)


def buckling_loads(system: NodalSystem, at: Equilibrium, count: int = 4) -> Modes:
    """The lowest load parameters above that of ``at`` at which the equilibrium becomes unstable.

    Parameters
    ----------
    system : NodalSystem
        On SE(3).
    at : Equilibrium
        Where the path is taken as straight; exact critical loads follow by moving it towards them.
    count : int
        At most.

    Raises
    ------
    SimulationError
        NO_EQUILIBRIUM: no load changes the stiffness, or follower loads make the equilibrium flutter.
    """
    stiffness, rows, saddle = _linearized(system, at)
    direction, multipliers = _path(system, at, saddle)
    reach = float(np.abs(direction * metre_scales(system)).max(initial=0.0))
    size = float(np.linalg.norm(np.ptp(system.start.poses[:, :3, 3], axis=0)))
    if reach == 0.0 or not np.isfinite(reach):
        raise _refused(at.t, "no load changes with the load parameter", "give the scene a load that does")
    step = _STEP * size / reach
    change: list[Matrix] = []
    for s in (-step, step):
        q = system.compose(at.q, s * direction)
        change.append(_stiffness(system, at.t + s, q, at.multipliers + s * multipliers))
    rate = (change[1] - change[0]) / (2 * step)
    found = _eigen(system, stiffness, -rate, rows, 2 * count + 4, at.t)  # some belong to loads the other way round
    ahead = found.values > 0
    return Modes(at.t + found.values[ahead][:count], found.shapes[ahead][:count])


def _linearized(system: NodalSystem, at: Equilibrium) -> tuple[Matrix, Matrix, Saddle]:
    """K, B, and both factored."""
    stiffness = _stiffness(system, at.t, at.q, at.multipliers)
    rows = system.constraint_matrix(at.t, at.q)
    saddle = Saddle(stiffness, rows.T, rows, Scales(metre_scales(system), abs(stiffness), rows), 1.0)
    if saddle.singular is not None:
        raise _refused(at.t, "the stiffness is singular: parts can move without force", "add supports, or a preload")
    return stiffness, rows, saddle


def _stiffness(system: NodalSystem, t: float, q: object, multipliers: Array) -> Matrix:
    rest = np.zeros(system.size)
    return system.stiffness_and_damping(t, q, rest, rest, multipliers)[0]  # type: ignore[arg-type]


def _path(system: NodalSystem, at: Equilibrium, saddle: Saddle) -> tuple[Array, Array]:
    """Increment (n,) and multipliers (m,) per unit of the load parameter."""
    force, gap = load_rate(system, Point(at.t, at.q, at.multipliers))
    move, change = saddle.unscaled(saddle.solve(saddle.scaled(force, gap)))
    return -move, -change


def _eigen(system: NodalSystem, stiffness: Matrix, other: Matrix, rows: Matrix, count: int, t: float) -> Modes:
    """Smallest eigenvalues of K x = λ G x on the null space of B."""
    if system.size <= DENSE_UP_TO:
        values, vectors = _dense_modes(dense(stiffness), dense(other), dense(rows))
    else:
        values, vectors = _sparse_modes(system, stiffness, other, rows, count)
    keep = np.argsort(np.abs(values))[:count]
    values, vectors = values[keep], vectors[:, keep]
    if not len(values):
        raise _refused(t, "nothing has mass, or no load changes the stiffness", "give materials a density, or loads")
    if np.abs(values.imag).max() > _REAL * np.abs(values).max():
        raise _refused(t, "loads that follow the mechanism make it flutter", "let the motion be computed in time")
    order = np.argsort(values.real)
    shapes = vectors.real.T[order]
    places = np.abs(shapes.reshape(len(shapes), -1, 6)[:, :, :3])
    return Modes(values.real[order], shapes / np.maximum(places.max(axis=(1, 2)), 1e-300)[:, None])


def _dense_modes(stiffness: Array, other: Array, rows: Array) -> tuple[Array, Array]:
    free = la.null_space(rows) if len(rows) else np.eye(len(stiffness))
    inverse = np.linalg.solve(free.T @ stiffness @ free, free.T @ other @ free)
    values, vectors = la.eig(inverse)
    finite = np.abs(values) > _NONE * np.abs(values).max(initial=0.0)
    return 1 / values[finite], free @ vectors[:, finite]


def _sparse_modes(
    system: NodalSystem, stiffness: Matrix, other: Matrix, rows: Matrix, count: int
) -> tuple[Array, Array]:
    saddle = Saddle(stiffness, rows.T, rows, Scales(metre_scales(system), abs(stiffness), rows), 1.0)
    n, none = system.size, np.zeros(rows.shape[0])

    def apply(x: Array) -> Array:
        return saddle.unscaled(saddle.solve(saddle.scaled(other @ x.ravel(), none)))[0]

    operator = LinearOperator((n, n), matvec=apply, dtype=float)
    start = apply(np.random.default_rng(0).standard_normal(n))
    values, vectors = eigs(operator, min(count, n - 2), v0=start)
    finite = np.abs(values) > _NONE * np.abs(values).max(initial=0.0)
    return 1 / values[finite], vectors[:, finite]


def _refused(t: float, message: str, remedy: str) -> SimulationError:
    return SimulationError(Cause.NO_EQUILIBRIUM, message, where=f"load parameter {t:.9g}", remedy=remedy)

"""Small motions about a state: M ẍ + D ẋ + K x = 0, and their roots, det(s² M + s D + K) = 0.

For forces out of balance R(t, y, v, a), which are M a - f, the tangents at a state are

    M = ∂R/∂a,    D = ∂R/∂v,    K = ∂R/∂y.

D holds damping C and what speeds do (G, gyroscopic and Coriolis forces), K all that forces change with the place:
elastic forces, weight, tension, centrifugal forces, controllers, loads that follow the mechanism. Neither need be
symmetric. Where conditions Φ(t, y) = 0 hold, with multipliers λ, K = ∂(R + Φ_yᵀ λ)/∂y, and x = N z goes the ways that
they leave, Φ_y N = 0. That is exact about equilibria; of a state that moves, tangents are those of the instant, and N
is taken as constant.

A system says R at many states at once, and its derivatives are central differences; functions that are compiled take no
complex steps, and those that would have to be compiled for each kind of scene. `derivatives` takes two states for each
coordinate, for iterations: an error of 1e-12 of what changes R over the size of the mechanism, and rounding of 1e-10 of
R over that size. `slopes` takes four, a thousand times farther apart: what is left is rounding, 1e-13 of R over the
size of the mechanism, and h⁴/30 of the fifth derivative, h = 1e-3 rad of a turn, 3e-14. Where R changes faster than
that, as friction does within its transition, steps shrink until two and four states agree.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la

from erls.maths.so3 import Array

Series = Callable[[Array], Array]
"""(k, m) forces of (k, n) states."""

STEP = 1e-6  # of the size of the mechanism, of differences
WIDE = 1e-3  # the same for `slopes`
_SHRINK, _SHRINKINGS = 1 / 16, 5  # of steps within which a function bends too much
_BENT = 1e-4  # of a slope: difference between that of two and of four states
_NOISE = 1e-13  # of a function over a step: differences that rounding makes
_ROUNDING = 1e-12  # of the largest root: real parts below are zero
_SYMMETRIC = 1e-7  # of a matrix of stiffness: less is rounding of differences


@dataclass(frozen=True)
class Linearization:
    """M z̈ + D ż + K z = 0 in f coordinates z, which move those of a system by x = N z.

    Attributes
    ----------
    mass, damping, stiffness : (f, f) arrays
    ways : (n, f) array
        N; the unit matrix where no conditions hold.
    """

    mass: Array
    damping: Array
    stiffness: Array
    ways: Array

    @property
    def size(self) -> int:
        """Number of coordinates z."""
        return len(self.mass)


def derivatives(forces: Series, at: Array, steps: Array) -> Array:
    """(m, n) derivatives of forces (m,) by coordinates (n,), by central differences.

    Parameters
    ----------
    forces : callable
        Of (k, n) states.
    at : (n,) array
    steps : (n,) array
        Of every coordinate.
    """
    n = len(at)
    if not n:
        return np.zeros((forces(at[None]).shape[1], 0))
    moved = np.tile(at, (2 * n, 1))
    numbers = np.arange(n)
    moved[numbers, numbers] += steps
    moved[n + numbers, numbers] -= steps
    taken = (moved[numbers, numbers] - moved[n + numbers, numbers])[:, None]  # what rounding leaves of two steps
    found = forces(moved)
    return np.asarray(((found[:n] - found[n:]) / taken).T)


def slopes(function: Series, directions: Array, steps: Array) -> Array:
    """(m, c) derivatives of a function (m,) along directions, at the place from which it is displaced.

    Parameters
    ----------
    function : callable
        Of (k, n) displacements.
    directions : (n, c) array
        Those of zeros are not evaluated.
    steps : (c,) array
        How far along each one.
    """
    moving = np.flatnonzero(np.abs(directions).max(axis=0, initial=0.0) > 0)
    if not len(moving):
        here = function(np.zeros((1, len(directions))))
        return np.zeros((here.shape[1], directions.shape[1]))
    best = _narrow(function, directions[:, moving], steps[moving])
    for k in range(1, _SHRINKINGS + 1):
        bent = np.flatnonzero(best.bend > _BENT * np.abs(best.slope).max(axis=0, initial=0.0) + best.noise)
        if not len(bent):
            break
        finer = _narrow(function, directions[:, moving[bent]], steps[moving[bent]] * _SHRINK**k)
        better = finer.bend < best.bend[bent]
        best.slope[:, bent[better]], best.bend[bent[better]] = finer.slope[:, better], finer.bend[better]
        best.noise[bent[better]] = finer.noise[better]
    result = np.zeros((len(best.slope), directions.shape[1]))
    result[:, moving] = best.slope
    return result


class _Slopes(NamedTuple):
    """Slopes (m, c), their largest distance (c,) from those of two states, and what rounding may make of that."""

    slope: Array
    bend: Array
    noise: Array


def _narrow(function: Series, directions: Array, steps: Array) -> _Slopes:
    count = directions.shape[1]
    moved = (directions * steps).T
    found = function(np.concatenate([moved, -moved, 2 * moved, -2 * moved])).reshape(4, count, -1)
    two = (found[0] - found[1]) / (2 * steps[:, None])
    slope = (4 * two - (found[2] - found[3]) / (4 * steps[:, None])) / 3
    bend = np.abs(slope - two).max(axis=1, initial=0.0)
    return _Slopes(slope.T, bend, _NOISE * np.abs(found).max(axis=(0, 2), initial=0.0) / steps)


def difference_steps(metres: Array, size: float, stiffness: Array, share: float = STEP) -> Array:
    """(n,) steps of differences, each of about the same displacement.

    Parameters
    ----------
    metres : (n,) array
        Displacement per unit of each coordinate [m].
    size : float
        Of the mechanism [m].
    stiffness : (n,) array
        Of each coordinate by itself, 0 where nothing holds it: one that moves no node (torsion of the last link) takes
        as much energy as the others.
    share : float
        Of the size.
    """
    steps = share * size / metres
    energies = stiffness * steps**2
    held = energies > 0
    if held.any():
        steps[held] *= np.sqrt(np.minimum(1.0, np.median(energies[held]) / energies[held]))
    return np.asarray(steps)


def ways_left(rows: Array, scales: Array) -> Array:
    """(n, f) ways N that conditions leave, B N = 0: orthonormal in coordinates x / ``scales``.

    Parameters
    ----------
    rows : (m, n) array
        B, its rows independent.
    scales : (n,) array
        Units of the coordinates.
    """
    if not len(rows):
        return np.diag(scales)
    scaled = rows * scales
    scaled = scaled / np.maximum(np.linalg.norm(scaled, axis=1), 1e-300)[:, None]
    q, _ = la.qr(scaled.T)
    return np.asarray(scales[:, None] * q[:, len(rows) :])


def roots(motions: Linearization) -> Array:
    """(2 f,) complex roots s of s² M + s D + K, the rightmost first, of several the slowest [1/s]: `small_modes`."""
    return _state_matrix(motions).sorted(np.linalg.eigvals)[0]


def small_modes(motions: Linearization) -> tuple[Array, Array]:
    """The same with their shapes, (f, 2 f).

    Coordinates are turned into modes of M and the symmetric part of K, and their places measured in units of their
    rates, so that stiff and soft ones do not spoil each other: a root of size |s| beside the largest ω is right to
    1e-14 ω, or to the square root of that share where two coincide. Ways without mass have no roots.

    Parameters
    ----------
    motions : Linearization
    """
    state = _state_matrix(motions)
    found, vectors = state.sorted(np.linalg.eig)
    return found, state.shapes @ vectors[: state.shapes.shape[1]]


class _State(NamedTuple):
    """Matrix (2 n, 2 n) of modal places in units of their rates, then of rates; and shapes (f, n) of these units."""

    matrix: Array
    shapes: Array

    def sorted(self, solve: Callable[[Array], Any]) -> tuple[Array, Array]:
        """Roots, and what ``solve`` finds beside them."""
        solved = solve(self.matrix)
        values, vectors = (solved, self.matrix) if isinstance(solved, np.ndarray) else solved
        found = values.astype(complex)
        found.real[np.abs(found.real) <= _ROUNDING * np.abs(found).max(initial=0.0)] = 0.0
        order = np.lexsort((-found.imag, np.abs(found.imag), -found.real))
        return found[order], vectors[:, order]


def _state_matrix(motions: Linearization) -> _State:
    modes = _modes(motions)
    stiffness, damping = (modes.T @ part @ modes for part in (motions.stiffness, motions.damping))
    n = len(stiffness)
    rates = np.sqrt(np.abs(np.diag(stiffness)))
    rates = np.maximum(rates, 1e-8 * rates.max()) if rates.any() else np.ones(n)
    return _State(np.block([[np.zeros((n, n)), np.diag(rates)], [-stiffness / rates, -damping]]), modes / rates)


def _modes(motions: Linearization) -> Array:
    """(f, k) shapes, orthonormal in M; without mass, shapes that follow the others are in them."""
    stiffness = (motions.stiffness + motions.stiffness.T) / 2
    try:
        return np.asarray(la.eigh(stiffness, motions.mass)[1])
    except la.LinAlgError:  # some ways have no mass
        masses, shapes = la.eigh(motions.mass)
        heavy, light = np.split(shapes, [int((masses <= 1e-14 * masses[-1]).sum())], axis=1)[::-1]
        follow = np.linalg.lstsq(light.T @ stiffness @ light, light.T @ stiffness @ heavy, rcond=None)[0]
        moving = heavy - light @ follow
        return np.asarray(moving @ la.eigh(moving.T @ stiffness @ moving, moving.T @ motions.mass @ moving)[1])


def stiffness_left(stiffness: Array, unloaded: Array) -> tuple[float, Array]:
    """What loads leave of a stiffness: the lowest κ of K φ = κ K₀ φ, and its shape φ (n,).

    κ is 1 without load, 0 where the equilibrium buckles, and 1 - P / P_c under a load P of which K depends linearly.
    Of a K that is not symmetric it is the lowest real part.

    Parameters
    ----------
    stiffness : (n, n) array
        K, under load.
    unloaded : (n, n) array
        K₀, symmetric and positive definite.
    """
    lower = la.cholesky(unloaded, lower=True)
    half = la.solve_triangular(lower, stiffness, lower=True)
    scaled = la.solve_triangular(lower, half.T, lower=True).T
    if np.abs(scaled - scaled.T).max(initial=0.0) <= _SYMMETRIC * np.abs(scaled).max(initial=0.0):
        values, shapes = la.eigh((scaled + scaled.T) / 2, subset_by_index=[0, 0])
    else:
        values, shapes = la.eig(scaled)
        values, shapes = values.real, shapes.real[:, [int(values.real.argmin())]]
    shape = la.solve_triangular(lower, shapes[:, 0], lower=True, trans="T")
    return float(values.min()), np.asarray(shape)

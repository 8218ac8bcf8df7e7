"""What vibrations make of what links leave out: they run out of step, and carry it along.

At some configurations, a mode ψ of the mechanism that was run, (K - ω² M) ψ = 0, bears the forces F = -ω² M_x ψ on what
it leaves out (with those of loops). These lower its frequency: r = -δ(ω²)/ω² = Gᵀ (K_xx - ω² M_xx)⁻¹ F / (ω² χᵀMψ),
where χ and G are those of the transposed stiffness, ψ and F themselves unless loads follow the links. A vibration of
amplitude a is after a time T out of phase by ½ r ω T, and then off by a |½ r ω T| or at most 2 a; one that damping
takes away runs out of step as long as it lasts. What is left out follows it by -(K_xx - ω² M_xx)⁻¹ F, and vibrates by
as much at frequencies of its own.

Loads that press links are part of K; what they do to what is left out is of second order, of which it has no data, and
taken to be to F as χᵀ K_p ψ, their part of the stiffness, to ω².

The amplitude is the least of ψᵀ K y / ω², ψᵀ K v / ω³ and ψᵀ K a / ω⁴, of the motion less its slow part: as modes turn
with the mechanism, quick vibrations spoil the accelerations of slow ones, and slow ones the places of quick ones.
Vibrations have nothing to do with each other, so that the squares of what they move points by add up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from erls.accuracy.compared_links import Compared
from erls.accuracy.configurations import SMALL_MOVE, Configuration
from erls.accuracy.slow_motion import Parted
from erls.maths.so3 import Array
from fe_import.model import IntArray

_RIGID = 1e-9  # of the largest ω²: a motion without stiffness
_CLOSE = 0.2  # of 1 - ω²/ω_x²: nearer to a mode left out, the change of frequency is not small
_UNLIKE = 1e-9  # of the largest entry: a stiffness that is not symmetric, frequencies that are complex
_DEPENDENT = 1e-9  # of the largest singular value: rows of loops that follow from others


def left_out_vibrations(
    compared: Compared, motion: Parted, places: Sequence[Configuration], duration: float
) -> tuple[Array, Array]:
    """(p,) what vibrations that run out of step move each point by, and what follows them [m].

    Parameters
    ----------
    compared : Compared
    motion : Parted
    places : sequence of Configuration
    duration : float
        Of the run [s].
    """
    points = len(compared.watched)
    off, largest, follows = np.zeros((0, points)), np.zeros((0, points)), np.zeros(points)
    for place in places:
        found = _vibrations(compared, motion, place)
        count = max(len(off), len(found.phase_rate))
        phase = found.phase_rate * np.minimum(duration / len(places), found.lasting)
        off = _padded(off, count) + _padded(phase[:, None] * found.moves, count)
        largest = np.maximum(_padded(largest, count), _padded(found.moves, count))
        follows = np.maximum(follows, np.sqrt((found.follows**2).sum(axis=0)))
    return np.sqrt((np.minimum(off, 2 * largest) ** 2).sum(axis=0)), follows


def _padded(values: Array, count: int) -> Array:
    """With zeros behind."""
    return np.concatenate([values, np.zeros((count - len(values), *values.shape[1:]))])


@dataclass(frozen=True)
class _Vibrations:
    """Modes of the mechanism at one configuration, in rising frequency.

    ``phase_rate`` (j,) by which each runs out of step [rad/s]; ``lasting`` (j,) time constant over e, until which a
    decaying vibration is off by most [s]; ``moves`` and ``follows`` (j, p): by how much each moves a point, and by how
    much what is left out does for it [m].
    """

    phase_rate: Array
    lasting: Array
    moves: Array
    follows: Array


def _vibrations(compared: Compared, motion: Parted, place: Configuration) -> _Vibrations:
    """Those of a stretch."""
    t, y, v, kept, rest = place.t, place.y, place.v, compared.kept, compared.rest
    mass, stiffness, rows, pressed = place.mass, place.stiffness, place.rows, place.pressed
    own = np.ix_(kept, kept)
    stiffness = stiffness if pressed is None else stiffness + pressed
    allowed = _allowed(rows[:, kept], np.diag(mass)[kept])
    values, modes, duals = _modes(allowed.T @ stiffness[own] @ allowed, allowed.T @ mass[own] @ allowed)
    elastic = values > _RIGID * values.max(initial=0.0)
    squares, modes, duals = values[elastic], allowed @ modes[:, elastic], allowed @ duals[:, elastic]
    omega = np.sqrt(squares)

    along = place.fields.T @ _forces(place, kept, rest, squares, modes, stiffness)
    against = along
    if pressed is not None:
        against = place.fields.T @ _forces(place, kept, rest, squares, duals, stiffness.T)
        more = 1 + np.abs(np.einsum("ij,ik,kj->j", duals, pressed[own], modes)) / squares
        along, against = more * along, more * against
    beyond = place.squares[:, None]
    apart = np.maximum(np.abs(beyond - squares), _CLOSE * np.maximum(beyond, squares))
    change, following = np.abs(against * along / apart).sum(axis=0) / squares, place.fields @ (along / apart)
    if not compared.exact:
        before = compared.lesser.mass_matrix(t, y[compared.run])
        differs = mass[own] - before[np.ix_(compared.own, compared.own)]
        change += np.abs(np.einsum("ij,ik,kj->j", duals, differs, modes))

    bent = stiffness[own].T @ duals
    kinds = [np.abs(part[place.stretch][:, compared.own] @ bent).max(axis=0) for part in motion.vibration]
    swing = np.min([kind / omega ** (2 + order) for order, kind in enumerate(kinds)], axis=0)
    every = np.zeros((2 * len(squares), compared.whole.size))
    every[: len(squares), kept], every[len(squares) :, rest] = modes.T, following.T
    step = SMALL_MOVE / np.maximum(np.abs(every).max(axis=1), np.finfo(float).tiny)
    shifted = np.concatenate([y[None], y + step[:, None] * every])
    found = compared.moves(np.full(len(shifted), t), shifted, np.repeat(v[None], len(shifted), axis=0))
    moves, follows = np.split(np.linalg.norm(found[1:] - found[0], axis=2) / step[:, None], 2)
    decay = np.abs(np.einsum("ij,ik,kj->j", duals, place.damping[own], modes)) / 2
    lasting = 1 / np.maximum(np.e * decay, np.finfo(float).tiny)
    return _Vibrations(0.5 * change * omega, lasting, swing[:, None] * moves, swing[:, None] * follows)


def _modes(stiffness: Array, mass: Array) -> tuple[Array, Array, Array]:
    """ω² in rising order, modes ψ and those χ of the transposed stiffness, χᵀ M ψ = 1; (d,), (d, d) twice.

    Loads that follow a link make both differ, the more the nearer two frequencies come to flutter; beyond it, where
    vibrations grow, both are those of the symmetric part.
    """
    if np.abs(stiffness - stiffness.T).max(initial=0.0) > _UNLIKE * np.abs(stiffness).max(initial=0.0):
        values, duals, modes = la.eig(stiffness, mass, left=True)
        if np.abs(values.imag).max(initial=0.0) <= _UNLIKE * np.abs(values).max(initial=0.0):
            order = np.argsort(values.real)
            modes, duals = modes.real[:, order], duals.real[:, order]
            return values.real[order], modes / np.einsum("ij,ik,kj->j", duals, mass, modes), duals
    values, modes = la.eigh((stiffness + stiffness.T) / 2, mass)
    return values, modes, modes


def _forces(
    place: Configuration, kept: IntArray, rest: IntArray, squares: Array, modes: Array, stiffness: Array
) -> Array:
    """(x, j) forces (K_xk - ω² M_xk) ψ of modes on what is left out, with those of loops."""
    mass, rows, own, other = place.mass, place.rows, np.ix_(kept, kept), np.ix_(rest, kept)
    forces = stiffness[other] @ modes - squares * (mass[other] @ modes)
    if len(rows):
        left = stiffness[own] @ modes - squares * (mass[own] @ modes)
        forces = forces + rows[:, rest].T @ np.linalg.lstsq(rows[:, kept].T, -left, rcond=_DEPENDENT)[0]
    return np.asarray(forces)


def _allowed(rows: Array, mass: Array) -> Array:
    """(k, d) directions in which the conditions of loops (m, k) allow to move."""
    if not len(rows):
        return np.eye(len(mass))
    size = 1 / np.sqrt(mass)
    _, values, right = la.svd(rows * size)
    return np.asarray(size[:, None] * right[np.count_nonzero(values > 1e-8 * values[0]) :].T)

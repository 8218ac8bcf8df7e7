"""Vibrations that run out of step, since links are softer than they were taken to be.

At some configurations, a mode ψ of the mechanism that was run, (K - ω² M) ψ = 0, bears the forces F = -ω² M_x ψ on what
it leaves out (with those of loops), which lower its frequency: r = -δ(ω²)/ω² = Fᵀ (K_xx - ω² M_xx)⁻¹ F / (ω² ψᵀMψ). A
vibration of amplitude a is after a time T out of phase by ½ r ω T, and then off by a |½ r ω T| or at most 2 a. Its
amplitude comes from the accelerations of the run, ψᵀ K a / ω⁴: rigid motion has no part in it, deflection that follows
slow loads next to none. Modes that damping takes away run out of step as long as they last.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from erls.accuracy.compared_links import Compared, Motion
from erls.maths.so3 import Array
from fe_import.model import IntArray

CONFIGURATIONS = 3  # at which modes of the mechanism are, if links turn against each other
_RIGID = 1e-9  # of the largest ω²: a motion without stiffness
_SMALL_MOVE = 1e-6  # m, of differences
_CLOSE = 0.2  # of 1 - ω²/ω_x²: nearer to a mode left out, the change of frequency is not small
_DEPENDENT = 1e-9  # of the largest singular value: rows of loops that follow from others


def out_of_step(compared: Compared, motion: Motion, duration: float) -> Array:
    """(p,) what vibrations that run out of step move each point by [m]."""
    turning = sum(link.elastic_modes > 0 for link in compared.whole.mechanism.links) > 1
    parts = CONFIGURATIONS if turning else 1
    result = np.zeros(len(compared.watched))
    phases = np.zeros(0)
    reach: Array = np.zeros((0, len(compared.watched)))
    for stretch in np.array_split(np.arange(len(motion.t)), parts):
        if not len(stretch):
            continue
        found = _vibrations(compared, motion, stretch)
        count = max(len(phases), len(found.phase_rate))
        lasting = np.minimum(duration / parts, found.lasting)
        phases = _padded(phases, count) + _padded(found.phase_rate * lasting, count)
        reach = np.maximum(_padded(reach, count), _padded(found.amplitude, count))
    result = (reach * np.minimum(2.0, phases)[:, None]).sum(axis=0)
    return np.asarray(result)


def _padded(values: Array, count: int) -> Array:
    """With zeros behind."""
    return np.concatenate([values, np.zeros((count - len(values), *values.shape[1:]))])


@dataclass(frozen=True)
class _Vibrations:
    """Modes of the mechanism at one configuration, in rising frequency.

    ``phase_rate`` (j,) by which each runs out of step [rad/s]; ``lasting`` (j,) time constant over e, until which a
    decaying vibration is off by most [s]; ``amplitude`` (j, p) of each point [m].
    """

    phase_rate: Array
    lasting: Array
    amplitude: Array


def _vibrations(compared: Compared, motion: Motion, stretch: IntArray) -> _Vibrations:
    """Those of a stretch of samples, from the one in its middle."""
    middle = int(stretch[len(stretch) // 2])
    t = float(motion.t[middle])
    y, v, _ = (row[middle] for row in motion.whole)
    kept, rest = compared.kept, compared.rest
    mass = compared.whole.mass_matrix(t, y) if compared.tied is None else compared.tied.masses(t, y)
    stiffness, damping = compared.whole.stiffness_and_damping(t, y, v)
    stiffness, damping = (stiffness + stiffness.T) / 2, (damping + damping.T) / 2
    own = np.ix_(kept, kept)
    rows = np.zeros((0, compared.whole.size))
    if compared.tied is not None:
        rows = compared.tied.closure(t, y, v).rows[:, compared.whole.free]
    allowed = _allowed(rows[:, kept], np.diag(mass)[kept])
    values, modes = la.eigh(allowed.T @ stiffness[own] @ allowed, allowed.T @ mass[own] @ allowed)
    elastic = values > _RIGID * values.max(initial=0.0)
    squares, modes = values[elastic], allowed @ modes[:, elastic]
    omega = np.sqrt(squares)

    forces = stiffness[np.ix_(rest, kept)] @ modes - squares * (mass[np.ix_(rest, kept)] @ modes)
    if len(rows):
        left = stiffness[own] @ modes - squares * (mass[own] @ modes)
        forces = forces + rows[:, rest].T @ np.linalg.lstsq(rows[:, kept].T, -left, rcond=_DEPENDENT)[0]
    block = np.ix_(rest, rest)
    change = np.zeros(len(squares))
    if len(rest):
        beyond, fields = la.eigh(stiffness[block], mass[block])
        near = np.maximum(1 - squares / beyond[:, None], _CLOSE) * beyond[:, None]
        change = ((fields.T @ forces) ** 2 / near).sum(axis=0) / squares
    if not compared.exact:
        finer, before = compared.whole.mass_matrix(t, y), compared.lesser.mass_matrix(t, y[compared.run])
        differs = finer[own] - before[np.ix_(compared.own, compared.own)]
        change += np.abs(np.einsum("ij,ik,kj->j", modes, differs, modes))

    turning = motion.whole[2][stretch][:, kept] - _references(compared, motion, stretch)
    swing = np.abs(turning @ stiffness[own] @ modes).max(axis=0) / squares**2
    step = _SMALL_MOVE / np.maximum(np.abs(modes).max(axis=0), np.finfo(float).tiny)
    shifted = np.repeat(y[None], 1 + len(squares), axis=0)
    shifted[1:, kept] += (step * modes).T
    places = compared.moves(np.full(len(shifted), t), shifted, np.repeat(v[None], len(shifted), axis=0))
    shapes = np.linalg.norm(places[1:] - places[0], axis=2) / step[:, None]
    decay = np.einsum("ij,ik,kj->j", modes, damping[own], modes) / 2
    lasting = 1 / np.maximum(np.e * decay, np.finfo(float).tiny)
    return _Vibrations(0.5 * change * omega, lasting, swing[:, None] * shapes)


def _allowed(rows: Array, mass: Array) -> Array:
    """(k, d) directions in which the conditions of loops (m, k) allow to move."""
    if not len(rows):
        return np.eye(len(mass))
    size = 1 / np.sqrt(mass)
    _, values, right = la.svd(rows * size)
    return np.asarray(size[:, None] * right[np.count_nonzero(values > 1e-8 * values[0]) :].T)


def _references(compared: Compared, motion: Motion, stretch: IntArray) -> Array:
    """(k, kept) accelerations that drives with controllers want of free joints."""
    result = np.zeros((len(stretch), len(compared.kept)))
    for place, joint in enumerate(compared.whole.free_joints):
        drive = compared.whole.mechanism.joints[joint].drive
        for row, t in enumerate(motion.t[stretch].tolist()):
            reference = drive.reference(t)
            if reference is not None:
                result[row, place] = reference[2]
    return result

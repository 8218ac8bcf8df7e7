"""What slow loads make of what links leave out: its static answer, and joints that drift for it.

The equations of the whole mechanism, at the slow part of the motion that was run and with nothing of what is left out,
leave forces D out of balance: on what is left out those that bend it, on the coordinates that were run what a finer
mesh makes of the inertia. The answer is K δ = -D, with the conditions of loops, where there are any.

The answer changes the forces on joints that are free to move by ΔR. Their error e grows as

    M ë + C ė + K e = -ΔR,

with links rigid: M is the inertia of the joints, C their dampers and controllers, K = ∂R/∂θ what springs, controllers,
weight and inertia make of e itself. It is followed by the trapezoidal rule from one stretch of time to the next.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg as la

from erls.accuracy.compared_links import Compared, Motion
from erls.accuracy.configurations import Configuration
from erls.maths.so3 import Array
from fe_import.model import IntArray

_DIFFERENCE = 1e-6  # rad or m
_PENALTY = 1e8  # of opened loops against stiffness
_DEPENDENT = 1e-9  # of the largest singular value: rows of loops that follow from others


def slow_answer(
    compared: Compared, motion: Motion, places: Sequence[Configuration], duration: float, start: Motion | None
) -> tuple[Array, Array]:
    """(p,) largest displacement of each point by the answer to slow loads, and by the drift of free joints [m].

    Loads that change make what is left out vibrate about the answer, by as much as it changed; all loads change at the
    start, but for those that deformed the links before.

    Parameters
    ----------
    compared : Compared
    motion : Motion
        The slow one.
    places : sequence of Configuration
    duration : float
        Of the run [s].
    start : Motion or None
        State at the start of a run whose links are deformed as they bear it at rest; None where they start undeformed.
    """
    forces, rows, before = _unbalanced(compared, motion)
    free, whole = compared.free, compared.whole
    stiffness = np.concatenate([link.stiffness for link in whole.mechanism.links])
    y, v, _ = motion.whole
    drift, answer = np.zeros_like(y), np.zeros_like(y)
    borne: Array = np.zeros((1, whole.size))
    if compared.tied is None:
        answer[:, free:] = -forces[:, free:] / stiffness
        if start is not None:
            borne[:, free:] = -_unbalanced(compared, start)[0][:, free:] / stiffness
        largest = 2 * answer - borne
        for at, place in _nearest(motion.t, places):
            block, steady = np.ix_(at, compared.rest), borne[:, compared.rest] @ _modal(place)
            along = -(forces[block] @ place.fields) / place.squares
            reached = 0.5 * place.squares * duration**2  # by a steady force, as long as nothing holds it back
            answer[block] = (np.minimum(1.0, reached) * along) @ place.fields.T
            largest[block] = (steady + np.minimum(2.0, reached) * (along - steady)) @ place.fields.T
    else:
        answer = _answer_of_loops(compared, motion, stiffness, forces, rows)
        largest = 2 * answer
    if free and len(motion.t) > 1:
        drift[:, :free] = _drift(compared, motion, before, answer, rows)
    times = np.tile(motion.t, 3)
    still, bent, drifted = np.split(
        compared.moves(times, np.concatenate([y, y + largest, y + drift]), np.tile(v, (3, 1))), 3
    )
    moved = [np.linalg.norm(found - still, axis=2).max(axis=0) for found in (bent, drifted)]
    return np.asarray(moved[0]), np.asarray(moved[1])


def _modal(place: Configuration) -> Array:
    """(x, x) what makes displacements of what is left out into those of its modes there."""
    return np.asarray(np.linalg.inv(place.fields).T)


def _nearest(t: Array, places: Sequence[Configuration]) -> list[tuple[IntArray, Configuration]]:
    """Instants that each configuration stands for."""
    own = np.abs(t[:, None] - np.array([place.t for place in places])).argmin(axis=1)
    return [(np.flatnonzero(own == k), place) for k, place in enumerate(places)]


def _answer_of_loops(compared: Compared, motion: Motion, stiffness: Array, forces: Array, rows: Array) -> Array:
    assert compared.tied is not None
    diagonal = np.concatenate([np.zeros(compared.free), stiffness])
    masses = np.array([compared.tied.masses(*at) for at in zip(motion.t.tolist(), motion.whole[0], strict=True)])
    matrices = np.diag(diagonal) + _pace(motion, compared) ** 2 * masses
    size = np.sqrt(np.einsum("kii->ki", matrices))
    along = rows / size[:, None]
    along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), np.finfo(float).tiny)
    scaled = matrices / (size[:, :, None] * size[:, None]) + _PENALTY * along.swapaxes(1, 2) @ along
    return np.asarray(-np.linalg.solve(scaled, (forces / size)[..., None])[..., 0] / size)


def _pace(motion: Motion, compared: Compared) -> float:
    """Of the rigid motion [rad/s]."""
    rates = np.abs(motion.whole[1][:, : compared.free]).max(initial=0.0)
    return float(max(rates, 2 * np.pi / max(float(np.ptp(motion.t)), 1e-9)))


def _unbalanced(compared: Compared, motion: Motion) -> tuple[Array, Array, Array]:
    """(k, N) forces out of balance on all coordinates, the conditions of loops (k, m, N), and (k, f) the forces on free
    joints by the equations that were run.
    """
    forces, own = np.empty_like(motion.whole[0]), np.zeros((len(motion.t), len(compared.own)))
    every = list(zip(motion.t.tolist(), *motion.whole, strict=True))
    for k, state in enumerate(every):
        forces[k] = compared.whole.residual(*state)
    before = forces[:, : compared.free].copy()
    if not compared.exact:
        lacking = [np.ascontiguousarray(row[:, compared.run]) for row in motion.whole]
        for k, at in enumerate(zip(motion.t.tolist(), *lacking, strict=True)):
            lesser = compared.lesser.residual(*at)
            before[k], own[k] = lesser[: compared.free], forces[k, compared.kept] - lesser[compared.own]
    if compared.tied is None:
        forces[:, compared.kept] = own
        return forces, np.zeros((len(motion.t), 0, forces.shape[1])), before
    rows = np.array([compared.tied.closure(*state[:3]).rows[:, compared.whole.free] for state in every])
    for k, state in enumerate(every):
        forces[k] = compared.tied.forces(*state)
        along, left = _loop_balance(compared, motion, k, forces[k, compared.kept] - own[k], rows[k])
        forces[k] += rows[k].T @ np.linalg.lstsq(along.T, -left, rcond=_DEPENDENT)[0]
    forces[:, compared.kept] = own
    return forces, rows, before


def _loop_balance(
    compared: Compared, motion: Motion, k: int, forces: Array, rows: Array
) -> tuple[Array, Array]:
    """Conditions of loops (m, n) over coordinates of the run, and what their forces balance there (n,)."""
    if len(compared.kept) == len(compared.run):
        return rows[:, compared.kept], forces
    assert compared.bound is not None  # all that was run moves there, with what counts as left out
    at, (y, v, a) = float(motion.t[k]), (row[k] for row in motion.given)
    return compared.bound.closure(at, y, v).rows[:, compared.lesser.free], compared.bound.forces(at, y, v, a)


def _drift(compared: Compared, motion: Motion, before: Array, answer: Array, rows: Array) -> Array:
    """(k, f) e of free joints, from the forces on them (k, f) by the equations that were run, the answer (k, N), and
    the conditions of loops (k, m, N).
    """
    free, lesser = compared.free, compared.lesser
    drift: Array = np.zeros((len(motion.t), free))
    moved: Array = np.zeros((2, free))
    for k, (at, y, v, a) in enumerate(zip(motion.t.tolist(), *motion.whole, strict=True)):
        ways, leading = _ways(rows[k][:, :free])
        force = ways.T @ (before[k] - compared.whole.residual(at, y + answer[k], v, a)[:free])
        mass = ways.T @ lesser.mass_matrix(at, np.ascontiguousarray(y[compared.run]))[:free, :free] @ ways
        spring, damping = (ways.T @ change @ ways for change in _changes(compared, at, (y, v, a), before[k]))
        h = float(motion.t[k] - motion.t[k - 1]) if k else 0.0
        matrix = mass + h / 2 * damping + h**2 / 4 * spring
        e, rate = moved[:, leading]
        change = np.asarray(np.linalg.solve(matrix, force - damping @ rate - spring @ e))
        e, rate = e + h**2 / 4 * change, rate + h / 2 * change
        drift[k] = ways @ e
        if k + 1 < len(motion.t):  # the first half of the next stretch
            h = float(motion.t[k + 1] - motion.t[k])
            moved = np.stack([ways @ (e + h * rate + h**2 / 4 * change), ways @ (rate + h / 2 * change)])
    return drift


def _ways(rows: Array) -> tuple[Array, IntArray]:
    """(f, d) ways in which joints may move under the conditions of loops (m, f), one for each joint that leads; (d,)
    those joints.
    """
    free = rows.shape[1]
    if not len(rows):
        return np.eye(free), np.arange(free)
    _, triangle, order = la.qr(rows, pivoting=True)
    size = np.abs(np.diag(triangle))
    rank = int(np.count_nonzero(size > _DEPENDENT * size.max(initial=0.0)))
    led, leading = np.sort(order[:rank]), np.sort(order[rank:])
    ways = np.zeros((free, len(leading)))
    ways[leading, np.arange(len(leading))] = 1.0
    ways[led] = -np.linalg.lstsq(rows[:, led], rows[:, leading], rcond=_DEPENDENT)[0]
    return ways, leading


def _changes(
    compared: Compared, t: float, state: tuple[Array, Array, Array], before: Array
) -> tuple[Array, Array]:
    """(f, f) changes of the forces out of balance (f,) on free joints, per unit of their coordinates and rates; none
    where loops hold them, since those of one turn of a crank cancel in the next.
    """
    free = compared.free
    changes = np.zeros((2, free, free))
    if compared.tied is None:
        for order in range(2):
            for j in range(free):
                moved = [np.ascontiguousarray(row[compared.run]) for row in state]
                step = _DIFFERENCE * max(1.0, abs(moved[order][j]))
                moved[order][j] += step
                changes[order, :, j] = (compared.lesser.residual(t, *moved)[:free] - before) / step
    return changes[0], changes[1]

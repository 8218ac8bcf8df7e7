"""What slow loads make of what links leave out: its static answer, and joints that drift for it.

The equations of the whole mechanism, at the slow part of the motion that was run and with nothing of what is left out,
leave forces D out of balance: on what is left out those that bend it, on the coordinates that were run what a finer
mesh makes of the inertia. The answer is K δ = -D, with the conditions of loops, where there are any.

The answer changes the forces R on joints that are free to move by ΔR. Their error e grows as

    M ë + C ė + K e = -ΔR,

with links rigid: M is the inertia of the joints, C = ∂R/∂θ̇, K = ∂R/∂θ what springs, controllers, weight and inertia
make of e itself. In loops R holds the forces Φ_θᵀ λ that close them, whose directions change with e and with the
answer, and e is one of the ways that joints may go, Φ_θ e = 0. It is followed by N. M. Newmark's method from one
stretch of time to the next, of loops a little damped, since what ways they may go is known at these alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from erls.accuracy.compared_links import Compared, Motion
from erls.accuracy.configurations import Configuration
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.series import mass_series
from erls.maths.full_turns import turned_on, turns_to
from erls.maths.so3 import Array
from fe_import.model import IntArray

_DIFFERENCE = 1e-6  # rad or m
_PENALTY = 1e8  # of opened loops against stiffness
_DEPENDENT = 1e-9  # of the largest singular value: rows of loops that follow from others
_SAME_WAY = 1e-6  # of the largest singular value: conditions on joints, not closed by as much as links are bent
_GAMMA_OF_LOOPS = 0.55  # of Newmark's method: 1/2 damps nothing


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
    found, free, whole, ways = _unbalanced(compared, motion), compared.free, compared.whole, _ways(compared, motion)
    stiffness = np.concatenate([link.stiffness for link in whole.mechanism.links])
    y, v, _ = motion.whole
    drift, answer = np.zeros_like(y), np.zeros_like(y)
    borne: Array = np.zeros((1, whole.size))
    if ways is None:
        answer[:, free:] = -found.forces[:, free:] / stiffness
        if start is not None:
            borne[:, free:] = -_unbalanced(compared, start).forces[:, free:] / stiffness
        largest = 2 * answer - borne
        for at, place in _nearest(motion.t, places):
            block, steady = np.ix_(at, compared.rest), borne[:, compared.rest] @ _modal(place)
            along = -(found.forces[block] @ place.fields) / place.squares
            reached = 0.5 * place.squares * duration**2  # by a steady force, as long as nothing holds it back
            answer[block] = (np.minimum(1.0, reached) * along) @ place.fields.T
            largest[block] = (steady + np.minimum(2.0, reached) * (along - steady)) @ place.fields.T
    else:
        answer = _answer_of_loops(compared, motion, duration, found, ways)
        largest = 2 * answer
    if free and len(motion.t) > 1:
        drift[:, :free] = _drift(compared, motion, found, answer, ways)
    times = np.tile(motion.t, 3)
    still, bent, drifted = np.split(
        compared.moves(times, np.concatenate([y, y + largest, y + drift]), np.tile(v, (3, 1))), 3
    )
    moved = [np.linalg.norm(at - still, axis=2).max(axis=0) for at in (bent, drifted)]
    return np.asarray(moved[0]), np.asarray(moved[1])


def start_of_loops(compared: Compared, start: Motion) -> Array:
    """(p,) how far points begin from where they do with all that is left out, of loops in static equilibrium [m].

    Parameters
    ----------
    compared : Compared
    start : Motion
        The first instant.

    Raises
    ------
    SimulationError
        NO_EQUILIBRIUM of the whole mechanism.
    """
    y, v = ClosedChain(compared.whole).initial_state()
    here, there = compared.moves(np.repeat(start.t, 2), np.stack([start.whole[0][0], y]), np.stack([v, v]))
    return np.asarray(np.linalg.norm(there - here, axis=-1))


def _modal(place: Configuration) -> Array:
    """(x, x) what makes displacements of what is left out into those of its modes there."""
    return np.asarray(np.linalg.inv(place.fields).T)


def _nearest(t: Array, places: Sequence[Configuration]) -> list[tuple[IntArray, Configuration]]:
    """Instants that each configuration stands for."""
    own = np.abs(t[:, None] - np.array([place.t for place in places])).argmin(axis=1)
    return [(np.flatnonzero(own == k), place) for k, place in enumerate(places)]


@dataclass(frozen=True)
class _Unbalanced:
    """What the equations of the whole mechanism leave out of balance at k times of a motion.

    Attributes
    ----------
    forces : (k, N) array
        On all coordinates; on those that were run, what a finer mesh makes of the inertia.
    joints : (k, f) array
        On free joints.
    finer : (k, f) array
        Of these, what a finer mesh makes of the inertia.
    rows : (k, m, N) array
        Conditions of loops.
    multipliers : (k, m) array
        Of these.
    """

    forces: Array
    joints: Array
    finer: Array
    rows: Array
    multipliers: Array


def _answer_of_loops(
    compared: Compared, motion: Motion, duration: float, found: _Unbalanced, ways: Sequence[Array]
) -> Array:
    """(k, N) that does not move joints along their ways, which is drift, and goes no farther than 1/2 D t^2."""
    assert compared.tied is not None
    masses = mass_series(compared.tied, motion.t, motion.whole[0])
    free, answer = compared.free, np.empty_like(found.forces)
    stiffness = np.concatenate([link.stiffness for link in compared.whole.mechanism.links])
    for k, (mass, way) in enumerate(zip(masses, ways, strict=True)):
        matrix = np.diag(np.concatenate([np.zeros(free), stiffness])) + 2 / duration**2 * mass
        size = np.sqrt(np.diag(matrix))
        along = np.concatenate([found.rows[k], (mass[:, :free] @ way).T]) / size
        along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
        scaled = matrix / (size[:, None] * size) + _PENALTY * along.T @ along
        answer[k] = -np.linalg.solve(scaled, found.forces[k] / size) / size
    return answer


def _unbalanced(compared: Compared, motion: Motion) -> _Unbalanced:
    free, run = compared.free, compared.run
    forces = compared.forces(motion.t, *motion.whole)
    own, finer = np.zeros((len(motion.t), len(compared.own))), np.zeros((len(motion.t), free))
    if not compared.exact:
        lesser = compared.lesser_forces(motion.t, *(row[:, run] for row in motion.whole))
        own, finer = forces[:, compared.kept] - lesser[:, compared.own], forces[:, :free] - lesser[:, :free]
    rows, multipliers = np.zeros((len(motion.t), 0, forces.shape[1])), np.zeros((len(motion.t), 0))
    if compared.tied is not None:
        tied = compared.tied
        rows = tied.gradients(motion.t, motion.whole[0])
        multipliers = np.zeros(rows.shape[:2])
        forces = tied.held(motion.t, *motion.whole, multipliers)
        for k in range(len(motion.t)):
            along, left = _loop_balance(compared, motion, k, forces[k, compared.kept] - own[k], rows[k])
            multipliers[k] = np.linalg.lstsq(along.T, -left, rcond=_DEPENDENT)[0]
        forces += np.einsum("kmn,km->kn", rows, multipliers)
    joints = forces[:, :free].copy()
    forces[:, compared.kept] = own
    return _Unbalanced(forces, joints, finer, rows, multipliers)


def _loop_balance(
    compared: Compared, motion: Motion, k: int, forces: Array, rows: Array
) -> tuple[Array, Array]:
    """Conditions of loops (m, n) over coordinates of the run, and what their forces balance there (n,)."""
    if len(compared.kept) == len(compared.run):
        return rows[:, compared.kept], forces
    assert compared.bound is not None  # all that was run moves there, with what counts as left out
    at, (y, v, a) = float(motion.t[k]), (row[k] for row in motion.given)
    return compared.bound.closure(at, y, v).rows[:, compared.lesser.free], compared.bound.forces(at, y, v, a)


def _drift(
    compared: Compared, motion: Motion, found: _Unbalanced, answer: Array, ways: Sequence[Array] | None
) -> Array:
    """(k, f) e of free joints."""
    free, (y, v, a) = compared.free, motion.whole
    forces = found.joints - _on_joints(compared, found, motion.t, y + answer, v, a) - found.finer
    vectors = compared.whole.mechanism.rotation_vector_places

    def along(k: int, matrix: Array, load: Array) -> Array:
        """What a load makes of joints that go their ways."""
        if ways is None:
            return np.asarray(np.linalg.solve(matrix, load))
        return np.asarray(ways[k] @ np.linalg.solve(ways[k].T @ matrix @ ways[k], ways[k].T @ load))

    masses = compared.lesser_masses(motion.t, y[:, compared.run])[:, :free, :free]
    springs, dampings = _changes(compared, motion, found)
    gamma = _GAMMA_OF_LOOPS if found.rows.shape[1] else 0.5
    beta = (gamma + 0.5) ** 2 / 4
    drift: Array = np.zeros((len(motion.t), free))
    e, rate, change = np.zeros((3, free))
    for k in range(len(motion.t)):
        if k:
            h = float(motion.t[k] - motion.t[k - 1])
            ahead, rate = e + h * rate + h**2 * (0.5 - beta) * change, rate + h * (1 - gamma) * change
            inertia = masses[k] / (beta * h**2) + gamma / (beta * h) * dampings[k]
            load = forces[k] + inertia @ ahead - dampings[k] @ rate
            e = along(k, inertia + springs[k], load)
            change = (e - ahead) / (beta * h**2)
            rate = rate + h * gamma * change
        else:
            change = along(k, masses[k], forces[k])
        drift[k] = e
        if k + 1 < len(motion.t):
            e, rate = _exchanged(e, rate, motion, k, vectors)
    return drift


def _exchanged(e: Array, rate: Array, motion: Motion, k: int, vectors: Sequence[int]) -> tuple[Array, Array]:
    """(f,) error of coordinates and rates at the next of the instants, where it holds other rotation vectors."""
    y, v, _ = motion.whole
    for at in (slice(place, place + 3) for place in vectors):
        turns = turns_to(y[k + 1, at], y[k, at])
        if turns:
            old = turned_on(y[k + 1, at], v[k + 1, at], turns)
            back = turns_to(old[0], y[k + 1, at])
            found, there = turned_on(old[0] + e[at], old[1] + rate[at], back), turned_on(*old, back)
            e[at], rate[at] = found[0] - there[0], found[1] - there[1]
    return e, rate


def _ways(compared: Compared, motion: Motion) -> list[Array] | None:
    """(f, d) ways in which joints may move at each instant, links rigid; None where nothing holds them."""
    free = compared.free
    if compared.tied is None:
        return None
    rigid = np.zeros_like(motion.whole[0])
    rigid[:, :free] = motion.whole[0][:, :free]
    result = []
    for rows in compared.tied.gradients(motion.t, rigid)[:, :, :free]:
        _, values, right = la.svd(rows)
        rank = int(np.count_nonzero(values > _SAME_WAY * values.max(initial=0.0)))
        result.append(np.asarray(right[rank:].T))
    return result


def _on_joints(compared: Compared, found: _Unbalanced, t: Array, y: Array, v: Array, a: Array) -> Array:
    """(k, f) forces out of balance on free joints, those of loops as they are."""
    if compared.tied is None:
        return compared.forces(t, y, v, a)[:, : compared.free]
    return compared.tied.held(t, y, v, a, found.multipliers)[:, : compared.free]


def _changes(compared: Compared, motion: Motion, found: _Unbalanced) -> Array:
    """(2, k, f, f) changes of the forces on free joints per unit of their coordinates and rates."""
    free, count, t = compared.free, len(motion.t), motion.t
    states = motion.whole if compared.tied is not None else [row[:, compared.run] for row in motion.whole]
    changes = np.zeros((2, count, free, free))
    moved = np.repeat(np.stack(states)[:, None], 1 + 2 * free, axis=1)
    steps = np.zeros((2, free, count))
    for order in range(2):
        for j in range(free):
            steps[order, j] = _DIFFERENCE * np.maximum(1.0, np.abs(states[order][:, j]))
            moved[order, 1 + order * free + j, :, j] += steps[order, j]
    flat, times = moved.reshape(3, (1 + 2 * free) * count, -1), np.tile(t, 1 + 2 * free)
    if compared.tied is None:
        forces = compared.lesser_forces(times, *flat)
    else:
        y, v, a = flat
        forces = compared.tied.held(times, y, v, a, np.tile(found.multipliers, (1 + 2 * free, 1)))
    forces = forces.reshape(1 + 2 * free, count, -1)[..., :free]
    found_changes = (forces[1:] - forces[0]).reshape(2, free, count, free) / steps[..., None]
    changes[:] = found_changes.transpose(0, 2, 3, 1)
    return changes

"""What slow loads make of what links leave out: its static answer, and joints that drift for it.

Forces D that are out of balance at the slow part of a motion (`erls.accuracy.unbalanced_forces`) are answered by
K δ = -D, with the conditions of loops, where there are any. Joints that are free to move drift for the answer
(`erls.accuracy.joint_drift`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from erls.accuracy.compared_links import Compared, Motion
from erls.accuracy.configurations import Configuration
from erls.accuracy.joint_drift import joint_drift, ways_of_joints
from erls.accuracy.mean_vibration_forces import mean_vibration_forces
from erls.accuracy.slow_motion import Parted
from erls.accuracy.unbalanced_forces import Unbalanced, unbalanced
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.series import mass_series
from erls.maths.so3 import Array
from fe_import.model import IntArray

_PENALTY = 1e8  # of opened loops against stiffness


def slow_answer(
    compared: Compared,
    parts: Parted,
    places: Sequence[Configuration],
    duration: float,
    at_rest: bool,
    sudden: bool = False,
) -> tuple[Array, Array]:
    """(p,) largest displacement of each point by the answer to slow loads, and by the drift of free joints [m].

    Loads that change make what is left out vibrate about the answer, by as much as it changed; all loads change at the
    start, but for those that deformed the links before.

    Parameters
    ----------
    compared : Compared
    parts : Parted
        Of the motion.
    places : sequence of Configuration
    duration : float
        Of the run [s].
    at_rest : bool
        Whether links are deformed at the start as they bear it at rest; else they start undeformed.
    sudden : bool
        Whether friction, contacts or limits of motors act.
    """
    motion, start = parts.slow, parts.start
    found, ways = unbalanced(compared, motion), ways_of_joints(compared, motion)
    free, whole = compared.free, compared.whole
    stiffness = np.concatenate([link.stiffness for link in whole.mechanism.links])
    y, v, _ = motion.whole
    drift, answer = np.zeros_like(y), np.zeros_like(y)
    borne: Array = np.zeros((1, whole.size))
    if ways is None:
        answer[:, free:] = -found.forces[:, free:] / stiffness
        if at_rest:
            borne[:, free:] = -unbalanced(compared, start).forces[:, free:] / stiffness
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
        more = mean_vibration_forces(compared, start, motion.t, sudden, borne[0]) if ways is None else 0.0
        drift[:, :free] = joint_drift(compared, motion, found, answer, borne[0], ways, sudden, more)
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


def _answer_of_loops(
    compared: Compared, motion: Motion, duration: float, found: Unbalanced, ways: Sequence[Array]
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

"""Joints that are free to move drift when slow loads give links another shape.

The answer δ of links (`erls.accuracy.slow_answer`), its rate and acceleration change the forces R on these joints by
ΔR. Their error e grows as

    M ë + C ė + K e = -ΔR,

with links rigid: M is the inertia of the joints, C = ∂R/∂θ̇, K = ∂R/∂θ what springs, controllers, weight and inertia
make of e itself. What δ̇ and δ̈ do of ΔR keeps the momentum of joints: a link that spins slows down as it is stretched.
Loads that links did not bear before the start bend them at once, by Δδ. With x = [Δe, Δδ] and the rows M_θ of the mass
matrix that belong to joints, which move as the mechanism does,

    M_θ x = 0,   M Δė = -(∂R/∂ẋ x - Ṁ_θ x + M_θδ δ̇).

In loops R holds the forces Φ_θᵀ λ that close them, whose directions change with e and with the answer, and e is one of
the ways that joints may go, Φ_θ e = 0. It is followed by N. M. Newmark's method from one stretch of time to the next,
of loops a little damped, since what ways they may go is known at these alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy.linalg as la

from erls.accuracy.compared_links import Compared, Motion
from erls.accuracy.unbalanced_forces import Unbalanced
from erls.maths.full_turns import turned_on, turns_to
from erls.maths.so3 import Array

_DIFFERENCE = 1e-6  # rad or m
_SAME_WAY = 1e-6  # of the largest singular value: conditions on joints, not closed by as much as links are bent
_GAMMA_OF_LOOPS = 0.55  # of Newmark's method: 1/2 damps nothing


def joint_drift(
    compared: Compared,
    motion: Motion,
    found: Unbalanced,
    answer: Array,
    borne: Array,
    ways: Sequence[Array] | None,
    sudden: bool = False,
    more: Array | float = 0.0,
) -> Array:
    """(k, f) e of free joints [rad or m].

    Parameters
    ----------
    compared : Compared
    motion : Motion
        The slow one, at k times.
    found : Unbalanced
    answer : (k, N) array
        What the links' shape changes by.
    borne : (N,) array
        The same before the start.
    ways : sequence of (f, d) arrays, or None
        Of `ways_of_joints`.
    sudden : bool
        Whether friction, contacts or limits of motors act.
    more : (k, f) array or float
        Forces R beside those (`erls.accuracy.mean_vibration_forces`).
    """
    free, (y, v, a) = compared.free, motion.whole
    bending = np.gradient(answer, motion.t, axis=0)
    states = y + answer, v + bending, a + np.gradient(bending, motion.t, axis=0)
    forces = found.joints - _on_joints(compared, found.multipliers, motion.t, *states) - found.finer - more
    vectors = compared.whole.mechanism.rotation_vector_places
    masses = compared.lesser_masses(motion.t, y[:, compared.run])[:, :free, :free]

    def along(k: int, matrix: Array, load: Array) -> Array:
        """What a load makes of joints that go their ways."""
        if ways is None:
            return np.asarray(np.linalg.solve(matrix, load))
        return np.asarray(ways[k] @ np.linalg.solve(ways[k].T @ matrix @ ways[k], ways[k].T @ load))

    springs, dampings = _changes(compared, motion, found)
    gamma = _GAMMA_OF_LOOPS if found.rows.shape[1] else 0.5
    beta = (gamma + 0.5) ** 2 / 4
    drift: Array = np.zeros((len(motion.t), free))
    change = np.zeros(free)
    jump = answer[0] - borne, bending[0]
    e, rate = _at_once(compared, motion, found, jump, lambda load: along(0, masses[0], load), sudden)
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
            change = along(k, masses[k], forces[k] - dampings[k] @ rate - springs[k] @ e)
        drift[k] = e
        if k + 1 < len(motion.t):
            e, rate = _exchanged(e, rate, motion, k, vectors)
    return drift


def _at_once(
    compared: Compared,
    motion: Motion,
    found: Unbalanced,
    jump: tuple[Array, Array],
    along: Callable[[Array], Array],
    sudden: bool,
) -> tuple[Array, Array]:
    """(f,) Δe and Δė of joints whose links are bent by (N,) Δδ, and go on at the rate δ̇, from the first instant on."""
    free, (y, v, a) = compared.free, (row[:2] for row in motion.whole)
    bent, bending = jump

    def change(rates: Array, accelerations: Array) -> Array:
        """(2, f) of the forces on joints, at the first two instants."""
        plus, minus = (
            _on_joints(compared, found.multipliers[:2], motion.t[:2], y, v + sign * rates, a + sign * accelerations)
            for sign in (0.5, -0.5)
        )
        return plus - minus

    still, shape = np.zeros_like(bent), bent.copy()
    shape[:free] -= along(change(still, bent)[0])
    mass = change(still, shape)
    growing = (mass[1] - mass[0]) / (motion.t[1] - motion.t[0])
    turned = shape.copy()
    if sudden:  # friction in joints does not grow with how fast they jump
        turned[:free] = 0.0
    return shape[:free] - bent[:free], -along(change(turned, bending)[0] - growing)


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


def ways_of_joints(compared: Compared, motion: Motion) -> list[Array] | None:
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


def _on_joints(compared: Compared, multipliers: Array, t: Array, y: Array, v: Array, a: Array) -> Array:
    """(k, f) forces out of balance on free joints, those of loops as they are."""
    if compared.tied is None:
        return compared.forces(t, y, v, a)[:, : compared.free]
    return compared.tied.held(t, y, v, a, multipliers)[:, : compared.free]


def _changes(compared: Compared, motion: Motion, found: Unbalanced) -> Array:
    """(2, k, f, f) changes of the forces on free joints per unit of their coordinates and rates."""
    free, count, t = compared.free, len(motion.t), motion.t
    states = motion.whole if compared.tied is not None else [row[:, compared.run] for row in motion.whole]
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
    changes = (forces[1:] - forces[0]).reshape(2, free, count, free) / steps[..., None]
    return np.asarray(changes.transpose(0, 2, 3, 1))

"""Forces that bend what links leave out, along a run, and the static answer to them.

The equations of the whole mechanism, at the motion that was run and with nothing of what is left out, leave forces D
out of balance: on what is left out those that bend it, on the coordinates that were run what a finer mesh makes of the
inertia. The answer is K δ = -D, with the conditions of loops, where there are any.
"""

from __future__ import annotations

import numpy as np

from erls.accuracy.compared_links import Compared, Motion
from erls.maths.so3 import Array

_PENALTY = 1e8  # of opened loops against stiffness
_DEPENDENT = 1e-9  # of the largest singular value: rows of loops that follow from others


def static_answer(compared: Compared, motion: Motion) -> Array:
    """(p,) largest displacement of each point by the static answer of what is left out [m]."""
    forces, rows = unbalanced(compared, motion)
    stiffness = np.zeros(compared.whole.size)
    stiffness[compared.free :] = np.concatenate([link.stiffness for link in compared.whole.mechanism.links])
    y, v, _ = motion.whole
    if compared.tied is None:
        answer = np.zeros_like(forces)
        answer[:, compared.free :] = -forces[:, compared.free :] / stiffness[compared.free :]
    else:
        masses = np.array([compared.tied.masses(*at) for at in zip(motion.t.tolist(), y, strict=True)])
        matrices = np.diag(stiffness) + _pace(motion, compared) ** 2 * masses
        size = np.sqrt(np.einsum("kii->ki", matrices))
        along = rows / size[:, None]
        along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), np.finfo(float).tiny)
        scaled = matrices / (size[:, :, None] * size[:, None]) + _PENALTY * along.swapaxes(1, 2) @ along
        answer = -np.linalg.solve(scaled, (forces / size)[..., None])[..., 0] / size
    twice = [np.concatenate(pair) for pair in ((motion.t, motion.t), (y + answer, y), (v, v))]
    moved, still = np.split(compared.moves(*twice), 2)
    return np.asarray(np.linalg.norm(moved - still, axis=2).max(axis=0))


def _pace(motion: Motion, compared: Compared) -> float:
    """Of the rigid motion [rad/s]."""
    rates = np.abs(motion.whole[1][:, : compared.free]).max(initial=0.0)
    return float(max(rates, 2 * np.pi / max(float(np.ptp(motion.t)), 1e-9)))


def unbalanced(compared: Compared, motion: Motion) -> tuple[Array, Array]:
    """(k, N) forces out of balance on all coordinates, and the conditions of loops (k, m, N)."""
    forces, own = np.empty_like(motion.whole[0]), np.zeros((len(motion.t), len(compared.own)))
    every = list(zip(motion.t.tolist(), *motion.whole, strict=True))
    for k, state in enumerate(every):
        forces[k] = compared.whole.residual(*state)
    if not compared.exact:
        lacking = [np.ascontiguousarray(row[:, compared.run]) for row in motion.whole]
        for k, at in enumerate(zip(motion.t.tolist(), *lacking, strict=True)):
            own[k] = forces[k, compared.kept] - compared.lesser.residual(*at)[compared.own]
    if compared.tied is None:
        forces[:, compared.kept] = own
        return forces, np.zeros((len(motion.t), 0, forces.shape[1]))
    rows = np.array([compared.tied.closure(*state[:3]).rows[:, compared.whole.free] for state in every])
    for k, state in enumerate(every):
        forces[k] = compared.tied.forces(*state)
        along, left = _loop_balance(compared, motion, k, forces[k, compared.kept] - own[k], rows[k])
        forces[k] += rows[k].T @ np.linalg.lstsq(along.T, -left, rcond=_DEPENDENT)[0]
    forces[:, compared.kept] = own
    return forces, rows


def _loop_balance(
    compared: Compared, motion: Motion, k: int, forces: Array, rows: Array
) -> tuple[Array, Array]:
    """Conditions of loops (m, n) over coordinates of the run, and what their forces balance there (n,)."""
    if len(compared.kept) == len(compared.run):
        return rows[:, compared.kept], forces
    assert compared.bound is not None  # all that was run moves there, with what counts as left out
    at, (y, v, a) = float(motion.t[k]), (row[k] for row in motion.given)
    return compared.bound.closure(at, y, v).rows[:, compared.lesser.free], compared.bound.forces(at, y, v, a)



"""Forces that the slow part of a motion leaves out of balance in the mechanism with finer links.

With nothing of what is left out, they are on that what bends it, and on the coordinates that were run what a finer mesh
makes of the inertia. Where links form loops, these are closed by the multipliers that balance what was run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.accuracy.compared_links import Compared, Motion
from erls.maths.so3 import Array

_DEPENDENT = 1e-9  # of the largest singular value: rows of loops that follow from others


@dataclass(frozen=True)
class Unbalanced:
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


def unbalanced(compared: Compared, motion: Motion) -> Unbalanced:
    """At the instants of a motion.

    Parameters
    ----------
    compared : Compared
    motion : Motion
        The slow one.
    """
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
    return Unbalanced(forces, joints, finer, rows, multipliers)


def _loop_balance(
    compared: Compared, motion: Motion, k: int, forces: Array, rows: Array
) -> tuple[Array, Array]:
    """Conditions of loops (m, n) over coordinates of the run, and what their forces balance there (n,)."""
    if len(compared.kept) == len(compared.run):
        return rows[:, compared.kept], forces
    assert compared.bound is not None  # all that was run moves there, with what counts as left out
    at, (y, v, a) = float(motion.t[k]), (row[k] for row in motion.given)
    return compared.bound.closure(at, y, v).rows[:, compared.lesser.free], compared.bound.forces(at, y, v, a)

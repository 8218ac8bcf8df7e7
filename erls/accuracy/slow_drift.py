"""Free joints that drift, since links under slow loads have another shape than they were taken to have.

What is left out answers the averaged motion of the run by δ, which changes the forces on joints that are free to move
by ΔR. Their error e grows as M ë = -ΔR, with M their inertia, links rigid; that forces change with e itself, as those
of a pendulum do, is left out.
"""

from __future__ import annotations

import numpy as np

from erls.accuracy.compared_links import Compared, Motion
from erls.maths.so3 import Array


def slow_drift(compared: Compared, motion: Motion) -> Array:
    """(p,) largest displacement of each point [m]; zero where no joint is free, or loops hold them.

    Parameters
    ----------
    compared : Compared
    motion : Motion
        Averaged over stretches of time.
    """
    free, whole = compared.free, compared.whole
    if not free or compared.tied is not None or len(motion.t) < 2:
        return np.zeros(len(compared.watched))
    stiffness = np.concatenate([link.stiffness for link in whole.mechanism.links])
    faster = np.empty((len(motion.t), free))
    for k, (at, y, v, a) in enumerate(zip(motion.t.tolist(), *motion.whole, strict=True)):
        before = whole.residual(at, y, v, a)
        differs = np.zeros(len(before))
        if not compared.exact:
            lesser = compared.lesser.residual(at, *(row[compared.run] for row in (y, v, a)))
            differs[compared.kept] = before[compared.kept] - lesser[compared.own]
        differs[compared.rest] = before[compared.rest]
        bent = y.copy()
        bent[free:] -= differs[free:] / stiffness
        change = (whole.residual(at, bent, v, a) - before + differs)[:free]
        faster[k] = -np.linalg.solve(whole.mass_matrix(at, y)[:free, :free], change)
    steps = np.diff(motion.t)[:, None]
    rate = np.concatenate([np.zeros((1, free)), np.cumsum((faster[1:] + faster[:-1]) / 2 * steps, axis=0)])
    drift = np.zeros_like(motion.whole[0])
    drift[1:, :free] = np.cumsum((rate[1:] + rate[:-1]) / 2 * steps, axis=0)
    y, v, _ = motion.whole
    moved = compared.moves(motion.t, y + drift, v) - compared.moves(motion.t, y, v)
    return np.asarray(np.linalg.norm(moved, axis=2).max(axis=0))

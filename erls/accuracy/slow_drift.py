"""Free joints that drift, since links under slow loads have another shape than they were taken to have.

What is left out answers the averaged motion of the run by δ, which changes the forces on joints that are free to move
by ΔR. Their error e grows as

    M ë + C ė + K e = -ΔR,

with links rigid: M is the inertia of the joints, C their dampers and controllers, K = ∂R/∂θ what springs, controllers,
weight and inertia make of e itself. It is followed by the trapezoidal rule from one stretch of time to the next.
"""

from __future__ import annotations

import numpy as np

from erls.accuracy.compared_links import Compared, Motion
from erls.equations.formulation import TreeFormulation
from erls.maths.so3 import Array

_DIFFERENCE = 1e-6  # rad or m


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
    drift = np.zeros_like(motion.whole[0])
    e: Array = np.zeros(free)
    rate, change = e, e
    for k, (at, y, v, a) in enumerate(zip(motion.t.tolist(), *motion.whole, strict=True)):
        before = whole.residual(at, y, v, a)
        differs = np.zeros(len(before))
        if not compared.exact:
            lesser = compared.lesser.residual(at, *(row[compared.run] for row in (y, v, a)))
            differs[compared.kept] = before[compared.kept] - lesser[compared.own]
        differs[compared.rest] = before[compared.rest]
        bent = y.copy()
        bent[free:] -= differs[free:] / stiffness
        force = -(whole.residual(at, bent, v, a) - before + differs)[:free]
        mass, damping = whole.mass_matrix(at, y)[:free, :free], whole.stiffness_and_damping(at, y, v)[1][:free, :free]
        if k == 0:
            change = np.asarray(np.linalg.solve(mass, force))
            continue
        h = float(motion.t[k] - motion.t[k - 1])
        spring = _stiffness(whole, at, y, v, a, before, free)
        e, rate = e + h * rate + h**2 / 4 * change, rate + h / 2 * change
        matrix = mass + h / 2 * damping + h**2 / 4 * spring
        change = np.asarray(np.linalg.solve(matrix, force - damping @ rate - spring @ e))
        e, rate = e + h**2 / 4 * change, rate + h / 2 * change
        drift[k, :free] = e
    y, v, _ = motion.whole
    moved = compared.moves(motion.t, y + drift, v) - compared.moves(motion.t, y, v)
    return np.asarray(np.linalg.norm(moved, axis=2).max(axis=0))


def _stiffness(whole: TreeFormulation, t: float, y: Array, v: Array, a: Array, before: Array, free: int) -> Array:
    """(f, f) change of the forces out of balance on free joints per unit of their coordinates."""
    columns = []
    for j in range(free):
        moved = y.copy()
        moved[j] += _DIFFERENCE
        columns.append((whole.residual(t, moved, v, a) - before)[:free] / _DIFFERENCE)
    return np.stack(columns, axis=1)

"""Laws by polynomials that shapers fold, so that slow vibrations are left at rest: the shortest within the bounds."""

from __future__ import annotations

import numpy as np

from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from erls.tracking.goal import Goal
from erls.tracking.laws import Law, folded, polynomial, shaper

KNOTS = 401
_DEGREE = 7
_MOST = 3  # modes that shapers leave at rest
_FINER = 1.02  # between durations that are tried
_TRIED = 250


def shaped(goal: Goal, efforts: Array, swing: float) -> Law:
    """The shortest that keeps the bounds, of those with none up to three modes at rest.

    Parameters
    ----------
    goal : Goal
    efforts : (j,) array
        Bounds.
    swing : float
        Bound [m].

    Raises
    ------
    SimulationError
        NO_PLAN: names the bound that no duration keeps.
    """
    if (_resting(goal) >= efforts).any():
        raise no_plan(goal, efforts, swing)
    best: Law | None = None
    modes = sorted(goal.modes, key=lambda mode: -mode.most)
    for count in range(min(_MOST, len(modes)) + 1):
        held = folded([shaper(mode.omega, mode.damping) for mode in modes[:count]])
        for duration in _durations(goal, efforts):
            law = polynomial(duration, _DEGREE, KNOTS, held)
            if best is not None and law.duration >= best.duration:
                break
            if keeps(goal, law, efforts, swing):
                best = law
                break
    if best is None:
        raise no_plan(goal, efforts, swing)
    return best


def _durations(goal: Goal, efforts: Array) -> Array:
    """Rising, from a third of what a rigid mechanism at an average effort and rate takes."""
    unit = polynomial(1.0, _DEGREE, KNOTS)
    still = np.zeros(KNOTS)
    hard = np.abs(goal.rigid(unit.place, still, unit.acceleration) - goal.rigid(unit.place, still, still)).max(axis=0)
    least = max(1 / goal.fastest, float(np.sqrt(hard / efforts).max()) / 3)
    return np.asarray(least * _FINER ** np.arange(_TRIED))


def keeps(goal: Goal, law: Law, efforts: Array, swing: float) -> bool:
    """Whether a law keeps all bounds, by the model; what modes were found to do besides falls with the duration."""
    if np.abs(law.rate).max() > goal.fastest or goal.swing(law) > swing * goal.beyond.share:
        return False
    return bool((np.abs(goal.needed(law)) <= efforts).all())


def _resting(goal: Goal) -> Array:
    """(j,) largest efforts that hold rigid links on the way."""
    still = np.zeros(KNOTS)
    return np.asarray(np.abs(goal.rigid(np.linspace(0.0, 1.0, KNOTS), still, still)).max(axis=0))


def no_plan(goal: Goal, efforts: Array, swing: float) -> SimulationError:
    """Which bound no motion keeps."""
    resting = _resting(goal)
    name, value, limit = "plan.swing", "no duration keeps it", f"{swing:.3g} m"
    heavy = np.flatnonzero(resting >= efforts)
    if len(heavy):
        k = int(heavy[0])
        name, value = f"plan.joints.{goal.names[k]}.effort", f"{resting[k]:.4g} at rest against the weight"
        limit = f"{efforts[k]:.4g}"
    return SimulationError(
        Cause.NO_PLAN,
        "no motion keeps the bounds",
        where=f"{goal.scene.path}: {name}",
        value=value,
        limit=limit,
        remedy="allow more, or another pose",
    )

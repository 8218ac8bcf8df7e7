"""Motors at their limit during a run, where an adaptive integrator does not see when that begins and ends: along
angles that are no coordinates, and where modes follow statically.
"""

from __future__ import annotations

import math

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.substructures import solved
from erls.integrate.base import Solution
from erls.integrate.choice import options_of
from erls.maths.so3 import Array
from erls.mechanism.rigid_dynamics import feed_forward
from erls.run.watches.base import Ended, Finding, Plan, Watch

_LOOKS = 500  # at most
_WORST = 100  # times the tolerance, in runs of one arm whose motor switches between its limits


class MotorLimits(Watch):
    """Looks at what drives ask of their motors."""

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Motors with a limit that is not located (`erls.equations.switched`), in steps that follow a tolerance."""
        blind = plan.settings.gauge == "minimum-norm" or plan.mechanism.bandwidth is not None
        return blind and plan.mechanism.limited and options_of(plan.settings).step is None

    def after(self, ended: Ended) -> Finding:
        """Motors that reached their limit and left it."""
        run = ended.run
        tolerance = options_of(run.scene.record.simulation).tolerance
        return Finding(limit_warnings(run.formulation, run.solution, tolerance))


def limit_warnings(formulation: Formulation, solution: Solution, tolerance: float) -> list[str]:
    """Of motors that reached their limit, and left it, under `lobatto`.

    When a motor leaves its limit follows from the rate of the joint, with all its small vibrations. An error of these,
    harmless for positions, so becomes one of the impulse that the motor gives, and that stays in the motion.

    Parameters
    ----------
    formulation : Formulation
    solution : Solution
    tolerance : float
        That the integrator was given [m].
    """
    formulation = solved(formulation)  # links in pieces are held by more joints
    mechanism = formulation.mechanism
    result = []
    for place, k in enumerate(getattr(formulation, "free_joints", ())):
        joint = mechanism.joints[k]
        if not math.isfinite(joint.drive.torque_limit):
            continue
        wanted = _wanted(formulation, solution, place, int(k))
        beyond = np.abs(wanted) > joint.drive.torque_limit
        sides = np.sign(wanted[beyond])
        if beyond.any() and (not beyond.all() or np.ptp(sides) > 0):
            result.append(
                f"the motor of joint {joint.name!r} reaches its limit of {joint.drive.torque_limit:.3g} and leaves it "
                f"again; small vibrations decide when, so the motion may be off by up to some {_WORST} times the "
                f"tolerance of {tolerance:.3g} m: see whether it changes with a tenth of that"
            )
    return result


def _wanted(formulation: Formulation, solution: Solution, place: int, k: int) -> Array:
    """Force that the drive of joint k, coordinate ``place``, asks of its motor, at some knots."""
    mechanism = formulation.mechanism
    drive = mechanism.joints[k].drive
    every = slice(None, None, max(1, len(solution.t) // _LOOKS))
    t, y, v = solution.t[every], solution.y[every, place], solution.v[every, place]
    result = np.array([drive.torque(*at) for at in zip(t.tolist(), y.tolist(), v.tolist(), strict=True)])
    return result + feed_forward(mechanism, t)[:, k] if drive.feed_forward else result

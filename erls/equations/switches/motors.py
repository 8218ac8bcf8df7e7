"""Motors at their limit: between two switches a motor either follows what its controller asks, or gives its limit.

A record of `erls.equations.serial.records.Joint` lies among the constants of a system, in numbers of its own for each
run. There the bounds of a motor are infinite while it follows, and both its limit while it does not, so that nothing
bends within a step. What is asked of motors is read where a residual leaves what acts along joints, of a system in
which nothing else acts there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from erls.equations.compiled_system import RESIDUAL, CompiledSystem
from erls.equations.serial.records import JOINT, JOINT_STATE, Joint, JointState, Serial
from erls.equations.series import residuals_leaving
from erls.maths.calls import handed
from erls.maths.contact_places import COEFFICIENT
from erls.maths.records import place_of, python_reader
from erls.maths.so3 import Array
from erls.mechanism.drives import Drive
from fe_import.model import IntArray

_see_serial, _see_joint = python_reader(Serial), python_reader(Joint)
_STOP_STIFFNESS = 2  # place among the numbers of stops


class Acting(NamedTuple):
    """What can be driven, of j joints.

    Attributes
    ----------
    joints : (j,) int array
        Places of their `Joint` records.
    efforts : (j,) int array
        Places in the working memory of what a residual finds to act along them.
    """

    joints: IntArray
    efforts: IntArray


class Motors(NamedTuple):
    """Motors with a limit, of c joints.

    Attributes
    ----------
    names : tuple of str
    limits : (c,) array
        [N m or N]
    acting : Acting
        Of their joints.
    """

    names: tuple[str, ...]
    limits: Array
    acting: Acting

    def by_value(self, asked: Array) -> Array:
        """(c,) 1 or -1 of a motor that is asked for more than its limit, 0 of one that follows."""
        return np.asarray(np.where(np.abs(asked) > self.limits, np.sign(asked), 0.0))

    def left(self, modes: Array, asked: Array) -> Array:
        """(k, c) how far each mode is from its end, at what is asked (k, c): it ends where this falls below zero."""
        return np.asarray(np.where(modes == 0.0, self.limits - np.abs(asked), modes * asked - self.limits))

    def put(self, modes: Array, reals: Array, integers: IntArray) -> None:
        """Say to the constants of a system what motors do; NaN stands for whatever they are asked."""
        for mode, limit, joint in zip(modes.tolist(), self.limits.tolist(), self.acting.joints.tolist(), strict=True):
            least, most = {0.0: (-np.inf, np.inf), 1.0: (limit, limit), -1.0: (-limit, -limit)}.get(
                mode, (-limit, limit)
            )
            reals[place_of(Joint, "least", integers, joint)] = least
            reals[place_of(Joint, "most", integers, joint)] = most


def put_friction(forces: Array, joints: IntArray, reals: Array, integers: IntArray) -> None:
    """Say to the constants of a system what friction gives along joints with these `Joint` records; zero where they
    stick.
    """
    for force, joint in zip(forces.tolist(), joints.tolist(), strict=True):
        reals[place_of(Joint, "rubbing", integers, joint)] = force


def acting_in(system: CompiledSystem) -> Acting:
    """Of the joints of a tree of links, all in their order."""
    serial = _see_serial(system.reals, system.integers, int(system.integers[0]))
    count = np.arange(serial.links)
    states = serial.joint_states + JOINT_STATE * count
    forces = [place_of(JointState, "forces", system.integers, int(at)) + 1 for at in states]
    return Acting(serial.joints + JOINT * count, np.array(forces, dtype=np.int64))


def motors_among(drives: Sequence[Drive], names: Sequence[str], acting: Acting) -> Motors:
    """Those with a limit."""
    found = [k for k, drive in enumerate(drives) if np.isfinite(drive.torque_limit)]
    limits = np.array([drives[k].torque_limit for k in found], dtype=float)
    return Motors(tuple(names[k] for k in found), limits, Acting(acting.joints[found], acting.efforts[found]))


class Asked:
    """What motors are asked for at states of a motion.

    Parameters
    ----------
    motors : Motors
    system : CompiledSystem
        Whose constants and memory are used; the former are copied.
    residual : callable
        Of it: what leaves the efforts.
    """

    def __init__(self, motors: Motors, system: CompiledSystem, residual: Callable[..., Any]) -> None:
        self._motors, self._system = motors, system
        self._residual = handed(residual, RESIDUAL) if len(motors.limits) else None
        self._reals = system.reals.copy()
        motors.put(np.zeros(len(motors.limits)), self._reals, system.integers)
        for at in motors.acting.joints.tolist():
            for name in ("stiffness", "damping", "friction", "rubbing"):
                self._reals[place_of(Joint, name, system.integers, at)] = 0.0
            stops = _see_joint(self._reals, system.integers, at).stops
            if len(stops):
                stops[_STOP_STIFFNESS] = 0.0
        for law in system.gripped_laws(self._reals):
            law[COEFFICIENT] = 0.0

    def __call__(self, t: Array, y: Array, v: Array) -> Array:
        """(k, c) at states (k, n) at times (k,)."""
        places, system = self._motors.acting.efforts, self._system
        if not len(places):
            return np.zeros((len(t), 0))
        return residuals_leaving(self._residual, self._reals, system.integers, system.scratch, t, y, v, places)

"""What acts in joints: drives, springs, dampers, friction, rotors; forces are in `actuator_forces`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.springs import with_ground
from erls.maths.so3 import Array
from erls.mechanism.joints import Joint

NO_STOPS = (-np.inf, np.inf, 0.0, 1.0, 0.0, 1.0)


@dataclass(frozen=True)
class Actuator:
    """What acts in a joint.

    Attributes
    ----------
    joint : Joint
        Of the mechanism: type, drive, passive forces, rotor, initial coordinate.
    nodes : tuple of int
        The outer node alone, when the inner frame is fixed to the ground; inner and outer node otherwise.
    inner_frame, outer_frame : (4, 4) array
        Pose of the joint in the frame of each node, in the world for the ground; z is its axis.
    lead : callable
        Torques (k,) at times (k,) that the drive adds (feed-forward).
    """

    joint: Joint
    nodes: tuple[int, ...]
    inner_frame: Array
    outer_frame: Array
    lead: Callable[[Array], Array]


class Actuators:
    """Actuators as arrays, for `erls.equations.nodal.actuator_forces`."""

    def __init__(self, actuators: Sequence[Actuator]) -> None:
        self.joints = tuple(a.joint for a in actuators)
        self.leads = tuple(a.lead for a in actuators)
        self.nodes = with_ground([a.nodes for a in actuators])
        self.inner_frames = np.array([a.inner_frame for a in actuators]).reshape(-1, 4, 4)
        self.outer_frames = np.array([a.outer_frame for a in actuators]).reshape(-1, 4, 4)
        self.start = np.array([j.position for j in self.joints], dtype=float)
        self.along = np.array([5 if j.freedom.turns else 2 for j in self.joints], dtype=np.int64)
        self.acting = tuple(j.forces.active or j.drive.kind not in ("free", "motion") for j in self.joints)
        active = [acts or j.rotor_inertia != 0 for acts, j in zip(self.acting, self.joints, strict=True)]
        self.active = np.array(active, dtype=np.int64)

    @property
    def laws(self) -> Array:
        """(e, 17) as in `erls.equations.nodal.contract.Model`."""
        found = []
        for joint, acts in zip(self.joints, self.acting, strict=True):
            own, drive = joint.forces, joint.drive
            gains = drive.gains if acts else (0.0, 0.0)
            law = (own.stiffness, own.rest, own.damping, *own.smooth_friction(False), *gains)
            bounds = -drive.torque_limit, drive.torque_limit, 0.0
            stops = NO_STOPS if own.stops is None else own.stops.numbers
            found.append([joint.rotor_inertia, *law, *bounds, *stops])
        return np.array(found, dtype=float).reshape(-1, 17)

    def wanted(self, times: Array) -> Array:
        """(k, e, 3) wanted coordinates, wanted rates, and torques besides, at times (k,)."""
        result = np.zeros((len(times), len(self.joints), 3))
        for k, (joint, lead) in enumerate(zip(self.joints, self.leads, strict=True)):
            drive = joint.drive
            if not self.acting[k]:
                continue
            if drive.motion is not None:
                result[:, k, :2] = [drive.motion.derivatives(t)[:2] for t in times.tolist()]
            result[:, k, 2] = lead(times)
            if drive.load is not None:
                result[:, k, 2] += [drive.load.value(t) for t in times.tolist()]
            if drive.prescribed and joint.forces.sticks:  # by the rate that is prescribed, which no iteration changes
                result[:, k, 2] -= joint.forces.friction * np.sign(result[:, k, 1])
        return result

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Of all drives."""
        return tuple(sorted({t for j in self.joints for t in j.drive.breakpoints}))

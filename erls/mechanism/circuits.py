"""Motors with an electric circuit: the current lags behind the voltage, and the speed of the motor works against it.

    L di/dt + R i = u - g ω,    torque = g i

with ω the rate of the joint and g its gear ratio times the motor's constant, in N m/A and in V s/rad the same number.
The charge that has passed is a coordinate of its own, with the inductance for its inertia and the resistance for its
damping: its rate is the current, ½ L i² is kinetic energy, and g ω i passes from one coordinate to the other without
loss. (S. H. Crandall et al., Dynamics of Mechanical and Electromechanical Systems, 1968, ch. 6.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.mechanism.compound_joints import intermediate_link
from erls.mechanism.curves import Curve, Harmonic, Piecewise, Sum
from erls.mechanism.drives import Drive
from erls.mechanism.joint_types import ElectricFreedom, JointType, Z
from erls.mechanism.joints import Joint, JointForces
from erls.mechanism.links import Link

CIRCUIT = JointType("circuit", None, (), axes=0)
"""What couples both coordinates, among what closes a chain: no condition."""


@dataclass(frozen=True)
class Circuit:
    """What couples a joint to the charge of its motor.

    Attributes
    ----------
    joint, charge : str
        Names of both coordinates.
    gyration : float
        g [N m/A, V s/rad; N/A, V s/m].
    """

    joint: str
    charge: str
    gyration: float


def charge_of(name: str, inductance: float, resistance: float) -> tuple[Joint, Link]:
    """The coordinate of a charge [C], and the massless link that it moves along z of the world for the equations'
    sake.
    """
    still = np.eye(4)
    forces, freedom = JointForces(damping=resistance), ElectricFreedom(Z, False)
    return Joint(name, freedom, still, still, forces, inductance, Drive(), 0.0, 0.0), intermediate_link(name)


def in_volts(drive: Drive, volts: float) -> Drive:
    """The voltage of an amplifier that makes ``volts`` of a unit of what a drive asks for."""
    limit, (stiffness, damping) = volts * drive.torque_limit, drive.gains
    load = None if drive.load is None else scaled(drive.load, volts)
    kind = "torque" if drive.kind == "voltage" else drive.kind
    return Drive(kind, load, drive.motion, (volts * stiffness, volts * damping), drive.feed_forward, limit)


def scaled(curve: Curve, factor: float) -> Curve:
    """A curve times a factor."""
    if isinstance(curve, Sum):
        return Sum(tuple(scaled(part, factor) for part in curve.parts))
    if isinstance(curve, Piecewise):
        return Piecewise(curve.knots, factor * curve.coefficients, curve.breakpoints)
    if isinstance(curve, Harmonic):
        amplitude, offset, before, after = (
            factor * x for x in (curve.amplitude, curve.offset, curve.before, curve.after)
        )
        return Harmonic(curve.breakpoints, amplitude, curve.omega, curve.phase, offset, before, after)
    raise TypeError(f"no multiple of the curve {type(curve).__name__}")

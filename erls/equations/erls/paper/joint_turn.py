"""The physical motion of a joint: its coordinate plus what the links' displacement adds along its freedom."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.equations.erls.paper.compatibility import Compatibility
from erls.maths.so3 import Array


@dataclass(frozen=True)
class Motion:
    """Modal coordinates and what relates them to the independent ones: q, q̇, D, G and n of `Compatibility`."""

    q: Array
    qd: Array
    d: Array
    g: Array
    n: Array


@dataclass(frozen=True)
class JointTurn:
    """Physical angle and rate of a joint.

    Attributes
    ----------
    angle, rate : float
        What an encoder reads [rad or m].
    gradient : (joints + elastic,) array or None
        Of the angle over (θ, q_d); None when the angle is the coordinate itself.
    bias : float
        Acceleration of the angle at θ̈ = 0, q̈_d = 0.
    """

    angle: float
    rate: float
    gradient: Array | None
    bias: float


def joint_turn(compatibility: Compatibility, k: int, theta: Array, rates: Array, motion: Motion) -> JointTurn:
    """Physical motion of joint ``k``; torque, springs, friction and rotor act on it."""
    if compatibility.keeps_angle(k):
        return JointTurn(float(theta[k]), float(rates[k]), None, 0.0)
    places = compatibility.layout
    row, slope, bend = np.zeros((3, places.size))
    for target, order in ((row, 0), (slope, 1), (bend, 2)):
        own, previous = compatibility.joint_displacement(k, theta[k], order)
        target[places.modes[k]] = own
        if previous is not None:
            target[places.modes[k - 1]] = previous
    rigid = row[places.rigid]
    gradient = np.concatenate([rigid @ motion.g, rigid @ motion.d + row[places.elastic]])
    gradient[k] += 1 + slope @ motion.q
    rate = rates[k] + row @ motion.qd + (slope @ motion.q) * rates[k]
    bias = (bend @ motion.q) * rates[k] ** 2 + 2 * (slope @ motion.qd) * rates[k] + rigid @ motion.n
    return JointTurn(float(theta[k] + row @ motion.q), float(rate), gradient, float(bias))

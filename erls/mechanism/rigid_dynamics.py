"""Inverse dynamics of the rigid links, by the recursive Newton-Euler method (Luh, Walker & Paul 1980).

Independent of the flexible formulations: it works on mass, centre of mass and inertia of each link.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.maths.rotation_maps import tangent, tangent_derivative
from erls.maths.so3 import Array, cross
from erls.mechanism.chain import Mechanism, joint_poses
from erls.mechanism.links import link_mass_properties


def inverse_dynamics(mechanism: Mechanism, theta: Array, rates: Array, accelerations: Array) -> Array:
    """Joint forces that give the rigid chain these accelerations.

    Gravity, payloads and rotor inertia are included; springs, damping and friction of the joints are not.

    Parameters
    ----------
    mechanism : Mechanism
    theta, rates, accelerations : (n,) arrays
        Joint coordinates [rad or m] and their derivatives.

    Returns
    -------
    (n,) array
        Torque [N m] or force [N] of each joint.
    """
    moving: list[_Moving] = []
    screws: list[Array] = []  # in the world
    loads: list[Array] = []  # moment about the world's origin, force
    moves = joint_poses(mechanism, theta)
    for k, (joint, link) in enumerate(zip(mechanism.joints, mechanism.links, strict=True)):
        qd, qdd = rates[k], accelerations[k]
        below = moving[joint.parent] if joint.parent >= 0 else _resting(mechanism.gravity)
        world = below.world @ joint.before
        world = world @ moves[k]
        if joint.freedom.vector:
            first = k - joint.freedom.axis
            spin, faster, axis = _turning(world[:3, :3], theta, rates, accelerations, first, joint.freedom.axis)
        else:
            axis = world[:3, :3] @ joint.freedom.direction * joint.freedom.turns
            spin, faster = axis * qd, axis * qdd
        advance = world[:3, :3] @ joint.freedom.advance
        origin = world[:3, 3].copy()
        arm = origin - below.point
        # of the point of the link below that is there, and then of the link's own
        acceleration = below.acceleration + cross(below.alpha, arm) + cross(below.omega, cross(below.omega, arm))
        acceleration = acceleration + advance * qdd + 2 * cross(below.omega, advance * qd)
        alpha = below.alpha + faster + cross(below.omega, spin)
        omega = below.omega + spin
        world = world @ joint.after
        moving.append(_Moving(world, omega, alpha, origin, acceleration))
        body = link_mass_properties(link)
        centre = world[:3, :3] @ body.centre_of_mass + world[:3, 3]
        inertia = world[:3, :3] @ body.inertia @ world[:3, :3].T
        arm = centre - origin
        force = body.mass * (acceleration + cross(alpha, arm) + cross(omega, cross(omega, arm)))
        moment = inertia @ alpha + cross(omega, inertia @ omega)
        screws.append(np.concatenate([axis, advance + cross(origin, axis)]))
        loads.append(np.concatenate([moment + cross(centre, force), force]))
    result = np.zeros(len(screws))
    for k in reversed(range(len(screws))):
        joint = mechanism.joints[k]
        result[k] = screws[k] @ loads[k] + joint.rotor_inertia * accelerations[k]
        if joint.parent >= 0:
            loads[joint.parent] = loads[joint.parent] + loads[k]
    return result


def _turning(
    world: Array, theta: Array, rates: Array, accelerations: Array, first: int, axis: int
) -> tuple[Array, Array, Array]:
    """What a rotation vector does to ω and ω̇, all with its first component; and the axis of one; in the world."""
    psi, rate, more = (np.asarray(x[first : first + 3]) for x in (theta, rates, accelerations))
    columns, once = world @ tangent(psi), float(axis == 0)
    faster = columns @ more + world @ tangent_derivative(psi, rate) @ rate
    return once * (columns @ rate), once * faster, columns[:, axis]


class _Moving(NamedTuple):
    """Pose of a link, its angular velocity and acceleration, and a material point with its acceleration."""

    world: Array
    omega: Array
    alpha: Array
    point: Array
    acceleration: Array


def _resting(gravity: Array) -> _Moving:
    return _Moving(np.eye(4), np.zeros(3), np.zeros(3), np.zeros(3), -gravity)

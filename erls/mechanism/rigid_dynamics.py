"""Inverse dynamics of the rigid links, by the recursive Newton-Euler method (Luh, Walker & Paul 1980).

Independent of the flexible formulations: it works on mass, centre of mass and inertia of each link.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.maths.rotation_maps import tangent, tangent_derivative
from erls.maths.so3 import Array
from erls.maths.so3 import cross_all as cross
from erls.mechanism.chain import Mechanism, joint_poses
from erls.mechanism.links import link_mass_properties


def feed_forward(mechanism: Mechanism, times: Array) -> Array:
    """(k, n) joint forces that wanted motions ask of the rigid chain at times (k,).

    Joints without a wanted motion are held where they begin.
    """
    held = [(joint.position, 0.0, 0.0) for joint in mechanism.joints]
    wanted = np.empty((3, len(times), len(held)))
    for i, t in enumerate(times.tolist()):
        goals = [j.drive.reference(t) or still for j, still in zip(mechanism.joints, held, strict=True)]
        wanted[:, i] = np.array(goals).T
    return inverse_dynamics(mechanism, *wanted)


def inverse_dynamics(mechanism: Mechanism, theta: Array, rates: Array, accelerations: Array) -> Array:
    """Joint forces that give the rigid chain these accelerations.

    Gravity, payloads and rotor inertia are included; springs, damping and friction of the joints are not.

    Parameters
    ----------
    mechanism : Mechanism
    theta, rates, accelerations : (..., n) arrays
        Joint coordinates [rad or m] and their derivatives.

    Returns
    -------
    (..., n) array
        Torque [N m] or force [N] of each joint.
    """
    theta, rates, accelerations = (np.asarray(x, dtype=float) for x in (theta, rates, accelerations))
    many = theta.shape[:-1]
    moving: list[_Moving] = []
    screws: list[Array] = []  # in the world
    loads: list[Array] = []  # moment about the world's origin, force
    moves = joint_poses(mechanism, theta)
    for k, (joint, link) in enumerate(zip(mechanism.joints, mechanism.links, strict=True)):
        qd, qdd = rates[..., k, None], accelerations[..., k, None]
        below = moving[joint.parent] if joint.parent >= 0 else _resting(mechanism.gravity, many)
        world = below.world @ joint.before @ moves[k]
        turn = world[..., :3, :3]
        if joint.freedom.vector:
            first = k - joint.freedom.axis
            spin, faster, axis = _turning(turn, theta, rates, accelerations, first, joint.freedom.axis)
        else:
            axis = turn @ joint.freedom.direction * joint.freedom.turns
            spin, faster = axis * qd, axis * qdd
        advance = turn @ joint.freedom.advance
        origin = world[..., :3, 3]
        arm = origin - below.point
        # of the point of the link below that is there, and then of the link's own
        acceleration = below.acceleration + cross(below.alpha, arm) + cross(below.omega, cross(below.omega, arm))
        acceleration = acceleration + advance * qdd + 2 * cross(below.omega, advance * qd)
        alpha = below.alpha + faster + cross(below.omega, spin)
        omega = below.omega + spin
        world = world @ joint.after
        turn = world[..., :3, :3]
        moving.append(_Moving(world, omega, alpha, origin, acceleration))
        body = link_mass_properties(link)
        centre = turn @ body.centre_of_mass + world[..., :3, 3]
        inertia = turn @ body.inertia @ np.swapaxes(turn, -2, -1)
        arm = centre - origin
        force = body.mass * (acceleration + cross(alpha, arm) + cross(omega, cross(omega, arm)))
        moment = _times(inertia, alpha) + cross(omega, _times(inertia, omega))
        screws.append(np.concatenate([axis, advance + cross(origin, axis)], axis=-1))
        loads.append(np.concatenate([moment + cross(centre, force), force], axis=-1))
    result = np.zeros((*many, len(screws)))
    for k in reversed(range(len(screws))):
        joint = mechanism.joints[k]
        result[..., k] = (screws[k] * loads[k]).sum(axis=-1) + joint.rotor_inertia * accelerations[..., k]
        if joint.parent >= 0:
            loads[joint.parent] = loads[joint.parent] + loads[k]
    return result


def _times(matrix: Array, vector: Array) -> Array:
    """(..., 3) products of matrices (..., 3, 3) with vectors (..., 3)."""
    return np.asarray((matrix @ vector[..., None])[..., 0])


def _turning(
    world: Array, theta: Array, rates: Array, accelerations: Array, first: int, axis: int
) -> tuple[Array, Array, Array]:
    """What a rotation vector does to ω and ω̇, all with its first component; and the axis of one; in the world."""
    psi, rate, more = (x[..., first : first + 3] for x in (theta, rates, accelerations))
    columns, once = world @ tangent(psi), float(axis == 0)
    faster = _times(columns, more) + _times(world @ tangent_derivative(psi, rate), rate)
    return once * _times(columns, rate), once * faster, columns[..., axis]


class _Moving(NamedTuple):
    """Pose of a link, its angular velocity and acceleration, and a material point with its acceleration."""

    world: Array
    omega: Array
    alpha: Array
    point: Array
    acceleration: Array


def _resting(gravity: Array, many: tuple[int, ...]) -> _Moving:
    still = np.zeros((*many, 3))
    return _Moving(np.broadcast_to(np.eye(4), (*many, 4, 4)), still, still, still, still - gravity)

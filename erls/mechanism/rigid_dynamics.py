"""Inverse dynamics of the rigid chain, by the recursive Newton-Euler method (Luh, Walker & Paul 1980).

Independent of the flexible formulations: it works on mass, centre of mass and inertia of each link.
"""

from __future__ import annotations

import numpy as np

from erls.maths.se3 import joint_pose
from erls.maths.so3 import Array, cross
from erls.mechanism.chain import Mechanism
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
    axes: list[Array] = []
    origins: list[Array] = []
    forces: list[Array] = []
    moments: list[Array] = []
    world = np.eye(4)
    # motion of the current link: angular velocity, angular acceleration, and acceleration of a material point
    omega, alpha = np.zeros(3), np.zeros(3)
    point, acceleration = np.zeros(3), -mechanism.gravity
    for joint, link, q, qd, qdd in zip(
        mechanism.joints, mechanism.links, theta, rates, accelerations, strict=True
    ):
        world = world @ joint.before
        axis = world[:3, 2].copy()
        world = world @ joint_pose(joint.type.revolute, q)
        origin = world[:3, 3].copy()
        arm = origin - point
        acceleration = acceleration + cross(alpha, arm) + cross(omega, cross(omega, arm))
        if joint.type.revolute:
            alpha = alpha + axis * qdd + cross(omega, axis * qd)
            omega = omega + axis * qd
        else:
            acceleration = acceleration + axis * qdd + 2 * cross(omega, axis * qd)
        point = origin
        world = world @ joint.after
        body = link_mass_properties(link)
        centre = world[:3, :3] @ body.centre_of_mass + world[:3, 3]
        inertia = world[:3, :3] @ body.inertia @ world[:3, :3].T
        arm = centre - point
        force = body.mass * (acceleration + cross(alpha, arm) + cross(omega, cross(omega, arm)))
        spin = inertia @ alpha + cross(omega, inertia @ omega)
        axes.append(axis)
        origins.append(origin)
        forces.append(force)
        moments.append(spin + cross(centre, force))  # about the world's origin
    result = np.zeros(len(axes))
    force, moment = np.zeros(3), np.zeros(3)
    for k in reversed(range(len(axes))):
        force, moment = force + forces[k], moment + moments[k]
        revolute = mechanism.joints[k].type.revolute
        load = moment - cross(origins[k], force) if revolute else force
        result[k] = axes[k] @ load + mechanism.joints[k].rotor_inertia * accelerations[k]
    return result

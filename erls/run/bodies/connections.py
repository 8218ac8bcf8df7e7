"""What connections of a scene of bodies do: their coordinates, and the forces on their nodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.equations.nodal.joints import GROUND, Joint
from erls.equations.nodal.redundant import smallest_multipliers
from erls.equations.nodal.scenes.build import Assembly
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array
from erls.mechanism.joint_types import JOINT_TYPES

ONE_COORDINATE = {name: kind.one.units[0] for name, kind in JOINT_TYPES.items() if kind.one is not None}
"""Units of the coordinates of joints that have one."""


def joint_frames(joint: Joint, inner: Array, outer: Array) -> tuple[Array, Array]:
    """Frames (..., 4, 4) of a joint on both of its sides, from the poses of its nodes; ``inner`` of the ground counts
    not.
    """
    first = joint.inner_frame if joint.inner == GROUND else inner @ joint.inner_frame
    return np.broadcast_to(first, outer.shape), outer @ joint.outer_frame


def joint_coordinate(joint: Joint, inner: Array, outer: Array) -> Array:
    """(...) angle within half a turn [rad] or slide [m] of a joint with one coordinate."""
    first, second = joint_frames(joint, inner, outer)
    relative = motions.inverse(first) @ second
    if ONE_COORDINATE[joint.type] == "m":
        return np.asarray(relative[..., 2, 3])
    sine, cosine = relative[..., 1, 0] - relative[..., 0, 1], relative[..., 0, 0] + relative[..., 1, 1]
    return np.asarray(np.arctan2(sine, cosine))


def connection_forces(assembly: Assembly, t: float, poses: Array, multipliers: Array) -> dict[str, tuple[Array, Array]]:
    """Force [N] and moment [N m] of each connection on its node, at the node, in the world's axes; the smallest where
    connections are redundant.
    """
    system, q = assembly.full, replace(assembly.full.start, poses=poses)
    if assembly.left_out:
        force = np.asarray(assembly.system.constraint_matrix(t, q).T @ multipliers).ravel()
        multipliers = smallest_multipliers(system, t, q, force)
    rows = system.constraint_matrix(t, q)
    found = {}
    for k, joint in enumerate(system.rows.joints):
        own = np.flatnonzero(system.rows.joint_of_row == k)
        block = rows[own][:, 6 * joint.outer : 6 * joint.outer + 6]
        wrench = -np.asarray(block.T @ multipliers[own]).ravel()
        turn = poses[joint.outer, :3, :3]
        found[joint.name] = (turn @ wrench[:3] if system.local else wrench[:3], turn @ wrench[3:])
    return found

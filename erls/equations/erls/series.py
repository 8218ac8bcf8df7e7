"""States of a chain at many times at once, in the joint-angle gauge without second-order compatibility.

With all six rows of every joint, compatibility is solved link by link: A_k q_k = X(θ_k) B_k q_{k-1}.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from erls.equations.erls.paper.compatibility import Compatibility
from erls.equations.serial.state_series import StateSeries
from erls.maths.se3 import joint_poses
from erls.maths.so3 import Array, cross_all

if TYPE_CHECKING:
    from erls.equations.erls.chain import Erls


def chain_series(chain: Erls, t: Array, y: Array, v: Array) -> StateSeries | None:
    """States of a chain.

    Parameters
    ----------
    chain : Erls
    t : (k,) array
    y, v : (k, n) arrays

    Returns
    -------
    StateSeries or None
        None where joint coordinates are no joint angles, or compatibility is of second order.
    """
    compatibility = chain.compatibility
    if type(compatibility) is not Compatibility or not all(map(compatibility.keeps_angle, range(chain.joints))):
        return None
    f = len(chain.free_joints)
    theta, rates = np.empty((2, len(t), chain.joints))
    theta[:, chain.free_joints], rates[:, chain.free_joints] = y[:, :f], v[:, :f]
    for k in chain.prescribed_joints.tolist():
        for row, at in enumerate(t.tolist()):
            theta[row, k], rates[row, k], _ = chain.mechanism.joints[k].drive.reference(at)  # type: ignore[misc]
    poses, modal = [], []
    world = np.eye(4)
    before = np.zeros((len(t), 0))  # modal coordinates of the link before
    for k, (joint, rows) in enumerate(zip(chain.mechanism.joints, compatibility.rows, strict=True)):
        motion = joint_poses(joint.type.revolute, theta[:, k])
        world = world @ (joint.before @ motion @ joint.after)
        elastic = y[:, f:][:, compatibility.layout.elastic_of[k]]
        moved = -elastic @ rows.own[:, 6:].T
        if rows.previous is not None:
            moved += _in_outer_frame(motion, before @ rows.previous.T)
        rigid = np.linalg.solve(rows.own[:, :6], moved.T).T
        before = np.hstack([rigid, elastic])
        poses.append(world)
        modal.append(before)
    return StateSeries(t, poses, modal, theta, theta, rates)


def _in_outer_frame(motion: Array, moved: Array) -> Array:
    """(k, 6) displacements and rotations X(θ) u of joint frames that were moved along the joint by poses (k, 4, 4)."""
    shift, turn = moved[:, :3], moved[:, 3:]
    shift = shift + cross_all(turn, motion[:, :3, 3])
    back = motion[:, :3, :3]  # its transpose is applied: rows of vectors from the left
    return np.concatenate([(part[:, None] @ back)[:, 0] for part in (shift, turn)], axis=1)

"""How far the coordinates of a chain move its nodes: metres per radian, per metre, per unit of a mode."""

from __future__ import annotations

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, poses


def reach_of_nodes(mechanism: Mechanism, d: Array) -> Array:
    """Largest displacement of any node per unit of each coordinate, from the initial configuration.

    Parameters
    ----------
    mechanism : Mechanism
    d : (6 links, elastic) array
        Rigid-body modal coordinates per unit of the elastic ones there.

    Returns
    -------
    (joints + elastic,) array
        Of θ, then of q_d.
    """
    joints, elastic = len(mechanism.joints), sum(link.elastic_modes for link in mechanism.links)
    theta = np.array([joint.position for joint in mechanism.joints])
    frames = poses(mechanism, theta)
    world = [
        link.model.nodes @ frame[:3, :3].T + frame[:3, 3] for link, frame in zip(mechanism.links, frames, strict=True)
    ]
    scales = np.empty(joints + elastic)
    for k, joint in enumerate(mechanism.joints):
        axis_frame = (frames[joint.parent] if joint.parent >= 0 else np.eye(4)) @ joint.before
        arms = np.vstack([world[outer] for outer in mechanism.carried(k)]) - axis_frame[:3, 3]
        reach = np.linalg.norm(np.cross(axis_frame[:3, joint.freedom.axis], arms), axis=1).max()
        scales[k] = max(reach, 1e-3) if joint.freedom.turns else 1.0
    scales[joints:] = 0.0
    first = 0
    for k, link in enumerate(mechanism.links):
        rows = d[6 * k : 6 * k + 6]
        moved = np.einsum("nim,md->nid", link.model.translation_shapes[:, :, :6], rows)
        moved[:, :, first : first + link.elastic_modes] += link.model.translation_shapes[:, :, 6:]
        size = np.linalg.norm(moved, axis=1).max(axis=0)
        scales[joints:] = np.maximum(scales[joints:], size)
        first += link.elastic_modes
    scales[joints:] = np.maximum(scales[joints:], 1e-12)
    return scales

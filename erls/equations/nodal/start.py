"""Velocities at the start of a nodal run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from erls.equations.nodal.chain import Chain
from erls.equations.nodal.nodes import Nodes
from erls.maths import motion_maps as motions
from erls.maths import rotation_maps as rotations
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.joint_types import Z


def carried_along(mechanism: Mechanism, chain: Chain, q: Nodes, rates: Sequence[float] | Array) -> Array:
    """(n,) twists of the nodes where links move rigidly with joints that have these rates."""
    v = np.zeros((chain.system.count, 6))
    moving: list[Array] = []  # links, in the world's axes, about its origin
    vectors = mechanism.rotation_vectors
    for k, (joint, seat, nodes) in enumerate(zip(mechanism.joints, chain.seats, chain.nodes, strict=True)):
        below = np.zeros(6) if joint.parent < 0 else moving[joint.parent]
        inner, outer = seat.frames(q)
        if k in vectors:
            spin = rotations.tangent(seat.vector(q)) @ np.array(rates[k : k + 3])
            below = below + motions.adjoint(outer) @ np.concatenate([np.zeros(3), spin])
        elif not joint.freedom.vector:
            below = below + motions.adjoint(inner) @ replace(joint.freedom, axis=Z).screw * rates[k]
        moving.append(below)
        v[nodes] = motions.adjoint_inverse(q.poses[nodes]) @ moving[-1]
    return v.ravel()

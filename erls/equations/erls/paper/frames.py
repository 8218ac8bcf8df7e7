"""Motion of frames on displaced nodes, with rows over (θ, q_d), in the notation of the paper: q_r = D q_d, G."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from erls.equations.erls.paper.compatibility import Compatibility
from erls.equations.serial.displaced_frame import displaced_frame
from erls.equations.serial.joint_frames import FrameMotion, attached, carried
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, jacobians, kinematics
from erls.mechanism.links import node_shape6
from erls.mechanism.loops import LoopEnd
from fe_import.model import IntArray


class Chain(Protocol):
    """What is asked of the equations of a chain."""

    mechanism: Mechanism
    joints: int
    elastic: int
    free_joints: IntArray
    stiffened: bool

    @property
    def compatibility(self) -> Compatibility:
        """Of its links."""


def displaced_frames(chain: Chain, t: float, y: Array, v: Array, ends: Sequence[LoopEnd]) -> list[FrameMotion]:
    """Frames on displaced nodes of links; accelerations of prescribed joints are within the bias."""
    mechanism, joints, elastic, f = chain.mechanism, chain.joints, chain.elastic, len(chain.free_joints)
    theta, rates, driven = np.zeros((3, joints))
    theta[chain.free_joints], rates[chain.free_joints] = y[:f], v[:f]
    for k, joint in enumerate(mechanism.joints):
        if joint.drive.prescribed:
            theta[k], rates[k], driven[k] = joint.drive.reference(t)  # type: ignore[misc]
    places = chain.compatibility.layout
    q, qd, d, g, n = chain.compatibility.acceleration(theta, rates, y[f:], v[f:])
    rigid = kinematics(mechanism, theta, rates)
    turning = jacobians(mechanism, rigid)
    bias = chain.compatibility.stack(g @ driven + n, np.zeros(elastic))
    result: list[FrameMotion] = []
    for k, node, offset in ((int(end.link or 0), end.node, end.frame) for end in ends):
        modes, at = places.modes[k], places.elastic_of[k]
        move = np.zeros((modes.stop - modes.start, joints + elastic))
        move[:6, :joints] = g[6 * k : 6 * k + 6]
        move[:6, joints:] = d[6 * k : 6 * k + 6]
        move[6:, joints + at.start : joints + at.stop] = np.eye(at.stop - at.start)
        link = mechanism.links[k]
        second = link.second_order if chain.stiffened else None
        local = displaced_frame(
            link.model.nodes[node],
            *node_shape6(link.model, node),
            q[modes],
            qd[modes],
            bias[modes],
            move,
            None if second is None else second.node(node),
        )
        rows = np.hstack([turning[k], np.zeros((6, elastic))])
        frame = FrameMotion(rigid.poses[k], rows, rigid.twists[k], rigid.biases[k] + turning[k] @ driven)
        result.append(attached(carried(frame, local), offset))
    return result

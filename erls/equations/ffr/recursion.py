"""The velocity transformation: twists of all floating frames from joint and elastic coordinates, link by link.

The frame of link k stands in that of link k-1 at S = H_out(η_{k-1}) · O · joint(θ_k) · I · H_in(η_k)⁻¹ with the
displaced interface nodes H and constant poses O, I. Hence ν_k = X ν_{k-1} + j_k with X = Ad(S⁻¹) and

    j_k = G_parent η̇_{k-1} + s θ̇_k + G_own η̇_k,    ν̇_k = X ν̇_{k-1} + [X ν_{k-1}, j_k] + d/dt j_k.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.equations.ffr.interface_motion import InterfaceMotion
from erls.maths.se3 import inverse, joint_pose, pose, twist_transform
from erls.maths.so3 import Array, cross
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link, node_shape6
from fe_import.model import InterfaceNode


def node_motion(link: Link, node: int, basis: Array, stiffened: bool) -> InterfaceMotion:
    """Motion of a node of a link whose elastic coordinates stand for the fields ``basis`` (m, n)."""
    translation, rotation = node_shape6(link.model, node)
    second = None
    if stiffened and link.second_order is not None:
        second = basis.T @ link.second_order.node(node) @ basis
    return InterfaceMotion(link.model.nodes[node], translation @ basis, rotation @ basis, second)


def bracket(a: Array, b: Array) -> Array:
    """(6,) Lie bracket of two twists [v; ω]."""
    return np.concatenate([cross(a[3:], b[:3]) + cross(a[:3], b[3:]), cross(a[3:], b[3:])])


@dataclass(frozen=True)
class Step:
    """From link k-1 (or the ground) to link k.

    Attributes
    ----------
    pose, transform : (4, 4), (6, 6) arrays
        S and X.
    joint : (6,) array
        s.
    parent, own : (6, n) arrays or None
        G of the elastic coordinates of either link; None where they move nothing.
    twist, bias : (6,) arrays
        j, and its derivative at θ̈ = 0, η̈ = 0.
    """

    pose: Array
    transform: Array
    joint: Array
    parent: Array | None
    own: Array | None
    twist: Array
    bias: Array


class Recursion:
    """Constant data of the steps along a chain.

    Parameters
    ----------
    mechanism : Mechanism
    bases : list of (6 + n, n) arrays
        Of every link, see `elastic_basis`.
    body_frame : str
        With ``tangent`` the inboard node rests in its floating frame.
    stiffened : bool
        Whether interface nodes move by second-order displacements, too.
    """

    def __init__(self, mechanism: Mechanism, bases: list[Array], body_frame: str, stiffened: bool = False) -> None:
        self.joints = mechanism.joints
        self.before: list[Array] = []
        self.after: list[Array] = []
        self.screws: list[Array] = []
        self.outboard: list[InterfaceMotion | None] = []  # of the parent
        self.inboard: list[InterfaceMotion | None] = []

        def node(k: int, interface: InterfaceNode) -> InterfaceMotion | None:
            if not bases[k].shape[1]:
                return None
            return node_motion(mechanism.links[k], interface.node, bases[k], stiffened)

        for k, (joint, link) in enumerate(zip(mechanism.joints, mechanism.links, strict=True)):
            parent = mechanism.links[k - 1].outboard if k else None
            self.outboard.append(None if parent is None else node(k - 1, parent))
            self.inboard.append(None if body_frame == "tangent" else node(k, link.inboard))
            before, after = joint.before, joint.after
            if parent is not None and self.outboard[k] is not None:
                before = pose(position=-parent.position) @ before
            if self.inboard[k] is not None:
                after = after @ pose(position=link.inboard.position)
            self.before.append(before)
            self.after.append(after)
            self.screws.append(twist_transform(after) @ joint.type.screw)

    def step(
        self, k: int, coordinate: float, joint_rate: float, parent: tuple[Array, Array], own: tuple[Array, Array]
    ) -> Step:
        """Step ``k`` at a joint coordinate and its rate, and (η, η̇) of both links."""
        place = self.before[k] @ joint_pose(self.joints[k].type.revolute, coordinate) @ self.after[k]
        joint, twist, bias = self.screws[k], self.screws[k] * joint_rate, np.zeros(6)
        from_parent = from_own = None
        if (outboard := self.outboard[k]) is not None:
            node = outboard.at(*parent)
            carry = twist_transform(place)
            place = node.pose @ place
            from_parent = carry @ node.jacobian
            carried = from_parent @ parent[1]
            bias = carry @ node.bias + bracket(carried, twist)
            twist = twist + carried
        if (inboard := self.inboard[k]) is not None:
            node = inboard.at(*own)
            back = inverse(node.pose)
            carry = twist_transform(back)
            place = place @ back
            from_own = -carry @ node.jacobian
            added, carried = from_own @ own[1], carry @ twist
            joint = carry @ joint
            from_parent = None if from_parent is None else carry @ from_parent
            bias = carry @ (bias - node.bias) + bracket(carried, added)
            twist = carried + added
        return Step(place, twist_transform(place), joint, from_parent, from_own, twist, bias)

"""Compatibility at the joints with finite rotations and second-order displacements: C(θ) q + e(θ, q_d) = 0.

The frames fixed to both links in a joint are displaced by u and turned by exp φ. To second order

- a frame at an arm p from its interface node moves by ½ φ × (φ × p) and by the second-order field of the node;
- along a slide of length s the outer frame moves by ½ φ × (φ × s);
- where a row along the joint's freedom is free, the outer frame is the inner one moved along that freedom in the inner
  frame's displaced axes: -½ φ₋ × φ of a turn, -φ₋ × (u - u₋) of a slide.

Their sum e is evaluated at the q of the linear compatibility, of which it is a quadratic form; what is left out is of
third order. Its derivatives are exact, so energy is conserved.

The turn of a link with the tip of the one before it is cut here after second order, too; FFR takes it whole. While
joints turn, the kinetic energy differs by ω q² q̇: within 0.4 s from an undeformed start the shoulder torque of the
two-link robot (0.73 N m at its peak) is 3.6e-3 N m off that of exact beams in ERLS, 0.75e-3 N m in FFR.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.equations.erls.paper.compatibility import Compatibility, compatibility_matrix
from erls.maths.se3 import inverse, pose
from erls.maths.so3 import Array, skew
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link, node_shape6
from fe_import.model import InterfaceNode
from fe_import.second_order.composition import twice_turned


@dataclass(frozen=True)
class Jet:
    """A vector that depends on (θ, q_d): value, gradient (k, joints + elastic), rate, and its second derivative in time
    at θ̈ = 0, q̈_d = 0.
    """

    value: Array
    slope: Array
    rate: Array
    bias: Array

    def __add__(self, other: Jet) -> Jet:
        return Jet(*(a + b for a, b in zip(self.parts, other.parts, strict=True)))

    def __sub__(self, other: Jet) -> Jet:
        return Jet(*(a - b for a, b in zip(self.parts, other.parts, strict=True)))

    @property
    def parts(self) -> tuple[Array, Array, Array, Array]:
        """Value, slope, rate, bias."""
        return self.value, self.slope, self.rate, self.bias

    def mapped(self, matrix: Array) -> Jet:
        """A constant matrix times this."""
        return Jet(*(matrix @ part for part in self.parts))

    def turned(self, transforms: tuple[Array, Array, Array], joint: int, rate: float) -> Jet:
        """A matrix of θ_joint, with its first and second derivative, times this."""
        x, first, second = transforms
        slope = x @ self.slope
        slope[:, joint] += first @ self.value
        bias = x @ self.bias + 2 * rate * (first @ self.rate) + rate**2 * (second @ self.value)
        return Jet(x @ self.value, slope, x @ self.rate + rate * (first @ self.value), bias)

    def crossed(self, other: Jet, factor: float) -> Jet:
        """``factor`` times the cross product with another, 3-vectors both."""
        a, b = factor * skew(self.value), factor * skew(other.value)
        bias = a @ other.bias - b @ self.bias + 2 * factor * (skew(self.rate) @ other.rate)
        return Jet(a @ other.value, a @ other.slope - b @ self.slope, a @ other.rate - b @ self.rate, bias)


def squared(tensor: Array, q: Jet) -> Jet:
    """½ qᵀ T q of a (k, m, m) tensor, symmetric in its last indices."""
    slope = tensor @ q.value
    bias = slope @ q.bias + (tensor @ q.rate) @ q.rate
    return Jet(slope @ q.value / 2, slope @ q.slope, slope @ q.rate, bias)


def frame_second_order(link: Link, interface: InterfaceNode, frame: Array) -> Array | None:
    """(6, m, m) second-order displacement and rotation vector of a frame that moves rigidly with an interface, in its
    axes; None where it has none.

    Parameters
    ----------
    link : Link
    interface : InterfaceNode
    frame : (4, 4) array
        Undeformed pose of that frame in the mesh frame.
    """
    if link.second_order is None:
        return None
    arm = pose(position=-interface.position) @ frame
    offset, back = arm[:3, 3], arm[:3, :3].T
    moved = link.second_order.node(interface.node)
    _, phi = node_shape6(link.model, interface.node)
    u = moved[:3] - np.einsum("ij,jab->iab", skew(offset), moved[3:]) + twice_turned(phi, offset)
    result = np.concatenate([np.einsum("ij,jab->iab", back, part) for part in (u, moved[3:])])
    return result if np.abs(result).max(initial=0.0) > 0 else None


class SecondOrderCompatibility(Compatibility):
    """`Compatibility` with second-order terms; the same questions are asked of it."""

    def __init__(self, mechanism: Mechanism, gauge: str) -> None:
        super().__init__(mechanism, gauge)
        self.constant = False
        self.own: list[Array | None] = []
        self.previous: list[Array | None] = []
        for k, (joint, link) in enumerate(zip(mechanism.joints, mechanism.links, strict=True)):
            self.own.append(frame_second_order(link, link.inboard, inverse(joint.after)))
            before = mechanism.links[k - 1]
            outboard = joint.seat
            found = None if outboard is None else frame_second_order(before, outboard, joint.before)
            self.previous.append(found)

    def _extra(self, theta: Array, rates: Array, q: Jet) -> Jet:
        """e over all rows, from the modal coordinates of the linear compatibility."""
        size = q.slope.shape[1]
        zero = Jet(np.zeros(6), np.zeros((6, size)), np.zeros(6), np.zeros(6))
        blocks: list[Jet] = []
        for k, row in enumerate(self.rows):
            own = _part(q, self.layout.modes[k])
            result = zero
            tensor = self.own[k]
            if tensor is not None:
                result = result + squared(tensor, own)
            if row.previous is not None:
                inner = _part(q, self.layout.modes[k - 1])
                x = row.transform(float(theta[k]))
                transforms = x, -row.bracket @ x, row.bracket @ row.bracket @ x
                tensor = self.previous[k]
                if tensor is not None:
                    result = result - squared(tensor, inner).turned(transforms, k, float(rates[k]))
                if not row.revolute or len(row.kept) < 6:
                    moved = inner.mapped(row.previous).turned(transforms, k, float(rates[k]))
                    result = result + _joint_terms(row.revolute, len(row.kept) < 6, moved, own.mapped(row.own),
                                                   (k, float(theta[k]), float(rates[k])))  # fmt: skip
            blocks.append(Jet(*(part[row.kept] for part in result.parts)))
        return Jet(*(np.concatenate(parts) for parts in zip(*(b.parts for b in blocks), strict=True)))

    def displacement(self, theta: Array, q_d: Array) -> tuple[Array, Array]:
        """q (size,) and ∂q_r/∂q_d at a configuration."""
        return self.velocity(theta, q_d)[:2]

    def velocity(self, theta: Array, q_d: Array) -> tuple[Array, Array, Array]:
        """q (size,), ∂q_r/∂q_d and ∂q_r/∂θ at a configuration."""
        q, _, d, g, _ = self.acceleration(theta, np.zeros_like(theta), q_d, np.zeros_like(q_d))
        return q, d, g

    def acceleration(
        self, theta: Array, rates: Array, q_d: Array, qd_d: Array
    ) -> tuple[Array, Array, Array, Array, Array]:
        """q, q̇ (size,), ∂q_r/∂q_d, ∂q_r/∂θ, and the quadratic term n (6 links,)."""
        joints, rigid = len(self.rows), self.layout.rigid
        q, qd, d, g, n = super().acceleration(theta, rates, q_d, qd_d)
        slope = np.zeros((self.layout.size, joints + len(q_d)))
        slope[rigid, :joints], slope[rigid, joints:] = g, d
        slope[self.layout.elastic, joints:] = np.eye(len(q_d))
        extra = self._extra(theta, rates, Jet(q, slope, qd, self.stack(n, np.zeros(len(q_d)))))
        _, right, d = self.elimination(theta)
        back = right.pseudo_inverse
        q = self.stack(q[rigid] - back @ extra.value, q_d)
        d = d - back @ extra.slope[:, joints:]
        first = compatibility_matrix(self.rows, self.layout, theta, 1)
        g = -back @ (self._by_joint(first, q) + extra.slope[:, :joints])
        if right.null_projector is not None:
            mu = back.T @ q[rigid]
            along = right.null_projector @ self._by_joint_transposed(first[:, rigid], mu)
            g += along
        qd_r = d @ qd_d + g @ rates
        qd = self.stack(qd_r, qd_d)
        second = compatibility_matrix(self.rows, self.layout, theta, 2)
        h = self._by_joint(second, q) @ rates**2
        n = -back @ (h + 2 * self._by_joint(first, qd) @ rates + extra.bias)
        if right.null_projector is not None:
            mu_rate = back.T @ (qd_r - self._by_joint_transposed(first[:, rigid], mu) @ rates)
            n += right.null_projector @ (
                2 * self._by_joint_transposed(first[:, rigid], mu_rate) @ rates
                + self._by_joint_transposed(second[:, rigid], mu) @ rates**2
            )
        return q, qd, d, g, n


def _part(q: Jet, modes: slice) -> Jet:
    return Jet(*(part[modes] for part in q.parts))


def _joint_terms(revolute: bool, free: bool, inner: Jet, outer: Jet, joint: tuple[int, float, float]) -> Jet:
    """What the finite motion of a joint adds: of a slide's length, and along a freedom whose row is free.

    ``joint``: its number, coordinate and rate; ``inner`` and ``outer`` are the displacements of its frames.
    """
    still = [np.zeros_like(part[:3]) for part in inner.parts]
    phi = Jet(*(part[3:] for part in inner.parts))
    slide, turn = Jet(*still), Jet(*still)
    if not revolute:
        number, length, rate = joint
        along = Jet(*(part.copy() for part in still))
        along.value[2], along.rate[2] = length, rate
        along.slope[2, number] = 1.0
        slide = phi.crossed(phi.crossed(along, -0.5), 1.0)
        if free:
            slide = slide + phi.crossed(
                Jet(*(a[:3] - b[:3] for a, b in zip(outer.parts, inner.parts, strict=True))), -1.0
            )
    elif free:
        turn = phi.crossed(Jet(*(part[3:] for part in outer.parts)), -0.5)
    return Jet(*(np.concatenate(parts) for parts in zip(slide.parts, turn.parts, strict=True)))


def second_order_compatibility(mechanism: Mechanism, gauge: str) -> Compatibility:
    """With the second-order terms, where there are any."""
    found = SecondOrderCompatibility(mechanism, gauge)
    alone = len(found.rows) == 1 and found.own[0] is None
    return Compatibility(mechanism, gauge) if alone else found

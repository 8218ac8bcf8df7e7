"""Compatibility of the displacements at the joints, C(θ) q = 0 (ERLS-CMS paper, eq. 3-24).

Block row k states that the frame fixed to link k in joint k is displaced like the frame fixed to link k-1, in the
axes of the former:

    A_k q_k - X(θ_k) B_k q_{k-1} = 0,

with A_k, B_k constant (rows: displacement u, rotation φ) and X(θ) = exp(-θ ad ξ) the change of joint frame. Under
the joint-angle gauge all six rows stand; under the minimum-norm gauge the row along the joint's freedom is dropped,
C_r has fewer rows than columns, and the pseudo-inverse picks the smallest rigid-body displacement. A joint with
prescribed motion has no freedom: all its six rows stand in either gauge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.maths.se3 import inverse, twist_cross, twist_transform
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.joint_types import PRISMATIC, REVOLUTE
from fe_import.model import IntArray

GAUGES = ("joint-angle", "minimum-norm")


@dataclass(frozen=True)
class JointRows:
    """The block row of one joint.

    Attributes
    ----------
    revolute : bool
    bracket : (6, 6) array
        ad ξ.
    own, previous : (6, m_k), (6, m_{k-1}) arrays
        A_k and B_k; ``previous`` is None on the ground.
    kept : int array
        Rows of the compatibility condition.
    free_row : int
        Row along the joint's freedom.
    """

    revolute: bool
    bracket: Array
    own: Array
    previous: Array | None
    kept: IntArray
    free_row: int

    def transform(self, coordinate: float) -> Array:
        """(6, 6) X(θ)."""
        return twist_transform((REVOLUTE if self.revolute else PRISMATIC).pose(coordinate))


@dataclass(frozen=True)
class Layout:
    """Where the coordinates stand: q = (rigid-body, elastic) of all links, stacked.

    Attributes
    ----------
    modes : tuple of slice
        All modal coordinates of each link within q.
    rigid, elastic : int arrays
        Places of q_r and q_d within q.
    elastic_of : tuple of slice
        Elastic coordinates of each link within q_d.
    """

    modes: tuple[slice, ...]
    rigid: IntArray
    elastic: IntArray
    elastic_of: tuple[slice, ...]

    @property
    def size(self) -> int:
        """Number of modal coordinates."""
        return len(self.rigid) + len(self.elastic)


def layout(mechanism: Mechanism) -> Layout:
    """Layout of the modal coordinates of a mechanism."""
    modes, elastic_of, rigid, elastic = [], [], [], []
    at = elastic_at = 0
    for link in mechanism.links:
        n = link.elastic_modes
        modes.append(slice(at, at + 6 + n))
        elastic_of.append(slice(elastic_at, elastic_at + n))
        rigid.append(at + np.arange(6))
        elastic.append(at + 6 + np.arange(n))
        at, elastic_at = at + 6 + n, elastic_at + n
    return Layout(tuple(modes), np.concatenate(rigid), np.concatenate(elastic), tuple(elastic_of))


def joint_rows(mechanism: Mechanism, gauge: str) -> tuple[JointRows, ...]:
    """Constant blocks of the compatibility condition of every joint."""
    result: list[JointRows] = []
    for k, (joint, link) in enumerate(zip(mechanism.joints, mechanism.links, strict=True)):
        own = link.interface_shape(link.inboard, inverse(joint.after))
        previous = None
        if k > 0:
            before = mechanism.links[k - 1]
            previous = before.interface_shape(joint.seat, joint.before)  # type: ignore[arg-type]
        all_rows = gauge == "joint-angle" or joint.drive.prescribed
        kept = np.arange(6) if all_rows else np.delete(np.arange(6), joint.freedom.row)
        result.append(
            JointRows(joint.freedom.turns, twist_cross(joint.freedom.screw), own, previous, kept, joint.freedom.row)
        )
    return tuple(result)


def compatibility_matrix(rows: tuple[JointRows, ...], places: Layout, theta: Array, order: int = 0) -> Array:
    """C(θ), or its derivatives stacked joint by joint.

    Parameters
    ----------
    rows : tuple of JointRows
    places : Layout
    theta : (n,) array
    order : int
        0 gives C. For 1 or 2 each block row k is differentiated that often with respect to its own θ_k; no block
        row depends on another coordinate, so ∂C/∂θ_k is block row k of the result, and mixed derivatives vanish.

    Returns
    -------
    (v, size) array
    """
    result = np.zeros((sum(len(row.kept) for row in rows), places.size))
    at = 0
    for k, row in enumerate(rows):
        block = result[at : at + len(row.kept)]
        at += len(row.kept)
        if order == 0:
            block[:, places.modes[k]] = row.own[row.kept]
        if row.previous is not None:
            x = row.transform(theta[k])
            for _ in range(order):
                x = -row.bracket @ x
            block[:, places.modes[k - 1]] = -(x @ row.previous)[row.kept]
    return result


@dataclass(frozen=True)
class RightInverse:
    """C_r⁺ and the projector on the null space of C_r (through the QR factors of C_rᵀ, where C_r is not square)."""

    pseudo_inverse: Array
    null_projector: Array | None  # None when C_r is square: the null space is empty


def right_inverse(c_r: Array) -> RightInverse:
    """Right pseudo-inverse of a matrix of full row rank (paper, before eq. 11)."""
    if c_r.shape[0] == c_r.shape[1]:
        return RightInverse(np.asarray(np.linalg.inv(c_r), dtype=float), None)
    q, r = np.linalg.qr(c_r.T)
    return RightInverse(q @ np.linalg.inv(r).T, np.eye(len(q)) - q @ q.T)


class Compatibility:
    """The elimination q_r = D(θ) q_d with its first and second derivatives in time.

    q̇_r = D q̇_d + G θ̇ and q̈_r = D q̈_d + G θ̈ + n. For a square C_r these are the paper's D = -C_r⁺C_d,
    G = -C_r⁺E (eq. 11-15) and n = -C_r⁺(h + 2c) (eq. 23). For the minimum-norm gauge the derivative of the
    pseudo-inverse itself is kept, so that G = ∂(D q_d)/∂θ and energy is conserved: with μ = C_r⁺ᵀ q_r,
    q_r = C_rᵀ μ is differentiated together with C q = 0.
    """

    def __init__(self, mechanism: Mechanism, gauge: str) -> None:
        self.layout = layout(mechanism)
        self.rows = joint_rows(mechanism, gauge)
        ends = np.cumsum([len(r.kept) for r in self.rows])
        self.row_of = tuple(slice(e - len(r.kept), e) for e, r in zip(ends, self.rows, strict=True))
        # on the ground nothing depends on θ: one link has a constant elimination
        self.constant = len(self.rows) == 1
        self._fixed: tuple[Array, RightInverse, Array] | None = None

    def elimination(self, theta: Array) -> tuple[Array, RightInverse, Array]:
        """C_r (v, 6 links), its right inverse, and D (6 links, elastic coordinates)."""
        if self._fixed is not None:
            return self._fixed
        c = compatibility_matrix(self.rows, self.layout, theta)
        c_r, c_d = c[:, self.layout.rigid], c[:, self.layout.elastic]
        inverse_r = right_inverse(c_r)
        result = c_r, inverse_r, -inverse_r.pseudo_inverse @ c_d
        if self.constant:
            self._fixed = result
        return result

    def stack(self, q_r: Array, q_d: Array) -> Array:
        """(size,) q from its rigid-body and elastic parts."""
        q = np.empty(self.layout.size)
        q[self.layout.rigid] = q_r
        q[self.layout.elastic] = q_d
        return q

    def _by_joint(self, block_rows: Array, factor: Array) -> Array:
        """(v, n): column k holds block row k of ``block_rows`` @ ``factor``."""
        product = block_rows @ factor
        result = np.zeros((len(product), len(self.rows)))
        for k, rows in enumerate(self.row_of):
            result[rows, k] = product[rows]
        return result

    def _by_joint_transposed(self, rigid_rows: Array, mu: Array) -> Array:
        """(6 links, n): column k holds (∂C_r/∂θ_k)ᵀ μ."""
        result = np.zeros((rigid_rows.shape[1], len(self.rows)))
        for k, rows in enumerate(self.row_of):
            result[:, k] = rigid_rows[rows].T @ mu[rows]
        return result

    def displacement(self, theta: Array, q_d: Array) -> tuple[Array, Array]:
        """q (size,) and D at a configuration."""
        _, _, d = self.elimination(theta)
        return self.stack(d @ q_d, q_d), d

    def velocity(self, theta: Array, q_d: Array) -> tuple[Array, Array, Array]:
        """q (size,), D (6 links, elastic) and G (6 links, joints) at a configuration."""
        _, right, d = self.elimination(theta)
        return self._velocity(theta, q_d, right, d)[:3]

    def _velocity(self, theta: Array, q_d: Array, right: RightInverse, d: Array) -> tuple[Array, Array, Array, Array]:
        """q, D, G and ∂C/∂θ."""
        q = self.stack(d @ q_d, q_d)
        if self.constant:
            return q, d, np.zeros((d.shape[0], 1)), np.zeros((0, 0))
        first = compatibility_matrix(self.rows, self.layout, theta, 1)
        g = -right.pseudo_inverse @ self._by_joint(first, q)
        if right.null_projector is not None:
            mu = right.pseudo_inverse.T @ q[self.layout.rigid]
            g += right.null_projector @ self._by_joint_transposed(first[:, self.layout.rigid], mu)
        return q, d, g, first

    def acceleration(
        self, theta: Array, rates: Array, q_d: Array, qd_d: Array
    ) -> tuple[Array, Array, Array, Array, Array]:
        """q, q̇ (size,), D, G, and the quadratic term n (6 links,)."""
        _, right, d = self.elimination(theta)
        q, d, g, first = self._velocity(theta, q_d, right, d)
        qd_r = d @ qd_d + g @ rates
        qd = self.stack(qd_r, qd_d)
        if self.constant:
            return q, qd, d, g, np.zeros(len(qd_r))
        second = compatibility_matrix(self.rows, self.layout, theta, 2)
        h = self._by_joint(second, q) @ rates**2
        c = self._by_joint(first, qd) @ rates
        n = -right.pseudo_inverse @ (h + 2 * c)
        if right.null_projector is not None:
            rigid = self.layout.rigid
            mu = right.pseudo_inverse.T @ q[rigid]
            turning = self._by_joint_transposed(first[:, rigid], mu) @ rates
            mu_rate = right.pseudo_inverse.T @ (qd_r - turning)
            n += right.null_projector @ (
                2 * self._by_joint_transposed(first[:, rigid], mu_rate) @ rates
                + self._by_joint_transposed(second[:, rigid], mu) @ rates**2
            )
        return q, qd, d, g, n

    def joint_displacement(self, k: int, theta_k: float, order: int = 0) -> tuple[Array, Array | None]:
        """Elastic displacement along joint k's own freedom, per modal coordinate: (m_k,) and (m_{k-1},).

        The physical joint angle is θ_k + own · q_k + previous · q_{k-1}. It is zero where that row is kept.
        """
        row = self.rows[k]
        own = row.own[row.free_row] if order == 0 else np.zeros(row.own.shape[1])
        if row.previous is None:
            return own, None
        x = row.transform(theta_k)
        for _ in range(order):
            x = -row.bracket @ x
        return own, -(x[row.free_row] @ row.previous)

    def keeps_angle(self, k: int) -> bool:
        """Whether the coordinate of joint k is its physical angle."""
        return len(self.rows[k].kept) == 6

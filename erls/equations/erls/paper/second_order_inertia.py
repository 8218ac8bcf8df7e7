"""Inertia and weight of a link with its second-order displacement ½ qᵀ Ψ q, for ERLS: geometric stiffening.

Of the velocity of that displacement the kinetic energy needs, to second order in q, what it has in common with
rigid-body motions: the momenta, with ν = [v; ω] the twist of the link's frame and the tensors of
`fe_import.modal.second_order`,

    h = C q̇ + H ν,   C = [S_ab q; qᵀ P],   H = [0, -S̃; 0, ½ qᵀ W q],   S = ½ qᵀ S_ab q.

They are those of a rigid-body motion with twist M₀⁻¹ h, M₀ the mass matrix of the undeformed link, so that

    T = T₁(ν + M₀⁻¹ h, q, q̇)

with the kinetic energy T₁ of the linear modes (`erls.equations.erls.paper.link_inertia`): positive for any q, and
with forces
that conserve energy. Weight adds -g·S to the potential. Beside rigid-body motion of the frame itself what acts on q is

    (S_ab q)·(v̇ + ω × v - g) + α_c P_cᵀ q + ω_c (P_cᵀ - P_c) q̇ - ω_c ω_d W_cd q.

What that velocity has in common with the elastic modes is the effect ``modal_inertia``, see `ModalInertia`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from erls.equations.erls.paper.link_inertia import LinkInertia
from erls.maths.so3 import Array, cross, skew
from erls.mechanism.second_order import LinkSecondOrder

if TYPE_CHECKING:
    from erls.equations.serial.modal_inertia import ModalInertia

_NO_INERTIA = 1e-12  # of the largest: a massless link has no direction to divide by


class _Terms(NamedTuple):
    """C (6, m), W q (9, m), H (6, 6) and S (3,) at modal coordinates."""

    coupling: Array
    spin: Array
    turning: Array
    moment: Array


class SecondOrderInertia:
    """A link's inertia with second-order terms; asked the same questions as `LinkInertia`."""

    def __init__(
        self, linear: LinkInertia, rigid_mass: Array, data: LinkSecondOrder, modal: ModalInertia | None = None
    ) -> None:
        n = linear.size
        self.linear, self.size, self.modal = linear, n, modal
        self._compliance = compliance(rigid_mass)
        turning = data.momentum[3:]
        self._odd = np.ascontiguousarray((turning - turning.transpose(0, 2, 1)) / 2).reshape(3 * n, n)
        # q meets the first index of the momenta
        self._rows = np.concatenate([data.momentum.transpose(0, 2, 1), data.spin.reshape(9, n, n)]).reshape(15 * n, n)

    def _terms(self, q: Array) -> _Terms:
        rows = (self._rows @ q).reshape(15, self.size)
        moment = rows[:3] @ q / 2
        return _Terms(rows[:6], rows[6:], _turning(moment, rows[6:] @ q / 2), moment)

    def forces(self, twist: Array, twist_rate: Array, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
        """Inertia forces; see `LinkInertia.forces`."""
        coupling, spin, turning, _ = self._terms(q)
        coupling_rate = (self._rows[: 6 * self.size] @ qd).reshape(6, self.size)
        turning_rate = _turning(coupling[:3] @ qd, spin @ qd)
        full = twist + self._compliance @ (coupling @ qd + turning @ twist)
        momenta = coupling @ qdd + coupling_rate @ qd + turning @ twist_rate + turning_rate @ twist
        wrench, modal = self.linear.forces(full, twist_rate + self._compliance @ momenta, q, qd, qdd)

        momentum = self.linear.mass_matrix(q)[:6] @ np.concatenate([full, qd])
        change = wrench - _transported(full, momentum)
        share, share_rate = self._compliance @ momentum, self._compliance @ change
        result = change + share_rate @ turning + share @ turning_rate
        result += _transported(twist, momentum + share @ turning)
        modal = modal + share_rate @ coupling - np.multiply.outer(share[3:], twist[3:]).ravel() @ spin
        modal -= 2 * (share[3:] @ (self._odd @ qd).reshape(3, self.size)) + cross(share[:3], twist[3:]) @ coupling[:3]
        return result, modal if self.modal is None else modal + self.modal.forces(q, qd, qdd)

    def mass_matrix(self, q: Array) -> Array:
        """(6 + m, 6 + m) mass matrix of (ν, q̇)."""
        coupling, _, turning, _ = self._terms(q)
        change = np.eye(6 + self.size)
        change[:6, :6] += self._compliance @ turning
        change[:6, 6:] = self._compliance @ coupling
        result = change.T @ self.linear.mass_matrix(q) @ change
        if self.modal is not None:
            result[6:, 6:] += self.modal.mass_matrix(q)
        return np.asarray(result)

    def gravity(self, g: Array, q: Array) -> tuple[Array, Array]:
        """Wrench and modal forces of gravity; see `LinkInertia.gravity`."""
        wrench, modal = self.linear.gravity(g, q)
        coupling, _, _, moment = self._terms(q)
        wrench[3:] += cross(moment, g)
        return wrench, modal + g @ coupling[:3]

    def gravity_energy(self, g: Array, world: Array, q: Array) -> float:
        """Potential energy; see `LinkInertia.gravity_energy`."""
        return self.linear.gravity_energy(g, world, q) - float(g @ (world[:3, :3] @ self._terms(q).moment))

    def kinetic_energy(self, twist: Array, q: Array, qd: Array) -> float:
        """T at a state."""
        coupling, _, turning, _ = self._terms(q)
        momenta = coupling @ qd + turning @ twist
        result = self.linear.kinetic_energy(twist + self._compliance @ momenta, q, qd)
        return result if self.modal is None else result + self.modal.kinetic_energy(q, qd)


def compliance(rigid_mass: Array) -> Array:
    """(6, 6) M₀⁻¹; nothing along what has no inertia."""
    return np.asarray(np.linalg.pinv(rigid_mass, rcond=_NO_INERTIA, hermitian=True))


def _turning(moment: Array, square: Array) -> Array:
    """(6, 6) H from S and the nine components of ½ qᵀ W q."""
    result = np.zeros((6, 6))
    result[:3, 3:] = -skew(moment)
    result[3:, 3:] = square.reshape(3, 3)
    return result


def _transported(twist: Array, momentum: Array) -> Array:
    """(6,) ad* of a twist on a momentum."""
    turned = cross(twist[3:], momentum[3:]) + cross(twist[:3], momentum[:3])
    return np.concatenate([cross(twist[3:], momentum[:3]), turned])

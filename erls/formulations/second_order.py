"""Inertia and weight of a link with its second-order displacement ½ qᵀ Ψ q, for ERLS: geometric stiffening.

Of the velocity of that displacement the kinetic energy needs, to second order in q, what it has in common with
rigid-body motions: the momenta, with ν = [v; ω] the twist of the link's frame and the tensors of
`fe_import.second_order.data`,

    h = C q̇ + ½ M ν,   C = [S_ab q; qᵀ P],   M = [0, -S̃; S̃, qᵀ W q],   S = ½ qᵀ S_ab q.

They are those of a rigid-body motion with twist M₀⁻¹ h, M₀ the mass matrix of the undeformed link, so that

    T = T₁(ν + M₀⁻¹ h, q, q̇)

with the kinetic energy T₁ of the linear modes (`erls.formulations.link_inertia`): positive for any q, and with forces
that conserve energy. Weight adds -g·S to the potential. Beside rigid-body motion of the frame itself what acts on q is

    (S_ab q)·(v̇ + ω × v - g) + α_c P_cᵀ q + ω_c (P_cᵀ - P_c) q̇ - ω_c ω_d W_cd q.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.formulations.link_inertia import LinkInertia
from erls.lie.so3 import Array, cross, skew
from erls.mechanism.second_order import LinkSecondOrder

_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
_PLACES = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])  # of each axis pair in _PAIRS
_NO_INERTIA = 1e-12  # of the largest: a massless link has no direction to divide by


class _Terms(NamedTuple):
    """C (6, m), W q (6 pairs, m) and S (3,) at modal coordinates."""

    coupling: Array
    spin: Array
    moment: Array


class SecondOrderInertia:
    """A link's inertia with second-order terms; asked the same questions as `LinkInertia`."""

    def __init__(self, linear: LinkInertia, rigid_mass: Array, data: LinkSecondOrder) -> None:
        n = linear.size
        self.linear, self.size = linear, n
        self._compliance = np.linalg.pinv(rigid_mass, rcond=_NO_INERTIA, hermitian=True)  # M₀⁻¹
        turning = data.momentum[3:]
        self._odd = np.ascontiguousarray((turning - turning.transpose(0, 2, 1)) / 2).reshape(3 * n, n)
        spin = np.stack([data.spin[c, d] for c, d in _PAIRS])
        # q meets the first index of the momenta
        self._rows = np.concatenate([data.momentum.transpose(0, 2, 1), spin]).reshape(12 * n, n)

    def _terms(self, q: Array) -> _Terms:
        rows = (self._rows @ q).reshape(12, self.size)
        return _Terms(rows[:6], rows[6:], rows[:3] @ q / 2)

    @staticmethod
    def _mass(moment: Array, square: Array) -> Array:
        """(6, 6) M from S and the six components of qᵀ W q."""
        result = np.zeros((6, 6))
        result[3:, :3] = skew(moment)
        result[:3, 3:] = -result[3:, :3]
        result[3:, 3:] = square[_PLACES]
        return result

    def forces(self, twist: Array, twist_rate: Array, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
        """Inertia forces; see `LinkInertia.forces`."""
        coupling, spin, moment = self._terms(q)
        coupling_rate = (self._rows[: 6 * self.size] @ qd).reshape(6, self.size)
        mass = self._mass(moment, spin @ q)
        mass_rate = self._mass(coupling[:3] @ qd, 2 * (spin @ qd))
        full = twist + self._compliance @ (coupling @ qd + mass @ twist / 2)
        momenta = coupling @ qdd + coupling_rate @ qd + (mass @ twist_rate + mass_rate @ twist) / 2
        wrench, modal = self.linear.forces(full, twist_rate + self._compliance @ momenta, q, qd, qdd)

        momentum = self.linear.mass_matrix(q)[:6] @ np.concatenate([full, qd])
        change = wrench - _transported(full, momentum)
        share, share_rate = self._compliance @ momentum, self._compliance @ change
        result = change + (mass @ share_rate + mass_rate @ share) / 2
        result += _transported(twist, momentum + mass @ share / 2)
        products = np.array([share[3 + c] * twist[3 + d] + share[3 + d] * twist[3 + c] for c, d in _PAIRS])
        products[:3] /= 2
        modal = modal + share_rate @ coupling - products @ spin
        modal -= 2 * (share[3:] @ (self._odd @ qd).reshape(3, self.size))
        modal -= (cross(share[:3], twist[3:]) + cross(twist[:3], share[3:])) @ coupling[:3] / 2
        return result, modal

    def mass_matrix(self, q: Array) -> Array:
        """(6 + m, 6 + m) mass matrix of (ν, q̇)."""
        coupling, spin, moment = self._terms(q)
        change = np.eye(6 + self.size)
        change[:6, :6] += self._compliance @ self._mass(moment, spin @ q) / 2
        change[:6, 6:] = self._compliance @ coupling
        return np.asarray(change.T @ self.linear.mass_matrix(q) @ change)

    def gravity(self, g: Array, q: Array) -> tuple[Array, Array]:
        """Wrench and modal forces of gravity; see `LinkInertia.gravity`."""
        wrench, modal = self.linear.gravity(g, q)
        coupling, _, moment = self._terms(q)
        wrench[3:] += cross(moment, g)
        return wrench, modal + g @ coupling[:3]

    def gravity_energy(self, g: Array, world: Array, q: Array) -> float:
        """Potential energy; see `LinkInertia.gravity_energy`."""
        return self.linear.gravity_energy(g, world, q) - float(g @ (world[:3, :3] @ self._terms(q).moment))

    def kinetic_energy(self, twist: Array, q: Array, qd: Array) -> float:
        """T at a state."""
        coupling, spin, moment = self._terms(q)
        momenta = coupling @ qd + self._mass(moment, spin @ q) @ twist / 2
        return self.linear.kinetic_energy(twist + self._compliance @ momenta, q, qd)


def _transported(twist: Array, momentum: Array) -> Array:
    """(6,) ad* of a twist on a momentum."""
    turned = cross(twist[3:], momentum[3:]) + cross(twist[:3], momentum[:3])
    return np.concatenate([cross(twist[3:], momentum[:3]), turned])

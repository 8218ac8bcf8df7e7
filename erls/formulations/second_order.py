"""Forces of the second-order displacement ½ qᵀ Ψ q of a link, for ERLS: inertia, weight and geometric stiffening.

To T and V of the linear modes (`erls.formulations.link_inertia`) are added, with ν = [v; ω] the twist of the link's
frame and the tensors of `fe_import.second_order.data`,

    T₂ = v·(Ṡ + ω × S) + ω_c qᵀ P_c q̇ + ½ ω_c ω_d qᵀ W_cd q,   V₂ = -g·S,   S = ½ qᵀ S_ab q.

With b = v̇ + ω × v - g the Boltzmann-Hamel equations give on q

    (S_ab q)·b + α_c P_cᵀ q + ω_c (P_cᵀ - P_c) q̇ - ω_c ω_d W_cd q,

which is stiffness by acceleration, weight and rotation; and a wrench on the frame. Products of second-order
displacements with first-order ones, of third order in q, are left out of T, so energy is conserved.
"""

from __future__ import annotations

import numpy as np

from erls.lie.so3 import Array, cross, skew
from erls.mechanism.second_order import LinkSecondOrder

_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
_PLACES = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])  # of each axis pair in _PAIRS


class SecondOrderInertia:
    """The tensors of a link, laid out for evaluation."""

    def __init__(self, data: LinkSecondOrder) -> None:
        n = data.momentum.shape[1]
        self.size = n
        turning = data.momentum[3:]
        turned = turning.transpose(0, 2, 1)
        parts = [data.momentum[:3], (turning + turned) / 2, np.stack([data.spin[c, d] for c, d in _PAIRS])]
        self._symmetric = np.concatenate(parts).reshape(12 * n, n)  # S, even part of P, W
        self._odd = np.ascontiguousarray((turning - turned) / 2).reshape(3 * n, n)
        self._inner = self._symmetric[: 6 * n]

    def _at(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """S q (3, m), even and odd P q (3, m), and W q (6, m)."""
        even = (self._symmetric @ q).reshape(12, self.size)
        return even[:3], even[3:6], (self._odd @ q).reshape(3, self.size), even[6:]

    def forces(
        self, twist: Array, twist_rate: Array, g: Array, q: Array, qd: Array, qdd: Array
    ) -> tuple[Array, Array]:
        """Inertia forces less weight, as in `LinkInertia.forces` and `LinkInertia.gravity`.

        Parameters
        ----------
        twist, twist_rate : (6,) arrays
            ν and its derivative in the link's frame.
        g : (3,) array
            Gravity in its axes.
        q, qd, qdd : (m,) arrays

        Returns
        -------
        wrench : (6,) array
        modal : (m,) array
        """
        omega, alpha = twist[3:], twist_rate[3:]
        sq, even, odd, wq = self._at(q)
        inner = (self._inner @ qd).reshape(6, self.size) @ qd
        pull = twist_rate[:3] + cross(omega, twist[:3]) - g
        s, sd = sq @ q / 2, sq @ qd
        sdd = sq @ qdd + inner[:3]
        spin, spin_rate = (wq @ q)[_PLACES], (wq @ qd)[_PLACES]
        turning = (even - odd) @ qd + spin @ omega  # (P_c q)_b = q_a P_c,ab: of the odd part minus P q
        wrench = np.empty(6)
        wrench[:3] = sdd + cross(alpha, s) + cross(omega, 2 * sd + cross(omega, s))
        wrench[3:] = cross(s, pull) + inner[3:] + (even - odd) @ qdd + spin @ alpha + 2 * (spin_rate @ omega)
        wrench[3:] += cross(omega, turning)
        squares = np.array([omega[c] * omega[d] * (1 if c == d else 2) for c, d in _PAIRS])
        modal = pull @ sq + alpha @ (even - odd) - squares @ wq
        modal -= 2 * (omega @ self._odd_rows(qd))
        return wrench, modal

    def _odd_rows(self, qd: Array) -> Array:
        return (self._odd @ qd).reshape(3, self.size)

    def mass_matrix(self, q: Array) -> Array:
        """(6 + m, 6 + m) what is added to the mass matrix of (ν, q̇)."""
        n = self.size
        sq, even, odd, wq = self._at(q)
        s = skew(sq @ q / 2)
        result = np.zeros((6 + n, 6 + n))
        result[:3, 3:6], result[3:6, :3] = -s, s
        result[3:6, 3:6] = (wq @ q)[_PLACES]
        result[:3, 6:], result[3:6, 6:] = sq, even - odd
        result[6:, :6] = result[:6, 6:].T
        return result

    def kinetic_energy(self, twist: Array, q: Array, qd: Array) -> float:
        """T₂."""
        omega = twist[3:]
        sq, even, odd, wq = self._at(q)
        slide = sq @ qd + cross(omega, sq @ q / 2)
        return float(twist[:3] @ slide + omega @ ((even - odd) @ qd) + omega @ (wq @ q)[_PLACES] @ omega / 2)

    def gravity_energy(self, g: Array, turn: Array, q: Array) -> float:
        """V₂ in the gravity vector ``g`` (world axes) with the frame turned by ``turn`` (3, 3)."""
        return -float(g @ (turn @ (self._at(q)[0] @ q))) / 2

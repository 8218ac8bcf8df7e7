"""Standard data of the second-order displacement ½ ηᵀ Ψ η: what it adds to mass matrix, momentum and weight of a body.

With the tensors of `fe_import.second_order.data` in the elastic coordinates, S = ½ ηᵀ S_ab η,

    M₂(η) = [0, -S̃; S̃, ηᵀ W η],   C₂(η) = [S_ab η; ηᵀ P]

are added to the blocks of T = ½ νᵀ M ν + νᵀ C η̇ + ½ η̇ᵀ M_e η̇, and S to the first moment. Their forces are geometric
stiffening (O. Wallrapp and R. Schwertassek, Int. J. Numer. Methods Eng. 32 (1991) 1833-1850).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.lie.so3 import Array, cross, skew
from erls.mechanism.second_order import LinkSecondOrder


class Terms(NamedTuple):
    """M₂ (6, 6), C₂ (6, n), the gradient of ½ ωᵀWω (3, 3, n) and S (3,) at elastic coordinates."""

    mass: Array
    coupling: Array
    spin: Array
    moment: Array


class SecondOrderData:
    """Second-order tensors of one body in its elastic coordinates.

    Parameters
    ----------
    data : LinkSecondOrder
    basis : (m, n) array
        Modal coordinates of the field of each elastic coordinate.
    """

    def __init__(self, data: LinkSecondOrder, basis: Array) -> None:
        n = basis.shape[1]
        self.size = n
        momentum = basis.T @ data.momentum @ basis
        self._momentum = momentum
        # from the left, η meets the first index
        self._left = np.ascontiguousarray(momentum.transpose(0, 2, 1)).reshape(6 * n, n)
        self._right = np.ascontiguousarray(momentum).reshape(6 * n, n)
        self._spin = np.ascontiguousarray(basis.T @ data.spin @ basis).reshape(9 * n, n)

    def terms(self, eta: Array) -> Terms:
        """What is added at elastic coordinates η."""
        coupling = (self._left @ eta).reshape(6, self.size)
        spin = (self._spin @ eta).reshape(3, 3, self.size)
        moment = coupling[:3] @ eta / 2
        return Terms(self._mass(moment, spin @ eta), coupling, spin, moment)

    @staticmethod
    def _mass(moment: Array, square: Array) -> Array:
        result = np.zeros((6, 6))
        result[3:, :3] = skew(moment)
        result[:3, 3:] = -result[3:, :3]
        result[3:, 3:] = square
        return result

    def forces(
        self, twist: Array, twist_rate: Array, g: Array, eta: Array, rate: Array, acceleration: Array
    ) -> tuple[Array, Array]:
        """Inertia forces less weight: (6,) wrench about the frame's origin and (n,) forces on η; see `StandardData`.

        ``g`` (3,) is gravity in the frame's axes.
        """
        omega, now = twist[3:], self.terms(eta)
        coupling_rate = (self._left @ rate).reshape(6, self.size)
        mass_rate = self._mass(now.coupling[:3] @ rate, 2 * (now.spin @ rate))
        momentum = now.mass @ twist + now.coupling @ rate
        wrench = now.mass @ twist_rate + now.coupling @ acceleration + mass_rate @ twist + coupling_rate @ rate
        wrench[:3] += cross(omega, momentum[:3])
        wrench[3:] += cross(omega, momentum[3:]) + cross(twist[:3], momentum[:3])
        wrench[3:] -= cross(now.moment, g)
        elastic = now.coupling.T @ twist_rate + coupling_rate.T @ twist
        elastic -= twist @ (self._right @ rate).reshape(6, self.size)  # νᵀ C₂ η̇
        elastic -= cross(twist[:3], omega) @ now.coupling[:3]  # v·(ω × S)
        elastic -= np.multiply.outer(omega, omega).ravel() @ now.spin.reshape(9, self.size)
        return wrench, elastic - g @ now.coupling[:3]

    def kinetic_energy(self, twist: Array, eta: Array, rate: Array) -> float:
        """What is added to T."""
        now = self.terms(eta)
        return float(twist @ now.mass @ twist / 2 + twist @ (now.coupling @ rate))

    def gravity_energy(self, g: Array, turn: Array, eta: Array) -> float:
        """What is added to the potential in the gravity vector ``g`` (world axes), the frame turned by ``turn``."""
        return -float(g @ (turn @ self.terms(eta).moment))

"""Standard data of a body with its second-order displacement ½ ηᵀ Ψ η: geometric stiffening.

Beside the blocks of T = ½ νᵀ M ν + νᵀ C η̇ + ½ η̇ᵀ M_e η̇ the second-order displacement has, with the tensors of
`fe_import.modal.second_order` in the elastic coordinates,

    C₂(η) = [S_ab η; ηᵀ P],   H(η) = [0, -S̃; 0, ½ ηᵀ W η],   S = ½ ηᵀ S_ab η

(O. Wallrapp and R. Schwertassek, Int. J. Numer. Methods Eng. 32 (1991) 1833-1850). Added to C and M as C₂ and H + Hᵀ
they could make the mass matrix indefinite where elastic motion cancels that of the frame. The frame's twist is
corrected instead, ν' = ν + M₀⁻¹ (C₂ η̇ + H ν), which gives the same to second order in η and stays positive. The forces
on η and on the frame are those of Lagrange and of Boltzmann and Hamel in the uncorrected twist.
"""

from __future__ import annotations

import numpy as np

from erls.equations.ffr.standard_data import StandardData
from erls.equations.serial.modal_inertia import ModalInertia
from erls.maths.se3 import twist_cross
from erls.maths.so3 import Array, cross, skew
from erls.mechanism.second_order import LinkSecondOrder


class SecondOrderData(StandardData):
    """Standard data of one body with second-order terms.

    Attributes
    ----------
    bend : (6, n, n) array
        S_ab and P: C₂ is ηᵀ times each.
    spin : (3, 3, n, n) array
        W.
    per_mass : (6, 6) array
        M₀⁻¹.
    """

    linear: StandardData

    def __init__(
        self, linear: StandardData, data: LinkSecondOrder, basis: Array, modal: ModalInertia | None = None
    ) -> None:
        self.__dict__.update(linear.__dict__)
        self.linear, self.modal = linear, modal
        n = linear.size
        self.bend = np.ascontiguousarray(basis.T @ data.momentum @ basis)
        self.spin = np.ascontiguousarray(basis.T @ data.spin @ basis)
        self.per_mass = np.linalg.inv(linear.rigid)
        self._spin = self.spin.reshape(9 * n, n)

    def _at(self, eta: Array) -> tuple[Array, Array, Array]:
        """C₂ (6, n), H (6, 6) and W η (9, n)."""
        coupling = eta @ self.bend
        spin = (self._spin @ eta).reshape(9, self.size)
        return coupling, self._block(coupling[:3] @ eta / 2, spin @ eta / 2), spin

    @staticmethod
    def _block(moment: Array, square: Array) -> Array:
        result = np.zeros((6, 6))
        result[:3, 3:] = -skew(moment)
        result[3:, 3:] = square.reshape(3, 3)
        return result

    def forces(
        self, twist: Array, twist_rate: Array, eta: Array, rate: Array, acceleration: Array
    ) -> tuple[Array, Array]:
        """Inertia forces; see `StandardData.forces`."""
        coupling, block, spin = self._at(eta)
        coupling_rate = rate @ self.bend
        block_rate = self._block(coupling[:3] @ rate, spin @ rate)
        corrected = twist + self.per_mass @ (coupling @ rate + block @ twist)
        added = coupling @ acceleration + coupling_rate @ rate + block @ twist_rate + block_rate @ twist
        wrench, elastic = self.linear.forces(corrected, twist_rate + self.per_mass @ added, eta, rate, acceleration)
        momentum = self.linear.momentum(corrected, eta, rate)
        change = wrench + twist_cross(corrected).T @ momentum  # d/dt of the momentum: ad* = -adᵀ
        carried, carried_rate = self.per_mass @ momentum, self.per_mass @ change
        total = momentum + carried @ block
        wrench = change + carried @ block_rate + carried_rate @ block - twist_cross(twist).T @ total

        # d/dt (C₂ᵀ λ) less the gradient of λ·(C₂ η̇ + H ν) at fixed λ = M₀⁻¹ p
        elastic = elastic + carried_rate @ coupling + carried @ coupling_rate
        elastic -= carried @ (self.bend @ rate)
        elastic -= cross(carried[:3], twist[3:]) @ coupling[:3]
        elastic -= np.multiply.outer(carried[3:], twist[3:]).ravel() @ spin
        return wrench, elastic if self.modal is None else elastic + self.modal.forces(eta, rate, acceleration)

    def mass_matrix(self, eta: Array) -> Array:
        """(6 + n, 6 + n) mass matrix of (ν, η̇)."""
        coupling, block, _ = self._at(eta)
        mass = self.linear.mass_matrix(eta)
        change = np.hstack([np.eye(6) + self.per_mass @ block, self.per_mass @ coupling])
        result = change.T @ mass[:6, :6] @ change
        result[:, 6:] += change.T @ mass[:6, 6:]
        result[6:] += mass[6:, :6] @ change
        result[6:, 6:] += mass[6:, 6:]
        if self.modal is not None:
            result[6:, 6:] += self.modal.mass_matrix(eta)
        return np.asarray(result)

    def kinetic_energy(self, twist: Array, eta: Array, rate: Array) -> float:
        """T."""
        velocity = np.concatenate([twist, rate])
        return float(velocity @ self.mass_matrix(eta) @ velocity / 2)

    def momentum(self, twist: Array, eta: Array, rate: Array) -> Array:
        """(6,) ∂T/∂ν: linear momentum, and angular momentum about the frame's origin, in its axes."""
        return np.asarray(self.mass_matrix(eta)[:6] @ np.concatenate([twist, rate]))

    def weight(self, g: Array, eta: Array) -> tuple[Array, Array]:
        """Wrench and elastic forces of gravity; see `StandardData.weight`."""
        wrench, elastic = self.linear.weight(g, eta)
        pull = eta @ self.bend[:3]
        wrench[3:] += cross(pull @ eta / 2, g)
        return wrench, elastic + g @ pull

    def gravity_energy(self, g: Array, world: Array, eta: Array) -> float:
        """Potential energy; see `StandardData.gravity_energy`."""
        moment = eta @ self.bend[:3] @ eta / 2
        return self.linear.gravity_energy(g, world, eta) - float(g @ (world[:3, :3] @ moment))

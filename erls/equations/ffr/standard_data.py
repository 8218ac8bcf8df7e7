"""Standard input data of a flexible body: its inertia as a polynomial of second order in the elastic coordinates.

With η the elastic coordinates, B the modes they stand for and ν = [v; ω] the twist of the floating frame, in its axes,
the nodal velocities give, for any mass matrix,

    T = ½ νᵀ M(η) ν + νᵀ C(η) η̇ + ½ η̇ᵀ M_e η̇,
    M(η) = M₀ + M₁ η + ηᵀ M₂ η,   C(η) = C₀ + C₁ η

(O. Wallrapp, Mech. Struct. & Mach. 22 (1994) 283-304: mdCM, J, Ct, Cr, Me; A. A. Shabana, Dynamics of Multibody
Systems, ch. 5). M₁ fills the rows and columns of ω, M₂ its block, C₁ its rows. The forces are the Boltzmann-Hamel
equations of T. Of these forces five parts may be left out (`erls.mechanism.effects`):

- ``centrifugal_load``: -½ νᵀ M₁ ν on η;
- ``coriolis``: what C₁ does on η by η̇ and ω;
- ``inertia_first_order``: what C₁ does on η by ω̇, and all of M₁ and C₁ in the frame's wrench;
- ``inertia_second_order``: all of M₂ in the frame's wrench;
- ``spin_softening``: -ωᵀ M₂ η ω on η.
"""

from __future__ import annotations

from collections.abc import Set

import numpy as np

from erls.maths.so3 import Array, cross
from erls.mechanism.effects import ALL
from fe_import.modal.inertia import InertiaInvariants


class StandardData:
    """Inertia and weight of one body in its floating frame.

    Parameters
    ----------
    invariants : InertiaInvariants
        Of the link, in the modes of its modal file, payloads included.
    basis : (m, n) array
        B: modal coordinates of the field of each elastic coordinate.
    effects : set of str
        Those that are on; what is off is not computed.

    Attributes
    ----------
    rigid : (6, 6) array
        M₀.
    coupling : (6, n) array
        C₀; its first rows are the first moment ∫ρ u per elastic coordinate.
    elastic : (n, n) array
        M_e.
    half, turned, square : (3, 6, n), (3, n, n), (3, 3, n, n) arrays
        Half of M₁, C₁ and M₂, each with the axes of rotation first.
    """

    def __init__(self, invariants: InertiaInvariants, basis: Array, effects: Set[str] = ALL) -> None:
        n = basis.shape[1]
        self.size = n
        self.centrifugal, self.coriolis = "centrifugal_load" in effects, "coriolis" in effects
        self.first_order, self.second_order = "inertia_first_order" in effects, "inertia_second_order" in effects
        self.softening = "spin_softening" in effects
        fields = invariants.rigid
        self.rigid = fields.T @ invariants.m @ fields
        self.coupling = fields.T @ invariants.m @ basis
        self.elastic = basis.T @ invariants.m @ basis
        self.half = np.stack([fields.T @ x @ basis for x in invariants.X])
        self.turned = np.stack([basis.T @ x @ basis for x in invariants.X])
        z = invariants.Z
        self.square = np.einsum("mi,abmk,kj->abij", basis, (z + z.transpose(0, 1, 3, 2)) / 2, basis, optimize=True)
        self._half = self.half.reshape(18, n)
        self._turned = self.turned.reshape(3, n * n)
        self._linear = np.vstack([self._half, self.turned.reshape(3 * n, n)])
        self._square = self.square.reshape(9 * n, n)
        self.mass = float(np.trace(self.rigid[:3, :3]) / 3)
        moment = self.rigid[3:, :3]
        self.first_moment = np.array([moment[2, 1], moment[0, 2], moment[1, 0]])

    def frame_mass(self, eta: Array) -> Array:
        """(6, 6) M(η)."""
        half = (self._half @ eta).reshape(3, 6) if self.first_order else None
        square = (self._square @ eta).reshape(3, 3, self.size) @ eta if self.second_order else None
        return self._frame_mass(half, square)

    def _frame_mass(self, half: Array | None, square: Array | None) -> Array:
        result = self.rigid.copy()
        if half is not None:
            result[3:] += half
            result[:, 3:] += half.T
        if square is not None:
            result[3:, 3:] += square
        return result

    def frame_coupling(self, eta: Array) -> Array:
        """(6, n) C(η)."""
        result = self.coupling.copy()
        if self.first_order:
            result[3:] += (self._linear[18:] @ eta).reshape(3, self.size)
        return result

    def forces(
        self, twist: Array, twist_rate: Array, eta: Array, rate: Array, acceleration: Array
    ) -> tuple[Array, Array]:
        """Inertia forces.

        Parameters
        ----------
        twist, twist_rate : (6,) arrays
            ν and its derivative.
        eta, rate, acceleration : (n,) arrays
            Elastic coordinates and their derivatives.

        Returns
        -------
        wrench : (6,) array
            Force and moment about the frame's origin, in its axes: ṗ + ad*(ν) p with the momentum p = ∂T/∂ν.
        elastic : (n,) array
            d/dt ∂T/∂η̇ - ∂T/∂η.
        """
        n, omega = self.size, twist[3:]
        coupling, half, square = self.coupling, None, None
        if self.first_order or self.coriolis:
            linear = self._linear @ np.stack((eta, rate), axis=1)
            turned, turned_rate = linear[18:, 0].reshape(3, n), linear[18:, 1].reshape(3, n)
        if self.first_order:
            half, half_rate = linear[:18, 0].reshape(3, 6), linear[:18, 1].reshape(3, 6)
            coupling = coupling.copy()
            coupling[3:] += turned
        if self.second_order or self.softening:
            square = (self._square @ eta).reshape(3, 3, n)
        mass = self._frame_mass(half, square @ eta if square is not None and self.second_order else None)

        momentum = mass @ twist + coupling @ rate
        wrench = mass @ twist_rate + coupling @ acceleration
        if self.first_order:
            wrench += half_rate.T @ omega  # Ṁ ν and Ċ η̇
            wrench[3:] += half_rate @ twist + turned_rate @ rate
        if square is not None and self.second_order:
            wrench[3:] += 2 * ((square @ rate) @ omega)
        wrench[:3] += cross(omega, momentum[:3])
        wrench[3:] += cross(omega, momentum[3:]) + cross(twist[:3], momentum[:3])

        elastic = coupling.T @ twist_rate + self.elastic @ acceleration
        if self.coriolis:
            elastic += omega @ turned_rate - rate @ (omega @ self._turned).reshape(n, n)
        if self.centrifugal:
            elastic -= np.multiply.outer(omega, twist).ravel() @ self._half
        if square is not None and self.softening:
            elastic -= np.multiply.outer(omega, omega).ravel() @ square.reshape(9, n)
        return wrench, elastic

    def mass_matrix(self, eta: Array) -> Array:
        """(6 + n, 6 + n) mass matrix of (ν, η̇)."""
        result = np.empty((6 + self.size, 6 + self.size))
        result[:6, :6] = self.frame_mass(eta)
        result[:6, 6:] = self.frame_coupling(eta)
        result[6:, :6] = result[:6, 6:].T
        result[6:, 6:] = self.elastic
        return result

    def momentum(self, twist: Array, eta: Array, rate: Array) -> Array:
        """(6,) linear momentum, and angular momentum about the frame's origin, in its axes."""
        return np.asarray(self.frame_mass(eta) @ twist + self.frame_coupling(eta) @ rate)

    def kinetic_energy(self, twist: Array, eta: Array, rate: Array) -> float:
        """T."""
        velocity = np.concatenate([twist, rate])
        return float(0.5 * velocity @ self.mass_matrix(eta) @ velocity)

    def weight(self, g: Array, eta: Array) -> tuple[Array, Array]:
        """Wrench and elastic forces of gravity ``g`` in the frame's axes.

        The moment takes the first moment of the deformed body: without its elastic part the weight would be wrong in
        first order of the deflection.
        """
        moment = self.first_moment + self.coupling[:3] @ eta
        return np.concatenate([self.mass * g, cross(moment, g)]), self.coupling[:3].T @ g

    def gravity_energy(self, g: Array, world: Array, eta: Array) -> float:
        """Potential energy in the gravity vector ``g`` (world axes) with the frame at ``world`` (4, 4)."""
        moment = self.first_moment + self.coupling[:3] @ eta
        return -float(g @ (self.mass * world[:3, 3] + world[:3, :3] @ moment))

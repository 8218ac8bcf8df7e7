"""Inertia forces of one flexible link in its own frame, from its kinetic energy.

With q the modal coordinates, ν = [v; ω] the twist of the link's frame and s = q̇ + ρ ν:

    T = ½ sᵀ m s + Σ_a ω_a sᵀ X_a q + ½ Σ_ab ω_a ω_b qᵀ Z_ab q

(see `fe_import.inertia`). The forces follow from the Boltzmann-Hamel equations of T, so energy is conserved for any
mass matrix, commuting with nodal rotations or not.
"""

from __future__ import annotations

import numpy as np

from erls.lie.so3 import Array, cross, skew
from fe_import.inertia import InertiaInvariants


class LinkInertia:
    """The invariants of a link, laid out for evaluation."""

    def __init__(self, invariants: InertiaInvariants) -> None:
        size = len(invariants.m)
        self.size = size
        self.m = invariants.m
        self.rigid = invariants.rigid
        self.x = np.ascontiguousarray(invariants.X)
        self.x_rows = self.x.reshape(3 * size, size)
        self.x_flat = self.x.reshape(3, size * size)
        self.z_rows = np.ascontiguousarray(invariants.Z).reshape(9 * size, size)
        rigid_mass = invariants.rigid_mass_matrix
        self.mass = float(np.trace(rigid_mass[:3, :3]) / 3)
        moment = rigid_mass[3:, :3]
        self.first_moment = np.array([moment[2, 1], moment[0, 2], moment[1, 0]])
        self.first_moment_shape = (self.rigid[:, :3].T @ self.m).copy()  # (3, m): ∫ρ u per modal coordinate

    def forces(self, twist: Array, twist_rate: Array, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
        """Inertia forces.

        Parameters
        ----------
        twist, twist_rate : (6,) arrays
            ν and its derivative in the link's frame.
        q, qd, qdd : (m,) arrays
            Modal coordinates and their derivatives.

        Returns
        -------
        wrench : (6,) array
            d/dt ∂T/∂ν + ad*: force and moment about the frame's origin, link axes.
        modal : (m,) array
            d/dt ∂T/∂q̇ - ∂T/∂q.
        """
        n = self.size
        omega, alpha = twist[3:], twist_rate[3:]
        s = qd + self.rigid @ twist
        sd = qdd + self.rigid @ twist_rate
        xq = (self.x_rows @ q).reshape(3, n)
        xqd = (self.x_rows @ qd).reshape(3, n)
        zq = (self.z_rows @ q).reshape(3, 3, n)
        zqq, zqqd = zq @ q, zq @ qd
        x_omega = (omega @ self.x_flat).reshape(n, n)

        momentum = self.m @ s + omega @ xq
        momentum_rate = self.m @ sd + alpha @ xq + omega @ xqd
        spin = xq @ s + zqq @ omega
        spin_rate = xq @ sd + xqd @ s + zqq @ alpha + (zqqd + zqqd.T) @ omega
        p = self.rigid.T @ momentum
        p[3:] += spin
        wrench = self.rigid.T @ momentum_rate
        wrench[3:] += spin_rate
        wrench[:3] += cross(omega, p[:3])
        wrench[3:] += cross(omega, p[3:]) + cross(twist[:3], p[:3])
        softening = np.einsum("a,abm,b->m", omega, zq, omega)
        return wrench, momentum_rate - s @ x_omega - softening

    def mass_matrix(self, q: Array) -> Array:
        """(6 + m, 6 + m) mass matrix of (ν, q̇) at the modal coordinates ``q``."""
        n = self.size
        xq = (self.x_rows @ q).reshape(3, n)
        zqq = (self.z_rows @ q).reshape(3, 3, n) @ q
        result = np.empty((6 + n, 6 + n))
        coupling = self.m @ self.rigid
        coupling[:, 3:] += xq.T
        turning = np.zeros((6, 6))
        turning[:, 3:] = self.rigid.T @ xq.T
        rigid = self.rigid.T @ self.m @ self.rigid + turning + turning.T
        rigid[3:, 3:] += (zqq + zqq.T) / 2
        result[:6, :6] = rigid
        result[6:, :6] = coupling
        result[:6, 6:] = coupling.T
        result[6:, 6:] = self.m
        return result

    def gravity(self, g: Array, q: Array) -> tuple[Array, Array]:
        """Wrench about the frame's origin and modal forces of a gravity vector ``g`` in link axes."""
        moment = self.first_moment + self.first_moment_shape @ q
        return np.concatenate([self.mass * g, cross(moment, g)]), self.first_moment_shape.T @ g

    def gravity_energy(self, g: Array, world: Array, q: Array) -> float:
        """Potential energy in the gravity vector ``g`` (world axes) at world pose ``world``."""
        moment = self.first_moment + self.first_moment_shape @ q
        return -float(g @ (self.mass * world[:3, 3] + world[:3, :3] @ moment))

    def kinetic_energy(self, twist: Array, q: Array, qd: Array) -> float:
        """T at a state."""
        s = qd + self.rigid @ twist
        omega = twist[3:]
        xq = (self.x_rows @ q).reshape(3, self.size)
        zqq = (self.z_rows @ q).reshape(3, 3, self.size) @ q
        return float(0.5 * s @ self.m @ s + omega @ (xq @ s) + 0.5 * omega @ zqq @ omega)


def moment_about(wrench: Array, point: Array) -> Array:
    """(6,) the wrench [force; moment] with its moment about ``point`` instead of the origin."""
    return np.concatenate([wrench[:3], wrench[3:] - skew(point) @ wrench[:3]])

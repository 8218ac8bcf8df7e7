"""Inertia forces of one flexible link in its own frame, from its kinetic energy.

With q the modal coordinates, ν = [v; ω] the twist of the link's frame and s = q̇ + ρ ν:

    T = ½ sᵀ m s + Σ_a ω_a sᵀ X_a q + ½ Σ_ab ω_a ω_b qᵀ Z_ab q

(see `fe_import.modal.inertia`). The forces follow from the Boltzmann-Hamel equations of T, so energy is conserved
for any mass matrix, commuting with nodal rotations or not. Of these forces five parts may be left out
(`erls.mechanism.effects`), with s₀ = ρ ν, X_ω = Σ_a ω_a X_a and α = ω̇:

- ``centrifugal_load``: -X_ωᵀ s₀ on the modes;
- ``coriolis``: X_ω q̇ - X_ωᵀ q̇ on the modes;
- ``inertia_first_order``: Σ_a α_a X_a q on the modes, and all of X in the frame's wrench;
- ``inertia_second_order``: all of Z in the frame's wrench;
- ``spin_softening``: -Σ_ab ω_a ω_b Z_ab q on the modes.

The first three come from the second term of T, the others from the third. Energy is conserved when each term is there
with all forces that do work, or with none; ``coriolis`` does none.
"""

from __future__ import annotations

from collections.abc import Set

import numpy as np

from erls.maths.so3 import Array, cross, skew
from erls.mechanism.effects import ALL
from fe_import.modal.inertia import InertiaInvariants


class LinkInertia:
    """The invariants of a link, laid out for evaluation; of the effects only those in ``effects`` are computed."""

    def __init__(self, invariants: InertiaInvariants, effects: Set[str] = ALL) -> None:
        size = len(invariants.m)
        self.size = size
        self.centrifugal, self.coriolis = "centrifugal_load" in effects, "coriolis" in effects
        self.first_order, self.second_order = "inertia_first_order" in effects, "inertia_second_order" in effects
        self.softening = "spin_softening" in effects
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
        momentum, rate = self.m @ s, self.m @ sd
        if self.first_order:
            xq = (self.x_rows @ q).reshape(3, n)
            momentum += omega @ xq
            rate += alpha @ xq
        modal = rate
        if self.first_order or self.coriolis:
            xqd = (self.x_rows @ qd).reshape(3, n)
            turning = rate + omega @ xqd
            rate, modal = turning if self.first_order else rate, turning if self.coriolis else rate
        if self.centrifugal or self.coriolis:
            moving = s if self.centrifugal and self.coriolis else qd if self.coriolis else self.rigid @ twist
            modal = modal - moving @ (omega @ self.x_flat).reshape(n, n)
        p = self.rigid.T @ momentum
        wrench = self.rigid.T @ rate
        if self.first_order:
            p[3:] += xq @ s
            wrench[3:] += xq @ sd + xqd @ s
        if self.second_order or self.softening:
            zq = (self.z_rows @ q).reshape(3, 3, n)
        if self.second_order:
            zqq, zqqd = zq @ q, zq @ qd
            p[3:] += zqq @ omega
            wrench[3:] += zqq @ alpha + (zqqd + zqqd.T) @ omega
        if self.softening:
            modal = modal - np.einsum("a,abm,b->m", omega, zq, omega)
        wrench[:3] += cross(omega, p[:3])
        wrench[3:] += cross(omega, p[3:]) + cross(twist[:3], p[:3])
        return wrench, modal

    def mass_matrix(self, q: Array) -> Array:
        """(6 + m, 6 + m) mass matrix of (ν, q̇) at the modal coordinates ``q``."""
        n = self.size
        result = np.empty((6 + n, 6 + n))
        coupling = self.m @ self.rigid
        rigid = self.rigid.T @ self.m @ self.rigid
        if self.first_order:
            xq = (self.x_rows @ q).reshape(3, n)
            coupling[:, 3:] += xq.T
            turning = np.zeros((6, 6))
            turning[:, 3:] = self.rigid.T @ xq.T
            rigid += turning + turning.T
        if self.second_order:
            zqq = (self.z_rows @ q).reshape(3, 3, n) @ q
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
        result = 0.5 * s @ self.m @ s
        if self.first_order:
            result += omega @ ((self.x_rows @ q).reshape(3, self.size) @ s)
        if self.second_order:
            result += 0.5 * omega @ ((self.z_rows @ q).reshape(3, 3, self.size) @ q) @ omega
        return float(result)


def moment_about(wrench: Array, point: Array) -> Array:
    """(6,) the wrench [force; moment] with its moment about ``point`` instead of the origin."""
    return np.concatenate([wrench[:3], wrench[3:] - skew(point) @ wrench[:3]])

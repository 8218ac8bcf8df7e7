"""Inertia of the elastic modes that changes with the deformation, through their displacements ½ qᵀ Ψ q.

With K of `fe_import.modal.second_order` the kinetic energy of a link holds q̇_c K_cab q_a q̇_b, the velocity of second
order times that of the elastic modes. What second-order momenta h = C q̇ contribute already, as those of a rigid-body
motion (`erls.equations.erls.paper.bent`), is taken off: k = K(q) q̇ - Φᵀm ρ M₀⁻¹ h. Then

    T₃ = q̇ₑ·k + ½ kᵀ σ⁻¹ k = ½ |q̇ₑ + σ⁻¹ k|² - ½ |q̇ₑ|²   (norms with σ)

adds to T, with the rates q̇ₑ of the elastic modes and σ their mass matrix when the rest of the link moves freely. The
last term is of fourth order; with it the mass matrix of the modes stays positive.

Links that ring have q ~ ε, q̇ ~ √ε and q̈ ~ 1 with ε the deflection over the length, 1/E: their Lagrangian starts with ε,
and the work of loads on ½ qᵀ Ψ q is of ε². So is T₃. Without it forces are wrong by a share of ε and displacements by
ε², as two body frames of one link show; with it what is left is of third order in the displacements, ω q² q̇ ~ ε^(5/2):
forces agree to ε^(3/2), and displacements to ε^(5/2) over a given number of vibrations.
"""

from __future__ import annotations

from collections.abc import Set

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link
from erls.mechanism.second_order import LinkSecondOrder
from fe_import.modal.inertia import InertiaInvariants

_NO_INERTIA = 1e-12  # of the largest: a thin link may have none about its axis, a massless one has none at all


class ModalInertia:
    """T₃ of one link.

    Parameters
    ----------
    invariants : InertiaInvariants
        Payloads included.
    data : LinkSecondOrder
    basis : (m, k) array, optional
        Modal coordinates, in the modes of the link, of each coordinate; the modes themselves without it.

    Attributes
    ----------
    tensor : (n, m, m) array
        K less what second-order momenta contribute.
    per_mass : (n, n) array
        σ⁻¹.
    """

    def __init__(self, invariants: InertiaInvariants, data: LinkSecondOrder, basis: Array | None = None) -> None:
        shared = (invariants.m @ invariants.rigid)[6:]
        share = np.linalg.lstsq(invariants.rigid_mass_matrix, shared.T, rcond=_NO_INERTIA)[0]
        tensor = data.modal - np.tensordot(share.T, data.momentum, 1)
        tensor = tensor if basis is None else basis.T @ tensor @ basis
        self.elastic, self.size = tensor.shape[:2]
        self.tensor = tensor
        rigid, coupling, own = invariants.m[:6, :6], invariants.m[:6, 6:], invariants.m[6:, 6:]
        moved = np.linalg.lstsq(rigid, coupling, rcond=_NO_INERTIA)[0]
        self.per_mass = np.linalg.inv(own - coupling.T @ moved)


def stiffened(mechanism: Mechanism) -> bool:
    """Whether second-order displacements enter the equations."""
    return "geometric_stiffening" in mechanism.effects and any(
        link.second_order is not None and link.elastic_modes for link in mechanism.links
    )


def compliance(rigid_mass: Array) -> Array:
    """(6, 6) M₀⁻¹ of an undeformed link; nothing along what has no inertia."""
    return np.asarray(np.linalg.pinv(rigid_mass, rcond=_NO_INERTIA, hermitian=True))


def modal_inertia(link: Link, effects: Set[str], basis: Array | None = None) -> ModalInertia | None:
    """That of a link, where the effect is on and there is any."""
    if "modal_inertia" not in effects or not link.elastic_modes or link.second_order is None:
        return None
    return ModalInertia(link.invariants, link.second_order, basis)

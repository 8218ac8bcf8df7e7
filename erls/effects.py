"""The registry of physical effects: what a scene may leave out of its equations of motion.

With q the modal coordinates of a link, ν = [v; ω] the twist of its frame, s = q̇ + ρ ν and the inertia invariants m, X,
Z (`fe_import.inertia`), the inertia forces fall into what always acts (m with itself) and five parts that may be left
out; their formulas are those of `erls.formulations.link_inertia`. Adding an effect means one line here and one block
where it acts: in `erls.formulations` for what enters the equations, in `erls.build` for what is data of the mechanism.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Effect:
    """One effect.

    Attributes
    ----------
    name : str
    summary : str
        What it is, in one line.
    in_equations : bool
        Whether formulations ask for it; otherwise leaving it out changes the data of the mechanism.
    """

    name: str
    summary: str
    in_equations: bool


EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        Effect("gravity", "weight of links and payloads", False),
        Effect("centrifugal_load", "what the rotation of the undeformed link does to its modes: -X_ωᵀ ρν", True),
        Effect("coriolis", "forces on the modes from their own rates: ω·X q̇ - X_ωᵀ q̇", True),
        Effect("inertia_first_order", "mass matrix and frame forces linear in the deformation: X q", True),
        Effect("inertia_second_order", "frame forces quadratic in the deformation: qᵀ Z q", True),
        Effect("spin_softening", "centrifugal force on the modes, linear in the deformation: -ωᵀ Z ω q", True),
        Effect("modal_damping", "damping of the elastic modes", False),
        Effect("joint_stiffness", "springs in joints", False),
        Effect("joint_damping", "viscous damping in joints", False),
        Effect("joint_friction", "Coulomb friction in joints", False),
        Effect("motor_inertia", "rotor inertia reflected to joints", False),
        Effect("payload", "payloads on named points", False),
        Effect("flexibility", "elastic modes of the links", False),
    )
}

ALL = frozenset(EFFECTS)
"""Every effect there is."""

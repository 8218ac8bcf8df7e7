"""The registry of physical effects: what a scene may leave out of its equations of motion.

With q the modal coordinates of a link, ν = [v; ω] the twist of its frame, s = q̇ + ρ ν and the inertia invariants m, X,
Z (`fe_import.modal.inertia`), the inertia forces fall into what always acts (m with itself) and five parts that may
be left out; their formulas are those of `erls.equations.erls.paper.forces`. Adding an effect means one line here and
one block where it acts: in `erls.equations` for what enters the equations, in `erls.mechanism.without_effects` for what
is data of the mechanism.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass

from erls.errors import Cause, SceneError
from fe_import.files.toml import choose


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
    of_links : bool
        Whether it acts on the deformation of links, so that it is nothing while they are rigid.
    energy : str
        Term of the energy that its work comes from; energy is conserved when all forces of a term are there, or none.
    needs : tuple of (str, str)
        Effects without which it is worse than nothing, and why.
    product : str
        Constants of a link that it multiplies with the deformation: leaving out saves operations when all effects with
        the same product go.
    """

    name: str
    summary: str
    in_equations: bool
    of_links: bool = False
    energy: str = ""
    needs: tuple[tuple[str, str], ...] = ()
    product: str = ""


def _inertia(product: str, name: str, summary: str, term: str, *needs: tuple[str, str]) -> Effect:
    return Effect(name, summary, in_equations=True, of_links=True, energy=term, needs=needs, product=product)


_LINEAR, _SQUARE = "linear in the deformation", "quadratic in the deformation"
_BASE = ("geometric_stiffening", "what the same displacements do to the frame's motion is of the same size")
_LARGER = ("centrifugal_load", "what turns a link loads it first, and then acts on the deformation")
_DEFINITE = ("inertia_second_order", "the mass matrix may turn indefinite where links deflect far")

EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        Effect("gravity", "weight of links and payloads", False),
        _inertia("X", "centrifugal_load", "what the turning undeformed link does to its modes: -X_ωᵀ ρν", _LINEAR),
        _inertia("X", "coriolis", "forces on the modes from their own rates: X_ω q̇ - X_ωᵀ q̇", "", _LARGER),
        _inertia("X", "inertia_first_order", "mass matrix and frame forces linear in q: X q", _LINEAR, _DEFINITE),
        _inertia("Z", "inertia_second_order", "frame forces quadratic in the deformation: qᵀ Z q", _SQUARE),
        _inertia("Z", "spin_softening", "centrifugal force on the modes, linear in q: -ωᵀ Z ω q", _SQUARE, _LARGER),
        Effect("modal_damping", "damping of the elastic modes", False, of_links=True),
        Effect("thermal_expansion", "expansion of links by their temperature change", False, of_links=True),
        Effect("joint_stiffness", "springs in joints", False),
        Effect("joint_damping", "viscous damping in joints", False),
        Effect("joint_friction", "Coulomb friction in joints", False),
        Effect("motor_inertia", "rotor inertia reflected to joints", False),
        Effect("payload", "payloads on named points", False),
        Effect("flexibility", "elastic modes of the links", False),
        Effect("static_correction", "static deflection of modes above simulation.bandwidth", False, of_links=True),
        Effect("geometric_stiffening", "loads on the second-order displacement of links: ½ qᵀΨq", False, of_links=True),
        Effect("foreshortening", "second-order displacement of reported points and nodes", False, of_links=True),
        Effect("modal_inertia", "mass matrix of the modes, linear in ½ qᵀΨq", False, of_links=True, needs=(_BASE,)),
    )
}

ALL = frozenset(EFFECTS)
"""Every effect there is: what acts unless a scene says otherwise."""

SECOND_KINEMATICS = frozenset({"geometric_stiffening", "foreshortening", "modal_inertia"})
"""What second-order displacements of links do."""

LINEAR = ALL - SECOND_KINEMATICS
"""Links are linear in their own frame, as in the papers."""

SECOND = frozenset(name for name, effect in EFFECTS.items() if effect.product == "Z")
FIRST = frozenset(name for name, effect in EFFECTS.items() if effect.product == "X")
"""Effects that share the products Z q, and X q; without the second nothing of the first is left that matters."""

_SETS = {"all": ALL, "linear": LINEAR}


def named_effects(value: str | Sequence[str], where: str) -> frozenset[str]:
    """Effects that a scene asks for; for ``auto`` those from which it chooses.

    Parameters
    ----------
    value : str or sequence of str
        ``all``, ``linear`` (`LINEAR`), ``auto``, or names in a list or separated by commas. Among names ``all`` and
        ``linear`` stand for all of these, and a minus in front leaves an effect out; names with a minus alone leave
        them out of all.
    where : str
        Field, for messages.

    Raises
    ------
    SceneError
        BAD_REFERENCE: unknown name, with a suggestion; BAD_FIELD: names with and without a minus, the same one with
        both, or a minus in front of ``all``, ``linear`` or ``auto``.
    """
    if value == "auto":
        return ALL
    given = [name.strip() for name in value.split(",")] if isinstance(value, str) else list(value)
    known = (*_SETS, "auto", *EFFECTS) if given == [value] else (*_SETS, *EFFECTS)
    for name in given:
        choose(name.removeprefix("-"), known, where, SceneError)
    off = {name[1:] for name in given if name.startswith("-")}
    on = {name for name in given if not name.startswith("-")}
    for name in sorted(off & {*_SETS, "auto"}):
        message = f"a minus leaves out one effect, not {name!r}"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=value, remedy="[] is no effect at all")
    if off & on:
        message = f"{_list(sorted(off & on))} both on and off"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=value, remedy="keep one of the two")
    if off and on and on.isdisjoint(_SETS):
        message = "either names of what is on, or, with a minus, of what is off"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=value, remedy="keep one kind, or add 'all'")
    every = frozenset().union(*(_SETS[name] for name in (on & set(_SETS) or ({"all"} if off else ()))))
    return frozenset((every | on) - off - set(_SETS))


def inconsistencies(effects: Set[str], formulation: str = "erls") -> tuple[str, ...]:
    """Why a set of effects can be expected to mislead; empty for one that can be meant."""
    result = []
    on = in_order(effects)
    if formulation == "nodal":
        kept = [e.name for e in EFFECTS.values() if e.in_equations and e.name not in effects]
        return (f"effects: beam elements have no part that is {_list(kept)}; it stays in",) if kept else ()
    if "flexibility" not in effects:
        idle = [name for name in on if EFFECTS[name].of_links]
        return (f"effects: links are rigid without 'flexibility', so that {_list(idle)} cannot act",) if idle else ()
    for term in dict.fromkeys(e.energy for e in EFFECTS.values() if e.energy):
        members = [e.name for e in EFFECTS.values() if e.energy == term]
        missing = [name for name in members if name not in effects]
        if missing and len(missing) < len(members):
            result.append(
                f"effects: {_list(n for n in members if n in effects)} without {_list(missing)}: all of them come "
                f"from the kinetic energy {term}, and energy is not conserved with a part of them"
            )
    for name in on:
        for other, why in EFFECTS[name].needs:
            if other not in effects:
                result.append(f"effects: {name!r} without {other!r}: {why}")
    return tuple(result)


def conserves_energy(effects: Set[str]) -> bool:
    """Whether every energy is there with all its forces, or with none."""
    present = {(e.energy, e.name in effects) for e in EFFECTS.values() if e.energy}
    return len(present) == len({term for term, _ in present})


def in_order(effects: Iterable[str]) -> list[str]:
    """Names in the order of the registry."""
    wanted = set(effects)
    return [name for name in EFFECTS if name in wanted]


def _list(names: Iterable[str]) -> str:
    return ", ".join(repr(name) for name in names)


@dataclass(frozen=True)
class Certificate:
    """What leaving out effects is estimated to have changed in a run.

    Attributes
    ----------
    error : float
        Of named points [m].
    effort_error : float or None
        Of drive forces, relative to their peak; None where no drive reacts.
    tolerance, effort_tolerance : float
        Those of the scene.
    wall_s : float
        Time that choosing effects and this estimate took.
    """

    error: float
    effort_error: float | None
    tolerance: float
    effort_tolerance: float
    wall_s: float = 0.0

    @property
    def ok(self) -> bool:
        """Whether both are within tolerance."""
        return self.error <= self.tolerance and (self.effort_error or 0.0) <= self.effort_tolerance

    def summary(self) -> dict[str, float | None]:
        """Part of the JSON of ``erls simulate``."""
        return {
            "left_out_error": self.error,
            "left_out_effort_error": self.effort_error,
            "effects_tolerance": self.tolerance,
            "effects_wall_s": self.wall_s,
        }

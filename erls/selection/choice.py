"""``effects = "auto"``: which effects may be left out within a tolerance, decided before the run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from erls.effects import EFFECTS, in_order
from erls.errors import SimulationError
from erls.mechanism.chain import Mechanism
from erls.mechanism.substructures import is_split
from erls.scene import Scene
from erls.selection.probe import EffectSize, effect_sizes, of_links

BUDGET = 0.3  # of the tolerance: what a coarse run may overlook is in the rest


@dataclass(frozen=True)
class Choice:
    """What ``auto`` decided.

    Attributes
    ----------
    off : frozenset of str
        Effects to leave out.
    sizes : tuple of EffectSize
        Of all effects that were considered.
    notes : tuple of str
        What the user should know.
    """

    off: frozenset[str]
    sizes: tuple[EffectSize, ...]
    notes: tuple[str, ...] = ()

    @property
    def estimates(self) -> dict[str, float]:
        """Estimated error of each effect that is left out [m]."""
        return {s.name: s.error for s in self.sizes if s.name in self.off}


def candidates(mechanism: Mechanism, formulation: str) -> list[str]:
    """Effects that ``auto`` may leave out: those that are on, and save operations."""
    if formulation == "nodal":
        return []
    names = [n for n in in_order(mechanism.effects) if EFFECTS[n].saves]
    return [n for n in names if n != "flexibility" or not is_split(mechanism)]


def choose_effects(scene: Scene, mechanism: Mechanism) -> Choice:
    """Decide what to leave out.

    Parameters
    ----------
    scene : Scene
        With the tolerances.
    mechanism : Mechanism
        With all effects among which to choose.
    """
    settings = scene.record.simulation
    names = candidates(mechanism, settings.formulation)
    if not names:
        return Choice(frozenset(), (), (f"effects: auto leaves nothing out of {settings.formulation!r}",))
    try:
        sizes = effect_sizes(scene, mechanism, names)
    except SimulationError as problem:
        return Choice(frozenset(), (), (f"effects: auto leaves nothing out, the coarse run failed ({problem})",))
    off = affordable(sizes, settings.effects_tolerance, settings.effects_effort_tolerance)
    return Choice(off, sizes, (_told(sizes, off, settings.effects_tolerance),))


def affordable(sizes: Iterable[EffectSize], tolerance: float, effort_tolerance: float) -> frozenset[str]:
    """Effects whose errors add up to no more than a share of the tolerance; of rigid links, all that deforms them."""
    sizes = tuple(sizes)
    room, effort_room = BUDGET * tolerance, BUDGET * effort_tolerance
    for s in sizes:
        if s.name == "flexibility" and s.error <= room and (s.effort_error or 0.0) <= effort_room:
            return frozenset(n for n in EFFECTS if of_links(n))
    off = []
    for s in sorted(sizes, key=lambda s: s.error):
        if s.name == "flexibility" or s.error > room or (s.effort_error or 0.0) > effort_room:
            continue
        room, effort_room = room - s.error, effort_room - (s.effort_error or 0.0)
        off.append(s.name)
    return frozenset(off)


def _told(sizes: tuple[EffectSize, ...], off: frozenset[str], tolerance: float) -> str:
    if not off:
        return "effects: auto leaves nothing out"
    gone = [s for s in sizes if s.name in off and s.present]
    if any(s.name == "flexibility" for s in gone):
        gone = [s for s in gone if s.name == "flexibility"]
    parts = ", ".join(f"{s.name} ({s.error:.2g} m)" for s in gone) or "what the scene does not hold"
    return f"effects: auto leaves out {parts}; tolerance {tolerance:.2g} m"

"""``effects = "auto"``: which effects may be left out within a tolerance, decided before the run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from erls.effects import EFFECTS, in_order
from erls.errors import SimulationError
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import with_rigid, without
from erls.mechanism.substructures import is_split
from erls.scene import Scene
from erls.selection.probe import EffectSize, effect_sizes

BUDGET = 0.3  # of the tolerance: what a coarse run may overlook is in the rest


@dataclass(frozen=True)
class Choice:
    """What ``auto`` decided.

    Attributes
    ----------
    off : frozenset of str
        Effects to leave out.
    rigid : frozenset of str
        Links to make rigid.
    sizes : tuple of EffectSize
        Of all effects that were considered.
    notes : tuple of str
        What the user should know.
    """

    off: frozenset[str]
    sizes: tuple[EffectSize, ...] = ()
    notes: tuple[str, ...] = ()
    rigid: frozenset[str] = frozenset()

    @property
    def estimates(self) -> dict[str, float]:
        """Estimated error of each effect that is left out [m]."""
        return {s.name: s.error for s in self.sizes if s.name in self.off and not s.link}

    def applied(self, whole: Mechanism) -> Mechanism:
        """The mechanism with what was decided."""
        return with_rigid(without(whole, self.off), self.rigid)


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
        return Choice(frozenset(), notes=(f"effects: auto leaves nothing out of {settings.formulation!r}",))
    try:
        sizes = effect_sizes(scene, mechanism, names)
    except SimulationError as problem:
        return Choice(frozenset(), notes=(f"effects: auto leaves nothing out, the coarse run failed ({problem})",))
    off, rigid = affordable(sizes, settings.effects_tolerance, settings.effects_effort_tolerance)
    return Choice(off, sizes, (_told(sizes, off, rigid, settings.effects_tolerance),), rigid)


def affordable(
    sizes: Iterable[EffectSize], tolerance: float, effort_tolerance: float
) -> tuple[frozenset[str], frozenset[str]]:
    """Effects, and links to make rigid, whose errors add up to no more than a share of the tolerance.

    Flexibility comes first, since it costs most: that of all links, with all that acts on their deformation, or that of
    single links. Then the other effects follow, smallest first.
    """
    room = _Room(BUDGET * tolerance, BUDGET * effort_tolerance)
    ordered = sorted(sizes, key=lambda s: s.error)
    if any(s.name == "flexibility" and not s.link and room.take(s) for s in ordered):
        return frozenset(n for n in EFFECTS if n == "flexibility" or EFFECTS[n].of_links), frozenset()
    rigid = frozenset(s.link for s in ordered if s.link and room.take(s))
    return frozenset(s.name for s in ordered if s.name != "flexibility" and room.take(s)), rigid


class _Room:
    """What is left of the tolerances."""

    def __init__(self, error: float, effort_error: float) -> None:
        self.error, self.effort_error = error, effort_error

    def take(self, size: EffectSize) -> bool:
        """Whether there is room; takes it if so."""
        effort = size.effort_error or 0.0
        if size.error > self.error or effort > self.effort_error:
            return False
        self.error, self.effort_error = self.error - size.error, self.effort_error - effort
        return True


def _told(sizes: tuple[EffectSize, ...], off: frozenset[str], rigid: frozenset[str], tolerance: float) -> str:
    gone = [s for s in sizes if s.present and (s.link in rigid if s.link else s.name in off)]
    if any(s.name == "flexibility" and not s.link for s in gone):
        gone = [s for s in gone if s.name == "flexibility" and not s.link]
    if not gone:
        return "effects: auto leaves nothing out that the scene holds"
    parts = ", ".join(f"{s.name}{f' of {s.link!r}' if s.link else ''} ({s.error:.2g} m)" for s in gone)
    return f"effects: auto leaves out {parts}; tolerance {tolerance:.2g} m"

"""What ``auto`` may leave out of a scene, to save operations: sets of effects, flexibility of links, vibrations."""

from __future__ import annotations

from dataclasses import dataclass, replace

from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import EFFECTS, FIRST, SECOND, SECOND_KINEMATICS, in_order
from erls.mechanism.substructures import is_split
from erls.mechanism.without_effects import present, with_rigid, without


@dataclass(frozen=True)
class Cut:
    """Something to leave out.

    Attributes
    ----------
    off : frozenset of str
        Effects; empty where a link becomes rigid, or all follow statically.
    link : str
        Link to make rigid; empty for all of them, or none.
    bandwidth : float
        Below all vibrations [Hz], which lets links follow statically; 0 where they vibrate.
    error : float
        Estimated error of leaving it out [m].
    effort_error : float
        The same of drive forces, relative to their peak.
    """

    off: frozenset[str] = frozenset()
    link: str = ""
    bandwidth: float = 0.0
    error: float = 0.0
    effort_error: float = 0.0

    def applied(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism without it."""
        if self.bandwidth:
            return replace(mechanism, bandwidth=self.bandwidth)
        return with_rigid(mechanism, {self.link}) if self.link else without(mechanism, self.off)

    def __str__(self) -> str:
        return f"{self.name} ({self.error:.2g} m)"

    @property
    def name(self) -> str:
        """In words."""
        if self.bandwidth:
            return "vibrations of links"
        return f"flexibility of {self.link!r}" if self.link else ", ".join(in_order(_named(self.off)))


RIGID = frozenset(name for name in EFFECTS if name == "flexibility" or EFFECTS[name].of_links)
"""Flexibility, with all that acts on the deformation of links."""


def possible_cuts(mechanism: Mechanism, formulation: str) -> list[Cut]:
    """What a mechanism holds and could leave out, what saves most first: all flexibility, that of single links,
    second-order displacements, the effects of inertia with the deformation, those of them that are quadratic in it.
    """
    if formulation == "nodal" or "flexibility" not in present(mechanism):
        return []
    result = [] if is_split(mechanism) else [Cut(RIGID & mechanism.effects)]
    result += [Cut(link=link) for link in flexible_links(mechanism)]
    second = SECOND_KINEMATICS & present(mechanism)
    for off in dict.fromkeys((second, mechanism.effects & (FIRST | SECOND), mechanism.effects & SECOND)):
        if off:
            result.append(Cut(off))
    return result


def flexible_links(mechanism: Mechanism) -> list[str]:
    """Links that may be made rigid alone: the flexible ones of several, none of which is split."""
    names = [link.name for link in mechanism.links if link.elastic_modes]
    return names if len(names) > 1 and not is_split(mechanism) else []


def partners(name: str) -> frozenset[str]:
    """Effects with which one has to go for operations to be saved, itself among them."""
    if name == "flexibility":
        return RIGID
    if name in SECOND:
        return SECOND
    if name in SECOND_KINEMATICS:
        return SECOND_KINEMATICS
    return FIRST | SECOND if name in FIRST else frozenset({name})


def _named(off: frozenset[str]) -> frozenset[str]:
    """Names that say what is left out."""
    return frozenset({"flexibility"}) if "flexibility" in off else off

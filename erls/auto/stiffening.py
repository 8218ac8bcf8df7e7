"""Whether links need geometric stiffening and foreshortening, with which ``auto`` does not start.

Links that are linear in their own frame are off by what second order makes of their motion;
`erls.run.watches.deflection_range` estimates that from the motion of the run, within a factor of about 2.5. Spins
that take
away the stiffness of a link need no run where drives prescribe them. ``auto`` is there to leave out what a scene does
not need, and never to be slower than all effects: beyond its tolerance it warns, and adds these where links lose their
stability without them, or where the user is strict.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from erls.auto.operations import operations, stiffened_operations
from erls.equations.registry import TREES
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import in_order
from erls.run.watches.spin_stability import UNSTABLE, planned_spin_warnings
from erls.scene.chain import Scene
from erls.scene.settings import Simulation

STIFFENING = frozenset({"geometric_stiffening", "foreshortening"})
_SPEEDS = 61


@dataclass(frozen=True)
class Addition:
    """Effects beyond those among which ``auto`` chooses.

    Attributes
    ----------
    names : frozenset of str
        Empty where they are not needed.
    note : str
        Why they are; empty where they are not.
    """

    names: frozenset[str] = frozenset()
    note: str = ""

    def applied(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism with them."""
        return replace(mechanism, effects=mechanism.effects | self.names) if self.names else mechanism


def can_stiffen(mechanism: Mechanism, settings: Simulation) -> bool:
    """Whether a link knows its second-order displacements and leaves them out."""
    if settings.formulation not in TREES or mechanism.effects >= STIFFENING:
        return False
    return any(link.elastic_modes and link.second_order is not None for link in mechanism.links)


def addition(mechanism: Mechanism, why: str) -> Addition:
    """Both effects, with the reason and what they make of a step."""
    added = Addition(STIFFENING - mechanism.effects)
    before, after = operations(mechanism).iteration, stiffened_operations(mechanism).iteration
    ratio = after / before if before else 1.0
    names = ", ".join(in_order(added.names))
    return replace(added, note=f"effects: added: {names}: {why}; a step takes about {ratio:.2g} times as long")


def stiffening(scene: Scene, mechanism: Mechanism) -> Addition:
    """What planned speeds ask for.

    Parameters
    ----------
    scene : Scene
    mechanism : Mechanism
        Among whose effects ``auto`` chooses.
    """
    settings = scene.record.simulation
    if not can_stiffen(mechanism, settings):
        return Addition()
    lost = unstable(planned_spin_warnings(mechanism, settings.duration, _SPEEDS))
    return addition(mechanism, lost) if lost else Addition()


def off_by(error: float, tolerance: float) -> str:
    """What links that are linear in their own frames leave, in words."""
    return f"without them points would be off by about {error:.2g} m, beyond the tolerance of {tolerance:.2g} m"


def unstable(warnings: list[str] | tuple[str, ...]) -> str:
    """The first part of a warning that a link loses its stability; empty without one."""
    found = next((text for text in warnings if UNSTABLE in text), "")
    return found.partition(" (reached")[0]

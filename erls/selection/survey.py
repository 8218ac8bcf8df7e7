"""All effects of a scene: sizes, errors if left out, shares of run time, and what ``auto`` would decide."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from erls.build import build_mechanism
from erls.effects import EFFECTS, in_order
from erls.scene import Scene, load_scene
from erls.selection.choice import affordable, candidates
from erls.selection.probe import EffectSize, effect_sizes


@dataclass(frozen=True)
class Survey:
    """What the effects are in a scene.

    Attributes
    ----------
    scene : Scene
    sizes : tuple of EffectSize
        Of the effects that the scene asks for.
    off, rigid : frozenset of str
        What ``auto`` would leave out of these, and the links that it would make rigid.
    """

    scene: Scene
    sizes: tuple[EffectSize, ...]
    off: frozenset[str]
    rigid: frozenset[str]

    def keeps(self, size: EffectSize) -> bool:
        """Whether ``auto`` would keep an effect."""
        return size.link not in self.rigid if size.link else size.name not in self.off

    @property
    def left(self) -> list[str]:
        """Effects that the scene itself leaves out."""
        return [name for name in EFFECTS if name not in {s.name for s in self.sizes}]


def survey(path: Path | str, overrides: Iterable[str] = (), tell: Callable[[str], None] = lambda text: None) -> Survey:
    """Look at all effects of a scene.

    Raises
    ------
    SceneError, FEImportError
        Bad input.
    SimulationError
        The coarse run with all effects failed.
    """
    scene = load_scene(path, overrides)
    mechanism = build_mechanism(scene, tell).mechanism
    sizes = effect_sizes(scene, mechanism, in_order(mechanism.effects), measure=True)
    settings = scene.record.simulation
    possible = set(candidates(mechanism, settings.formulation))
    off, rigid = affordable(
        [s for s in sizes if s.name in possible], settings.effects_tolerance, settings.effects_effort_tolerance
    )
    return Survey(scene, sizes, off, rigid)

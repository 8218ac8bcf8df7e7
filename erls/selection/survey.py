"""All effects of a scene: sizes, errors if left out, shares of run time, and what ``auto`` would decide."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from erls.build import build_mechanism
from erls.effects import EFFECTS, in_order
from erls.scene import Scene, load_scene
from erls.selection.choice import Choice, affordable, choose_effects
from erls.selection.cuts import Cut, possible_cuts
from erls.selection.sizes import EffectSize, effect_sizes


@dataclass(frozen=True)
class Survey:
    """What the effects are in a scene.

    Attributes
    ----------
    scene : Scene
    sizes : tuple of EffectSize
        Of the effects that the scene asks for.
    off, rigid : frozenset of str
        What the tolerance allows ``auto`` to leave out of these, and the links that it allows to be rigid.
    note : str
        What ``auto`` decides, which also asks what deciding costs.
    """

    scene: Scene
    sizes: tuple[EffectSize, ...]
    off: frozenset[str]
    rigid: frozenset[str]
    note: str

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
    reduced = build_mechanism(scene, tell).mechanism
    mechanism = replace(reduced, bandwidth=None)  # other effects are judged with all modes
    sizes = effect_sizes(scene, mechanism, in_order(mechanism.effects))
    if reduced.bandwidth is not None:
        own = effect_sizes(scene, reduced, {"static_correction"} & reduced.effects)
        sizes = tuple(next((o for o in own if o.name == s.name), s) for s in sizes)
    settings = scene.record.simulation
    cuts = [_sized(cut, sizes) for cut in possible_cuts(mechanism, settings.formulation)]
    choice = Choice(affordable(cuts, settings.effects_tolerance, settings.effects_effort_tolerance))
    return Survey(scene, sizes, choice.off, choice.rigid, choose_effects(scene, mechanism).note)


def _sized(cut: Cut, sizes: tuple[EffectSize, ...]) -> Cut:
    """With the errors of its effects added up; flexibility stands for all that acts on the deformation."""
    if cut.link:
        found = [s for s in sizes if s.link == cut.link]
    else:
        names = {"flexibility"} if "flexibility" in cut.off else cut.off
        found = [s for s in sizes if s.name in names and not s.link]
    return replace(cut, error=sum(s.error for s in found), effort_error=sum(s.effort_error or 0.0 for s in found))

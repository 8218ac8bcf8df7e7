"""All effects of a scene: sizes, errors if left out, shares of run time, and what ``auto`` would decide."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from erls.auto.choice import Choice, affordable, choose_effects
from erls.auto.cuts import Cut, possible_cuts
from erls.auto.sizes import EffectSize, effect_sizes
from erls.equations.registry import TREES
from erls.errors import Cause, SceneError
from erls.mechanism.effects import EFFECTS, in_order
from erls.run.watches.second_order_data import missing_stiffening
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene
from erls.scene.read import load_chain


@dataclass(frozen=True)
class Survey:
    """What the effects are in a scene.

    Attributes
    ----------
    scene : Scene
    sizes : tuple of EffectSize
        Of the effects that the scene asks for.
    choice : Choice
        What ``auto`` decides, which also asks what deciding costs.
    allowed : Choice
        What the tolerance allows to leave out, whatever that costs.
    cuts : tuple of Cut
        What may be left out at all.
    missing : tuple of str
        Why effects that the scene asks for are not there.
    """

    scene: Scene
    sizes: tuple[EffectSize, ...]
    choice: Choice
    allowed: Choice
    cuts: tuple[Cut, ...]
    missing: tuple[str, ...]

    def keeps(self, size: EffectSize) -> bool:
        """Whether ``auto`` keeps an effect."""
        return _keeps(self.choice, size)

    def why(self, size: EffectSize) -> str:
        """Why ``auto`` keeps an effect, in a few words; empty where it does not."""
        if not size.present or not self.keeps(size):
            return ""
        if not _keeps(self.allowed, size):
            return "deciding costs more"
        of_it = [c for c in self.cuts if (c.link == size.link if size.link else size.name in c.off and not c.link)]
        if not of_it:
            return "saves nothing"
        least = min(of_it, key=lambda cut: len(cut.off))
        others = [s for s in self.sizes if s.name in least.off - {size.name} and s.present and not s.link]
        if size.link or size.name == "flexibility" or not others or self._too_large(size):
            return "needed"
        return f"goes with {max(others, key=lambda s: s.error).name}"

    def _too_large(self, size: EffectSize) -> bool:
        settings = self.scene.record.simulation
        alone = Cut(error=size.error, effort_error=size.effort_error or 0.0)
        return not affordable([alone], settings.effects_tolerance, settings.effects_effort_tolerance)

    @property
    def left(self) -> list[str]:
        """Effects that the scene itself leaves out."""
        return [name for name in EFFECTS if name not in {s.name for s in self.sizes}]


def _keeps(choice: Choice, size: EffectSize) -> bool:
    return size.link not in choice.rigid if size.link else size.name not in choice.off


def survey(path: Path | str, overrides: Iterable[str] = (), tell: Callable[[str], None] = lambda text: None) -> Survey:
    """Look at all effects of a scene.

    Raises
    ------
    SceneError, FEImportError
        Bad input; BAD_FIELD: the nodal formulation has no such parts.
    SimulationError
        The coarse run with all effects failed.
    """
    scene = load_chain(path, overrides)
    settings = scene.record.simulation
    if settings.formulation not in TREES:
        raise SceneError(
            Cause.BAD_FIELD,
            "beam elements hold all effects of links in one, and none of them can be left out",
            where=f"{scene.path}: simulation.formulation",
            value=settings.formulation,
            remedy=f"look at the modal model of the same scene: --set simulation.formulation={next(iter(TREES))}",
        )
    reduced = build_mechanism(scene, tell).mechanism
    mechanism = replace(reduced, bandwidth=None)  # other effects are judged with all modes
    choice = choose_effects(scene, mechanism)
    sizes = effect_sizes(scene, mechanism, in_order(mechanism.effects))
    if reduced.bandwidth is not None:
        own = effect_sizes(scene, reduced, {"static_correction"} & reduced.effects)
        sizes = tuple(next((o for o in own if o.name == s.name), s) for s in sizes)
    cuts = tuple(_sized(cut, sizes) for cut in possible_cuts(mechanism, settings.formulation))
    allowed = Choice(affordable(cuts, settings.effects_tolerance, settings.effects_effort_tolerance))
    return Survey(scene, sizes, choice, allowed, cuts, tuple(missing_stiffening(mechanism)))


def _sized(cut: Cut, sizes: tuple[EffectSize, ...]) -> Cut:
    """With the errors of its effects added up; flexibility stands for all that acts on the deformation."""
    if cut.link:
        found = [s for s in sizes if s.link == cut.link]
    else:
        names = {"flexibility"} if "flexibility" in cut.off else cut.off
        found = [s for s in sizes if s.name in names and not s.link]
    return replace(cut, error=sum(s.error for s in found), effort_error=sum(s.effort_error or 0.0 for s in found))

"""What a cost study tries: formulations, modes, integrators and sets of effects, each from coarse to fine."""

from __future__ import annotations

from dataclasses import dataclass, replace

from erls.errors import Cause, SceneError
from erls.integrate.choice import INTEGRATION_SHARE
from erls.scene.chain import Scene
from erls.scene.integrators import INTEGRATORS
from erls.studies.effect_sets import each_once, own_set, parse_sets
from erls.studies.ladder import Setting
from fe_import.files.toml import choose

FORMULATIONS = ("erls", "ffr")
_SCIPY = ("rk45", "dop853", "radau", "bdf", "lsoda")
_RELATIVE = tuple(10.0**-k for k in range(3, 11))
_STEP_SHARES = tuple(2.0**-k for k in range(-3, 6))  # of the scene's own step
_TOLERANCE_SHARES = (100.0, 30.0, 10.0, 3.0, 1.0, 0.3, 0.1, 0.03)  # of the tolerance asked for


@dataclass(frozen=True)
class Grid:
    """What the study varies; empty means a choice that suits the scene.

    Attributes
    ----------
    formulations, integrators : tuple of str
    effects : tuple of str
        Sets, written as `erls.studies.effect_sets` says; that of the scene is always tried, too.
    modes : tuple of int
        Elastic modes of every link; all there are, half and a quarter of them unless given.
    """

    formulations: tuple[str, ...] = ()
    integrators: tuple[str, ...] = ()
    effects: tuple[str, ...] = ()
    modes: tuple[int, ...] = ()


def checked(grid: Grid) -> Grid:
    """The grid with each set of effects once.

    Raises
    ------
    SceneError
        A name that is not known.
    """
    for integrator in grid.integrators:
        choose(integrator, INTEGRATORS, "integrators", SceneError)
    for formulation in grid.formulations:
        choose(formulation, FORMULATIONS, "formulations", SceneError)
    return replace(grid, effects=parse_sets(grid.effects))


def ladders(scene: Scene, grid: Grid, tolerance: float, most: int, stiffening: bool) -> list[tuple[Setting, ...]]:
    """All combinations of the grid, each from coarse to fine; what the scene states itself comes first, and SciPy's
    integrators, whose steps are not compiled, last: the budget may not last for all.

    Parameters
    ----------
    scene : Scene
    grid : Grid
    tolerance : float
        [m]
    most : int
        Elastic modes that every link has.
    stiffening : bool
        Whether links know second-order displacements: then all modes are tried without them, too.

    Raises
    ------
    SceneError
        More modes than there are.
    """
    for count in grid.modes:
        if not 0 <= count <= most:
            message, remedy = "the modal models do not have this number of elastic modes", "give counts up to the limit"
            raise SceneError(Cause.BAD_FIELD, message, where="modes", value=count, limit=most, remedy=remedy)
    counts: tuple[int | None, ...] = grid.modes or tuple(dict.fromkeys((None, most // 2, most // 4)))
    if not most:
        counts = (None,)
    own = own_set(scene.record.simulation.effects)
    sets = each_once((own, *(grid.effects or ("all", "auto"))))
    tried = each_once((own, "linear", *sets)) if stiffening and most and not grid.effects else sets
    models = [(effects, counts[0]) for effects in tried]
    models += [(effects, count) for count in counts[1:] for effects in sets]
    stated = scene.record.simulation.formulation
    integrators = grid.integrators or _default_integrators(scene)
    return [
        tuple(Setting(formulation, integrator, effects, count, *rung) for rung in _rungs(scene, integrator, tolerance))
        for some in ([k for k in integrators if k not in _SCIPY], [k for k in integrators if k in _SCIPY])
        for effects, count in models
        for integrator in some
        for formulation in grid.formulations or sorted(_possible(scene), key=lambda name: name != stated)
    ]


def _possible(scene: Scene) -> tuple[str, ...]:
    """Formulations that can split links where the scene does."""
    split = any(link.substructures > 1 and link.flexible for link in scene.record.links)
    return ("ffr",) if split else FORMULATIONS


def _default_integrators(scene: Scene) -> tuple[str, ...]:
    own = [name for name in INTEGRATORS if name not in (*_SCIPY, "auto")]
    return (*own, "dop853")


def _rungs(scene: Scene, integrator: str, tolerance: float) -> list[tuple[str, float]]:
    settings = scene.record.simulation
    if integrator in _SCIPY:
        return [("rtol", value) for value in _RELATIVE]
    if integrator == "generalized_alpha":
        step = settings.step or min(settings.duration / 1000, 1e-3)
        return [("step", share * step) for share in _STEP_SHARES]
    return [("tolerance", share * tolerance / INTEGRATION_SHARE) for share in _TOLERANCE_SHARES]

"""A design: the scene at values of the variables, its mechanism, its mass, its run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from erls.equations.registry import FORMULATIONS
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.optimize.problem import Problem
from erls.run.chain.run import ChainRun
from erls.run.watches.watching import Warnings
from erls.scene.build import build_mechanism, link_description, link_model
from erls.scene.chain import Scene
from erls.scene.overrides import apply_override
from erls.scene.read import checked
from erls.sensitivity.parameters import tables_of
from erls.simulation.asked import Asked
from erls.simulation.chains import run_mechanism
from fe_import.description.records import LinkDescription
from fe_import.files.toml import choose
from fe_import.errors import ReportedError
from fe_import.modal.model import ModalModel

Message = Callable[[str], None]


@dataclass(frozen=True)
class Design:
    """The scene at values of the variables.

    Attributes
    ----------
    x : (v,) array
    scene : Scene
    mechanism : Mechanism
    masses : (links,) array
        Of the links of the scene without payloads [kg].
    """

    x: Array
    scene: Scene
    mechanism: Mechanism
    masses: Array


def scene_at(problem: Problem, x: Array, changes: Sequence[str] = ()) -> Scene:
    """The scene with values of the variables in its fields.

    Raises
    ------
    SceneError, FEImportError
        They are refused.
    """
    data = tables_of(problem.scene.record)
    for text in (*problem.overrides(x), *changes):
        apply_override(data, text)
    found = checked(data, problem.scene.path, str(problem.scene.path))
    assert isinstance(found, Scene)
    return found


class Designs:
    """Makes designs of a problem; links that no variable changes are reduced once."""

    def __init__(self, problem: Problem, tell: Message = lambda text: None) -> None:
        self.problem, self._tell = problem, tell
        self._changed = {p.link for p in problem.parameters if p.link is not None}
        self._models: dict[int, ModalModel] = {}

    def at(self, x: Array, changes: Sequence[str] = ()) -> Design:
        """The design at values of the variables, and with changes of the scene.

        Raises
        ------
        SceneError, FEImportError
            The values are refused: names the field.
        """
        scene = scene_at(self.problem, x, changes)
        models = [self._model(scene, k) for k in range(len(scene.record.links))]
        mechanism = build_mechanism(scene, lambda text: None, models, self._descriptions(scene)).mechanism
        return Design(x, scene, mechanism, np.array([model.mass_properties.mass for model in models]))

    def masses(self, x: Array) -> Array:
        """(links,) of the scene without payloads [kg], at values of the variables."""
        scene = scene_at(self.problem, x)
        return np.array([self._model(scene, k).mass_properties.mass for k in range(len(scene.record.links))])

    def _model(self, scene: Scene, k: int) -> ModalModel:
        if k in self._changed and scene.record.links[k].model:
            return link_model(scene, k, lambda text: None, link_description(scene, scene.record.links[k]))
        if k not in self._models:
            self._models[k] = link_model(scene, k, self._tell)
        return self._models[k]

    @staticmethod
    def _descriptions(scene: Scene) -> list[LinkDescription | None]:
        found = [link_description(scene, link).description if link.model else None for link in scene.record.links]
        return [d if d is not None and d.frame is not None else None for d in found]


def run_of(design: Design, tell: Message = lambda text: None) -> ChainRun:
    """Its motion.

    Raises
    ------
    SimulationError
        It failed.
    """
    asked = Asked(None, tell, None, False, None, verdict=False)
    found = run_mechanism(design.scene, design.mechanism, asked, Warnings(lambda text: None))
    if found.failure is not None:
        raise found.failure
    return found

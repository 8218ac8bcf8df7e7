"""A design: the scene at values of the variables, its mechanism, its run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from erls.equations.registry import formulate
from erls.integrate.choice import compile_kernels, compiled_steps, compiling_steps, integrator, options_of
from erls.maths.jit import announcing
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.optimization.problem import Problem
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism, link_description, link_model
from erls.scene.chain import Scene
from erls.scene.overrides import apply_override
from erls.scene.read import checked
from erls.sensitivity.parameters import leaves_nodes
from fe_import.description.numbers import tables_of
from fe_import.description.records import LinkDescription
from fe_import.modal.model import ModalModel

Message = Callable[[str], None]

_OF_FORCES = (
    "stiffness", "damping", "friction", "motor", "proportional_gain", "derivative_gain", "torque_limit", "profiles",
)  # fmt: skip


@dataclass(frozen=True)
class Design:
    """The scene at values of the variables.

    Attributes
    ----------
    x : (v,) array
    scene : Scene
    mechanism : Mechanism
    """

    x: Array
    scene: Scene
    mechanism: Mechanism


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


def moving(problem: Problem) -> list[str]:
    """Names of variables that may change where nodes are or how joints are to move."""
    found = []
    for k, variable in enumerate(problem.record.variables):
        keys = [p for p, used in zip(problem.parameters, problem.factors[:, k], strict=True) if used]
        if not all(_stays(p.key, p.within) for p in keys):
            found.append(variable.name)
    return found


def _stays(key: str, within: str) -> bool:
    if within:
        return leaves_nodes(within)
    table, *fields = key.split(".")
    return table in ("payloads", "gravity", "loads") or (
        table in ("joints", "loops") and not {*fields}.isdisjoint(_OF_FORCES)
    )


class Designs:
    """Makes designs of a problem; links that no variable changes are reduced once.

    A nodal scene takes nothing but nodes and interfaces from the modal models of its links, so that these stay as they
    are while no node moves.
    """

    def __init__(self, problem: Problem, tell: Message = lambda text: None) -> None:
        self.problem, self._tell = problem, tell
        self.moving = moving(problem)
        leads = any(getattr(joint.drive, "feed_forward", False) for joint in problem.scene.record.joints)
        nodal = problem.scene.record.simulation.formulation == "nodal" and not self.moving and not leads
        self._changed = set() if nodal else {p.link for p in problem.parameters if p.link is not None}
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
        return Design(x, scene, build_mechanism(scene, self._quiet, models, _descriptions(scene)).mechanism)

    @staticmethod
    def _quiet(text: str) -> None:
        """Nothing is told of a design among many."""

    def _model(self, scene: Scene, k: int) -> ModalModel:
        link = scene.record.links[k]
        if k in self._changed and link.model:
            return link_model(scene, k, self._quiet, link_description(scene, link))
        if k not in self._models:
            self._models[k] = link_model(scene, k, self._tell)
        return self._models[k]


def _descriptions(scene: Scene) -> list[LinkDescription | None]:
    """Of links that are made of beams."""
    found = [link_description(scene, link).description if link.model else None for link in scene.record.links]
    return [d if d is not None and d.frame is not None else None for d in found]


def run_of(design: Design, tell: Message = lambda text: None) -> ChainRun:
    """Its motion, without what looks along it: a design that is kept is simulated again in full.

    Raises
    ------
    SimulationError
        It failed.
    """
    settings = design.scene.record.simulation
    with announcing(tell), compiling_steps(compiled_steps(design.mechanism, settings)):
        formulation = formulate(design.mechanism, settings)
        compile_kernels(formulation, settings)
    integrate = integrator(design.mechanism, settings)
    span, options = (0.0, settings.duration), replace(options_of(settings), keeper=None)
    solution = integrate(formulation, span, *formulation.initial_state(), options, None)
    if solution.failure is not None:
        raise solution.failure
    return ChainRun(design.scene, formulation, solution)

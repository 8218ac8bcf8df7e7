"""The equations of motion at other values of a parameter, and derivatives by it as differences of these.

What equations depend on (lengths, masses, gains, reduced matrices) is smooth algebra of a parameter, without the
iterations and choices of a run: differences of it are right to 1e-11 where those of runs are right to 1e-5.

A link whose description changes has other modes. Its coordinates x stay what they are, with shapes that are held
(`fe_import.modal.held_shapes`): the forces at p are Tᵀ R(T x).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from erls.equations.compiled_system import CompiledSystem
from erls.equations.registry import formulate, system_of
from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.shared_links import sharing_links
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism, link_model
from erls.sensitivity.parameters import Parameter, description_with, leaves_nodes, scene_with
from erls.simulation.chains import models_of
from fe_import.derivatives import STENCILS, STEP, Stencil, held
from fe_import.errors import ReportedError

_PLACED = "mesh_pose"  # where a link stands on its joint, of which its model knows nothing


@dataclass(frozen=True)
class Variant:
    """The equations at another value.

    Attributes
    ----------
    weight : float
        In the derivative [1/unit of the parameter].
    apart : float
        Of the parameter from its value in the run.
    formulation : Formulation
    turn : (n, n) array or None
        T, of all coordinates; None where they are the same.
    sections : bool
        Whether it differs in what nodal beams are made of alone: joints and their conditions are those of the run.
    """

    weight: float
    apart: float
    formulation: Any
    turn: Array | None = None
    sections: bool = False

    def placed(self, y: Array) -> Array:
        """(..., n) coordinates of the run in those of the variant."""
        return y if self.turn is None else y @ self.turn.T

    def taken_back(self, y: Array) -> Array:
        """The other way."""
        return y if self.turn is None else np.asarray(np.linalg.solve(self.turn, y))

    def run(self, run: ChainRun) -> ChainRun:
        """The same motion of the variant."""
        s = run.solution
        moved = replace(s, y=self.placed(s.y), v=self.placed(s.v), a=self.placed(s.a))
        return replace(run, formulation=self.formulation, solution=moved)


class Difference:
    """A derivative by a parameter, as a sum over variants, which are made when they are asked for.

    Parameters
    ----------
    run : ChainRun
    parameter : Parameter
    stencil : Stencil
        Where, and with which weights.
    models : bool, optional
        Whether modal models of links in nodal scenes are those of the variant.

    Raises
    ------
    SceneError, FEImportError
        The first two that are made will not do; others are refused when they are asked for.
    """

    def __init__(self, run: ChainRun, parameter: Parameter, stencil: Stencil, models: bool = True) -> None:
        self.parameter = parameter
        self._run, self._stencil, self._models = run, stencil, models
        self._made: dict[int, Variant] = {}
        if parameter.within:  # shapes of all are held together
            self._get(tuple(range(len(stencil))))
        self.few = self._get((0, 2) if stencil[0][0] else (1, 3))

    @property
    def variants(self) -> tuple[Variant, ...]:
        """All of them."""
        return self._get(tuple(range(len(self._stencil))))

    @property
    def acts(self) -> bool:
        """Whether the equations of motion depend on it: a start alone may."""
        first, second = (variant.formulation.compiled for variant in self.few)
        return any(variant.turn is not None for variant in self.few) or not _alike(first, second)

    def _get(self, numbers: tuple[int, ...]) -> tuple[Variant, ...]:
        missing = [k for k in numbers if k not in self._made]
        if missing:
            made = _variants(self._run, self.parameter, [self._stencil[k] for k in missing], self._models)
            self._made |= dict(zip(missing, made, strict=True))
        return tuple(self._made[k] for k in numbers)

    def beside(self, what: Callable[[Variant], Array], here: Array) -> Array:
        """The derivative of what an array depends on, ``here`` in the run; nothing where two variants have the same."""
        if all(np.array_equal(what(variant), here) for variant in self.few):
            return np.zeros_like(here)
        return self.of(what)

    def of(self, what: Callable[[Variant], Array]) -> Array:
        """The derivative of what an array depends on: exactly zero where it does not."""
        first = what(self.variants[0])  # weights add up to zero
        return np.asarray(sum(variant.weight * (what(variant) - first) for variant in self.variants[1:]))


def _alike(one: CompiledSystem, other: CompiledSystem) -> bool:
    """Whether two systems of the same kind have the same constants."""
    return np.array_equal(one.integers, other.integers) and np.array_equal(one.reals, other.reals, equal_nan=True)


def differences(run: ChainRun, parameters: Sequence[Parameter], models: bool = True) -> list[Difference]:
    """By each parameter; ``models`` as in `Difference`.

    Raises
    ------
    SceneError, FEImportError
        No value beside that of a parameter will do; a link would have another number of modes; times at which forces
        jump depend on a parameter.
    """
    return [_difference(run, parameter, models) for parameter in parameters]


def _difference(run: ChainRun, parameter: Parameter, models: bool) -> Difference:
    problems = []
    for stencil in STENCILS:
        try:
            return Difference(run, parameter, stencil, models)
        except ReportedError as problem:
            problems.append(problem)
    raise problems[0]


def _variants(
    run: ChainRun, parameter: Parameter, stencil: Sequence[tuple[int, float]], models: bool
) -> list[Variant]:
    """At the values of a stencil, or some of them."""
    base: Any = run.formulation
    step = STEP * parameter.size
    nodal = system_of(base.mechanism, run.scene.record.simulation) == "nodal"
    sections = nodal and not models and _of_sections(run, parameter)
    make = _with_sections if sections else _mechanism
    mechanisms = [make(run, parameter, parameter.value + at * step) for at, _ in stencil]
    turns: list[Array | None] = [None] * len(stencil)
    if parameter.within and parameter.link is not None and not nodal:
        number = base.mechanism.bodies[parameter.link]
        shapes = [mechanism.links[number].model for mechanism in mechanisms]
        found = held(shapes, base.mechanism.links[number].model, f"parameter {parameter.key}")
        turns = [_of_all(base, number, turn[6:, 6:]) for turn in found]
    result = []
    for (at, weight), mechanism, turn in zip(stencil, mechanisms, turns, strict=True):
        settings = run.scene.record.simulation
        formulation: Any = base.with_sections(mechanism) if sections else formulate(mechanism, settings)
        if nodal:
            _refuse_others(formulation, base, parameter)
        elif mechanism.loops:
            formulation.kept = base.kept  # of rows that follow from one another, any others would do as well
        if _times(formulation, nodal) != _times(base, nodal):
            raise SceneError(
                Cause.NO_DERIVATIVE,
                "times at which forces jump depend on this parameter: derivatives through them are not known yet",
                where=f"parameter {parameter.key}",
                value=parameter.value,
                remedy="name another field, or smooth the profile that it belongs to",
            )
        result.append(Variant(weight / step, at * step, formulation, turn, sections))
    return result


def _times(formulation: Any, nodal: bool) -> tuple[float, ...]:
    """At which forces jump."""
    found: tuple[float, ...] = (formulation.system if nodal else formulation).breakpoints
    return found


def _refuse_others(formulation: Any, base: Any, parameter: Parameter) -> None:
    """Refuse nodes, elements or conditions of another number or order."""
    if formulation.chain.left_out != base.chain.left_out:
        message = "which conditions of a loop follow from the others depends on this parameter"
    elif not np.array_equal(formulation.system.flat.integers, base.system.flat.integers):
        message = "elements and joints change with this parameter by jumps"
    else:
        return
    where, remedy = f"parameter {parameter.key}", "name another field, or give it a value off such a place"
    raise SceneError(Cause.BAD_FIELD, message, where=where, value=parameter.value, remedy=remedy)


def _of_sections(run: ChainRun, parameter: Parameter) -> bool:
    """Whether it says of beams what they are made of: nodal equations take that from descriptions, and nothing but
    nodes and interfaces from modal models; feed-forward takes masses from these.
    """
    leads = any(getattr(joint.drive, "feed_forward", False) for joint in run.scene.record.joints)
    if leads or parameter.link is None or not leaves_nodes(parameter.within):
        return False
    mechanism = run.formulation.mechanism
    link = mechanism.links[mechanism.bodies[parameter.link]]
    return bool(link.elastic_modes) and link.description is not None and link.description.frame is not None


def _with_sections(run: ChainRun, parameter: Parameter, value: float) -> Mechanism:
    """The mechanism of the run with another number of a link's beams."""
    mechanism = run.formulation.mechanism
    assert parameter.link is not None
    number, described = mechanism.bodies[parameter.link], description_with(run.scene, parameter, value)
    links = list(mechanism.links)
    links[number] = replace(links[number], description=described.description)
    return replace(mechanism, links=tuple(links))


def _mechanism(run: ChainRun, parameter: Parameter, value: float) -> Mechanism:
    """With another value."""
    models, descriptions, pieces = models_of(run)
    scene, k = run.scene, parameter.link
    described = None
    if parameter.within:
        described = description_with(scene, parameter, value)
    else:
        scene = scene_with(scene, parameter, value)
    if k is not None and parameter.key.split(".")[2] != _PLACED:
        models[k] = link_model(scene, k, lambda text: None, described)
        if described is not None and descriptions[k] is not None:  # made of beams, as nodes take them
            descriptions[k] = described.description
    built = build_mechanism(scene, lambda text: None, models, descriptions, pieces).mechanism
    return sharing_links(built, run.formulation.mechanism)


def _of_all(base: Any, number: int, turn: Array) -> Array:
    """(n, n) T of all coordinates, from that (e, e) of the elastic ones of a link."""
    modes = [link.elastic_modes for link in base.mechanism.links]
    first = base.size - sum(modes[number:])
    result = np.eye(base.size)
    result[first : first + len(turn), first : first + len(turn)] = turn
    return result

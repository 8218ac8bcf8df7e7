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
from erls.equations.nodal.equations import Nodal
from erls.equations.registry import formulate
from erls.equations.series import residual_series
from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism, link_model
from erls.sensitivity.parameters import Parameter, description_with, scene_with
from erls.sensitivity.tangents import Knots
from erls.simulation.chains import models_of
from fe_import.derivatives import STENCILS, STEP, Stencil, held
from fe_import.errors import ReportedError

LINEAR = 1e-10
"""Of a derivative: what the third order of steps makes of it; a square root makes 1e-7."""
ROUNDING = 1e-13
"""Of forces."""


@dataclass(frozen=True)
class Variant:
    """The equations at another value.

    Attributes
    ----------
    weight : float
        In the derivative [1/unit of the parameter].
    formulation : Formulation
    turn : (n, n) array or None
        T, of all coordinates; None where they are the same.
    """

    weight: float
    formulation: Any
    turn: Array | None = None

    def forces(self, knots: Knots) -> Array:
        """(k, n) forces out of balance, in the coordinates of the run."""
        t, y, v, a = knots
        if self.turn is None:
            return residual_series(self.formulation.compiled, t, y, v, a)
        turned = (x @ self.turn.T for x in (y, v, a))
        return np.asarray(residual_series(self.formulation.compiled, t, *turned) @ self.turn)

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


@dataclass(frozen=True)
class Difference:
    """A derivative by a parameter, as a sum over variants."""

    parameter: Parameter
    variants: tuple[Variant, ...]

    @property
    def acts(self) -> bool:
        """Whether the equations of motion depend on it: a start alone may."""
        first, *others = (variant.formulation.compiled for variant in self.variants)
        turned = any(variant.turn is not None for variant in self.variants)
        return turned or not all(_alike(first, other) for other in others)

    def thinned(self, sample: Knots) -> Difference:
        """The same with fewer variants where forces depend linearly on the parameter, as some knots show."""
        if len(self.variants) != len(STENCILS[0]):
            return self
        inner = Difference(self.parameter, tuple(replace(v, weight=0.75 * v.weight) for v in self.variants[1:3]))
        forces = [np.abs(variant.forces(sample)).max(initial=0.0) for variant in self.variants]
        rounding = ROUNDING * max(forces) * inner.variants[1].weight
        whole, less = (one.of(lambda variant: variant.forces(sample)) for one in (self, inner))
        return inner if np.abs(whole - less).max() <= LINEAR * np.abs(whole).max() + rounding else self

    def of(self, what: Callable[[Variant], Array]) -> Array:
        """The derivative of what an array depends on."""
        return np.asarray(sum(variant.weight * what(variant) for variant in self.variants))


def _alike(one: CompiledSystem, other: CompiledSystem) -> bool:
    """Whether two systems of the same kind have the same constants."""
    return np.array_equal(one.integers, other.integers) and np.array_equal(one.reals, other.reals, equal_nan=True)


def differences(run: ChainRun, parameters: Sequence[Parameter]) -> list[Difference]:
    """By each parameter.

    Raises
    ------
    SceneError, FEImportError
        No value beside that of a parameter will do; a link would have another number of modes; times at which forces
        jump depend on a parameter.
    """
    return [_difference(run, parameter) for parameter in parameters]


def _difference(run: ChainRun, parameter: Parameter) -> Difference:
    step, problems = STEP * parameter.size, []
    for stencil in STENCILS:
        try:
            return Difference(parameter, tuple(_variants(run, parameter, stencil, step)))
        except ReportedError as problem:
            problems.append(problem)
    raise problems[0]


def _variants(run: ChainRun, parameter: Parameter, stencil: Stencil, step: float) -> list[Variant]:
    """At the values of a stencil."""
    base: Any = run.formulation
    mechanisms = [_mechanism(run, parameter, parameter.value + at * step) for at, _ in stencil]
    turns: list[Array | None] = [None] * len(stencil)
    nodal = isinstance(base, Nodal)
    if parameter.within and parameter.link is not None and not nodal:
        number = base.mechanism.bodies[parameter.link]
        models = [mechanism.links[number].model for mechanism in mechanisms]
        found = held(models, base.mechanism.links[number].model, f"parameter {parameter.key}")
        turns = [_of_all(base, number, turn[6:, 6:]) for turn in found]
    result = []
    for (_, weight), mechanism, turn in zip(stencil, mechanisms, turns, strict=True):
        formulation: Any = formulate(mechanism, run.scene.record.simulation)
        if nodal:
            _refuse_others(formulation, base, parameter)
        elif mechanism.loops:
            formulation.kept = base.kept  # of rows that follow from one another, any others would do as well
        if _times(formulation) != _times(base):
            raise SceneError(
                Cause.BAD_FIELD,
                "times at which forces jump depend on this parameter: derivatives through them are not known yet",
                where=f"parameter {parameter.key}",
                value=parameter.value,
                remedy="name another field, or smooth the profile that it belongs to",
            )
        result.append(Variant(weight / step, formulation, turn))
    return result


def _times(formulation: Any) -> tuple[float, ...]:
    """At which forces jump."""
    of: Any = formulation.system if isinstance(formulation, Nodal) else formulation
    found: tuple[float, ...] = of.breakpoints
    return found


def _refuse_others(formulation: Nodal, base: Nodal, parameter: Parameter) -> None:
    """Refuse nodes, elements or conditions of another number or order."""
    if formulation.chain.left_out != base.chain.left_out:
        message = "which conditions of a loop follow from the others depends on this parameter"
    elif not np.array_equal(formulation.system.flat.integers, base.system.flat.integers):
        message = "elements and joints change with this parameter by jumps"
    else:
        return
    where, remedy = f"parameter {parameter.key}", "name another field, or give it a value off such a place"
    raise SceneError(Cause.BAD_FIELD, message, where=where, value=parameter.value, remedy=remedy)


def _mechanism(run: ChainRun, parameter: Parameter, value: float) -> Mechanism:
    """With another value."""
    models, descriptions, pieces = models_of(run)
    scene, k = run.scene, parameter.link
    described = None
    if parameter.within:
        described = description_with(scene, parameter, value)
    else:
        scene = scene_with(scene, parameter, value)
    if k is not None:
        models[k] = link_model(scene, k, lambda text: None, described)
        if described is not None and descriptions[k] is not None:  # made of beams, as nodes take them
            descriptions[k] = described.description
    return build_mechanism(scene, lambda text: None, models, descriptions, pieces).mechanism


def _of_all(base: Any, number: int, turn: Array) -> Array:
    """(n, n) T of all coordinates, from that (e, e) of the elastic ones of a link."""
    modes = [link.elastic_modes for link in base.mechanism.links]
    first = base.size - sum(modes[number:])
    result = np.eye(base.size)
    result[first : first + len(turn), first : first + len(turn)] = turn
    return result

"""The equations of motion at other values of a parameter, and derivatives by it as differences of these.

What equations depend on (lengths, masses, gains, reduced matrices) is smooth algebra of a parameter, without the
iterations and choices of a run: differences of it are right to 1e-11 where those of runs are right to 1e-5.

A link whose description changes has other modes. Its coordinates stay what they are, with the shapes Φ(p) T(p) that
come nearest to Φ(p₀) among those which the modes of both span: T is what follows from the space that they span, so that
modes which turn within it, like the pairs of a round section, make no trouble. In the coordinates x of the link at p₀
the forces at p are Tᵀ R(T x).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from erls.equations.registry import formulate
from erls.equations.series import residual_series
from erls.errors import Cause, SceneError
from erls.integrate.base import Solution
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism, link_model
from erls.sensitivity.parameters import Parameter, description_with, scene_with
from erls.sensitivity.tangents import Knots
from erls.simulation.chains import models_of
from fe_import.errors import ReportedError
from fe_import.modal.model import ModalModel

Stencil = tuple[tuple[int, float], ...]
"""Steps and weights of a difference."""

_STENCILS: tuple[Stencil, ...] = (
    ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12)),
    ((0, -25 / 12), (1, 4.0), (2, -3.0), (3, 4 / 3), (4, -1 / 4)),
    ((0, 25 / 12), (-1, -4.0), (-2, 3.0), (-3, -4 / 3), (-4, 1 / 4)),
)
"""Of fourth order: central, and to one side where the other is refused (a negative mass)."""

_STEP = 1e-3  # of the size of a parameter: rounding takes 1e-13 of forces, the fifth derivative 1e-13 of itself


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
        moved: Solution = s if self.turn is None else replace(s, **{x: self.placed(getattr(s, x)) for x in "yva"})
        return replace(run, formulation=self.formulation, solution=moved)


@dataclass(frozen=True)
class Difference:
    """A derivative by a parameter, as a sum over variants."""

    parameter: Parameter
    variants: tuple[Variant, ...]

    def of(self, what: Callable[[Variant], Array]) -> Array:
        """The derivative of what an array depends on."""
        return np.asarray(sum(variant.weight * what(variant) for variant in self.variants))


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
    step, problems = _STEP * parameter.size, []
    for stencil in _STENCILS:
        try:
            return Difference(parameter, tuple(_variants(run, parameter, stencil, step)))
        except ReportedError as problem:
            problems.append(problem)
    raise problems[0]


def _variants(run: ChainRun, parameter: Parameter, stencil: Stencil, step: float) -> Iterator[Variant]:
    base: Any = run.formulation
    for at, weight in stencil:
        if not at:
            yield Variant(weight / step, base)
            continue
        value = parameter.value + at * step
        mechanism = _mechanism(run, parameter, value)
        found: Any = formulate(mechanism, run.scene.record.simulation)
        if found.breakpoints != base.breakpoints:
            raise SceneError(
                Cause.BAD_FIELD,
                "times at which forces jump depend on this parameter: derivatives through them are not known yet",
                where=f"parameter {parameter.key}",
                value=parameter.value,
                remedy="name another field, or smooth the profile that it belongs to",
            )
        yield Variant(weight / step, found, _turn(run, parameter, mechanism))


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
        modes = models_of(run)[0][k].modes
        if models[k].modes != modes:
            raise SceneError(
                Cause.BAD_FIELD,
                "the link has another number of modes beside this value: the number must hold",
                where=f"parameter {parameter.key}",
                value=models[k].modes - 6,
                limit=f"{modes - 6} elastic modes",
                remedy="ask for a number of elastic modes that parts none of equal frequency",
            )
    return build_mechanism(scene, lambda text: None, models, descriptions, pieces).mechanism


def _turn(run: ChainRun, parameter: Parameter, mechanism: Mechanism) -> Array | None:
    """T of all coordinates."""
    base: Any = run.formulation
    if not parameter.within or parameter.link is None:
        return None
    number = base.mechanism.bodies[parameter.link]
    modes = [link.elastic_modes for link in base.mechanism.links]
    first = base.size - sum(modes[number:])
    result = np.eye(base.size)
    rows = slice(first, first + modes[number])
    result[rows, rows] = nearest_shapes(mechanism.links[number].model, base.mechanism.links[number].model)
    return result


def nearest_shapes(model: ModalModel, base: ModalModel) -> Array:
    """(e, e) T: elastic coordinates of a model whose shapes come nearest to the elastic modes of another one, up to
    rigid-body motion.

    Parameters
    ----------
    model, base : ModalModel
        Of the same nodes and number of modes.
    """
    size = max(float(np.linalg.norm(np.ptp(base.nodes, axis=0))), 1e-300)

    def shapes(of: ModalModel) -> Array:
        turns = size * of.rotation_shapes
        return np.concatenate([of.translation_shapes.reshape(-1, of.modes), turns.reshape(-1, of.modes)])

    return np.asarray(np.linalg.lstsq(shapes(model), shapes(base)[:, 6:], rcond=None)[0][6:])

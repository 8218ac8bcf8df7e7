"""Derivatives of what a run gives by the variables of a problem: those of `erls.sensitivities` where they are known,
and otherwise differences of runs whose steps are fixed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.optimization.design import Design, Designs, run_of
from erls.optimization.evaluation import beside
from erls.optimization.problem import Problem
from erls.run.chain.run import ChainRun
from erls.scene.integrators import FIXED_STEP
from erls.sensitivity.sensitivities import Method, sensitivities

Asked = Callable[[ChainRun], Array]
"""(n,) what a run gives."""

_ALL = "constraints"
_FORWARD: tuple[Method, ...] = ("forward",)
_BACKWARD: tuple[Method, ...] = ("adjoint", "forward")  # runs with contacts, stops or what sticks have no way back
_LARGE = 0.25  # of a field: modes of slender links turn with the fourth power of a diameter
_STEP = 2e-5  # of a variable: vibrations that fall out of step make large third derivatives


def derivatives(
    problem: Problem,
    designs: Designs,
    design: Design,
    run: ChainRun,
    asked: Asked,
    times: Array,
    weights: Array | None = None,
) -> tuple[Array, str]:
    """(n, v) of what is asked at times (k,) by all variables, or (m, v) of weighted sums (m, n); how they were found.

    Raises
    ------
    SceneError
        BAD_FIELD: neither way is open.
    SimulationError
        A run beside the design failed.
    """
    keys = _sizes(problem, design.x)
    sums = None if weights is None else {_ALL: weights}
    refused: SceneError | None = None
    for method in _FORWARD if weights is None else _BACKWARD:
        try:  # constraints ask a run for its motion and what moves it; masses are counted from descriptions
            found = sensitivities(run, {_ALL: asked}, keys, method, weights=sums, models=False, times=times)
        except SceneError as refusal:
            if refusal.cause != Cause.NO_DERIVATIVE:
                raise
            refused = refusal
            continue
        slopes = np.stack([found.derivatives[_ALL][key] for key in keys], axis=-1) @ problem.factors
        return slopes, "sensitivities" if found.method == "forward" else found.method
    assert refused is not None
    settings = problem.scene.record.simulation
    if settings.integrator != FIXED_STEP:
        raise SceneError(
            Cause.BAD_FIELD,
            f"{refused.message}, and differences of runs whose steps change are noise",
            where=refused.where,
            value=settings.integrator,
            remedy=f"{refused.remedy}; or give simulation.step",
        ) from None
    whole = differences(designs, design, asked)
    return whole if weights is None else weights @ whole, "differences"


def _sizes(problem: Problem, x: Array) -> dict[str, float]:
    """How large a change of each field is large: a share of what it is, or of what it may go through."""
    values = np.abs(problem.factors @ x)
    spans = np.abs(problem.factors) @ (problem.upper - problem.lower)
    sizes = _LARGE * np.where(values > 0, np.minimum(values, spans), spans)
    return {p.key: float(size) for p, size in zip(problem.parameters, sizes, strict=True)}


def differences(designs: Designs, design: Design, asked: Asked) -> Array:
    """(n, v) by all variables, from runs on both sides of a design."""
    problem, columns = designs.problem, []
    for above, below, step in beside(design.x, problem.upper - problem.lower, _STEP):
        more, less = (asked(run_of(designs.at(x))) for x in (above, below))
        columns.append((more - less) / (2 * step))
    return np.stack(columns, axis=-1)

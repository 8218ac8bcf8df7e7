"""Derivatives of what a run gives by the variables of a problem: those of `erls.sensitivities` where they are known,
and otherwise differences of runs whose steps are fixed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.optimization.design import Design, Designs, run_of
from erls.optimization.problem import Problem
from erls.run.chain.run import ChainRun
from erls.scene.integrators import FIXED_STEP
from erls.sensitivity.sensitivities import sensitivities

Asked = Callable[[ChainRun], Array]
"""(n,) what a run gives."""

_ALL = "constraints"
_STEP = 2e-5  # of a variable: vibrations that fall out of step make large third derivatives


def derivatives(
    problem: Problem, designs: Designs, design: Design, run: ChainRun, asked: Asked
) -> tuple[Array, str]:
    """(n, v) by all variables, and how they were found.

    Raises
    ------
    SceneError
        BAD_FIELD: neither way is open.
    SimulationError
        A run beside the design failed.
    """
    keys = [p.key for p in problem.parameters]
    try:
        found = sensitivities(run, {_ALL: asked}, keys, "forward").derivatives[_ALL]
    except SceneError as refusal:
        if refusal.cause != Cause.BAD_FIELD or "not known yet" not in refusal.message:
            raise
        settings = problem.scene.record.simulation
        if settings.integrator != FIXED_STEP:
            raise SceneError(
                Cause.BAD_FIELD,
                f"{refusal.message}, and differences of runs whose steps change are noise",
                where=refusal.where,
                value=settings.integrator,
                remedy=f"{refusal.remedy}; or give simulation.step",
            ) from None
        return _differences(designs, design, asked), "differences"
    return np.stack([found[key] for key in keys], axis=-1) @ problem.factors, "sensitivities"


def _differences(designs: Designs, design: Design, asked: Asked) -> Array:
    problem, columns = designs.problem, []
    span = problem.upper - problem.lower
    for k in range(len(design.x)):
        step = _STEP * max(abs(float(design.x[k])), 1e-2 * float(span[k]))
        sides = []
        for sign in (1.0, -1.0):
            x = design.x.copy()
            x[k] += sign * step
            sides.append(asked(run_of(designs.at(x))))
        columns.append((sides[0] - sides[1]) / (2 * step))
    return np.stack(columns, axis=-1)

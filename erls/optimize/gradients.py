"""Derivatives of what a run gives by the variables of a problem: those of `erls.sensitivities` where they are known, and
otherwise differences of runs whose steps are fixed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.optimize.design import Design, Designs, run_of
from erls.optimize.problem import Problem
from erls.run.chain.run import ChainRun
from erls.scene.integrators import FIXED_STEP
from erls.sensitivity.sensitivities import sensitivities

Asked = Callable[[ChainRun], Sequence[Array]]
"""Arrays that a run gives."""

_STEP = 2e-4  # of a variable: truncation takes 4e-8 of a derivative, iterations that end at 1e-13 m as much


def derivatives(
    problem: Problem, designs: Designs, design: Design, run: ChainRun, asked: Asked
) -> tuple[list[Array], str]:
    """Of arrays by all variables, (..., v) each, and how they were found.

    Raises
    ------
    SceneError
        BAD_FIELD: neither way is open.
    SimulationError
        A run beside the design failed.
    """
    count = len(asked(run))
    keys = [p.key for p in problem.parameters]
    try:
        found = sensitivities(run, {str(k): lambda r, k=k: asked(r)[k] for k in range(count)}, keys)
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
    by_key = [np.stack([found.derivatives[str(k)][key] for key in keys], axis=-1) for k in range(count)]
    return [array @ problem.factors for array in by_key], "sensitivities"


def _differences(designs: Designs, design: Design, asked: Asked) -> list[Array]:
    problem, columns = designs.problem, []
    span = problem.upper - problem.lower
    for k in range(len(design.x)):
        step = _STEP * max(abs(float(design.x[k])), 1e-2 * float(span[k]))
        sides = []
        for sign in (1.0, -1.0):
            x = design.x.copy()
            x[k] += sign * step
            sides.append(asked(run_of(designs.at(x))))
        columns.append([(above - below) / (2 * step) for above, below in zip(*sides, strict=True)])
    return [np.stack([column[k] for column in columns], axis=-1) for k in range(len(columns[0]))]

"""Integration of nodal systems: Lie-group generalized-α, one iteration matrix for as many steps as it serves.

Between knots, stiff elements would turn errors of interpolation into accelerations. A solution therefore keeps the
accelerations and multipliers of the knots, interpolated through differences of each stretch without jumps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from erls.equations.nodal.equations import Nodal
from erls.equations.nodal.redundant import refuse_open
from erls.errors import SimulationError
from erls.integrate.base import Observer, Options, Solution
from erls.integrate.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.integrate.step_plans import Plan
from erls.maths.so3 import Array

_LOOKS = 21
_SHARE = 1e-2  # of the Newton tolerance: errors of a step add up, over 2 s of 1 ms steps to a million times as much


def nodal_generalized_alpha(
    system: Nodal,
    times: tuple[float, float],
    y: Array,
    v: Array,
    options: Options,
    observer: Observer | None = None,
    adaptive: bool = False,
    plan: Plan | None = None,
) -> Solution:
    """Integrate a `Nodal`; see `lie_generalized_alpha`.

    With ``adaptive``, steps are chosen for an error of ``options.tolerance`` over the whole run, unless a ``plan`` says
    what they are.
    """
    settings = ConstrainedOptions(
        options.step,
        spectral_radius=options.spectral_radius,
        newton_tolerance=_SHARE * options.newton_tolerance,
        start_from="last",
        tolerance=options.tolerance,
        follows_tolerance=adaptive and plan is None,
        output_step=options.output_step,
        keeper=options.keeper,
        compiled=None if system.locked is None else True,  # only what is compiled knows conditions out of use
    )

    def complete(found: ConstrainedSolution) -> Solution:
        more = [np.concatenate([found.accelerations, found.multipliers], axis=1)]
        for _ in range(2):
            more.append(slopes_in_time(found.t, more[-1]))
        full = [np.concatenate(pair, axis=1) for pair in zip((found.y, found.v, found.a), more, strict=True)]
        known = found.work, found.failure, found.warnings
        return Solution(found.t, full[0], full[1], full[2], *known, companion=found.companion, halved=found.halved)

    def watch(t: float, knots: Callable[[], ConstrainedSolution]) -> Sequence[float] | None:
        return None if observer is None else observer(t, lambda: complete(knots()))

    start, moving = system.configuration(y, v), system.system if system.locked is None else system.locked
    return closed(system, complete(lie_generalized_alpha(moving, times, *start, settings, watch, plan)))  # type: ignore[arg-type]


def closed(system: Nodal, found: Solution) -> Solution:
    """A solution that failed where conditions of loops were left out that did not follow from the others for long."""
    if found.failure is not None or not system.chain.left_out:
        return found
    for k in np.unique(np.linspace(0, len(found.t) - 1, _LOOKS).astype(np.int64)):
        q, _ = system.configuration(found.y[k], found.v[k])
        try:
            refuse_open(system.chain.full, float(found.t[k]), q, system.chain.left_out)
        except SimulationError as problem:
            return replace(found, failure=problem)
    return found


def slopes_in_time(t: Array, values: Array) -> Array:
    """(knots, n) derivatives by time, from differences that reach over no jump."""
    result = np.zeros_like(values)
    ends = np.flatnonzero(np.diff(t) == 0) + 1
    for part in np.split(np.arange(len(t)), ends):
        if len(part) > 1:
            result[part] = np.gradient(values[part], t[part], axis=0)
    return result

"""Derivatives of what is asked of a run: through its motion, and through what a parameter itself changes of the answer.

An output is a function of a run. Of its derivative

    dg/dp = ∂g/∂(y, v, a) · d(y, v, a)/dp + ∂g/∂p

both parts are differences of the function, on motions that are known: that of the run moved along its derivative, and
that of the run with the mechanism at other values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.variants import Difference
from fe_import.model import IntArray

Output = Callable[[ChainRun], Any]
"""A number or an array that a run gives, smooth in its motion."""

EVALUATIONS = 4
"""Of an output by a parameter, along the derivative of a motion."""
ALONG = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))
"""Steps and weights of differences, of fourth order."""
MOVED = 1e-3
"""Steps along the derivative of a motion, of the size of the mechanism."""


def value_of(output: Output, run: ChainRun, name: str) -> Array:
    """What a run gives.

    Raises
    ------
    SceneError
        BAD_FIELD: no finite number or array of numbers.
    """
    given = output(run)
    try:
        found = np.asarray(given, dtype=float)
    except (TypeError, ValueError) as problem:
        message, remedy = f"not a number or an array of numbers: {problem}", "give a function of a run"
        raise SceneError(Cause.BAD_FIELD, message, where=f"output {name}", remedy=remedy) from None
    if not np.isfinite(found).all():
        message, remedy = "not finite", "only finite outputs have derivatives"
        raise SceneError(Cause.BAD_FIELD, message, where=f"output {name}", remedy=remedy)
    return found


def around(run: ChainRun, times: Array, outputs: Mapping[str, Output], values: Mapping[str, Array]) -> IntArray:
    """Numbers of the knots between which times (k,) lie, all that outputs of these ``values`` ask for.

    Raises
    ------
    SceneError
        BAD_FIELD: an output looks elsewhere, too.
    """
    t = run.solution.t
    sides = [np.searchsorted(t, times, side=side) + more for side in ("left", "right") for more in (-1, 0)]
    ends = np.array([0, len(t) - 3, len(t) - 2, len(t) - 1])
    rows = np.unique(np.clip(np.concatenate([*sides, ends]), 0, len(t) - 1))
    for name, output in outputs.items():
        if not np.array_equal(value_of(output, at_knots(run, rows), name), values[name]):
            message, remedy = "it looks at other times than those that are given", "give all, or none"
            raise SceneError(Cause.BAD_FIELD, message, where=f"output {name}", remedy=remedy)
    return rows


def at_knots(run: ChainRun, rows: IntArray) -> ChainRun:
    """A run that knows some of its knots alone."""
    s = run.solution
    return replace(run, solution=replace(s, t=s.t[rows], y=s.y[rows], v=s.v[rows], a=s.a[rows]))


def own_derivative(output: Output, name: str, run: ChainRun, difference: Difference, value: Array) -> Array:
    """What a parameter changes of an output whose ``value`` is known, the motion held; in the shape of the output."""
    return difference.beside(lambda variant: value_of(output, variant.run(run), name), value)


def derivative_of(
    output: Output, name: str, run: ChainRun, difference: Difference, motion: Array, metres: Array, value: Array
) -> Array:
    """Of an output by a parameter, in the shape of the output.

    Parameters
    ----------
    output : callable
    name : str
        For messages.
    run : ChainRun
    difference : Difference
        By the parameter.
    motion : (k, 3, n) array
        Derivatives of coordinates, rates and accelerations at the knots of the run.
    metres : (n,) array
        Per unit of each coordinate.
    value : array
        Of the output.
    """
    own = own_derivative(output, name, run, difference, value)
    formulation: Any = run.formulation
    largest = float(np.abs(metres * motion[:, 0]).max(initial=0.0))
    if not motion.any():
        return own
    step = MOVED * float(formulation.mechanism.reach) / max(largest, 1e-300)
    s = run.solution

    def moved(share: float) -> Array:
        y, v, a = (x + share * motion[:, i] for i, x in enumerate((s.y, s.v, s.a)))
        return value_of(output, replace(run, solution=replace(s, y=y, v=v, a=a)), name)

    return np.asarray(own + sum(weight / step * moved(at * step) for at, weight in ALONG))

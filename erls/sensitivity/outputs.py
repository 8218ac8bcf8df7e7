"""Derivatives of what is asked of a run: through its motion, and through what a parameter itself changes of the answer.

An output is a function of a run. Of its derivative

    dg/dp = ∂g/∂(y, v, a) · d(y, v, a)/dp + ∂g/∂p

both parts are differences of the function, on motions that are known: that of the run moved along its derivative, and
that of the run with the mechanism at other values.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.variants import Difference

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

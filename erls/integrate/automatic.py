"""The integrator that fits a system: ``auto``.

A compiled system goes to `lobatto`, whose steps then cost microseconds; SciPy would come back to Python for each
evaluation. So does a stiff system, whose highest frequency would keep the steps of an explicit method below what the
motion asks for. What is left, soft systems in Python, goes to ``dop853``, which needs the fewest evaluations there.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from erls.equations.system import SecondOrderSystem
from erls.errors import SimulationError
from erls.integrate.base import Observer, Options, Solution
from erls.integrate.lobatto import lobatto
from erls.integrate.scipy_ivp import explicit_step_limit, scipy_method
from erls.maths.so3 import Array

FEW_STEPS = 300  # of dop853, at its limit of stability: as many as an implicit method of order 6 needs anyway
_TIGHTER = 1e-2  # tolerances of a step of dop853, per wish for the whole run


def automatic(
    system: SecondOrderSystem,
    times: tuple[float, float],
    y: Array,
    v: Array,
    options: Options,
    observer: Observer | None = None,
) -> Solution:
    """Integrate to ``options.tolerance`` with the method of `choose`; ``Solution.choice`` says which and why."""
    name, why = choose(system, times, y, v)
    if name == "lobatto":
        found = lobatto(system, times, y, v, options, observer)
    else:
        strict = _TIGHTER * options.tolerance
        tight = replace(options, rtol=float(np.clip(strict, 1e-13, 1e-3)), atol=strict)
        found = scipy_method(name)(system, times, y, v, tight, observer)
    return replace(found, choice=f"{name}: {why}")


def choose(system: SecondOrderSystem, times: tuple[float, float], y: Array, v: Array) -> tuple[str, str]:
    """Name of the method for a system from a state on, and the reason in words."""
    if system.compiled is not None:
        return "lobatto", "the equations are compiled"
    try:
        frequency, limit = explicit_step_limit(system, times[0], np.asarray(y), np.asarray(v), "dop853")
    except (np.linalg.LinAlgError, SimulationError):
        return "lobatto", "the stiffness at the start is not known"
    steps = (times[1] - times[0]) / limit if math.isfinite(limit) else 0.0
    if steps > FEW_STEPS:
        return "lobatto", f"the highest frequency, {frequency:.4g} Hz, would take {steps:.3g} explicit steps"
    return "dop853", f"the highest frequency, {frequency:.4g} Hz, limits its steps to no less than the motion does"

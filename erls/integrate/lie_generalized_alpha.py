"""Lie-group generalized-α for constrained systems: implicit, second order, with numerical damping.

O. Brüls and A. Cardona, J. Comput. Nonlinear Dyn. 5 (2010) 031002; M. Arnold and O. Brüls, Multibody Syst. Dyn. 18
(2007) 185–202. At every knot M v̇ = f − Bᵀλ and Φ = 0 hold, and with the algorithmic acceleration a,

    (1 − α_m) a₁ + α_m a₀ = (1 − α_f) v̇₁ + α_f v̇₀,
    q₁ = q₀ ∘ exp(d),  d = h v₀ + h² ((½ − β) a₀ + β a₁),  v₁ = v₀ + h ((1 − γ) a₀ + γ a₁)

with the coefficients of `erls.integrate.generalized_alpha`. Corrections of d and λ solve

    [[β' M + γ' C + K T, Bᵀ], [B T, 0]],   β' = (1 − α_m)/(h² β (1 − α_f)),  γ' = γ/(h β),

scaled as in `erls.maths.saddle`. A step starts from v̇₁ = 0 and λ₁ = 0 unless told otherwise.
A run starts with a₀ = v̇₀: that is wrong by O(h), once; multipliers, of first order there, are of second order when it
has decayed.
"""

from __future__ import annotations

import math

import numpy as np

from erls.equations.consistency import consistent_start, refuse_redundant
from erls.equations.constrained_system import Configuration, ConstrainedState, ConstrainedSystem
from erls.errors import Cause, SimulationError
from erls.integrate.base import Leg, Observer, StopRun, legs
from erls.integrate.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrate.constrained_run import ConstrainedRecorder
from erls.integrate.lie_compiled import compiled_steps
from erls.integrate.lie_formulas import FAILED, GROWTH, INACCURATE, MAX_HALVINGS, Limit, Steps
from erls.integrate.lie_steps import NumpySteps
from erls.maths.so3 import Array

_SAFETY, _LARGEST_CHANGE = 0.9, 4.0  # of an adaptive step
_FIRST, _SMALLEST = 1 / 64, 1e-6  # adaptive steps, of the largest
_AT_ONCE, _HELD = 4096, 8  # adaptive steps that are asked for, and those after a rejected one, which do not grow


def lie_generalized_alpha(
    system: ConstrainedSystem,
    times: tuple[float, float],
    q: Configuration,
    v: Array,
    options: ConstrainedOptions,
    observer: Observer | None = None,
) -> ConstrainedSolution:
    """Integrate with fixed steps ``options.step`` (default: a thousandth of the run, at most 1 ms), or adaptive ones.

    Fixed steps are equal inside a leg and end on breakpoints. Where Newton's method fails they are halved for a while.
    With ``options.error_tolerance`` they follow the local error, up to ``options.step``.
    """
    walk = legs(system, times) or [Leg(times[0], times[1], times[0], times[1])]
    step = options.step or min((times[1] - times[0]) / 1000, 1e-3) or 1e-3
    failure: SimulationError | None = None
    given = ConstrainedState(q, np.array(v, dtype=float), np.zeros(system.size), np.zeros(system.constraints))
    recorder = ConstrainedRecorder(system, times[0], given, observer, options.output_step)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # infinities are found and reported
        try:
            refuse_redundant(system, walk[0].first, q)
            q, v = consistent_start(system, walk[0].first, q, given.v, recorder.warnings)
            steps = compiled_steps(system, options, recorder) or NumpySteps(system, options, recorder)
            for leg in walk:
                steps.begin(leg, q, v)
                if leg.end > leg.start:
                    if options.error_tolerance is None:
                        _equal_steps(steps, leg, step, options, recorder)
                    else:
                        _adaptive_steps(steps, leg, step, options.error_tolerance, recorder)
                q, v = steps.end()
        except StopRun:
            pass
        except KeyboardInterrupt:
            failure = SimulationError(
                Cause.INTERRUPTED, "the run was interrupted", remedy="the motion up to this time was kept"
            )
        except SimulationError as error:
            failure = error
    if recorder.time is None:  # failed at once; a solution always has a knot
        recorder.add(times[0], given)
    if failure is not None and not failure.where:
        failure.where = f"t = {recorder.time:.9g} s"
    return recorder.solution(failure)


def _equal_steps(
    steps: Steps, leg: Leg, step: float, options: ConstrainedOptions, recorder: ConstrainedRecorder
) -> None:
    """Equal steps over a leg, each of 2^MAX_HALVINGS units of time, so that halved steps meet its end."""
    unit = 1 << MAX_HALVINGS
    count = max(1, math.ceil((leg.end - leg.start) / step * (1 - 1e-9)))
    total, at, halvings, served = count * unit, 0, 0, 0
    span = leg.end - leg.start
    steps.set_step(span / count)
    while at < total:
        width = unit >> halvings
        ends = np.arange(at + width, total + 1 if not halvings else at + width + 1, width)
        times = np.where(ends == total, leg.end, leg.start + span * (ends / total))
        made, status = steps.stretch(times, leg.last, Limit())
        at, served = at + made * width, served + made
        if status == FAILED:
            recorder.work.rejected_steps += 1
            halvings, served = halvings + 1, 0
            if halvings > MAX_HALVINGS or options.iteration_matrix == "frozen":
                raise steps.failure(float(times[made]))
        elif halvings and served >= 4 and at % (2 * width) == 0:
            halvings, served = halvings - 1, 0
        else:
            continue
        steps.set_step(span / count / (1 << halvings))


def _adaptive_steps(
    steps: Steps, leg: Leg, largest: float, tolerance: float, recorder: ConstrainedRecorder
) -> None:
    """Steps whose local error stays below ``tolerance`` [m]; each change of their size leads to the end of the leg.

    The error of a step is of third order (M. Géradin, A. Cardona, Flexible Multibody Dynamics, 2001, ch. 14).
    """
    t, h, held = leg.start, min(max(steps.h, _FIRST * largest), largest), False
    while t < leg.end:
        count = max(1, math.ceil((leg.end - t) / h * (1 - 1e-9)))
        steps.set_step((leg.end - t) / count)
        ahead = min(count, _HELD if held else _AT_ONCE)
        times = t + (leg.end - t) * np.arange(1, ahead + 1) / count
        if ahead == count:
            times[-1] = leg.end
        can_grow = not held and count > 1 and steps.h * GROWTH <= largest
        made, status = steps.stretch(times, leg.last, Limit(tolerance, can_grow))
        if made:
            t = float(times[made - 1])
        ratio = _SAFETY * (tolerance / max(steps.error, 1e-300)) ** (1 / 3)
        if status == FAILED:
            ratio = 1 / _LARGEST_CHANGE
        elif status == INACCURATE:
            ratio = min(ratio, 0.8)
        held = status in (FAILED, INACCURATE)
        recorder.work.rejected_steps += held
        h = min(largest, steps.h * min(max(ratio, 1 / _LARGEST_CHANGE), _LARGEST_CHANGE))
        if h < _SMALLEST * largest:
            raise steps.failure(float(times[made])) if status == FAILED else _too_small(t, steps, tolerance)


def _too_small(t: float, steps: Steps, tolerance: float) -> SimulationError:
    return SimulationError(
        Cause.STEP_TOO_SMALL,
        f"a step of {steps.h:.3g} s still has an error of {steps.error:.3g} m",
        where=f"t = {t:.9g} s",
        value=f"{steps.h:.3g} s",
        limit=f"{tolerance:.3g} m",
        remedy="look for jumps of forces without breakpoint; or allow a larger error",
    )

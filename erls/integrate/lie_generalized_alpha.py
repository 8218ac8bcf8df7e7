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

from functools import partial

import numpy as np

from erls.equations.consistency import consistent_acceleration, consistent_start, refuse_redundant
from erls.equations.constrained_system import (
    Configuration,
    ConstrainedState,
    ConstrainedSystem,
    SwitchedSystem,
)
from erls.equations.dead_points import dead_point
from erls.equations.system import metre_scales
from erls.errors import Cause, SimulationError
from erls.integrate.alpha_rules import Formulas, Rules, Words
from erls.integrate.alpha_steps import Steps, adaptive_steps, equal_steps, rough_steps
from erls.integrate.alpha_to_tolerance import to_tolerance
from erls.integrate.base import Leg, Observer
from erls.integrate.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrate.constrained_run import ConstrainedRecorder, tell_again
from erls.integrate.driver import Recorder, not_finite, run_to_end
from erls.integrate.memory import Keeping
from erls.integrate.step_plans import Plan, planned
from erls.integrate.switching import Switch
from erls.maths.jit import ENABLED
from erls.maths.so3 import Array

_REFRESH_COST = 6.0  # of a fresh iteration matrix, in iterations
_TOLERATED = 3.0  # iterations beyond the fewest, or beyond two, on average, before a fresh matrix is worth its cost


def lie_generalized_alpha(
    system: ConstrainedSystem,
    times: tuple[float, float],
    q: Configuration,
    v: Array,
    options: ConstrainedOptions,
    observer: Observer | None = None,
    plan: Plan | None = None,
) -> ConstrainedSolution:
    """Integrate with fixed steps ``options.step`` (default: a thousandth of the run, at most 1 ms), or others.

    Fixed steps are equal inside a leg and end on breakpoints. Where Newton's method fails they are halved for a while.
    With ``options.error_tolerance`` they follow the local error, up to ``options.step``; where options follow the
    tolerance, `erls.integrate.alpha_to_tolerance` chooses them. A ``plan`` says what they are instead of options.
    """
    run = partial(_run, system, times, q, v)
    if not options.follows_tolerance:
        return run(options, observer, plan)
    return to_tolerance(run, system, times[1] - times[0], options, observer)


def _run(
    system: ConstrainedSystem,
    times: tuple[float, float],
    q: Configuration,
    v: Array,
    options: ConstrainedOptions,
    observer: Observer | None = None,
    plan: Plan | None = None,
    known: ConstrainedSolution | None = None,
) -> ConstrainedSolution:
    """An `erls.integrate.alpha_to_tolerance.Attempt`."""
    step = options.step or min((times[1] - times[0]) / 1000, 1e-3) or 1e-3
    given = ConstrainedState(q, np.array(v, dtype=float), np.zeros(system.size), np.zeros(system.constraints))
    recorder = ConstrainedRecorder(system, times[0], given, observer, options.output_step)

    def advance(steps: Steps, leg: Leg) -> None:
        if options.error_tolerance is not None:
            follow = rough_steps if options.rough else adaptive_steps
            follow(steps, leg, step, options.error_tolerance, recorder)
            return
        parts = [(leg, step)] if plan is None else planned(plan, leg)
        for part, width in parts[steps.part :]:
            equal_steps(steps, part, width, options.iteration_matrix != "frozen", recorder, given=plan is None)
            steps.part += 1

    moving = system if recorder.switching is not None and isinstance(system, SwitchedSystem) else None

    def begin(
        steps: Steps, leg: Leg, place: Configuration, rate: Array, stored: tuple[Array, Array] | None = None
    ) -> None:
        switching = recorder.switching
        if switching is not None and (stored is not None or switching.system.jumps):
            # accelerations jump: of vibrations that steps do not resolve they would start another with each switch
            beta = Formulas.of(Rules(options.spectral_radius, 0.0), step).beta
            switching.system.seen_by = beta * (steps.h or step) ** 2
        start = _start_of_leg(system, leg, place, rate, recorder, stored)
        steps.begin(place, start.v, np.concatenate([start.a, start.multipliers]))

    def go(walk: list[Leg]) -> None:
        if known is not None:
            tell_again(known, recorder)
            return
        free = system if moving is None else moving.unlocked
        refuse_redundant(free, walk[0].first, q)
        place, rate = consistent_start(free, walk[0].first, q, given.v, recorder.warnings)
        if recorder.switching is not None:
            recorder.switching.coarse = True
            rate = np.where(given.v == 0.0, 0.0, rate)  # who rests does
        steps = steps_of(system, options, recorder, recorder.kept)
        keeping = Keeping(options.keeper, recorder, steps)
        for number, leg in enumerate(walk):
            if keeping.passed(number):
                continue
            if not keeping.resumes(number):
                begin(steps, leg, place, rate)
            elif recorder.switching is not None:
                leg = recorder.switching.leg
            while leg.end > leg.start:
                before = recorder.steps
                try:
                    advance(steps, leg)
                    break
                except Switch as switch:
                    assert moving is not None
                    leg = Leg(switch.t, leg.end, switch.t, leg.last)
                    begin(steps, leg, *moving.from_stored(switch.y, switch.v), (switch.y, switch.v))
                except SimulationError as problem:
                    raise _why(problem, system, recorder.time or leg.start, steps) from None
                finally:
                    if options.project_velocity:
                        recorder.work.factorizations += recorder.steps - before
            place, rate = steps.end()

    found = run_to_end(system, times, recorder, go, lambda: recorder.add(times[0], given))
    assert isinstance(found, ConstrainedSolution)
    return found


def _why(problem: SimulationError, system: ConstrainedSystem, t: float, steps: Steps) -> SimulationError:
    """What ended the steps: a dead point, where that is why they fail."""
    if problem.cause not in (Cause.NEWTON_FAILED, Cause.STEP_TOO_SMALL):
        return problem
    return dead_point(system, t, steps.end()[0]) or problem


def steps_of(system: ConstrainedSystem, options: ConstrainedOptions, recorder: Recorder, kept: int) -> Steps:
    """Steps of a system that stores so many numbers of a knot: by compiled functions, where there is a compiler, the
    system has them, and velocities are not projected.
    """
    from erls.equations.uncompiled import tied_steps_of  # here: it imports the linear algebra of plain systems

    wanted = ENABLED if options.compiled is None else options.compiled
    compiled = system.compiled if wanted and not options.project_velocity else None
    rules = Rules(
        options.spectral_radius,
        options.newton_tolerance,
        matrix=options.iteration_matrix,
        guess=options.start_from,
        balance=options.residual_tolerance,
        patience=_REFRESH_COST,
        renewal=_REFRESH_COST,
        tolerated=_TOLERATED,
        fewest=2,
        over=2,
    )
    words = Words(system.constraint_names, "there", "a smaller step")
    known = compiled or tied_steps_of(system, kept, options.project_velocity)
    return Steps(known, metre_scales(system), rules, words, recorder)


def _start_of_leg(
    system: ConstrainedSystem,
    leg: Leg,
    q: Configuration,
    v: Array,
    recorder: ConstrainedRecorder,
    stored: tuple[Array, Array] | None,
) -> ConstrainedState:
    """Acceleration and multipliers at the start of a leg, which becomes a knot; places and rates that are ``stored`` of
    one are those of a switch.
    """
    recorder.work.rhs_calls += 1
    recorder.work.factorizations += 1
    switching = recorder.switching
    if switching is None:
        a, multipliers = consistent_acceleration(system, leg.first, q, v)
    else:
        switching.stand(leg, *(stored or system.stored(leg.first, q, v, np.zeros(system.size))[:2]))
        assert isinstance(system, SwitchedSystem)
        a, multipliers = system.driven(leg.first, q, v)
    if not np.isfinite(a).all():
        raise not_finite(leg.start, a)
    state = ConstrainedState(q, v, a, multipliers)
    recorder.begin_with(leg.start, state)
    return state

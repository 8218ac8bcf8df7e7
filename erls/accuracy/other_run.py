"""Other equations, or other options, over the time of a run, and how far its points are from theirs."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np

from erls.accuracy.judged_places import judged_nodes, judged_places
from erls.auto.outputs import Watched
from erls.equations.formulation import Formulation
from erls.equations.registry import TREES, formulate
from erls.equations.substructures import solved
from erls.errors import Cause, SimulationError
from erls.integrate.base import Options, Solution, hermite
from erls.integrate.choice import integrator, options_of
from erls.integrate.work_limit import work_limit
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import in_order
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism
from erls.scene.integrators import FIXED_STEP
from erls.scene.settings import Simulation

_PLACES = 60
_SHARE = 1.2  # of the distance from other equations, whose run has an error of integration, too
_MOST = 4  # times the evaluations of the run that another one may take


def other_run(
    run: ChainRun,
    formulation: Formulation,
    options: Options,
    most: float | None = None,
    steps: float = np.inf,
    settings: Simulation | None = None,
    **more: Any,
) -> Solution | None:
    """Integrate other equations, or with other options, over the time of a run; None where that fails, or takes more
    than ``most`` evaluations, `_MOST` times its own unless given, or more ``steps``. By the integrator of ``settings``,
    which are those of the run unless given; ``more`` goes to what integrates.

    Raises
    ------
    SimulationError
        INTERRUPTED.
    """
    limit = work_limit(_MOST * run.solution.work.rhs_calls if most is None else most, steps)
    integrate = integrator(formulation.mechanism, settings or run.scene.record.simulation)
    times = float(run.solution.t[0]), run.end
    found = integrate(formulation, times, *formulation.initial_state(), options, limit, **more)
    if found.failure is not None and found.failure.cause == Cause.INTERRUPTED:
        raise found.failure
    return found if found.failure is None and found.t[-1] >= run.end else None


def distance_from(
    run: ChainRun, watched: Watched, formulation: Formulation, other: Solution
) -> tuple[Array, Array]:
    """Times (k,) [s], and how far any judged point of a run and of other equations were apart up to each [m]."""
    looks, own = run.looks(_PLACES), run.solution
    here, there = (
        judged_places(of, watched, looks, *hermite(s.t, s.y, s.v, s.a, looks))
        for of, s in ((solved(run.formulation), own), (formulation, other))
    )
    return looks, np.maximum.accumulate(np.linalg.norm(here - there, axis=-1).max(axis=1, initial=0.0))


def mechanism_with(run: ChainRun, effects: Set[str]) -> Mechanism:
    """The mechanism of a run with some effects more."""
    record = run.scene.record
    names = in_order(run.formulation.mechanism.effects | effects)
    settings = msgspec.structs.replace(record.simulation, effects=names)
    scene = replace(run.scene, record=msgspec.structs.replace(record, simulation=settings))
    return build_mechanism(scene).mechanism


def distance_beside(run: ChainRun, whole: Mechanism, settings: Simulation, most: float) -> float | None:
    """How far points of a run get from those of another mechanism [m]; None where that fails or takes too long.

    Parameters
    ----------
    run : ChainRun
    whole : Mechanism
        The same with more effects or modes.
    settings : Simulation
        By which it is integrated.
    most : float
        Evaluations that it may take.

    Raises
    ------
    SimulationError
        INTERRUPTED.
    """
    options = replace(options_of(settings), output_step=None)
    try:
        formulation = solved(formulate(whole, settings))
        found = other_run(run, formulation, options, most, settings=settings)
    except SimulationError as problem:  # it has no start, as where links are softer under their loads
        if problem.cause == Cause.INTERRUPTED:
            raise
        return None
    return None if found is None else float(distance_from(run, judged_nodes(run), formulation, found)[1][-1])


def following_tolerance(settings: Simulation) -> Simulation | None:
    """Those with steps that follow the tolerance, by the default integrator; None of beam elements."""
    if settings.formulation not in TREES:
        return None
    return msgspec.structs.replace(settings, integrator="auto", step=None, coordinates="independent")


def error_beside(run: ChainRun, whole: Mechanism, most: float = 0.0) -> tuple[float | None, str]:
    """What a run is off by the equations of another mechanism in the same formulation [m], or None, and why.

    Fixed steps may not resolve what the other one does: its steps follow the tolerance, where they can. What such a run
    is off by for its steps is then in the figure once more.

    Parameters
    ----------
    run : ChainRun
    whole : Mechanism
        The same with more effects or modes.
    most : float
        Evaluations that it may take, where that is more than `_MOST` times those of the run.
    """
    own = run.scene.record.simulation
    adaptive = following_tolerance(own) if own.integrator == FIXED_STEP else None
    for settings in (own,) if adaptive is None else (adaptive, own):
        distance = distance_beside(run, whole, settings, max(most, _MOST * run.solution.work.rhs_calls))
        if distance is not None:
            return _SHARE * distance, ""
    return None, "a run with all effects fails; use effects = 'all'"

"""What leaving out effects has changed in a run: an estimate after the fact, along the computed motion."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from erls.auto.coordinates import embedded, kept_places, same_start
from erls.auto.error_motion import Deviation, Knots, error_motion
from erls.auto.outputs import Outputs, busiest, effort_error, largest_distance, watched_nodes
from erls.auto.resolution import Resolution, Vibrations, resolution, vibrations
from erls.auto.static import vibrating_efforts
from erls.equations.formulation import Formulation
from erls.equations.quick import quick
from erls.equations.registry import formulate
from erls.equations.substructures import solved
from erls.equations.system import metre_scales
from erls.integrate.base import hermite
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import Certificate
from erls.run.chain.run import ChainRun
from fe_import.model import IntArray

FEWEST = 500  # steps
PLACES, EFFORTS = 40, 16  # knots at which points and drive forces are compared
UNRESOLVED = 0.1  # of the tolerance: what vibrations may add that the steps do not follow
_ACCURACY = 1e-2  # of the tolerance
_EVEN = 1.01  # ratio of steps that count as equal


@dataclass(frozen=True)
class Following:
    """How the error of what a run left out is followed.

    Attributes
    ----------
    whole : Mechanism
        With all effects.
    formulation : Formulation
        Its equations.
    kept : (m,) int array
        Places of the run's coordinates among theirs.
    start : (n,), (n,) arrays
        Error and its rate at the start.
    found : Vibrations
        What the scene sets off.
    wanted : Resolution
        How finely they are looked at.
    steps : int
        Over the whole run.
    """

    whole: Mechanism
    formulation: Formulation
    kept: IntArray
    start: tuple[Array, Array]
    found: Vibrations
    wanted: Resolution
    steps: int


def following(run: ChainRun, whole: Mechanism) -> Following:
    """What it takes to follow the error of a run that left out effects.

    Raises
    ------
    SimulationError
        SINGULAR_MASS.
    """
    settings = run.scene.record.simulation
    formulation = formulate(whole, settings)
    system = solved(formulation)
    kept = kept_places(whole, run.formulation.mechanism, system.size)
    begun = [embedded(x[0], kept, system.size) for x in (run.solution.y, run.solution.v)]
    begin = begun if same_start(whole, run.formulation.mechanism) else formulation.initial_state()
    found = vibrations(quick(system), whole, settings.duration, *begin)
    wanted = resolution(found, UNRESOLVED * settings.effects_tolerance)
    start = (begin[0] - begun[0], begin[1] - begun[1])
    return Following(whole, formulation, kept, start, found, wanted, wanted.count(settings.duration, FEWEST))


def certify(run: ChainRun, followed: Following) -> Certificate:
    """Estimate the error of a run that left out effects.

    Parameters
    ----------
    run : ChainRun
    followed : Following

    Raises
    ------
    SimulationError
        The error cannot be followed.
    """
    settings, whole, formulation = run.scene.record.simulation, followed.whole, followed.formulation
    system, reduced = solved(formulation), solved(run.formulation)
    kept, found, wanted = followed.kept, followed.found, followed.wanted
    legs, strides = _legs(run, settings.duration / followed.steps)
    accuracy = _ACCURACY * settings.effects_tolerance
    deviation = error_motion(system, reduced, kept, legs, followed.start, strides, accuracy)  # type: ignore[arg-type]
    watched = watched_nodes(whole)
    ours = Outputs(run.scene, run.formulation, watched)
    others = Outputs(run.scene, formulation, watched)
    metres = metre_scales(system)  # type: ignore[arg-type]
    static = run.formulation.mechanism.bandwidth is not None
    moved = _swing(system, deviation) if static else deviation.error
    apart = np.abs(metres * moved).sum(axis=1)
    here, there = [], []
    for k in busiest(apart, PLACES):
        t, other_y, other_v = _other(deviation, k, kept)
        here.append(ours.positions(run.formulation.state(t, deviation.y[k], deviation.v[k])))
        there.append(others.positions(formulation.state(t, other_y, other_v)))
    efforts: tuple[list[Array], list[Array]] = ([], [])
    if ours.driven:
        for k in busiest(apart, EFFORTS):
            efforts[0].append(others.efforts(*_other(deviation, k, kept)))
            efforts[1].append(ours.efforts(float(deviation.t[k]), deviation.y[k], deviation.v[k]))
    error, effort = largest_distance(here, there), effort_error(*efforts)
    if static and found.forced is not None and effort is not None:  # coarse steps do not follow fast vibrations
        effort = max(effort, vibrating_efforts(run.scene, formulation, found.forced) or 0.0)
    return Certificate(
        error + (wanted.unresolved if static else min(wanted.unresolved, error)),
        effort,
        settings.effects_tolerance,
        settings.effects_effort_tolerance,
    )


def _other(deviation: Deviation, k: int, kept: IntArray) -> tuple[float, Array, Array]:
    """Time and state of the whole system at a knot."""
    size = deviation.error.shape[1]
    y = embedded(deviation.y[k], kept, size) + deviation.error[k]
    v = embedded(deviation.v[k], kept, size) + deviation.rate[k]
    return float(deviation.t[k]), y, v


def _swing(system: Any, deviation: Deviation) -> Array:
    """(k, n) K⁻¹ M ë: about how far links are from where they would rest under their loads."""
    t, rest = deviation.t, np.zeros(system.size)
    spans = np.diff(t)
    a = np.diff(deviation.rate, axis=0) / np.maximum(spans, np.median(spans) / 2)[:, None]  # 0 between legs
    stiffness = system.stiffness_and_damping(float(t[0]), rest, rest)[0]
    weight = np.linalg.solve(stiffness, system.mass_matrix(float(t[0]), rest))
    return np.vstack([a[:1], a]) @ weight.T


def _legs(run: ChainRun, step: float) -> tuple[list[Knots], list[int]]:
    """Knots of a run between jumps, and how many of them make a step.

    Where knots are too far apart for it, or not even, states between them with accelerations of their own.
    """
    s, system = run.solution, quick(solved(run.formulation))
    ends = [0, *(np.flatnonzero(np.diff(s.t) == 0) + 1).tolist(), len(s.t)]
    legs, strides = [], []
    for first, end in itertools.pairwise(ends):
        part = slice(first, end)  # views: a run may be long
        t = s.t[part]
        if len(t) < 2:
            continue
        gaps = np.diff(t)
        if gaps.max() <= _EVEN * gaps.min() and gaps.max() <= 2 * step:
            legs.append(Knots.inside(t, s.y[part], s.v[part], s.a[part]))
            strides.append(max(1, round(step / gaps[0])))
            continue
        times = np.linspace(t[0], t[-1], max(int(np.ceil((t[-1] - t[0]) / step)), 2) + 1)
        y, v = hermite(t, s.y[part], s.v[part], s.a[part], times)
        knots = Knots.inside(times, y, v, np.zeros_like(y))
        states = zip(knots.t.tolist(), y, v, strict=True)
        accelerations = np.array([system.acceleration(*state) for state in states]).reshape(y.shape)
        legs.append(Knots(knots.t, y, v, accelerations))
        strides.append(1)
    return legs, strides

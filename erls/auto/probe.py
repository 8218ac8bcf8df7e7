"""Coarse looks at a scene: a run with everything, and runs without something, in few large steps.

Large steps follow rigid motion and the vibrations that matter (`erls.auto.resolution`); others follow statically.
Their own error is common to the runs with and without an effect, and cancels in first order from their difference.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import msgspec
import numpy as np

from erls.auto.coordinates import embedded, kept_places
from erls.auto.outputs import Outputs, busiest, effort_error, largest_distance, watched_nodes
from erls.auto.resolution import Resolution, Vibrations, resolution, vibrations
from erls.equations.formulation import Formulation
from erls.equations.quick import quick
from erls.equations.registry import formulate
from erls.equations.substructures import solved
from erls.equations.system import metre_scales
from erls.errors import Cause
from erls.integrate.base import Options, hermite
from erls.integrate.choice import integrator
from erls.integrate.work_limit import work_limit
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.run.chain.run import ChainRun
from erls.scene.chain import Scene
from erls.scene.settings import Simulation

FEWEST, MOST = 120, 20_000  # steps
PLACES, EFFORTS = 16, 6  # times at which points and drive forces are compared
UNRESOLVED = 0.1  # of the tolerance: what vibrations may add that the steps do not follow
_RADIUS = 0.7
_TIMES = 241
_MORE = 4  # times the evaluations of a run with everything, that one without something may take
_TURN = 0.5  # rad per step: beyond, a look says nothing


@dataclass(frozen=True)
class Difference:
    """What leaving something out changes.

    Attributes
    ----------
    error : float
        Largest distance of named points [m]; infinite where they cannot move without it.
    effort_error : float or None
        Largest difference of drive forces, relative to their peak; None where no drive reacts.
    """

    error: float
    effort_error: float | None


State = tuple[Array, Array]


def fixed_steps(settings: Simulation) -> int | None:
    """Steps of a run with generalized-alpha; None for adaptive methods."""
    if settings.integrator != "generalized_alpha" and settings.formulation != "nodal":
        return None
    step = settings.step or min(settings.duration / 1000, 1e-3)
    return math.ceil(settings.duration / step)


def look_steps(settings: Simulation, found: Resolution) -> int:
    """Steps of a coarse run: what it has to resolve, no more than the run itself."""
    return min(found.count(settings.duration, FEWEST), MOST, fixed_steps(settings) or MOST)


def needed(settings: Simulation, formulation: Formulation) -> tuple[Vibrations, State]:
    """What coarse looks at a scene have to follow, and the state in which it starts.

    Raises
    ------
    SimulationError
        SINGULAR_MASS.
    """
    start = formulation.initial_state()
    return vibrations(quick(solved(formulation)), formulation.mechanism, settings.duration, *start), start


def resolved(settings: Simulation, found: Vibrations) -> Resolution:
    """How finely coarse looks follow that."""
    return resolution(found, UNRESOLVED * settings.effects_tolerance)


def coarse_run(
    scene: Scene, mechanism: Mechanism, count: int, start: State | None = None, whole: ChainRun | None = None
) -> ChainRun:
    """A run in ``count`` steps; failures stand in the run, which ends early where it takes many times the work of the
    ``whole`` one: its steps are halved again and again.
    """
    settings = scene.record.simulation
    coarse = msgspec.structs.replace(
        settings, integrator="generalized_alpha", step=settings.duration / count, spectral_radius=_RADIUS
    )
    formulation = formulate(mechanism, coarse)
    y, v = formulation.initial_state() if start is None else start
    options = Options(coarse.step, coarse.rtol, coarse.atol, _RADIUS, newton_tolerance=1e-9)
    limit = None if whole is None else work_limit(_MORE * whole.solution.work.rhs_calls)
    solution = integrator(mechanism, coarse)(formulation, (0.0, settings.duration), y, v, options, limit)
    if solution.failure is not None and solution.failure.cause == Cause.INTERRUPTED:
        raise solution.failure
    return ChainRun(scene, formulation, solution)


def too_coarse(run: ChainRun, count: int) -> bool:
    """Whether joints turn so fast that the steps say nothing."""
    s = run.solution
    free = np.diag(quick(solved(run.formulation)).stiffness_and_damping(float(s.t[0]), s.y[0], s.v[0])[0]) == 0
    return bool(np.abs(s.v[:, free]).max(initial=0.0) * (s.t[-1] - s.t[0]) / count > _TURN)


def difference(whole: ChainRun, less: ChainRun) -> Difference:
    """Between two coarse runs, at the times when they are farthest apart; the second one may lack coordinates."""
    if less.solution.failure is not None or less.end < whole.end:
        return Difference(np.inf, None)
    system = solved(whole.formulation)
    kept = kept_places(whole.formulation.mechanism, less.formulation.mechanism, system.size)
    times = np.linspace(float(whole.solution.t[0]), whole.end, _TIMES)
    here, there = (hermite(s.t, s.y, s.v, s.a, times) for s in (whole.solution, less.solution))
    apart = np.abs(here[0] - embedded(there[0], kept, system.size))
    places = busiest((metre_scales(system) * apart).sum(axis=1), PLACES)  # type: ignore[arg-type]
    sides = []
    for run, (y, v) in ((whole, here), (less, there)):
        formulation = run.formulation
        outputs = Outputs(run.scene, formulation, watched_nodes(formulation.mechanism))
        positions = [outputs.positions(formulation.state(float(times[k]), y[k], v[k])) for k in places]
        some = places[:: max(1, len(places) // EFFORTS)] if outputs.driven else []
        sides.append((positions, [outputs.efforts(float(times[k]), y[k], v[k]) for k in some]))
    (ours, our_efforts), (others, other_efforts) = sides
    return Difference(largest_distance(ours, others), effort_error(our_efforts, other_efforts))


def deformation(run: ChainRun, link: str = "") -> float:
    """Largest distance that the deformation of a link, or of all, moves a named point by [m]; none of its modes left
    out comes cheaper, except by chance.
    """
    system, mechanism = solved(run.formulation), run.formulation.mechanism
    places = np.arange(system.size - sum(k.elastic_modes for k in mechanism.links), system.size)
    at = np.repeat([k.name for k in mechanism.links], [k.elastic_modes for k in mechanism.links])
    if link:
        places = places[at == link]
    s = run.solution
    outputs = Outputs(run.scene, run.formulation, watched_nodes(mechanism))
    metres = metre_scales(system)  # type: ignore[arg-type]
    size = np.abs(metres * s.y)[:, places].sum(axis=1)
    sides: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    for k in busiest(size, 4):
        still = s.y[k].copy()
        still[places] = 0.0
        for side, y in zip(sides, (s.y[k], still), strict=True):
            side.append(outputs.positions(run.formulation.state(float(s.t[k]), y, s.v[k])))
    return largest_distance(*sides)

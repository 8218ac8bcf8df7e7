"""The error of generalized-α over a whole run, of systems with conditions and without, from a run with larger steps.

Motions of bodies, nodal chains and absolute coordinates choose their steps by such companions and keep the last one.
Runs of fixed steps, and those read from files, get one here, with `LARGER` times their steps: about a quarter of their
work; where Newton's method does not bear that, one with half as large ones, at twice their work.
`erls.integrate.step_distance` says how the distance of both becomes an error. That takes errors to be in proportion,
which those of a sudden start are not where it sets off what larger steps do not resolve (joints that follow their
motors within a step): the first steps of a run are held against a quarter of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np

from erls.accuracy.force_errors import force_differences
from erls.accuracy.judged_places import judged_nodes, judged_places
from erls.auto.outputs import watched_nodes
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.equations import Nodal
from erls.equations.substructures import solved
from erls.errors import Cause
from erls.integrate.base import Companion, Solution, hermite
from erls.integrate.choice import body_options, integrator, options_of
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.integrate.step_distance import STATED, Track, distance_bands, errors_over_time, samples, step_ratio
from erls.integrate.work_limit import work_limit
from erls.maths.so3 import Array
from erls.run.bodies.motion import BodyMotion
from erls.run.chain.run import ChainRun
from erls.scene.bodies.analyses import Dynamics
from erls.scene.integrators import FIXED_STEP
from fe_import.model import IntArray

LARGER = 4.0
"""Steps of a companion, of those of the run."""

SMALLER = 0.5
"""The same where larger steps cannot be made."""

_HALVED = 0.02  # of the steps of a companion, at most, that Newton's method may refuse
_FORCES = 8  # instants at which they are compared
_FIRST, _FINER = 10, 0.25  # steps of a run that are made anew; the length of theirs, of its own
_TOO_LIKE = 1.4  # ratio of steps below which a distance says nothing


@dataclass(frozen=True)
class ConstrainedError:
    """Error of the integration at points.

    Attributes
    ----------
    points : tuple of str
    times : (k,) array
        [s]
    errors : (k, points) array
        Largest of each point up to each time [m].
    evaluations : int
        Of residuals, that finding it took; 0 where the run had its companion.
    effort, reaction : (joints,) arrays or None
        Of a chain, relative to their peaks: the whole distance of the companion, to the safe side. NaN where they
        cannot be evaluated; None of nodal chains and of bodies.
    """

    points: tuple[str, ...]
    times: Array
    errors: Array
    evaluations: int
    effort: Array | None = None
    reaction: Array | None = None

    @property
    def error(self) -> Array:
        """(k,) of any point up to each time [m]."""
        return np.asarray(self.errors.max(axis=1, initial=0.0))

    @property
    def total(self) -> float:
        """Over the run [m]."""
        return float(self.error[-1])

    def horizon(self, tolerance: float) -> float:
        """Last time up to which all points stay within a tolerance [s]."""
        beyond = np.flatnonzero(self.error > tolerance)
        return float(self.times[max(int(beyond[0]) - 1, 0)] if len(beyond) else self.times[-1])


def constrained_integration_error(run: ChainRun | BodyMotion) -> ConstrainedError | str:
    """Estimate it, or say in words why it is not known.

    Parameters
    ----------
    run : ChainRun or BodyMotion
        Of generalized-α, in any coordinates.

    Raises
    ------
    SimulationError
        INTERRUPTED.
    """
    s = run.solution
    if len(s.t) < 2 or not s.work.steps:
        return "the run has no steps"
    companion, evaluations = s.companion, 0
    if companion is None and s.work.rejected_steps <= _HALVED * s.work.steps:  # else larger ones are refused, too
        companion, evaluations = _companion(run, LARGER)
    ratio = 0.0 if companion is None else _ratio(s, companion)
    if ratio < _TOO_LIKE:
        companion, more = _companion(run, SMALLER)
        evaluations += more
    if companion is None:
        return "Newton's method converges neither at larger nor at smaller steps"
    looks = samples(s.t)
    t, radius = s.t[looks], run.scene.record.simulation.spectral_radius  # type: ignore[union-attr]  # a motion's
    forces: tuple[Array | None, Array | None] = None, None
    names, places, other = _places(run, looks, companion)
    if isinstance(run, ChainRun):
        forces = _forces(run, companion, STATED if ratio < _TOO_LIKE else 1.0)
    touches = run.formulation.mechanism.touches if isinstance(run, ChainRun) else bool(run.scene.record.contacts)
    if ratio < _TOO_LIKE or touches:
        apart = np.maximum.accumulate(np.linalg.norm(places - other, axis=2), axis=0)
        # impacts turn within a step, by chance early or late: the distance is the error, which `sudden` multiplies
        share = 1.0 if touches and ratio >= _TOO_LIKE else STATED / (1 - SMALLER**2)
        return ConstrainedError(names, t, share * apart, evaluations, *forces)
    bands = distance_bands(t, places, other, s.work.steps, ratio, radius)
    errors = STATED * errors_over_time(bands, beyond=companion.beyond)
    if s.companion is None:
        begun, more = _of_first_steps(run)
        errors, evaluations = np.maximum(errors, np.outer(bands.t > s.t[0], STATED * begun)), evaluations + more
    return ConstrainedError(names, bands.t, errors, evaluations, *forces)


def _ratio(s: Solution, companion: Companion) -> float:
    """Of steps; their numbers tell it where not all of the run are kept."""
    if np.count_nonzero(np.diff(s.t)) >= s.work.steps:
        return step_ratio(s.t, companion.t)
    return s.work.steps / max(int(np.count_nonzero(np.diff(companion.t))), 1)


def _companion(run: ChainRun | BodyMotion, larger: float) -> tuple[Companion | None, int]:
    """The same with steps so many times as large, None where it fails; and its evaluations."""
    most = _HALVED * run.solution.work.steps / larger if larger > 1 else np.inf  # else no proportion of steps any more
    made = _with_steps(run, larger, most)
    if made.failure is not None and made.failure.cause == Cause.INTERRUPTED:
        raise made.failure
    if made.t[-1] < run.solution.t[-1] or made.work.rejected_steps > most:
        return None, made.work.rhs_calls
    return Companion(made.t, made.y, made.v, made.a), made.work.rhs_calls


def _of_first_steps(run: ChainRun | BodyMotion) -> tuple[Array, int]:
    """(points,) what the first steps are off [m], by smaller ones, and their evaluations; zero where these fail."""
    s = run.solution
    end = float(s.t[0]) + _FIRST * (float(s.t[-1]) - float(s.t[0])) / s.work.steps
    looks = np.flatnonzero(s.t <= min(end * (1 + 1e-9), s.t[-1]))
    made = _with_steps(run, _FINER, np.inf, end)
    if made.failure is not None and made.failure.cause == Cause.INTERRUPTED:
        raise made.failure
    if len(made.t) < 2:
        return np.zeros(1), made.work.rhs_calls
    other = Companion(made.t, made.y, made.v, made.a)
    _, own, finer = _places(run, looks, other)
    apart = np.linalg.norm(own - finer, axis=2)[s.t[looks] <= made.t[-1]]
    return np.asarray(apart.max(axis=0, initial=0.0) / (1 - _FINER**2)), made.work.rhs_calls


def _with_steps(run: ChainRun | BodyMotion, larger: float, most: float, end: float | None = None) -> Solution:
    """The same with steps so many times as large, up to a time or where the run ended, or more than so many are
    refused.
    """
    s = run.solution
    limit = work_limit(refused=most)
    step = larger * (float(s.t[-1]) - float(s.t[0])) / s.work.steps
    times = float(s.t[0]), float(s.t[-1]) if end is None else min(end, float(s.t[-1]))
    if isinstance(run, BodyMotion):
        system, analysis = run.assembly.system, run.scene.record.simulation
        assert isinstance(analysis, Dynamics)
        own = body_options(msgspec.structs.replace(analysis, step=step))
        return lie_generalized_alpha(system, times, system.start, run.assembly.velocity, own, limit)
    settings = msgspec.structs.replace(run.scene.record.simulation, integrator=FIXED_STEP, step=step, output_step=None)
    integrate = integrator(run.formulation.mechanism, settings)
    return integrate(run.formulation, times, *run.formulation.initial_state(), options_of(settings), limit)


def _places(
    run: ChainRun | BodyMotion, looks: IntArray, companion: Companion
) -> tuple[tuple[str, ...], Array, Array]:
    """Names of the points, and their places (k, p, 3) in both runs."""
    return _of_bodies(run, looks, companion) if isinstance(run, BodyMotion) else _of_chain(run, looks, companion)


def _of_bodies(run: BodyMotion, looks: IntArray, companion: Companion) -> tuple[tuple[str, ...], Array, Array]:
    """Names of the points, and their places (k, p, 3) in both runs."""
    numbers = run.assembly.numbers
    names = run.point_names or tuple(numbers)
    nodes = [numbers[name] for name in names]
    return names, *_of_nodes(run.assembly.system, run.solution, looks, companion, nodes)


def _of_nodes(
    system: NodalSystem, s: Solution, looks: IntArray, companion: Companion, nodes: list[int]
) -> tuple[Array, Array]:
    places = system.places
    other = Track(companion.t, *(places(part)[:, nodes] for part in (companion.y, companion.v, companion.a)))
    return places(s.y[looks])[:, nodes], other.at(s.t[looks])


def _of_chain(run: ChainRun, looks: IntArray, companion: Companion) -> tuple[tuple[str, ...], Array, Array]:
    """The same; points of nodal chains are taken to be their nearest nodes."""
    formulation, s, watched = solved(run.formulation), run.solution, judged_nodes(run)
    links = run.formulation.mechanism.links
    names = run.point_names or tuple(f"{links[k].name}, node {n}" for k, n in watched_nodes(run.formulation.mechanism))

    def positions(t: Array, y: Array, v: Array) -> Array:
        return judged_places(formulation, watched, t, y, v)

    t = s.t[looks]
    if isinstance(formulation, Nodal):
        nodes = [formulation.place_of(link, node) for link, node in watched]
        return names, *_of_nodes(formulation.system, s, looks, companion, nodes)
    at = hermite(companion.t, companion.y, companion.v, companion.a, np.clip(t, companion.t[0], companion.t[-1]))
    return names, positions(t, s.y[looks], s.v[looks]), positions(t, *at)


def _forces(run: ChainRun, companion: Companion, times: float) -> tuple[Array | None, Array | None]:
    """So many times the distances of efforts and reactions of both runs."""
    if isinstance(run.formulation, Nodal):
        return None, None
    s = run.solution
    t = s.t[np.unique(np.linspace(0, len(s.t) - 1, _FORCES).astype(int))]
    at = np.clip(t, companion.t[0], companion.t[-1])
    own = hermite(s.t, s.y, s.v, s.a, t)
    known = force_differences(
        run.formulation, t, own, hermite(companion.t, companion.y, companion.v, companion.a, at)
    )
    if known is None:
        nothing = np.full(len(run.joint_names), np.nan)
        return nothing, nothing
    return known.relative(times * known.apart.max(axis=1, initial=0.0))

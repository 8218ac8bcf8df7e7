"""The error of the integration of a chain's run: over the whole run, at points, and of efforts and reactions.

What the error equation follows (`erls.integrate.global_error`) and what vibrations too fast for it lose
(`erls.accuracy.vibrations`) are turned into distances of the judged points and differences of forces, and multiplied by
`SAFETY`, since an estimate should err to the safe side.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from erls.accuracy.error_over_time import ErrorOverTime
from erls.accuracy.force_errors import force_differences
from erls.accuracy.judged_places import judged_places
from erls.accuracy.vibrations import FastModes, fast_modes, wrong_table
from erls.auto.outputs import Watched
from erls.equations.substructures import solved
from erls.integrate.choice import options_of
from erls.integrate.global_error import (
    ENDS,
    ENDS_STIFF,
    MERGED_RIGID,
    MERGED_SMOOTH,
    GlobalError,
    global_error,
)
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun

SAFETY = 1.5
SUDDEN = 3.0
"""Times as large an error where forces change all at once, at an instant that small vibrations decide."""

ITERATED = 0.03
"""Of what the integration aims at: what Newton's iterations and rounding may leave, which is no smooth error."""

_MANY = 200  # steps from which on positions alone tell a motion better than with rates, which vibrations spoil
_EXPECTED = 5.0  # times what the integration aimed at
_PLACES, _FORCES = 40, 8  # instants at which points, and forces, are compared
_ROUNDING = 1e-16
_MODES_OF_FORCES = 2  # fast modes, of each instant


@dataclass(frozen=True)
class IntegrationError(ErrorOverTime):
    """What the error equation says.

    Attributes
    ----------
    evaluations : int
        Of residuals.
    whole : bool
        Whether it could be followed to the end of the run.
    """

    evaluations: int
    whole: bool


def integration_error(run: ChainRun, watched: Watched) -> IntegrationError:
    """Estimate it, of a run without loops by `erls.integrate.lobatto` of which all steps were kept.

    Parameters
    ----------
    run : ChainRun
    watched : tuple of (int, int)
        Link and node of each judged point.

    Raises
    ------
    SimulationError
        The equations cannot be evaluated beside the motion.
    """
    system, s = solved(run.formulation), run.solution
    rigid = not any(link.elastic_modes for link in run.formulation.mechanism.links)
    found = global_error(
        system,  # type: ignore[arg-type]
        s,
        options_of(run.scene.record.simulation).tolerance,
        run.formulation.mechanism.reach,
        _ROUNDING,
        solved(run.formulation).mechanism.rotation_vector_places,
        ENDS if rigid or s.work.steps < _MANY else ENDS_STIFF,
        MERGED_RIGID if rigid else MERGED_SMOOTH,
    )
    return _estimate(run, watched, system, found)


def expected(run: ChainRun) -> float:
    """Error of the integration up to which an estimate needs no other beside it [m]."""
    return _EXPECTED * options_of(run.scene.record.simulation).tolerance


def _estimate(run: ChainRun, watched: Watched, system: Any, found: GlobalError) -> IntegrationError:
    """Of points and forces, from the error of coordinates."""
    settings = run.scene.record.simulation
    looks = _spread(found, _PLACES)
    slow = _apart(run, watched, found.t[looks], (found.y[looks], found.v[looks]), (found.error, found.rate), looks)
    table = wrong_table(run.solution, settings.integrator)
    tau = float(np.median(found.filter)) if len(found.filter) else 0.0
    fast = [] if table is None else fast_modes(system, run.solution, table, tau)
    vibrating = _of_vibrations(run, watched, fast)
    along = (found.t[looks] - found.t[0]) / max(float(run.end - found.t[0]), 1e-300)
    safety = SAFETY * (SUDDEN if sudden(run) else 1.0)
    aim = options_of(settings).tolerance
    error = safety * (np.maximum.accumulate(slow) + along * vibrating) + ITERATED * aim
    effort, reaction = _forces(run, found, fast)
    return IntegrationError(
        found.t[looks], error, safety * effort, safety * reaction, found.evaluations, found.whole
    )


def sudden(run: ChainRun) -> bool:
    """Whether friction, motors at their limits, contacts or stops act."""
    mechanism = run.formulation.mechanism
    joints = mechanism.joints
    return mechanism.touches or any(joint.forces.friction or np.isfinite(joint.drive.torque_limit) for joint in joints)


def _spread(found: GlobalError, count: int) -> Array:
    """Numbers of instants: the largest error in each of some stretches, and the last one."""
    sizes = np.abs(found.error).max(axis=1, initial=0.0)
    parts = np.array_split(np.arange(len(sizes)), min(count, len(sizes)))
    return np.unique([*(int(part[np.argmax(sizes[part])]) for part in parts), len(sizes) - 1])


def _apart(
    run: ChainRun, watched: Watched, t: Array, at: tuple[Array, Array], error: tuple[Array, Array], looks: Array
) -> Array:
    """(k,) largest distance of a point with the error from one without [m]."""
    times = np.concatenate([t, t])
    y = np.concatenate([at[0], at[0] + error[0][looks]])
    v = np.concatenate([at[1], at[1] + error[1][looks]])
    here, there = np.split(judged_places(solved(run.formulation), watched, times, y, v), 2)
    return np.asarray(np.linalg.norm(there - here, axis=-1).max(axis=1))


def _of_vibrations(run: ChainRun, watched: Watched, fast: list[FastModes]) -> float:
    """What fast vibrations are wrong by at any point [m]."""
    if not fast:
        return 0.0
    s = run.solution
    knots = np.concatenate([np.full(len(f.shapes), f.knot) for f in fast])
    shapes = np.concatenate([f.shapes for f in fast])
    t, v = s.t[knots], s.v[knots]
    y, v = np.concatenate([s.y[knots], s.y[knots] + shapes]), np.concatenate([v, v])
    here, there = np.split(judged_places(solved(run.formulation), watched, np.concatenate([t, t]), y, v), 2)
    moved = np.linalg.norm(there - here, axis=-1)
    ends = np.cumsum([0, *(len(f.shapes) for f in fast)])
    sums = [np.sqrt((moved[a:b] ** 2).sum(axis=0)).max() for a, b in itertools.pairwise(ends.tolist())]
    return float(max(sums))


def _forces(run: ChainRun, found: GlobalError, fast: list[FastModes]) -> tuple[Array, Array]:
    """Errors of efforts and reactions of all joints relative to their peaks; NaN where they cannot be evaluated."""
    s, looks = run.solution, _spread(found, _FORCES)
    few = [(f.knot, shape) for f in fast for shape in f.shapes[:_MODES_OF_FORCES]]
    knots = np.array([knot for knot, _ in few], dtype=np.int64)
    shapes = np.array([shape for _, shape in few]).reshape(-1, s.y.shape[1])
    t = np.concatenate([found.t[looks], s.t[knots]])
    y, v = np.concatenate([found.y[looks], s.y[knots]]), np.concatenate([found.v[looks], s.v[knots]])
    off = np.concatenate([found.error[looks], shapes]), np.concatenate([found.rate[looks], 0 * shapes])
    known = force_differences(run.formulation, t, (y, v), (y + off[0], v + off[1]))
    if known is None:
        return (np.full(len(run.joint_names), np.nan),) * 2
    slow, quick = known.apart[:, : len(looks)], known.apart[:, len(looks) :]
    vibrating = np.sqrt((quick**2).sum(axis=1) / max(len(fast), 1))
    return known.relative(slow.max(axis=1, initial=0.0) + vibrating)

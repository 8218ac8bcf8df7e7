"""What a run states about its error: parts, total, horizon, verdict, and the reasons with what to change."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from erls.accuracy.audits import audits
from erls.accuracy.constrained_integration import constrained_integration_error
from erls.accuracy.integration import SUDDEN, IntegrationError, expected, integration_error, sudden
from erls.accuracy.left_out_effects import effects_error
from erls.accuracy.links import links_error
from erls.accuracy.modes import modes_error
from erls.accuracy.second_run import second_run_error
from erls.accuracy.vibrations import wrong_table
from erls.auto.outputs import Watched, watched_nodes
from erls.equations.registry import system_of
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from erls.run.accuracy import BROKEN, GOOD, LIMITED, PARTS, Accuracy, Trust
from erls.run.chain.run import ChainRun
from erls.run.watches.stored_output import output_error
from erls.scene.integrators import FIXED_STEP

CONSTRAINED = ("nodal", "absolute")
"""Kinds of systems whose integration is generalized-α with conditions."""

_FARTHEST = 4.0  # times the reach: two points at opposite ends of it, on links that deflect as far again
_CHAOTIC = 3.0  # e-folds of the error over the second half of a run: more than drift makes


class Judged(NamedTuple):
    """A part: metres, or None, and what is to be said of it."""

    error: float | None
    note: str = ""


class Integrated(NamedTuple):
    """What is known of the integration of a run.

    Attributes
    ----------
    times, error : (k,) arrays
        Largest error of a point up to each time [s], [m].
    efforts, reactions : mapping of str to float or None
        By joint, relative to their peaks.
    note : str
        Why nothing is known, or up to when it is.
    """

    times: Array
    error: Array
    efforts: Mapping[str, float | None]
    reactions: Mapping[str, float | None]
    note: str = ""


def stated(run: ChainRun, tolerance: float | None = None) -> ChainRun:
    """The run with ``accuracy`` and ``trust``.

    Parameters
    ----------
    run : ChainRun
    tolerance : float, optional
        What the total is judged by [m], that of the scene unless given.

    Raises
    ------
    SimulationError
        INTERRUPTED.
    """
    watched = watched_nodes(run.formulation.mechanism)
    tolerance, reach = tolerance or run.scene.record.simulation.tolerance, _FARTHEST * run.formulation.mechanism.reach
    integrated = _integrated(run, watched)
    found = {
        "integration": _capped(integrated, reach),
        "modes": _judged(lambda: modes_error(run)),
        "effects": _judged(lambda: effects_error(run)),
        "links": _judged(lambda: links_error(run)),
        "output": _judged(lambda: (output_error(run), "")),
    }
    for name in ("modes", "links"):
        found[name] = found[name]._replace(error=_within(found[name].error, reach))
    others = [found[name].error for name in PARTS if name != "integration"]
    horizon = _horizon(integrated, tolerance, sum(part or 0.0 for part in others))
    accuracy = Accuracy(
        **{name: part.error for name, part in found.items()},
        efforts=integrated.efforts,
        reactions=integrated.reactions,
        horizon=horizon,
        judged_at=_names(run, watched),
        unjudged={name: part.note for name, part in found.items() if part.error is None},
    )
    return replace(run, accuracy=accuracy, trust=_trust(run, accuracy, integrated, tolerance))


def _within(error: float | None, reach: float) -> float | None:
    """No point is farther off than that."""
    return None if error is None else min(error, reach)


def _judged(find: Callable[[], tuple[float | None, str]]) -> Judged:
    """A part; one that cannot be evaluated is not known."""
    try:
        with np.errstate(all="ignore"):
            error, note = find()
    except SimulationError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return Judged(None, f"it cannot be evaluated: {problem}")
    except np.linalg.LinAlgError as problem:
        return Judged(None, f"it cannot be evaluated: {problem}")
    if error is not None and not math.isfinite(error):
        return Judged(None, note or "the estimate is not finite")
    return Judged(error, note)


def _integrated(run: ChainRun, watched: Watched) -> Integrated:
    """By the error equation where it can be followed, by a second run elsewhere."""
    none: dict[str, float | None] = dict.fromkeys(run.joint_names)
    settings, s = run.scene.record.simulation, run.solution
    if not s.y.shape[1] or len(s.t) < 2:  # nothing is integrated
        zero: dict[str, float | None] = dict.fromkeys(run.joint_names, 0.0)
        return Integrated(s.t[[0, -1]], np.zeros(2), zero, zero)
    kind = system_of(run.formulation.mechanism, settings)
    if kind in CONSTRAINED:
        return _of_constrained(run, none)
    if settings.integrator == FIXED_STEP:
        return _of_constrained(run, none)
    found: IntegrationError | None = None
    if settings.output_step is None and wrong_table(s, settings.integrator) is not None:
        found = integration_error(run, watched)
    mechanism = run.formulation.mechanism
    smooth = not mechanism.loops and not any(link.elastic_modes for link in mechanism.links)
    if found is not None and found.whole and (smooth or found.total <= expected(run)):
        return _followed(run, found)
    second = second_run_error(run, watched)
    if found is None or not found.whole:
        if second is None:
            return Integrated(np.zeros(0), np.zeros(0), none, none, "a second run at a larger tolerance fails")
        return Integrated(*second, none, none)
    followed = _followed(run, found)  # errs to the large side where steps are coarse or leave vibrations unresolved
    if second is None or not second[1][-1] < found.total:
        return followed
    return followed._replace(times=second[0], error=second[1])


def _of_constrained(run: ChainRun, none: dict[str, float | None]) -> Integrated:
    """Of generalized-α, from a run with larger steps."""
    known = constrained_integration_error(run)
    if isinstance(known, str):
        return Integrated(np.zeros(0), np.zeros(0), none, none, known)
    return Integrated(known.times, (SUDDEN if sudden(run) else 1.0) * known.error, none, none)


def _followed(run: ChainRun, found: IntegrationError) -> Integrated:
    """By the error equation."""
    efforts, reactions = (_named(run, values) for values in (found.effort, found.reaction))
    return Integrated(found.times, found.error, efforts, reactions)


def _named(run: ChainRun, values: Array) -> dict[str, float | None]:
    pairs = zip(run.joint_names, values.tolist(), strict=True)
    return {name: value if math.isfinite(value) else None for name, value in pairs}


def _capped(found: Integrated, reach: float) -> Judged:
    """No point is farther off than the mechanism reaches."""
    if not len(found.error):
        return Judged(None, found.note)
    total = float(found.error[-1])
    return Judged(min(total, reach) if math.isfinite(total) else reach, found.note)


def _horizon(found: Integrated, tolerance: float, others: float) -> float | None:
    """Last time up to which all parts together stay within the tolerance, where the integration passes it."""
    beyond = np.flatnonzero(~(found.error + others <= tolerance))
    if not len(beyond) or others > tolerance:
        return None
    return float(found.times[max(int(beyond[0]) - 1, 0)])


def _names(run: ChainRun, watched: Watched) -> tuple[str, ...]:
    """Named points; without any the ends of links."""
    if run.point_names:
        return run.point_names
    links = run.formulation.mechanism.links
    return tuple(f"{links[link].name}: {node}" for link, node in watched)


_REMEDIES = {
    "integration": "a smaller simulation.tolerance, or a smaller step",
    "modes": "more elastic_modes in the links' reductions, or finer meshes",
    "effects": "effects = 'all'",
    "links": "substructures (formulation ffr), or formulation nodal",
    "output": "a smaller simulation.output_step",
}


def _trust(run: ChainRun, accuracy: Accuracy, integrated: Integrated, tolerance: float) -> Trust:
    """The verdict, with the reasons why it is no better."""
    breaches = [audit.text for audit in audits(run, accuracy.integration) if not audit.ok]
    if breaches:
        return Trust(BROKEN, tuple(f"audit: {text}" for text in breaches))
    if accuracy.total is None:
        return Trust(BROKEN, tuple(f"the part {name} is not known: {why}" for name, why in accuracy.unjudged.items()))
    if accuracy.total <= tolerance:
        return Trust(GOOD)
    reasons = [_too_large(accuracy, accuracy.total, tolerance)]
    growth = _growth(integrated)
    if accuracy.horizon is not None:
        faster = f"; disturbances grow by a factor of e in {1 / growth:.2g} s" if growth else ""
        reasons.append(f"up to t = {accuracy.horizon:.4g} s the error stays within the tolerance{faster}")
    return Trust(LIMITED, tuple(reasons))


def _too_large(accuracy: Accuracy, total: float, tolerance: float) -> str:
    largest = max(PARTS, key=lambda name: getattr(accuracy, name) or 0.0)
    return (
        f"the stated error is {total:.2g} m, the tolerance {tolerance:.2g} m; the largest part is {largest}, "
        f"{getattr(accuracy, largest):.2g} m: use {_REMEDIES[largest]}"
    )


def _growth(found: Integrated) -> float:
    """Rate at which errors grow exponentially over the second half of a run [1/s]; 0 where they only add up.

    The largest finite-time Lyapunov exponent, as the error itself shows it, which is followed with nothing linearized.
    """
    half = len(found.times) // 2
    if half < 4:
        return 0.0
    t, error = found.times[half:], np.maximum(found.error[half:], 1e-300)
    folds = float(np.log(error[-1] / error[0]))
    return folds / float(t[-1] - t[0]) if folds > _CHAOTIC and t[-1] > t[0] else 0.0

"""What a run states about its error: parts, total, horizon, verdict, and the reasons with what to change."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from erls.accuracy.audits import audits
from erls.accuracy.integration import ITERATED, SUDDEN, sudden
from erls.accuracy.judged import Judged
from erls.accuracy.judged_integration import Integrated, judged_integration
from erls.accuracy.judged_places import judged_nodes
from erls.accuracy.left_out_effects import effects_error
from erls.accuracy.links import links_error
from erls.accuracy.modes import modes_error
from erls.accuracy.verdict import verdict
from erls.auto.outputs import watched_nodes
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.errors import Cause, SimulationError
from erls.integrate.choice import options_of
from erls.run.accuracy import PARTS, Accuracy
from erls.run.chain.run import ChainRun
from erls.run.watches.stored_output import output_error

_FARTHEST = 4.0  # times the reach: two points at opposite ends of it, on links that deflect as far again


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
    tolerance, reach = tolerance or run.scene.record.simulation.tolerance, _FARTHEST * run.formulation.mechanism.reach
    found = {
        "modes": _judged(lambda: modes_error(run)),
        "effects": _judged(lambda: effects_error(run)),
        "links": _judged(lambda: links_error(run)),
        "output": _judged(lambda: (output_error(run), "")),
    }
    integrated = judged_integration(run, judged_nodes(run), _sum(found))
    integration = _capped(integrated, reach)
    found["modes"] = _within(found["modes"].grown(integrated.amplified(), integration.error), reach)
    found["links"] = _within(found["links"].grown(SUDDEN if sudden(run) else 1.0, None), reach)
    others = _sum(found)
    found["integration"] = integration
    accuracy = Accuracy(
        **{name: found[name].error for name in PARTS},
        efforts=integrated.efforts,
        reactions=integrated.reactions,
        horizon=integrated.horizon(tolerance, others),
        judged_at=_names(run),
        unjudged={name: found[name].note for name in PARTS if found[name].error is None},
    )
    iterated = ITERATED * options_of(run.scene.record.simulation).tolerance  # what no audit need find
    granted = None if accuracy.integration is None else max(accuracy.integration, iterated)
    static = isinstance(run.formulation, QuasiStatic)
    if granted is not None and static:  # it keeps the energy but for what it leaves out
        granted += accuracy.effects or 0.0
    breaches = [audit.text for audit in audits(run, granted) if not audit.ok]
    remedies = _REMEDIES | ({"effects": _OF_STATIC_MODES} if static else {})
    trust = verdict(accuracy, breaches, tolerance, remedies, integrated.growth())
    return replace(run, accuracy=accuracy, trust=trust)


def _sum(found: Mapping[str, Judged]) -> float:
    """Of the parts that are known [m]."""
    return math.fsum(part.error or 0.0 for part in found.values())


def _within(part: Judged, reach: float) -> Judged:
    """No point is farther off than the mechanism reaches."""
    return part if part.error is None else part._replace(error=min(part.error, reach))


def _judged(find: Callable[[], tuple[float | None, str] | Judged]) -> Judged:
    """A part; one that cannot be evaluated is not known."""
    try:
        with np.errstate(all="ignore"):
            found = Judged(*find())
    except SimulationError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return Judged(None, f"it cannot be evaluated: {problem}")
    except np.linalg.LinAlgError as problem:
        return Judged(None, f"it cannot be evaluated: {problem}")
    if found.error is not None and not math.isfinite(found.error):
        return Judged(None, found.note or "the estimate is not finite")
    return found


def _capped(found: Integrated, reach: float) -> Judged:
    """No point is farther off than the mechanism reaches."""
    if not len(found.error):
        return Judged(None, found.note)
    total = float(found.error[-1])
    return Judged(min(total, reach) if math.isfinite(total) else reach, found.note)


def _names(run: ChainRun) -> tuple[str, ...]:
    """Named points; without any the ends of links."""
    if run.point_names:
        return run.point_names
    links = run.formulation.mechanism.links
    return tuple(f"{links[link].name}: {node}" for link, node in watched_nodes(run.formulation.mechanism))


_OF_STATIC_MODES = "effects = 'all', and a larger simulation.bandwidth, or none"
_REMEDIES = {
    "integration": "a smaller simulation.tolerance, or a smaller step",
    "modes": "more elastic_modes in the links' reductions, or finer meshes",
    "effects": "effects = 'all'",
    "links": "effects = 'all', substructures (formulation ffr), or formulation nodal",
    "output": "a smaller simulation.output_step",
}

"""What links that bend are estimated to be off in a run."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from erls.equations.registry import TREES
from erls.equations.substructures import Substructured, solved
from erls.errors import SimulationError
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link
from erls.run.chain.places import watched_nodes
from erls.run.chain.run import ChainRun
from erls.run.deflection.estimate import DeflectionError, LeftOut, LinkSeries, link_series, together
from erls.run.deflection.motion import bending


@dataclass(frozen=True)
class LinkErrors:
    """Estimated errors of the links of a run.

    Attributes
    ----------
    total : float or None
        Of all links together, the largest of any watched node at any time [m]; None where ``why`` says why it is not
        known.
    links : dict of DeflectionError
        By name of flexible link, pieces of a split link together.
    why : str
    """

    total: float | None
    links: dict[str, DeflectionError] = field(default_factory=dict)
    why: str = ""


def link_errors(run: ChainRun) -> LinkErrors:
    """What the model of its links leaves out of a run: see `erls.run.deflection.estimate`.

    Judged at named points; without any, where joints stand on links, and at the farthest nodes of those without. Links
    of nodal elements leave out nothing but what their mesh does.

    Parameters
    ----------
    run : ChainRun
    """
    mechanism = solved(run.formulation).mechanism
    if run.scene.record.simulation.formulation not in TREES:
        return LinkErrors(0.0)
    if not any(link.elastic_modes for link in mechanism.links):
        return LinkErrors(0.0)
    if not run.end > float(run.solution.t[0]):
        return LinkErrors(None, why="the run has no duration")
    with np.errstate(all="ignore"):  # a run that failed may hold anything
        try:
            seen = bending(run, watched_nodes(mechanism))
            every = {k: link_series(seen, k, _left_out(run, mechanism.links[k])) for k in seen.links}
        except (SimulationError, np.linalg.LinAlgError) as problem:
            return LinkErrors(None, why=f"loads on links cannot be found: {problem}")
        found = {k: series for k, series in every.items() if series is not None}
        links = _by_name(run, mechanism, found)
        if len(found) < len(every):
            return LinkErrors(None, links, "links are deflected beyond any meaning")
        total = together(seen, found)
    return LinkErrors(total, links)


def _left_out(run: ChainRun, link: Link) -> LeftOut:
    """Orders that are missing with the effects of a run."""
    mechanism, settings = solved(run.formulation).mechanism, run.scene.record.simulation
    known = link.second_order is not None
    stiffened = known and "geometric_stiffening" in mechanism.effects
    anchored = stiffened and settings.gauge != "minimum-norm"
    return LeftOut(
        loads=not stiffened,
        places=not (known and "foreshortening" in mechanism.effects),
        turns=settings.formulation == "erls" and not anchored,
    )


def _by_name(run: ChainRun, mechanism: Mechanism, found: dict[int, LinkSeries]) -> dict[str, DeflectionError]:
    """Of the pieces of one link errors and shortenings add up, and the rest is the largest."""
    if not isinstance(run.formulation, Substructured):
        return {mechanism.links[k].name: series.told for k, series in found.items()}
    result = {}
    for link, own in zip(run.formulation.mechanism.links, run.formulation.parts.links, strict=True):
        some = [found[k].told for k in own if k in found]
        if some:
            result[link.name] = DeflectionError(
                sum(e.error for e in some),
                max(e.deflection for e in some),
                max(e.slope for e in some),
                sum(e.shortening for e in some),
                max(e.load for e in some),
                max(e.drift for e in some),
                any(e.second for e in some),
                any(e.assumed for e in some),
            )
    return result

"""What a run says of its own range: how far off its links are, bending further than their model holds."""

from __future__ import annotations

from collections.abc import Mapping

from erls.run.chain.run import ChainRun
from erls.run.deflection.errors import link_errors
from erls.run.deflection.estimate import DeflectionError
from erls.run.watches.base import NOTHING, Ended, Finding, Plan, Watch

NOTABLE = 2e-3  # of the size of a link: errors above this make a run warn


class DeflectionRange(Watch):
    """Looks at the deflection of links."""

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Where somebody asks: it takes a sixth of a short run."""
        return plan.bending

    def after(self, ended: Ended) -> Finding:
        """Errors of all links together, with a warning of those that matter."""
        if ended.meaningless:
            return NOTHING
        errors = link_errors(ended.run)
        return Finding(deflection_warnings(ended.run, errors.links), error=errors.total)


def deflection_errors(run: ChainRun) -> dict[str, DeflectionError]:
    """Estimated error of every flexible link: see `erls.run.deflection.estimate`.

    Parameters
    ----------
    run : ChainRun

    Returns
    -------
    dict of DeflectionError
        By name of link, pieces of a split link together. Empty in the nodal formulation.
    """
    return link_errors(run).links


def deflection_warnings(run: ChainRun, errors: Mapping[str, DeflectionError] | None = None) -> list[str]:
    """Links whose estimated error is more than 0.2 % of their size, with the reason and what to do."""
    result = []
    links = {link.name: link for link in run.formulation.mechanism.links}
    for name, found in (deflection_errors(run) if errors is None else errors).items():
        size = links[name].size
        if found.error <= NOTABLE * size:
            continue
        more = "more substructures" if links[name].pieces else "substructures = 4 or more (formulation ffr)"
        if found.second:
            why = "it is linear in its own frame"
            remedy = f"use {more}, the effects geometric_stiffening and foreshortening, or formulation nodal"
        else:
            why = "its displacements are of second order in its own frame"
            remedy = f"use {more}, or formulation nodal"
        if links[name].second_order is None:
            known = links[name].model.provenance.get("second_order", "not in its modal file")
            remedy = f"no effect mends it, since its second-order displacements are {known}"
        if found.assumed:
            remedy += "; this takes it to bend as a beam between its interfaces"
        result.append(
            f"link {name!r}: expect errors of about {found.error:.2g} m, since {why}: it "
            f"deflects by up to {found.deflection:.2g} m and turns by up to {found.slope:.2g} rad, which changes its "
            f"stiffness by up to {100 * found.load:.2g} %, makes vibrations run out of step by up to "
            f"{found.drift:.2g} rad, and moves points by up to {found.shortening:.2g} m; {remedy}"
        )
    return result

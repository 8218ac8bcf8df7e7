"""The part ``links`` of the stated error: what the model of the links leaves out against exact beams and solids."""

from __future__ import annotations

from erls.run.chain.run import ChainRun
from erls.run.deflection.errors import link_errors

MARGIN = 2.5
"""Of the statement over the estimate, which lies between 0.5 and 5 times the distance from exact beams
(`benchmarks/links_error.py`)."""


def links_error(run: ChainRun) -> tuple[float | None, str]:
    """What orders of displacement beyond those of the links' model change at named points, at most, over a run.

    It is judged from the computed motion alone, whatever second-order data the run uses, and so is 0 only where no link
    bends, or where links are nodal elements, whose mesh is another part of the error.

    Parameters
    ----------
    run : ChainRun

    Returns
    -------
    error : float or None
        [m], at most twice the reach of all links; None where it is not known.
    why : str
        Why not; empty otherwise.
    """
    known, why = run.second_order_error, ""
    if known is None:  # the run did not look itself
        found = link_errors(run)
        known, why = found.total, found.why
    if known is None:
        return None, why
    mechanism = run.formulation.mechanism
    reach = sum(link.size for link in mechanism.links)
    return min(MARGIN * known, 2 * reach), why

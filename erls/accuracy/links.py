"""The part ``links`` of the stated error: what the model of the links leaves out against exact beams and solids."""

from __future__ import annotations

from erls.accuracy.other_run import error_beside, mechanism_with
from erls.equations.registry import TREES
from erls.mechanism.effects import SECOND_KINEMATICS
from erls.mechanism.without_effects import present
from erls.run.chain.run import ChainRun
from erls.run.deflection.errors import link_errors

MARGIN = 2.5
"""Of the statement over the estimate, which lies between 0.5 and 5 times the distance from exact beams
(`benchmarks/links_error.py`)."""


def links_error(run: ChainRun) -> tuple[float | None, str]:
    """What orders of displacement beyond those of the links' model change at named points, at most, over a run.

    It is judged from the computed motion, whatever second-order data the run uses, and so is 0 only where no link
    bends, or where links are nodal elements, whose mesh is another part of the error. Where a scene leaves second-order
    displacements out that its links know, it is no less than the distance from a run with them.

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
    reach = sum(link.size for link in run.formulation.mechanism.links)
    return min(max(MARGIN * known, _left_out(run)), 2 * reach), why


def _left_out(run: ChainRun) -> float:
    """What second-order displacements that a run leaves out would have changed [m]; 0 where it leaves none out, where
    `effects` counts them, and where a run with them fails.
    """
    missing = SECOND_KINEMATICS - run.formulation.mechanism.effects
    if not missing or run.certificate is not None or run.scene.record.simulation.formulation not in TREES:
        return 0.0
    whole = mechanism_with(run, SECOND_KINEMATICS)
    return 0.0 if missing.isdisjoint(present(whole)) else error_beside(run, whole)[0] or 0.0

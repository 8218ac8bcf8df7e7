"""Plain text about a run of any kind."""

from __future__ import annotations

from collections.abc import Sequence

from erls.report.tables import chain_report
from erls.run.chain.run import ChainRun
from erls.run.record import Run


def run_report(run: Run, times: Sequence[float] = ()) -> str:
    """Summary of a run, and joints and points at given times (its end unless given)."""
    if isinstance(run, ChainRun):
        return chain_report(run, times)
    from erls.report.body_tables import body_report  # here: it imports nodal elements, which chains do not need
    from erls.run.bodies.run import BodyRun

    assert isinstance(run, BodyRun)
    return body_report(run, times)

"""Change points of loops: where links in line may go on in two ways."""

from __future__ import annotations

from erls.equations.formulation import Formulation
from erls.equations.substructures import solved
from erls.errors import Cause
from erls.integrate.base import Solution
from erls.run.watches.base import NOTHING, Begun, Finding, Plan, Watch


class ChangePoints(Watch):
    """Looks for the singular positions that a run met."""

    def __init__(self) -> None:
        self._chain: Formulation | None = None

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Mechanisms with loops whose coordinates the conditions tie; nodal elements state loops in others."""
        return bool(plan.mechanism.loops) and plan.modal

    def begins(self, begun: Begun) -> Finding:
        """Nothing; it learns the equations."""
        self._chain = solved(begun.formulation)
        return NOTHING

    def ends(self, solution: Solution) -> Finding:
        """Loops that branch, and the end of a run where rounding decides which way."""
        from erls.run.singular_positions import singular_positions_met  # here: chains without loops need none of it

        failure = solution.failure
        if self._chain is None or (failure and failure.cause in (Cause.INTERRUPTED, Cause.OUT_OF_MEMORY)):
            return NOTHING
        met = singular_positions_met(self._chain, solution)
        return Finding(met.warnings, failure=met.failure, end=met.end)

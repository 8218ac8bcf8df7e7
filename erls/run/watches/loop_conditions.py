"""What the loops of a mechanism say of their conditions, before a run."""

from __future__ import annotations

from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.substructures import solved
from erls.run.watches.base import NOTHING, Begun, Finding, Plan, Watch


class LoopConditions(Watch):
    """Conditions that follow from the others."""

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Modal models; the loops of pieces are tied within their chain."""
        return plan.modal

    def begins(self, begun: Begun) -> Finding:
        """Which ones are left out."""
        chain = solved(begun.formulation)
        return Finding(chain.warnings) if isinstance(chain, ClosedChain) else NOTHING

"""What the loops of a mechanism say of their conditions, before a run."""

from __future__ import annotations

from typing import cast

from erls.equations.formulation import LoopFormulation
from erls.equations.substructures import solved
from erls.run.watches.base import Begun, Finding, Plan, Watch


class LoopConditions(Watch):
    """Conditions that follow from the others."""

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Mechanisms with loops."""
        return bool(plan.mechanism.loops)

    def begins(self, begun: Begun) -> Finding:
        """Which ones are left out; those of pieces are tied within their chain."""
        return Finding(cast(LoopFormulation, solved(begun.formulation)).warnings)

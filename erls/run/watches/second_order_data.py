"""Links without the second-order displacements that a scene asks for, before a run."""

from __future__ import annotations

from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link
from erls.run.watches.base import Finding, Plan, Watch


class SecondOrderData(Watch):
    """Looks at the modal models of links."""

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Links that are linear in their own frames."""
        return plan.modal

    def before(self, plan: Plan) -> Finding:
        """Those that lack it."""
        return Finding(missing_stiffening(plan.mechanism))


def missing_stiffening(mechanism: Mechanism) -> list[str]:
    """Flexible links without the second-order data that the scene asks for."""
    if {"geometric_stiffening", "foreshortening"}.isdisjoint(mechanism.effects):
        return []
    return [
        f"link {link.name!r} has no geometric stiffening and foreshortening: {reason_without(link)}"
        for link in mechanism.links
        if link.elastic_modes and link.second_order is None
    ]


def reason_without(link: Link) -> str:
    """Why a link has no second-order displacements, in words."""
    found = link.model.provenance.get("second_order", "")
    return found or "its modal file was made without them; reduce it again"

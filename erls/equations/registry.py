"""Formulations of the equations of motion, and their registry."""

from __future__ import annotations

from collections.abc import Callable

from erls.equations.erls.chain import Erls
from erls.equations.formulation import Formulation, TreeFormulation
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.substructures import Substructured
from erls.mechanism.chain import Mechanism
from erls.mechanism.substructures import is_split, split
from erls.scene.settings import Simulation


def _ffr(mechanism: Mechanism, settings: Simulation) -> TreeFormulation:
    from erls.equations.ffr.equations import Ffr  # here, like those below: a run imports what it needs

    return Ffr(mechanism, settings.body_frame)


def _nodal(mechanism: Mechanism, settings: Simulation) -> Formulation:
    from erls.equations.nodal.equations import Nodal

    return Nodal(mechanism, settings.elements_per_member)


TREES: dict[str, Callable[[Mechanism, Simulation], TreeFormulation]] = {
    "erls": lambda mechanism, settings: Erls(mechanism, settings.gauge),
    "ffr": _ffr,
}
"""In independent coordinates, on modal models."""

FORMULATIONS: dict[str, Callable[[Mechanism, Simulation], Formulation]] = {
    **TREES,
    "nodal": _nodal,
}


def formulate(mechanism: Mechanism, settings: Simulation) -> Formulation:
    """Equations of motion of a mechanism; of its chain, tied by its loops; of the pieces of links that are split; with
    modes above a bandwidth that follow statically.
    """
    if settings.formulation in TREES and is_split(mechanism):
        parts = split(mechanism)
        return Substructured(formulate(parts.pieces, settings), parts)
    if mechanism.loops and settings.formulation in TREES:
        return ClosedChain(TREES[settings.formulation](mechanism, settings))
    if mechanism.bandwidth is not None and settings.formulation in TREES:
        from erls.equations.quasi_static.formulation import quasi_static

        build = TREES[settings.formulation]
        return quasi_static(lambda given: build(given, settings), mechanism, settings.duration)
    return FORMULATIONS[settings.formulation](mechanism, settings)

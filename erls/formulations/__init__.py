"""Formulations of the equations of motion, and their registry."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from importlib import import_module

from erls.formulations.base import Formulation, TreeFormulation
from erls.formulations.closed_chain import ClosedChain
from erls.formulations.erls import Erls
from erls.formulations.substructures import Substructured, of_pieces, solved
from erls.integrators import INTEGRATORS, KERNELS
from erls.integrators.base import Solution
from erls.mechanism.chain import Mechanism
from erls.mechanism.substructures import is_split, split
from erls.scene import Simulation


def _ffr(mechanism: Mechanism, settings: Simulation) -> TreeFormulation:
    from erls.formulations.ffr import Ffr  # here, like those below: a run imports what it needs

    return Ffr(mechanism, settings.body_frame)


def _nodal(mechanism: Mechanism, settings: Simulation) -> Formulation:
    from erls.formulations.nodal import Nodal

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
        from erls.formulations.quasi_static import quasi_static

        build = TREES[settings.formulation]
        return quasi_static(lambda given: build(given, settings), mechanism, settings.duration)
    return FORMULATIONS[settings.formulation](mechanism, settings)


def integrator(mechanism: Mechanism, settings: Simulation) -> Callable[..., Solution]:
    """The integrator that the settings name, for what `formulate` makes of the same: chains, loops, or frames tied by
    joints.
    """
    if settings.formulation in TREES and is_split(mechanism):
        return of_pieces(integrator(split(mechanism).pieces, settings))
    if settings.formulation == "nodal":
        from erls.formulations.nodal import nodal_generalized_alpha

        return partial(nodal_generalized_alpha, adaptive=settings.integrator == "auto")
    if settings.coordinates == "absolute":
        from erls.formulations.ffr.absolute import absolute_generalized_alpha

        return absolute_generalized_alpha
    if mechanism.loops:
        from erls.formulations.closed_run import loop_integrator

        return loop_integrator(settings.integrator)
    return INTEGRATORS[settings.integrator]


def compile_kernels(formulation: Formulation, settings: Simulation) -> None:
    """Compile what a run will call, by importing it: before the clock of the run starts."""
    if settings.formulation == "nodal":
        for name in ("system", "matrix", "step"):
            import_module(f"erls.kernels.nodal.{name}")
    elif settings.integrator in KERNELS:
        from erls.kernels.jit import compiling_beside

        tied = formulation.mechanism.loops and settings.integrator == "generalized_alpha"
        one = tied or settings.gauge != "joint-angle"  # module, or none at all
        with nullcontext() if one else compiling_beside(KERNELS[settings.integrator]):
            compiled = getattr(solved(formulation), "compiled", None)
        if compiled is not None:
            import_module("erls.kernels.loops.steps" if tied else KERNELS[settings.integrator])
    elif (compiled := getattr(solved(formulation), "compiled", None)) is not None:
        compiled.load_acceleration()


__all__ = ["FORMULATIONS", "TREES", "Formulation", "compile_kernels", "formulate", "integrator"]

"""The integrator that fits a formulation, and what it compiles."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from importlib import import_module

from erls.equations.formulation import Formulation
from erls.equations.registry import TREES
from erls.equations.substructures import solved
from erls.integrate.base import Observer, Options, Solution
from erls.integrate.registry import integrator_named
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.substructures import is_split, split
from erls.scene.integrators import INTEGRATORS
from erls.scene.settings import Simulation


def of_pieces(integrate: Callable[..., Solution]) -> Callable[..., Solution]:
    """An integrator that solves for the pieces."""

    def integrated(
        system: Formulation,
        times: tuple[float, float],
        y: Array,
        v: Array,
        options: Options,
        observer: Observer | None = None,
    ) -> Solution:
        return integrate(solved(system), times, y, v, options, observer)

    return integrated


def integrator(mechanism: Mechanism, settings: Simulation) -> Callable[..., Solution]:
    """The integrator that the settings name, for what `formulate` makes of the same: chains, loops, or frames tied by
    joints.
    """
    if settings.formulation in TREES and is_split(mechanism):
        return of_pieces(integrator(split(mechanism).pieces, settings))
    if settings.formulation == "nodal":
        from erls.integrate.nodal_chain import nodal_generalized_alpha

        return partial(nodal_generalized_alpha, adaptive=settings.integrator == "auto")
    if settings.coordinates == "absolute":
        from erls.integrate.absolute import absolute_generalized_alpha

        return absolute_generalized_alpha
    if mechanism.loops:
        from erls.integrate.closed_loops import loop_integrator

        return loop_integrator(settings.integrator)
    return integrator_named(settings.integrator)


def compile_kernels(formulation: Formulation, settings: Simulation) -> None:
    """Compile what a run will call, by importing it: before the clock of the run starts."""
    if settings.formulation == "nodal":
        for name in ("system", "matrix", "step"):
            import_module(f"erls.equations.nodal.kernels.{name}")
    elif (loop := INTEGRATORS[settings.integrator].kernels) is not None:
        from erls.maths.jit import compiling_beside

        tied = formulation.mechanism.loops and settings.integrator == "generalized_alpha"
        one = tied or settings.gauge != "joint-angle"  # module, or none at all
        with nullcontext() if one else compiling_beside(loop):
            compiled = getattr(solved(formulation), "compiled", None)
        if compiled is not None:
            import_module("erls.integrate.stepping.loops" if tied else loop)
    elif (compiled := getattr(solved(formulation), "compiled", None)) is not None:
        compiled.load_acceleration()

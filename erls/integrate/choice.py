"""What integrates a kind of system, and what that compiles: one line for each in `INTEGRATIONS`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from importlib import import_module
from typing import Any, NamedTuple, TypeAlias

from erls.equations.formulation import Formulation, Modular
from erls.equations.registry import system_of
from erls.equations.substructures import solved
from erls.equations.switched import switched
from erls.integrate.base import Observer, Options, Solution
from erls.integrate.charts import in_charts
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.registry import integrator_named
from erls.integrate.thinning import output_step
from erls.maths.beside import compiling_beside
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.substructures import split
from erls.scene.bodies.analyses import Dynamics
from erls.scene.integrators import FIXED_STEP, INTEGRATORS
from erls.scene.settings import Simulation

TIED_STEPS = "erls.integrate.stepping.generalized_alpha"

INTEGRATION_SHARE = 0.1
"""Of the error that a run is wanted to keep in all, what integration aims at."""

_ITERATED = 1e-7
"""Of the same: where iterations of equal steps end at the latest; of the usual tolerance, where they always end."""

IMPACT_SHARE = 1e-3
"""Of what it aims at elsewhere, where contacts or stops act: an error of the place within an impact is one of the speed
after it. Measured on a bouncing ball: `docs/trust.md`."""

_STICKING = 0.02
"""Of that again, where joints stick on flexible links: vibrations which positions hardly show decide when they do. With
a tenth, random scenes had up to a thousand switches of vibrations alone, and took longer."""

_LIMITED = 0.1
"""Of that again, where motors have limits on flexible links: vibrations decide when these are reached, and an error of
them becomes one of the impulse that the motor gives. Measured on an arm that swings to a stop under its limit: off by
up to thirty times of what was aimed at."""

Integrate: TypeAlias = Callable[..., Solution]
"""An `erls.integrate.base.Integrator` for one kind of system."""


class Integration(NamedTuple):
    """What integrates a kind of system as the settings say, and what compiles the functions that this will call."""

    integrator: Callable[[Mechanism, Simulation], Integrate]
    compile: Callable[[Any, Simulation], None]


def _nodal(mechanism: Mechanism, settings: Simulation) -> Integrate:
    from erls.integrate.nodal_chain import nodal_generalized_alpha

    return partial(nodal_generalized_alpha, adaptive=settings.integrator == "auto")


def _compile_nodal(system: Any, settings: Simulation) -> None:
    import_module("erls.equations.nodal.compiled")


def _pieces(mechanism: Mechanism, settings: Simulation) -> Integrate:
    integrate = integrator(split(mechanism).pieces, settings)

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


def _compile_pieces(system: Any, settings: Simulation) -> None:
    compile_kernels(solved(system), settings)


def _tied(mechanism: Mechanism, settings: Simulation) -> Integrate:
    from erls.integrate.closed_loops import loop_integrator

    return _with_modes(loop_integrator(settings.integrator), mechanism)


def _compile_tied(system: Any, settings: Simulation) -> None:
    if settings.integrator == FIXED_STEP and system.compiled is not None:
        import_module("erls.equations.loops.steps")
    elif settings.integrator != FIXED_STEP:
        _compile_named(system, settings)


def _absolute(mechanism: Mechanism, settings: Simulation) -> Integrate:
    from erls.integrate.absolute import absolute_generalized_alpha

    return partial(absolute_generalized_alpha, adaptive=settings.integrator == "auto")


def _named(mechanism: Mechanism, settings: Simulation) -> Integrate:
    return integrator_named(settings.integrator)


def _tree(mechanism: Mechanism, settings: Simulation) -> Integrate:
    return _with_modes(integrator_named(settings.integrator), mechanism)


def _with_modes(integrate: Integrate, mechanism: Mechanism) -> Integrate:
    """The same of a system whose joints stick, or whose motors come to their limits."""
    if not mechanism.switches:
        return integrate
    if any(link.elastic_modes for link in mechanism.links):
        integrate = _aimed(integrate, _STICKING if mechanism.sticks else _LIMITED)

    def integrated(
        system: Formulation,
        times: tuple[float, float],
        y: Array,
        v: Array,
        options: Options,
        observer: Observer | None = None,
    ) -> Solution:
        return integrate(switched(system), times, y, v, options, observer)

    return integrated


def _compile_named(system: Any, settings: Simulation) -> None:
    if INTEGRATORS[settings.integrator].kernels is None:
        if system.compiled is not None:
            system.compiled.load_acceleration()
        return
    own = ("erls.equations.independent", *(system.kernels if isinstance(system, Modular) else ()))
    with compiling_beside(*own[2:]):
        for module in own[:2]:  # the first: what steps ask of systems without ties
            import_module(module)
    for module in own:
        if module not in sys.modules:
            import_module(module)
    _ = system.compiled  # with what its size asks for, factors link by link


def _compile_tree(system: Any, settings: Simulation) -> None:
    _compile_named(system, settings)
    if system.mechanism.sticks:
        import_module("erls.equations.switches.kernels")


INTEGRATIONS: dict[str, Integration] = {
    "nodal": Integration(_nodal, _compile_nodal),
    "pieces": Integration(_pieces, _compile_pieces),
    "loops": Integration(_tied, _compile_tied),
    "quasi-static": Integration(_named, _compile_named),
    "absolute": Integration(_absolute, _compile_named),
    "tree": Integration(_tree, _compile_tree),
}
"""By kind of system, as in `erls.equations.registry.SYSTEMS`."""


def integrator(mechanism: Mechanism, settings: Simulation) -> Integrate:
    """What integrates that which `erls.equations.registry.formulate` makes of the same."""
    kind = system_of(mechanism, settings)
    found = INTEGRATIONS[kind].integrator(mechanism, settings)
    if kind in ("pieces", "nodal"):
        return found
    if mechanism.touches and kind != "absolute":
        found = _aimed(found, IMPACT_SHARE)
    return in_charts(found, mechanism.rotation_vector_places) if mechanism.rotation_vectors else found


def _aimed(integrate: Integrate, share: float) -> Integrate:
    """The same at a share of the tolerance."""

    def integrated(
        system: Formulation,
        times: tuple[float, float],
        y: Array,
        v: Array,
        options: Options,
        observer: Observer | None = None,
    ) -> Solution:
        return integrate(system, times, y, v, replace(options, tolerance=share * options.tolerance), observer)

    return integrated


def compiled_steps(mechanism: Mechanism, settings: Simulation) -> str | None:
    """The module of the compiled steps that integrate; None where they are not compiled."""
    if system_of(mechanism, settings) in ("nodal", "absolute"):
        return TIED_STEPS
    return INTEGRATORS[settings.integrator].kernels


@contextmanager
def compiling_steps(module: str | None) -> Iterator[None]:
    """Compile the steps of an integrator beside the equations, which the block compiles."""
    if module is None:
        yield
        return
    with compiling_beside(module):
        yield
    import_module(module)


def compile_kernels(formulation: Formulation, settings: Simulation) -> None:
    """Compile the equations that a run will call, by importing them: before the clock of the run starts."""
    INTEGRATIONS[system_of(formulation.mechanism, settings)].compile(formulation, settings)


def options_of(settings: Simulation) -> Options:
    """What the settings say to an integrator; steps that follow a tolerance are not given.

    Iterations of equal steps end the earlier the larger the tolerance is, and never later than is usual: who asks for
    more digits gets them, whatever the units.
    """
    equal = settings.integrator == FIXED_STEP and settings.step is not None
    return Options(
        None if INTEGRATORS[settings.integrator].follows_tolerance else settings.step,
        settings.rtol,
        settings.atol,
        settings.spectral_radius,
        min(Options.newton_tolerance, _ITERATED * settings.tolerance) if equal else Options.newton_tolerance,
        tolerance=INTEGRATION_SHARE * settings.tolerance,
        output_step=output_step(settings),
    )


def body_options(settings: Dynamics) -> ConstrainedOptions:
    """The same of a motion of bodies; steps that are not given follow the tolerance."""
    return ConstrainedOptions(
        step=settings.step,
        spectral_radius=settings.spectral_radius,
        newton_tolerance=settings.newton_tolerance,
        iteration_matrix=settings.iteration_matrix,
        residual_tolerance=settings.residual_tolerance,
        tolerance=INTEGRATION_SHARE * settings.tolerance,
        follows_tolerance=settings.step is None,
    )

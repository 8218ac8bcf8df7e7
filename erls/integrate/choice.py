"""What integrates a kind of system, and what that compiles: one line for each in `INTEGRATIONS`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from erls.equations.formulation import Formulation, Modular
from erls.equations.registry import system_of
from erls.equations.substructures import solved
from erls.integrate.base import Observer, Options, Solution
from erls.integrate.charts import in_charts
from erls.integrate.registry import integrator_named
from erls.integrate.thinning import output_step
from erls.maths.jit import compiling_beside
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.substructures import split
from erls.scene.integrators import FIXED_STEP, INTEGRATORS
from erls.scene.settings import Simulation

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
    loop = "erls.integrate.stepping.generalized_alpha"
    with compiling_beside(loop):
        import_module("erls.equations.nodal.compiled")
    import_module(loop)


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

    return loop_integrator(settings.integrator)


def _compile_tied(system: Any, settings: Simulation) -> None:
    if settings.integrator != FIXED_STEP:
        _compile_named(system, settings)
        return
    loop = "erls.integrate.stepping.generalized_alpha"
    with compiling_beside(loop):
        if system.compiled is not None:
            import_module("erls.equations.loops.steps")
    if system.compiled is not None:
        import_module(loop)


def _absolute(mechanism: Mechanism, settings: Simulation) -> Integrate:
    from erls.integrate.absolute import absolute_generalized_alpha

    return absolute_generalized_alpha


def _named(mechanism: Mechanism, settings: Simulation) -> Integrate:
    return integrator_named(settings.integrator)


def _compile_named(system: Any, settings: Simulation) -> None:
    loop = INTEGRATORS[settings.integrator].kernels
    if loop is None:
        if system.compiled is not None:
            system.compiled.load_acceleration()
        return
    here, beside = system.kernels if isinstance(system, Modular) else ((), ())
    with compiling_beside(loop, *beside):
        for module in ("erls.equations.independent", *here):  # the first: what steps ask of systems without ties
            import_module(module)
        if not beside:
            _ = system.compiled
    for module in beside:
        import_module(module)
    if system.compiled is not None:  # with what its size asks for, factors link by link
        import_module(loop)


INTEGRATIONS: dict[str, Integration] = {
    "nodal": Integration(_nodal, _compile_nodal),
    "pieces": Integration(_pieces, _compile_pieces),
    "loops": Integration(_tied, _compile_tied),
    "quasi-static": Integration(_named, _compile_named),
    "absolute": Integration(_absolute, _compile_named),
    "tree": Integration(_named, _compile_named),
}
"""By kind of system, as in `erls.equations.registry.SYSTEMS`."""


def integrator(mechanism: Mechanism, settings: Simulation) -> Integrate:
    """What integrates that which `erls.equations.registry.formulate` makes of the same."""
    kind = system_of(mechanism, settings)
    found = INTEGRATIONS[kind].integrator(mechanism, settings)
    if kind == "pieces" or not mechanism.rotation_vectors:
        return found
    prescribed = np.cumsum([joint.drive.prescribed for joint in mechanism.joints])
    return in_charts(found, [k - int(prescribed[k]) for k in mechanism.rotation_vectors])


def compile_kernels(formulation: Formulation, settings: Simulation) -> None:
    """Compile what a run will call, by importing it: before the clock of the run starts."""
    INTEGRATIONS[system_of(formulation.mechanism, settings)].compile(formulation, settings)


def options_of(settings: Simulation) -> Options:
    """What the settings say to an integrator; steps that follow a tolerance are not given."""
    return Options(
        None if INTEGRATORS[settings.integrator].follows_tolerance else settings.step,
        settings.rtol,
        settings.atol,
        settings.spectral_radius,
        tolerance=settings.tolerance,
        output_step=output_step(settings),
    )

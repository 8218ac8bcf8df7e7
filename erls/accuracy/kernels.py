"""Kernels that a statement will call, to be compiled beside those of the run."""

from __future__ import annotations

from erls.equations.registry import TREES, system_of
from erls.mechanism.chain import Mechanism
from erls.scene.integrators import FIXED_STEP, INTEGRATORS
from erls.scene.settings import Simulation


def kernels_of(mechanism: Mechanism, settings: Simulation) -> tuple[str, ...]:
    """Modules by name: powers in joints, forces at many states; where `lobatto` may integrate, the steps of the error
    equation.
    """
    if settings.formulation not in TREES or system_of(mechanism, settings) == "absolute":
        return ()
    followed = settings.integrator != FIXED_STEP and INTEGRATORS[settings.integrator].kernels is not None
    steps = ("erls.integrate.stepping.error_steps",) if followed and settings.output_step is None else ()
    return (*steps, "erls.equations.serial.joint_powers", "erls.equations.series")

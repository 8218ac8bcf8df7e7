"""Explicit methods on stiff links: the steps that their stability asks for, told before time goes into them."""

from __future__ import annotations

import math

from erls.equations.registry import formulate, system_of
from erls.errors import Cause, SimulationError
from erls.integrate.scipy_ivp import METHODS, explicit_step_limit
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene

_MOST_STEPS = 3000  # ten times those of an implicit method of order 6, each of which is compiled


def is_explicit(integrator: str) -> bool:
    """Whether steps of an integrator are limited by the highest frequency."""
    method = METHODS.get(integrator)
    return method is not None and math.isfinite(method.stable_to)


def too_stiff(scene: Scene) -> SimulationError | None:
    """Why an explicit method is of no use to a scene: TOO_STIFF, with the step that it would need; None for an implicit
    method, and where it may do.
    """
    settings = scene.record.simulation
    if not is_explicit(settings.integrator):
        return None
    mechanism = build_mechanism(scene).mechanism
    if system_of(mechanism, settings) != "tree":
        return None
    system = formulate(mechanism, settings)
    state = system.initial_state()
    frequency, limit = explicit_step_limit(system, 0.0, *state, settings.integrator)  # type: ignore[arg-type]
    steps = settings.duration / limit
    if steps <= _MOST_STEPS:
        return None
    return SimulationError(
        Cause.TOO_STIFF,
        f"needs steps of {limit:.3g} s or less, {math.ceil(steps)} of them, at {frequency:.4g} Hz, being explicit",
        limit=f"{_MOST_STEPS} steps",
        remedy="use an implicit integrator, or fewer modes; named in --integrators, it is tried all the same",
    )

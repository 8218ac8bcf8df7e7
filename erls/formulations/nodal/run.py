"""Integration of nodal systems: Lie-group generalized-α, one iteration matrix for as many steps as it serves."""

from __future__ import annotations

from erls.formulations.nodal.equations import Nodal
from erls.integrators.base import Observer, Options, Solution
from erls.integrators.constrained import ConstrainedOptions
from erls.integrators.lie_generalized_alpha import lie_generalized_alpha
from erls.lie.so3 import Array


def nodal_generalized_alpha(
    system: Nodal, times: tuple[float, float], y: Array, v: Array, options: Options, observer: Observer | None = None
) -> Solution:
    """Integrate a `Nodal`; see `lie_generalized_alpha`. Its solution holds frames and joint coordinates."""
    settings = ConstrainedOptions(
        options.step, options.rtol, options.atol, options.spectral_radius, options.newton_tolerance
    )
    return lie_generalized_alpha(system.system, times, *system.system.from_stored(y, v), settings, observer)

"""Integration of nodal systems: Lie-group generalized-α, one iteration matrix for as many steps as it serves.

Between knots, stiff elements would turn errors of interpolation into accelerations. A solution therefore keeps the
accelerations and multipliers of the knots, interpolated through differences of each stretch without jumps.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from erls.formulations.nodal.equations import Nodal
from erls.integrators.base import Observer, Options, Solution
from erls.integrators.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrators.lie_generalized_alpha import lie_generalized_alpha
from erls.lie.so3 import Array


def nodal_generalized_alpha(
    system: Nodal, times: tuple[float, float], y: Array, v: Array, options: Options, observer: Observer | None = None
) -> Solution:
    """Integrate a `Nodal`; see `lie_generalized_alpha`."""
    settings = ConstrainedOptions(
        options.step, options.rtol, options.atol, options.spectral_radius, options.newton_tolerance
    )

    def complete(found: ConstrainedSolution) -> Solution:
        more = [np.concatenate([twist_rates(found, system.system.count), found.multipliers], axis=1)]
        for _ in range(2):
            more.append(_slopes(found.t, more[-1]))
        full = [np.concatenate(pair, axis=1) for pair in zip((found.y, found.v, found.a), more, strict=True)]
        return Solution(found.t, full[0], full[1], full[2], found.work, found.failure, found.warnings)

    def watch(t: float, knots: Callable[[], ConstrainedSolution]) -> None:
        if observer is not None:
            observer(t, lambda: complete(knots()))

    start = system.configuration(y, v)
    return complete(lie_generalized_alpha(system.system, times, *start, settings, watch))  # type: ignore[arg-type]


def twist_rates(found: Solution, nodes: int) -> Array:
    """(knots, 6 nodes) rates of the twists, in node axes, from positions and rotation matrices."""
    frames = (x[:, : 12 * nodes].reshape(len(x), nodes, 12) for x in (found.y, found.v, found.a))
    (turn, _), (turning, slide), (swing, push) = (
        (x[..., 3:].reshape(*x.shape[:2], 3, 3), x[..., :3, None]) for x in frames
    )
    back = np.swapaxes(turn, 2, 3)
    spin = back @ turning
    linear = back @ push - spin @ back @ slide
    angular = back @ swing - spin @ spin
    rates = np.concatenate([linear[..., 0], angular[..., [2, 0, 1], [1, 2, 0]]], axis=2)
    return rates.reshape(len(rates), 6 * nodes)


def _slopes(t: Array, values: Array) -> Array:
    """(knots, n) derivatives by time, from differences that reach over no jump."""
    result = np.zeros_like(values)
    ends = np.flatnonzero(np.diff(t) == 0) + 1
    for part in np.split(np.arange(len(t)), ends):
        if len(part) > 1:
            result[part] = np.gradient(values[part], t[part], axis=0)
    return result

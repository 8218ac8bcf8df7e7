"""Generalized-α on absolute coordinates: floating frames tied by joints with multipliers, instead of joint angles.

A configuration that closes its joints is one of joint angles and elastic coordinates, so that the run is kept in these
and answers every question as the other does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from erls.equations.ffr.constrained import ConstrainedFfr
from erls.equations.ffr.formulation import Ffr
from erls.equations.system import SecondOrderSystem
from erls.integrate.base import Observer, Options, Solution
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.maths.so3 import Array


def absolute_generalized_alpha(
    system: SecondOrderSystem,
    times: tuple[float, float],
    y: Array,
    v: Array,
    options: Options,
    observer: Observer | None = None,
    adaptive: bool = False,
) -> Solution:
    """Integrate an `Ffr` as an index-3 system; see `lie_generalized_alpha`.

    With ``adaptive``, steps are chosen for an error of ``options.tolerance`` over the whole run.
    """
    assert isinstance(system, Ffr)
    absolute = ConstrainedFfr(system)
    settings = ConstrainedOptions(
        options.step,
        options.rtol,
        options.atol,
        options.spectral_radius,
        options.newton_tolerance,
        tolerance=options.tolerance,
        output_step=options.output_step,
        keeper=options.keeper,
        follows_tolerance=adaptive,
    )
    frames = 12 * absolute.links  # entries of what is stored before the elastic coordinates and the joint angles
    angles = frames + system.elastic + system.free_joints
    kept = np.concatenate([angles, frames + np.arange(system.elastic)])

    def independent(found: Solution) -> Solution:
        y, v, a = (np.ascontiguousarray(x[:, kept]) for x in (found.y, found.v, found.a))
        other = found.companion
        companion = other and other._replace(y=other.y[:, kept], v=other.v[:, kept], a=other.a[:, kept])
        known = found.work, found.failure, found.warnings
        return Solution(found.t, y, v, a, *known, companion=companion, halved=found.halved)

    def watch(t: float, knots: Callable[[], Solution]) -> Sequence[float] | None:
        return None if observer is None else observer(t, lambda: independent(knots()))

    start = absolute.configuration(times[0], y, v)
    return independent(lie_generalized_alpha(absolute, times, *start, settings, watch))

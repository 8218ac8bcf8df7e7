"""What modes that follow statically leave out of a run, estimated from the run itself.

Where their loads change, η̈ is left out. It would change η by m η̈ / κ, with m the mass of a mode, and push on the slow
modes, with stiffness k = ω², by F = Wᵀ M H η̈: that moves them by F / k, and their vibrations, to which it adds out of
step, by √(1 + ½ ω T) times as much over a run of T (joints, without stiffness, by F / (M Ω²) at the rate Ω at which η
changes). Where loads jump, at the start and at breakpoints, η would vibrate about the new deflection by as much as that
differs from the old one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.errors import SimulationError
from erls.integrate.base import Leg, Solution, hermite, legs
from erls.maths.so3 import Array
from erls.run.watches.base import NOTHING, Ended, Finding, Plan, Watch

ABOVE = "modes above the bandwidth"  # in warnings of an error beyond the tolerance
_SAMPLES, _SAMPLES_UNCOMPILED = 30, 10
_MOST_LEGS = 30
_MARGIN = 8.0
_PER_PERIOD = 40  # differences in time, of the period of the slowest static mode


class StaticFollowing(Watch):
    """Looks at what the loads of static modes do."""

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Mechanisms with a bandwidth."""
        return plan.mechanism.bandwidth is not None

    def after(self, ended: Ended) -> Finding:
        """An error beyond the tolerance."""
        if ended.meaningless:
            return NOTHING
        run = ended.run
        return Finding(static_warnings(run.formulation, run.solution, run.scene.record.simulation.effects_tolerance))


@dataclass(frozen=True)
class StaticError:
    """What is left out of the motion of static modes.

    Attributes
    ----------
    deflection : float
        Largest static deflection of a node [m].
    inertia : float
        What their inertia would change in it and in the slow coordinates [m].
    ringing : float
        Amplitude of the vibration that the largest jump of the loads would start [m].
    rate_hz : float
        Frequency at which the static deflection changes.
    """

    deflection: float
    inertia: float
    ringing: float
    rate_hz: float

    @property
    def error(self) -> float:
        """Estimated error of points [m]."""
        return self.inertia + self.ringing

    @property
    def stated(self) -> float:
        """The same with a margin [m]: points of twelve random scenes were 0.05 to 7.4 times as far from all modes."""
        return _MARGIN * self.error


def static_error(formulation: QuasiStatic, solution: Solution) -> StaticError | None:
    """Estimate from the knots of a run; None for one that ended at once, or whose numbers are not finite.

    Parameters
    ----------
    formulation : QuasiStatic
    solution : Solution
    """
    modes, s = formulation.modes, solution
    times = float(s.t[0]), float(s.t[-1])
    if not len(modes.stiffness) or not times[1] > times[0]:
        return None

    def eta(t: Array) -> Array:
        states = zip(t.tolist(), *hermite(s.t, s.y, s.v, s.a, t), strict=True)
        return np.array([formulation.deflection(*state) for state in states])

    walk = legs(formulation, times)
    walk = [walk[k] for k in np.unique(np.linspace(0, len(walk) - 1, _MOST_LEGS).astype(int))]
    middle, step = _samples(formulation, walk, s.t)
    try:
        with np.errstate(all="ignore"):  # a run that failed may hold anything
            before, at, after = eta(middle - step), eta(middle), eta(middle + step)
            starts, ends = eta(np.array([leg.first for leg in walk])), eta(np.array([leg.last for leg in walk]))
    except (SimulationError, np.linalg.LinAlgError):
        return None
    second = (before - 2 * at + after) / step[:, None] ** 2
    jumps = starts - np.vstack([modes.static_start, ends[:-1]])
    moved = float(np.sqrt(np.mean((modes.metres * (at - at.mean(axis=0))) ** 2)))
    swift = float(np.sqrt(np.mean((modes.metres * second) ** 2)))
    rate = float(np.sqrt(swift / moved)) if moved else 0.0
    pushed = _pushed(formulation, solution, middle, second, rate)
    result = StaticError(
        deflection=_size(modes.metres, at),
        inertia=_size(modes.metres * modes.masses / modes.stiffness, second) + pushed,
        ringing=_size(modes.metres, jumps),
        rate_hz=rate / (2 * np.pi),
    )
    return result if np.isfinite(result.error + result.deflection) else None


def _pushed(formulation: QuasiStatic, solution: Solution, times: Array, second: Array, rate: float) -> float:
    """How far η̈ (k, h) at some times would move the slow coordinates [m]."""
    s, slow, squares = solution, formulation.modes.slow, formulation.squares
    length = float(s.t[-1] - s.t[0])
    moved = []
    for t, z, change in zip(times.tolist(), hermite(s.t, s.y, s.v, s.a, times)[0], second, strict=True):
        weighted = slow.T @ formulation.full_mass_matrix(t, z)
        stiffness = np.where(squares > 0, squares, np.einsum("sn,ns->s", weighted, slow) * rate**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            moved.append(np.where(stiffness > 0, weighted @ formulation.modes.static @ change / stiffness, 0.0))
    return _size(formulation.length_scales * np.sqrt(1 + np.sqrt(squares) * length / 2), np.array(moved))


def static_warnings(formulation: Formulation, solution: Solution, tolerance: float) -> list[str]:
    """At most one: what static modes leave out passes the tolerance [m] of points."""
    if not isinstance(formulation, QuasiStatic):
        return []
    found = static_error(formulation, solution)
    if found is None or found.error <= tolerance:
        return []
    if found.ringing > found.inertia:
        why = f"loads that jump would make them vibrate by {found.ringing:.2g} m"
    else:
        why = f"at {found.rate_hz:.3g} Hz, at which their loads change, inertia would add {found.inertia:.2g} m"
    return [
        f"{ABOVE}, {formulation.bandwidth:g} Hz, follow statically and deflect by up to "
        f"{found.deflection:.2g} m: {why}; expect errors of about {found.error:.2g} m, or raise simulation.bandwidth "
        f"(tolerance {tolerance:.2g} m)"
    ]


def _samples(formulation: QuasiStatic, walk: list[Leg], knots: Array) -> tuple[Array, Array]:
    """Times away from jumps, those of the knots next to even ones, and the steps of differences around them."""
    count = _SAMPLES_UNCOMPILED if formulation.inner.compiled is None else _SAMPLES
    finest = formulation.period / _PER_PERIOD
    middle, step = [], []
    for leg in walk:
        length = leg.last - leg.first
        some = max(1, round(count * length / float(knots[-1] - knots[0])))
        margin = min(finest, length / 8)
        even = np.linspace(leg.first + margin, leg.last - margin, some + 2)[1:-1]
        own = knots[(knots >= leg.first + margin) & (knots <= leg.last - margin)]
        at = np.unique(own[np.searchsorted((own[1:] + own[:-1]) / 2, even)]) if len(own) else even
        middle.append(at)
        step.append(np.full(len(at), margin))
    return np.concatenate(middle), np.concatenate(step)


def _size(metres: Array, eta: Array) -> float:
    """Largest displacement of deflections (k, h), the modes' own added as if in any direction [m]."""
    return float(np.sqrt(((metres * eta) ** 2).sum(axis=1)).max(initial=0.0))

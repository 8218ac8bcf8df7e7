"""The contract between equations of motion and integrators.

Rules for adding an integrator:

1. One file with one function ``integrate(system, times, y, v, options, observer) -> Solution`` and one line
   in the registry of ``erls/integrate/registry.py``.
2. An integrator knows the system only through `SecondOrderSystem`; it never asks what the coordinates mean.
   Norms are taken in metres, through ``system.length_scales``.
3. It never steps over a member of ``breakpoints(system, times)``: forces jump there. At such a time the
   solution holds two knots, one with the acceleration on either side. Forces are asked for only at times
   inside ``[leg.first, leg.last]`` of the current member of ``legs(system, times)``, a hair away from the
   jump, so that it does not matter to which side a force counts its own jump.
4. Knots lie densely enough that quintic Hermite interpolation through (y, v, a) is as accurate as the method.
5. It never raises for a numerical failure: it returns what was computed, at least one knot, with
   ``Solution.failure`` set, whose message says when, why and what to try. ``KeyboardInterrupt`` likewise ends
   in a failure with cause INTERRUPTED, ``MemoryError`` in one with cause OUT_OF_MEMORY.
6. It counts its work honestly in `Work`; tests assert budgets on it.
7. It calls ``observer(t, knots)`` after each accepted step (a compiled one after the last of some steps that took
   about 50 ms, once a run has made its first steps), where ``knots()`` returns the `Solution` so far, with every step
   since the last call. What is kept of these follows ``options.output_step``, and times that the observer returns,
   whose knots on either side are kept.
   A `SimulationError` that the observer or the system raises ends the run and becomes its failure; a `StopRun` of
   the observer ends it without failure.
8. After each look it offers ``options.keeper`` what it needs to go on, if it can (`erls.integrate.memory`); with a
   memory it goes on from there, bit for bit as though it had never ended.

`erls.integrate.driver.integrate_legs` keeps rules 3, 5, 7 and 8 for a method that can advance over one leg.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from erls.equations.system import MovingSystem, SecondOrderSystem
from erls.errors import Cause, SceneError, SimulationError
from erls.integrate.memory import Keeper
from erls.maths.so3 import Array
from fe_import.model import IntArray

_HAIR = 1e-12  # of the largest time, or of 1 s: breakpoints this close are one


def _hair(times: tuple[float, float]) -> float:
    """Time that no force resolves; above the tolerance within which `erls.mechanism.curves` merges events."""
    return _HAIR * max(abs(times[0]), abs(times[1]), 1.0)


class StopRun(Exception):
    """The observer has seen enough; nothing went wrong. Its arguments are times as an `Observer` may return them."""


@dataclass
class Work:
    """What an integration cost; what a foreign solver does not tell stays 0."""

    steps: int = 0
    rejected_steps: int = 0
    rhs_calls: int = 0  # evaluations of residual or acceleration
    newton_iterations: int = 0
    factorizations: int = 0


@dataclass(frozen=True)
class Options:
    """Settings of an integration.

    Attributes
    ----------
    step : float or None
        Step of a fixed-step method [s]; largest step of an adaptive one.
    rtol, atol : float
        Relative tolerance, and absolute tolerance in metres, of an adaptive method.
    spectral_radius : float
        ρ∞ of generalized-α: numerical damping at infinite frequency, 1 none, 0 full.
    newton_tolerance : float
        Newton iterations stop when the remaining error is estimated below this [m]; at steps below 1 ms it
        falls with the cube of the step, so that convergence keeps its order.
    tolerance : float
        Error over the whole run [m] that ``lobatto`` and ``auto`` aim at.
    output_step : float or None
        Of the knots only the states at these distances in time [s] are kept (`erls.integrate.thinning`) beside the
        ends of legs; None keeps all.
    keeper : Keeper or None
        Of what the integration needs to go on, and what it goes on from (`erls.integrate.memory`); it says nothing of
        the motion.

    Raises
    ------
    SceneError
        With cause BAD_FIELD, naming the setting.
    """

    step: float | None = None
    rtol: float = 1e-8
    atol: float = 1e-12
    spectral_radius: float = 0.8
    newton_tolerance: float = 1e-11
    tolerance: float = 1e-5
    output_step: float | None = None
    keeper: Keeper | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        apart = self.output_step
        # NaN fails every comparison, so that it is refused too
        checks = (
            ("step", self.step, self.step is None or self.step > 0, "a positive number of seconds"),
            ("output_step", apart, apart is None or apart > 0, "a positive number of seconds"),
            ("rtol", self.rtol, 3e-14 <= self.rtol < 1, "between 3e-14 (rounding) and 1"),
            ("atol", self.atol, self.atol > 0, "a positive number of metres"),
            ("spectral_radius", self.spectral_radius, 0 <= self.spectral_radius <= 1, "between 0 and 1"),
            ("tolerance", self.tolerance, self.tolerance > 0, "a positive number of metres"),
            ("newton_tolerance", self.newton_tolerance, self.newton_tolerance >= 0, "zero or more metres"),
        )
        for name, value, ok, right in checks:
            if not ok:
                message = "the integrator cannot work with this value"
                raise SceneError(
                    Cause.BAD_FIELD, message, where=f"options.{name}", value=value, remedy=f"must be {right}"
                )


class Companion(NamedTuple):
    """Knots of a run of the same with larger steps, whose distance tells the error of a `Solution`
    (`erls.integrate.step_distance`).

    ``beyond``: what that is more than smaller steps have it, where rounding decides [m].
    """

    t: Array
    y: Array
    v: Array
    a: Array
    beyond: float = 0.0


class Halved(NamedTuple):
    """Steps of a given size that were made in parts, since Newton's method did not converge.

    Attributes
    ----------
    steps, given : int
        How many, and of how many.
    first : float
        Time of the first one [s]; infinite where there is none.
    """

    steps: int = 0
    given: int = 0
    first: float = math.inf

    def and_then(self, more: Halved) -> Halved:
        """Those of two stretches."""
        return Halved(self.steps + more.steps, self.given + more.given, min(self.first, more.first))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to tell; nothing where none was halved."""
        if not self.steps:
            return ()
        were = "step was" if self.given == 1 else "steps were"
        why = "since Newton's method did not converge: use a smaller simulation.step"
        return (f"{self.steps} of {self.given} {were} halved, first at t = {self.first:.6g} s, {why}",)


@dataclass(frozen=True)
class Solution:
    """Knots of the motion: times (k,) in rising order (twice at a jump), y, v, a (k, n).

    ``choice`` names the method that ``auto`` chose, and why; ``nodes_per_step``: how many knots a step adds, the last
    of them its end; ``companion`` is known where steps were chosen by it. ``halved`` stands apart from
    ``warnings``: what it says is known at the end, of all stretches of a run together.
    """

    t: Array
    y: Array
    v: Array
    a: Array
    work: Work = field(default_factory=Work)
    failure: SimulationError | None = None
    warnings: tuple[str, ...] = ()
    choice: str = ""
    nodes_per_step: int = 1
    companion: Companion | None = None
    halved: Halved = field(default_factory=Halved)


Observer = Callable[[float, Callable[[], Solution]], Sequence[float] | None]
Integrator = Callable[
    [SecondOrderSystem, tuple[float, float], Array, Array, Options, Observer | None], Solution
]


class Leg(NamedTuple):
    """A stretch of time without jumps: its ends, and the first and last time at which to ask for forces."""

    start: float
    end: float
    first: float
    last: float


def breakpoints(system: MovingSystem, times: tuple[float, float]) -> list[float]:
    """Breakpoints strictly inside ``times``, and its end, in rising order; the legs of an integration.

    Breakpoints that only rounding tells apart (0.3 and 0.1 + 0.2) count once.
    """
    start, end = times
    margin = _hair(times)
    found: list[float] = []
    for b in sorted(system.breakpoints):
        if (found[-1] if found else start) + margin < b < end - margin:
            found.append(b)
    return [*found, end]


def legs(system: MovingSystem, times: tuple[float, float]) -> list[Leg]:
    """Stretches between breakpoints; none when ``times`` has no length.

    Raises
    ------
    SceneError
        With cause BAD_FIELD when the times are not finite or fall.
    """
    start, end = times
    if not (np.isfinite(start) and np.isfinite(end) and start <= end):
        raise SceneError(
            Cause.BAD_FIELD,
            "the end of a run must be finite and not before its start",
            where="times",
            value=times,
            remedy="give (start, end) in seconds with start <= end",
        )
    if start == end:
        return []
    ends = breakpoints(system, times)
    hair = _hair(times)
    pairs = zip([start, *ends[:-1]], ends, strict=True)
    return [Leg(s, e, min(s + hair, (s + e) / 2), max(e - hair, (s + e) / 2)) for s, e in pairs]


def walked(system: MovingSystem, t: Array) -> list[tuple[int, int, Leg]]:
    """Stretches without jumps of a run with knots (k,): numbers of their first knot and of the one after their last,
    and the legs, of which those that a switch begins or ends are parts.
    """
    found: list[tuple[int, int, Leg]] = []
    ends = [0, *(np.flatnonzero(np.diff(t) == 0) + 1).tolist(), len(t)]
    whole = legs(system, (float(t[0]), float(t[-1])))
    for first, end in pairwise(ends):
        begun = float(t[first])
        leg = next((leg for leg in whole if leg.start <= begun < leg.end), whole[-1] if whole else None)
        if leg is not None:
            own = leg if begun == leg.start else Leg(begun, leg.end, begun, leg.last)
            found.append((first, end, own))
    return found


def hermite(t: Array, y: Array, v: Array, a: Array, at: Array) -> tuple[Array, Array]:
    """Quintic Hermite interpolation through knots of position, velocity and acceleration.

    Parameters
    ----------
    t : (k,) array
        Knots in rising order, at least one; a time that stands twice marks a jump of ``a``.
    y, v, a : (k, n) arrays
    at : (m,) array
        Times within [t[0], t[-1]]; outside, the first and last polynomial are continued.

    Returns
    -------
    y, v : (m, n) arrays
        Interpolated positions and velocities (the derivative of the interpolant).
    """
    if len(t) == 1:  # a run that failed at once
        return np.repeat(y, len(at), axis=0), np.repeat(v, len(at), axis=0)
    return _quintics(t, y, v, a, at).first_two()


def knots_after(t: Array, at: Array) -> IntArray:
    """(m,) numbers of the knots that end the stretches in which times lie; those before them begin these."""
    right = np.clip(np.searchsorted(t, at, side="right"), 1, len(t) - 1)
    # a zero-length interval (a jump) is never asked for: step back over it at the end of the knots
    return np.asarray(np.where(t[right] == t[right - 1], right - 1, right).clip(1))


def hermite_knots(t: Array, y: Array, v: Array, a: Array, at: Array) -> tuple[Array, Array, Array]:
    """The same with (m, n) accelerations, the second derivative of the interpolant."""
    if len(t) == 1:  # a run that failed at once
        return np.repeat(y, len(at), axis=0), np.repeat(v, len(at), axis=0), np.repeat(a, len(at), axis=0)
    found = _quintics(t, y, v, a, at)
    return *found.first_two(), found.acceleration()


class _Quintics(NamedTuple):
    """Polynomials in s, from 0 to 1 along stretches of length h, at each of m times: coefficients (m, n)."""

    s: Array
    h: Array
    start: Array
    rate: Array
    bend: Array
    third: Array
    fourth: Array
    fifth: Array

    def first_two(self) -> tuple[Array, Array]:
        """Values, and their rates."""
        s, h, y0, v0, a0, c3, c4, c5 = self
        position = y0 + s * (v0 + s * (a0 / 2 + s * (c3 + s * (c4 + s * c5))))
        return position, (v0 + s * (a0 + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))) / h

    def acceleration(self) -> Array:
        """The second derivative."""
        s, h, _, _, a0, c3, c4, c5 = self
        return np.asarray((a0 + s * (6 * c3 + s * (12 * c4 + s * 20 * c5))) / h**2)


def _quintics(t: Array, y: Array, v: Array, a: Array, at: Array) -> _Quintics:
    """At times between two or more knots."""
    right = knots_after(t, at)
    left = right - 1
    h = (t[right] - t[left])[:, None]
    h = np.where(h > 0, h, 1.0)
    s = (at - t[left])[:, None] / h
    y0, y1 = y[left], y[right]
    v0, v1 = v[left] * h, v[right] * h
    a0, a1 = a[left] * h**2, a[right] * h**2
    # y0 + v0 s + a0 s²/2 + c3 s³ + c4 s⁴ + c5 s⁵ with the three conditions at s = 1
    dy, dv, da = y1 - y0 - v0 - a0 / 2, v1 - v0 - a0, a1 - a0
    c3 = 10 * dy - 4 * dv + da / 2
    c4 = -15 * dy + 7 * dv - da
    c5 = 6 * dy - 3 * dv + da / 2
    return _Quintics(s, h, y0, v0, a0, c3, c4, c5)

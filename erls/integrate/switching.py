"""Switches of a motion whose modes change: found between the knots of a step, and located in time.

A switch is where a joint that slides comes to rest, where friction that holds one reaches what it can hold, or where a
motor comes to its limit or leaves it (`erls.equations.switches.base`). Steps go on with the modes that they began with,
so that what they interpolate is smooth, and a switch is as accurate as the knots (rule 4 of `erls.integrate.base`): it
becomes the last knot of a leg, and another leg begins there with the modes that follow. What falls below zero and comes
back between two looks is not seen.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from functools import cache

import numpy as np

from erls.equations.switches.base import Switches
from erls.equations.system import MovingSystem
from erls.errors import Cause, SimulationError
from erls.integrate.base import Leg, hermite_knots
from erls.integrate.memory import Memory, taken
from erls.maths.so3 import Array
from fe_import.model import IntArray

_LOOKS = 4  # in the interval between two knots
_MANY, _AT_ONCE = 100, 1e-7  # switches, and the time in which nobody meant as many [s]
_HAIR = 4e-12  # of the largest time, or of 1 s: a switch this close to the end of a leg is left to the next one
_ROUNDING = 4 * np.finfo(float).eps


class Switch(Exception):
    """A mode has ended, at the last knot that was recorded; y and v (n,) at time ``t``."""

    def __init__(self, t: float, y: Array, v: Array) -> None:
        super().__init__(t)
        self.t, self.y, self.v = t, y, v


class Switching:
    """Looks for switches in the knots of a run.

    Parameters
    ----------
    system : Switches
    """

    def __init__(self, system: Switches) -> None:
        self.system = system
        self._decided = system.undecided
        self._recent: deque[float] = deque(maxlen=_MANY)
        self._knot = np.zeros((3, len(system.still)))  # the last one
        self._t = 0.0
        self._begun = False
        self.leg = Leg(0.0, 0.0, 0.0, 0.0)
        """What is being walked over: a leg, or what a switch leaves of one."""
        self.coarse = False
        """Whether steps need not resolve vibrations, so that accelerations at knots tell nothing of what is between."""

    def stand(self, leg: Leg, y: Array, v: Array) -> tuple[Array, Array]:
        """Set the modes at the start of a leg; rates and accelerations (n,)."""
        if self._begun:  # who rests because others do keeps no rounding
            v = np.where(self.system.still, 0.0, v)
        else:
            self.system.grips.forget()  # another run of the same system may have left some
        self._begun = True
        a = self.system.settle(leg.first, y, v, self._decided)
        self._decided = self.system.undecided
        self.leg, self._t, self._knot = leg, leg.start, self.system.seen_at_start(np.array([y, v, a]))
        return v, a

    def rest(self, knots: Array) -> None:
        """Take from knots (k, 3, n) what rounding leaves of the motion of joints that rest."""
        still = self.system.still
        knots[:, 0, still], knots[:, 1:, still] = self._knot[0, still], 0.0

    def first(self, t: Array, knots: Array, beside: Array) -> tuple[int, Array | None, Switch | None]:
        """The first switch in new knots.

        Parameters
        ----------
        t : (k,) array
        knots : (k, 3, n) array
            y, v and a.
        beside : (k, b) array
            What is kept beside them.

        Returns
        -------
        count : int
            Of knots before it; all of them where there is none.
        knot : (3 n + b,) array or None
            At the switch, with what is kept beside; None where that is the last knot before.
        switch : Switch or None
        """
        knots = self.system.seen(knots, beside)
        times, states = np.append(self._t, t), np.concatenate([self._knot[None], knots])
        slides = self.coarse or self.system.steady
        looks, (y, v, a) = (times, states.swapaxes(0, 1)) if slides else _looks(times, states)
        ended = self.system.left(looks, y, v, a) < 0.0
        ended[0] = False  # there the law has just spoken
        if ended.any():
            every = 1 if slides else _LOOKS  # looks from knot to knot; rates are looked at at knots alone
            ended &= np.logical_not(self.system.slides) | (np.arange(len(looks)) % every == 0)[:, None]
            for at in np.flatnonzero(ended.any(axis=1)).tolist():
                since = looks[at - (every if at % every == 0 else 1)]
                found = self._located(times, states, since, looks[at], np.flatnonzero(ended[at]))
                if found is not None:
                    return found
        self._t, self._knot = float(times[-1]), states[-1]
        return len(t), None, None

    def _located(
        self, times: Array, states: Array, start: float, end: float, joints: IntArray
    ) -> tuple[int, Array | None, Switch] | None:
        """The first switch of some joints between two looks; None where there is none, since between knots that do not
        resolve a vibration interpolated accelerations do not tell, or where it is at the end of the leg.
        """

        def state(x: float) -> tuple[Array, Array]:
            if self.coarse:
                return _cubic(times, states, x)
            y, v, _ = hermite_knots(times, states[:, 0], states[:, 1], states[:, 2], np.array([x]))
            return y[0], v[0]

        def accelerations(x: float, y: Array, v: Array) -> Array:
            if self.system.sees:
                return _between(times, states[:, 2], x)
            return self.system.acceleration(x, y, v)

        def left(joint: int) -> Callable[[float], float]:
            def value(x: float) -> float:
                y, v = state(x)
                a = accelerations(x, y, v)
                return float(self.system.left(np.array([x]), y[None], v[None], a[None])[0, joint])

            return value

        zero = self.system.begins_at_zero[joints]
        roots = np.array([_root(left(int(k)), start, end, bool(s)) for k, s in zip(joints, zero, strict=True)])
        t = float(roots.min())
        if not t < self.leg.end - _HAIR * max(abs(self.leg.end), 1.0):
            return None
        now = joints[roots <= t + _ROUNDING * max(abs(t), 1.0)]
        y, v = self.system.closed(t, *state(t))
        a = accelerations(t, y, v)
        v = self.system.brought_to_rest(t, y, v, now[self.system.slides[now]])
        knot, beside = self.system.knot(t, y, v)
        self._end_modes(t, y, v, a, now)
        before = max(int(np.searchsorted(times, t)) - 1, 0)
        return before, np.append(knot, beside) if t > times[0] else None, Switch(t, y, v)

    def _end_modes(self, t: float, y: Array, v: Array, a: Array, ended: IntArray) -> None:
        """What follows of some modes is decided.

        Raises
        ------
        SimulationError
            STEP_TOO_SMALL, where that goes on and on at one instant.
        """
        self._decided = self.system.after(t, y, v, a, ended)
        self._recent.append(t)
        if len(self._recent) == _MANY and t - self._recent[0] < _AT_ONCE:
            raise SimulationError(
                Cause.STEP_TOO_SMALL,
                f"{self.system.names[int(ended[0])]} {_MANY} times at once",
                where=f"t = {t:.9g} s",
                value=f"{t - self._recent[0]:.3g} s",
                limit=f"{_AT_ONCE:g} s for {_MANY} switches",
                remedy="look for forces without bound on this joint; or use friction.law = 'smooth', or another limit",
            )

    def memory(self) -> Memory:
        """Between two steps, see `erls.integrate.memory`."""
        return {
            "switching.modes": self.system.modes.copy(),
            "switching.fixed": self.system.fixed.copy(),
            "switching.grips": self.system.grips.kept,
            "switching.leg": np.array(self.leg),
            "switching.t": np.array([self._t, self.system.seen_by]),
            "switching.knot": self._knot,
            "switching.recent": np.array(self._recent, dtype=float),
        }

    def restore(self, memory: Memory) -> None:
        """As another run left it."""
        modes = taken(memory, "switching.modes", self.system.modes)
        self._knot = taken(memory, "switching.knot", self._knot).copy()
        self.system.grips.restore(taken(memory, "switching.grips", self.system.grips.kept))
        self.system.set(modes, taken(memory, "switching.fixed", self.system.fixed, axis=0), self._knot[0])
        self.leg = Leg(*taken(memory, "switching.leg", np.zeros(4)).tolist())
        self._t, self.system.seen_by = taken(memory, "switching.t", np.zeros(2)).tolist()
        self._recent = deque(taken(memory, "switching.recent", np.zeros(0), axis=0).tolist(), maxlen=_MANY)
        self._begun = True


def switching_of(system: MovingSystem) -> Switching | None:
    """What looks for switches; None where there are none."""
    found = system if isinstance(system, Switches) else getattr(system, "switches", None)
    return Switching(found) if isinstance(found, Switches) else None


def _cubic(times: Array, states: Array, x: float) -> tuple[Array, Array]:
    """(n,) y and v by a cubic, from places and rates alone."""
    k = int(np.clip(np.searchsorted(times, x), 1, len(times) - 1))
    h = float(times[k] - times[k - 1])
    s = (x - float(times[k - 1])) / h
    (y0, v0), (y1, v1) = states[k - 1, :2], states[k, :2]
    rise = (y1 - y0) / h
    c, d = 3 * rise - 2 * v0 - v1, v0 + v1 - 2 * rise
    return y0 + h * s * (v0 + s * (c + s * d)), v0 + s * (2 * c + 3 * s * d)


def _between(times: Array, values: Array, x: float) -> Array:
    """(n,) a straight line from knot to knot; constant from one that is not known."""
    k = int(np.clip(np.searchsorted(times, x), 1, len(times) - 1))
    s = (x - float(times[k - 1])) / float(times[k] - times[k - 1])
    before = np.where(np.isnan(values[k - 1]), values[k], values[k - 1])
    return np.asarray(before + s * (values[k] - before))


def _looks(times: Array, states: Array) -> tuple[Array, Array]:
    """Times (q,), evenly between knots and at these, and y, v, a there (3, q, n), of knots (k,) and (k, 3, n)."""
    span = np.diff(times)[:, None]
    powers = span[:, :, None] ** np.arange(3)[:, None]
    both = np.concatenate([states[:-1] * powers, states[1:] * powers], axis=1)  # per unit of the interval
    between = np.einsum("dli,kin->dkln", _shapes(), both) / powers.swapaxes(0, 1)[..., None]
    at = (times[:-1, None] + span * np.arange(_LOOKS) / _LOOKS).ravel()
    found = between.reshape(3, len(at), states.shape[2])
    return np.append(at, times[-1]), np.concatenate([found, states[-1][:, None]], axis=1)


@cache
def _shapes() -> Array:
    """(3, looks, 6) value, rate and acceleration at looks in an interval of length 1, by y, v, a at either end."""
    at, ends = np.arange(_LOOKS) / _LOOKS, np.array([0.0, 1.0])
    y, v, a = np.eye(6).reshape(2, 3, 6).swapaxes(0, 1)
    return np.array(hermite_knots(ends, y, v, a, at))


def _root(value: Callable[[float], float], start: float, end: float, from_zero: bool) -> float:
    """Where a value that is positive after ``start``, and there unless it begins ``from_zero``, falls below zero;
    infinite where it does not.
    """
    from scipy.optimize import brentq  # here: only switches need it

    if value(end) >= 0.0:
        return math.inf
    first = start
    if value(first) <= 0.0:
        if not from_zero:
            return start
        last = end  # it starts from rest, as a joint does that has just broken away, or from the limit of a motor
        while value(first) <= 0.0:
            end = first if first > start else end
            first = start + (end - start) / 2
            if end - start < _ROUNDING * max(abs(end), _ROUNDING):
                return last  # and goes back at once, as far as steps tell
    return float(brentq(value, first, end, xtol=1e-15, rtol=_ROUNDING))

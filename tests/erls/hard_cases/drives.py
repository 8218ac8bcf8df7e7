"""Drives and friction: jumps, impulses, tables, controllers up to gains of 1e12, saturation, stick-slip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.optimize

from erls.errors import Cause
from erls.maths.so3 import Array
from hard_cases.case import Case, closed, of_subject
from hard_cases.pendulums import planar, thin
from hard_cases.truths import ends_of_bars, integrated

_LENGTH, _MASS = 0.5, 1.0
_INERTIA = _MASS * _LENGTH**2 / 3


def _bar(drive: dict[str, Any], start: float = 0.0, rate: float = 0.0, **more: Any) -> dict[str, Any]:
    """A bar about a vertical axis, driven."""
    scene = planar([thin(_LENGTH, _MASS)], [start], [rate], gravity=[0.0] * 3, **more)
    scene["joints"][0]["drive"] = drive
    if drive["type"] == "motion":
        del scene["joints"][0]["initial"]
    return scene


def _pushed(name: str, profiles: Sequence[dict[str, Any]], jumps: Sequence[tuple[float, float]], **more: Any) -> Case:
    """Torques that jump, at times, by so much: θ = Σ Δτ (t - t₀)² / 2 J."""

    def places(t: Array) -> Array:
        angle = sum(size * np.maximum(t - time, 0.0) ** 2 / (2 * _INERTIA) for time, size in jumps)
        return ends_of_bars([_LENGTH], np.atleast_2d(angle))

    scene = _bar(
        {"type": "torque", "profiles": list(profiles)}, simulation={"duration": 1.0, **more.pop("simulation", {})}
    )
    return Case(name, scene, closed(places, "parabolas", 1e-12), **more)


def _controlled(name: str, proportional: float, derivative: float, limit: float | None = None, **more: Any) -> Case:
    """A controller that follows a polynomial of degree 5: its equation, integrated by itself."""
    span, turn = 0.8, 1.5
    motion = {"shape": "polynomial", "from": 0.0, "to": turn, "duration": span, "degree": 5}
    drive = {"type": "pd", "motion": motion, "proportional_gain": proportional, "derivative_gain": derivative}
    drive |= {} if limit is None else {"torque_limit": limit}

    def wanted(t: Array | float) -> tuple[Array, Array, Array]:
        s = np.clip(np.asarray(t) / span, 0.0, 1.0)
        rate = turn / span
        place = turn * s**3 * (10 - 15 * s + 6 * s**2)
        return place, rate * 30 * s**2 * (1 - s) ** 2, rate / span * 60 * s * (1 - s) * (1 - 2 * s)

    def rate_of(t: float, e: Array) -> Array:  # of what is missing: no digits are lost at large gains
        torque = proportional * e[0] + derivative * e[1]
        torque = torque if limit is None else np.clip(torque, -limit, limit)
        return np.array([e[1], wanted(t)[2] - torque / _INERTIA])

    def places(t: Array) -> Array:
        missing = integrated(rate_of, [0.0, 0.0], 1.0, stiff=derivative > 0)
        return ends_of_bars([_LENGTH], (wanted(t)[0] - missing(t)[0])[None])

    scene = _bar(drive, simulation={"duration": 1.0})
    return Case(name, scene, closed(places, "own equation, Radau to 1e-12", 1e-9), **more)


_MOVED, _PULL, _SPEED = 4.0, 20.0, 0.1  # s, N/m, m/s: a block behind a spring whose end moves steadily


def _block(friction: dict[str, Any], thrown: float = 0.0, **simulation: Any) -> dict[str, Any]:
    """A block of 1 kg on a rail, thrown, or pulled by the spring."""
    body = {"mass": 1.0, "inertia": [1e-3] * 3, "points": {"middle": [0.0, 0.0, 0.0]}}
    joint: dict[str, Any] = {"name": "rail", "type": "prismatic", "dh": {"convention": "standard"}}
    joint |= {"initial": {"rate": thrown}, "friction": friction}
    if not thrown:
        times = [-1.0, 0.0, _MOVED, _MOVED + 1]
        values, rates = [_SPEED * t for t in times], [_SPEED, _SPEED]
        motion = {"shape": "table", "times": times, "values": values, "rates": rates}
        joint["drive"] = {"type": "pd", "motion": motion, "proportional_gain": _PULL, "derivative_gain": 0.0}
    return {
        "gravity": [0.0, 0.0, 0.0],
        "simulation": {"duration": 1.0 if thrown else _MOVED, **simulation},
        "joints": [joint],
        "links": [{"name": "block", "rigid": body}],
        "points": [{"name": "block", "link": "block", "node": "middle"}],
    }


def _along(distance: Array) -> Array:
    """(k, 1, 3) along the rail."""
    return np.stack([0 * distance, 0 * distance, distance], axis=1)[:, None]


def _smooth(name: str, force: float, transition: float, thrown: float = 0.0, **more: Any) -> Case:
    """Under smooth friction."""
    pull, duration = (0.0, 1.0) if thrown else (_PULL, _MOVED)

    def rate_of(t: float, x: Array) -> Array:
        return np.array([x[1], pull * (_SPEED * t - x[0]) - force * np.tanh(x[1] / transition)])

    def places(t: Array) -> Array:
        return _along(integrated(rate_of, [0.0, thrown], duration, stiff=True)(t)[0])

    scene = _block({"force": force, "transition_rate": transition}, thrown)
    return Case(name, scene, closed(places, "own equation, Radau to 1e-12", 1e-9), **more)


def _slips(force: float, static: float) -> Callable[[Array], Array]:
    """Places (k,) of the pulled block that sticks, and slips on ẍ = k (V t - x) - F from rest to rest."""
    rate, at, place = np.sqrt(_PULL), 0.0, 0.0
    phases = []
    while at < _MOVED:
        begins = max((static / _PULL + place) / _SPEED, at)
        ahead = place - _SPEED * begins + force / _PULL  # of where spring and friction balance

        def speed(t: float, ahead: float = ahead) -> float:
            return float(_SPEED - ahead * rate * np.sin(rate * t) - _SPEED * np.cos(rate * t))

        lasts = float(scipy.optimize.brentq(speed, 1e-3 / rate, 2 * np.pi / rate - 1e-12))
        phases.append((begins, begins + lasts, place, ahead))
        at, s = begins + lasts, rate * lasts
        place = _SPEED * at - force / _PULL + ahead * np.cos(s) - _SPEED / rate * np.sin(s)
    ends = [phase[2] for phase in phases] + [place]

    def places(t: Array) -> Array:
        result = np.zeros_like(t)
        for number, (begins, until, _, ahead) in enumerate(phases):
            s = rate * (t - begins)
            moving = _SPEED * t - force / _PULL + ahead * np.cos(s) - _SPEED / rate * np.sin(s)
            result = np.where(t > begins, np.where(t < until, moving, ends[number + 1]), result)
        return result

    return places


def _thrown(t: Array) -> Array:
    """At 1 m/s, against 2 N."""
    sliding = np.minimum(t, 0.5)
    return np.asarray(sliding - sliding**2)


def _stick(name: str, places: Callable[[Array], Array], force: float, static: float, thrown: float = 0.0) -> Case:
    """Under Coulomb's law, exactly; to 1e-6 m where integration aims at a tenth of it."""
    scene = _block({"force": force, "static_force": static, "law": "stick"}, thrown, tolerance=1e-6)
    return Case(name, scene, closed(lambda t: _along(places(t)), "closed form", 1e-9), fast=("erls",))


def _step(start: float, value: float, end: float | None = None) -> dict[str, Any]:
    return {"shape": "step", "start": start, "value": value} | ({} if end is None else {"end": end})


_TABLE = {"shape": "table", "times": [0.0, 0.3, 0.3, 0.6], "values": [0.0, 0.0, 1.0, 1.0]}
CASES = of_subject(
    "drives and friction",
    [
        _pushed("a torque that jumps", [_step(0.3, 0.4)], [(0.3, 0.4)], fast=("erls", "ffr")),
        _pushed(
            "jumps that meet",
            [_step(0.3, 0.4, 0.5), _step(0.5, -0.4, 0.7)],
            [(0.3, 0.4), (0.5, -0.8), (0.7, 0.4)],
            fast=("erls",),
        ),
        _pushed(
            "an impulse of 1 µs", [_step(0.3, 5e4, 0.300001)], [(0.3, 5e4), (0.300001, -5e4)], fast=("erls", "ffr")
        ),
        _pushed(
            "a table that holds its values",
            [{"shape": "table", "times": [0.0, 0.3, 0.7], "values": [0.0, 0.4, 0.0], "interpolation": "hold"}],
            [(0.3, 0.4), (0.7, -0.4)],
        ),
        _pushed(
            "equal steps that do not meet a jump",
            [_step(0.30005, 0.4)],
            [(0.30005, 0.4)],
            simulation={"step": 1e-3, "integrator": "generalized_alpha"},
        ),
        Case(
            "a table with a time twice",
            _bar({"type": "torque", "profiles": [_TABLE]}),
            ends={"all": Cause.BAD_FIELD},
            told="rise",
            fast=("erls",),
        ),
        _controlled("controller, gains 1e2 and 1e1", 1e2, 1e1, fast=("erls", "ffr")),
        _controlled("controller, gains 1e6 and 1e3", 1e6, 1e3),
        _controlled("controller, gains 1e12 and 1e6", 1e12, 1e6, fast=("erls", "ffr")),
        _controlled("controller, gain 1e6, no damping", 1e6, 0.0),
        _controlled("controller at its limit", 200.0, 10.0, 0.5),
        _smooth("a block that slides to rest", 2.0, 1e-2, 1.0, fast=("erls",)),
        _smooth("a block that slides to rest, transition 1e-6 m/s", 2.0, 1e-6, 1.0),
        _stick(
            "a block that slides to rest, and sticks",
            lambda t: np.minimum(t, 0.5) * (1 - np.minimum(t, 0.5)),
            2.0,
            2.0,
            1.0,
        ),
        _smooth("stick-slip of a block on a spring, smooth law", 1.0, 1e-3),
        _stick("stick-slip of a block on a spring, exact sticking", _slips(0.6, 1.0), 0.6, 1.0),
    ],
)

"""Contacts and stops: a ball that bounces, arms against a plane and a stop, by their own equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import contact_scenes
import numpy as np
import scenes

from erls.maths.so3 import Array
from hard_cases.case import Case, closed, energy_kept, fine, of_subject
from hard_cases.flexible import better
from hard_cases.truths import integrated

_G, _MASS = contact_scenes.G, contact_scenes.MASS
_DROP, _SPRING = 0.2, 1e5  # m, N/m: of the ball that keeps its energy
_ABOUT_HINGE = 0.1 + 1.0 * 0.5**2  # kg m², of the arm
_AHEAD = 0.1  # m or rad, to what the arm meets
_TRANSITION = 1e-3  # m/s, rad/s


def _pressed(stiffness: float, exponent: float, restitution: float) -> Callable[[float, float], float]:
    """Force at a depth and its rate, as docs/scenes.md has it: k δⁿ (1 ± d), between them x (15 - 10 x² + 3 x⁴) / 8."""
    loss = (1 - restitution**2) / (1 + restitution**2)

    def force(depth: float, rate: float) -> float:
        x = float(np.clip(rate / _TRANSITION, -1.0, 1.0))
        return stiffness * max(depth, 0.0) ** exponent * (1 + loss * x * (15 - 10 * x**2 + 3 * x**4) / 8)

    return force


def _up(height: Array) -> Array:
    """(k, 1, 3)"""
    return np.stack([0 * height, 0 * height, height], axis=1)[:, None]


def _bouncing(t: Array) -> Array:
    """A ball on a linear spring without loss: parabolas, and between them δ = g (1 - cos ωt) / ω² + v sin(ωt) / ω."""
    fall, rate = np.sqrt(2 * _DROP / _G), np.sqrt(_SPRING / _MASS)
    speed = _G * fall
    pressed = 2 * (np.pi - np.arctan(speed * rate / _G)) / rate
    at = np.mod(t + fall, 2 * fall + pressed) - fall  # from each highest place
    inside = at - fall
    depth = _G / rate**2 * (1 - np.cos(rate * inside)) + speed / rate * np.sin(rate * inside)
    return _up(np.where(inside > 0, -depth, _DROP - _G * at**2 / 2))


def _losing(restitution: float, duration: float) -> Callable[[Array], Array]:
    force = _pressed(contact_scenes.STIFFNESS, 1.5, restitution)

    def rate_of(t: float, x: Array) -> Array:
        return np.array([x[1], force(-x[0], -x[1]) / _MASS - _G])

    return lambda t: _up(integrated(rate_of, [_DROP, 0.0], duration, stiff=True)(t)[0])


def _turned(torque: Callable[[float, float], float]) -> Callable[[Array], Array]:
    """The tip of the arm under a torque against its turn."""

    def rate_of(t: float, x: Array) -> Array:
        return np.array([x[1], -torque(x[0], x[1]) / _ABOUT_HINGE])

    def places(t: Array) -> Array:
        angle = integrated(rate_of, [0.0, 1.0], 0.6, stiff=True)(t)[0]
        return np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)[:, None]

    return places


def _on_a_plane(name: str, restitution: float, **more: Any) -> Case:
    force = _pressed(1e7, 1.5, restitution)

    def torque(angle: float, rate: float) -> float:
        return np.cos(angle) * force(np.sin(angle) - _AHEAD, np.cos(angle) * rate)

    plane = {"normal": [0.0, -1.0, 0.0], "position": [0.0, _AHEAD, 0.0]}
    contact = {"name": "wall", "point": "tip", "plane": plane, "stiffness": 1e7, "restitution": restitution}
    truth = closed(_turned(torque), "own equation, Radau to 1e-12", 1e-8)
    return Case(name, contact_scenes.arm(contacts=[contact]), truth, **more)


def _at_a_stop(name: str, restitution: float, **more: Any) -> Case:
    force = _pressed(2e4, 1.0, restitution)
    stops = {"upper": _AHEAD, "stiffness": 2e4, "restitution": restitution}
    truth = closed(_turned(lambda angle, rate: force(angle - _AHEAD, rate)), "own equation, Radau to 1e-12", 1e-8)
    return Case(name, contact_scenes.arm(joint={"stops": stops}), truth, **more)


def _on_a_slope(name: str, degrees: float, **more: Any) -> Case:
    mu, speed = 0.3, -1.0
    slope = np.radians(degrees)
    scene = contact_scenes.on_a_slope(degrees, speed, {"law": "stick", "coefficient": mu})
    depth = (_MASS * _G * np.cos(slope) / contact_scenes.STIFFNESS) ** (1 / 1.5)

    def places(t: Array) -> Array:
        way = contact_scenes.down_the_slope(degrees, speed, mu, t)
        x, z = way * np.cos(slope) - depth * np.sin(slope), -way * np.sin(slope) - depth * np.cos(slope)
        return np.stack([x, 0 * x, z], axis=1)[:, None]

    return Case(name, scene, closed(places, "closed form", 1e-9), **more)


_KEPT = contact_scenes.ball(1.0, _DROP, 0.0, _G, stiffness=_SPRING, exponent=1.0)
CASES = of_subject(
    "contacts",
    [
        Case(
            "a ball that bounces without loss",
            _KEPT,
            # nodal steps are of second order
            closed(_bouncing, "parabolas and half sines", 0.0, energy_kept(1e-2)),
            fast=("erls", "ffr"),
        ),
        Case(
            "a ball that bounces at half its speed, until it rests",
            contact_scenes.ball(0.5, _DROP, 0.0, _G),
            closed(_losing(0.5, 1.0), "own equation, Radau to 1e-12", 1e-8),
        ),
        _on_a_plane("an arm that meets a plane, e = 0.5", 0.5, fast=("ffr",)),
        _on_a_plane("an arm that meets a plane, e = 0", 0.0),
        _on_a_slope("a block pushed up a slope that holds it", 10.0, fast=("erls",)),
        _on_a_slope("a block pushed up a slope, which slides back", 25.0),
        _at_a_stop("a joint that meets its stop, e = 0.9", 0.9, fast=("erls",)),
        Case(
            "a flexible arm that falls onto a plane",
            contact_scenes.falling_arm(),
            fine("beam elements, tolerance / 30", better("nodal", 1e-5), better("nodal", 3e-6)),
            links={"arm": scenes.ARM_LINK},
        ),
    ],
)

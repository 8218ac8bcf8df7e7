"""Loops: redundant conditions, dead points, change points."""

from __future__ import annotations

from functools import partial
from typing import Any

import loop_scenes
import numpy as np

from erls.errors import Cause
from erls.maths.so3 import Array
from hard_cases.case import Case, Made, Measure, closed, energy_kept, measured, of_subject
from hard_cases.flexible import beam
from hard_cases.truths import swinging

_G = 9.81
_LINK, _BAR, _LENGTH = 0.3, 0.9, 0.2  # kg, kg, m: two legs and the bar of a parallelogram


def _flat(*points: Array) -> Array:
    """(k, points, 3) in the plane of x and z, of complex numbers (k,)."""
    return np.stack([np.stack([p.real, 0 * p.real, p.imag], axis=1) for p in points], axis=1)


def _crank(t: Array) -> Array:
    return np.radians(60.0 + 720.0 * np.asarray(t))


def _four_bar(t: Array) -> Array:
    first, second, third = loop_scenes.LENGTHS
    angles = _crank(t), *loop_scenes.four_bar_angles(_crank(t))
    places, root = [], 0 * t + 0j
    for length, angle in zip((first, second, third), angles, strict=True):
        places += [root + length / 2 * np.exp(1j * angle), root + length * np.exp(1j * angle)]
        root = places[-1]
    return _flat(*places)


def _slider_crank(t: Array) -> Array:
    first, second, _ = loop_scenes.LENGTHS
    pin = first * np.exp(1j * _crank(t))
    slider = pin.real + np.sqrt(second**2 - pin.imag**2) + 0j
    return _flat(pin / 2, pin, (pin + slider) / 2, slider, slider)


def _parallelogram(degrees: float, third: bool = False, **simulation: Any) -> dict[str, Any]:
    """Legs of the same length at an angle from the horizontal, let go at rest; a third leg follows from the others."""
    joints = [
        loop_scenes.joint(f"j{k}", length, angle)
        for k, (length, angle) in enumerate(((_LENGTH, degrees), (0.5, -degrees), (_LENGTH, degrees - 180.0)))
    ]
    links = [
        {"name": name, "rigid": loop_scenes.bar(length, mass), "mesh_pose": {"frame": "joint"}}
        for name, length, mass in (("leg", _LENGTH, _LINK), ("bar", 0.5, _BAR), ("other", _LENGTH, _LINK))
    ]
    loops = [{"name": "closing", "link": "other", "node": "tip", "position": [0.5, 0.0, 0.0]}]
    if third:
        branch = {"position": [0.25, 0.0, 0.0]}
        joints.append(loop_scenes.joint("j3", _LENGTH, degrees - 180.0, on="bar", at="middle", branch=branch))
        body = loop_scenes.bar(_LENGTH, _LINK)
        links.append({"name": "third", "rigid": body, "mesh_pose": {"frame": "joint"}})
        loops.append({"name": "third", "link": "third", "node": "tip", "position": [0.25, 0.0, 0.0]})
    return {
        "gravity": [0.0, 0.0, -_G],
        "simulation": {"duration": 2.0, **simulation},
        "base": {"rotation_deg": [90.0, 0.0, 0.0]},
        "joints": joints,
        "links": links,
        "loops": loops,
        "points": [{"name": "end", "link": "bar", "node": "tip"}],
    }


def _translated(degrees: float, legs: int) -> Any:
    """The bar stays level, and circles as a pendulum."""
    moment = _LENGTH * (legs * _LINK / 2 + _BAR)
    inertia = _LENGTH**2 * (legs * _LINK / 3 + _BAR)
    swing = swinging(np.radians(90.0 + degrees), np.sqrt(_G * moment / inertia))

    def places(t: Array) -> Array:
        return _flat(0.5 + _LENGTH * np.exp(1j * (swing(t) - np.pi / 2)))

    return places


def _driven(data: dict[str, Any], start: float, rate: float) -> dict[str, Any]:
    return loop_scenes.driven(data, loop_scenes.steady(start, rate))


def _swung(name: str, degrees: float, kept: float, legs: int = 2, **more: Any) -> Case:
    """Energy is kept to a share of what is exchanged."""
    truth = closed(_translated(degrees, legs), "elliptic function", 0.0, energy_kept(kept))
    return Case(name, _parallelogram(degrees, legs == 3, **more.pop("simulation", {})), truth, **more)


_GAP, _SPAN, _STIFF = 1e-3, 0.5, 2e11 * 0.01**4 / 12  # m, m, N m²


def _bent_into_place(made: Made) -> Measure:
    """3 E I δ / L³ in the slot, but for terms of (δ / L)²."""
    force = float(made.run.loop_reaction("slot", 0.0)[0][2])
    return Measure("force, off by", abs(force / (3 * _STIFF * _GAP / _SPAN**3) - 1), 2 * (_GAP / _SPAN) ** 2)


def _stays(made: Made) -> Measure:
    off = made.places()[:, 0, 2] - _GAP
    return Measure("off the line / m", float(np.abs(off).max()), 1e-9)


_BENT: dict[str, Any] = {
    "gravity": [0.0, 0.0, 0.0],
    "simulation": {"duration": 0.1},
    "initial": {"assemble": "elastic"},
    "joints": [{"name": "clamp", "type": "fixed", "dh": {"convention": "standard", "a": _SPAN}}],
    "links": [{"name": "beam", "model": "beam.toml", "mesh_pose": {"frame": "joint"}}],
    "points": [{"name": "tip", "link": "beam", "node": "tip"}],
    "loops": [
        {"name": "slot", "type": "line", "link": "beam", "node": "tip", "axis": [1.0, 0.0, 0.0]}
        | {"position": [_SPAN, 0.0, _GAP]}
    ],
}
_PIVOT = {"name": "pivot", "type": "spherical", "link": "beam", "node": "tip", "position": [_SPAN + _GAP, 0.0, 0.0]}
_SPRING, _RUB, _FAR, _AT = 20.0, 0.1, 0.1, 60.0  # N m/rad, N m in each joint of the tree, rad, degrees
_CLOSING = 0.2  # N m in the joint that closes it


def _rubbing(closing: float = 0.0) -> dict[str, Any]:
    """A parallelogram on a spring, displaced; three joints rub, and the one that closes it, and rest together."""
    data = _parallelogram(_AT, tolerance=1e-6)
    for joint in data["joints"]:
        joint["friction"] = {"law": "stick", "force": _RUB}
    if closing:
        data["loops"][0]["friction"] = {"law": "stick", "force": closing}
    data["joints"][0] |= {"stiffness": _SPRING, "rest": float(np.radians(_AT) - _FAR)}
    return {**data, "gravity": [0.0, 0.0, 0.0]}


def _comes_to_rest(t: Array, closing: float = 0.0) -> Array:
    """Half cycles about places where spring and friction balance."""
    rate = np.sqrt(_SPRING / (_LENGTH**2 * (2 * _LINK / 3 + _BAR)))
    balance = (3 * _RUB + closing) / _SPRING
    angle, x, begun = np.zeros_like(t), _FAR, 0.0
    while abs(x) > balance:
        middle = np.copysign(balance, x)
        angle = np.where(t >= begun, middle + (x - middle) * np.cos(rate * (t - begun)), angle)
        x, begun = 2 * middle - x, begun + np.pi / rate
    angle = np.where(t >= begun, x, angle)
    return _flat(0.5 + _LENGTH * np.exp(1j * (np.radians(_AT) - _FAR + angle)))


_TURNED = _driven(loop_scenes.four_bar(), 60.0, 720.0)
CASES = of_subject(
    "loops",
    [
        Case(
            "planar four-bar, redundant conditions",
            _TURNED,
            closed(_four_bar, "closed form", 1e-9),
            fast=("erls", "ffr"),
        ),
        Case(
            "slider-crank through both dead centres",
            _driven(loop_scenes.slider_crank(), 60.0, 720.0),
            closed(_slider_crank, "closed form", 1e-9),
            fast=("erls",),
        ),
        Case(
            "a drive that meets a dead point",
            loop_scenes.rocker_first(180.0),
            ends={"all": Cause.LOOP_OPEN},
            told="'pivot'.*locks|locks.*'pivot'",
            fast=("erls", "ffr", "nodal"),
        ),
        Case(
            "a beam bent by 1 mm into its slot",
            _BENT,
            measured("3 E I δ / L³", _bent_into_place, _stays),
            links={"beam": beam(_SPAN)},
            ends={"nodal": Cause.BAD_FIELD},
            fast=("erls", "ffr"),
        ),
        Case(
            "a beam that no mode lengthens to its pivot",
            {**_BENT, "loops": [_PIVOT]},
            links={"beam": beam(_SPAN)},
            changes=("links.beam.elastic_modes=2",),
            ends={"all": Cause.LOOP_OPEN, "nodal": Cause.BAD_FIELD},
            told="no link gives way.*along x|assemble",
        ),
        _swung("parallelogram that swings", -60.0, 1e-4),
        Case(
            "parallelogram whose joints come to rest, and stick",
            _rubbing(),
            closed(_comes_to_rest, "closed form", 1e-9),
            fast=("erls", "ffr"),
        ),
        Case(
            "parallelogram whose joints stick, the closing one too",
            _rubbing(_CLOSING),
            closed(partial(_comes_to_rest, closing=_CLOSING), "closed form", 1e-9),
            fast=("erls",),
        ),
        _swung("parallelogram with a third leg", -60.0, 1e-4, legs=3),
        _swung("parallelogram through its change point, adaptive", 60.0, 1e-6, simulation={"tolerance": 1e-6}),
        _swung("parallelogram through its change point, steps of 1 ms", 60.0, 1e-4, simulation={"step": 1e-3}),
        _swung("parallelogram through its change point, steps of 0.1 ms", 60.0, 1e-6, simulation={"step": 1e-4}),
    ],
)

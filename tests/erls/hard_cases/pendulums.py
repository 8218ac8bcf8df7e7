"""Pendulums: long runs, many turns, links without mass, mass ratios, folded and stretched chains, sizes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scenes
from loop_scenes import bar, joint

from erls.errors import Cause
from erls.maths.so3 import Array
from hard_cases.case import Case, closed, of_subject
from hard_cases.truths import bars_in_a_plane, ends_of_bars, swinging

G = 9.81
_HANGING = -np.pi / 2


def planar(
    bodies: Sequence[dict[str, Any]], angles: Sequence[float], rates: Sequence[float] = (), **changes: Any
) -> Any:
    """Links on each other in the plane of x and z; angles from the horizontal [rad], rates [rad/s], of each link."""
    between, turning = np.diff(angles, prepend=0.0), np.diff(rates or np.zeros(len(bodies)), prepend=0.0)
    lengths = [body["points"]["tip"][0] for body in bodies]
    joints = [
        joint(f"j{k}", length, initial={"position": float(between[k]), "rate": float(turning[k])})
        for k, length in enumerate(lengths)
    ]
    links = [{"name": f"b{k}", "rigid": body, "mesh_pose": {"frame": "joint"}} for k, body in enumerate(bodies)]
    data = {
        "gravity": [0.0, 0.0, -G],
        "simulation": {"duration": 2.0},
        "base": {"rotation_deg": [90.0, 0.0, 0.0]},
        "joints": joints,
        "links": links,
        "points": [{"name": f"tip{k}", "link": f"b{k}", "node": "tip"} for k in range(len(bodies))],
    }
    return scenes.merged(data, changes)


def thin(length: float, mass: float) -> dict[str, Any]:
    """A bar without thickness."""
    across = mass * length**2 / 12
    return {**bar(length, mass), "inertia": [0.0, across, across]}


def bob(length: float, mass: float) -> dict[str, Any]:
    """A point mass at the end of a rod without mass."""
    return {**bar(length, mass), "centre_of_mass": [length, 0.0, 0.0], "inertia": [0.0, 0.0, 0.0]}


def _released(name: str, length: float, degrees: float, mass: float = 1.0, thick: bool = False, **more: Any) -> Case:
    """A pendulum released at rest, at an angle from hanging: its elliptic function."""
    body, factor = (thin(length, mass), 1.5) if thick else (bob(length, mass), 1.0)
    angle = swinging(np.radians(degrees), np.sqrt(factor * G / length))
    simulation = more.pop("simulation", {})
    scene = planar([body], [_HANGING + np.radians(degrees)], simulation=simulation)
    return Case(
        name, scene, closed(lambda t: ends_of_bars([length], _HANGING + angle(t)[None]), "elliptic function"), **more
    )


def _hung(
    name: str,
    lengths: Sequence[float],
    masses: Sequence[float],
    angles: Sequence[float],
    rates: Sequence[float],
    duration: float = 2.0,
    **more: Any,
) -> Case:
    """Thin bars on each other: an integration of their own equations."""
    start = [_HANGING + np.radians(angle) for angle in angles]
    bodies = [thin(length, mass) for length, mass in zip(lengths, masses, strict=True)]
    scene = planar(bodies, start, rates, simulation={"duration": duration, **more.pop("simulation", {})})

    def places(t: Array) -> Array:
        return ends_of_bars(lengths, bars_in_a_plane(lengths, masses, start, rates, duration, G)(t))

    return Case(name, scene, closed(places, "own equations, DOP853 to 1e-13", 1e-11 * sum(lengths)), **more)


def _turning(name: str, turns: int, duration: float, **more: Any) -> Case:
    """A bar that turns steadily."""
    rate = 2 * np.pi * turns / duration
    scene = planar(
        [thin(0.5, 1.0)],
        [0.0],
        [rate],
        gravity=[0.0] * 3,
        simulation={"duration": duration, **more.pop("simulation", {})},
    )
    return Case(name, scene, closed(lambda t: ends_of_bars([0.5], rate * t[None]), "steady turn"), **more)


def _conical(degrees: float, **more: Any) -> Case:
    """A mass that circles at an angle from hanging, at √(g / (L cos)): on a spherical joint."""
    lean, length = np.radians(degrees), 0.8
    rate = np.sqrt(G / (length * np.cos(lean)))
    out = np.array([np.sin(lean), 0.0, -np.cos(lean)])
    body = {
        "mass": 1.0,
        "centre_of_mass": (length * out).tolist(),
        "inertia": [1e-3, 1e-3, 1e-3],
        "points": {"root": [0.0] * 3, "tip": (length * out).tolist()},
    }
    scene = {
        "gravity": [0.0, 0.0, -G],
        "simulation": {"duration": 5.0},
        "joints": [
            {
                "name": "ball",
                "type": "spherical",
                "dh": {"convention": "modified"},
                "coordinates": {"turn_z": {"initial": {"rate": float(rate)}}},
            }
        ],
        "links": [{"name": "bob", "rigid": body}],
        "points": [{"name": "tip", "link": "bob", "node": "tip"}],
    }

    def places(t: Array) -> Array:
        flat = length * np.sin(lean)
        circle = [flat * np.cos(rate * t), flat * np.sin(rate * t), np.full_like(t, -length * np.cos(lean))]
        return np.stack(circle, axis=1)[:, None]

    return Case(f"conical pendulum at {degrees:g}°", scene, closed(places, "steady circle"), **more)


_LONG = {"nodal": ("simulation.tolerance=1e-2", "simulation.output_step=0.1")}  # steps of second order
CASES = of_subject(
    "pendulums",
    [
        _released("simple pendulum from 170°", 1.0, 170.0, simulation={"duration": 5.0}, fast=("erls", "ffr")),
        _released(
            "simple pendulum from 179.99°, near the top", 1.0, 179.99, simulation={"duration": 10.0}, fast=("erls",)
        ),
        _released("600 s of a bar from 60°", 0.7, 60.0, thick=True, simulation={"duration": 600.0}, also=_LONG),
        _released(
            "1e6 equal steps of a bar from 60°",
            0.7,
            60.0,
            thick=True,
            also=_LONG,
            simulation={"duration": 600.0, "step": 6e-4, "integrator": "generalized_alpha"},
        ),
        _released(
            "pendulum of 1 µm",
            1e-6,
            100.0,
            1e-15,
            simulation={"duration": 5e-3, "tolerance": 1e-10},
            fast=("erls", "ffr", "nodal"),
        ),
        _released("pendulum of 50 m", 50.0, 100.0, 1e4, simulation={"duration": 50.0}, fast=("erls", "ffr")),
        _turning("1000 turns", 1000, 100.0, fast=("erls", "ffr")),
        _turning(
            "1000 turns in equal steps", 1000, 100.0, simulation={"step": 1e-2, "integrator": "generalized_alpha"}
        ),
        _hung("stretched, hanging, pushed", [0.5, 0.5], [1.0, 1.0], [0.0, 0.0], [3.0, 3.0], fast=("erls", "ffr")),
        _hung("folded back on itself", [0.5, 0.5], [1.0, 1.0], [-40.0, 140.0], [0.0, 0.0], fast=("erls",)),
        _hung("folded, arms of unequal length", [0.5, 0.3], [1.0, 1.0], [-90.0, 90.0], [0.0, 0.0]),
        _hung(
            "a millionth of the mass at the end",
            [0.5, 0.5],
            [1.0, 1e-6],
            [60.0, 20.0],
            [0.0, 0.0],
            fast=("erls", "ffr"),
        ),
        _hung("a millionth of the mass above", [0.5, 0.5], [1e-6, 1.0], [60.0, 20.0], [0.0, 0.0], fast=("erls",)),
        _hung(
            "upper bar without mass", [0.5, 0.5], [0.0, 1.0], [60.0, 20.0], [0.0, 0.0], fast=("erls", "ffr", "nodal")
        ),
        _hung("middle bar of 1e-9 kg", [0.5, 0.3, 0.5], [1.0, 1e-9, 1.0], [60.0, 20.0, 0.0], [0.0] * 3),
        _hung("three bars, chaotic", [0.5, 0.4, 0.3], [1.0, 0.5, 0.2], [120.0, 90.0, 150.0], [0.0] * 3, duration=5.0),
        Case(
            "last bar without mass",
            planar([thin(0.5, 1.0), thin(0.5, 0.0)], [0.0, 0.0]),
            ends={"all": Cause.SINGULAR_MASS},
            fast=("erls", "ffr", "nodal"),
        ),
        _conical(30.0, fast=("erls",)),
        _conical(85.0),
    ],
)

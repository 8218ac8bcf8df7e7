"""Tops: free and heavy ones, asleep, tumbling, on a spherical joint whose rotation vector is exchanged on the way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from erls.maths.so3 import Array
from hard_cases.case import Case, closed, of_subject
from hard_cases.truths import top

_NODES = {"pin": [0.0, 0.0, 0.0], "nose": [0.0, 0.0, 0.3], "side": [0.2, 0.0, 0.0]}


def spinning(
    spin: Sequence[float],
    duration: float,
    inertia: Sequence[float],
    mass: float = 1.0,
    centre: Sequence[float] = (0.0, 0.0, 0.0),
    gravity: Sequence[float] = (0.0, 0.0, 0.0),
    simulation: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """The scene of a rigid body pinned at a point; inertia about its centre of mass."""
    body = {"mass": mass, "centre_of_mass": list(centre), "inertia": list(inertia), "points": _NODES}
    starts = {f"turn_{axis}": {"initial": {"rate": float(rate)}} for axis, rate in zip("xyz", spin, strict=True)}
    return {
        "gravity": list(gravity),
        "simulation": {"duration": duration, **(simulation or {})},
        "joints": [{"name": "ball", "type": "spherical", "dh": {"convention": "modified"}, "coordinates": starts}],
        "links": [{"name": "top", "rigid": body}],
        "points": [{"name": node, "link": "top", "node": node} for node in ("nose", "side")],
    }


def _top(
    name: str,
    inertia: Sequence[float],
    spin: Sequence[float],
    duration: float,
    mass: float = 1.0,
    centre: Sequence[float] = (0.0, 0.0, 0.0),
    gravity: Sequence[float] = (0.0, 0.0, 0.0),
    **more: Any,
) -> Case:
    middle = np.array(centre)
    about_pin = np.array(inertia) + mass * (middle @ middle - middle**2)  # the centre lies on a principal axis

    def places(t: Array) -> Array:
        turned = top(about_pin.tolist(), spin, duration, (mass * middle).tolist(), gravity)(t)
        return np.stack([turned @ _NODES["nose"], turned @ _NODES["side"]], axis=1)

    scene = spinning(spin, duration, inertia, mass, centre, gravity)
    return Case(name, scene, closed(places, "Euler's equations, DOP853 to 1e-13", 1e-10), **more)


def _tilted(degrees: float, g: float = 9.81) -> list[float]:
    """Weight against the z axis, tilted."""
    return [g * float(np.sin(np.radians(degrees))), 0.0, -g * float(np.cos(np.radians(degrees)))]


SLEEPING = {"inertia": (0.01, 0.01, 0.005), "mass": 1.0, "centre": (0.0, 0.0, 0.1)}
CRITICAL = 2 * np.sqrt(9.81 * 0.1 * (0.01 + 0.1**2)) / 0.005  # 2 √(m g s J₁) / J₃: below it a sleeping top falls

CASES = of_subject(
    "tops",
    [
        _top("free symmetric top", (0.03, 0.03, 0.05), (3.0, 0.0, 70.0), 0.5, fast=("erls", "ffr", "nodal")),
        _top("free body about its middle axis", (0.02, 0.03, 0.05), (1e-3, 8.0, 1e-3), 5.0, fast=("erls",)),
        _top("heavy top, fast", (0.02, 0.02, 0.03), (0.0, 0.0, 100.0), 2.0, 1.5, (0.0, 0.0, 0.15), _tilted(60.0)),
        _top(
            "heavy top, let go at rest", (0.02, 0.02, 0.03), (0.0, 0.0, 0.0), 3.0, 1.5, (0.0, 0.0, 0.15), _tilted(60.0)
        ),
        _top(
            "sleeping top above its critical spin",
            spin=(0.0, 0.0, 1.1 * CRITICAL),
            duration=5.0,
            gravity=_tilted(0.01),
            **SLEEPING,
        ),
        _top(
            "sleeping top below its critical spin",
            spin=(0.0, 0.0, 0.8 * CRITICAL),
            duration=3.0,
            gravity=_tilted(0.01),
            **SLEEPING,
        ),
        _top(
            "top of Bruels, Arnold and Cardona",
            (0.234375, 0.234375, 0.46875),
            (0.0, -4.61538, 150.0),
            2.0,
            15.0,
            (0.0, 0.0, 1.0),
            (0.0, -9.81, 0.0),
        ),
    ],
)

"""Scenes of contacts that tests vary."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scenes

import erls
from erls.run.chain.run import ChainRun
from erls.scene.read import load_scene

G, MASS, STIFFNESS = 9.81, 2.0, 1e7
BALL = {"mass": MASS, "inertia": [0.1, 0.1, 0.1], "points": {"centre": [0.0, 0.0, 0.0], "side": [1.0, 0.0, 0.0]}}


def simulated(path: Path, *changes: str, verdict: bool = False) -> ChainRun:
    """A run with changes of the scene."""
    run = erls.simulate(load_scene(path, list(changes)), verdict=verdict)
    assert isinstance(run, ChainRun)
    return run


def ball(restitution: float, position: float, rate: float, gravity: float, **more: Any) -> dict[str, Any]:
    """A body that moves along z above the ground."""
    start = {"position": position, "rate": rate}
    law = {"stiffness": STIFFNESS, "restitution": restitution}
    return {
        "gravity": [0.0, 0.0, -gravity],
        "simulation": {"duration": 1.0},
        "joints": [{"name": "fall", "type": "prismatic", "dh": {"convention": "standard"}, "initial": start}],
        "links": [{"name": "ball", "rigid": BALL}],
        "points": [{"name": "centre", "link": "ball", "node": "centre"}],
        "contacts": [{"name": "floor", "point": "centre", "plane": {"normal": [0.0, 0.0, 2.0]}, **law, **more}],
    }


def falling(folder: Path, restitution: float, position: float, rate: float, gravity: float, **more: Any) -> Path:
    """A file of it."""
    return scenes.write_toml(folder / "ball.toml", ball(restitution, position, rate, gravity, **more))


def on_a_slope(degrees: float, speed: float, friction: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """A block that moves down a slope at some speed, at the depth that bears it."""
    slope = np.radians(degrees)
    normal = np.array([np.sin(slope), 0.0, np.cos(slope)])
    start = -((MASS * G * np.cos(slope) / STIFFNESS) ** (1 / 1.5)) * normal
    rate = speed * np.array([np.cos(slope), 0.0, -np.sin(slope)])
    begins = (("x", float(start[0]), float(rate[0])), ("y", float(start[2]), float(rate[2])))
    coordinates = {name: {"initial": {"position": place, "rate": rate}} for name, place, rate in begins}
    law = {"stiffness": STIFFNESS, "restitution": 0.5, "friction": friction}
    data = {
        "gravity": [0.0, 0.0, -G],
        "simulation": {"duration": 0.5},
        "base": {"rotation_deg": [90.0, 0.0, 0.0]},
        "joints": [{"name": "free", "type": "planar", "dh": {"convention": "standard"}, "coordinates": coordinates}],
        "links": [{"name": "block", "rigid": BALL}],
        "points": [{"name": "centre", "link": "block", "node": "centre"}],
        "contacts": [{"name": "slope", "point": "centre", "plane": {"normal": normal.tolist()}, **law}],
    }
    return scenes.merged(data, changes)


def down_the_slope(degrees: float, speed: float, mu: float, t: Any) -> Any:
    """Way down of one that is pushed up, with Coulomb friction: it stays where it rests, unless tan α exceeds µ."""
    slope = np.radians(degrees)
    up, down = (G * (np.sin(slope) + sign * mu * np.cos(slope)) for sign in (1.0, -1.0))
    rests = -speed / up
    later = np.maximum(t - rests, 0.0)
    return np.where(t < rests, speed * t + up * t**2 / 2, speed * rests / 2 + max(down, 0.0) * later**2 / 2)


def two_bodies(folder: Path, **more: Any) -> Path:
    """A body of 2 kg that moves along x at 1 m/s towards one of 1 kg at rest, half a metre ahead."""
    slide = {"type": "prismatic", "dh": {"convention": "standard"}}
    first = {"name": "first", **slide, "branch": {"rotation_deg": [0.0, 90.0, 0.0]}, "initial": {"rate": 1.0}}
    second = {"name": "second", **slide, "initial": {"position": 0.5, "rate": -1.0}}
    plane = {"on": "b", "normal": [0.0, 0.0, -1.0], "position": [0.0, 0.0, -0.1]}
    return scenes.write_toml(
        folder / "two.toml",
        {
            "gravity": [0.0, 0.0, 0.0],
            "simulation": {"duration": 0.8},
            "joints": [first, second],
            "links": [{"name": "a", "rigid": BALL}, {"name": "b", "rigid": {**BALL, "mass": 1.0}}],
            "points": [{"name": x, "link": x, "node": "centre"} for x in "ab"],
            "contacts": [{"name": "bump", "point": "a", "plane": plane, "stiffness": 1e6, "restitution": 0.5, **more}],
        },
    )


def arm(**more: Any) -> dict[str, Any]:
    """A rigid arm of 1 m that turns about z at 1 rad/s; ``joint`` has more fields of its joint."""
    body = {"mass": 1.0, "centre_of_mass": [0.5, 0.0, 0.0], "inertia": [0.01, 0.1, 0.1]}
    joint = {"name": "hinge", "dh": {"convention": "standard"}, "initial": {"rate": 1.0}}
    return {
        "gravity": [0.0, 0.0, 0.0],
        "simulation": {"duration": 0.6},
        "links": [{"name": "arm", "rigid": {**body, "points": {"root": [0, 0, 0], "tip": [1.0, 0.0, 0.0]}}}],
        "points": [{"name": "tip", "link": "arm", "node": "tip"}],
        "joints": [{**joint, **more.pop("joint", {})}],
        **more,
    }


def pendulum(folder: Path, **more: Any) -> Path:
    """A file of it."""
    return scenes.write_toml(folder / "pendulum.toml", arm(**more))


def falling_arm(**changes: Any) -> dict[str, Any]:
    """A flexible arm that falls about a hinge, its tip onto a plane; its link is `scenes.ARM_LINK`."""
    contact = {"name": "floor", "point": "tip", "plane": {"normal": [0.0, 0.0, 1.0], "position": [0.0, 0.0, 0.05]}}
    data = {
        "simulation": {"duration": 0.12},
        "base": {"rotation_deg": [-90.0, 0.0, 0.0]},
        "joints": [{"name": "hinge", "dh": {"convention": "standard", "alpha_deg": 90.0}}],
        "links": [{"name": "a", **scenes.ARM}],
        "points": [{"name": "tip", "link": "a", "node": "tip"}],
        "contacts": [{**contact, "stiffness": 2e3, "restitution": 0.8, "exponent": 1.0}],
    }
    return scenes.merged(data, changes)


def flexible(folder: Path, **changes: Any) -> Path:
    """A file of it, beside its link."""
    scenes.arm_link(folder)
    return scenes.write_toml(folder / "scene.toml", falling_arm(**changes))

"""Motors that come to their limits: when they do is located, in every integrator, in trees and in closed loops."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
import pytest
import scenes
from random_scenes import random_scene
from scipy.optimize import brentq
from test_sticking import TIGHT, switches
from test_sticking_loops import INERTIA, LEVEL, parallelogram, pin, run_scene

import erls
from erls.accuracy.energy_balance import energy_balance
from erls.accuracy.looked_at import LookedAt
from erls.errors import SceneError
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun

GAIN, RATE_GAIN, LIMIT, GOAL, END = 40.0, 0.8, 0.5, 0.3, 1.5


class Piece(NamedTuple):
    """A stretch of J ẍ = torque: since when, and x less its goal and the rate so much later."""

    start: float
    move: Callable[[float], tuple[float, float]]


def bang_bang(inertia: float, start: float) -> list[Piece]:
    """Parabolas at the limit, damped vibrations between: each ends where the other torque would begin."""
    found: list[Piece] = []
    t, x, v = 0.0, start, 0.0
    omega = math.sqrt(GAIN / inertia - (RATE_GAIN / 2 / inertia) ** 2)
    decay, mode = RATE_GAIN / 2 / inertia, math.copysign(1.0, -start)
    assert abs(GAIN * start) > LIMIT
    while t < END:

        def move(s: float, x: float = x, v: float = v, push: float = mode * LIMIT / inertia) -> tuple[float, float]:
            if push:
                return x + v * s + push * s * s / 2, v + push * s
            c, n, e = math.cos(omega * s), math.sin(omega * s) / omega, math.exp(-decay * s)
            return e * (x * c + (v + decay * x) * n), e * (v * c - (GAIN / inertia * x + decay * v) * n)

        def left(s: float, move: Any = move, mode: float = mode) -> float:
            x, v = move(s)
            asked = -GAIN * x - RATE_GAIN * v
            return mode * asked - LIMIT if mode else LIMIT - abs(asked)

        found.append(Piece(t, move))
        times = np.linspace(1e-6, END, 4001)
        beyond = np.flatnonzero(np.array([left(s) for s in times.tolist()]) < 0)
        if not len(beyond):
            break
        later = float(brentq(left, times[beyond[0] - 1], times[beyond[0]], xtol=1e-14))
        x, v = move(later)
        t, mode = t + later, 0.0 if mode else math.copysign(1.0, -GAIN * x - RATE_GAIN * v)
    return found


def places(pieces: list[Piece], times: Array) -> Array:
    """(k,) x less its goal."""
    return np.array([max(p for p in pieces if p.start <= t).move(t - max(p.start for p in pieces if p.start <= t))[0]
                     for t in times.tolist()])  # fmt: skip


DRIVE = {
    "type": "pd",
    "motion": {"shape": "table", "times": [-1.0, 9.0, 10.0, 11.0], "values": [GOAL] * 4},
    "proportional_gain": GAIN,
    "derivative_gain": RATE_GAIN,
    "torque_limit": LIMIT,
}
ROD = {"mass": 0.9, "centre_of_mass": [0.25, 0.0, 0.0], "inertia": [0.0, 0.02, 0.02]}


@pytest.mark.parametrize("integrator", TIGHT)
def test_arm_under_its_limit(integrator: str, tmp_path: Path) -> None:
    """Places to 1e-6 m, switches to 1e-6 s, and the stated error holds."""
    finer = {"step": 1e-4} if integrator == "generalized_alpha" else {}
    link = {"name": "arm", "rigid": {**ROD, "points": {"root": [0.0] * 3, "tip": [0.5, 0.0, 0.0]}}}
    data = {
        "gravity": [0.0] * 3,
        "simulation": {"duration": END, "integrator": integrator, **TIGHT[integrator], **finer},
        "joints": [{"name": "hub", "dh": {"convention": "modified"}, "drive": DRIVE}],
        "links": [{**link, "mesh_pose": {"frame": "joint"}}],
        "points": [{"name": "end", "link": "arm", "node": "tip"}],
    }
    run = run_scene(tmp_path, data)
    pieces = bang_bang(0.02 + 0.9 * 0.25**2, -GOAL)
    times = np.linspace(0.0, END, 151)
    angles = GOAL + places(pieces, times)
    off = float(np.abs(run.joint_coordinate("hub", times) - angles).max())
    assert off < 1e-6
    assert run.accuracy is not None
    assert run.accuracy.integration is not None
    assert 0.5 * off <= run.accuracy.integration
    expected = [piece.start for piece in pieces[1:]]
    assert len(expected) >= 4
    assert switches(run) == pytest.approx(expected, abs=1e-6)
    middle = [(a.start + b.start) / 2 for a, b in pairwise(pieces)]
    efforts = np.abs(run.joint_effort("hub", np.array(middle)))
    assert efforts[::2] == pytest.approx(LIMIT, rel=1e-12)  # parabolas and vibrations take turns
    assert (efforts[1::2] < LIMIT).all()
    assert not any("reaches its limit" in text for text in run.warnings)


@pytest.mark.parametrize(("formulation", "where"), [("erls", "crank"), ("ffr", "closing")])
def test_linkage_under_its_limit(formulation: str, where: str, tmp_path: Path) -> None:
    """A motor on the ground, in the tree or where it closes, of a linkage with one coordinate."""
    start = LEVEL - GOAL
    drive = {**DRIVE, "motion": {**DRIVE["motion"], "values": [LEVEL if where == "crank" else GOAL] * 4}}
    crank, closing = ({"drive": drive}, {}) if where == "crank" else ({}, {"drive": drive})
    settings = {"duration": END, "formulation": formulation, "integrator": "lobatto", "tolerance": 1e-6}
    run = run_scene(tmp_path, {**parallelogram(crank, {}, closing, start), "simulation": settings})
    pieces = bang_bang(INERTIA, -GOAL)
    times = np.linspace(0.0, END, 101)
    assert np.abs(run.position("pin", times) - pin(LEVEL + places(pieces, times))).max() < 1e-6
    assert switches(run) == pytest.approx([piece.start for piece in pieces[1:]], abs=1e-6)


def test_nodal_switches_start_no_vibrations(tmp_path: Path) -> None:
    """Steps that do not resolve the vibrations of light elements see accelerations as they are resolved: those of the
    elements would have grown with every switch, to a thousand times the energy that there is.
    """
    runs = {}
    for formulation in ("erls", "nodal"):
        scene = random_scene(478).changed({"formulation": formulation, "duration": 0.11})
        runs[formulation] = cast(ChainRun, erls.simulate(erls.load_scene(scene.write(tmp_path)), verdict=False))
        assert len(switches(runs[formulation])) >= 1
    nodal, times = runs["nodal"], np.linspace(0.0, 0.11, 23)
    energies = [nodal.energy(t) for t in nodal.times.tolist()]
    assert max(e.kinetic + e.elastic for e in energies) < 1.2e-4  # 5.8e-5 J at the start, and what motors and weight do
    apart = np.linalg.norm(nodal.position("end 1", times) - runs["erls"].position("end 1", times), axis=1).max()
    assert apart < 2e-3  # of 2e-2 m moved: one mode in the other


def test_flexible_arm_under_its_limit(tmp_path: Path) -> None:
    """Vibrations decide when: ERLS and FFR, and equal steps, against a run at a tenth of the tolerance."""
    scenes.arm_link(tmp_path, damping={"ratio": 0.002})
    motion = {"shape": "polynomial", "from": 0.0, "to": 1.5, "duration": 0.2}
    gains = {"proportional_gain": 60.0, "derivative_gain": 2.0, "torque_limit": 1.5}
    drive = {"type": "pd", "motion": motion, **gains, "feed_forward": True}
    data = {
        "gravity": [0.0] * 3,
        "joints": [{"name": "hub", "dh": {"convention": "modified"}, "drive": drive}],
        "links": [{"name": "arm", **scenes.ARM, "mesh_pose": {"frame": "joint"}}],
        "points": [{"name": "end", "link": "arm", "node": "tip"}],
    }
    changes: dict[str, dict[str, Any]] = {
        "judge": {"tolerance": 1e-7},
        "erls": {"tolerance": 1e-6},
        "ffr": {"tolerance": 1e-6, "formulation": "ffr"},
        "equal": {"integrator": "generalized_alpha", "step": 1e-3},
    }
    times, ends = np.linspace(0.0, 0.24, 49), {}
    for name, change in changes.items():
        settings = {"duration": 0.24, "integrator": "lobatto", **change}
        run = run_scene(tmp_path, {**data, "simulation": settings}, name == "equal")
        ends[name] = run.position("end", times)
        if name == "erls":
            balance = energy_balance(LookedAt(run))
            assert balance is not None
            assert abs(balance.off) < 1e-6 * balance.exchanged
    assert len(switches(run)) >= 3
    off = {name: float(np.abs(x - ends["judge"]).max()) for name, x in ends.items()}
    assert off["erls"] < 1e-6  # the tolerance
    assert off["ffr"] < 1e-6
    assert run.accuracy is not None
    assert run.accuracy.integration is not None
    assert off["equal"] <= run.accuracy.integration


@pytest.mark.parametrize("settings", [{"integrator": "lobatto"}, {"formulation": "nodal", "step": 5e-3}])
def test_derivatives_of_motors_at_their_limits_are_refused(settings: dict[str, Any], tmp_path: Path) -> None:
    """By name where limits are reached; a larger one is differentiated."""
    link = {"name": "arm", "rigid": {**ROD, "points": {"root": [0.0] * 3, "tip": [0.5, 0.0, 0.0]}}}
    data: dict[str, Any] = {
        "gravity": [0.0] * 3,
        "simulation": {"duration": 0.6, **settings},
        "joints": [{"name": "hub", "dh": {"convention": "modified"}, "drive": DRIVE}],
        "links": [{**link, "mesh_pose": {"frame": "joint"}}],
        "points": [{"name": "end", "link": "arm", "node": "tip"}],
    }
    asked = {"end": lambda run: run.position("end", 0.5)}, ["joints.hub.drive.proportional_gain"]
    path = scenes.write_toml(tmp_path / "scene.toml", data)
    with pytest.raises(SceneError, match="motors come to their limits") as caught:
        erls.sensitivities(erls.load_scene(path), *asked)
    assert caught.value.where.endswith("torque_limit")
    data["joints"][0]["drive"] = {**DRIVE, "torque_limit": 100.0}
    found = erls.sensitivities(erls.load_scene(scenes.write_toml(path, data)), *asked)
    assert np.abs(found.derivatives["end"]["joints.hub.drive.proportional_gain"]).max() > 1e-4

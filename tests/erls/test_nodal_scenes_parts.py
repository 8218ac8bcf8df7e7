"""Scenes of bodies part by part: beams, arcs, connections, loads and their factors against closed forms."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
import scenes
from body_scenes_data import PENDULUM, STRIP, body_scene

from erls import simulate
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.rest import BodyRest
from erls.scene.bodies import analyses, schema
from erls.scene.read import load_scene

EI_Y, EI_Z = 1e6 * 0.1 * 0.02**3 / 12, 1e6 * 0.02 * 0.1**3 / 12
GA = 5e5 * 0.1 * 0.02 * 5 / 6


def _rest(folder: Path, base: dict[str, Any] = STRIP, **changes: Any) -> BodyRest:
    found = simulate(body_scene(folder, base, **changes))
    assert isinstance(found, BodyRest)
    return found


def _moving(folder: Path, base: dict[str, Any] = PENDULUM, **changes: Any) -> BodyMotion:
    found = simulate(body_scene(folder, base, **changes))
    assert isinstance(found, BodyMotion)
    return found


@pytest.mark.parametrize(("height", "bending"), [([0, 0, 1], EI_Y), ([0, 1, 0], EI_Z)])
def test_cantilever(tmp_path: Path, height: list[int], bending: float) -> None:
    """P L³/(3EI) less what eight constant curvatures miss, and P L/(kGA); the height decides which bending."""
    beam = {**STRIP["beams"][0], "local_z": height}
    moved = _rest(tmp_path, beams=[beam], loads=[{"node": "tip", "force": [0.0, 0.0, 1e-5]}]).position("tip", 1.0)[2]
    assert moved == pytest.approx(1e-5 * (8 / (3 * bending) * (1 - 1 / (4 * 64)) + 2 / GA), rel=1e-5)


@pytest.mark.parametrize(("force", "axis", "arm"), [([1, 0, 0], 0, np.pi / 4), ([0, 1, 0], 1, 3 * np.pi / 4 - 2)])
@pytest.mark.parametrize("chords", [False, True])
def test_quarter_arc(tmp_path: Path, force: list[int], axis: int, arm: float, chords: bool) -> None:
    """A clamped quarter circle of radius 2: Castigliano's P R³/(EI) times π/4 or 3π/4 − 2, within the mesh's 1 %."""
    beam = {**STRIP["beams"][0], "through": [2**0.5, 2 - 2**0.5, 0], "chords": chords, "elements": 16}
    nodes = {"root": [0.0, 0.0, 0.0], "tip": [2.0, 2.0, 0.0]}
    load = {"node": "tip", "force": (1e-3 * np.array(force)).tolist()}
    found = _rest(tmp_path, nodes=nodes, beams=[beam], loads=[load])
    start = [2.0, 2.0, 0.0][axis]
    bend = 1e-3 * 8 / EI_Z * arm
    assert found.position("tip", 1.0)[axis] - start == pytest.approx(bend, rel=0.01)
    middle = found.assembly.system.start.poses[found.assembly.numbers["strip/8"], :3, 3]
    np.testing.assert_allclose(middle, [np.sqrt(2), 2 - np.sqrt(2), 0], atol=1e-14)


def test_dead_and_follower_loads(tmp_path: Path) -> None:
    """A moment bends a cantilever to a right angle; a force along its end then pushes along y or along x."""
    moment = {"node": "tip", "moment": [0.0, 0.0, np.pi / 2 * EI_Z / 2], "follower": True}
    pushes = []
    for follower in (False, True):
        force = {"node": "tip", "force": [1e-9, 0.0, 0.0], "follower": follower}
        found = _rest(tmp_path, loads=[moment, force], simulation={"load_steps": 4, "tangent": "material"})
        np.testing.assert_allclose(found.position("tip", 1.0), [4 / np.pi, 4 / np.pi, 0], atol=1e-6)
        pushes.append(found.summary()["samples"][-1]["connections"]["clamp"]["force"])
    np.testing.assert_allclose(pushes, [[-1e-9, 0, 0], [0, -1e-9, 0]], atol=1e-13)


def test_factors_over_the_load_parameter(tmp_path: Path) -> None:
    """A table over the load parameter: up, and down to zero again."""
    factor = [{"shape": "table", "times": [0.0, 0.5, 1.0], "values": [0.0, 1.0, 0.0]}]
    loads = [{**STRIP["loads"][0], "factor": factor}]
    found = _rest(tmp_path, loads=loads, simulation={"load_steps": 2})
    whole = _rest(tmp_path).position("tip", 1.0)
    np.testing.assert_allclose([found.position("tip", 0.5), found.position("tip", 1.0)], [whole, [2, 0, 0]], atol=1e-13)


def test_weight_of_beams_and_masses(tmp_path: Path) -> None:
    """The clamp carries ρ A L g and the mass at the tip."""
    found = _rest(tmp_path, loads=[], gravity=[0, 0, -1e-3], masses=[{"node": "tip", "mass": 3.0}])
    clamp = found.summary()["samples"][0]["connections"]["clamp"]
    np.testing.assert_allclose(clamp["force"], [0, 0, 1e-3 * (1000 * 0.002 * 2 + 3)], atol=1e-12)


def test_a_prescribed_turn_carries_a_beam(tmp_path: Path) -> None:
    """Statics: the root turns by 90° over the load parameter, and an unloaded beam with it."""
    root = {"name": "hinge", "type": "revolute", "node": "root", "axis": [0, 0, 1]}
    turn = {"shape": "polynomial", "from_deg": 0.0, "to_deg": 90.0, "duration": 1.0}
    found = _rest(tmp_path, loads=[], connections=[{**root, "motion": turn}], simulation={"load_steps": 4})
    np.testing.assert_allclose(found.position("tip", 1.0), [0, 2, 0], atol=1e-9)


def test_free_body(tmp_path: Path) -> None:
    """Without connections: a thrown body turns about its centre of mass, which falls on a parabola."""
    body = {**PENDULUM["bodies"][0], "inertia": [0.2, 0.2, 0.2], "centre_of_mass": [0.5, 0.0, 0.0],
            "velocity": [1.0, -10.0 * 0.5, 2.0], "angular_velocity": [0.0, 0.0, 10.0]}  # fmt: skip
    for group in ("SE(3)", "R3xSO(3)"):
        found = _moving(tmp_path, bodies=[body], connections=[], simulation={"group": group})
        centre = np.array([1.5 + 0.2, 0.0, 2 * 0.2 - 9.81 * 0.2**2 / 2])
        frame = centre - 0.5 * np.array([np.cos(2.0), np.sin(2.0), 0.0])
        np.testing.assert_allclose(found.position("bob", 0.2), frame, atol=2e-4)


def test_pendulum(tmp_path: Path) -> None:
    """Energy: θ̇²/2 (J + m) = m g sin θ below the start; the pin carries the weight and what turns."""
    found = _moving(tmp_path)
    x, _, z = found.position("bob", 0.2)
    speed = (found.position("bob", 0.2) - found.position("bob", 0.1999)) / 1e-4
    assert np.hypot(x, z) == pytest.approx(1.0, abs=1e-10)
    rate2 = 2 * 2.0 * 9.81 * -z / (0.2 + 2.0)
    assert speed @ speed == pytest.approx(rate2, rel=2e-3)
    force = np.array(found.summary([0.2])["samples"][0]["connections"]["pin"]["force"])
    assert force @ np.array([x, 0, z]) == pytest.approx(-2.0 * rate2 + 2.0 * 9.81 * z, rel=1e-4)


CONNECTIONS = [
    ({"type": "prismatic", "axis": [0, 0, 1]}, {}, [1.0, 0.0, -9.81 * 0.02]),
    ({"type": "prismatic", "axis": [1, 0, 1]}, {}, [1 - 9.81 * 0.01, 0.0, -9.81 * 0.01]),
    ({"type": "cylindrical", "axis": [0, 0, 1], "position": [1, 0, 0]}, {"angular_velocity": [0, 0, 5]},
     [1.0, 0.0, -9.81 * 0.02]),
    ({"type": "fixed"}, {}, [1.0, 0.0, 0.0]),
    ({"type": "revolute", "axis": [0, 0, 1], "position": [0, 0, 0]},
     {"angular_velocity": [0, 0, 5], "velocity": [0, 5, 0]}, [np.cos(1.0), np.sin(1.0), 0.0]),
    ({"type": "universal", "axis": [1, 0, 0], "second_axis": [0, 0, 1], "position": [0, 0, 0]},
     {"angular_velocity": [0, 0, 5], "velocity": [0, 5, 0]}, [np.cos(1.0), np.sin(1.0), None]),
    ({"type": "prismatic", "axis": [0, 1, 0],
      "motion": {"shape": "polynomial", "from": 0.0, "to": 0.3, "duration": 0.15}}, {}, [1.0, 0.3, 0.0]),
]  # fmt: skip


@pytest.mark.parametrize(("connection", "body", "place"), CONNECTIONS)
def test_connections(tmp_path: Path, connection: dict[str, Any], body: dict[str, Any], place: list[Any]) -> None:
    """Where a body is after 0.2 s: it slides, spins, turns, or goes where it must."""
    gravity = [0.0, 0.0, 0.0] if connection["type"] == "universal" else [0.0, 0.0, -9.81]
    bodies = [{**PENDULUM["bodies"][0], **body}]
    found = _moving(tmp_path, bodies=bodies, gravity=gravity, connections=[{"name": "j", "node": "bob", **connection}])
    end = found.position("bob", 0.2)
    for k, expected in enumerate(place):
        if expected is not None:
            assert end[k] == pytest.approx(expected, abs=2e-4)


def test_two_nodes_in_one_place_are_hinged(tmp_path: Path) -> None:
    """A beam between two hinges carries no moment: the tip of a hinged pair falls onto a second support."""
    beams = [
        {**STRIP["beams"][0], "name": "a", "to": "left"},
        {**STRIP["beams"][0], "name": "b", "from": "right"},
    ]
    nodes = {"root": [0.0, 0, 0], "left": [1.0, 0, 0], "right": [1.0, 0, 0], "tip": [2.0, 0, 0]}
    connections = [
        {"name": "clamp", "type": "fixed", "node": "root"},
        {"name": "hinge", "type": "revolute", "node": "right", "to": "left", "axis": [0, 1, 0]},
        {"name": "support", "type": "prismatic", "node": "tip", "axis": [1, 0, 0]},
    ]
    loads = [{"node": "left", "force": [0.0, 0.0, 1e-3]}]
    found = _rest(tmp_path, nodes=nodes, beams=beams, connections=connections, loads=loads)
    wrenches = found.summary()["samples"][0]["connections"]
    assert abs(wrenches["hinge"]["moment"][1]) < 1e-12
    assert wrenches["clamp"]["force"][2] + wrenches["support"]["force"][2] == pytest.approx(-1e-3, rel=1e-9)
    stiffness = np.array([3 * EI_Y / 1.0, 3 * EI_Y / 1.0])  # a cantilever, and one whose tip is clamped
    share = wrenches["clamp"]["force"][2] / -1e-3
    assert share == pytest.approx(stiffness[0] / stiffness.sum(), rel=1e-6)


def test_the_scene_of_the_documentation_shows_every_field(tmp_path: Path) -> None:
    """It runs as printed, for a while; with the fields that it shows as comments none of the schema is missing."""
    text = (scenes.ROOT / "docs" / "bodies.md").read_text(encoding="utf-8")
    (block,) = (b for b in re.findall(r"```toml\n(.*?)```", text, re.DOTALL) if 'name = "door on a beam"' in b)
    path = tmp_path / "door.toml"
    path.write_text(block, encoding="utf-8")
    found = simulate(load_scene(path, ["simulation.duration=0.02"]))
    assert isinstance(found, BodyMotion)
    assert found.end == 0.02
    records = (schema.BodySceneRecord, schema.Body, schema.Beam, schema.PointMass, schema.Connection, schema.LineSpring,
               schema.TurningSpring, schema.Load, *get_args(analyses.Analysis))  # fmt: skip
    for record in records:
        for name in record.__struct_encode_fields__:
            assert re.search(rf"\b{name}\b", block), f"{record.__name__}.{name}"

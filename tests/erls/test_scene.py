"""Scene files: defaults, ``--set`` overrides, unknown keys at every depth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import scenes

from erls.errors import Cause, SceneError
from erls.mechanism.drives import FreeDrive, TorqueDrive
from erls.scene.chain import Scene
from erls.scene.read import load_scene

DATA = scenes.shipped()


def test_defaults(tmp_path: Path) -> None:
    """What a scene says when it says nothing."""
    data = {**scenes.L_SCENE, "simulation": {"duration": 1}}
    del data["base"], data["points"]
    scene = load_scene(scenes.write_toml(tmp_path / "small.toml", data))
    record, simulation, joint, link = (
        scene.record,
        scene.record.simulation,
        scene.record.joints[0],
        scene.record.links[0],
    )
    assert (scene.name, scene.folder, record.name) == ("small", tmp_path, "")
    assert (simulation.duration, simulation.step, simulation.rtol, simulation.atol) == (1.0, None, 1e-8, 1e-12)
    assert (simulation.formulation, simulation.gauge) == ("erls", "joint-angle")
    assert (simulation.integrator, simulation.spectral_radius) == ("auto", 0.8)
    assert record.gravity == (0.0, 0.0, -9.81)
    assert record.base.position == record.base.rotation_deg == (0.0, 0.0, 0.0)
    assert (record.points, record.payloads, record.initial.deformation) == ([], [], "zero")
    assert (joint.type, joint.drive, joint.friction) == ("revolute", FreeDrive(), None)
    assert (joint.stiffness, joint.damping, joint.rest, joint.rest_deg) == (0.0, 0.0, None, None)
    assert (joint.motor.gear_ratio, joint.motor.rotor_inertia, joint.motor.mass) == (1.0, 0.0, 0.0)
    assert (link.flexible, link.elastic_modes, link.damping) == (True, None, None)
    assert (link.mesh_pose.frame, link.inboard, link.outboard) == ("dh", "", "")


@pytest.mark.parametrize("path", DATA, ids=lambda p: p.stem)
def test_scenes_of_the_repository_load(path: Path) -> None:
    """Each scene that a new user runs first."""
    scene = load_scene(path)
    assert isinstance(scene, Scene)
    assert scene.record.points


@pytest.fixture
def two(tmp_path: Path) -> Path:
    """Two joints, the second one named like a number that is not its own."""
    drive = {"type": "torque", "profiles": [{"shape": "constant", "value": 1.0}]}
    data: dict[str, Any] = {
        "simulation": {"duration": 1.0},
        "joints": [
            {"name": "shoulder", "dh": {"convention": "standard"}, "drive": drive},
            {"name": "0", "dh": {"convention": "modified"}},
        ],
        "links": [{"name": "arm", "model": "arm.toml"}, {"name": "hand", "model": "arm.toml"}],
        "points": [{"name": "tip", "link": "hand", "node": "tip"}],
    }
    return scenes.write_toml(tmp_path / "two.toml", data)


SET: list[tuple[str, Any, Any]] = [
    ("simulation.step=1e-4", lambda r: r.simulation.step, 1e-4),
    (" simulation.step = 1e-4 ", lambda r: r.simulation.step, 1e-4),
    ("simulation.duration=3", lambda r: r.simulation.duration, 3.0),
    ("simulation.integrator=radau", lambda r: r.simulation.integrator, "radau"),
    ('simulation.integrator="bdf"', lambda r: r.simulation.integrator, "bdf"),
    ("simulation.integrator='bdf'", lambda r: r.simulation.integrator, "bdf"),
    ("name=a = b", lambda r: r.name, "a = b"),
    ("name=", lambda r: r.name, ""),
    ("gravity=[0, 0.0, 9]", lambda r: r.gravity, (0.0, 0.0, 9.0)),
    ("gravity.2=-1.6", lambda r: r.gravity, (0.0, 0.0, -1.6)),
    ("links.hand.elastic_modes=8", lambda r: r.links[1].elastic_modes, 8),
    ("links.1.elastic_modes=8", lambda r: r.links[1].elastic_modes, 8),
    ("links.arm.flexible=false", lambda r: r.links[0].flexible, False),
    ("joints.1.damping=0.5", lambda r: r.joints[1].damping, 0.5),
    ("joints.0.damping=0.5", lambda r: r.joints[1].damping, 0.5),  # a name goes before a number
    ("joints.0.initial.position_deg=30", lambda r: r.joints[1].initial.position_deg, 30.0),
    ("base.rotation_deg=[1,2,3]", lambda r: r.base.rotation_deg, (1.0, 2.0, 3.0)),
    ("links.arm.damping.rayleigh.beta=1e-5", lambda r: r.links[0].damping.rayleigh.beta, 1e-5),
    ("links.arm.damping={ratio=0.01}", lambda r: r.links[0].damping.ratio, 0.01),
    ("joints.shoulder.drive.profiles.0.value=2.5", lambda r: r.joints[0].drive.profiles[0].value, 2.5),
    ("joints.shoulder.drive={type='free'}", lambda r: r.joints[0].drive, FreeDrive()),
    ("joints.1.drive.type=free", lambda r: r.joints[1].drive, FreeDrive()),
    ("points=[]", lambda r: r.points, []),
    ("payloads=[{point='tip', mass=2}]", lambda r: r.payloads[0].mass, 2.0),
]


@pytest.mark.parametrize(("text", "get", "expected"), SET, ids=[s[0] for s in SET])
def test_set(two: Path, text: str, get: Any, expected: Any) -> None:
    """Names and numbers of list members, tables that the file does not have, every kind of value."""
    if text.startswith(("joints.1.", "gravity.2")):  # a list that the file must have
        data = scenes.read_toml(two)
        data["joints"][1]["name"], data["gravity"] = "wrist", [0.0, 0.0, -9.81]
        scenes.write_toml(two, data)
    assert get(load_scene(two, [text]).record) == expected


def test_set_leaves_the_rest_alone_and_the_last_one_wins(two: Path) -> None:
    """Several overrides of one table."""
    plain, changed = load_scene(two), load_scene(two, ["simulation.step=1e-3", "name=x", "simulation.step=1e-4"])
    assert (changed.record.simulation.step, changed.record.simulation.duration, changed.name) == (1e-4, 1.0, "x")
    assert changed.record.joints == plain.record.joints
    assert isinstance(plain.record.joints[0].drive, TorqueDrive)


FAULTY_SET = [
    ("simulation.step", Cause.BAD_FIELD, "--set simulation.step", "KEY=VALUE"),
    ("=1", Cause.BAD_FIELD, "--set =1", "KEY=VALUE"),
    ("simulation..step=1", Cause.BAD_FIELD, "--set simulation..step=1", "KEY=VALUE"),
    ("", Cause.BAD_FIELD, "--set", "KEY=VALUE"),
    ("links.leg.flexible=false", Cause.BAD_REFERENCE, "--set links.leg.flexible=false", "arm, hand"),
    ("links.2.flexible=false", Cause.BAD_REFERENCE, "--set links.2.flexible=false", "0, 1, arm"),
    ("links.-1.flexible=false", Cause.BAD_REFERENCE, "--set links.-1.flexible=false", "known"),
    ("links.².flexible=false", Cause.BAD_REFERENCE, "--set links.².flexible=false", "known"),
    ("points.0.0.name=a", Cause.UNKNOWN_FIELD, "two.toml: points[0].0", "known fields"),
    ("simulation.duration.x=1", Cause.BAD_FIELD, "--set simulation.duration.x=1", "not inside a table"),
    ("simulation.duratoin=1", Cause.UNKNOWN_FIELD, "two.toml: simulation.duratoin", "'duration'"),
    ("simulation.duration=long", Cause.BAD_FIELD, "two.toml: simulation.duration", "give a number"),
    ("simulation.duration=" + "9" * 5000, Cause.BAD_FIELD, "two.toml: simulation.duration", "give"),
    ("simulation.duration=" + "[" * 5000, Cause.BAD_FIELD, "two.toml: simulation.duration", "give a number"),
    ("simulation.duration=1\nother = 2", Cause.BAD_FIELD, "two.toml: simulation.duration", "give a number"),
    ("simulation.step=0", Cause.BAD_FIELD, "two.toml: simulation.step", "above 0"),
    ("links.arm.flexible=0", Cause.BAD_FIELD, "two.toml: links[0].flexible", "true or false"),
    ("joints=5", Cause.BAD_FIELD, "two.toml: joints", "list"),
    ("joints.shoulder.drive.type=free", Cause.UNKNOWN_FIELD, "joints[0].drive.profiles", "drive = { type = 'free' }"),
    ("joints.shoulder.dh={a=0.5}", Cause.BAD_FIELD, "joints[0].dh", "add convention = ... (`standard`: Rz"),
]


@pytest.mark.parametrize(("text", "cause", "where", "words"), FAULTY_SET, ids=[f[0][:40] for f in FAULTY_SET])
def test_faulty_set(two: Path, text: str, cause: Cause, where: str, words: str) -> None:
    """An override that cannot be applied names itself; one that makes the scene faulty names the field."""
    with pytest.raises(SceneError) as caught:
        load_scene(two, [text])
    error = caught.value
    assert error.cause == cause
    assert where in error.where
    assert words in str(error)
    assert error.remedy


UNKNOWN = [
    ({"gravty": [0, 0, 0]}, "gravty", "'gravity'"),
    ({"simulation": {"duration": 1.0, "steps": 1}}, "simulation.steps", "'step'"),
    ({"joints": [{"name": "a", "dh": {"convention": "standard", "alfa": 1.0}}]}, "joints[0].dh.alfa", "'alpha'"),
    (
        {"joints": [{"name": "a", "dh": {"convention": "standard"}, "initial": {"positoin": 1.0}}]},
        "joints[0].initial.positoin",
        "'position'",
    ),
    (
        {"joints": [{"name": "a", "dh": {"convention": "standard"}, "friction": {"force": 1.0, "rate": 1.0}}]},
        "joints[0].friction.rate",
        "transition_rate",
    ),
    ({"links": [{"name": "l", "modalfile": "x"}]}, "links[0].modalfile", "'modal_file'"),
    ({"links": [{"name": "l", "damping": {"rayleigh": {"bta": 1.0}}}]}, "links[0].damping.rayleigh.bta", "'beta'"),
    ({"links": [{"name": "l", "rigid": {"mass": 1.0, "points": {}, "com": [0, 0, 0]}}]}, "links[0].rigid.com", "mass"),
    ({"points": [{"name": "p", "link": "l", "nod": "x"}]}, "points[0].nod", "'node'"),
    ({"payloads": [{"point": "p"}, {"point": "p", "weight": 1.0}]}, "payloads[1].weight", "known fields"),
    ({"base": {"rotation": [0, 0, 0]}}, "base.rotation", "'rotation_deg'"),
]


@pytest.mark.parametrize(("changes", "field", "words"), UNKNOWN, ids=[u[1] for u in UNKNOWN])
def test_unknown_keys_get_a_suggestion(tmp_path: Path, changes: dict[str, Any], field: str, words: str) -> None:
    """At every depth: file, path of the key, and the field that was probably meant or those there are."""
    path = scenes.write_toml(tmp_path / "s.toml", {**scenes.L_SCENE, **changes})
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    assert caught.value.cause == Cause.UNKNOWN_FIELD
    assert caught.value.where == f"{path}: {field}"
    assert words in caught.value.remedy

"""Screw joints in chains, loops, absolute coordinates, nodes and scenes of bodies: a nut that falls along its thread,
energy of flexible links on one, prescribed turns, what a scene may say of its pitch.

The value of the condition, its gradient and its second derivative far from closed joints are checked with those of the
other joints: `test_nodal_system`, `test_loops_flexible`, by complex steps in `test_any_scalar`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.errors import Cause, SceneError
from erls.maths import rotation_maps as rotations
from erls.maths import screws
from erls.maths.jit import plain
from erls.maths.so3 import Array
from erls.mechanism.joint_types import JOINT_TYPES, Freedom, Z, single

MASS, INERTIA, PITCH, GRAVITY = 2.0, 0.01, 0.1, 9.81
FALL = -MASS * GRAVITY * PITCH / (INERTIA + MASS * PITCH**2)
"""What a thread along the vertical makes of the weight [rad/s²]: (J + m h²) θ̈ = -m g h."""
END = 1.5
TIMES = np.linspace(0.0, END, 31)
FORMS: dict[str, tuple[str, ...]] = {
    "erls": ("formulation=erls",),
    "ffr": ("formulation=ffr",),
    "absolute": ("formulation=ffr", "coordinates=absolute"),
    "nodal": ("formulation=nodal",),
}
IN_LOOPS = [name for name in FORMS if name != "absolute"]
TURNED = 40.0
MOTION = {"shape": "polynomial", "degree": 7, "from": 0.0, "to": TURNED, "start": 0.0, "duration": END}
DRIVE = {"type": "motion", "motion": MOTION}
ROUNDING = 1e-9
"""Of the angle: constant accelerations are met by steps of second order exactly; what iterations may leave adds up."""


def _body(mass: float, inertia: float) -> dict[str, Any]:
    points = {"root": [0.0, 0.0, 0.0], "rim": [0.2, 0.1, 0.05]}
    return {"mass": mass, "inertia": [inertia] * 3, "points": points}


def _joint(name: str, kind: str, **more: Any) -> dict[str, Any]:
    return {"name": name, "type": kind, "dh": {"convention": "standard"}, **more}


def _chain(joints: list[dict[str, Any]], links: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    points = [{"name": "rim", "link": "nut", "node": "rim"}] if links[-1]["name"] == "nut" else []
    simulation = {"duration": END, "step": 0.025}
    return {"simulation": simulation, "joints": joints, "links": links, "points": points, **more}


def _run(folder: Path, data: dict[str, Any], *changes: str) -> Any:
    path = scenes.write_toml(folder / "screw.toml", data)
    run = erls.simulate(erls.load_scene(path, [f"simulation.{change}" for change in changes]), verdict=False)
    assert run.failure is None
    return run


def _falls(angle: Array, acceleration: float = FALL) -> None:
    """Ten turns and more, with constant acceleration."""
    wanted = 0.5 * acceleration * TIMES**2
    assert abs(wanted[-1]) > 20 * np.pi
    np.testing.assert_allclose(angle, wanted, rtol=0, atol=ROUNDING * abs(wanted[-1]))


NUT = {"name": "nut", "rigid": _body(MASS, INERTIA)}


@pytest.mark.parametrize("form", FORMS)
def test_a_nut_on_a_screw(tmp_path: Path, form: str) -> None:
    """As the joint of a chain."""
    run = _run(tmp_path, _chain([_joint("thread", "screw", pitch=PITCH)], [NUT]), *FORMS[form])
    _falls(run.joint_angle("thread", TIMES))


@pytest.mark.parametrize("form", IN_LOOPS)
@pytest.mark.parametrize("kind", ["cylindrical", "floating"])
def test_a_nut_in_a_loop(tmp_path: Path, kind: str, form: str) -> None:
    """Free along the axis, or altogether, and closed by a screw to the ground. The coordinate begins where it is told,
    and its turns are counted by how far the nut has come.
    """
    loop = {"name": "thread", "type": "screw", "link": "nut", "node": "root", "axis": [0, 0, 1], "pitch": PITCH}
    data = _chain([_joint("free", kind)], [NUT], loops=[{**loop, "coordinate": 0.3}])
    run = _run(tmp_path, data, *FORMS[form])
    _falls(run.loop_coordinate("thread", TIMES) - 0.3)


@pytest.mark.parametrize("form", IN_LOOPS)
def test_a_lead_screw_between_links(tmp_path: Path, form: str) -> None:
    """A nut that cannot turn drives a spindle that cannot slide: the same equation, the spindle turning back. It begins
    away from the spindle's end along the axis, where the thread fits it.
    """
    spindle = {"name": "spindle", "rigid": _body(3.0, INERTIA)}
    nut = {"name": "nut", "rigid": _body(MASS, 0.5)}
    loop = {"name": "thread", "type": "screw", "link": "nut", "node": "root", "axis": [0, 0, 1], "pitch": PITCH}
    slide = _joint("slide", "prismatic", on="ground", branch={}, initial={"position": 0.37})
    joints = [_joint("turn", "revolute"), slide]
    data = _chain(joints, [spindle, nut], loops=[{**loop, "to_link": "spindle", "to_node": "root"}])
    run = _run(tmp_path, data, *FORMS[form])
    _falls(run.joint_angle("turn", TIMES), -FALL)
    _falls((run.joint_angle("slide", TIMES) - 0.37) / PITCH)
    _falls(run.loop_coordinate("thread", TIMES))


@pytest.mark.parametrize("group", ["SE(3)", "R3xSO(3)"])
def test_a_nut_in_a_scene_of_bodies(tmp_path: Path, group: str) -> None:
    """To the ground, and as a lead screw between two bodies."""
    axis, foot = [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]
    nut = {"name": "nut", "mass": MASS, "inertia": [0.02, 0.02, INERTIA]}
    turned = {"name": "spindle", "mass": 3.0, "inertia": [0.02, 0.02, INERTIA], "position": [1.0, 0.0, 0.0]}
    slid = {"name": "slider", "mass": MASS, "inertia": [0.02, 0.03, 0.04], "position": [1.0, 0.2, 0.4]}
    thread = {"type": "screw", "axis": axis, "pitch": PITCH}
    there = {"axis": axis, "position": [1.0, 0.0, 0.0]}
    data = {
        "simulation": {"type": "dynamics", "duration": END, "step": 0.025, "group": group},
        "bodies": [nut, turned, slid],
        "connections": [
            {"name": "thread", "node": "nut", "position": foot, **thread},
            {"name": "turn", "type": "revolute", "node": "spindle", **there},
            {"name": "slide", "type": "prismatic", "node": "slider", **there},
            {"name": "between", "node": "slider", "to": "spindle", **thread, **there},
        ],
    }
    run = _run(tmp_path, data)
    _falls(run.joint_angle("thread", TIMES))
    _falls(run.joint_angle("turn", TIMES), -FALL)
    _falls(run.joint_angle("slide", TIMES) / PITCH)
    _falls(run.joint_angle("between", TIMES))


def test_a_driven_screw_in_a_scene_of_bodies(tmp_path: Path) -> None:
    """Place and coordinate are those of the motion, from either side: 1e-9, where iterations stop."""
    nuts = [{"name": name, "mass": MASS, "inertia": [INERTIA] * 3} for name in ("nut", "other")]
    thread = {"type": "screw", "axis": [0.0, 0.0, 1.0], "pitch": PITCH, "motion": MOTION}
    data = {
        "simulation": {"type": "dynamics", "duration": END, "step": 0.025},
        "bodies": nuts,
        "connections": [
            {"name": "first", "node": "nut", **thread},
            {"name": "second", "node": "other", "to": "nut", **thread},
        ],
    }
    run = _run(tmp_path, data)
    s = TIMES / END
    angle = TURNED * (35 * s**4 - 84 * s**5 + 70 * s**6 - 20 * s**7)
    for number, (name, body) in enumerate((("first", "nut"), ("second", "other")), start=1):
        np.testing.assert_allclose(run.joint_angle(name, TIMES), angle, rtol=0, atol=1e-9 * TURNED)
        np.testing.assert_allclose(run.position(body, TIMES)[:, 2], number * PITCH * angle, rtol=0, atol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_a_driven_screw_needs_the_weight_along_its_thread(tmp_path: Path, form: str) -> None:
    """In a chain: torque (J + m h²) θ̈ + m g h, force m (g + h θ̈)."""
    thread = _joint("thread", "screw", pitch=PITCH, drive=DRIVE)
    run = _run(tmp_path, _chain([thread], [NUT]), "step=5e-3", *FORMS[form])
    _needs(run, run.joint_effort("thread", TIMES), run.reaction("thread", TIMES)[0])


@pytest.mark.parametrize("form", IN_LOOPS)
def test_a_driven_screw_in_a_loop(tmp_path: Path, form: str) -> None:
    """The same of one that closes a loop."""
    loop = {"name": "thread", "type": "screw", "link": "nut", "node": "root", "axis": [0, 0, 1], "pitch": PITCH}
    data = _chain([_joint("free", "cylindrical")], [NUT], loops=[{**loop, "drive": DRIVE, "coordinate": 0.0}])
    run = _run(tmp_path, data, "step=5e-3", *FORMS[form])
    _needs(run, run.loop_effort("thread", TIMES), run.loop_reaction("thread", TIMES)[0])


def _needs(run: Any, effort: Array, force: Array) -> None:
    """Forces of steps with multipliers are of second order, (4e-3)² at the times of this motion; places are exact."""
    s = TIMES / END
    acceleration = TURNED / END**2 * (420 * s**2 - 1680 * s**3 + 2100 * s**4 - 840 * s**5)
    along = MASS * (GRAVITY + PITCH * acceleration)
    torque = INERTIA * acceleration + PITCH * along
    np.testing.assert_allclose(effort, torque, rtol=0, atol=1e-3 * np.abs(torque).max())
    np.testing.assert_allclose(force[:, 2], along, rtol=0, atol=1e-3 * along.max())
    place = run.position("rim", TIMES)[:, 2]
    angle = TURNED * (35 * s**4 - 84 * s**5 + 70 * s**6 - 20 * s**7)
    np.testing.assert_allclose(place - place[0], PITCH * angle, rtol=0, atol=1e-9)


ARM_AXIS = {"mesh_pose": {"frame": "joint", "rotation_deg": [0.0, 25.0, 0.0]}}


def _flexible(folder: Path, loop: bool) -> dict[str, Any]:
    """An arm that bends, and one that it bears on a hinge, on a thread that is not vertical."""
    scenes.arm_link(folder, reduction={"fixed_interface_modes": 12, "elastic_modes": 18})
    first = _joint("thread", "cylindrical") if loop else _joint("thread", "screw", pitch=PITCH)
    elbow = {"name": "elbow", "dh": {"convention": "standard", "alpha_deg": 30.0, "a": 0.4}}
    arms = [{"name": name, **scenes.ARM, **ARM_AXIS} for name in ("upper", "fore")]
    points = [{"name": "end", "link": "fore", "node": "tip"}]
    data = _chain([first, elbow], arms, points=points, base={"rotation_deg": [30.0, 0.0, 0.0]})
    data["simulation"] = {"duration": 0.02, "step": 1e-4, "spectral_radius": 1.0, "effects": "linear"}
    if loop:
        axis = [0.0, -0.5, np.sqrt(0.75)]
        data["loops"] = [
            {"name": "nut", "type": "screw", "link": "upper", "node": "root", "axis": axis, "pitch": PITCH}
        ]
    return data


@pytest.mark.parametrize("loop", [False, True])
def test_flexible_links_on_a_screw(tmp_path: Path, loop: bool) -> None:
    """ρ∞ = 1 keeps energy to 1e-6 of what gravity gives. FFR leaves ERLS by 1e-7 m, of second order in the deflection:
    a quarter at half the weight. Nodal elements come nearer by the square of their length, and absolute coordinates
    and the loop move as the chain does.
    """
    t = np.linspace(0.0, 0.02, 5)
    forms = {name: FORMS[name] for name in (IN_LOOPS if loop else FORMS)}
    fine = {f"{n} elements": (*FORMS["nodal"], f"elements_per_member={n}") for n in (6, 12)}
    found = {}
    for form, changes in {**forms, **fine}.items():
        run = _run(tmp_path, _flexible(tmp_path, loop), *changes)
        energy = run.energy(t)
        assert np.ptp(energy.total) < 1e-6 * np.ptp(energy.gravity)
        assert energy.elastic.max() > 1e-2 * np.ptp(energy.gravity)
        found[form] = run.position("end", t)
    apart = {form: float(np.abs(place - found["erls"]).max()) for form, place in found.items()}
    assert apart["ffr"] < 2e-7
    assert apart["nodal"] / apart["6 elements"] == pytest.approx(4.0, rel=0.1)
    assert apart["6 elements"] / apart["12 elements"] == pytest.approx(4.0, rel=0.1)
    if loop:
        chain = _run(tmp_path, _flexible(tmp_path, False), *FORMS["erls"]).position("end", t)
        np.testing.assert_allclose(found["erls"], chain, rtol=0, atol=1e-9)
    else:
        np.testing.assert_allclose(found["absolute"], found["ffr"], rtol=0, atol=1e-9)


def test_the_turn_and_its_derivatives() -> None:
    """By complex steps, of a rotation whose z axis lies anywhere: 1e-13; and threads are told to the nearest lead."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        q, w = rotations.exp(rng.standard_normal(3)), rng.standard_normal(3)
        moved = tuple((q @ rotations.exp(1e-30j * w)).ravel())
        here, slope = tuple(q.ravel()), np.array(plain(screws.turn_gradient)(tuple(q.ravel())))
        thread = plain(screws.off_thread)(0.3 + 0.0j, PITCH, moved)
        assert thread.imag / 1e-30 == pytest.approx(-PITCH * slope @ w, abs=1e-13)
        change = np.imag(plain(screws.turn_gradient)(moved)) / 1e-30
        size = max(1.0, float(np.abs(change).max()))
        np.testing.assert_allclose(plain(screws.turn_gradient_change)(here, tuple(w)), change, atol=1e-13 * size)
    for angle in (-20.0, -3.0, 0.4, 2.0, 9.0):
        q = tuple(rotations.exp(np.array([0.0, 0.0, angle])).ravel())
        for pitch in (PITCH, -PITCH):
            assert plain(screws.off_thread)(pitch * angle + 1e-3, pitch, q) == pytest.approx(1e-3, abs=1e-14)


def test_the_table_tells_screws_from_the_others() -> None:
    """What is asked of kinds of joints."""
    kind = single(Freedom(Z, True, pitch=0.2))
    assert (kind.name, kind.slides, kind.mutual, kind.aligned) == ("screw", True, True, (Z,))
    assert [row.pitch for row in kind.conditions] == [0.0, 0.0, 0.2, 0.0, 0.0]
    assert single(Freedom(Z, True)) is JOINT_TYPES["revolute"]
    assert single(Freedom(Z, False)) is JOINT_TYPES["prismatic"]


CHAIN = _chain([_joint("thread", "screw", pitch=PITCH)], [NUT])
LOOP = {"name": "closing", "type": "screw", "link": "nut", "node": "root", "axis": [0, 0, 1], "pitch": PITCH}
BODIES = {
    "simulation": {"type": "dynamics", "duration": 0.1, "step": 1e-3},
    "bodies": [{"name": "nut", "mass": MASS}],
    "connections": [{"name": "thread", "type": "screw", "node": "nut", "axis": [0, 0, 1], "pitch": PITCH}],
}
PLACES: dict[str, tuple[dict[str, Any], str]] = {
    "chain": (CHAIN, "joints"),
    "loop": (_chain([_joint("free", "floating")], [NUT], loops=[LOOP]), "loops"),
    "bodies": (BODIES, "connections"),
}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(
    ("changes", "message", "remedy"),
    [
        ({"pitch": None}, "a screw joint needs it", "give how far it advances"),
        ({"pitch": 0.0}, "a screw joint needs it", "give how far it advances"),
        ({"pitch": float("inf")}, "not a finite number", "give a number"),
        ({"type": "revolute"}, "a revolute joint has none", "remove it"),
    ],
)
def test_a_pitch_is_told_of_screws_alone(
    tmp_path: Path, place: str, changes: dict[str, Any], message: str, remedy: str
) -> None:
    """By file, field, value and remedy."""
    data, table = PLACES[place]
    record = {name: x for name, x in {**data[table][0], **changes}.items() if x is not None}
    path = scenes.write_toml(tmp_path / "scene.toml", {**data, table: [record]})
    with pytest.raises(SceneError) as caught:
        erls.load_scene(path)
    assert caught.value.cause is Cause.BAD_FIELD
    assert caught.value.where == f"{path}: {table}[0].pitch"
    assert message in caught.value.message
    assert remedy in caught.value.remedy

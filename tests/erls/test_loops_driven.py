"""Drives, springs, dampers, friction and rotors on joints that close a loop: the five-bar robot, a driven slider."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import loop_scenes
import numpy as np
import pytest
import scenes

from erls.equations.loops.closed_chain import ClosedChain
from erls.errors import SceneError
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.scene.read import load_scene
from erls.simulation.simulate import simulate
from fe_import.errors import ReportedError

INNER, OUTER, GROUND = 0.25, 0.35, 0.2
LEFT, RIGHT = (135.0, 110.0), (45.0, 75.0)
NAMES = ("left_inner", "left_outer", "right_outer", "right_inner")
LENGTHS = (INNER, OUTER, OUTER, INNER)


def move(ends: tuple[float, float], duration: float = 0.4) -> dict[str, Any]:
    """A prescribed motion from rest to rest."""
    motion = {"shape": "polynomial", "from_deg": ends[0], "to_deg": ends[1], "duration": duration, "degree": 5}
    return {"type": "motion", "motion": motion}


def five_bar(first: dict[str, Any], closing: dict[str, Any], *, from_right: bool = False) -> dict[str, Any]:
    """A rigid five-bar: what acts in the first joint of the chain and in the one that closes it.

    The chain goes from the left motor to the right one, or the other way.
    """
    up = float(np.degrees(np.arccos((GROUND / 2 + INNER * np.cos(np.pi / 4)) / OUTER)))  # of the left outer arm
    guess, start, end = (135.0, up - 135.0, -2 * up, up - 135.0), 0.0, GROUND
    if from_right:
        guess, start, end = (45.0, 135.0 - up, 2 * up, 135.0 - up), GROUND, 0.0
    masses = (0.3, 0.2, 0.25, 0.35)
    names = NAMES[::-1] if from_right else NAMES
    starts = zip(LENGTHS, guess, strict=True)
    joints = [loop_scenes.joint(f"j{k}", length, angle) for k, (length, angle) in enumerate(starts)]
    if first.get("drive", {}).get("type") == "motion":
        del joints[0]["initial"]
    joints[0] |= first
    links = [
        {"name": name, "rigid": loop_scenes.bar(length, masses[NAMES.index(name)]), "mesh_pose": {"frame": "joint"}}
        for name, length in zip(names, LENGTHS, strict=True)
    ]
    loop = {"name": "motor", "link": names[-1], "node": "tip", "position": [end, 0.0, 0.0]}
    loop["coordinate_deg"] = sum(guess) + (-180.0 if from_right else 180.0)
    return {
        "simulation": {"duration": 0.4, "step": 2e-2},  # where both motors move it nothing is left to integrate
        "base": {"rotation_deg": [90.0, 0.0, 0.0], "position": [start, 0.0, 0.0]},
        "joints": joints,
        "links": links,
        "points": [{"name": "hand", "link": names[1], "node": "tip"}],
        "loops": [{**loop, **closing}],
    }


def hand(left: Array, right: Array) -> Array:
    """Where the circles around both elbows meet, on the upper side, as x + i z."""
    elbows = INNER * np.exp(1j * left), GROUND + INNER * np.exp(1j * right)
    across = elbows[1] - elbows[0]
    bend = np.arccos(np.abs(across) / (2 * OUTER))
    return np.asarray(elbows[0] + OUTER * across / np.abs(across) * np.exp(1j * bend))


def motors(place: Array) -> tuple[Array, Array]:
    """Motor angles that bring the hand to x + i z, elbows outward: the law of cosines at either motor."""
    angles = []
    for base, side in ((0.0, 1.0), (GROUND, -1.0)):
        reach = np.abs(place - base)
        bend = np.arccos((reach**2 + INNER**2 - OUTER**2) / (2 * reach * INNER))
        angles.append(np.angle(place - base) + side * bend)
    return angles[0], angles[1]


def at(curve: tuple[float, float], t: Array) -> Array:
    """Angle [rad] of `move`: a polynomial of degree 5, at rest at both ends."""
    s = t / 0.4
    return np.asarray(np.radians(curve[0] + (curve[1] - curve[0]) * (10 * s**3 - 15 * s**4 + 6 * s**5)))


@pytest.mark.parametrize("name", ["erls", "minimum-norm", "ffr"])
def test_both_motors_on_the_ground(tmp_path: Path, name: str) -> None:
    """Forward and inverse kinematics in closed form, to 1e-10; between steps too. Three conditions are redundant."""
    run = loop_scenes.run(tmp_path, five_bar({"drive": move(LEFT)}, {"drive": move(RIGHT)}), name)
    t = np.linspace(0, 0.4, 17)
    found = run.position("hand", t)
    place = found[:, 0] + 1j * found[:, 2]
    np.testing.assert_allclose(place, hand(at(LEFT, t), at(RIGHT, t)), atol=1e-12)
    left, right = motors(place)
    np.testing.assert_allclose(left, run.joint_angle("j0", t), atol=1e-10)
    np.testing.assert_allclose(right, run.loop_coordinate("motor", t), atol=1e-10)
    np.testing.assert_allclose(run.loop_coordinate("motor", t), at(RIGHT, t), atol=1e-12)
    s = t / 0.4
    rate = np.radians(RIGHT[1] - RIGHT[0]) * 30 * s**2 * (1 - s) ** 2 / 0.4
    np.testing.assert_allclose(run.loop_rate("motor", t), rate, atol=1e-11)
    summary = run.summary()
    assert summary["degrees_of_freedom"] == 0
    assert len(summary["loops"][0]["redundant"]) == 3


def _work(run: ChainRun, *joints: str) -> float:
    """Of joints and of the closing one, by Gauss's rule."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    t = run.end * (nodes + 1) / 2
    closing = float(weights @ (run.loop_effort("motor", t) * run.loop_rate("motor", t))) * run.end / 2
    return closing + (loop_scenes.work(run, *joints) if joints else 0.0)


def test_work_of_both_motors_is_the_energy(tmp_path: Path) -> None:
    """With a spring and a rotor on either motor: ∫ τ φ̇ dt of both = ΔE, 1e-8 of the energy that comes and goes."""
    acting = {"stiffness": 3.0, "rest_deg": 60.0, "motor": {"rotor_inertia": 2e-5, "gear_ratio": 20.0}}
    data = five_bar({"drive": move(LEFT), **acting}, {"drive": move(RIGHT), **acting})
    run = loop_scenes.run(tmp_path, data, integrator="dop853", duration=0.3, rtol=1e-6, atol=1e-9)
    energy = run.energy(np.linspace(0, run.end, 21)).total
    assert abs(_work(run, "j0") - (energy[-1] - energy[0])) < 1e-8 * np.ptp(energy)


def burst(amplitude: float, frequency: float) -> dict[str, Any]:
    """One period of a torque or force."""
    shape = {"shape": "sine_burst", "start": 0.0, "amplitude": amplitude, "frequency_hz": frequency, "cycles": 1.0}
    return {"type": "torque", "profiles": [shape]}


ACTING: dict[str, dict[str, Any]] = {
    "spring": {"stiffness": 4.0, "rest_deg": 30.0, "motor": {"rotor_inertia": 1e-5}},
    "all": {"stiffness": 4.0, "rest_deg": 30.0, "damping": 0.05, "friction": {"force": 0.1, "transition_rate": 0.2},
            "motor": {"rotor_inertia": 1e-5, "gear_ratio": 30.0}, "drive": burst(0.4, 10.0)},
    "pd": {"drive": {"type": "pd", "motion": move(RIGHT)["motion"], "proportional_gain": 30.0, "derivative_gain": 0.5,
                     "torque_limit": 2.0}, "damping": 0.02},
}  # fmt: skip


@pytest.mark.parametrize(("name", "acting"), [("erls", "spring"), ("erls", "all"), ("ffr", "all"), ("ffr", "pd")])
def test_a_closing_joint_is_a_joint_like_any_other(tmp_path: Path, name: str, acting: str) -> None:
    """The same forces in the first joint of a chain that begins at the other motor: one motion, to 1e-8; rtol 1e-9.

    So are coordinate, effort and what either motor's joint does to its arm.
    """
    settings = {"integrator": "dop853", "rtol": 1e-9, "atol": 1e-11, "duration": 0.03}
    closing = loop_scenes.run(tmp_path, five_bar({}, ACTING[acting]), name, **settings)
    first = loop_scenes.run(tmp_path, five_bar(ACTING[acting], {}, from_right=True), name, **settings)
    t = np.linspace(0, 0.03, 4)
    np.testing.assert_allclose(closing.position("hand", t), first.position("hand", t), atol=1e-8)
    np.testing.assert_allclose(closing.loop_coordinate("motor", t), first.joint_angle("j0", t), atol=1e-8)
    np.testing.assert_allclose(closing.joint_angle("j0", t), first.loop_coordinate("motor", t), atol=1e-8)
    np.testing.assert_allclose(closing.loop_effort("motor", t), first.joint_effort("j0", t), atol=1e-6)
    np.testing.assert_allclose(closing.energy(t).total, first.energy(t).total, atol=1e-6)
    for ours, theirs in (
        (closing.loop_reaction("motor", t), first.reaction("j0", t)),
        (closing.reaction("j0", t), first.loop_reaction("motor", t)),
    ):
        for vector, other in zip(ours, theirs, strict=True):
            np.testing.assert_allclose(vector, other, atol=1e-5)
    assert closing.conservative == first.conservative == (acting == "spring")


def test_generalized_alpha_with_a_controlled_closing_joint(tmp_path: Path) -> None:
    """Of second order against DOP853: 2 and 1 ms."""
    data = five_bar({"drive": move(LEFT)}, ACTING["pd"])
    exact = loop_scenes.run(tmp_path, data, integrator="dop853", rtol=1e-9, duration=0.04).position("hand", 0.04)
    errors = [
        np.abs(loop_scenes.run(tmp_path, data, step=h, duration=0.04).position("hand", 0.04) - exact).max()
        for h in (2e-3, 1e-3)
    ]
    assert 1.8 < np.log2(errors[0] / errors[1]) < 2.2


def test_implicit_methods_know_what_acts_in_closing_joints(tmp_path: Path) -> None:
    """Stiffness, damping and mass of the chain against differences of its forces, along random motions; 1e-6."""
    acting = {**ACTING["all"], "drive": {**ACTING["pd"]["drive"], "torque_limit": 1e3}}
    chain: ClosedChain = loop_scenes.chain(tmp_path, five_bar({}, acting))
    bare: ClosedChain = loop_scenes.chain(tmp_path, five_bar({}, {}))
    y, _ = chain.initial_state()
    rng = np.random.default_rng(2)
    v, way = rng.uniform(-1, 1, (2, chain.size))
    (k, c), (k0, c0) = (one.loops.matrices(0.1, y, v) for one in (chain, bare))

    def acts(y: Array, v: Array, a: Array) -> Array:
        return np.asarray(chain.loops.forces(0.1, y, v, a) - bare.loops.forces(0.1, y, v, a))

    h, still = 1e-6, np.zeros(chain.size)
    slowed = (acts(y, v + h * way, still) - acts(y, v - h * way, still)) / (2 * h)
    np.testing.assert_allclose((c - c0) @ way, slowed, rtol=1e-6, atol=1e-6 * np.abs(slowed).max())
    heavier = acts(y, v, way) - acts(y, v, still)
    np.testing.assert_allclose((chain.mass_matrix(0.1, y) - bare.mass_matrix(0.1, y)) @ way, heavier, rtol=1e-9)
    bent = (acts(y + h * way, still, still) - acts(y - h * way, still, still)) / (2 * h)
    np.testing.assert_allclose((k - k0) @ way, bent, rtol=1e-6, atol=1e-6 * np.abs(bent).max())


def test_turns_are_counted(tmp_path: Path) -> None:
    """A crank that closes the chain makes more than a turn: its coordinate goes on, and so does the spring on it."""
    data = loop_scenes.four_bar()
    for k, (length, mass) in enumerate(((0.35, 0.7), (0.45, 0.9), (0.15, 0.3))):
        data["joints"][k]["dh"]["a"] = length
        data["links"][k]["rigid"] = loop_scenes.bar(length, mass)
    crank = 0.15 * np.exp(1j * np.radians(60.0))
    coupler, rocker = loop_scenes.four_bar_angles(np.radians(np.array(60.0)))
    guess = np.degrees([rocker + np.pi, coupler + np.pi, np.radians(60.0) + np.pi])  # from the rocker's pivot outward
    for joint, angle in zip(data["joints"], np.diff(guess, prepend=0.0), strict=True):
        joint["initial"] = {"position_deg": float(angle)}
    data["base"]["position"] = [loop_scenes.GROUND, 0.0, 0.0]
    data["points"] = [{"name": "pin", "link": "coupler", "node": "tip"}]
    loop = {"name": "motor", "link": "rocker", "node": "tip", "position": [0.0, 0.0, 0.0], "coordinate_deg": 60.0}
    data["loops"] = [{**loop, "drive": loop_scenes.steady(60.0, 360.0), "stiffness": 0.1}]
    run = loop_scenes.run(tmp_path, data, step=2e-2, duration=1.2)
    t = np.linspace(0, 1.2, 9)
    turned = np.radians(60.0 + 360.0 * t)
    np.testing.assert_allclose(run.loop_coordinate("motor", t), turned, atol=1e-10)
    np.testing.assert_allclose(run.energy(t).springs, 0.05 * turned**2, rtol=1e-10)
    pin = run.position("pin", t)
    np.testing.assert_allclose(pin[:, 0] + 1j * pin[:, 2], crank * np.exp(2j * np.pi * t), atol=1e-10)


def _slider(**closing: Any) -> dict[str, Any]:
    data = loop_scenes.slider_crank()
    data["loops"][0] |= {"name": "motor", **closing}
    return data


def test_a_driven_slider_turns_the_crank(tmp_path: Path) -> None:
    """x(t) prescribed on the closing prismatic joint: the crank from the law of cosines, to 1e-10; its work: ΔE."""
    r, l = loop_scenes.LENGTHS[:2]
    x0 = r * np.cos(np.radians(60.0)) + np.sqrt(l**2 - (r * np.sin(np.radians(60.0))) ** 2)
    motion = {"shape": "polynomial", "from": float(x0), "to": float(x0) - 0.1, "duration": 0.2, "degree": 5}
    data = _slider(drive={"type": "motion", "motion": motion})
    run = loop_scenes.run(tmp_path, data, "ffr", integrator="dop853", duration=0.15, rtol=1e-6, atol=1e-9)
    t = np.linspace(0, run.end, 9)
    s = t / 0.2
    x = x0 - 0.1 * (10 * s**3 - 15 * s**4 + 6 * s**5)
    np.testing.assert_allclose(run.loop_coordinate("motor", t), x, atol=1e-12)
    np.testing.assert_allclose(run.joint_angle("j0", t), np.arccos((x**2 + r**2 - l**2) / (2 * x * r)), atol=1e-10)
    energy = run.energy(np.linspace(0, run.end, 21)).total
    assert abs(_work(run) - (energy[-1] - energy[0])) < 1e-8 * np.ptp(energy)


def test_force_and_damper_on_a_slider(tmp_path: Path) -> None:
    """Work of a force, a spring and a damper along the guide is kinetic and gravity energy, 1e-8 J; rtol 1e-10.

    ``coordinate`` moves the zero: the spring rests where the slider begins.
    """
    acting = {"drive": burst(5.0, 5.0), "stiffness": 20.0, "damping": 3.0, "motor": {"rotor_inertia": 0.2}}
    settings = {"integrator": "dop853", "duration": 0.15, "rtol": 1e-10, "atol": 1e-12}
    run = loop_scenes.run(tmp_path, _slider(**acting, coordinate=0.0), **settings)
    assert float(run.loop_coordinate("motor", 0.0)) == pytest.approx(0.0, abs=0.1)  # the chain's guess is not closed
    found = run.energy([0.0, run.end])
    energy = found.total - found.springs
    assert abs(_work(run) - (energy[1] - energy[0])) < 1e-8
    assert abs(energy[1] - energy[0]) > 1e-2


def test_formulations_agree_to_second_order(tmp_path: Path) -> None:
    """Shipped robot, slower, static start: twice the stiffness quarters the distance of ERLS and FFR, within 5 %."""
    t = np.array([0.0, 0.03])
    distances, deflections = [], []
    path = scenes.ROOT / "data/five_bar"
    for softness in (1.0, 0.5):
        (tmp_path / "links").mkdir(exist_ok=True)
        for link in ("inner", "outer"):
            text = (path / f"links/{link}.toml").read_text(encoding="utf-8")
            text = text.replace("youngs_modulus = 7e10", f"youngs_modulus = {7e10 / softness}")
            text = text.replace("fixed_interface_modes = 4", "fixed_interface_modes = 1")
            text = text.replace("elastic_modes = 10", "elastic_modes = 4").replace("elements = 8", "elements = 4")
            (tmp_path / f"links/{link}.toml").write_text(text, encoding="utf-8")
        shutil.copy(path / "parallel_robot.toml", tmp_path / "robot.toml")
        runs = []
        for name, rigid in (("erls", False), ("ffr", False), ("erls", True)):
            changes = ["simulation.duration=0.03", "simulation.step=5e-3", scenes.LINEAR]
            changes.append(f"simulation.formulation={name}")
            changes += ["joints.left_motor.drive.motion.duration=2.0", "loops.right_motor.drive.motion.duration=2.0"]
            changes += [f"links.{link}.flexible=false" for link in NAMES if rigid]
            runs.append(simulate(load_scene(tmp_path / "robot.toml", changes), verdict=False).position("hand", t))
        distances.append(np.abs(runs[0] - runs[1]).max())
        deflections.append(np.abs(runs[0] - runs[2]).max())
    assert 1.9 < deflections[0] / deflections[1] < 2.1
    assert 3.8 < distances[0] / distances[1] < 4.2


@pytest.mark.parametrize(
    ("changes", "where", "words"),
    [
        ({"type": "spherical"}, "coordinate_deg", "no single coordinate"),
        ({"type": "planar", "axis": [0.0, 1.0, 0.0], "coordinate_deg": None, "damping": 1.0}, "damping", "no single"),
        ({"coordinate": 0.5}, "coordinate", "both coordinate and coordinate_deg"),
        ({"stiffness": -1.0}, "stiffness", "negative"),
        ({"motor": {"rotor_inertia": -1.0}}, "motor.rotor_inertia", "negative"),
        ({"motor": {"mass": 1.0}}, "motor.mass", "rotor_inertia"),
        ({"type": "prismatic", "axis": [1.0, 0.0, 0.0]}, "coordinate_deg", "degrees at a prismatic joint"),
        ({"drive": {**ACTING["pd"]["drive"], "feed_forward": True}}, "drive.feed_forward", "set it to false"),
        ({"axis": [1.0, 0.0, 0.0], "stiffness": 1.0}, "stiffness", "turns of this joint cannot be counted"),
        ({"axis": [1.0, 0.0, 0.0], "drive": ACTING["pd"]["drive"]}, "drive", "turns of this joint cannot be counted"),
    ],
)
def test_what_cannot_act_is_refused(tmp_path: Path, changes: dict[str, Any], where: str, words: str) -> None:
    """One message with the field and a remedy."""
    data = five_bar({}, changes)
    data["loops"][0] = {k: v for k, v in data["loops"][0].items() if v is not None}
    with pytest.raises(ReportedError, match=words) as caught:
        loop_scenes.run(tmp_path, data)
    assert isinstance(caught.value, SceneError)
    assert f"loops[0].{where}" in str(caught.value)


def test_jumps_of_a_closing_motion_are_told(tmp_path: Path) -> None:
    """As for any other joint."""
    sine = {"shape": "sine", "amplitude_deg": 2.0, "frequency_hz": 1.0, "offset_deg": 45.0}
    for motion, told in ((sine | {"start": 0.005}, True), (sine | {"start": 0.5}, False)):
        data = five_bar({"drive": move(LEFT)}, {"drive": {"type": "motion", "motion": motion}})
        run = loop_scenes.run(tmp_path, data, duration=0.02)
        assert any("loop 'motor': the prescribed rate jumps" in w for w in run.warnings) == told

"""Joints that follow others by ratios: closed forms, formulations, integrators, what goes through the whole program."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import erls
from erls.errors import SceneError

DH = {"convention": "standard"}
MOTOR, WHEEL, IDLER, RATIO, TORQUE = 0.02, 0.05, 0.004, -2.5, 0.3  # kg m², wheel per motor, N m
REDUCED = 1 / (RATIO**2 / MOTOR + 1 / WHEEL)  # what the teeth of an elastic gear swing, at the wheel
DUE = 8.0 * math.pi


def shaft(name: str, inertia: float, **more: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """A rotor of 0.1 m on the ground about z, on a link that carries nothing else."""
    body = {"mass": 1.0, "inertia": [0.0, 0.0, inertia], "points": {"seat": [0.0, 0.0, 0.0], "rim": [0.1, 0.0, 0.0]}}
    joint = {"name": name, "dh": DH, "on": "ground", "branch": {"position": [0.3, 0.0, 0.0]}, **more}
    return joint, {"name": f"{name} rotor", "rigid": body}


DRIVE = {"type": "torque", "profiles": [{"shape": "constant", "value": TORQUE}]}
Shafts = list[tuple[dict[str, Any], dict[str, Any]]]


def geared(coupling: dict[str, Any], shafts: Shafts | None = None, *before: dict[str, Any], **settings: Any) -> Any:
    """A scene of two rotors, the first driven, that a gear couples; of others with what couples them."""
    own = shafts or [shaft("motor", MOTOR, drive=DRIVE), shaft("wheel", WHEEL)]
    return erls.make_scene(
        gravity=[0.0, 0.0, 0.0],
        simulation={"duration": 0.5, **settings},
        joints=[joint for joint, _ in own],
        links=[link for _, link in own],
        couplings=[*before, {"name": "gear", "joint": "wheel", "follows": {"motor": RATIO}, **coupling}],
    )


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
@pytest.mark.parametrize("integrator", ["generalized_alpha", "auto", "rk45"])
def test_two_geared_rotors_are_one_of_the_equivalent_inertia(formulation: str, integrator: str) -> None:
    """J = J₁ + r² J₂ at the motor, and the teeth carry r J₂ times its acceleration; to the tolerance of rk45."""
    run = erls.simulate(geared({}, formulation=formulation, integrator=integrator), verdict=False)
    acceleration = TORQUE / (MOTOR + RATIO**2 * WHEEL)
    times = np.array([0.2, 0.5])
    np.testing.assert_allclose(run.joint_angle("motor", times), acceleration * times**2 / 2, rtol=1e-8)
    np.testing.assert_allclose(run.joint_angle("wheel", times), RATIO * run.joint_angle("motor", times), rtol=1e-12)
    np.testing.assert_allclose(run.coupling_effort("gear", times), WHEEL * RATIO * acceleration, rtol=1e-8)


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
@pytest.mark.parametrize("last", [{}, {"stiffness": 1e5, "damping": 20.0}], ids=["ideal", "elastic"])
def test_a_train_of_gears(formulation: str, last: dict[str, Any]) -> None:
    """J = J₁ + r² J₂ + (r s)² J₃ at the motor: a coupling whose joint another one follows, and which is told first; an
    elastic one follows in the mean of what its teeth swing, which its damping has ended.
    """
    second = {"name": "second", "joint": "idler", "follows": {"wheel": 3.0}, **last}
    shafts = [shaft("motor", MOTOR, drive=DRIVE), shaft("wheel", WHEEL), shaft("idler", IDLER)]
    run = erls.simulate(geared({}, shafts, second, formulation=formulation), verdict=False)
    acceleration = TORQUE / (MOTOR + RATIO**2 * WHEEL + (3 * RATIO) ** 2 * IDLER)
    motor = run.joint_angle("motor", 0.5)
    assert motor == pytest.approx(acceleration * 0.5**2 / 2, rel=1e-3 if last else 1e-8)
    wound = IDLER * 3 * RATIO * acceleration / last.get("stiffness", np.inf)
    assert run.joint_angle("idler", 0.5) == pytest.approx(3 * RATIO * motor - wound, rel=1e-5)
    assert run.coupling_effort("second", 0.5) == pytest.approx(IDLER * 3 * RATIO * acceleration, rel=1e-3)


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
@pytest.mark.parametrize("play", [0.0, 2e-3])
def test_teeth_of_an_elastic_gear_swing(formulation: str, play: float) -> None:
    """Free through the play, half a period of √(k / J) on either side, with J = J₁ J₂ / (J₁ + r² J₂) at the wheel;
    after a whole one all is as it was, and the sum of momenta that the gear keeps has not changed. To the tolerance of
    the angle over the rate.
    """
    stiffness, rate = 400.0, 1.5
    half = 2 * play / rate + math.pi * math.sqrt(REDUCED / stiffness)
    teeth: dict[str, Any] = {"stiffness": stiffness}
    if play:
        teeth = {"stops": {"lower": -play, "upper": play, "restitution": 1.0, **teeth}}
    shafts = [shaft("motor", MOTOR), shaft("wheel", WHEEL, initial={"rate": rate})]
    settings = {"formulation": formulation, "duration": 2 * half, "tolerance": 1e-6}
    run = erls.simulate(geared(teeth, shafts, **settings), verdict=False)
    times = np.array([0.0, half / 2, half, 2 * half])
    wound = run.joint_angle("wheel", times) - RATIO * run.joint_angle("motor", times)
    deepest = play + rate * math.sqrt(REDUCED / stiffness)
    np.testing.assert_allclose(wound, [0.0, deepest, 0.0, 0.0], rtol=0, atol=1e-5)
    momentum = WHEEL * RATIO * run.joint_rate("wheel", times) + MOTOR * run.joint_rate("motor", times)
    np.testing.assert_allclose(momentum, WHEEL * RATIO * rate, rtol=1e-9)
    effort = -stiffness * (deepest - play)
    np.testing.assert_allclose(run.coupling_effort("gear", half / 2), effort, rtol=1e-2)
    energies = run.energy([0.0, half / 2, half]).total
    np.testing.assert_allclose(energies, WHEEL * rate**2 / 2, rtol=1e-4)


def test_a_differential_shares_what_its_case_turns() -> None:
    """case = (left + right) / 2: the case's torque goes to both sides alike, whatever their rates."""
    drive = {"type": "torque", "profiles": [{"shape": "constant", "value": TORQUE}]}
    shafts = [shaft("left", MOTOR), shaft("wheel", WHEEL, initial={"rate": 3.0}), shaft("case", 0.1, drive=drive)]
    scene = erls.make_scene(
        gravity=[0.0, 0.0, 0.0],
        simulation={"duration": 0.5},
        joints=[joint for joint, _ in shafts],
        links=[link for _, link in shafts],
        couplings=[{"name": "differential", "joint": "case", "follows": {"left": 0.5, "wheel": 0.5}}],
    )
    run = erls.simulate(scene, verdict=False)
    # the case follows: its rate is the mean, and with h the torque on it the sides get -h / 2 each
    case, left, wheel = 0.1, MOTOR, WHEEL
    h = -TORQUE / (1 + case * (1 / left + 1 / wheel) / 4)
    gained = [run.joint_rate(name, 0.5) - run.joint_rate(name, 0.0) for name in ("left", "wheel", "case")]
    np.testing.assert_allclose(gained, 0.5 * np.array([-h / left / 2, -h / wheel / 2, (TORQUE + h) / case]), rtol=1e-9)
    np.testing.assert_allclose(run.coupling_effort("differential", 0.25), h, rtol=1e-9)


def test_rack_follows_a_prescribed_pinion() -> None:
    """What a prescribed motion asks of its motor includes what the coupling hands on: r m r θ̈ beside J θ̈."""
    motion = {"shape": "polynomial", "from_deg": 0.0, "to_deg": 90.0, "duration": 0.5, "degree": 5}
    pinion = shaft("pinion", MOTOR, drive={"type": "motion", "motion": motion})
    rack, body = shaft("rack", 0.0, type="prismatic")
    scene = erls.make_scene(
        gravity=[0.0, 0.0, 0.0],
        simulation={"duration": 0.5},
        joints=[pinion[0], rack],
        links=[pinion[1], body],
        couplings=[{"name": "teeth", "joint": "rack", "follows": {"pinion": 0.03}, "offset": 0.1}],
    )
    run = erls.simulate(scene, verdict=False)
    t, whole = 0.15, math.pi / 2
    x = t / 0.5
    turned, sped = whole * (10 * x**3 - 15 * x**4 + 6 * x**5), whole * (60 * x - 180 * x**2 + 120 * x**3) / 0.25
    np.testing.assert_allclose(run.joint_angle("rack", t), 0.1 + 0.03 * turned, rtol=1e-12)
    np.testing.assert_allclose(run.coupling_effort("teeth", t), 0.03 * sped, rtol=1e-9)
    np.testing.assert_allclose(run.joint_effort("pinion", t), (MOTOR + 0.03**2) * sped, rtol=1e-9)


def arms(**more: Any) -> Any:
    """Two flexible arms under gravity, elbow tied to shoulder by a belt; keys of the simulation, or a coupling."""
    coupling = more.pop("coupling", {})
    return erls.make_scene(
        folder=Path(__file__).parents[2] / "data/robot",
        base={"rotation_deg": [90.0, 0.0, 0.0]},
        simulation={"duration": 0.3, **more},
        joints=[
            {"name": "shoulder", "dh": {**DH, "a": 0.5}, "initial": {"position_deg": 20.0}},
            {"name": "elbow", "dh": {**DH, "a": 0.5}, "initial": {"position_deg": -20.0}},
        ],
        links=[
            {"name": name, "model": "links/arm.toml", "mesh_pose": {"frame": "joint"}, "elastic_modes": 4}
            for name in ("upper", "fore")
        ],
        points=[{"name": "tip", "link": "fore", "node": "tip"}],
        couplings=[
            {"name": "belt", "joint": "elbow", "follows": {"shoulder": -1.5}, "offset_deg": 10.0, **coupling}
        ],
    )


def test_flexible_arms_agree_between_formulations() -> None:
    """To the tolerance, with the energy kept, and the belt to rounding."""
    runs = {name: erls.simulate(arms(formulation=name)) for name in ("erls", "ffr")}
    times = [0.0, 0.15, 0.3]
    np.testing.assert_allclose(runs["ffr"].position("tip", times), runs["erls"].position("tip", times), atol=1e-5)
    for run in runs.values():
        total = run.energy(times).total
        np.testing.assert_allclose(total, total[0], atol=1e-5)
        held = run.joint_angle("elbow", times) + 1.5 * run.joint_angle("shoulder", times)
        np.testing.assert_allclose(held, math.radians(10.0), atol=1e-12)
        assert run.accuracy.integration is not None
        assert run.accuracy.integration < 1e-4


def test_a_stiff_belt_comes_to_the_ideal_one() -> None:
    """It is wound up by the effort over its stiffness: ten times the stiffness, a tenth as far off."""
    ideal = erls.simulate(arms(duration=0.05, effects=["gravity"]), verdict=False)
    off = []
    for stiffness in (1e4, 1e5):
        coupling = {"stiffness": stiffness, "damping": stiffness * 1e-4}
        run = erls.simulate(arms(duration=0.05, tolerance=1e-7, effects=["gravity"], coupling=coupling), verdict=False)
        off.append(float(np.linalg.norm(run.position("tip", 0.05) - ideal.position("tip", 0.05))))
    assert off[1] < 0.2 * off[0]
    assert off[0] < 1e-3


def test_poles_of_an_elastic_gear() -> None:
    """√(k / J) with damping c / (2 √(k J)), of the linear model; the ideal one has the motion of both alone."""
    stiffness, damping = 300.0, 0.4
    scene = geared({"stiffness": stiffness, "damping": damping}, [shaft("motor", MOTOR), shaft("wheel", WHEEL)])
    modes = [mode for mode in erls.linearize(scene, at=0.0).modes if abs(mode.pole) > 1.0]
    pole = modes[0].pole
    np.testing.assert_allclose(abs(pole), math.sqrt(stiffness / REDUCED), rtol=1e-8)
    np.testing.assert_allclose(-pole.real, damping / (2 * REDUCED), rtol=1e-7)
    ideal = erls.linearize(geared({}, [shaft("motor", MOTOR), shaft("wheel", WHEEL)]), at=0.0)
    assert all(abs(mode.pole) < 1e-5 for mode in ideal.modes)


def test_sensitivities_by_a_ratio() -> None:
    """Of the closed form θ = ½ τ t² / (J₁ + r² J₂)."""
    key = "couplings.gear.follows.motor"
    found = erls.sensitivities(geared({}), {"angle": lambda run: run.joint_angle("motor", 0.5)}, [key])
    whole = MOTOR + RATIO**2 * WHEEL
    exact = -TORQUE * 0.125 * 2 * RATIO * WHEEL / whole**2
    np.testing.assert_allclose(found.derivatives["angle"][key], exact, rtol=1e-6)


def test_a_stepper_and_a_run_give_the_same() -> None:
    """Couplings have no inputs of their own, and a stepper keeps to them."""
    shafts = [shaft("motor", MOTOR), shaft("wheel", WHEEL)]
    stepper = erls.stepper(geared({}, shafts))
    assert stepper.input_names == ("motor", "wheel")
    for _ in range(10):
        stepper.step({"motor": TORQUE}, 1e-2, held=True)
    y, v, _ = stepper.state
    np.testing.assert_allclose(y[1], RATIO * y[0], rtol=1e-12)
    np.testing.assert_allclose(v[0], 0.1 * TORQUE / (MOTOR + RATIO**2 * WHEEL), rtol=1e-9)


def hinged(joint: str, **more: Any) -> Any:
    """A wheel that follows a closing joint, by which a body on a joint of several coordinates hangs from the ground."""
    body = {"mass": 1.0, "inertia": [WHEEL, WHEEL, WHEEL], "points": {"seat": [0.0, 0.0, 0.0]}}
    wheel, rotor = shaft("wheel", WHEEL, initial={"rate": RATIO * 15.0})
    carrier = {"name": "carrier", "type": joint, "dh": DH}
    turn = {"turn" if joint == "planar" else "turn_z": {"initial": {"rate": 15.0}}}
    return erls.make_scene(
        gravity=[0.0, 0.0, 0.0],
        simulation={"duration": 1.0, **more},
        joints=[{**carrier, "coordinates": turn}, wheel],
        links=[{"name": "body", "rigid": body}, rotor],
        loops=[{"name": "hinge", "type": "revolute", "link": "body", "node": "seat", "axis": [0.0, 0.0, 1.0]}],
        couplings=[{"name": "gear", "joint": "wheel", "follows": {"hinge": RATIO}}],
    )


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_closing_joints_are_followed_turn_after_turn(formulation: str) -> None:
    """No force acts, so that rates stay."""
    run = erls.simulate(hinged("planar", formulation=formulation), verdict=False)
    wheel, turned = run.joint_angle("wheel", [0.0, 1.0]), run.joint_angle("carrier/turn", [0.0, 1.0])
    np.testing.assert_allclose(wheel, RATIO * turned, rtol=0, atol=1e-9)
    np.testing.assert_allclose(turned[1], 15.0, rtol=1e-8)


def test_closing_joints_whose_turns_are_lost_are_not_followed() -> None:
    with pytest.raises(SceneError, match=r"couplings\[0\]\.follows: turns of this joint cannot be counted"):
        erls.simulate(hinged("spherical"))


@pytest.mark.parametrize(
    ("coupling", "field", "words"),
    [
        ({"joint": "whel"}, "couplings[0].joint", "wheel"),
        ({"follows": {}}, "couplings[0].follows", "no joint to follow"),
        ({"follows": {"wheel": 1.0}}, "couplings[0].follows.wheel", "does not follow itself"),
        ({"follows": {"motor": 0.0}}, "couplings[0].follows.motor", "not 0"),
        ({"damping": 1.0}, "couplings[0].damping", "ideal"),
        ({"stiffness": -1.0}, "couplings[0].stiffness", "0 or more"),
        ({"name": "motor"}, "couplings[0].name", "must differ"),
        ({"stops": {"stiffness": 1.0, "restitution": 0.5}}, "couplings[0].stops", "lower"),
    ],
)
def test_faults_name_their_field(coupling: dict[str, Any], field: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        erls.simulate(geared(coupling))
    assert field in str(caught.value)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({"gauge": "minimum-norm"}, "gauge"),
        ({"formulation": "ffr", "coordinates": "absolute"}, "coordinates"),
        ({"formulation": "nodal"}, "formulation"),
        ({"bandwidth": 100.0}, "bandwidth"),
    ],
)
def test_settings_that_do_not_know_couplings_refuse_them(settings: dict[str, Any], field: str) -> None:
    with pytest.raises(SceneError, match=field):
        geared({}, **settings)

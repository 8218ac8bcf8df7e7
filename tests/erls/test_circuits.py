"""Motors with an electric circuit: closed forms, energy, controllers, faults."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from resumed_runs import chunks_of, equal
from test_resume import at_every_look, stopped

import erls
from erls.errors import SceneError
from erls.run.checkpoints import Checkpoints, read_checkpoint

INERTIA, OHM, HENRY, CONSTANT, GEAR, VOLT = 0.02, 1.2, 3e-3, 0.05, 10.0, 6.0
G = GEAR * CONSTANT
MATRIX = np.array([[-OHM / HENRY, -G / HENRY], [G / INERTIA, 0.0]])  # of current and rate
CIRCUIT = {"gear_ratio": GEAR, "resistance": OHM, "inductance": HENRY, "torque_constant": CONSTANT}
STEP = {"type": "voltage", "profiles": [{"shape": "constant", "value": VOLT}]}


def axis(drive: dict[str, Any], motor: dict[str, Any] = CIRCUIT, **settings: Any) -> Any:
    """A disc on a motor."""
    body = {"mass": 1.0, "inertia": [0.0, 0.0, INERTIA], "points": {"seat": [0.0, 0.0, 0.0]}}
    joint = {"name": "axis", "dh": {"convention": "standard"}, "motor": motor, "drive": drive}
    return erls.make_scene(
        gravity=[0.0, 0.0, 0.0],
        simulation={"duration": 0.1, **settings},
        joints=[joint],
        links=[{"name": "disc", "rigid": body}],
    )


def exact(t: float) -> np.ndarray:
    """(2,) current and rate after a step of the voltage."""
    whole = np.zeros((3, 3))
    whole[:2, :2], whole[0, 2] = MATRIX, VOLT / HENRY
    return np.asarray((la.expm(whole * t) @ [0.0, 0.0, 1.0])[:2])


@pytest.mark.parametrize(
    ("formulation", "integrator"), [("erls", "auto"), ("ffr", "auto"), ("erls", "generalized_alpha"), ("erls", "rk45")]
)
def test_a_step_of_the_voltage(formulation: str, integrator: str) -> None:
    """Current and rate are those of the two linear equations, to the tolerance; the torque is g i, and what the battery
    gave is in the disc, in the field and in the warm resistor.
    """
    run = erls.simulate(axis(STEP, formulation=formulation, integrator=integrator))
    times = np.linspace(0.0, 0.1, 201)
    current, rate = run.joint_rate("axis charge", times), run.joint_rate("axis", times)
    expected = np.array([exact(float(t)) for t in times])
    np.testing.assert_allclose(current, expected[:, 0], atol=2e-4 * VOLT / OHM)
    np.testing.assert_allclose(rate, expected[:, 1], atol=2e-4 * VOLT / G)
    np.testing.assert_allclose(run.joint_effort("axis", times), G * current, rtol=1e-9, atol=1e-12)
    kinetic = INERTIA * rate**2 / 2 + HENRY * current**2 / 2
    np.testing.assert_allclose(run.energy(times).total, kinetic, rtol=1e-9, atol=1e-12)
    charge = run.joint_angle("axis charge", 0.1)
    lost = float(np.sum((current[1:] ** 2 + current[:-1] ** 2) / 2)) * OHM * (times[1] - times[0])
    assert VOLT * charge == pytest.approx(kinetic[-1] + lost, rel=1e-3)  # of the trapezoidal rule
    assert run.trust.verdict == "good"


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_motors_on_one_gear(formulation: str) -> None:
    """Two axes whose discs a belt ties, the second without a battery: the three linear equations, to the tolerance."""
    ratio, one = 0.5, axis(STEP)
    body = {"mass": 1.0, "inertia": [0.0, 0.0, INERTIA], "points": {"seat": [0.0, 0.0, 0.0]}}
    other = {"name": "other", "dh": {"convention": "standard"}, "on": "ground", "branch": {"position": [0.3, 0.0, 0.0]}}
    scene = erls.make_scene(
        gravity=[0.0, 0.0, 0.0],
        simulation={"duration": 0.1, "formulation": formulation},
        joints=[one.record.joints[0], {**other, "motor": CIRCUIT}],
        links=[{"name": name, "rigid": body} for name in ("disc", "second")],
        couplings=[{"name": "belt", "joint": "other", "follows": {"axis": ratio}}],
    )
    run = erls.simulate(scene, verdict=False)
    whole, inertia = np.zeros((4, 4)), INERTIA * (1 + ratio**2)
    whole[0] = [-OHM / HENRY, 0.0, -G / HENRY, VOLT / HENRY]
    whole[1, 1:3] = -OHM / HENRY, -G * ratio / HENRY
    whole[2, :2] = G / inertia, G * ratio / inertia
    expected = la.expm(0.1 * whole)[:3, 3]
    found = [run.joint_rate(name, 0.1) for name in ("axis charge", "other charge", "axis")]
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-4 * VOLT / OHM)


def test_a_motor_at_its_end_speed_takes_no_current() -> None:
    """The back-EMF is the whole voltage; a motor that is held has V / R after some L / R."""
    free = erls.simulate(axis(STEP, duration=2.0), verdict=False)
    np.testing.assert_allclose(free.joint_rate("axis", 2.0), VOLT / G, rtol=1e-6)
    held = axis(STEP, {**CIRCUIT, "rotor_inertia": 1e6})
    at = HENRY / OHM
    run = erls.simulate(held, verdict=False)
    np.testing.assert_allclose(run.joint_rate("axis charge", at), VOLT / OHM * (1 - np.exp(-1)), rtol=1e-4)


def test_poles_are_those_of_the_equations() -> None:
    """Beside those of the charge and of the angle, which act on nothing."""
    model = erls.linearize(axis(STEP), at=0.0, inputs=["joint.axis charge.effort"], outputs=["joint.axis.rate"])
    poles = np.sort([mode.pole.real for mode in model.modes])
    np.testing.assert_allclose(poles[:2], np.sort(np.linalg.eigvals(MATRIX).real), rtol=1e-7)
    np.testing.assert_allclose(poles[2:], 0.0, atol=1e-5)


@pytest.mark.parametrize("integrator", ["auto", "generalized_alpha"])
def test_controllers_command_voltages(integrator: str) -> None:
    """A torque at rest and gains make u = R τ / g, by an independent integration; limited as the torque is."""
    gains, wanted, limit = (5.0, 0.3), 0.5, 1.5
    drive = {"type": "pd", "proportional_gain": gains[0], "derivative_gain": gains[1], "torque_limit": limit,
             "motion": {"shape": "table", "times": [0.0, 1.0, 2.0, 3.0], "values": [wanted] * 4}}  # fmt: skip
    run = erls.simulate(axis(drive, integrator=integrator), verdict=False)
    state, h = np.zeros(3), 1e-5  # angle, rate, current; by the explicit midpoint rule

    def slope(x: np.ndarray) -> np.ndarray:
        torque = np.clip(gains[0] * (wanted - x[0]) - gains[1] * x[1], -limit, limit)
        return np.array([x[1], G * x[2] / INERTIA, (OHM * torque / G - OHM * x[2] - G * x[1]) / HENRY])

    for _ in range(10_000):
        state = state + h * slope(state + h / 2 * slope(state))
    found = [run.joint_angle("axis", 0.1), run.joint_rate("axis", 0.1), run.joint_rate("axis charge", 0.1)]
    np.testing.assert_allclose(found, state, rtol=1e-4)


def test_a_short_inductance_comes_to_a_damper() -> None:
    """To first order in L / R: ten times shorter, a tenth as far from a torque R⁻¹ g V and a damper of g² / R."""
    rates = VOLT / G * (1 - np.exp(-0.05 * G**2 / OHM / INERTIA))
    off = [
        abs(erls.simulate(axis(STEP, {**CIRCUIT, "inductance": henry}), verdict=False).joint_rate("axis", 0.05) - rates)
        for henry in (1e-4, 1e-5)
    ]
    assert off[1] < 0.15 * off[0]


def test_inputs_and_derivatives() -> None:
    """A stepper takes volts, and derivatives by the resistance are those of runs beside it."""
    stepper = erls.stepper(axis(STEP))
    assert stepper.input_names == ("axis",)
    for _ in range(100):
        stepper.step({"axis": VOLT}, 1e-4, held=True)
    np.testing.assert_allclose(stepper.state[1], exact(0.01)[::-1], rtol=1e-3)
    key, h = "joints.axis.motor.resistance", 1e-3
    found = erls.sensitivities(axis(STEP), {"rate": lambda run: run.joint_rate("axis", 0.05)}, [key])
    ends = [
        erls.simulate(
            axis(STEP, {**CIRCUIT, "resistance": OHM + sign * h}, tolerance=1e-8), verdict=False
        ).joint_rate("axis", 0.05)
        for sign in (-1, 1)
    ]
    np.testing.assert_allclose(found.derivatives["rate"][key], (ends[1] - ends[0]) / (2 * h), rtol=1e-4)


def test_a_flexible_arm_agrees_between_formulations() -> None:
    """The shipped one, to the tolerance; a run file keeps the currents."""
    path = Path(__file__).parents[2] / "data/robot/servo.toml"
    runs = [
        erls.simulate(erls.load_scene(path, ["simulation.duration=0.15", f"simulation.formulation={name}"]))
        for name in ("erls", "ffr")
    ]
    currents = [run.sensor("current", [0.05, 0.15]) for run in runs]
    np.testing.assert_allclose(currents[1], currents[0], rtol=1e-3)
    np.testing.assert_allclose(runs[1].position("hand", 0.15), runs[0].position("hand", 0.15), atol=2e-5)


@pytest.mark.parametrize("settings", [{}, {"integrator": "generalized_alpha", "step": 1e-3}])
def test_currents_go_on_through_the_file(
    settings: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that was stopped and resumed is that of one go, bit for bit."""
    at_every_look(monkeypatch)
    chunks_of(random.Random(4), monkeypatch)
    scene, path = tmp_path / "scene.toml", tmp_path / "r.partial"
    erls.save_scene(scene, axis(STEP, duration=0.02, **settings))
    whole = erls.simulate(scene, verdict=False)
    assert stopped(scene, path, 4) > 0
    run = erls.simulate(scene, checkpoint=Checkpoints(path, saved=read_checkpoint(path)), verdict=False)
    assert equal(run.solution, whole.solution)


@pytest.mark.parametrize(
    ("motor", "drive", "field", "words"),
    [
        ({"resistance": 1.0}, STEP, "motor.inductance", "all of"),
        ({**CIRCUIT, "inductance": 0.0}, STEP, "motor.inductance", "above 0"),
        ({**CIRCUIT, "gear_ratio": 0.0}, STEP, "motor.gear_ratio", "turns"),
        ({}, STEP, "drive.type", "circuit"),
        (
            CIRCUIT,
            {"type": "motion", "motion": {"shape": "polynomial", "from": 0, "to": 1, "duration": 1}},
            "drive.type",
            "no voltage",
        ),
    ],
)
def test_faults_name_their_field(motor: dict[str, Any], drive: dict[str, Any], field: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        axis(drive, motor)
    assert field in str(caught.value)
    assert words in str(caught.value)


def test_joints_of_several_coordinates_have_no_circuit() -> None:
    one = axis(STEP).record
    with pytest.raises(SceneError, match=r"joints\[0\]\.motor: a spherical joint has no single coordinate"):
        erls.make_scene(
            simulation={"duration": 0.1},
            joints=[{"name": "ball", "type": "spherical", "dh": {"convention": "standard"}, "motor": CIRCUIT}],
            links=one.links,
        )


def test_formulations_without_circuits_refuse_them() -> None:
    with pytest.raises(SceneError, match="circuits of motors"):
        axis(STEP, formulation="nodal")

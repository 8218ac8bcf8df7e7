"""Linear models of rigid mechanisms against hand-derived equations; inputs, outputs, zeros, what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import loop_scenes
import numpy as np
import pytest
import scenes
from body_scenes_data import PENDULUM, STRIP, body_scene

import erls
from erls.errors import Cause, SceneError, SimulationError
from erls.linear.diagrams import campbell
from erls.linear.response import frequency_response
from erls.linear.zeros import transmission_zeros

G = 9.81
LENGTHS, MASSES = (0.6, 0.4), (2.0, 1.5)
GAINS = (40.0, 3.0)
WANTED = {"shape": "sine", "amplitude": 0.3, "frequency_hz": 1.5, "offset": -0.5, "phase_deg": 30.0}
OUTPUTS = [
    *("joint.j1.angle", "joint.j1.rate", "joint.j2.acceleration", "joint.j1.effort", "joint.j2.effort"),
    *("point.tip.x", "point.tip.velocity.z", "point.tip.acceleration.x", "point.tip.acceleration.z"),
    *("sensor.imu", "sensor.gyro.z"),
]


def arm(folder: Path, **changes: Any) -> Path:
    """Two rigid bars in the plane of x and z, the first joint with spring, damper and rotor, the second driven."""
    joints = [
        loop_scenes.joint("j1", LENGTHS[0], stiffness=5.0, damping=0.7, motor={"rotor_inertia": 0.02}),
        loop_scenes.joint("j2", LENGTHS[1]),
    ]
    for joint, (position, rate) in zip(joints, ((0.4, 1.1), (-0.9, -2.3)), strict=True):
        joint["initial"] = {"position_deg": float(np.degrees(position)), "rate_deg": float(np.degrees(rate))}
    links = [
        {"name": f"l{k}", "rigid": loop_scenes.bar(*sizes), "mesh_pose": {"frame": "joint"}}
        for k, sizes in enumerate(zip(LENGTHS, MASSES, strict=True), start=1)
    ]
    gains = {"proportional_gain": GAINS[0], "derivative_gain": GAINS[1]}
    joints[1]["drive"] = {"type": "pd", "motion": WANTED, **gains}
    data = {
        "simulation": {"duration": 1.0, "step": 1e-3},
        "base": {"rotation_deg": [90.0, 0.0, 0.0]},
        "joints": joints,
        "links": links,
        "points": [{"name": "tip", "link": "l2", "node": "tip"}],
        "loads": [{"point": "tip", "force": [2.0, 0.0, 1.0]}],
        "sensors": [
            {"type": "accelerometer", "name": "imu", "point": "tip", "direction": [1.0, 0.0, 0.0]},
            {"type": "gyroscope", "name": "gyro", "point": "tip"},
        ],
    }
    return scenes.write_toml(folder / "arm.toml", scenes.merged(data, changes))


def _accelerations(q: Any, v: Any, force: Any) -> Any:
    """(2,) of the joints under generalized forces, with weight: the planar arm of every textbook."""
    (l1, l2), (m1, m2) = LENGTHS, MASSES
    c1, c2, i1, i2 = l1 / 2, l2 / 2, m1 * l1**2 / 12, m2 * l2**2 / 12
    cos, sin = np.cos(q[1]), np.sin(q[1])
    m22, m12 = i2 + m2 * c2**2, i2 + m2 * (c2**2 + l1 * c2 * cos)
    m11 = i1 + m1 * c1**2 + m2 * l1**2 + 2 * m2 * l1 * c2 * cos + m22 + 0.02
    h = m2 * l1 * c2 * sin
    weight = m2 * c2 * G * np.cos(q[0] + q[1])
    balance = np.array([
        force[0] + h * (2 * v[0] * v[1] + v[1] ** 2) - (m1 * c1 + m2 * l1) * G * np.cos(q[0]) - weight,
        force[1] - h * v[0] ** 2 - weight,
    ])
    return np.array([m22 * balance[0] - m12 * balance[1], m11 * balance[1] - m12 * balance[0]]) / (m11 * m22 - m12**2)


def _tip(q: Any, v: Any, a: Any) -> Any:
    """(3, 2) place, velocity and acceleration in x and z."""
    (l1, l2), p = LENGTHS, q[0] + q[1]
    turn, spin, gain = np.array([q[0], p]), np.array([v[0], v[0] + v[1]]), np.array([a[0], a[0] + a[1]])
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    arms = np.array([l1, l2])
    return np.array([along @ arms, across @ (arms * spin), across @ (arms * gain) - along @ (arms * spin**2)])


def _complex_step(function: Callable[[Any, Any], Any], x: Any, u: Any) -> tuple[Any, Any]:
    """Jacobians by states and inputs, right to rounding."""
    n, r = len(x), len(u)
    both = np.concatenate([x, u]).astype(complex)
    rows = []
    for k in range(n + r):
        moved = both.copy()
        moved[k] += 1e-30j
        rows.append(np.asarray(function(moved[:n], moved[n:])).imag / 1e-30)
    return np.array(rows[:n]).T, np.array(rows[n:]).T


def _near(found: Any, wanted: Any, share: float = 1e-10) -> None:
    """Equal to a share of the largest entry: of slopes, 1e-13 and the size of a force beside the stiffness."""
    np.testing.assert_allclose(found, wanted, rtol=0, atol=share * np.abs(wanted).max(initial=1e-300))


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_moving_arm_against_hand_derived_equations(tmp_path: Path, formulation: str) -> None:
    """A, B, C, D of a two-link arm in full motion, to 1e-10: efforts, a wanted motion, a load and a force; sensors.

    Closed form differentiated by the complex step.
    """
    inputs = ["joint.j1.effort", "joint.j2.effort", "joint.j2.acceleration", "point.tip.force.z", "load.0.factor"]
    path = arm(tmp_path, simulation={"duration": 1.0, "step": 1e-3, "formulation": formulation})
    model = erls.linearize(path, inputs=inputs, outputs=OUTPUTS)
    omega, phase = 2 * np.pi * 1.5, np.radians(30.0)
    motion = [-0.5 + 0.3 * np.sin(phase), 0.3 * omega * np.cos(phase)]

    def parts(x: Any, u: Any) -> tuple[Any, Any, Any]:
        q, v, s, rate = x[:2], x[2:4], x[4], x[5]
        efforts = np.array([-5.0 * q[0] - 0.7 * v[0] + u[0], GAINS[0] * (s - q[1]) + GAINS[1] * (rate - v[1]) + u[1]])
        (l1, l2), p = LENGTHS, q[0] + q[1]
        pushes = 2.0 * (1.0 + u[4]), u[3] + 1.0 + u[4]
        push = pushes[0] * np.array([-l1 * np.sin(q[0]) - l2 * np.sin(p), -l2 * np.sin(p)])
        push = push + pushes[1] * np.array([l1 * np.cos(q[0]) + l2 * np.cos(p), l2 * np.cos(p)])
        return efforts, push, _accelerations(q, v, efforts + push)

    def rates(x: Any, u: Any) -> Any:
        return np.array([*x[2:4], *parts(x, u)[2], x[5], u[2]])

    def seen(x: Any, u: Any) -> Any:
        efforts, _, a = parts(x, u)
        tip = _tip(x[:2], x[2:4], a)
        p = x[0] + x[1]
        felt = tip[2, 0] * np.cos(p) + (tip[2, 1] + G) * np.sin(p)
        return np.array([x[0], x[2], a[1], *efforts, tip[0, 0], tip[1, 1], *tip[2], felt, x[2] + x[3]])

    start = np.array([0.4, -0.9, 1.1, -2.3, *motion])
    still = np.array([0.0, 0.0, -0.3 * omega**2 * np.sin(phase), 0.0, 0.0])
    (a, b), (c, d) = _complex_step(rates, start, still), _complex_step(seen, start, still)
    _near(model.A, a)
    _near(model.B, b)
    exact = [k for k, name in enumerate(OUTPUTS) if "velocity" not in name and "acceleration.x" not in name]
    exact = [k for k in exact if "acceleration.z" not in OUTPUTS[k]]
    _near(model.C[exact], c[exact])
    _near(model.D, d)
    _near(model.C, c, 1e-7)  # rates of places: differences along the motion
    np.testing.assert_allclose(model.values[exact], seen(start, still)[exact], atol=1e-9)
    assert not model.steady
    assert model.states[-2:] == ("motion of joint.j2", "rate of the motion of joint.j2")


def test_prescribed_joint_against_hand_derived_equations(tmp_path: Path) -> None:
    """The first joint turns as prescribed, at rest: its acceleration moves the second one, and takes an effort."""
    motion = {"shape": "polynomial", "from": 0.4, "to": 0.5, "start": 10.0, "duration": 1.0}
    path = arm(tmp_path)
    data = scenes.read_toml(path)
    data["joints"][0] |= {"drive": {"type": "motion", "motion": motion}, "stiffness": 0.0, "damping": 0.0}
    data["joints"][0].pop("initial")
    data["joints"][1]["drive"] = {"type": "free"}
    data["joints"][1]["initial"] = {"position_deg": float(np.degrees(-0.9))}
    data["loads"] = []
    outputs = ["joint.j1.effort", "joint.j2.angle", "point.tip.z"]
    scenes.write_toml(path, data)
    model = erls.linearize(path, outputs=outputs)
    assert {channel.name for channel in model.inputs} == {"joint.j1.acceleration", "joint.j2.effort"}
    model = erls.linearize(path, inputs=["joint.j1.acceleration", "joint.j2.effort"], outputs=outputs)

    def solved(x: Any, u: Any) -> tuple[Any, Any]:
        """Acceleration of the second joint and effort of the first: linear in both, so that two trials tell."""
        q, v = np.array([x[2], x[0]]), np.array([x[3], x[1]])
        free = _accelerations(q, v, np.array([0.0, u[1]]))
        push = _accelerations(q, v, np.array([1.0, u[1]])) - free
        effort = (u[0] - free[0]) / push[0]
        return (free + push * effort)[1], effort

    def rates(x: Any, u: Any) -> Any:
        return np.array([x[1], solved(x, u)[0], x[3], u[0]])

    def seen(x: Any, u: Any) -> Any:
        effort = solved(x, u)[1]
        return np.array([effort, x[0], _tip(np.array([x[2], x[0]]), 0 * x[:2], 0 * x[:2])[0, 1]])

    start = np.array([-0.9, 0.0, 0.4, 0.0])
    (a, b), (c, d) = _complex_step(rates, start, np.zeros(2)), _complex_step(seen, start, np.zeros(2))
    _near(model.A, a)
    _near(model.B, b)
    _near(model.C, c)
    _near(model.D, d)


def _pendulum(folder: Path, degrees: float, **joint: Any) -> Path:
    links = [{"name": "rod", "rigid": loop_scenes.bar(1.0, 2.0), "mesh_pose": {"frame": "joint"}}]
    data = {
        "simulation": {"duration": 1.0, "step": 1e-3},
        "base": {"rotation_deg": [90.0, 0.0, 0.0]},
        "joints": [loop_scenes.joint("hinge", 1.0, degrees, **joint)],
        "links": links,
        "points": [{"name": "tip", "link": "rod", "node": "tip"}],
    }
    return scenes.write_toml(folder / "pendulum.toml", data)


@pytest.mark.parametrize(
    ("start_deg", "rest_deg", "formulation"),
    [(80.0, 90.0, "erls"), (-60.0, -90.0, "erls"), (0.0, -90.0, "erls"), (0.0, -90.0, "nodal")],
)
def test_pendulum_falls_and_swings_at_its_closed_form(
    tmp_path: Path, start_deg: float, rest_deg: float, formulation: str
) -> None:
    """Equilibria next to the start: upright with the pole √(3 g / 2 l), named; hanging at the same frequency.

    Where it is level nothing holds it, and it falls.
    """
    scene = erls.load_scene(_pendulum(tmp_path, start_deg), [f"simulation.formulation={formulation}"])
    model = erls.linearize(scene, at="equilibrium")
    pole = np.sqrt(1.5 * G)
    assert np.degrees(model.values[0]) == pytest.approx(rest_deg, abs=1e-7)
    np.testing.assert_allclose(np.sort_complex(model.poles**2), [pole**2 * np.sign(rest_deg)] * 2, rtol=1e-9)
    assert [mode.moves for mode in model.unstable] == (["joint hinge"] if rest_deg > 0 else [])
    assert model.steady


def test_free_fall_has_no_equilibrium_and_weightless_parts_stay(tmp_path: Path) -> None:
    """A slider under its weight is refused; without weight it rests where it is, with two poles at zero."""
    falling = _pendulum(tmp_path, 0.0)
    data = scenes.read_toml(falling)
    data["joints"] = [{"name": "slide", "type": "prismatic", "dh": {"convention": "standard"}}]
    data["base"] = {}
    with pytest.raises(SimulationError, match="nothing balances its forces") as caught:
        erls.linearize(scenes.write_toml(falling, data), at="equilibrium")
    assert caught.value.cause == Cause.NO_EQUILIBRIUM
    model = erls.linearize(scenes.write_toml(falling, {**data, "gravity": [0.0, 0.0, 0.0]}), at="equilibrium")
    assert model.poles.tolist() == [0.0, 0.0]
    assert model.B[1, 0] == pytest.approx(1 / 2.0, rel=1e-12)


def test_four_bar_in_motion_is_a_system_of_one_freedom(tmp_path: Path) -> None:
    """Conditions, some of them redundant, leave one coordinate: the crank's acceleration over its angle and rate.

    Against differences of the closed mechanism's accelerations at other cranks, steps of 0.05 deg: 1e-6 of the slopes.
    """

    def acceleration(degrees: float, rate_deg: float, effort: float) -> float:
        data = loop_scenes.four_bar()
        constant = {"shape": "constant", "value": effort}
        data["joints"][0]["drive"] = {"type": "torque", "profiles": [constant]}
        data["joints"][0]["initial"] = {"position_deg": degrees, "rate_deg": rate_deg}
        chain = loop_scenes.chain(tmp_path, data)
        return float(chain.accelerations(0.0, *chain.initial_state())[0][0])

    data, h = loop_scenes.four_bar(), 0.05
    data["joints"][0]["initial"] = {"position_deg": 60.0, "rate_deg": 100.0}
    quantities = ("angle", "rate", "acceleration")
    path = scenes.write_toml(tmp_path / "four.toml", data)
    model = erls.linearize(path, inputs=["joint.j0.effort"], outputs=[f"joint.j0.{name}" for name in quantities])
    assert model.size == 1
    found = model.C[2] @ np.linalg.inv(model.C[:2])  # per angle and rate of the crank
    by_place = (acceleration(60 + h, 100.0, 0.0) - acceleration(60 - h, 100.0, 0.0)) / np.radians(2 * h)
    by_rate = (acceleration(60.0, 101.0, 0.0) - acceleration(60.0, 99.0, 0.0)) / np.radians(2.0)
    by_effort = (acceleration(60.0, 100.0, 0.1) - acceleration(60.0, 100.0, -0.1)) / 0.2
    np.testing.assert_allclose(found, [by_place, by_rate], rtol=1e-5)
    assert model.D[2, 0] == pytest.approx(by_effort, rel=1e-9)


def test_zeros_of_a_known_system() -> None:
    """(s + 2)(s² + 9) over (s + 1)(s² + 4)(s + 5), and none of 1 / s²."""
    from scipy.signal import tf2ss

    system = tf2ss(np.poly([-2, 3j, -3j]), np.poly([-1, 2j, -2j, -5]))
    np.testing.assert_allclose(np.sort_complex(transmission_zeros(*system)), [-2, -3j, 3j], atol=1e-12)
    assert len(transmission_zeros(*tf2ss([1.0], [1.0, 0.0, 0.0]))) == 0


def test_zeros_of_more_outputs_than_inputs() -> None:
    """[(s + 2)(s + 3), (s + 2)(s² + 9)] over one denominator have the common zero alone, and so has its transpose; two
    transfer functions without a common one have none.
    """
    from scipy.signal import tf2ss

    poles = np.poly([-1, 2j, -2j, -5]).real
    numerators = np.array([[0.0, *np.poly([-2, -3])], np.poly([-2, 3j, -3j]).real])
    a, b, c, d = tf2ss(numerators, poles)
    np.testing.assert_allclose(transmission_zeros(a, b, c, d), [-2], atol=1e-9)
    np.testing.assert_allclose(transmission_zeros(a.T, c.T, b.T, d.T), [-2], atol=1e-9)
    numerators[0] = [0.0, *np.poly([-4, -3])]
    assert len(transmission_zeros(*tf2ss(numerators, poles))) == 0


@pytest.mark.parametrize(
    ("arguments", "cause", "words"),
    [
        ({"inputs": ["joint.elbow.effort"]}, Cause.BAD_REFERENCE, "no such input"),
        ({"outputs": ["point.tip.w"]}, Cause.BAD_REFERENCE, "no such output"),
        ({"outputs": ["point.tip.x", "point.tip.x"]}, Cause.BAD_REFERENCE, "named twice"),
        ({"at": "somewhere"}, Cause.BAD_FIELD, "'equilibrium'"),
        ({"at": -1.0}, Cause.TIME_OUT_OF_RANGE, "0 or later"),
        ({"at": 1e3}, Cause.TIME_OUT_OF_RANGE, "ends before this time"),
        ({"at": float("nan")}, Cause.TIME_OUT_OF_RANGE, "0 or later"),
    ],
)
def test_faulty_requests(tmp_path: Path, arguments: dict[str, Any], cause: Cause, words: str) -> None:
    """Are refused with what is known."""
    with pytest.raises(SceneError, match=words) as caught:
        erls.linearize(_pendulum(tmp_path, 0.0), **arguments)
    assert caught.value.cause == cause


def test_hanging_body_swings_at_its_closed_form(tmp_path: Path) -> None:
    """A scene of bodies, its pin five conditions: ω² = m g l / (J + m l²), and 1 / (J + m l²) per force on it."""
    bodies = [{**PENDULUM["bodies"][0], "position": [0.3, 0.0, -0.9]}]
    path = body_scene(tmp_path, PENDULUM, bodies=bodies)
    outputs = ["point.bob.z", "point.bob.x", "point.bob.acceleration.x"]
    model = erls.linearize(path, at="equilibrium", inputs=["point.bob.force.x"], outputs=outputs)
    length = np.hypot(0.3, 0.9)
    inertia = 0.2 + 2.0 * length**2
    assert model.size == 1
    np.testing.assert_allclose(model.poles**2, [-2.0 * G * length / inertia] * 2, rtol=1e-9)
    np.testing.assert_allclose(model.values[:2], [-length, 0.0], atol=1e-9)
    np.testing.assert_allclose(model.D[:, 0], [0.0, 0.0, length**2 / inertia], atol=1e-9)


def test_strip_gives_way_as_it_is_pushed(tmp_path: Path) -> None:
    """Beams: L³ / 3 EI at the tip, by a force and by the factor of a load that hardly bends them.

    Of 8 and 16 elements, whose errors are of second order; shear gives 6e-5.
    """
    found = []
    for elements in (8, 16):
        beams, loads = [{**STRIP["beams"][0], "elements": elements}], [{"node": "tip", "force": [0.0, 0.0, 1e-6]}]
        path = body_scene(tmp_path, STRIP, beams=beams, loads=loads)
        model = erls.linearize(path, inputs=["point.tip.force.z", "load.0.factor"], outputs=["point.tip.z"])
        found.append(frequency_response(model, [1e-5])[0, 0].real)
    bending, compliance = 1e6 * 0.1 * 0.02**3 / 12, (4 * found[1] - found[0]) / 3
    np.testing.assert_allclose(compliance, np.array([1.0, 1e-6]) * 2.0**3 / (3 * bending), rtol=2e-4)
    with pytest.raises(SceneError, match="no such input"):
        erls.linearize(path, inputs=["joint.clamp.effort"])


def test_diagrams_of_scenes_of_bodies_are_refused() -> None:
    """By name."""
    with pytest.raises(SceneError, match="scene of bodies"):
        campbell(scenes.ROOT / "data/heavy_top/fast.toml", "tip", [1.0])

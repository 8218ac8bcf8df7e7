"""Steps one at a time: those of runs, inputs of one's own, states that are saved, and what is refused."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from numpy.typing import NDArray

import erls
from erls.errors import Cause, ReportedError, SimulationError
from erls.simulation.stepper import Stepper

Array = NDArray[np.float64]
MOTOR = {"rotor_inertia": 1e-4, "gear_ratio": 10.0}
STEP = 2.0**-10  # s: multiples of it are exact, so that times of runs and of steppers are the same numbers
IMU = [
    {"name": "acc", "type": "accelerometer", "point": "tip"},
    {"name": "tau", "type": "effort", "joint": "shoulder"},
    {"name": "angle", "type": "joint_angle", "joint": "shoulder"},
]


def moved(stepper: Stepper, steps: int, *inputs: Any) -> tuple[Array, Array, Array]:
    """The state after some steps."""
    for _ in range(steps):
        stepper.step(*inputs)
    return stepper.state


def apart(stepper: Stepper, run: Any) -> tuple[float, float]:
    """Largest differences of coordinates and rates at the end of a run."""
    y, v, _ = stepper.state
    assert stepper.time == run.end
    return float(np.abs(y - run.solution.y[-1]).max()), float(np.abs(v - run.solution.v[-1]).max())


@pytest.mark.parametrize(
    ("scene", "changes", "limit"),
    [
        ("l_shape/steel_tall.toml", [], 0.0),  # bit for bit
        ("l_shape/steel_tall.toml", ["simulation.formulation=ffr"], 0.0),
        ("robot/three_link.toml", [], 1e-13),  # the last step of a run ends a hair before a jump
        ("four_bar/flexible.toml", [], 1e-7),  # what Newton's method leaves of a step, 1e-11 m / STEP
    ],
)
def test_steps_are_those_of_a_run(scene: str, changes: list[str], limit: float) -> None:
    """Without inputs a stepper makes the run of the scene."""
    settings = [f"simulation.step={STEP}", f"simulation.duration={20 * STEP}", *changes]
    loaded = erls.load_scene(scenes.ROOT / "data" / scene, settings)
    run, stepper = erls.simulate(loaded, verdict=False), erls.stepper(loaded)
    moved(stepper, 20)
    assert max(apart(stepper, run)) <= limit


def driven(folder: Path, **changes: Any) -> Path:
    """The L pendulum under a torque and a load that jump on the grid of steps, with sensors."""
    scenes.l_link(folder, 4)
    pulse = [{"shape": "step", "start": 4 * STEP, "end": 9 * STEP, "value": 0.7}, {"shape": "constant", "value": 0.2}]
    joint = {**scenes.L_SCENE["joints"][0], "drive": {"type": "torque", "profiles": pulse}}
    joint["motor"] = MOTOR
    burst = {"shape": "sine_burst", "start": 6 * STEP, "amplitude": 1.0, "frequency_hz": 1 / (8 * STEP), "cycles": 1.0}
    loads = [{"point": "tip", "force": [0.0, 3.0, 1.0], "factor": [burst]}, {"point": "elbow", "force": [0, 0, 0.5]}]
    simulation = {"duration": 20 * STEP, "step": STEP}
    given = {"joints": [joint], "loads": loads, "simulation": simulation, "sensors": IMU}
    return scenes.l_scene(folder, **{**given, **changes})


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_inputs_of_the_scene_give_its_run(tmp_path: Path, formulation: str) -> None:
    """Torques and loads with jumps: left to the scene, and set by hand where they do not jump. To rounding; readings of
    accelerations to what Newton's method leaves of them, 4e-11 m / STEP².
    """
    path = driven(tmp_path)
    scene = erls.load_scene(path, [f"simulation.formulation={formulation}"])
    run, stepper = erls.simulate(scene, verdict=False), erls.stepper(scene)
    assert stepper.input_names == ("shoulder", "loads[0]", "loads[1]")
    assert stepper.sensor_names == ("acc", "tau", "angle")
    for k in range(20):
        given = {"loads[1]": 1.0} if k % 2 else {"loads[1]": 1.0, "loads[0]": 0.0} if k < 4 else {}
        readings = stepper.step(given)
        t = stepper.time
        if k in (2, 7, 19):
            np.testing.assert_allclose(readings["acc"], run.sensor("acc", t), rtol=0, atol=5e-5)
            np.testing.assert_allclose(readings["angle"], run.sensor("angle", t), rtol=0, atol=1e-13)
    assert apart(stepper, run)[0] < 1e-12
    assert apart(stepper, run)[1] < 1e-9


def test_inputs_set_by_hand_do_what_the_scene_would(tmp_path: Path) -> None:
    """A constant torque and a constant factor, from a scene without them: the run of the scene with them, to rounding;
    the effort sensor reads the torque less what the rotor takes, and an input lasts for its step alone.
    """
    free = driven(tmp_path, joints=[{**scenes.L_SCENE["joints"][0], "motor": MOTOR}])
    changes = [
        'joints.0.drive={ type = "torque", profiles = [{ shape = "constant", value = 0.6 }] }',
        'loads.0.factor=[{ shape = "constant", value = -2.0 }]',
    ]
    run, stepper = erls.simulate(erls.load_scene(free, changes), verdict=False), erls.stepper(free)
    readings: dict[str, Any] = {}
    for _ in range(20):
        readings = stepper.step({"shoulder": 0.6, "loads[0]": -2.0})
    assert apart(stepper, run)[0] < 1e-12
    assert apart(stepper, run)[1] < 1e-9
    accelerated = stepper.state[2][0]
    assert readings["tau"] == pytest.approx(0.6 - 1e-2 * accelerated, rel=1e-9)
    stepper.step()
    assert stepper.readings()["tau"] == pytest.approx(-1e-2 * stepper.state[2][0], rel=1e-9)


def test_drives_of_closing_joints_are_inputs() -> None:
    """Both ways of turning the crank of a four-bar: the drive of its joint, as the scene has it and as an input."""
    profile = '{ type = "torque", profiles = [{ shape = "constant", value = -0.4 }] }'
    path = scenes.ROOT / "data" / "four_bar" / "flexible.toml"
    settings = [f"simulation.step={STEP}", f"simulation.duration={10 * STEP}", "initial.deformation=zero"]
    run = erls.simulate(erls.load_scene(path, [*settings, f"loops.rocker_pivot.drive={profile}"]), verdict=False)
    stepper = erls.stepper(erls.load_scene(path, settings))
    moved(stepper, 10, {"rocker_pivot": -0.4})
    assert apart(stepper, run)[0] < 1e-9  # Newton's method leaves 1e-11 m a step
    still = erls.stepper(erls.load_scene(path, settings))
    moved(still, 10)
    assert apart(still, run)[0] > 1e-6


def test_states_are_saved_bit_for_bit(tmp_path: Path) -> None:
    """Going back, and another stepper of the same scene, make the same numbers again; steps may have other lengths."""
    path = driven(tmp_path)
    stepper = erls.stepper(path)
    moved(stepper, 7, {"shoulder": 1.0})
    saved = stepper.save()
    wanted = [*moved(stepper, 3, {"loads[0]": 0.5}), *moved(stepper, 4, None, STEP / 3)]
    time = stepper.time
    for again in (stepper, erls.stepper(path)):
        again.restore(saved)
        assert again.time == 7 * STEP
        found = [*moved(again, 3, {"loads[0]": 0.5}), *moved(again, 4, None, STEP / 3)]
        assert again.time == time
        assert all(np.array_equal(a, b) for a, b in zip(found, wanted, strict=True))
    scenes.l_link(tmp_path, 4, reduction={"elastic_modes": 5})
    with pytest.raises(ReportedError) as caught:
        erls.stepper(path).restore(saved)
    assert str(caught.value.cause) == str(Cause.RUN_FILE)


def test_nothing_grows(tmp_path: Path) -> None:
    """Steps leave less than the knots of a run would take: a few kilobytes that Python keeps for reuse."""
    stepper = erls.stepper(driven(tmp_path, sensors=[]))
    moved(stepper, 20)
    tracemalloc.start()
    moved(stepper, 20)
    before = tracemalloc.get_traced_memory()[0]
    moved(stepper, 80)
    left = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert left < 80 * 3 * 8 * len(stepper.state[0])


@pytest.mark.parametrize(
    ("inputs", "h", "said"),
    [
        ({"elbow": 1.0}, None, "shoulder"),
        ({"shoulder": float("nan")}, None, "finite"),
        ({"shoulder": 1e40}, None, "plausible"),
        ({}, 0.0, "length"),
        ({}, float("inf"), "length"),
    ],
)
def test_bad_steps_are_refused(tmp_path: Path, inputs: dict[str, float], h: float | None, said: str) -> None:
    """Before anything moves."""
    stepper = erls.stepper(driven(tmp_path))
    with pytest.raises(ReportedError, match=said):
        stepper.step(inputs, h)
    assert stepper.time == 0.0


def test_what_cannot_be_stepped_is_said(tmp_path: Path) -> None:
    """With the field and a remedy; and a step that fails says when, and leaves the stepper where it was."""
    path = driven(tmp_path)
    for change, field in (
        ("simulation.formulation=nodal", "simulation.formulation"),
        ("simulation.bandwidth=50.0", "simulation.bandwidth"),
        ("simulation.effects=auto", "simulation.effects"),
    ):
        with pytest.raises(ReportedError) as caught:
            erls.stepper(erls.load_scene(path, [change]))
        assert field in str(caught.value)
        assert caught.value.exit_code == 2
    bodies = scenes.ROOT / "data" / "heavy_top" / "slow.toml"
    for given in (bodies, erls.load_scene(bodies)):
        with pytest.raises(ReportedError, match="chain"):
            erls.stepper(given)
    stepper, other = erls.stepper(path), erls.stepper(path)
    for _ in range(2):
        with pytest.raises(SimulationError, match="t = "):
            stepper.step({"shoulder": 1e25})
        found, wanted = moved(stepper, 3), moved(other, 3)
        assert stepper.time == other.time
        for a, b in zip(found, wanted, strict=True):  # but for factors that are made anew
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-7 * np.abs(b).max())


ENDS = {"root": [0, 0, 0], "bob": [0.5, 0, 0]}
BODY = {"mass": 2.0, "centre_of_mass": [0.5, 0, 0], "inertia": [0.1] * 3, "points": ENDS}
RIGID: dict[str, Any] = {
    "simulation": {"duration": 160 * STEP, "step": STEP},
    "links": [{"name": "arm", "rigid": BODY, "mesh_pose": {"frame": "joint"}}],
    "points": [{"name": "bob", "link": "arm", "node": "bob"}],
    "sensors": [{"name": "at", "type": "position", "point": "bob"}],
}


def test_nothing_free_is_moved_by_time_alone(tmp_path: Path) -> None:
    """A rigid link whose motion is prescribed has no coordinates, and is where its motion says."""
    motion = {"shape": "sine", "amplitude": 0.3, "frequency_hz": 1.0}
    joint = {"name": "j", "dh": {"convention": "standard", "a": 0.5}, "drive": {"type": "motion", "motion": motion}}
    stepper = erls.stepper(scenes.write_toml(tmp_path / "p.toml", {**RIGID, "joints": [joint]}))
    saved = stepper.save()
    angle = 0.3 * np.sin(2 * np.pi * 0.05)
    for _ in range(2):
        place = stepper.step({}, 0.05)["at"]
        np.testing.assert_allclose(place, 0.5 * np.array([np.cos(angle), np.sin(angle), 0.0]), rtol=0, atol=1e-12)
        stepper.restore(saved)
    assert (stepper.input_names, len(stepper.state[0])) == ((), 0)


def test_rotation_vectors_turn_on(tmp_path: Path) -> None:
    """A body in a ball joint beyond a full turn, where its vector is exchanged for a shorter one, as in its run."""
    turning = {"turn_x": {"initial": {"rate": 30.0}}}
    joint = {"name": "ball", "type": "spherical", "dh": {"convention": "standard", "a": 0.5}, "coordinates": turning}
    path = scenes.write_toml(tmp_path / "p.toml", {**RIGID, "joints": [joint]})
    run, stepper = erls.simulate(erls.load_scene(path), verdict=False), erls.stepper(path)
    y, v, _ = moved(stepper, 160)
    assert stepper.time * 30.0 > 1.25 * np.pi > np.linalg.norm(y)
    np.testing.assert_allclose(y, run.solution.y[-1], rtol=0, atol=1e-9)  # type: ignore[attr-defined]
    np.testing.assert_allclose(v, run.solution.v[-1], rtol=0, atol=1e-7)  # type: ignore[attr-defined]


def test_a_sampled_controller_with_a_delay() -> None:
    """A rigid arm without gravity under a PD controller that reads every fourth step and acts a sample later: the
    recursion x' = A x + B u of its exact discrete model, to rounding.
    """
    inertia, sample, gains = 0.05 + 0.5**2, 4 * STEP, np.array([2.0, 0.4])
    arm = {"mass": 1.0, "inertia": [0.0, 0.0, 0.05], "points": {"root": [-0.5, 0.0, 0.0], "tip": [0.0, 0.0, 0.0]}}
    scene = erls.make_scene(
        gravity=[0.0, 0.0, 0.0],
        simulation={"duration": 1.0, "step": STEP},
        joints=[{"name": "hip", "dh": {"convention": "standard", "a": 0.5}, "initial": {"position": 0.3}}],
        links=[{"name": "arm", "rigid": arm}],
    )
    stepper = erls.stepper(scene)
    moved, pushed = np.array([[1.0, sample], [0.0, 1.0]]), np.array([sample**2 / 2, sample]) / inertia
    x, torque = np.array([0.3, 0.0]), 0.0
    for _ in range(60):
        y, v, _ = stepper.state
        asked = -float(gains @ [y[0], v[0]])
        for _ in range(4):
            stepper.step({"hip": torque}, held=True)
        x, torque = moved @ x + pushed * torque, asked
    np.testing.assert_allclose([stepper.state[0][0], stepper.state[1][0]], x, rtol=0, atol=1e-11)

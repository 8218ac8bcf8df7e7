"""Linear models of flexible mechanisms: published frequencies, spinning beams, other formulations, time runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import loop_scenes
import numpy as np
import pytest
import scenes

import erls
from erls.errors import SceneError, SimulationError
from erls.linear.diagrams import campbell, root_locus
from erls.linear.model import LinearModel
from erls.linear.response import frequency_response, step_response, telling_frequencies, telling_times
from erls.report.linear_page import model_text
from erls.run.chain.run import ChainRun

TORQUE = scenes.ROOT / "data/l_shape/torque.toml"


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_frequencies_of_the_third_test_of_the_paper(formulation: str) -> None:
    """The L on its motor, weightless, joint free: 8.435, 23.165, 118.41, 173.84 Hz in its plane, which the joint turns.

    Across it those of the mesh of the paper, rounded as they are given.
    """
    changes = ["gravity=[0.0,0.0,0.0]", f"simulation.formulation={formulation}"]
    model = erls.linearize(erls.load_scene(TORQUE, changes), at="equilibrium")
    assert model.outputs[0].name == "joint.shoulder.angle"
    across = [mode.frequency_hz for mode in model.modes if mode.pole and abs(mode.seen[0]) > 1e-6]
    within = [mode.frequency_hz for mode in model.modes if mode.pole and abs(mode.seen[0]) < 1e-6]
    np.testing.assert_allclose(within[:4], [8.435, 23.165, 118.41, 173.84], rtol=5e-5)
    np.testing.assert_allclose(across[:4], [12.28, 31.0, 120.3, 151.9], rtol=2e-3)


@pytest.mark.parametrize("formulation", ["erls", "nodal"])
def test_campbell_diagram_of_a_spinning_beam(formulation: str) -> None:
    """The slow mode of a cantilever that turns in its plane: J. R. Wright et al., J. Appl. Mech. 49 (1982) 197-202.

    Their first frequency across the plane of rotation at η = 0, 1, 2, 3 in units of √(EI / ρA L⁴), less η² within it.
    Beam of data/spin_up: EI = 1.4e4 N m², ρA = 1.2 kg/m, L = 10 m; shear and rotary inertia take less than 1e-3 of it.
    """
    unit = np.sqrt(1.4e4 / 1.2) / 100
    turns = np.arange(4) if formulation == "erls" else np.array([0, 3])
    beam = erls.load_scene(scenes.ROOT / "data/spin_up/beam.toml", [f"simulation.formulation={formulation}"])
    found = campbell(beam, "hub", turns * unit)
    wright = np.array([3.5160, 3.6817, 4.1373, 4.7973])[turns]
    expected = np.sqrt(wright**2 - turns**2)
    np.testing.assert_allclose(found.poles.imag[:, 0] / unit, expected, rtol=1e-3)
    assert not found.warnings
    assert all(model.steady for model in found.models)


def _blade(folder: Path, axis_deg: float) -> Path:
    """A rigid blade on a hinge 0.2 m from the axis of a rigid hub, which turns about z; hinge across by an angle."""
    hub = {"mass": 1.0, "inertia": [0.1, 0.1, 0.1], "points": {"root": [0.0, 0.0, 0.0], "tip": [0.2, 0.0, 0.0]}}
    rod = loop_scenes.bar(1.0, 3.0)
    rod["inertia"] = [0.0, 3.0 / 12, 3.0 / 12]
    joints = [
        {"name": "mast", "dh": {"convention": "standard", "a": 0.2, "alpha_deg": axis_deg}},
        {"name": "hinge", "dh": {"convention": "standard", "a": 1.0}},
    ]
    links = [
        {"name": "hub", "rigid": hub, "mesh_pose": {"frame": "joint"}},
        {"name": "blade", "rigid": rod, "mesh_pose": {"frame": "joint"}},
    ]
    data = {"simulation": {"duration": 1.0}, "gravity": [0.0, 0.0, 0.0], "joints": joints, "links": links}
    return scenes.write_toml(folder / "blade.toml", data)


@pytest.mark.parametrize("formulation", ["erls", "nodal"])
@pytest.mark.parametrize(("axis_deg", "flaps"), [(0.0, 0.0), (90.0, 1.0)])
def test_campbell_diagram_of_a_hinged_blade(tmp_path: Path, axis_deg: float, flaps: float, formulation: str) -> None:
    """ω² = Ω² (m e c / I + 1) as it flaps, without the 1 as it lags: exact, e = 0.2 m, c = 0.5 m, I = m l² / 3."""
    speeds = [2.0, 30.0]
    blade = erls.load_scene(_blade(tmp_path, axis_deg), [f"simulation.formulation={formulation}"])
    found = campbell(blade, "mast", speeds)
    expected = np.array(speeds) * np.sqrt(0.2 * 0.5 * 3 + flaps)
    np.testing.assert_allclose(found.poles[:, 0], 1j * expected, rtol=1e-9)


def test_speed_beyond_all_numbers_has_no_equilibrium(tmp_path: Path) -> None:
    """Is told, and nothing else."""
    with pytest.raises(SimulationError, match="no equilibrium"):
        campbell(_blade(tmp_path, 0.0), "mast", [1e300])


def test_nodes_go_along_with_joints_on_the_ground_alone(tmp_path: Path) -> None:
    """Others are refused by name; so is rest, without a speed."""
    scene = erls.load_scene(_blade(tmp_path, 0.0), ["simulation.formulation=nodal"])
    with pytest.raises(SceneError, match="joint on the ground alone"):
        campbell(scene, "hinge", [1.0])


def test_real_parts_of_an_instant_are_marked() -> None:
    """Quick vibrations of an undamped L that swings: 1e-5 of the frequency is no growth and no decay."""
    model = erls.linearize(TORQUE, at=0.1)
    quick = {mode.pole for mode in model.modes if mode.frequency_hz > 160}
    assert not model.steady
    assert any(pole.real > 0 for pole in quick)
    assert all(model.noise(pole) for pole in quick)
    assert not {mode.pole for mode in model.unstable} & quick
    assert "~0 ± " in model_text(model)
    damped = erls.linearize(erls.load_scene(TORQUE, ["links.l.damping={ratio=0.001}"]), at=0.1)
    assert not any(damped.noise(mode.pole) for mode in damped.modes if mode.frequency_hz > 160)


def test_places_seen_from_a_turning_hub(tmp_path: Path) -> None:
    """A blade that rests on a hub of even speed Ω: its velocity in the world is J̇ z + J ż, with J̇ = ±Ω J turned, exact.

    At the start along x: lag angle φ moves the tip by 1 m along y, and as the hub turns by Ω t, along -x at Ω.
    """
    path = _blade(tmp_path, 0.0)
    data = scenes.read_toml(path)
    motion = {"shape": "table", "times": [-1.0, 0.0, 1.0, 2.0], "values": [-3.0, 0.0, 3.0, 6.0], "rates": [3.0, 3.0]}
    data["joints"][0]["drive"] = {"type": "motion", "motion": motion}
    data["points"] = [{"name": "tip", "link": "blade", "node": "tip"}]
    outputs = [f"point.tip.{way}" for way in ("x", "y", "velocity.x", "velocity.y")]
    model = erls.linearize(scenes.write_toml(path, data), at="equilibrium", inputs=[], outputs=outputs)
    np.testing.assert_allclose(model.values, [1.2, 0.0, 0.0, 3.6], atol=1e-8)
    np.testing.assert_allclose(model.C, [[0.0, 0.0], [1.0, 0.0], [-3.0, 0.0], [0.0, 1.0]], atol=1e-7)
    assert model.steady


def test_campbell_diagram_tells_of_weight_across_the_axis(tmp_path: Path) -> None:
    """Weight turns as seen from the blade, which is then in no steady state."""
    path = _blade(tmp_path, 0.0)
    data = {**scenes.read_toml(path), "gravity": [0.0, 0.0, -9.81], "base": {"rotation_deg": [90.0, 0.0, 0.0]}}
    found = campbell(scenes.write_toml(path, data), "mast", [10.0])
    assert "gravity acts across the axis of joint 'mast'" in found.warnings[0]


def test_free_flying_link_has_its_own_frequencies(tmp_path: Path) -> None:
    """On a floating joint: six ways at rest, and the frequencies of the free link, to 1e-8."""
    scenes.arm_link(tmp_path)
    data = {
        "simulation": {"duration": 1.0},
        "gravity": [0.0, 0.0, 0.0],
        "joints": [{"name": "free", "type": "floating", "dh": {"convention": "standard"}}],
        "links": [{"name": "arm", **scenes.ARM}],
        "points": [{"name": "tip", "link": "arm", "node": "tip"}],
    }
    scene = erls.load_scene(scenes.write_toml(tmp_path / "free.toml", data))
    model = erls.linearize(scene, at="equilibrium", inputs=["joint.free/x.effort"])
    frequencies = np.array([mode.frequency_hz for mode in model.modes])
    run = erls.simulate(erls.load_scene(tmp_path / "free.toml", ["simulation.duration=0.001"]), verdict=False)
    assert isinstance(run, ChainRun)
    own = np.sqrt(run.formulation.mechanism.links[-1].stiffness) / (2 * np.pi)
    rising = np.sort(frequencies)[-len(own) :]
    np.testing.assert_allclose(rising, own, rtol=1e-8)
    assert (frequencies < 1e-4 * own[0]).sum() == len(frequencies) - len(own)
    assert not model.unstable


def _same(a: Any, b: Any, share: float) -> None:
    np.testing.assert_allclose(a, b, rtol=0, atol=share * np.abs(b).max())


@pytest.mark.parametrize("formulation", ["ffr", "nodal"])
def test_formulations_give_one_response(tmp_path: Path, formulation: str) -> None:
    """A four-bar in motion, its crank let go or driven: rigid links leave no mesh error, to 1e-6.

    From a drive, a force on a point and a prescribed motion, to angles, places, accelerations and efforts. Coordinates
    of the formulations turn against each other as it moves, so that what is let go is compared by angle and rate of
    its crank.
    """
    free, driven = loop_scenes.four_bar(), loop_scenes.driven(loop_scenes.four_bar(), loop_scenes.steady(60.0, 90.0))
    free["joints"][0]["initial"]["rate_deg"] = 100.0
    free["joints"][1]["stiffness"] = 3.0

    def both(data: dict[str, Any], inputs: list[str], outputs: list[str]) -> list[LinearModel]:
        path = scenes.write_toml(tmp_path / "four.toml", data)
        loaded = (erls.load_scene(path, [f"simulation.formulation={name}"]) for name in ("erls", formulation))
        return [erls.linearize(scene, inputs=inputs, outputs=outputs) for scene in loaded]

    crank = [f"joint.j0.{quantity}" for quantity in ("angle", "rate", "acceleration")]
    outputs = [*crank, "joint.j1.rate", "point.coupler tip.acceleration.x"]
    found = both(free, ["joint.j0.effort", "point.coupler tip.force.z"], outputs)
    rows = [model.C @ np.linalg.inv(model.C[:2]) for model in found]
    for a, b in (rows, [model.D for model in found], [model.values for model in found]):
        _same(b, a, 1e-6)
    found = both(driven, ["joint.j0.acceleration"], ["joint.j2.angle", "joint.j0.effort", outputs[-1]])
    responses = [frequency_response(model, [0.3, 1.0, 5.0]) for model in found]
    _same(responses[1], responses[0], 1e-6)


def _damped(folder: Path, **changes: Any) -> Path:
    """The L hanging from a joint with spring and damper, which a torque shakes."""
    scenes.l_link(folder, 2)
    dh = {"convention": "standard", "alpha_deg": 90.0}
    joint = {"name": "shoulder", "dh": dh, "stiffness": 200.0, "damping": 3.0, **changes}
    links = [{"name": "l", "model": "link.toml", "damping": {"ratio": 0.03}}]
    return scenes.l_scene(folder, joints=[joint], links=links, simulation={"duration": 2.0, "step": 1e-3})


@pytest.mark.parametrize("frequency_hz", [4.0, 14.0])
def test_frequency_response_against_a_time_run(tmp_path: Path, frequency_hz: float) -> None:
    """A small sine on the drive: amplitude and phase after 2.5 s, in which what begins decays by e⁻⁹, within 1 %."""
    model = erls.linearize(_damped(tmp_path), at="equilibrium", outputs=["point.tip.z", "joint.shoulder.angle"])
    expected = frequency_response(model, [frequency_hz])[0, :, 0]
    burst = {"shape": "sine_burst", "start": 0.0, "amplitude": 0.2, "frequency_hz": frequency_hz}
    profiles = [{**burst, "cycles": 3.5 * frequency_hz}]
    path = _damped(
        tmp_path,
        drive={"type": "torque", "profiles": profiles},
        initial={"position": float(model.values[1])},
    )
    changes = ["initial.deformation=static", "simulation.duration=3.5"]
    run = erls.simulate(erls.load_scene(path, changes), verdict=False)
    t = np.linspace(2.5, 3.5, 401)[:-1]
    wave = np.exp(-2j * np.pi * frequency_hz * t)
    for k, values in enumerate((run.position("tip", t)[:, 2], run.joint_angle("shoulder", t))):
        found = 2 * np.mean((values - values.mean()) * wave) * 1j / 0.2
        assert abs(found - expected[k]) < 0.01 * abs(expected[k])


def test_step_response_ends_in_the_static_one(tmp_path: Path) -> None:
    """The inverse of the stiffness, which is also the response at a low frequency; to 1e-8."""
    model = erls.linearize(_damped(tmp_path), at="equilibrium", outputs=["point.tip.z", "joint.shoulder.angle"])
    static = model.seen[0] @ np.linalg.solve(model.stiffness, model.forces[2])
    found = step_response(model, np.linspace(0.0, 60.0, 601))
    np.testing.assert_allclose(found[0], 0.0, atol=1e-15)
    _same(found[-1], static, 1e-8)
    _same(frequency_response(model, [1e-6])[0].real, static, 1e-8)
    assert telling_times(model)[0] == 0
    assert np.diff(telling_frequencies(model)).min() > 0


@pytest.mark.parametrize("formulation", ["erls", "nodal"])
def test_root_locus_over_a_spring(tmp_path: Path, formulation: str) -> None:
    """A rigid rod upright on a spring: s² = (m g l / 2 - k) / I, unstable below k = m g l / 2, exact."""
    rod = loop_scenes.bar(1.0, 2.0)
    joint = loop_scenes.joint("hinge", 1.0, 90.0, stiffness=0.0, rest_deg=90.0)
    data = {
        "simulation": {"duration": 1.0},
        "base": {"rotation_deg": [90.0, 0.0, 0.0]},
        "joints": [joint],
        "links": [{"name": "rod", "rigid": rod, "mesh_pose": {"frame": "joint"}}],
    }
    path = scenes.write_toml(tmp_path / "rod.toml", data)
    values = [0.0, 5.0, 15.0]
    found = root_locus(path, "joints.hinge.stiffness", values, changes=[f"simulation.formulation={formulation}"])
    squares = np.array([model.modes[0].pole ** 2 for model in found.models])
    np.testing.assert_allclose(squares, (9.81 - np.array(values)) / (2.0 / 3), rtol=1e-9)
    assert [bool(model.unstable) for model in found.models] == [True, True, False]

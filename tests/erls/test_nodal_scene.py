"""Scenes in the nodal formulation: against ERLS, the hand-built system, rigid chains and energy; what it refuses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import loop_scenes
import numpy as np
import pytest
import scenes
from test_nodal_dynamics import _l_shape, _swing

from erls.errors import Cause, SceneError
from erls.integrate.base import hermite
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.rigid_dynamics import inverse_dynamics
from erls.run.chain.run import ChainRun
from erls.run.file import load_run, save_run
from erls.scene.read import load_scene
from erls.simulation.simulate import simulate
from erls.studies.outputs import run_outputs
from fe_import.errors import ReportedError

ROBOT = scenes.ROOT / "data" / "robot" / "two_link.toml"


def _run(path: Path, formulation: str = "nodal", *changes: str) -> ChainRun:
    return simulate(load_scene(path, [f'simulation.formulation="{formulation}"', *changes]))


def _simulation(duration: float, step: float, **more: Any) -> dict[str, Any]:
    return {"simulation": {"duration": duration, "step": step, **more}}


def _farthest(one: ChainRun, other: ChainRun, point: str, times: Array) -> float:
    return float(np.linalg.norm(one.position(point, times) - other.position(point, times), axis=1).max())


def test_the_hand_built_system_comes_out(tmp_path: Path) -> None:
    """The L of `test_nodal_dynamics`, from its scene: the same tip and elbow, to what Newton's method leaves."""
    scenes.l_link(tmp_path, 4)
    run = _run(scenes.l_scene(tmp_path, **_simulation(0.05, 1e-3)))
    built = _swing(_l_shape(4), 0.05, 1e-3)
    times = np.linspace(0.0, 0.05, 23)
    for point, node in (("elbow", 4), ("tip", 8)):
        places, _ = hermite(built.t, built.y, built.v, built.a, times)
        np.testing.assert_allclose(run.position(point, times), places[:, 12 * node : 12 * node + 3], atol=1e-9)


def test_elements_per_member(tmp_path: Path) -> None:
    """A finer mesh by the scene is that of the description; points between its nodes lie on the beams' axes."""
    scenes.l_link(tmp_path, 4)
    settings = _simulation(0.02, 1e-3)
    fine = _run(scenes.l_scene(tmp_path, **settings))
    scenes.l_link(tmp_path, 2)
    refined = _run(scenes.l_scene(tmp_path, **settings), "nodal", "simulation.elements_per_member=4")
    times = np.linspace(0.0, 0.02, 7)
    assert _farthest(fine, refined, "tip", times) < 1e-12
    scenes.l_link(tmp_path, 4)
    coarse = _run(scenes.l_scene(tmp_path, **settings), "nodal", "simulation.elements_per_member=2")
    assert _farthest(coarse, refined, "tip", times) < 1e-4
    start, end = (run.states(0.02)[0].nodes for run in (refined, coarse))
    assert start is not None
    assert end is not None
    assert start[0].shape == (5, 3)
    assert end[0].shape == (9, 3)


def test_departure_from_erls_is_of_second_order(tmp_path: Path) -> None:
    """Half the weight, half the sag: what gravity does within the plane of the L, which small displacements do not
    see, falls to a quarter.
    """
    scenes.l_link(tmp_path, 6, reduction={"fixed_interface_modes": 12})
    apart, sags = [], []
    for gravity in (40.0, 20.0):
        changes: dict[str, Any] = {"gravity": [0.0, 0.0, -gravity], "initial": {"deformation": "static"}}
        path = scenes.l_scene(tmp_path, **changes, **_simulation(1e-3, 1e-3))
        nodal, modal = (_run(path, name).position("tip", 0.0) for name in ("nodal", "erls"))
        apart.append(np.linalg.norm(nodal[:2] - modal[:2]))
        sags.append(nodal[2])
    assert sags[0] / sags[1] == pytest.approx(2.0, rel=1e-3)
    assert apart[0] / apart[1] == pytest.approx(4.0, rel=0.02)


def test_against_erls_over_a_swing(tmp_path: Path) -> None:
    """Within second order in the deflection, δ²/L times ten as `erls compare` has it, and the error of the mesh, which
    4e-5 m bounds with four elements a leg (`test_nodal_dynamics`).
    """
    scenes.l_link(tmp_path, 4, reduction={"fixed_interface_modes": 12})
    path = scenes.l_scene(tmp_path, **_simulation(0.1, 5e-4))
    nodal, modal = (_run(path, name) for name in ("nodal", "erls"))
    times = np.linspace(0.0, 0.1, 51)
    deflection = 2e-3
    assert _farthest(nodal, modal, "tip", times) < 10 * deflection**2 / 0.5 + 4e-5
    assert np.abs(nodal.joint_angle("shoulder", times) - modal.joint_angle("shoulder", times)).max() < 1e-3


def test_energy_and_its_parts(tmp_path: Path) -> None:
    """ρ∞ = 1 damps nothing: the total drifts by 1e-3 of what is exchanged; it is 0 at the start."""
    scenes.l_link(tmp_path, 2)
    run = _run(scenes.l_scene(tmp_path, **_simulation(0.06, 5e-4, spectral_radius=1.0)))
    energy = run.energy(np.linspace(0.0, 0.06, 121))
    assert np.ptp(energy.gravity) > 0.1
    assert np.ptp(energy.total) < 1e-3 * np.ptp(energy.gravity)
    assert energy.elastic.min() > -1e-12
    assert energy.elastic.max() > 1e-4
    assert energy.total[0] == pytest.approx(0.0, abs=1e-12)
    modal = _run(run.scene.path, "erls").energy(np.array([0.03]))
    assert float(energy.kinetic[60]) == pytest.approx(float(modal.kinetic[0]), rel=0.01)


def test_torques_of_the_robot(tmp_path: Path) -> None:
    """Motors' torques of the first 0.1 s from static equilibrium, which ERLS gives within a second-order share, and
    accelerations; between knots as at knots.
    """
    changes = ("simulation.duration=0.1", "simulation.step=1e-3", 'initial.deformation="static"')
    nodal = _run(ROBOT, "nodal", "simulation.elements_per_member=4", *changes)
    modal = _run(ROBOT, "erls", *changes)
    times = np.linspace(0.0, 0.1, 38)
    for joint in nodal.joint_names:
        one, other = nodal.joint_effort(joint, times), modal.joint_effort(joint, times)
        assert np.abs(one - other).max() < 0.02 * max(np.abs(other).max(), 0.1), joint
        force, moment = nodal.reaction(joint, times)
        wanted_force, wanted_moment = modal.reaction(joint, times)
        assert np.abs(force - wanted_force).max() < 0.01 * np.abs(wanted_force).max()
        assert np.abs(moment - wanted_moment).max() < 0.02 * np.abs(wanted_moment).max()
    for point in nodal.point_names:
        assert _farthest(nodal, modal, point, times) < 1e-4
    np.testing.assert_allclose(nodal.joint_angle("shoulder", times), modal.joint_angle("shoulder", times), atol=1e-9)
    found, wanted = (run_outputs(run, times).accelerations["end2"] for run in (nodal, modal))
    assert np.abs(found - wanted).max() < 0.05 * np.abs(wanted).max()


def _rigid_chain(folder: Path) -> Path:
    """Revolute and prismatic joints with all that may act in them, on rigid links with a payload."""
    body = {"mass": 0.5, "centre_of_mass": [0.2, 0.01, 0], "inertia": [1e-3, 2e-3, 2.5e-3]}
    pose = {"mesh_pose": {"frame": "joint", "rotation_deg": [10.0, 20.0, 0.0]}}
    rows = [{"convention": "standard", "a": 0.4, "alpha_deg": 40.0}, {"convention": "standard", "a": 0.3, "d": 0.05}]
    track = {"shape": "sine", "amplitude": 0.3, "frequency_hz": 2.0}
    pd = {"type": "pd", "motion": track, "proportional_gain": 30.0, "derivative_gain": 0.5, "feed_forward": True}
    torque = {"type": "torque", "profiles": [{"shape": "constant", "value": 0.4}]}
    joints = [
        {"name": "j1", "dh": rows[0], "initial": {"rate": 1.5, "position": 0.2}, "drive": pd, "damping": 0.05,
         "motor": {"rotor_inertia": 1e-4, "gear_ratio": 10.0}},
        {"name": "j2", "type": "prismatic", "dh": rows[1], "stiffness": 200.0, "rest": 0.02, "damping": 1.0,
         "motor": {"rotor_inertia": 0.1, "mass": 0.2}},
        {"name": "j3", "dh": rows[0], "initial": {"position": 3.0, "rate": 4.0}, "drive": torque,
         "friction": {"force": 0.05, "transition_rate": 0.5}},
    ]  # fmt: skip
    links = [
        {"name": name, "rigid": {**body, "points": {"in": [0, 0, 0], "out": [0.4, 0, 0]}}, **pose} for name in "abc"
    ]
    data = {
        **_simulation(0.2, 1e-3),
        "base": {"rotation_deg": [20.0, 30.0, 0.0]},
        "joints": joints,
        "links": links,
        "points": [{"name": "end", "link": "c", "node": "out"}],
        "payloads": [{"point": "end", "mass": 0.1, "offset": [0.01, 0, 0.02], "inertia": [1e-4, 1e-4, 1e-4]}],
    }
    return scenes.write_toml(folder / "rigid.toml", data)


def test_rigid_links_and_everything_in_joints(tmp_path: Path) -> None:
    """Rigid links are exact in both formulations: accelerations and reactions at the start agree to rounding, the
    motion to the error of 1 ms steps, of second order in both. The last joint turns past π and is counted on.
    """
    path = _rigid_chain(tmp_path)
    nodal, modal = (_run(path, name) for name in ("nodal", "erls"))
    times = np.linspace(0.0, 0.2, 41)
    assert _farthest(nodal, modal, "end", times) < 2e-5
    for joint in nodal.joint_names:
        assert np.abs(nodal.joint_angle(joint, times) - modal.joint_angle(joint, times)).max() < 1e-4
        assert np.abs(nodal.joint_rate(joint, times) - modal.joint_rate(joint, times)).max() < 3e-3
        assert nodal.joint_effort(joint, 0.0) == pytest.approx(float(modal.joint_effort(joint, 0.0)), rel=1e-9)
        for found, wanted in zip(nodal.reaction(joint, 0.0), modal.reaction(joint, 0.0), strict=True):
            np.testing.assert_allclose(found, wanted, atol=1e-8 * np.abs(wanted).max())
    assert nodal.joint_angle("j3", 0.2) > np.pi
    start = [getattr(run.energy(0.0), kind) for kind in ("kinetic", "gravity", "springs") for run in (nodal, modal)]
    np.testing.assert_allclose(start[::2], start[1::2], rtol=1e-12)


def test_rigid_torques_of_a_prescribed_motion(tmp_path: Path) -> None:
    """Efforts come out as by the recursive Newton-Euler method, with an error of second order in the step, once the
    start, where multipliers are of first order, has decayed (as 0.8 to the number of steps).
    """
    data = scenes.read_toml(_rigid_chain(tmp_path))
    drive = {"type": "motion", "motion": {"shape": "sine", "amplitude": 0.3, "frequency_hz": 2.0}}
    joints = [{k: j[k] for k in ("name", "type", "dh", "motor") if k in j} | {"drive": drive} for j in data["joints"]]
    path = scenes.write_toml(tmp_path / "driven.toml", {**data, "joints": joints})
    errors = []
    for step in (4e-3, 2e-3):
        run = _run(path, "nodal", "simulation.duration=0.4", f"simulation.step={step}")
        mechanism: Mechanism = run.formulation.mechanism
        wanted = np.array([j.drive.reference(0.4) for j in mechanism.joints])
        efforts = [run.joint_effort(name, 0.4) for name in run.joint_names]
        errors.append(np.abs(np.divide(efforts, inverse_dynamics(mechanism, *wanted.T)) - 1).max())
    assert errors[0] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(
    "frame",
    [{"mass": "lumped"}, {"theory": "euler-bernoulli"}, {"torsion": "polar"}, {"rotary_inertia": False}],
    ids=lambda f: next(iter(f)),
)
def test_options_of_a_frame(tmp_path: Path, frame: dict[str, Any]) -> None:
    """Static sag and its energy, and where the tip is 20 ms after release, are as in ERLS with the same option: shapes
    of elements that differ make 2 % with six of them a leg.
    """
    scenes.l_link(tmp_path, 6, frame=frame, reduction={"fixed_interface_modes": 12})
    path = scenes.l_scene(tmp_path, initial={"deformation": "static"}, **_simulation(0.02, 1e-3))
    nodal, modal = (_run(path, name) for name in ("nodal", "erls"))
    for t in (0.0, 0.02):
        tip, wanted = nodal.position("tip", t), modal.position("tip", t)
        assert abs(tip[2] - wanted[2]) < 0.02 * abs(wanted[2])
    assert nodal.energy(0.0).elastic == pytest.approx(float(modal.energy(0.0).elastic), rel=0.02)


def test_units_masses_and_payloads(tmp_path: Path) -> None:
    """A link in millimetres and tonnes with a mass on its elbow is that in metres with a payload there."""
    nodes = {"root": [0.0, 0.0, 0.0], "elbow": [500.0, 0.0, 0.0], "tip": [500.0, 500.0, 0.0]}
    changes = {
        "units": {"length": "mm", "mass": "t"},
        "masses": [{"node": "elbow", "mass": 1e-4, "inertia": [1.0, 2.0, 2.0]}],
        "materials": {"m": {"youngs_modulus": 2e5, "density": 7.8e-9}},
        "sections": {"s": {"width": 10.0, "height": 30.0}},
        "frame": {"nodes": nodes},
    }
    scenes.l_link(tmp_path, **changes)
    settings = _simulation(0.02, 1e-3)
    one = _run(scenes.l_scene(tmp_path, **settings))
    scenes.l_link(tmp_path, 2)
    payload = {"point": "elbow", "mass": 0.1, "inertia": [1e-3, 2e-3, 2e-3]}
    other = _run(scenes.l_scene(tmp_path, payloads=[payload], **settings))
    assert _farthest(one, other, "tip", np.linspace(0.0, 0.02, 5)) < 1e-10
    assert one.energy(0.02).kinetic == pytest.approx(float(other.energy(0.02).kinetic), rel=1e-8)


def test_run_files_reload(tmp_path: Path) -> None:
    """A run answers as before without its link description."""
    link = scenes.l_link(tmp_path, 2)
    run = _run(scenes.l_scene(tmp_path, **_simulation(0.01, 1e-3)), "nodal", "simulation.elements_per_member=3")
    save_run(tmp_path / "run.h5", run)
    link.unlink()
    again = load_run(tmp_path / "run.h5")
    np.testing.assert_array_equal(again.position("tip", 0.0077), run.position("tip", 0.0077))
    assert again.energy(0.01).total == run.energy(0.01).total
    assert again.formulation.describe() == run.formulation.describe()
    assert again.formulation.describe()["elements"] == 6


def _between(folder: Path) -> Path:
    point = {"name": "middle", "link": "l", "node": "root-elbow/1"}
    return scenes.l_scene(folder, points=[point], payloads=[{"point": "middle", "mass": 0.1}])


@pytest.mark.parametrize(
    ("scene", "changes", "words"),
    [
        (lambda folder: scenes.ROOT / "data" / "l_shape" / "solid.toml", (), ("link 'l'", "beams")),
        (scenes.l_scene, ("links.l.damping.ratio=0.01",), ("link 'l'", "damp")),
        (_between, ("simulation.elements_per_member=3",), ("link 'l'", "between the nodes")),
        (scenes.l_scene, ("simulation.elements_per_member=0",), ("elements_per_member",)),
        (scenes.l_scene, ('simulation.integrator="radau"',), ("simulation.integrator",)),
    ],
    ids=["solid", "damping", "payload", "elements", "integrator"],
)
def test_what_it_refuses(tmp_path: Path, scene: Any, changes: tuple[str, ...], words: tuple[str, ...]) -> None:
    """One message that names the link."""
    scenes.l_link(tmp_path)
    path = scene(tmp_path)
    with pytest.raises(SceneError) as found:
        _run(path, "nodal", *changes)
    assert found.value.cause == Cause.BAD_FIELD
    for word in words:
        assert word in str(found.value)


def test_a_damaged_description_in_a_run_file(tmp_path: Path) -> None:
    """It is reported as such."""
    import h5py

    from fe_import.files.hdf5.files import write_strings

    scenes.l_link(tmp_path)
    save_run(tmp_path / "run.h5", _run(scenes.l_scene(tmp_path, **_simulation(2e-3, 1e-3))))
    with h5py.File(tmp_path / "run.h5", "a") as file:
        del file["descriptions"]
        write_strings(file, "descriptions", ("{",), "broken")
    with pytest.raises(ReportedError, match="not JSON"):
        load_run(tmp_path / "run.h5")


def test_static_start_of_one_rigid_link(tmp_path: Path) -> None:
    """One node alone, which has no extent to measure corrections by: it starts where it was put, and swings."""
    data = loop_scenes.four_bar(initial={"deformation": "static"})
    data |= {"joints": data["joints"][:1], "links": data["links"][:1], "points": data["points"][:2], "loops": []}
    run = loop_scenes.run(tmp_path, data, "nodal", duration=0.01)
    np.testing.assert_allclose(run.joint_angle("j0", 0.0), np.radians(60.0), atol=1e-12)
    inertia = loop_scenes.MASSES[0] * loop_scenes.LENGTHS[0] / 3  # of the bar, over its length
    fall = 9.81 * loop_scenes.MASSES[0] / 2 * np.cos(np.radians(60.0)) / inertia * 0.01**2 / 2
    assert np.radians(60.0) - float(run.joint_angle("j0", 0.01)) == pytest.approx(fall, rel=1e-3)  # the angle changes

"""Virtual sensors: against closed forms, against differences of positions, against what runs say otherwise."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from numpy.typing import NDArray
from sensor_cases import ENDS, KINDS, refused, sensor

import erls
from erls.cli.main import main
from erls.equations.serial.state_series import state_series
from erls.errors import ReportedError
from erls.mechanism.sensors.base import Node
from erls.mechanism.sensors.registry import AnySensor
from erls.run.chain.instants import Instants
from erls.run.chain.places import point_position
from erls.run.chain.run import ChainRun
from erls.run.readings import output_names, outputs

Array = NDArray[np.float64]

def l_run(folder: Path, *sensors: dict[str, Any], **changes: Any) -> ChainRun:
    """20 ms of the L pendulum, with sensors."""
    scenes.l_link(folder, 4, **ENDS)
    given = {"simulation": {"duration": 0.02}, **changes}
    return erls.simulate(erls.load_scene(scenes.l_scene(folder, sensors=list(sensors), **given)), verdict=False)  # type: ignore[return-value]


def test_the_table_has_every_type() -> None:
    """A new kind of sensor gets its row here."""
    assert {kind.__struct_config__.tag for kind in AnySensor.__args__} == set(KINDS)


@pytest.fixture(scope="module")
def every(tmp_path_factory: pytest.TempPathFactory) -> ChainRun:
    """A run with one sensor of each type that beams have."""
    folder = tmp_path_factory.mktemp("every")
    found = [{**sensor(kind), "name": f"s {kind}"} for kind in KINDS if kind != "stress"]
    return l_run(folder, *found)


def test_readings_are_columns_curves_and_samples(
    every: ChainRun, tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same numbers in the table, in the run file, in its summary and in a run that is read."""
    monkeypatch.setattr("erls.run.file._OUTPUT_TIMES", 5)
    times = every.spread(5)
    columns = every.columns(times)
    for kind, (_, heads) in KINDS.items():
        if kind == "stress":
            continue
        own = [name.replace("s.", f"s {kind}.").replace("s [", f"s {kind} [") for name in heads]
        found = every.sensor(f"s {kind}", times)
        np.testing.assert_array_equal(np.stack([columns[name] for name in own], axis=1).reshape(found.shape), found)
        assert every.sensor(f"s {kind}", 0.01).shape == found.shape[1:]
    assert list(columns)[-1] == "energy.total [J]"  # by which a table of ours is known
    erls.save_run(tmp_path / "l.run.h5", every)
    again = erls.load_run(tmp_path / "l.run.h5")
    assert main(["view", str(tmp_path / "l.run.h5"), "-o", str(tmp_path / "l.csv"), "--at", "0.01"]) == 0
    capsys.readouterr()
    with (tmp_path / "l.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert isinstance(again, ChainRun)
    gauge = every.sensor("s strain_gauge", 0.01)
    assert float(rows[0]["s strain_gauge [1]"]) == pytest.approx(float(gauge), rel=1e-12)
    (sample,) = again.summary([0.01])["samples"]
    assert sample["sensors"]["s strain_gauge"] == pytest.approx(float(gauge), rel=1e-12)
    assert sample["sensors"]["s gyroscope"] == pytest.approx(every.sensor("s gyroscope", 0.01).tolist(), abs=1e-12)
    np.testing.assert_array_equal(every.curves(times)["sensors/s gyroscope"].values, every.sensor("s gyroscope", times))
    with pytest.raises(ReportedError, match="sensor"):
        every.sensor("other", 0.0)


CASES = [
    ("l_shape/steel_tall.toml", [], "tip"),
    ("l_shape/steel_tall.toml", ["simulation.formulation=ffr"], "tip"),
    ("l_shape/steel_tall.toml", ["simulation.gauge=minimum-norm"], "tip"),
    ("l_shape/steel_tall.toml", ["simulation.formulation=nodal"], "tip"),
    ("l_shape/steel_tall.toml", ["simulation.formulation=ffr", "links.l.substructures=2"], "tip"),
    ("robot/two_link.toml", ["simulation.effects=linear"], "end2"),
    ("four_bar/flexible.toml", [], "rocker_pin"),
]


@pytest.mark.parametrize(("scene", "changes", "point"), CASES)
def test_motion_is_that_of_differences(scene: str, changes: list[str], point: str) -> None:
    """Velocity, acceleration and turning of a point from the twists of frames and modes, against fourth-order
    differences of where it is and how it has turned along the parabola of a state.

    Differences of 1e-4 s leave 1e-16 m / 1e-8 s² = 1e-8 m/s², a few times, and h⁴/90 of a sixth derivative, below that.
    """
    settings = ["simulation.duration=0.004", "simulation.step=1e-3", *changes]
    run = erls.simulate(erls.load_scene(scenes.ROOT / "data" / scene, settings), verdict=False)
    assert isinstance(run, ChainRun)
    chain = run.formulation
    own = next(p for p in chain.mechanism.points if p.name == point)
    seen, h = run.instants(run.solution.t[2:4]), 1e-4
    assert seen.t[0] > 0
    y, v, a = seen.y, seen.v, seen.a
    near = [(seen.t + x, y + x * v + x * x / 2 * a, v + x * a) for x in h * np.arange(-2, 3)]
    places = [point_position(chain.mechanism, state_series(chain, *at), run.point_names.index(point)) for at in near]
    turns = [Instants(chain, *at, a).node(Node(own.link, own.node)).turn for at in near]

    def first(x: list[Array]) -> Array:
        return np.asarray((x[0] - 8 * x[1] + 8 * x[3] - x[4]) / (12 * h))

    def second(x: list[Array]) -> Array:
        return np.asarray((16 * (x[1] + x[3]) - x[0] - x[4] - 30 * x[2]) / (12 * h * h))

    found = seen.node(Node(own.link, own.node))
    np.testing.assert_allclose(found.place, places[2], rtol=0, atol=1e-15)
    np.testing.assert_allclose(found.velocity, first(places), rtol=0, atol=1e-11)
    np.testing.assert_allclose(found.acceleration, second(places), rtol=0, atol=2e-7)
    np.testing.assert_array_equal(run.acceleration(point, seen.t), found.acceleration)
    spinning = first(turns) @ turns[2].transpose(0, 2, 1)
    np.testing.assert_allclose(found.spin, spinning[:, [2, 0, 1], [1, 2, 0]], rtol=0, atol=1e-9)
    faster = second(turns) @ turns[2].transpose(0, 2, 1)
    skew = (faster - faster.transpose(0, 2, 1))[:, [2, 0, 1], [1, 2, 0]] / 2
    np.testing.assert_allclose(found.spin_rate, skew, rtol=0, atol=1e-6)


PENDULUM: dict[str, Any] = {
    "simulation": {"duration": 0.3, "integrator": "lobatto", "tolerance": 1e-7},
    "base": {"rotation_deg": [90.0, 0.0, 0.0]},  # the axis is -y, θ raises the arm from x towards z
    "joints": [{"name": "pivot", "dh": {"convention": "standard", "a": 0.5}}],
    "links": [
        {
            "name": "arm",
            "rigid": {"mass": 2.0, "centre_of_mass": [0.5, 0, 0], "points": {"root": [0, 0, 0], "bob": [0.5, 0, 0]}},
            "mesh_pose": {"frame": "joint"},
        }
    ],
    "points": [{"name": "bob", "link": "arm", "node": "bob"}],
    "sensors": [
        {"name": "acc", "type": "accelerometer", "point": "bob"},
        {"name": "up", "type": "accelerometer", "point": "bob", "axes": "world", "direction": [0, 0, 1]},
        {"name": "gyro", "type": "gyroscope", "point": "bob"},
        {"name": "speed", "type": "velocity", "point": "bob", "axes": "node"},
    ],
}


def test_accelerometer_of_a_pendulum(tmp_path: Path) -> None:
    """A point mass that falls from the side feels its rod alone: 3 g sin φ towards the pivot, φ below the horizontal,
    and nothing across, since no force acts there. Energy gives its speed, √(2 g r sin φ).

    The run is right to 1e-8 m; accelerations turn that into (2π/0.3)² of it, below 1e-5.
    """
    run = erls.simulate(scenes.write_toml(tmp_path / "p.toml", PENDULUM), verdict=False)
    t = np.linspace(0.0, 0.3, 13)
    fallen = -run.joint_angle("pivot", t)
    reading = run.sensor("acc", t)
    np.testing.assert_allclose(reading[:, 0], -3 * 9.81 * np.sin(fallen), rtol=0, atol=1e-5)
    np.testing.assert_allclose(reading[:, 1:], 0.0, atol=1e-12)
    np.testing.assert_allclose(run.sensor("up", t), 3 * 9.81 * np.sin(fallen) ** 2, rtol=0, atol=1e-5)
    speed = np.sqrt(2 * 9.81 * 0.5 * np.sin(fallen))
    np.testing.assert_allclose(run.sensor("speed", t)[:, 1], -speed, rtol=0, atol=1e-6)
    np.testing.assert_allclose(run.sensor("gyro", t)[:, 2], -speed / 0.5, rtol=0, atol=2e-6)
    np.testing.assert_allclose(run.angular_velocity("arm", t), run.angular_velocity("bob", t), rtol=0, atol=1e-15)


def test_gyroscope_of_a_spinning_link(tmp_path: Path) -> None:
    """At a steady rate about an axis that leans, ω along z of the link, ω × (ω × r) in its axes, to rounding."""
    rate, lean = 7.0, 30.0
    motion = {"shape": "table", "times": [0.0, 0.1, 0.2, 0.3], "values": [0.0, 0.7, 1.4, 2.1], "rates": [rate, rate]}
    joint = {**PENDULUM["joints"][0], "drive": {"type": "motion", "motion": motion}}
    data = {**PENDULUM, "base": {"rotation_deg": [lean, 0.0, 0.0]}, "joints": [joint], "gravity": [0.0, 0.0, 0.0]}
    data["simulation"] = {"duration": 0.2, "step": 0.01}
    run = erls.simulate(scenes.write_toml(tmp_path / "p.toml", data), verdict=False)
    t = np.linspace(0.0, 0.2, 5)
    np.testing.assert_allclose(run.sensor("gyro", t), np.tile([0.0, 0.0, rate], (5, 1)), rtol=0, atol=1e-12)
    expected = np.tile([-(rate**2) * 0.5, 0.0, 0.0], (5, 1))
    np.testing.assert_allclose(run.sensor("acc", t), expected, rtol=0, atol=1e-10)
    axis = np.array([0.0, -np.sin(np.radians(lean)), np.cos(np.radians(lean))])
    np.testing.assert_allclose(run.angular_velocity("bob", t), np.tile(rate * axis, (5, 1)), rtol=0, atol=1e-12)


def test_a_base_that_accelerates_is_felt(tmp_path: Path) -> None:
    """A force on all mass stands for a frame that accelerates: a held arm reads that, and its weight."""
    held = {"shape": "table", "times": [0.0, 0.1, 0.2, 0.3], "values": [0.0] * 4}
    joint = {**PENDULUM["joints"][0], "drive": {"type": "motion", "motion": held}}
    loads = [{"force_per_mass": [-2.0, 0.0, 0.0]}]
    data = {**PENDULUM, "joints": [joint], "loads": loads, "simulation": {"duration": 0.01, "step": 0.01}}
    run = erls.simulate(scenes.write_toml(tmp_path / "p.toml", data), verdict=False)
    np.testing.assert_allclose(run.sensor("acc", 0.0), [2.0, 9.81, 0.0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_gauges_of_a_static_cantilever(tmp_path: Path, formulation: str) -> None:
    """A clamped L under a force at its tip: strain M c / (E I) + N / (E A) at the root of the first leg and at the end
    of the second, section forces by statics. Links bend by 2e-4 of their length, which arms change by.
    """
    force = np.array([3.0, -2.0, 5.0])
    gauges = [
        {"name": "at root", "type": "strain_gauge", "point": "root", "offset": [0.0, 0.005, 0.015]},
        {"name": "at tip", "type": "strain_gauge", "point": "tip", "direction": [0.0, -1.0, 0.0]},
        {"name": "all", "type": "section_force", "point": "root", "element": 0},
        {"name": "moment", "type": "section_force", "point": "root", "component": "Mz"},
    ]
    run = l_run(
        tmp_path,
        *gauges,
        joints=[{**scenes.L_SCENE["joints"][0], "type": "fixed"}],
        points=[{"name": n, "link": "l", "node": n} for n in ("root", "tip")],
        loads=[{"point": "tip", "force": force.tolist()}],
        gravity=[0.0, 0.0, 0.0],
        initial={"deformation": "static"},
        simulation={"duration": 1e-3, "step": 1e-3, "formulation": formulation},
    )
    modulus, (w, h) = 2e11, (0.01, 0.03)
    moment = np.cross([0.5, 0.5, 0.0], force)
    from erls.run.recovery import recovery_places

    maps = recovery_places(run, "l")
    y, z = maps.axes[0][1:] @ [0.0, 0.005, 0.015]
    my, mz = maps.axes[0][1:] @ moment
    strain = force[0] / (w * h) + my * z / (w * h**3 / 12) - mz * y / (h * w**3 / 12)
    assert float(run.sensor("at root", 0.0)) == pytest.approx(strain / modulus, rel=2e-3)
    assert float(run.sensor("at tip", 0.0)) == pytest.approx(force[1] / (w * h * modulus), rel=2e-3)
    expected = np.concatenate([maps.axes[0] @ force, maps.axes[0] @ moment])
    for part in (slice(3), slice(3, 6)):
        limit = 2e-3 * np.abs(expected[part]).max()
        np.testing.assert_allclose(run.sensor("all", 0.0)[part], expected[part], rtol=0, atol=limit)
    np.testing.assert_array_equal(run.sensor("all", [0.0, 1e-3])[:, 5], run.sensor("moment", [0.0, 1e-3]))
    np.testing.assert_array_equal(run.sensor("all", 1e-3), erls.section_forces(run, "l", 1e-3)[0])


def test_gauges_of_a_solid(tmp_path: Path) -> None:
    """Stress is that of `erls.stress` at the node, strain what Hooke's law makes of it, by inverting its stiffness."""
    source = scenes.ROOT / "data" / "l_shape" / "links"
    data = scenes.read_toml(source / "solid.toml")
    data["solid"]["mesh"] = str(source / data["solid"]["mesh"])
    data["reduction"] = {"fixed_interface_modes": 6, "elastic_modes": 8}
    scenes.write_toml(tmp_path / "solid.toml", {**data, "recovery": {"all": True}})
    way = np.array([1.0, 2.0, -1.0]) / np.sqrt(6.0)
    scene = {
        **scenes.L_SCENE,
        "simulation": {"duration": 2e-3, "step": 1e-3},
        "links": [{"name": "l", "model": "solid.toml"}],
        "points": [{"name": "gauge", "link": "l", "position": [0.25, 0.015, 0.005]}],
        "sensors": [
            {"name": "stress", "type": "stress", "point": "gauge"},
            {"name": "xy", "type": "stress", "point": "gauge", "component": "xy"},
            {"name": "strain", "type": "strain_gauge", "point": "gauge", "direction": way.tolist()},
            {"name": "acc", "type": "accelerometer", "point": "gauge", "axes": "link"},
        ],
    }
    path = scenes.write_toml(tmp_path / "scene.toml", scene)
    run = erls.simulate(erls.load_scene(path), verdict=False)
    assert isinstance(run, ChainRun)
    from erls.run.recovery import recovery_places

    (point,) = run.formulation.mechanism.points
    (site,) = np.flatnonzero(recovery_places(run, "l").nodes == point.node)
    found = erls.stress(run, "l", 2e-3)[site]
    np.testing.assert_array_equal(run.sensor("stress", 2e-3), found)
    assert run.sensor("xy", 2e-3) == found[3]
    material = data["materials"][data["solid"]["material"]]
    e, nu = material["youngs_modulus"], material["poissons_ratio"]
    stiffness = np.eye(6) * e / (1 + nu)
    stiffness[:3, :3] += e * nu / ((1 + nu) * (1 - 2 * nu))
    xx, yy, zz, xy, yz, zx = np.linalg.solve(stiffness, found)  # tensor strains
    strain = way @ np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]) @ way
    assert float(run.sensor("strain", 2e-3)) == pytest.approx(strain, rel=1e-9)
    said = refused(path, ['sensors.acc.axes="node"'])
    assert "no rotation" in said
    assert "sensors[3].point" in said


def test_effort_on_both_sides_of_the_gear(tmp_path: Path) -> None:
    """The motor's torque times the gear ratio, less friction and what the rotor takes, is what arrives at the link; and
    that is the moment of the joint's reaction along its axis, which comes from the other side.
    """
    motor = {"rotor_inertia": 2e-4, "gear_ratio": 20.0}
    motion = {"shape": "sine", "amplitude": 0.5, "frequency_hz": 2.0, "phase_deg": 30.0}
    gains = {"proportional_gain": 100.0, "derivative_gain": 3.0, "torque_limit": 9.0}
    controller = {"type": "pd", "motion": motion, **gains}
    acting = {"motor": motor, "damping": 0.2, "stiffness": 5.0, "friction": {"force": 0.3, "transition_rate": 0.05}}
    read = [
        {"name": f"{kind} {side}", "type": kind, "joint": "shoulder", "side": side}
        for kind in ("effort", "joint_angle", "joint_rate")
        for side in ("motor", "load")
    ]
    for drive in (controller, {"type": "motion", "motion": motion}):
        joint = {**scenes.L_SCENE["joints"][0], "drive": drive, **acting}
        run = l_run(tmp_path, *read, joints=[joint])
        t = np.array([0.004, 0.011, 0.02])
        seen = run.instants(t)
        accelerated = seen.motion.angle_accelerations[:, 0]
        at_motor, at_load = run.sensor("effort motor", t), run.sensor("effort load", t)
        angle, rate = run.joint_angle("shoulder", t), run.joint_rate("shoulder", t)
        lost = 5.0 * angle + 0.2 * rate + 0.3 * np.tanh(rate / 0.05)
        inertia = 2e-4 * 20.0**2
        assert np.abs(inertia * accelerated).max() > 0.05 * np.abs(at_load).max()
        np.testing.assert_allclose(20.0 * at_motor - lost - inertia * accelerated, at_load, rtol=1e-12)
        _, moment = run.reaction("shoulder", t)
        np.testing.assert_allclose(moment[:, 1], at_load, rtol=1e-8)  # the axis is the world's y
        np.testing.assert_allclose(run.sensor("joint_angle motor", t), 20.0 * angle, rtol=1e-14)
        np.testing.assert_array_equal(run.sensor("joint_rate load", t), rate)


def test_closing_joints_and_bodies_read_too(tmp_path: Path) -> None:
    """Angle and rate of a closing joint; node, gyroscope and connection of a scene of bodies, against differences."""
    path = scenes.ROOT / "data" / "four_bar" / "flexible.toml"
    own = {"joint": "rocker_pivot"}
    found = [{"name": "s", "type": "joint_angle", **own}, {"name": "r", "type": "joint_rate", **own}]
    data = scenes.read_toml(path)
    for link in data["links"]:
        link["model"] = str(path.parent / link["model"])
    scene = scenes.write_toml(tmp_path / "four.toml", {**data, "sensors": found, "name": "four bar"})
    run = erls.simulate(erls.load_scene(scene, ["simulation.duration=0.004"]), verdict=False)
    assert isinstance(run, ChainRun)
    np.testing.assert_array_equal(run.sensor("s", [0.0, 0.004]), run.loop_coordinate("rocker_pivot", [0.0, 0.004]))
    np.testing.assert_array_equal(run.sensor("r", [0.0, 0.004]), run.loop_rate("rocker_pivot", [0.0, 0.004]))
    top = scenes.read_toml(scenes.ROOT / "data" / "heavy_top" / "slow.toml")
    top["connections"][0].update(type="revolute", axis=[1.0, 0.0, 0.0])
    top["bodies"][0].update(velocity=[0.0, 0.0, 0.5], angular_velocity=[0.5, 0.0, 0.0])
    top["sensors"] = [
        {"name": "acc", "type": "accelerometer", "point": "top"},
        {"name": "gyro", "type": "gyroscope", "point": "top"},
        {"name": "angle", "type": "joint_angle", "joint": "point"},
        {"name": "rate", "type": "joint_rate", "joint": "point"},
    ]
    path = scenes.write_toml(tmp_path / "top.toml", top)
    body = erls.simulate(erls.load_scene(path, ["simulation.duration=0.05", "simulation.step=1e-3"]), verdict=False)
    t, h = body.times[[10, 30]], 1e-5
    # of a fixed axis, with gyroscope and encoder alike; the accelerometer: r ω², and what weight turns along
    rates = (body.sensor("angle", t + h) - body.sensor("angle", t - h)) / (2 * h)  # type: ignore[attr-defined]
    np.testing.assert_allclose(body.sensor("rate", t), rates, rtol=1e-6)  # type: ignore[attr-defined]
    np.testing.assert_allclose(body.sensor("gyro", t)[:, 0], body.sensor("rate", t), rtol=1e-10)  # type: ignore[attr-defined]
    felt = body.sensor("acc", t)  # type: ignore[attr-defined]
    angle = body.sensor("angle", t)  # type: ignore[attr-defined]
    np.testing.assert_allclose(felt[:, 1], -body.sensor("rate", t) ** 2 + 9.81 * np.sin(angle), rtol=1e-3)  # type: ignore[attr-defined]
    said = refused(path, ['sensors.0={name="x", type="effort", joint="point"}'])
    assert "connections have no motors" in said
    assert "links" in refused(path, ['sensors.0.axes="link"'])


def test_outputs_depend_on_the_state_alone(every: ChainRun) -> None:
    """As a linearization asks: at a state with accelerations of its own, of all sensors beside each other."""
    y, v = (x[5:7] for x in (every.solution.y, every.solution.v))
    t = every.solution.t[5:7]
    own = Instants(every.formulation, t, y, v)
    found = outputs(every.sensors, own, 2)
    assert found.shape == (2, len(output_names(every.sensors)))
    pushed = outputs(every.sensors, Instants(every.formulation, t, y, v, own.a + np.eye(2, y.shape[1])), 2)
    heads = output_names(every.sensors)
    same = [heads.index(x) for x in ("s position.x [m]", "s gyroscope.y [rad/s]", "s joint_rate [rad/s]")]
    np.testing.assert_array_equal(found[:, same], pushed[:, same])
    felt = heads.index("s accelerometer.z [m/s2]")
    assert abs(found[0, felt] - pushed[0, felt]) > 0.1  # 1 rad/s² of the shoulder moves the tip

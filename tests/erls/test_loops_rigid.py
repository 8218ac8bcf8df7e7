"""Rigid linkages: closed-form kinematics, an independent equation of motion, work, equilibrium of forces, lock-up."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import loop_scenes
import numpy as np
import pytest
import scenes
from loop_scenes import GROUND, LENGTHS, MASSES
from scipy.integrate import solve_ivp

from erls.equations.loops.closed_chain import ClosedChain
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.run.file import load_run, save_run

RATE = 360.0  # deg/s
PLANAR = ("translation along z", "rotation about x", "rotation about y")


def planar(positions: Array) -> Array:
    """x + i z."""
    return np.asarray(positions[..., 0] + 1j * positions[..., 2])


DRIVEN = [*((name, "generalized_alpha") for name in ("erls", "minimum-norm", "ffr")), ("ffr", "dop853")]


@pytest.mark.parametrize(("name", "integrator"), DRIVEN)
def test_driven_four_bar_keeps_to_the_closed_form(tmp_path: Path, name: str, integrator: str) -> None:
    """Pins and middles of all links at any time, between steps too; 1e-10 m asked, closed forms hold to rounding."""
    data = loop_scenes.driven(loop_scenes.four_bar(), loop_scenes.steady(60.0, RATE))
    run = loop_scenes.run(tmp_path, data, name, integrator=integrator, step=5e-3, duration=0.1)
    t = np.linspace(0, run.end, 23)
    crank = np.radians(60.0 + RATE * t)
    at = LENGTHS[0] * np.exp(1j * crank)
    for link, length, angle in zip(("coupler", "rocker"), LENGTHS[1:], loop_scenes.four_bar_angles(crank), strict=True):
        along = length * np.exp(1j * angle)
        np.testing.assert_allclose(planar(run.position(f"{link} middle", t)), at + along / 2, atol=1e-12)
        np.testing.assert_allclose(planar(run.position(f"{link} tip", t)), at + along, atol=1e-12)
        at = at + along
    np.testing.assert_allclose(at, GROUND, atol=1e-14)


def test_driven_slider_crank_keeps_to_the_closed_form(tmp_path: Path) -> None:
    """x = r cos φ + (l² - r² sin² φ)^½ of the slider, and its rate through the joint coordinates."""
    data = loop_scenes.driven(loop_scenes.slider_crank(), loop_scenes.steady(60.0, RATE))
    run = loop_scenes.run(tmp_path, data, duration=0.25, step=5e-3)
    t = np.linspace(0, run.end, 23)
    crank = np.radians(60.0 + RATE * t)
    x = LENGTHS[0] * np.cos(crank) + np.sqrt(LENGTHS[1] ** 2 - (LENGTHS[0] * np.sin(crank)) ** 2)
    found = run.position("slider", t)
    np.testing.assert_allclose(found, np.outer(x, [1.0, 0.0, 0.0]), atol=1e-12)
    rod = -np.arcsin(LENGTHS[0] / LENGTHS[1] * np.sin(crank))
    rate = -LENGTHS[0] * np.cos(crank) * np.radians(RATE) / (LENGTHS[1] * np.cos(rod))
    np.testing.assert_allclose(run.joint_rate("j1", t), rate - np.radians(RATE), rtol=1e-11)


def one_coordinate(times: Array) -> Array:
    """Crank angle of the free four-bar: ½ m(φ) φ̇² + V(φ) with the transmission angles of the closed loop."""
    inertias = [m * length**2 / 12 for m, length in zip(MASSES, LENGTHS, strict=True)]

    def slope(_: float, state: Array) -> list[float]:
        phi, rate = state
        coupler, rocker = (float(x) for x in loop_scenes.four_bar_angles(np.array(phi)))
        turn = 1j * np.exp(1j * np.array([phi, coupler, rocker])) * LENGTHS  # derivative of each bar by its angle
        matrix = np.array([[turn[1].real, turn[2].real], [turn[1].imag, turn[2].imag]])
        one = np.linalg.solve(matrix, [-turn[0].real, -turn[0].imag])
        bend = -(1j * (turn[0] + turn[1] * one[0] ** 2 + turn[2] * one[1] ** 2))
        two = np.linalg.solve(matrix, [bend.real, bend.imag])
        angles_one, angles_two = np.array([1.0, *one]), np.array([0.0, *two])
        mass = half_slope = force = 0.0
        start, start_two = 0.0 + 0j, 0.0 + 0j
        for k in range(3):
            d, dd = turn[k] * angles_one[k], turn[k] * angles_two[k] + 1j * turn[k] * angles_one[k] ** 2
            centre, centre_two = start + d / 2, start_two + dd / 2
            start, start_two = start + d, start_two + dd
            mass += MASSES[k] * abs(centre) ** 2 + inertias[k] * angles_one[k] ** 2
            half_slope += MASSES[k] * (centre.conjugate() * centre_two).real
            half_slope += inertias[k] * angles_one[k] * angles_two[k]
            force -= MASSES[k] * 9.81 * centre.imag
        return [rate, (force - half_slope * rate**2) / mass]

    start = [np.radians(60.0), 0.0]
    found = solve_ivp(slope, (0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-13)
    return np.asarray(found.y[0])


@pytest.mark.parametrize("name", ["erls", "ffr"])
def test_free_four_bar_againstone_coordinate(tmp_path: Path, name: str) -> None:
    """Released at rest; rtol 1e-9 against 1e-12: 1e-8 rad within 0.3 s. Energy stays, to 1e-8 J."""
    settings = {"integrator": "dop853", "rtol": 1e-9, "atol": 1e-10, "duration": 0.3}
    run = loop_scenes.run(tmp_path, loop_scenes.four_bar(), name, **settings)
    t = np.linspace(0, run.end, 30)
    np.testing.assert_allclose(run.joint_angle("j0", t), one_coordinate(t), atol=1e-8)
    assert np.ptp(run.energy(t).total) < 1e-8
    assert _widest(run) < 1e-9


def test_generalized_alpha_is_of_second_order_in_loops(tmp_path: Path) -> None:
    """Crank angle of the free four-bar against the one-coordinate equation; steps of 4 and 2 ms. Loops stay closed."""
    t = np.array([0.3])
    exact = one_coordinate(np.array([0.0, *t]))[1:]
    runs = [loop_scenes.run(tmp_path, loop_scenes.four_bar(), step=h, duration=0.3) for h in (4e-3, 2e-3)]
    errors = [abs(float((run.joint_angle("j0", t) - exact)[0])) for run in runs]
    assert 1.8 < np.log2(errors[0] / errors[1]) < 2.2
    assert _widest(runs[0]) < 1e-10


def _widest(run: ChainRun) -> float:
    """Largest opening at knots [m], before states are moved onto the conditions."""
    chain, knots = run.formulation, zip(run.solution.t.tolist(), run.solution.y, run.solution.v, strict=True)
    assert isinstance(chain, ClosedChain)
    return max(float(np.abs(chain.openings(chain.closure(*knot))).max()) for knot in knots)


@pytest.mark.parametrize(("name", "scene"), [("erls", "four-bar"), ("ffr", "slider-crank")])
def test_work_of_the_crank_is_the_energy(tmp_path: Path, name: str, scene: str) -> None:
    """∫ torque · rate dt = ΔE, 1e-8 of the energy that comes and goes; smooth start, DOP853.

    All follows from the crank here, so tolerances of the integrator do not matter.
    """
    data = loop_scenes.four_bar() if scene == "four-bar" else loop_scenes.slider_crank()
    move = {"shape": "polynomial", "from_deg": 60.0, "to_deg": 240.0, "duration": 0.4}
    data = loop_scenes.driven(data, {"type": "motion", "motion": move})
    run = loop_scenes.run(tmp_path, data, name, integrator="dop853", duration=0.3, rtol=1e-6, atol=1e-9)
    energy = run.energy(np.linspace(0, run.end, 21)).total
    assert abs(loop_scenes.work(run, "j0") - (energy[-1] - energy[0])) < 1e-8 * np.ptp(energy)


def test_reactions_balance_momentum(tmp_path: Path) -> None:
    """For every joint: its reaction, the loop's force and the weight of the links outward change their momentum.

    Momenta from second differences of positions; forces 1e-5 N, moments about the world's origin 1e-5 N m.
    """
    data = loop_scenes.driven(loop_scenes.four_bar(), loop_scenes.steady(60.0, RATE))
    run = loop_scenes.run(tmp_path, data, step=5e-3, duration=0.11)  # nothing to integrate: all follows from the crank
    t, h = 0.1, 1e-4
    times = [t - h, t, t + h]
    gravity = np.array([0.0, 0.0, -9.81])
    loop_force, loop_moment = run.loop_reaction("pivot", t)
    pivot = np.array([GROUND, 0.0, 0.0])
    starts = [np.zeros((3, 3)), run.position("crank tip", times), run.position("coupler tip", times)]
    names = ("crank", "coupler", "rocker")
    middles = [run.position(f"{name} middle", times) for name in names]
    crank = np.radians(60.0 + RATE * np.array(times))
    angles = [crank, *loop_scenes.four_bar_angles(crank)]
    for k in range(3):
        force, moment = np.zeros(3), np.zeros(3)
        for middle, mass, length, angle in zip(middles[k:], MASSES[k:], LENGTHS[k:], angles[k:], strict=True):
            need = mass * ((middle[0] - 2 * middle[1] + middle[2]) / h**2 - gravity)
            force += need
            spin = np.unwrap(angle)
            turning = mass * length**2 / 12 * (spin[0] - 2 * spin[1] + spin[2]) / h**2
            moment += np.cross(middle[1], need) - turning * np.array([0.0, 1.0, 0.0])  # angles grow about -y
        found, turned = run.reaction(f"j{k}", t)
        np.testing.assert_allclose(found + loop_force, force, atol=1e-5)
        sides = turned + np.cross(starts[k][1], found) + loop_moment + np.cross(pivot, loop_force)
        np.testing.assert_allclose(sides, moment, atol=1e-5)
    assert run.joint_effort("j0", t) == pytest.approx(-run.reaction("j0", t)[1][1], rel=1e-10)


@pytest.mark.parametrize("name", ["erls", "ffr"])
def test_planar_linkage_names_redundant_conditions(tmp_path: Path, name: str) -> None:
    """Three of five, in the warning and in the summary; they carry no force."""
    run = loop_scenes.run(tmp_path, loop_scenes.four_bar(), name, duration=0.01)
    warning = next(w for w in run.warnings if "follow from the others" in w)
    assert warning.startswith("3 conditions")
    assert all(f"loop 'pivot', {direction}" in warning for direction in PLANAR)
    summary = run.summary()
    assert summary["loops"] == [{"name": "pivot", "redundant": list(PLANAR)}]
    assert summary["degrees_of_freedom"] == 1
    force, moment = run.loop_reaction("pivot", 0.005)
    np.testing.assert_allclose([force[1], *moment], 0.0, atol=1e-12)


def test_loops_between_links_follow_the_one_that_stands(tmp_path: Path) -> None:
    """A four-bar on a link that is held equals the four-bar on the ground; its joint force passes on to the ground."""
    data = loop_scenes.driven(loop_scenes.four_bar(), loop_scenes.steady(60.0, RATE))
    held = loop_scenes.joint("held", 0.0)
    still = {"shape": "polynomial", "from": 0.0, "to": 0.0, "duration": 1.0}
    frame = {"mass": 1.0, "points": {"root": [0.0, 0.0, 0.0], "tip": [0.0, 0.0, 0.0], "foot": [GROUND, 0.0, 0.0]}}
    between = {"name": "pivot", "link": "rocker", "node": "tip", "to_link": "frame", "to_node": "foot"}
    held["drive"] = {"type": "motion", "motion": still}
    on_link = {
        **data,
        "joints": [held, *data["joints"]],
        "links": [{"name": "frame", "rigid": {**frame, "inertia": [1e-3, 1e-3, 1e-3]}}, *data["links"]],
        "loops": [between],
    }
    one = loop_scenes.run(tmp_path, data, duration=0.1)
    two = loop_scenes.run(tmp_path, on_link, duration=0.1)
    t = np.linspace(0, 0.1, 7)
    np.testing.assert_allclose(two.position("rocker middle", t), one.position("rocker middle", t), atol=1e-12)
    np.testing.assert_allclose(two.loop_reaction("pivot", t)[0], one.loop_reaction("pivot", t)[0], atol=1e-9)
    np.testing.assert_allclose(two.joint_effort("j0", t), one.joint_effort("j0", t), atol=1e-9)
    carried = one.reaction("j0", t)[0] + one.loop_reaction("pivot", t)[0] + [0.0, 0.0, 9.81]
    np.testing.assert_allclose(two.reaction("held", t)[0], carried, atol=1e-9)


def _link(name: str, length: float, mass: float) -> dict[str, Any]:
    return {"name": name, "rigid": loop_scenes.bar(length, mass), "mesh_pose": {"frame": "joint"}}


def _five_bar() -> dict[str, Any]:
    """Two arms of two bars from the ground, their elbows up; one motor moves, a torque acts in the middle."""
    lengths, angles = (0.2, 0.3, 0.3, 0.2), (110.0, -60.0, -100.0, -50.0)
    torque = {"type": "torque", "profiles": [{"shape": "constant", "value": 0.3}]}
    joints = [loop_scenes.joint(f"j{k}", a, d) for k, (a, d) in enumerate(zip(lengths, angles, strict=True))]
    joints[2]["drive"] = torque
    links = [_link(f"l{k}", a, 0.4) for k, a in enumerate(lengths)]
    data = loop_scenes.four_bar()
    loops = [{"name": "foot", "link": "l3", "node": "tip", "position": [0.25, 0.0, 0.0]}]
    points = [{"name": "hand", "link": "l1", "node": "tip"}, {"name": "foot", "link": "l3", "node": "tip"}]
    move = {"shape": "polynomial", "from_deg": 110.0, "to_deg": 130.0, "duration": 0.2}
    data = {**data, "joints": joints, "links": links, "loops": loops, "points": points}
    return loop_scenes.driven(data, {"type": "motion", "motion": move})


def test_five_bar_robot_runs(tmp_path: Path) -> None:
    """It closes from a guess, has one freedom beside its motor, and both formulations and the work balance agree."""
    runs = {
        name: loop_scenes.run(tmp_path, _five_bar(), name, integrator="dop853", duration=0.06, rtol=1e-9, atol=1e-10)
        for name in ("erls", "ffr")
    }
    t = np.linspace(0, 0.06, 11)
    for run in runs.values():
        assert run.summary()["degrees_of_freedom"] == 1
        np.testing.assert_allclose(run.position("foot", t), np.tile([0.25, 0.0, 0.0], (11, 1)), atol=1e-13)
    run = runs["erls"]
    np.testing.assert_allclose(run.position("hand", t), runs["ffr"].position("hand", t), atol=1e-9)
    energy = run.energy([0.0, run.end]).total
    assert loop_scenes.work(run, "j0", "j2") == pytest.approx(energy[1] - energy[0], abs=1e-8)


def test_spatial_loop_with_a_ball_joint(tmp_path: Path) -> None:
    """Six revolute joints in space and a spherical one at the end: free motion keeps the energy, in any integrator."""
    alphas = (90.0, -90.0, 90.0, -60.0, 45.0, 0.0)
    joints = [loop_scenes.joint(f"j{k}", 0.2, 20.0 * (-1) ** k) for k in range(6)]
    for record, alpha in zip(joints, alphas, strict=True):
        record["dh"]["alpha_deg"] = alpha
    links = [_link(f"l{k}", 0.2, 0.3) for k in range(6)]
    loops = [{"name": "ball", "type": "spherical", "link": "l5", "node": "tip", "position": [0.5, 0.2, 0.1]}]
    data = {**loop_scenes.four_bar(), "joints": joints, "links": links, "loops": loops}
    data["points"] = [{"name": "end", "link": "l5", "node": "tip"}, {"name": "knee", "link": "l2", "node": "tip"}]
    exact = loop_scenes.run(tmp_path, data, "ffr", integrator="dop853", duration=0.03, rtol=1e-9)
    assert exact.summary()["degrees_of_freedom"] == 3
    assert not any("follow from the others" in w for w in exact.warnings)
    t = np.linspace(0, 0.03, 11)
    np.testing.assert_allclose(exact.position("end", t), np.tile([0.5, 0.2, 0.1], (11, 1)), atol=1e-13)
    assert np.ptp(exact.energy(t).total) < 1e-8
    # 1 ms, second order; rtol 1e-8; tolerance 1e-5 m
    for integrator, distance in {"generalized_alpha": 2e-5, "radau": 1e-6, "lobatto": 1e-5}.items():
        run = loop_scenes.run(tmp_path, data, "erls", integrator=integrator, duration=0.03)
        assert np.abs(run.position("knee", t) - exact.position("knee", t)).max() < distance


def test_run_file_keeps_loops(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run read again answers alike, reactions of loops included."""
    run = loop_scenes.run(tmp_path, loop_scenes.four_bar(), duration=0.02)
    monkeypatch.setattr("erls.run.file._OUTPUT_TIMES", 5)
    save_run(tmp_path / "loop.run.h5", run)
    again = load_run(tmp_path / "loop.run.h5")
    assert again.loop_names == ("pivot",)
    np.testing.assert_array_equal(again.loop_reaction("pivot", 0.01)[0], run.loop_reaction("pivot", 0.01)[0])
    np.testing.assert_array_equal(again.position("coupler tip", 0.01), run.position("coupler tip", 0.01))
    assert again.warnings == run.warnings


@pytest.mark.parametrize("integrator", ["generalized_alpha", "dop853", "lobatto"])
def test_lock_up_is_named(tmp_path: Path, integrator: str) -> None:
    """A rocker driven beyond its dead point, where crank and coupler stretch out: loop and time are named."""
    data = loop_scenes.four_bar()
    for k, (length, angle) in enumerate(((0.35, None), (0.45, 150.0), (0.15, -60.0))):
        data["joints"][k] = loop_scenes.joint(f"j{k}", length, angle)
        data["links"][k]["rigid"] = loop_scenes.bar(length, 0.5)
    # stretched: law of cosines in the triangle of rocker, ground and crank + coupler
    stretched = np.degrees(np.arccos((0.35**2 + GROUND**2 - 0.6**2) / (2 * 0.35 * GROUND)))
    shortened = np.degrees(np.arccos((0.35**2 + GROUND**2 - 0.3**2) / (2 * 0.35 * GROUND)))
    data = loop_scenes.driven(data, loop_scenes.steady(float(stretched + shortened) / 2, 180.0))
    with pytest.raises(SimulationError, match=r"loop 'pivot' locks.*dead point") as caught:
        loop_scenes.run(tmp_path, data, integrator=integrator, duration=0.5, rtol=1e-5, atol=1e-8)
    assert caught.value.cause == Cause.LOOP_OPEN
    assert caught.value.exit_code == 3
    assert caught.value.run.end == pytest.approx((stretched - shortened) / 2 / 180.0, abs=2e-3)


def test_conditions_left_out_are_watched(tmp_path: Path) -> None:
    """Two links in line, held at both ends: the condition along the line depends on the others there, not later."""
    data = loop_scenes.four_bar()
    data["joints"] = [loop_scenes.joint("j0", 0.2, 0.0), loop_scenes.joint("j1", 0.2, 0.0)]
    data["links"] = data["links"][:2]
    for link in data["links"]:
        link["rigid"] = loop_scenes.bar(0.2, 0.5)
    data["points"] = []
    data["loops"] = [{"name": "end", "link": "coupler", "node": "tip", "position": [0.4, 0.0, 0.0]}]
    with pytest.raises(SimulationError, match=r"end.*comes apart.* followed from the other") as caught:
        loop_scenes.run(tmp_path, data)
    assert caught.value.cause == Cause.LOOP_OPEN


@pytest.mark.parametrize("formulation", ["erls", "ffr", "nodal"])
def test_loops_that_do_not_fit_to_the_last_digit(tmp_path: Path, formulation: str) -> None:
    """A pivot 0.1 nm out of the plane, in which nothing moves: assembled, told, and the motion of one that fits."""
    data = loop_scenes.four_bar()
    fits = loop_scenes.run(tmp_path, data, duration=0.02, formulation=formulation)
    data["loops"][0]["position"][1] = 1e-10
    run = loop_scenes.run(tmp_path, data, duration=0.02, formulation=formulation)
    at = np.linspace(0.0, 0.02, 5)
    gap = np.abs(run.position("coupler tip", at) - fits.position("coupler tip", at)).max()
    assert gap < 2e-10  # the plane moves by less than the gap
    if formulation != "nodal":
        assert any("leave 1e-10 m open, within the assembly tolerance of 4.5e-09 m" in text for text in run.warnings)
    data["loops"][0]["position"][1] = 1e-8
    with pytest.raises(SimulationError, match="stays open") as caught:
        loop_scenes.run(tmp_path, data, formulation=formulation)
    assert caught.value.cause == Cause.LOOP_OPEN


def test_joints_near_the_ground_keep_their_start(tmp_path: Path) -> None:
    """Whatever the guess, the crank stays where it was put, and rates of the others follow."""
    data = loop_scenes.four_bar()
    data["joints"][0]["initial"]["rate_deg"] = 50.0
    for guess in (-40.0, -20.0, -60.0):
        data["joints"][1]["initial"]["position_deg"] = guess
        run = loop_scenes.run(tmp_path, data, duration=0.002)
        coupler, rocker = loop_scenes.four_bar_angles(np.radians(60.0))
        angles = [float(run.joint_angle(f"j{k}", 0.0)) for k in range(3)]
        np.testing.assert_allclose(np.cumsum(angles), [np.radians(60.0), coupler, rocker], atol=1e-12)
        assert float(run.joint_rate("j0", 0.0)) == pytest.approx(np.radians(50.0), rel=1e-12)
        h = 1e-6
        ahead = loop_scenes.four_bar_angles(np.radians(60.0) + h)[0] - coupler
        rate = float(ahead) / h * np.radians(50.0) - np.radians(50.0)
        assert float(run.joint_rate("j1", 0.0)) == pytest.approx(rate, rel=1e-5)


def test_scenes_of_the_folder_close(tmp_path: Path) -> None:
    """The shipped rigid four-bar runs as its header says."""
    from erls import load_scene
    from erls.simulation.simulate import simulate

    changes = ["simulation.duration=0.05", "simulation.step=5e-3"]
    run = simulate(load_scene(scenes.ROOT / "data/four_bar/rigid.toml", changes))
    coupler, _ = loop_scenes.four_bar_angles(np.radians(78.0))
    wanted = LENGTHS[0] * np.exp(1j * np.radians(78.0)) + LENGTHS[1] * np.exp(1j * coupler)
    np.testing.assert_allclose(planar(run.position("rocker_pin", 0.05)), wanted, atol=1e-12)

"""The ERLS equations: mass matrix against residual, energy against power, gauges, reactions, equilibrium."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.equations.erls.paper.pack import GAUGES
from erls.errors import Cause, SimulationError
from erls.mechanism.links import link_mass_properties

KINDS = ("revolute", "mixed", "prescribed")
SPRINGS: dict[str, Any] = {"stiffness": 3.0, "rest": 0.2, "motor": {"rotor_inertia": 2e-4, "gear_ratio": 10.0}}
STEP = 1e-6


def _equations(folder: Path, kind: str, gauge: str, **joint: Any) -> Any:
    data = scenes.read_toml(scenes.three_links(folder, kind))
    for record in data["joints"]:
        record.update(joint)
    return scenes.equations(scenes.write_toml(folder / "three.toml", data), gauge)


def _random(equations: Any, seed: int = 2) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    f = len(equations.free_joints)
    y, v, a = rng.uniform(-1, 1, (3, equations.size))
    y[f:] *= 1e-2
    return y, v, a


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("gauge", GAUGES)
def test_residual_is_linear_with_the_mass_matrix(tmp_path: Path, kind: str, gauge: str) -> None:
    """r(a) - r(0) = M a with M symmetric positive definite, and the acceleration solves r = 0; to rounding."""
    equations = _equations(tmp_path, kind, gauge, **SPRINGS)
    y, v, a = _random(equations)
    mass = equations.mass_matrix(0.3, y)
    np.testing.assert_allclose(mass, mass.T, atol=1e-14 * np.abs(mass).max())
    assert np.linalg.eigvalsh(mass).min() > 0
    zero = equations.residual(0.3, y, v, 0 * a)
    found = equations.residual(0.3, y, v, a) - zero
    np.testing.assert_allclose(found, mass @ a, atol=1e-12 * np.abs(zero).max())
    solved = equations.residual(0.3, y, v, equations.acceleration(0.3, y, v))
    assert np.abs(solved).max() <= 1e-10 * np.abs(zero).max()


@pytest.mark.parametrize("kind", ["revolute", "mixed"])
@pytest.mark.parametrize("gauge", GAUGES)
def test_energy_grows_with_the_power_of_unbalanced_forces(tmp_path: Path, kind: str, gauge: str) -> None:
    """dE/dt along any (y, v, a) = rᵀ v: the equations follow from T and V exactly. Tolerance: differences, 1e-8.

    With springs and rotors, so that the physical joint angle and its second derivative are covered in both gauges.
    """
    equations = _equations(tmp_path, kind, gauge, **SPRINGS)
    for seed in range(3):
        y, v, a = _random(equations, seed)

        def energy(t: float, y: np.ndarray = y, v: np.ndarray = v, a: np.ndarray = a) -> float:
            return equations.energy(0.0, y + t * v + t**2 / 2 * a, v + t * a).total

        growth = (energy(STEP) - energy(-STEP)) / (2 * STEP)
        power = equations.residual(0.0, y, v, a) @ v
        assert growth == pytest.approx(power, rel=1e-7)


@pytest.mark.parametrize("gauge", GAUGES)
def test_physical_angle_and_its_rate(tmp_path: Path, gauge: str) -> None:
    """The rate of the reported joint angle is the derivative of the angle; in the joint-angle gauge it is θ."""
    equations = _equations(tmp_path, "mixed", gauge)
    y, v, _ = _random(equations)
    state = equations.state(0.0, y, v)
    later, before = (equations.state(0.0, y + s * STEP * v, v).angles for s in (1, -1))
    np.testing.assert_allclose((later - before) / (2 * STEP), state.rates, atol=1e-8 * np.abs(state.rates).max())
    same = np.allclose(state.angles, state.coordinates, atol=0)
    assert same == (gauge == "joint-angle")


@pytest.mark.parametrize("gauge", GAUGES)
def test_weight_hangs_on_the_ground(tmp_path: Path, gauge: str) -> None:
    """At rest in equilibrium, all joints driven: reaction force = total weight, moment = weight x lever arm, where
    the centre of mass is that of the deformed chain, summed over its nodes independently. 1e-9 relative.
    """
    arms = scenes.read_toml(scenes.three_links(tmp_path))
    for joint in arms["joints"]:
        held = {"shape": "polynomial", "from": 0.3, "to": 0.3, "duration": 1.0}
        joint["drive"] = {"type": "motion", "motion": held}
    arms["initial"] = {"deformation": "static"}
    arms["payloads"] = [{"point": "end", "mass": 0.2, "offset": [0.0, 0.0, 0.1]}]
    equations = scenes.equations(scenes.write_toml(tmp_path / "held.toml", arms), gauge)
    y, v = equations.initial_state()
    scale = np.abs(equations.stiffness * y).max()
    assert np.abs(equations.residual(0.0, y, v, 0 * y)).max() <= 1e-9 * scale
    state = equations.state(0.0, y, v)
    mass, moment = 0.0, np.zeros(3)
    for link, frame, modal in zip(equations.mechanism.links, state.poses, state.modal, strict=True):
        body = link_mass_properties(link)
        shape = link.invariants.rigid[:, :3].T @ link.invariants.m  # ∫ρ u per modal coordinate
        local = body.mass * body.centre_of_mass + shape @ modal
        mass += body.mass
        moment += frame[:3, :3] @ local + body.mass * frame[:3, 3]
    reaction = equations.reactions(0.0, y, v)[0]
    g = equations.mechanism.gravity
    np.testing.assert_allclose(reaction.force, -mass * g, atol=1e-9 * mass * 9.81)
    root = equations.mechanism.links[0]
    node = root.inboard.node
    shape = root.model.translation_shapes[node] @ state.modal[0]
    at = state.poses[0][:3, :3] @ (root.model.nodes[node] + shape) + state.poses[0][:3, 3]
    expected = -np.cross(moment - mass * at, g)
    np.testing.assert_allclose(reaction.moment, expected, atol=1e-9 * np.abs(expected).max())


def test_static_start_stays_at_rest(tmp_path: Path) -> None:
    """Links that start in equilibrium and are held there do not vibrate; undeformed ones do."""
    held = {"type": "motion", "motion": {"shape": "polynomial", "from": 0.0, "to": 0.0, "duration": 1.0}}
    joints = [{**scenes.L_SCENE["joints"][0], "drive": held}]
    scenes.l_link(tmp_path, 2)
    moves = {}
    for start in ("static", "zero"):
        scene = scenes.l_scene(
            tmp_path, joints=joints, initial={"deformation": start}, simulation={"duration": 0.1, "step": 1e-3}
        )
        run = erls.simulate(scene, verdict=False)
        moves[start] = np.ptp(run.position("tip", np.linspace(0, 0.1, 50)), axis=0).max()
    assert moves["static"] < 1e-11  # rounding of a deflection of 1e-3 m
    assert moves["zero"] > 1e-4


def test_static_deflection_of_a_cantilever(tmp_path: Path) -> None:
    """Tip of a held straight link under its weight and a payload: ρA g L⁴ / 8EI + F L³ / 3EI.

    Euler-Bernoulli elements with work-equivalent loads are exact at the nodes, and all modes are kept; 1e-9 is
    rounding times the condition of the clamped stiffness.
    """
    frame = {
        "theory": "euler-bernoulli",
        "nodes": {"root": [0.0, 0.0, 0.0], "tip": [0.5, 0.0, 0.0]},
        "members": [{"from": "root", "to": "tip", "elements": 3, "material": "m", "section": "s"}],
    }
    scenes.write_toml(tmp_path / "link.toml", {**scenes.L_LINK, "frame": frame})
    held = {"type": "motion", "motion": {"shape": "polynomial", "from": 0.0, "to": 0.0, "duration": 1.0}}
    scene = scenes.l_scene(
        tmp_path,
        joints=[{**scenes.L_SCENE["joints"][0], "drive": held}],
        points=[{"name": "tip", "link": "l", "node": "tip"}],
        payloads=[{"point": "tip", "mass": 0.5}],
        initial={"deformation": "static"},
        simulation={"duration": 1e-3, "step": 1e-3},
    )
    bending = 2e11 * 0.01 * 0.03**3 / 12
    expected = 9.81 * (7800 * 0.01 * 0.03 * 0.5**4 / 8 + 0.5 * 0.5**3 / 3) / bending
    assert -float(erls.simulate(scene, verdict=False).position("tip", 0.0)[2]) == pytest.approx(expected, rel=1e-9)


def test_prescribed_joints_count_six_rows_in_both_gauges(tmp_path: Path) -> None:
    """With every joint driven both gauges are one: same accelerations to rounding."""
    found = []
    for gauge in GAUGES:
        equations = _equations(
            tmp_path,
            "revolute",
            gauge,
            drive={"type": "motion", "motion": {"shape": "sine", "amplitude": 0.5, "frequency_hz": 1.0}},
        )
        y, v, _ = _random(equations)
        found.append(equations.acceleration(0.2, y, v))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9, atol=1e-9 * np.abs(found[0]).max())


def test_effort_of_a_prescribed_motion_is_the_power_supplied(tmp_path: Path) -> None:
    """Energy gained along the motion = work of the motors, ∫ Σ effort · rate dt. 1e-6: Gauss over the vibration."""
    motion = {"shape": "polynomial", "from": 0.0, "to": 0.8, "duration": 0.25, "degree": 7}
    data = scenes.read_toml(scenes.three_links(tmp_path))
    for joint in data["joints"]:
        joint["drive"] = {"type": "motion", "motion": motion}
    for link in data["links"]:
        link["elastic_modes"] = 2
    data["simulation"] = {"duration": 0.2, "integrator": "dop853", "rtol": 1e-9}
    run = erls.simulate(scenes.write_toml(tmp_path / "driven.toml", data), verdict=False)
    points, weights = np.polynomial.legendre.leggauss(400)
    times = 0.1 * (points + 1)
    power = sum(run.joint_effort(name, times) * run.joint_rate(name, times) for name in run.joint_names)
    energy = run.energy([0.0, 0.2]).total
    assert 0.1 * weights @ power == pytest.approx(np.diff(energy)[0], rel=1e-6)


def test_massless_chain_is_refused_with_the_joint(tmp_path: Path) -> None:
    """SINGULAR_MASS names the joint that nothing resists."""
    body = {"mass": 0.0, "points": {"a": [0.0, 0.0, 0.0]}}
    scene = scenes.l_scene(tmp_path, links=[{"name": "l", "rigid": body}], points=[])
    with pytest.raises(SimulationError, match="shoulder") as caught:
        erls.simulate(scene, verdict=False)
    assert caught.value.cause == Cause.SINGULAR_MASS
    assert caught.value.exit_code == 3


def test_no_equilibrium_is_reported(tmp_path: Path) -> None:
    """Links that would sag by more than their size have no equilibrium within small displacements; linear ones, which
    keep their stiffness: with geometric stiffening they buckle before.
    """
    scenes.l_link(tmp_path, 2)
    changes = {"simulation": {"effects": "linear"}, "initial": {"deformation": "static"}}
    scene = scenes.l_scene(tmp_path, **changes, gravity=[0.0, 0.0, -1e7])
    with pytest.raises(SimulationError) as caught:
        erls.simulate(scene, verdict=False)
    assert caught.value.cause == Cause.NO_EQUILIBRIUM
    assert caught.value.remedy
    assert caught.value.exit_code == 3


@pytest.mark.parametrize("kind", ["free", "pd"])
def test_joint_friction_and_damping_take_energy(tmp_path: Path, kind: str) -> None:
    """Energy lost = work of damping and friction, ∫ effort · rate, for a free joint. 1e-5: Gauss over 1 s."""
    joint = {**scenes.L_SCENE["joints"][0], "damping": 0.2, "friction": {"force": 0.5, "transition_rate": 0.05}}
    if kind == "pd":
        motion = {"shape": "polynomial", "from": 0.0, "to": 1.0, "duration": 0.5}
        joint["drive"] = {"type": "pd", "motion": motion, "proportional_gain": 50.0, "derivative_gain": 2.0}
    scenes.l_link(tmp_path, 2, reduction={"elastic_modes": 2})
    simulation = {"duration": 0.4, "integrator": "dop853", "rtol": 1e-9, "step": 0.1}
    scene = scenes.l_scene(tmp_path, joints=[joint], simulation=simulation)
    run = erls.simulate(scene, verdict=False)
    points, weights = np.polynomial.legendre.leggauss(400)
    times = 0.2 * (points + 1)
    work = 0.2 * weights @ (run.joint_effort("shoulder", times) * run.joint_rate("shoulder", times))
    assert np.diff(run.energy([0.0, 0.4]).total)[0] == pytest.approx(work, rel=1e-5)
    assert not run.conservative


def test_feed_forward_makes_a_stiff_robot_follow(tmp_path: Path) -> None:
    """PD with the rigid inverse dynamics added follows rigid links to integration accuracy, PD alone does not."""
    body = {"mass": 1.0, "centre_of_mass": [0.2, 0.0, 0.0], "inertia": [0.01, 0.01, 0.01]}
    links = [
        {"name": n, "rigid": {**body, "points": {"root": [0.0, 0.0, 0.0], "tip": [0.4, 0.0, 0.0]}},
         "mesh_pose": {"frame": "joint"}}
        for n in "ab"
    ]  # fmt: skip
    errors = {}
    for forward in (True, False):
        drive = {
            "type": "pd", "proportional_gain": 20.0, "derivative_gain": 1.0, "feed_forward": forward,
            "motion": {"shape": "polynomial", "from": 0.0, "to": 1.0, "duration": 0.4, "degree": 7},
        }  # fmt: skip
        joints = [
            {"name": n, "dh": {"convention": "standard", "a": 0.4, "alpha_deg": 90.0}, "drive": drive} for n in "ab"
        ]
        data = {"simulation": {"duration": 0.5, "step": 1e-3}, "joints": joints, "links": links}
        run = erls.simulate(scenes.write_toml(tmp_path / "pd.toml", data), verdict=False)
        errors[forward] = max(abs(float(run.joint_angle(n, 0.4)) - 1.0) for n in "ab")
    assert errors[True] < 1e-5  # second order at 1 ms
    assert errors[False] > 1e-2

"""The floating-frame equations: mass matrix against residual, energy against power, kinematics, closed forms, ERLS."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
import scipy.linalg as la

import erls
from erls.equations.erls.formulation import Erls
from erls.equations.ffr.body_frame import BODY_FRAMES
from erls.equations.ffr.formulation import Ffr
from erls.equations.serial.equilibrium import equilibrium, held_tree
from erls.equations.serial.nodes import Node, NodeState, move_node, node_state, place_node
from erls.errors import Cause, SimulationError
from erls.maths.jit import plain
from erls.maths.so3 import Array, skew
from erls.mechanism.links import link_mass_properties
from erls.mechanism.rigid_dynamics import inverse_dynamics

KINDS = ("revolute", "mixed", "prescribed")
SPRINGS: dict[str, Any] = {"stiffness": 3.0, "rest": 0.2, "motor": {"rotor_inertia": 2e-4, "gear_ratio": 10.0}}
PAYLOAD = [{"point": "end", "mass": 0.2, "inertia": [1e-3, 2e-3, 2.5e-3], "offset": [0.0, 0.02, 0.1]}]
HELD = {"type": "motion", "motion": {"shape": "polynomial", "from": 0.3, "to": 0.3, "duration": 1.0}}
STEP = 1e-6


def _equations(folder: Path, kind: str, body_frame: str, **joint: Any) -> Ffr:
    data = scenes.read_toml(scenes.three_links(folder, kind, payloads=PAYLOAD))
    for record in data["joints"]:
        record.update(joint)
    return Ffr(scenes.mechanism(scenes.write_toml(folder / "three.toml", data)), body_frame)


def _random(equations: Ffr | Erls, seed: int = 2) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(seed)
    f = len(equations.free_joints)
    y, v, a = rng.uniform(-1, 1, (3, equations.size))
    y[f:], v[f:] = 1e-2 * y[f:], 1e-1 * v[f:]
    return y, v, a


@pytest.mark.parametrize("size", [0.0, 1e-3, 0.3, 0.7, 0.71, 2.5])
def test_nodes_move_against_differences(size: float) -> None:
    """Pose = exp(φ) and u; twist and its rate are the derivatives of the pose; both branches of the factors."""
    rng = np.random.default_rng(4)
    rotation, translation = rng.uniform(-1, 1, (2, 3, 5))
    eta, rate = rng.uniform(-1, 1, (2, 5))
    eta *= size / np.linalg.norm(rotation @ eta)
    node = Node(0, 1, np.array([0.1, 0.2, 0.3]), np.vstack([translation, rotation]), np.zeros((0, 0)))

    def moved(eta: Array) -> NodeState:
        state = NodeState(*(np.array(part) for part in node_state(5, False)))
        plain(place_node)(node, state, eta)
        plain(move_node)(node, state, rate, np.zeros(0))
        return state

    found, h = moved(eta), 1e-5
    before, after = (moved(eta + s * h * rate) for s in (-1, 1))
    turn, change = found.pose[:9].reshape(3, 3), (after.pose - before.pose) / (2 * h)
    np.testing.assert_allclose(turn, la.expm(skew(rotation @ eta)), atol=1e-14)
    np.testing.assert_allclose(turn.T @ change[9:], found.twist[:3], atol=1e-9)
    np.testing.assert_allclose(turn.T @ change[:9].reshape(3, 3), skew(found.twist[3:]), atol=1e-9)
    np.testing.assert_allclose((after.twist - before.twist) / (2 * h), found.twist_rate, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_residual_is_linear_with_the_mass_matrix(tmp_path: Path, kind: str, body_frame: str) -> None:
    """r(a) - r(0) = M a with M symmetric positive definite, and the acceleration solves r = 0; to rounding."""
    equations = _equations(tmp_path, kind, body_frame, **SPRINGS)
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
@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_energy_grows_with_the_power_of_unbalanced_forces(tmp_path: Path, kind: str, body_frame: str) -> None:
    """dE/dt along any (y, v, a) = rᵀ v: the projected equations follow from T and V exactly. Differences, 1e-7."""
    equations = _equations(tmp_path, kind, body_frame, **SPRINGS)
    for seed in range(3):
        y, v, a = _random(equations, seed)

        def energy(t: float, y: Array = y, v: Array = v, a: Array = a) -> float:
            return equations.energy(0.0, y + t * v + t**2 / 2 * a, v + t * a).total

        growth = (energy(STEP) - energy(-STEP)) / (2 * STEP)
        assert growth == pytest.approx(equations.residual(0.0, y, v, a) @ v, rel=1e-7)


@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_twists_are_the_rates_of_the_poses(tmp_path: Path, body_frame: str) -> None:
    """Every floating frame moves with its twist; joint angles and rates are those of the coordinates."""
    equations = _equations(tmp_path, "mixed", body_frame)
    y, v, _ = _random(equations)
    motion = equations.motion(0.0, y, v)
    later, before = (equations.motion(0.0, y + s * STEP * v, v) for s in (1, -1))
    for pose, twist, one, two in zip(motion.poses, motion.twists, later.poses, before.poses, strict=True):
        turning = pose[:3, :3].T @ (one - two)[:3] / (2 * STEP)
        size = 1e-8 * np.abs(twist).max()
        np.testing.assert_allclose(turning[:, 3], twist[:3], atol=size)
        np.testing.assert_allclose(turning[:, :3], skew(twist[3:]), atol=size)
    state = equations.state(0.0, y, v)
    np.testing.assert_array_equal(state.angles, y[:3])
    np.testing.assert_array_equal(state.rates, v[:3])


def _displaced(equations: Ffr, motion: Any, k: int, interface: Any) -> Array:
    """(4, 4) pose of a displaced interface node in the world, from the fields that a run draws."""
    link = equations.mechanism.links[k]
    translation, rotation = link.model.node_shape(interface.node)
    modal = equations.bases[k] @ motion.eta[equations.modes[k]]
    local = np.eye(4)
    local[:3, :3] = la.expm(skew(rotation @ modal))
    local[:3, 3] = interface.position + translation @ modal
    return np.asarray(motion.poses[k] @ local)


@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_joints_hold_the_displaced_interfaces_together(tmp_path: Path, body_frame: str) -> None:
    """Joint frames, carried by the displaced interface nodes of either link, differ by the joint's motion alone."""
    equations = _equations(tmp_path, "mixed", body_frame)
    y, v, _ = _random(equations)
    motion = equations.motion(0.0, y, v)
    links, joints = equations.mechanism.links, equations.mechanism.joints
    for k in (1, 2):
        outboard, inboard = joints[k].seat, links[k].inboard
        assert outboard is not None
        first = _displaced(equations, motion, k - 1, outboard)
        second = _displaced(equations, motion, k, inboard)
        shift_out, shift_in = np.eye(4), np.eye(4)
        shift_out[:3, 3], shift_in[:3, 3] = -outboard.position, -inboard.position
        relative = la.inv(first @ shift_out @ joints[k].before) @ second @ shift_in @ la.inv(joints[k].after)
        expected = np.eye(4)
        if joints[k].freedom.turns:
            expected[:2, :2] = [[np.cos(y[k]), -np.sin(y[k])], [np.sin(y[k]), np.cos(y[k])]]
        else:
            expected[2, 3] = y[k]
        np.testing.assert_allclose(relative, expected, atol=1e-13)


@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_rigid_chain_against_recursion(tmp_path: Path, body_frame: str) -> None:
    """Residual of rigid links = torques of the Newton-Euler recursion, with payload and rotors; 1e-10 relative."""
    data = scenes.read_toml(scenes.three_links(tmp_path, "mixed", payloads=PAYLOAD))
    data["joints"][1]["motor"] = {"rotor_inertia": 1e-4, "gear_ratio": 50.0, "mass": 0.3, "inertia": [1e-4, 1e-4, 2e-4]}
    for link in data["links"]:
        link["flexible"] = False
    chain = scenes.mechanism(scenes.write_toml(tmp_path / "rigid.toml", data))
    equations = Ffr(chain, body_frame)
    rng = np.random.default_rng(7)
    for _ in range(5):
        theta, rates, accelerations = rng.uniform(-2, 2, (3, 3))
        expected = inverse_dynamics(chain, theta, rates, accelerations)
        found = equations.residual(0.0, theta, rates, accelerations)
        np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())


def test_rigid_robot_feels_joints_and_drives_as_in_erls(tmp_path: Path) -> None:
    """PD with feed-forward and limit, spring, damper, friction, rotor: same residual, effort, reactions; rounding."""
    motion = {"shape": "polynomial", "from": 0.0, "to": 1.0, "duration": 0.4, "degree": 7}
    drive = {
        "type": "pd", "proportional_gain": 20.0, "derivative_gain": 1.0, "feed_forward": True, "motion": motion,
        "torque_limit": 12.0,
    }  # fmt: skip
    data = scenes.read_toml(scenes.three_links(tmp_path, "prescribed", payloads=PAYLOAD))
    for joint in data["joints"]:
        joint.update(SPRINGS, damping=0.1, friction={"force": 0.05, "transition_rate": 0.02})
    data["joints"][0]["drive"] = drive
    for link in data["links"]:
        link["flexible"] = False
    chain = scenes.mechanism(scenes.write_toml(tmp_path / "robot.toml", data))
    ours, theirs = Ffr(chain), Erls(chain)
    y, v, a = _random(ours)
    expected = theirs.residual(0.2, y, v, a)
    np.testing.assert_allclose(ours.residual(0.2, y, v, a), expected, atol=1e-11 * np.abs(expected).max())
    pairs = zip(ours.reactions(0.2, y, v), theirs.reactions(0.2, y, v), strict=True)
    for mine, other in pairs:
        np.testing.assert_allclose(mine.force, other.force, atol=1e-9 * np.abs(other.force).max())
        np.testing.assert_allclose(mine.moment, other.moment, atol=1e-9 * np.abs(other.moment).max())
        assert mine.effort == pytest.approx(other.effort, rel=1e-9)
    for mine, other in zip(ours.stiffness_and_damping(0.2, y, v), theirs.stiffness_and_damping(0.2, y, v), strict=True):
        np.testing.assert_allclose(mine, other, rtol=1e-12)


def test_one_link_in_its_tangent_frame_is_the_erls_link(tmp_path: Path) -> None:
    """With six rows at the ground the rigid system of ERLS is the tangent frame: same equations from other terms."""
    scenes.l_link(tmp_path, 2)
    payloads = [{**PAYLOAD[0], "point": "tip"}]
    chain = scenes.mechanism(scenes.l_scene(tmp_path, payloads=payloads))
    ours, theirs = Ffr(chain), Erls(chain)
    y, v, a = _random(ours)
    expected = theirs.residual(0.0, y, v, a)
    np.testing.assert_allclose(ours.residual(0.0, y, v, a), expected, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(ours.length_scales, theirs.length_scales, rtol=1e-12)
    mine, other = ours.reactions(0.0, y, v)[0], theirs.reactions(0.0, y, v)[0]
    np.testing.assert_allclose(mine.moment, other.moment, atol=1e-9 * np.abs(other.moment).max())
    assert ours.energy(0.0, y, v).total == pytest.approx(theirs.energy(0.0, y, v).total, rel=1e-12)


@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_clamped_frequencies_are_those_of_the_model(tmp_path: Path, body_frame: str) -> None:
    """A link held at its joint, all modes kept: the frequencies of the reduced matrices with the interface clamped.

    Whatever the floating frame; 1e-9 is rounding times the spread of the frequencies.
    """
    scenes.l_link(tmp_path, 2, reduction={"fixed_interface_modes": 18})
    joints = [{**scenes.L_SCENE["joints"][0], "drive": HELD}]
    equations = Ffr(scenes.mechanism(scenes.l_scene(tmp_path, joints=joints)), body_frame)
    y, v = equations.initial_state()
    stiffness, _ = equations.stiffness_and_damping(0.0, y, v)
    found = la.eigh(stiffness, equations.mass_matrix(0.0, y), eigvals_only=True)
    model = equations.mechanism.links[0].model
    held = la.null_space(np.vstack(model.node_shape(equations.mechanism.links[0].inboard.node)))
    expected = la.eigh(held.T @ model.stiffness @ held, held.T @ model.invariants.m @ held, eigvals_only=True)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_weight_hangs_on_the_ground(tmp_path: Path, body_frame: str) -> None:
    """At rest in equilibrium, all joints held: reaction = weight, moment = weight x arm of the deformed chain.

    The arm comes from the nodes' displacements: a weight without its elastic part fails in first order. 1e-9 relative.
    """
    equations = _equations(tmp_path, "revolute", body_frame, drive=HELD)
    y, v = equations.initial_state()
    y, _ = equilibrium(held_tree(equations, y, equations.free_joints), y)
    assert np.abs(equations.residual(0.0, y, v, 0 * y)).max() <= 1e-9 * np.abs(equations.stiffness * y).max()
    state = equations.state(0.0, y, v)
    mass, moment = 0.0, np.zeros(3)
    for link, frame, modal in zip(equations.mechanism.links, state.poses, state.modal, strict=True):
        body = link_mass_properties(link)
        moved = (link.invariants.rigid[:, :3].T @ link.invariants.m) @ modal
        mass += body.mass
        moment += frame[:3, :3] @ (body.mass * body.centre_of_mass + moved) + body.mass * frame[:3, 3]
    reaction, g = equations.reactions(0.0, y, v)[0], equations.mechanism.gravity
    np.testing.assert_allclose(reaction.force, -mass * g, atol=1e-9 * mass * 9.81)
    at = _displaced(equations, equations.motion(0.0, y, v), 0, equations.mechanism.links[0].inboard)[:3, 3]
    expected = -np.cross(moment - mass * at, g)
    np.testing.assert_allclose(reaction.moment, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_effort_of_a_prescribed_motion_is_the_power_supplied(tmp_path: Path, body_frame: str) -> None:
    """Energy gained along the motion = work of the motors, ∫ Σ effort · rate dt. 1e-6: Gauss over the vibration."""
    motion = {"shape": "sine", "amplitude": 0.5, "frequency_hz": 4.0}
    data = scenes.read_toml(scenes.three_links(tmp_path))
    for joint in data["joints"]:
        joint["drive"] = {"type": "motion", "motion": motion}
    for link in data["links"]:
        link["elastic_modes"] = 1
    data["simulation"] = {
        "duration": 0.03, "integrator": "dop853", "rtol": 1e-9, "formulation": "ffr", "body_frame": body_frame,
    }  # fmt: skip
    run = erls.simulate(scenes.write_toml(tmp_path / "driven.toml", data), verdict=False)
    points, weights = np.polynomial.legendre.leggauss(60)
    times = 0.015 * (points + 1)
    power = sum(run.joint_effort(name, times) * run.joint_rate(name, times) for name in run.joint_names)
    energy = run.energy([0.0, 0.03]).total
    assert 0.015 * weights @ power == pytest.approx(np.diff(energy)[0], rel=1e-6)


def test_massless_link_is_refused_with_the_joint(tmp_path: Path) -> None:
    """SINGULAR_MASS names the joint that nothing resists."""
    body = {"mass": 0.0, "points": {"a": [0.0, 0.0, 0.0]}}
    links = [{"name": "l", "rigid": body}]
    scene = scenes.l_scene(tmp_path, links=links, points=[], simulation={"formulation": "ffr"})
    with pytest.raises(SimulationError, match="shoulder") as caught:
        erls.simulate(scene, verdict=False)
    assert caught.value.cause == Cause.SINGULAR_MASS

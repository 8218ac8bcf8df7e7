"""FFR with joints as constraints: group, constraints and their derivatives, against the independent coordinates."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
import scipy.linalg as la

import erls
from erls.formulations.ffr import Ffr
from erls.formulations.ffr.body_frame import BODY_FRAMES
from erls.formulations.ffr.constrained import Configuration, ConstrainedFfr
from erls.formulations.ffr.frame_group import exponential, tangent
from erls.formulations.ffr.redundancy import redundant_rows
from erls.lie.se3 import inverse
from erls.lie.so3 import Array, skew

KINDS = ("revolute", "mixed", "prescribed")
JOINT: dict[str, Any] = {
    "stiffness": 3.0, "rest": 0.2, "damping": 0.1, "friction": {"force": 0.05, "transition_rate": 0.5},
    "motor": {"rotor_inertia": 2e-4, "gear_ratio": 10.0},
}  # fmt: skip
TIME = 0.3


def _system(folder: Path, kind: str, body_frame: str) -> ConstrainedFfr:
    data = scenes.read_toml(scenes.three_links(folder, kind))
    for record in data["joints"]:
        record.update(JOINT)
    return ConstrainedFfr(Ffr(scenes.mechanism(scenes.write_toml(folder / "three.toml", data)), body_frame))


def _random(system: ConstrainedFfr, seed: int = 2) -> tuple[Array, Array]:
    """A state in independent coordinates."""
    y, v = np.random.default_rng(seed).uniform(-1, 1, (2, system.reduced.size))
    f = len(system.reduced.free_joints)
    y[f:], v[f:] = 1e-2 * y[f:], 1e-1 * v[f:]
    return y, v


def _velocity(system: ConstrainedFfr, seed: int) -> Array:
    """Any velocity, whatever the joints allow."""
    v = np.random.default_rng(seed).uniform(-1, 1, system.size)
    v[system.elastic] *= 0.01
    return v


def _accelerations(system: ConstrainedFfr, q: Configuration, v: Array) -> tuple[Array, Array]:
    """a and λ from the equations of motion and the constraints, differentiated twice."""
    b, mass = system.constraint_matrix(TIME, q), system.mass_matrix(TIME, q)
    matrix = np.block([[mass, b.T], [b, np.zeros((len(b), len(b)))]])
    force = system.residual(TIME, q, v, np.zeros(system.size))
    # scaled by coordinates, like an index-3 integrator does
    scale = np.concatenate([1 / np.sqrt(np.diag(mass)), np.sqrt(np.diag(mass)).min() * np.ones(len(b))])
    right = -np.concatenate([force, system.constraint_bias(TIME, q, v)])
    found = scale * la.solve(scale[:, None] * matrix * scale, scale * right)
    return found[: system.size], found[system.size :]


@pytest.mark.parametrize("size", [0.0, 1e-4, 0.5, 2.0])
def test_increments_of_frames(size: float) -> None:
    """The exponential of rigid motions, and its tangent against differences."""
    rng = np.random.default_rng(5)
    xi, change = rng.uniform(-1, 1, (2, 6))
    xi *= size
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = skew(xi[3:]), xi[:3]
    np.testing.assert_allclose(exponential(xi), la.expm(generator), atol=1e-14)
    h = 1e-5
    difference = (exponential(xi + h * change) - exponential(xi - h * change)) / (2 * h)
    moved = inverse(exponential(xi)) @ difference
    twist = tangent(xi) @ change
    np.testing.assert_allclose(moved[:3, 3], twist[:3], atol=1e-9)
    np.testing.assert_allclose(moved[:3, :3], skew(twist[3:]), atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_derivatives_of_the_constraints(tmp_path: Path, kind: str, body_frame: str) -> None:
    """B v + Φ_t and Φ̈ at constant v are the first and second differences of Φ, off the constraints too."""
    system = _system(tmp_path, kind, body_frame)
    q, _ = system.configuration(TIME, *_random(system))
    q, v = system.compose(q, 0.1 * _velocity(system, 0)), _velocity(system, 1)
    h = 1e-4
    before, at, after = (system.constraint(TIME + s * h, system.compose(q, s * h * v)) for s in (-1, 0, 1))
    rate = system.constraint_matrix(TIME, q) @ v + system.constraint_rate(TIME, q)
    np.testing.assert_allclose((after - before) / (2 * h), rate, atol=1e-6 * np.abs(rate).max())
    bias = system.constraint_bias(TIME, q, v)
    np.testing.assert_allclose((after - 2 * at + before) / h**2, bias, atol=1e-5 * np.abs(bias).max())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_same_motion_as_independent_coordinates(tmp_path: Path, kind: str, body_frame: str) -> None:
    """Constraints hold at its states; joint and elastic accelerations, reactions and energies agree to rounding."""
    system = _system(tmp_path, kind, body_frame)
    reduced = system.reduced
    for seed in range(3):
        y, rates = _random(system, seed)
        q, v = system.configuration(TIME, y, rates)
        assert np.abs(system.constraint(TIME, q)).max() <= 1e-14
        rate = system.constraint_matrix(TIME, q) @ v + system.constraint_rate(TIME, q)
        assert np.abs(rate).max() <= 1e-12
        a, multipliers = _accelerations(system, q, v)
        expected = reduced.acceleration(TIME, y, rates)
        f = len(reduced.free_joints)
        np.testing.assert_allclose(a[system.elastic], expected[f:], atol=1e-9 * np.abs(expected).max())
        found = system.stored(TIME, q, v, a)[2][-len(system.along) :][reduced.free_joints]
        np.testing.assert_allclose(found, expected[:f], atol=1e-9 * np.abs(expected).max())
        for mine, theirs in zip(
            system.reactions(TIME, q, v, a, multipliers), reduced.reactions(TIME, y, rates), strict=True
        ):
            np.testing.assert_allclose(mine.force, theirs.force, atol=1e-9 * np.abs(theirs.force).max())
            np.testing.assert_allclose(mine.moment, theirs.moment, atol=1e-9 * np.abs(theirs.moment).max())
            assert mine.effort == pytest.approx(theirs.effort, rel=1e-9)
        mine, theirs = system.energy(TIME, q, v), reduced.energy(TIME, y, rates)
        assert mine.kinetic == pytest.approx(theirs.kinetic, rel=1e-12)
        assert mine.total == pytest.approx(theirs.total, rel=1e-12)


def test_residual_is_linear_with_the_mass_matrix(tmp_path: Path) -> None:
    """r(a) - r(0) = M a, rotors included; M symmetric."""
    system = _system(tmp_path, "mixed", "mean-axis")
    q, v = system.configuration(TIME, *_random(system))
    a = _velocity(system, 3)
    zero, mass = system.residual(TIME, q, v, 0 * a), system.mass_matrix(TIME, q)
    np.testing.assert_allclose(mass, mass.T, atol=1e-14 * np.abs(mass).max())
    np.testing.assert_allclose(system.residual(TIME, q, v, a) - zero, mass @ a, atol=1e-12 * np.abs(zero).max())


def test_gains_are_the_derivatives_of_the_joint_forces(tmp_path: Path) -> None:
    """Springs, dampers and friction at rest: differences of the residual."""
    system = _system(tmp_path, "mixed", "tangent")
    still = np.zeros(system.reduced.size)
    q, v = system.configuration(TIME, still, still)
    stiffness, damping = system.stiffness_and_damping(TIME, q, v, v, np.zeros(system.constraints))
    step = 1e-6 * _velocity(system, 6)
    ahead, back = (system.residual(TIME, q, s * step, v) for s in (1, -1))
    np.testing.assert_allclose((ahead - back) / 2, damping @ step, atol=1e-6 * np.abs(damping @ step).max())
    move = step.copy()
    move[: system.elastic.start] = 0.0  # weights turn with the frames, which the gains leave out
    ahead, back = (system.residual(TIME, system.compose(q, s * move), v, v) for s in (1, -1))
    change = (ahead - back)[system.elastic] / 2
    np.testing.assert_allclose(change, (stiffness @ move)[system.elastic], atol=1e-3 * np.abs(change).max())


def test_stored_knots_give_the_configuration_back(tmp_path: Path) -> None:
    """Frames, elastic coordinates, angles and velocities; stored rates are derivatives."""
    system = _system(tmp_path, "mixed", "mean-axis")
    q, v = system.configuration(TIME, *_random(system))
    v, a = v * 0.1, _velocity(system, 4)
    place, rate, acceleration = system.stored(TIME, q, v, a)
    again, velocity = system.from_stored(place, rate)
    np.testing.assert_allclose(velocity, v, atol=1e-12 * np.abs(v).max())
    for mine, other in zip(again.poses, q.poses, strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-14)
    np.testing.assert_array_equal(again.angles, q.angles)
    h = 1e-5
    moved = [system.stored(TIME, system.compose(q, s * h * v + h**2 / 2 * a), v + s * h * a, a) for s in (1, -1)]
    first = (moved[0][0] - moved[1][0]) / (2 * h)
    np.testing.assert_allclose(first, rate, atol=1e-6 * np.abs(rate).max())
    second = (moved[0][1] - moved[1][1]) / (2 * h)
    np.testing.assert_allclose(second, acceleration, atol=1e-6 * np.abs(acceleration).max())


def test_joint_angles_count_whole_turns(tmp_path: Path) -> None:
    """Ten increments of one radian about the joint make ten radians."""
    body = {"mass": 1.0, "inertia": [0.1, 0.1, 0.1], "points": {"a": [0.0, 0.0, 0.0]}}
    scene = scenes.l_scene(tmp_path, links=[{"name": "l", "rigid": body}], points=[])
    system = ConstrainedFfr(Ffr(scenes.mechanism(scene)))
    q, _ = system.initial_state()
    axis = system.mechanism.joints[0].screw
    for _ in range(10):
        q = system.compose(q, axis)
    assert q.angles[0] == pytest.approx(10.0, abs=1e-12)
    assert np.abs(system.constraint(0.0, q)).max() <= 1e-14


def test_redundant_constraints_are_named(tmp_path: Path) -> None:
    """An open chain has none; a condition that follows from earlier ones is the one that is named."""
    system = _system(tmp_path, "revolute", "tangent")
    q, _ = system.configuration(TIME, *_random(system))
    assert system.redundant(TIME, q) == ()
    assert system.constraint_names[0] == "joint 'j1', translation along x"
    assert system.constraint_names[-1] == "joint 'j3', rotation about y"
    assert len(system.constraint_names) == system.constraints == 15
    b = system.constraint_matrix(TIME, q)
    more = np.vstack([b, b[2] - 3 * b[7] + 2 * b[11], np.random.default_rng(0).uniform(-1, 1, system.size)])
    assert redundant_rows(more) == [15]


def _generalized_alpha(system: ConstrainedFfr, end: float, steps: int) -> tuple[Configuration, Array, float]:
    """Lie-group generalized-α without projection (M. Arnold & O. Brüls 2007), ρ = 0.8: q, v and the largest |Φ|."""
    h, rho = end / steps, 0.8
    alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    gamma = 0.5 + alpha_f - alpha_m
    beta = 0.25 * (gamma + 0.5) ** 2
    share = (1 - alpha_f) / (1 - alpha_m)
    to_v, to_a = gamma / (h * beta), 1 / (h * h * beta * share)
    q, v = system.initial_state()
    b, mass = system.constraint_matrix(0.0, q), system.mass_matrix(0.0, q)
    n, m = system.size, system.constraints
    right = np.concatenate([system.residual(0.0, q, v, np.zeros(n)), system.constraint_bias(0.0, q, v)])
    acc = la.solve(np.block([[mass, b.T], [b, np.zeros((m, m))]]), -right)[:n]
    alg, multipliers, open_by = acc, np.zeros(m), 0.0
    for k in range(1, steps + 1):
        t, new, known = k * h, acc.copy(), (alpha_f * acc - alpha_m * alg) / (1 - alpha_m)
        for _ in range(12):
            now = known + share * new
            increment = h * v + h * h * ((0.5 - beta) * alg + beta * now)
            q1, v1 = system.compose(q, increment), v + h * ((1 - gamma) * alg + gamma * now)
            b = system.constraint_matrix(t, q1)
            force = system.residual(t, q1, v1, new) + b.T @ multipliers
            gap = system.constraint(t, q1)
            stiffness, damping = system.stiffness_and_damping(t, q1, v1, new, multipliers)
            body = (to_a * system.mass_matrix(t, q1) + to_v * damping + stiffness) / to_a
            matrix = np.block([[body, b.T], [b @ system.tangent(increment), np.zeros((m, m))]])
            move = la.solve(matrix, -np.concatenate([force, gap * to_a]))
            new = new + move[:n]
            multipliers = multipliers + move[n:]
            if np.abs(move[:n] / to_a).max() < 1e-12:
                break
        else:
            raise AssertionError(f"no convergence at t = {t}")
        q, v, alg, acc = q1, v1, now, new
        open_by = max(open_by, float(np.abs(gap).max()))
    return q, v, open_by


@pytest.mark.parametrize("kind", ["mixed", "prescribed"])
def test_index_3_integration_converges_to_the_independent_coordinates(tmp_path: Path, kind: str) -> None:
    """Three flexible links over 0.02 s: joints stay closed to rounding, the end closes in with the square of the step.

    Against the explicit reference integrator in independent coordinates.
    """
    data = scenes.read_toml(scenes.three_links(tmp_path, kind))
    for link in data["links"]:
        link["elastic_modes"] = 1
    data["simulation"] = {"duration": 0.02, "integrator": "dop853", "rtol": 1e-9, "formulation": "ffr"}
    path = scenes.write_toml(tmp_path / "short.toml", data)
    expected = erls.simulate(path).position("end", 0.02)
    system = ConstrainedFfr(Ffr(scenes.mechanism(path)))
    model, node = system.mechanism.links[2].model, system.mechanism.points[0].node
    errors = []
    for steps in (60, 120):
        q, v, open_by = _generalized_alpha(system, 0.02, steps)
        assert open_by <= 1e-12
        state = system.state(0.02, q, v)
        local = model.nodes[node] + model.translation_shapes[node] @ state.modal[2]
        end = state.poses[2][:3, :3] @ local + state.poses[2][:3, 3]
        errors.append(float(np.linalg.norm(end - expected)))
    assert errors[0] <= 1e-6
    assert errors[0] / errors[1] >= 3.5

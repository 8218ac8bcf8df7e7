"""FFR with joints as constraints: group, constraints and their derivatives, against the independent coordinates."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
import scipy.linalg as la

import erls
from erls.equations.consistency import redundant_constraints, refuse_redundant
from erls.equations.ffr.body_frame import BODY_FRAMES
from erls.equations.ffr.constrained import Configuration, ConstrainedFfr
from erls.equations.ffr.formulation import Ffr
from erls.equations.system import metre_scales
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.maths.so3 import Array

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
        found = system.stored(TIME, q, v, a)[2][-system.links :][reduced.free_joints]
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


def test_tangent_of_increments(tmp_path: Path) -> None:
    """Twists of q ∘ exp(increment) per variation of the increment, by differences of the frames."""
    system = _system(tmp_path, "mixed", "tangent")
    q, _ = system.configuration(TIME, *_random(system))
    increment, change, h = _velocity(system, 8), _velocity(system, 9), 1e-6
    one, at, two = (system.compose(q, increment + s * h * change) for s in (1, 0, -1))
    expected = system.tangent(increment) @ change
    for k, move in enumerate(system.twists):
        turning = at.poses[k, :3, :3].T @ (one.poses - two.poses)[k, :3] / (2 * h)
        found = np.array([*turning[:, 3], turning[2, 1], turning[0, 2], turning[1, 0]])
        np.testing.assert_allclose(found, expected[move], atol=1e-8)
    np.testing.assert_array_equal(expected[system.elastic], change[system.elastic])


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
    np.testing.assert_allclose(again.angles, q.angles, atol=1e-14)  # found anew from the frames
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


def test_constraints_of_an_open_chain_are_independent_and_named(tmp_path: Path) -> None:
    """Joint and direction; full rank; one that follows from others is found."""
    system = _system(tmp_path, "revolute", "tangent")
    q, _ = system.configuration(TIME, *_random(system))
    refuse_redundant(system, TIME, q)
    assert system.constraint_names[0] == "joint 'j1', translation along x"
    assert system.constraint_names[-1] == "joint 'j3', rotation about y"
    assert len(system.constraint_names) == system.constraints == 15
    b = system.constraint_matrix(TIME, q)
    more = np.vstack([b, b[2] - 3 * b[7] + 2 * b[11], _velocity(system, 0)])
    assert redundant_constraints(more, 1 / metre_scales(system)) == [15]


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
    expected = erls.simulate(path, verdict=False).position("end", 0.02)
    system = ConstrainedFfr(Ffr(scenes.mechanism(path)))
    model, node = system.mechanism.links[2].model, system.mechanism.points[0].node
    errors = []
    for step in (4e-4, 2e-4):
        solution = lie_generalized_alpha(system, (0.0, 0.02), *system.initial_state(), ConstrainedOptions(step=step))
        assert solution.failure is None
        for t, y, v in zip(solution.t, solution.y, solution.v, strict=True):
            assert np.abs(system.constraint(t, system.from_stored(y, v)[0])).max() <= 1e-12
        state = system.state(0.02, *system.from_stored(solution.y[-1], solution.v[-1]))
        local = model.nodes[node] + model.translation_shapes[node] @ state.modal[2]
        end = state.poses[2][:3, :3] @ local + state.poses[2][:3, 3]
        errors.append(float(np.linalg.norm(end - expected)))
    assert errors[0] <= 1e-6
    assert errors[0] / errors[1] >= 3.0


def test_scenes_run_in_absolute_coordinates(tmp_path: Path) -> None:
    """The same motion as in independent coordinates: both methods are of order 2 with nearly the same error."""
    scenes.l_link(tmp_path, reduction={"elastic_modes": 3})
    path = scenes.l_scene(tmp_path, simulation={"duration": 0.1})
    found = {}
    for step in (1e-3, 5e-4):
        for coordinates in ("independent", "absolute"):
            changes = ["simulation.formulation=ffr", f"simulation.coordinates={coordinates}", f"simulation.step={step}"]
            run = erls.simulate(erls.load_scene(path, changes), verdict=False)
            found[coordinates, step] = run.position("tip", 0.1)
            assert run.solution.work.steps == round(0.1 / step)
    apart = [np.linalg.norm(found["absolute", h] - found["independent", h]) for h in (1e-3, 5e-4)]
    assert max(apart) < 1e-7  # of 46 mm travelled; 8e-9 and 3e-9 seen
    assert run.reaction("shoulder", 0.1)[0].shape == (3,)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["simulation.coordinates=absolute"], "formulation"),
        (["simulation.coordinates=absolute", "simulation.formulation=ffr", "simulation.integrator=bdf"], "integrator"),
        (["simulation.coordinates=polar"], "polar"),
    ],
)
def test_faulty_coordinates(tmp_path: Path, changes: list[str], words: str) -> None:
    scenes.l_link(tmp_path)
    with pytest.raises(erls.errors.SceneError, match=words):
        erls.load_scene(scenes.l_scene(tmp_path), changes)

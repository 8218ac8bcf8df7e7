"""Nodal systems: every derivative against differences, joints against the motions they allow, both groups alike."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la
from nodal_tables import KINDS

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.joints import GROUND, Joint
from erls.equations.nodal.nodes import Nodes
from erls.equations.nodal.rigid_body import RigidBodies, RigidBody
from erls.equations.nodal.scatter import DENSE_UP_TO
from erls.errors import Cause, SceneError, SimulationError
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.maths import motion_maps as motions
from erls.maths.groups import R3_SO3, SE3, Group
from erls.maths.so3 import Array
from erls.mechanism.joint_types import HOLDING_TYPES, SINGLE_TYPES

GROUPS = {"SE(3)": SE3, "R³×SO(3)": R3_SO3}
G = np.array([0.3, -0.2, -9.81])
PITCH = 0.3
# twists of the outer frame, in its axes at D = 1, that each joint allows
ALLOWED = {
    "fixed": np.zeros((0, 6)),
    "revolute": np.eye(6)[[5]],
    "prismatic": np.eye(6)[[2]],
    "screw": PITCH * np.eye(6)[[2]] + np.eye(6)[[5]],
    "cylindrical": np.eye(6)[[2, 5]],
    "universal": np.eye(6)[[3, 4]],
    "spherical": np.eye(6)[3:],
}


def _inertia(rng: np.random.Generator) -> Array:
    a = rng.standard_normal((3, 3))
    turn = la.qr(a)[0]
    return turn @ np.diag([0.2, 0.3, 0.4]) @ turn.T


def _random(kind: str, group: Group, seed: int, motion: bool = False) -> NodalSystem:
    """Two bodies off their nodes, joined to each other and to the ground at random frames, not closed."""
    rng = np.random.default_rng(seed)
    poses, frames = motions.exp(rng.standard_normal((2, 6))), motions.exp(rng.standard_normal((4, 6)))
    bodies = [RigidBody(k, 2.0 + k, _inertia(rng), rng.standard_normal(3)) for k in (0, 1)]

    def swing(t: float) -> tuple[float, float, float]:
        return float(np.sin(t)), float(np.cos(t)), -float(np.sin(t))

    drive = swing if motion else None
    joints = [
        Joint("root", kind, GROUND, 0, frames[0], frames[1], drive, pitch=0.3),
        Joint("elbow", kind, 1, 0, frames[2], frames[3], drive, pitch=-0.7),
    ]
    return NodalSystem(poses, [RigidBodies(bodies, G)], joints, group)


@pytest.mark.parametrize("group", GROUPS)
@pytest.mark.parametrize("kind", [*HOLDING_TYPES, *(f"driven {kind}" for kind in SINGLE_TYPES)])
def test_derivatives_against_differences(kind: str, group: str) -> None:
    """B, Φ̈ − B a, Φ_t, stiffness and damping, far from closed joints: central differences with step 1e-5, 1e-7."""
    system = _random(kind.removeprefix("driven "), GROUPS[group], 4, motion=kind.startswith("driven "))
    rng = np.random.default_rng(5)
    v, a = rng.standard_normal((2, system.size))
    multipliers, t, q, e = rng.standard_normal(system.constraints), 0.7, system.start, 1e-5

    def total(t: float, q: Nodes, v: Array) -> Array:
        return system.residual(t, q, v, a) + system.constraint_matrix(t, q).T @ multipliers

    stiffness, damping = system.stiffness_and_damping(t, q, v, a, multipliers)
    for k in range(system.size):
        d = np.eye(system.size)[k] * e
        ahead, back = system.compose(q, d), system.compose(q, -d)
        slope = (system.constraint(t, ahead) - system.constraint(t, back)) / (2 * e)
        np.testing.assert_allclose(system.constraint_matrix(t, q)[:, k], slope, atol=1e-8)
        np.testing.assert_allclose(stiffness[:, k], (total(t, ahead, v) - total(t, back, v)) / (2 * e), atol=1e-7)
        np.testing.assert_allclose(damping[:, k], (total(t, q, v + d) - total(t, q, v - d)) / (2 * e), atol=1e-7)
    rate = (system.constraint(t + e, q) - system.constraint(t - e, q)) / (2 * e)
    np.testing.assert_allclose(system.constraint_rate(t, q), rate, atol=1e-8)

    def speed(s: float) -> Array:
        moved = system.compose(q, s * v + s * s / 2 * a)  # v + s a to first order: [v, v] = 0
        return system.constraint_matrix(t + s, moved) @ (v + s * a) + system.constraint_rate(t + s, moved)

    bias = (speed(e) - speed(-e)) / (2 * e) - system.constraint_matrix(t, q) @ a
    np.testing.assert_allclose(system.constraint_bias(t, q, v), bias, atol=1e-7)


@pytest.mark.parametrize("group", GROUPS)
def test_stored_derivatives_and_energy(group: str) -> None:
    """Rates of what is stored are derivatives; power of residual forces is the rate of energy."""
    system = _random("fixed", GROUPS[group], 8)
    rng = np.random.default_rng(9)
    v, a = rng.standard_normal((2, system.size))
    q, e = system.start, 1e-5

    def at(s: float) -> tuple[Nodes, Array]:
        return system.compose(q, s * v + s * s / 2 * a), v + s * a

    knots = [system.stored(0.0, *at(s), a) for s in (-e, 0.0, e)]
    np.testing.assert_allclose(knots[1][1], (knots[2][0] - knots[0][0]) / (2 * e), atol=1e-8)
    np.testing.assert_allclose(knots[1][2], (knots[2][1] - knots[0][1]) / (2 * e), atol=1e-8)
    before, after = (sum(system.energy(0.0, *at(s))) for s in (-e, e))
    assert v @ system.residual(0.0, q, v, a) == pytest.approx((after - before) / (2 * e), abs=1e-7)


def test_both_groups_describe_one_system() -> None:
    """Residual, masses, multipliers and motion of SE(3) and R³×SO(3) agree through u = R U."""
    local, world = (_random("revolute", g, 12) for g in (SE3, R3_SO3))
    rng = np.random.default_rng(13)
    v, a = rng.standard_normal((2, 12))
    q = local.start
    to_world = la.block_diag(*(b for h in q.poses for b in (h[:3, :3], np.eye(3))))
    swing = np.concatenate(
        [
            np.concatenate([h[:3, :3] @ np.cross(w[3:], w[:3]), np.zeros(3)])
            for h, w in zip(q.poses, v.reshape(2, 6), strict=True)
        ]
    )
    found = world.residual(0.0, q, to_world @ v, to_world @ a + swing)
    np.testing.assert_allclose(found, to_world @ local.residual(0.0, q, v, a), atol=1e-12)
    np.testing.assert_allclose(world.mass_matrix(0, q), to_world @ local.mass_matrix(0, q) @ to_world.T, atol=1e-13)
    np.testing.assert_allclose(world.constraint_matrix(0, q) @ to_world, local.constraint_matrix(0, q), atol=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_joints_allow_their_motions_only(kind: str) -> None:
    """The null space of B at a closed joint is spanned by the free twists; a long way along one keeps Φ = 0."""
    joint = Joint("j", kind, GROUND, 0, pitch=PITCH)
    system = NodalSystem(np.eye(4)[None], [RigidBodies([RigidBody(0, 1.0, np.eye(3))], G)], [joint])
    q = system.start
    free = la.null_space(system.constraint_matrix(0.0, q))
    assert free.shape[1] == len(ALLOWED[kind])
    outside = la.null_space(ALLOWED[kind]) if len(ALLOWED[kind]) else np.eye(6)
    np.testing.assert_allclose(outside.T @ free, 0, atol=1e-14)
    for way in ALLOWED[kind] if kind != "spherical" else []:
        turned = system.compose(q, 2.5 * way)
        np.testing.assert_allclose(system.constraint(0.0, turned), 0, atol=1e-15)
    assert len(system.constraint_names) == 6 - len(ALLOWED[kind])


def test_rigid_motions_leave_constraints_and_forces_alone() -> None:
    """Without gravity, a turned and shifted world (the ground's joint left out) gives the same local equations."""
    rng = np.random.default_rng(21)
    poses = motions.exp(rng.standard_normal((2, 6)))
    bodies = [RigidBody(k, 1.0, _inertia(rng)) for k in (0, 1)]
    joint = Joint("j", "universal", 0, 1, *motions.exp(rng.standard_normal((2, 6))))
    system = NodalSystem(poses, [RigidBodies(bodies, np.zeros(3))], [joint])
    moved = system.at(motions.exp(rng.standard_normal(6)) @ poses)
    v, a = rng.standard_normal((2, 12))
    np.testing.assert_allclose(system.residual(0, moved, v, a), system.residual(0, system.start, v, a), atol=1e-14)
    np.testing.assert_allclose(system.constraint(0, moved), system.constraint(0, system.start), atol=1e-14)
    np.testing.assert_allclose(
        system.constraint_matrix(0, moved), system.constraint_matrix(0, system.start), atol=1e-14
    )


def _chain(count: int) -> tuple[NodalSystem, Nodes, Array]:
    """Rods of 0.1 m and 0.1 kg in a row along x, revolute about y, the first to the ground, at rest."""
    poses = np.array([motions.poses(np.eye(3), np.array([0.05 + 0.1 * k, 0, 0])) for k in range(count)])
    about_y = motions.exp(np.array([0, 0, 0, -np.pi / 2, 0, 0]))
    ends = [motions.poses(np.eye(3), np.array([x, 0, 0])) @ about_y for x in (-0.05, 0.05)]
    joints = [Joint("j0", "revolute", GROUND, 0, about_y, ends[0])]
    joints += [Joint(f"j{k}", "revolute", k - 1, k, ends[1], ends[0]) for k in range(1, count)]
    bodies = [RigidBody(k, 0.1, np.diag([1e-5, 8.3e-5, 8.3e-5])) for k in range(count)]
    system = NodalSystem(poses, [RigidBodies(bodies, np.array([0, 0, -9.81]))], joints)
    return system, system.start, np.zeros(system.size)


def test_sparse_and_dense_assembly_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chain of twenty rods, large enough for sparse matrices, and the same one dense."""
    count = 20
    assert 6 * count > DENSE_UP_TO
    runs = []
    for limit in (DENSE_UP_TO, 10**6):
        monkeypatch.setattr("erls.equations.nodal.scatter.DENSE_UP_TO", limit)
        system, q, v = _chain(count)
        assert hasattr(system.mass_matrix(0.0, q), "tocsc") == (limit == DENSE_UP_TO)
        runs.append(lie_generalized_alpha(system, (0, 0.05), q, v, ConstrainedOptions(step=2e-3)))
        assert runs[-1].failure is None
    np.testing.assert_allclose(runs[0].y, runs[1].y, atol=1e-9)
    assert np.abs(runs[0].y[-1] - runs[0].y[0]).max() > 0.01


FAULTS = [
    (lambda: Joint("j", "hinge", 0, 1), "type"),
    (lambda: Joint("j", "spherical", 0, 1, motion=lambda t: (0.0, 0.0, 0.0)), "motion"),
    (lambda: Joint("j", "revolute", 1, 1), "outer"),
    (lambda: RigidBody(0, -1.0), "mass"),
    (lambda: RigidBody(0, float("nan")), "mass"),
    (lambda: RigidBody(0, 1.0, np.diag([1.0, 1.0, 3.0])), "inertia"),
    (lambda: RigidBody(0, 1.0, np.array([[1.0, 0.5, 0], [0, 1, 0], [0, 0, 1]])), "inertia"),
    (lambda: RigidBody(0, 1.0, np.eye(3), np.array([0, np.inf, 0])), "centre"),
    (lambda: ConstrainedOptions(iteration_matrix="sometimes"), "iteration_matrix"),
    (lambda: ConstrainedOptions(residual_tolerance=-1.0), "residual_tolerance"),
]


@pytest.mark.parametrize("case", range(len(FAULTS)))
def test_faulty_input(case: int) -> None:
    make, field = FAULTS[case]
    with pytest.raises(SceneError) as caught:
        make()
    assert caught.value.cause is Cause.BAD_FIELD
    assert caught.value.where.endswith(field)


def test_redundant_constraints_are_named() -> None:
    """Two parallel hinges on one door: five conditions of the second repeat the first."""
    apart = motions.poses(np.eye(3), np.array([0, 0, 1.0]))
    joints = [Joint("low", "revolute", GROUND, 0), Joint("high", "revolute", GROUND, 0, apart, apart)]
    system = NodalSystem(np.eye(4)[None], [RigidBodies([RigidBody(0, 1.0, np.eye(3))], G)], joints)
    found = lie_generalized_alpha(system, (0, 1), system.start, np.zeros(6), ConstrainedOptions())
    assert isinstance(found.failure, SimulationError)
    assert found.failure.cause is Cause.REDUNDANT_CONSTRAINTS
    assert found.failure.message.count("'high'") == 5
    assert "'low'" not in found.failure.message
    assert len(found.t) == 1

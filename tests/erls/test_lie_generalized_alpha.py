"""The constrained integrator against independent coordinates: orders, breakpoints, starts, conditioning, failures."""

from __future__ import annotations

from collections.abc import Callable

import heavy_top
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from small_systems import DoublePendulum

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.joints import GROUND, Joint, Motion
from erls.equations.nodal.nodes import Nodes
from erls.equations.nodal.rigid_body import RigidBodies, RigidBody
from erls.errors import Cause
from erls.integrate.base import Solution
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.maths import motion_maps as motions
from erls.maths.groups import R3_SO3, SE3, Group
from erls.maths.saddle import Scales, scaled_matrix
from erls.maths.se3 import pose
from erls.maths.so3 import Array, rotation_x, rotation_y

GROUPS = {"SE(3)": SE3, "R³×SO(3)": R3_SO3}
ABOUT_Y = pose(rotation_x(-np.pi / 2))  # its z axis is y
WEIGHT = np.array([0.0, 0.0, -9.81])


def _double_pendulum(group: Group, angles: Array) -> tuple[NodalSystem, Nodes]:
    """`DoublePendulum` with nodes at the pivots: point masses, whose own inertia at the node is singular."""
    first = pose(rotation_y(angles[0]))
    second = pose(rotation_y(angles[1]), first[:3, :3] @ [0, 0, -1.0])
    poses = np.array([first, second])
    bodies = [RigidBody(k, 1.0, centre=np.array([0, 0, -1.0])) for k in (0, 1)]
    low = pose(position=np.array([0, 0, -1.0]))
    joints = [
        Joint("upper", "revolute", GROUND, 0, ABOUT_Y, ABOUT_Y),
        Joint("lower", "revolute", 0, 1, low @ ABOUT_Y, ABOUT_Y),
    ]
    system = NodalSystem(poses, [RigidBodies(bodies, WEIGHT)], joints, group)
    return system, system.start


@pytest.mark.parametrize("radius", [0.0, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("group", GROUPS)
def test_order_two_against_independent_coordinates(group: str, radius: float) -> None:
    """Double pendulum of point masses, pivot positions over 0.5 s, against DOP853 with rtol 1e-13."""
    angles = np.array([1.0, 0.5])
    exact = solve_ivp(
        lambda t, x: np.concatenate([x[2:], DoublePendulum().acceleration(t, x[:2], x[2:])]),
        (0, 0.5), [*angles, 0, 0], method="DOP853", rtol=1e-13, atol=1e-13, dense_output=True,
    ).sol  # fmt: skip
    errors = []
    for step in (4e-3, 2e-3):
        system, q = _double_pendulum(GROUPS[group], angles)
        found = lie_generalized_alpha(
            system, (0, 0.5), q, np.zeros(12), ConstrainedOptions(step=step, spectral_radius=radius)
        )
        assert found.failure is None
        assert found.warnings == ()
        theta, rate = exact(found.t)[:2].T, exact(found.t)[2:].T
        x = -np.sin(theta[:, 0]), -np.cos(theta[:, 0])
        u = -np.cos(theta[:, 0]) * rate[:, 0], np.sin(theta[:, 0]) * rate[:, 0]
        lower = found.y[:, 15:24].reshape(-1, 3, 3)
        angle = np.unwrap(np.arctan2(lower[:, 0, 2], lower[:, 0, 0]))
        errors.append(
            [
                np.hypot(found.y[:, 12] - x[0], found.y[:, 14] - x[1]).max(),
                np.hypot(found.v[:, 12] - u[0], found.v[:, 14] - u[1]).max(),
                np.abs(angle - theta[:, 1]).max(),
            ]
        )
    np.testing.assert_allclose(np.log2(np.divide(*errors)), 2.0, atol=0.1)


def _driven(motion: Motion, breakpoints: tuple[float, ...] = (), kind: str = "revolute") -> tuple[NodalSystem, Nodes]:
    """A bar of 2 kg, its centre 0.5 m from an axis along y, moved as told."""
    body = RigidBody(0, 2.0, np.diag([0.01, 0.1, 0.1]))
    frame = pose(position=np.array([-0.5, 0, 0])) @ ABOUT_Y
    joint = Joint("drive", kind, GROUND, 0, ABOUT_Y, frame, motion, breakpoints)
    q = pose(position=np.array([0.5, 0, 0]))[None]
    system = NodalSystem(q, [RigidBodies([body], WEIGHT)], [joint])
    return system, system.start


def _ramp(t: float) -> tuple[float, float, float]:
    """At rest up to 0.1 s, then at 3 rad/s²."""
    s = max(t - 0.1, 0.0)
    return 1.5 * s * s, 3 * s, 3.0 * (t > 0.1)


@pytest.mark.parametrize("group", GROUPS)
def test_prescribed_motion_and_its_torque(group: str) -> None:
    """Position to rounding; the multiplier is the drive's torque: I s̈ − m g r cos s, on both sides of the jump."""
    system, q = _driven(_ramp, (0.1,))
    system = NodalSystem(q.poses, system.elements, system.rows.joints, GROUPS[group])
    found = lie_generalized_alpha(system, (0, 0.5), q, np.zeros(6), ConstrainedOptions(step=1e-2))
    assert found.failure is None
    assert found.work.steps == 50
    jump = np.flatnonzero(np.diff(found.t) == 0)
    np.testing.assert_allclose(found.t[jump], 0.1, rtol=1e-14)
    s = np.array([_ramp(t)[0] for t in found.t])
    np.testing.assert_allclose(found.y[:, :3], 0.5 * np.stack([np.cos(s), 0 * s, -np.sin(s)], axis=1), atol=1e-12)
    torque = found.multipliers[:, system.constraint_names.index("joint 'drive': rotation about z")]
    inertia = 0.1 + 2 * 0.25
    push = np.where(np.arange(len(s)) > jump[0], 3.0, 0.0)
    right = inertia * push - 2 * 9.81 * 0.5 * np.cos(s)
    at_rest = found.t < 0.1 + 1e-9
    np.testing.assert_allclose(torque[at_rest], right[at_rest], rtol=1e-11)
    # the transient after the jump decays, truncation error h²/12 of fourth derivatives stays
    np.testing.assert_allclose(torque[found.t > 0.3], right[found.t > 0.3], atol=5e-3)
    np.testing.assert_allclose(torque[jump[0] + 1], right[jump[0] + 1], rtol=1e-11)


def test_prescribed_slide() -> None:
    """A prismatic drive along y lifts nothing and pushes with m s̈."""
    system, q = _driven(lambda t: (0.1 * t * t, 0.2 * t, 0.2), kind="prismatic")
    found = lie_generalized_alpha(system, (0, 0.2), q, np.zeros(6), ConstrainedOptions(step=1e-2))
    np.testing.assert_allclose(found.y[:, 1], 0.1 * found.t**2, atol=1e-13)
    force = found.multipliers[:, system.constraint_names.index("joint 'drive': translation along z")]
    np.testing.assert_allclose(force, 2 * 0.2, atol=1e-7)  # rounding of positions over β h²


def test_inconsistent_starts_are_corrected_with_a_warning() -> None:
    """The nearest position, and the velocity after an impulse of the constraints; a consistent start is left alone."""
    system = heavy_top.heavy_top("SE(3)")
    q = system.at(pose(rotation_x(0.2), [0.01, 1.0, 0.02])[None])
    found = lie_generalized_alpha(system, (0, 0.01), q, np.array([0.5, 0, 0, 0, 2.0, 0]), ConstrainedOptions())
    assert found.failure is None
    assert len(found.warnings) == 2
    assert "was moved by" in found.warnings[0]
    assert "velocities" in found.warnings[1]
    turn, x = found.y[0, 3:12].reshape(3, 3), found.y[0, :3]
    np.testing.assert_allclose(turn.T @ x, heavy_top.ARM, atol=1e-12)
    rate = found.v[0, 3:12].reshape(3, 3)
    np.testing.assert_allclose(rate.T @ x + turn.T @ found.v[0, :3], 0, atol=1e-12)
    # a central impulse at the pivot leaves the angular momentum about it: I ω_z = −m r u at x = 0.5 m/s
    omega = turn.T @ rate
    assert omega[1, 0] == pytest.approx(-15 * 0.5 / (15 + 0.234375), rel=1e-9)
    assert omega[0, 2] == pytest.approx(2.0)  # ω_y keeps its value


def _fourbar(coupler: float) -> tuple[NodalSystem, Nodes]:
    """Two cranks of 0.1 m on pivots 1 m apart, and a coupler, whose far pin is spherical so that no row repeats."""
    centres = np.array([[0, 0, 0.05], [coupler / 2, 0, 0.1], [1.0, 0, 0.05]])
    q = np.array([pose(position=c) for c in centres])
    end = [pose(position=np.array([0, 0, z])) @ ABOUT_Y for z in (-0.05, 0.05)]
    side = [pose(position=np.array([x, 0, 0])) @ ABOUT_Y for x in (-coupler / 2, coupler / 2)]
    joints = [
        Joint("a", "revolute", GROUND, 0, ABOUT_Y, end[0]),
        Joint("b", "revolute", 0, 1, end[1], side[0]),
        Joint("c", "spherical", 1, 2, side[1], end[1]),
        Joint("d", "universal", GROUND, 2, pose(position=np.array([1.0, 0, 0])), end[0]),
    ]
    bodies = [RigidBody(k, 1.0, 0.01 * np.eye(3)) for k in range(3)]
    system = NodalSystem(q, [RigidBodies(bodies, WEIGHT)], joints)
    return system, system.start


def test_a_loop_is_closed_or_refused() -> None:
    """A coupler of 1.05 m leans the cranks; one of 1.3 m can never reach."""
    system, q = _fourbar(1.05)
    found = lie_generalized_alpha(system, (0, 0.02), q, np.zeros(18), ConstrainedOptions())
    assert found.failure is None
    assert len(found.warnings) == 1
    system, q = _fourbar(1.3)
    failed = lie_generalized_alpha(system, (0, 0.02), q, np.zeros(18), ConstrainedOptions())
    assert failed.failure is not None
    assert failed.failure.cause is Cause.INCONSISTENT_START
    assert len(failed.t) == 1


def test_scaled_condition_stays_bounded() -> None:
    """From h = 1 ms to 1 µs: some hundreds, where the unscaled matrix reaches 1e20 and more."""
    system = heavy_top.heavy_top("SE(3)")
    q = system.start
    mass, rows = system.mass_matrix(0, q), system.constraint_matrix(0, q)
    stiffness, damping = system.stiffness_and_damping(
        0, q, np.array([4.6, 0, 0, 0, 150.0, -4.6]), np.zeros(6), np.ones(3)
    )
    for h in (1e-3, 1e-6):
        to_a, to_v = 2 / h**2, 1.5 / h
        block = to_a * mass + to_v * damping + stiffness
        scaled = scaled_matrix(block, rows, Scales(system.length_scales, mass, rows), h / np.sqrt(2))
        assert np.linalg.cond(np.asarray(scaled)) < 1e3
        raw = np.block([[block, rows.T], [rows, np.zeros((3, 3))]])
    assert np.linalg.cond(raw) > 1e20


def test_a_body_without_inertia_is_reported() -> None:
    """A point mass free to turn about a ball joint at itself."""
    bodies = RigidBodies([RigidBody(0, 1.0)], WEIGHT)
    system = NodalSystem(np.eye(4)[None], [bodies], [Joint("ball", "spherical", GROUND, 0)])
    found = lie_generalized_alpha(system, (0, 1), system.start, np.zeros(6), ConstrainedOptions())
    assert found.failure is not None
    assert found.failure.cause is Cause.SINGULAR_MASS
    assert found.failure.where == "t = 0 s"


class _Faulty(NodalSystem):
    """The heavy top with forces that go wrong after 10 ms."""

    def __init__(self, fault: Callable[[Array], Array]) -> None:
        good = heavy_top.heavy_top("SE(3)")
        super().__init__(good.start.poses, good.elements, good.rows.joints)
        self.fault = fault

    def residual(self, t: float, q: Nodes, v: Array, a: Array) -> Array:
        found = super().residual(t, q, v, a)
        return found if t < 0.0105 else self.fault(found)


def _interrupt(found: Array) -> Array:
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        (lambda r: r * np.nan, Cause.NOT_FINITE),
        (lambda r: r + 1e12 * np.sign(r + 1e3), Cause.NEWTON_FAILED),
        (_interrupt, Cause.INTERRUPTED),
    ],
)
def test_failures_keep_what_was_computed(fault: Callable[[Array], Array], cause: Cause) -> None:
    system = _Faulty(fault)
    start = np.cross(heavy_top.SPINS["slow"], heavy_top.ARM), heavy_top.SPINS["slow"]
    seen: list[tuple[float, int]] = []

    def observe(t: float, knots: Callable[[], Solution]) -> None:
        seen.append((t, len(knots().t)))

    found = lie_generalized_alpha(
        system, (0, 0.1), system.start, np.concatenate(start), ConstrainedOptions(step=1e-3), observe
    )
    assert found.failure is not None
    assert found.failure.cause is cause
    assert found.t[-1] == pytest.approx(0.010, abs=6e-4)
    assert found.multipliers.shape == (len(found.t), 3)
    assert seen[:3] == [(pytest.approx(1e-3 * k), k + 1) for k in (1, 2, 3)]
    if cause is not Cause.INTERRUPTED:
        assert found.work.rejected_steps == 13


def test_nothing_moves_without_time() -> None:
    system = heavy_top.heavy_top("SE(3)")
    found = lie_generalized_alpha(system, (1.0, 1.0), system.start, np.zeros(6), ConstrainedOptions())
    assert found.failure is None
    assert found.t.tolist() == [1.0]
    np.testing.assert_allclose(found.multipliers, [[0, 0, 15 * 9.81 * 0.234375 / 15.234375]], atol=1e-9)


def test_free_body_needs_no_joint() -> None:
    """Two bodies without constraints: a symmetric spinner turns for ever, a thrown point falls on its parabola."""
    bodies = [RigidBody(0, 1.0, np.diag([0.2, 0.2, 0.3])), RigidBody(1, 2.0, 0.1 * np.eye(3))]
    system = NodalSystem(np.array([np.eye(4)] * 2), [RigidBodies(bodies, WEIGHT)])
    v = np.array([0, 0, 0, 0, 0, 2.0, 1.0, 0, 3.0, 0, 0, 0])
    found = lie_generalized_alpha(system, (0, 0.5), system.start, v, ConstrainedOptions(step=1e-2))
    assert found.failure is None
    np.testing.assert_allclose(found.y[-1, :3], [0, 0, -9.81 / 8], atol=1e-9)
    np.testing.assert_allclose(found.y[-1, 12:15], [0.5, 0, 1.5 - 9.81 / 8], atol=1e-9)
    np.testing.assert_allclose(
        found.y[-1, 3:12].reshape(3, 3), motions.exp(np.array([0, 0, 0, 0, 0, 1.0]))[:3, :3], atol=1e-9
    )

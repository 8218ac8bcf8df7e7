"""Inverse dynamics: published and independent figures, and internal motions of every nature."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scenes
from inverse_models import LinearArm, LinearField, PassiveArm, nine
from scipy.integrate import solve_bvp, solve_ivp

import erls
from erls.errors import Cause, SceneError, SimulationError
from erls.inverse.inversion import Inversion
from erls.inverse.invert import invert, rigid_motion
from erls.inverse.marching import march
from erls.inverse.problem import problem_of
from erls.inverse.two_point import Sweep, collocate, ends_of
from erls.inverse.work import Work
from erls.tracking.confirm import confirmed
from erls.tracking.correct import corrected

INVERSE = scenes.ROOT / "data" / "inverse"
PASSIVE, ARM, PLANAR = (INVERSE / f"{name}.toml" for name in ("passive_arm", "arm", "two_link_planar"))
ROBOT = scenes.ROOT / "data" / "robot" / "two_link.toml"
TIP = "[1.0, 0.0, 0.0]"


def scene(path: Any, *changes: str) -> Any:
    """With changes."""
    return erls.load_scene(path, changes)


def linear_torque(arm: LinearArm, h: float) -> tuple[Any, Any]:
    """Knots, and the torque by collocation."""
    a, b, c = arm.internal()
    m = len(a)
    matrix = np.block([[np.zeros((m, m)), np.eye(m)], [a, np.zeros((m, m))]])
    t = np.linspace(0.0, 2.2, round(2.2 / h) + 1)
    y, _, faster = nine(t, np.pi / 3, 0.8, 0.6)
    force = np.zeros((len(t), 2 * m))
    force[:, m:] = np.outer(y, b) + np.outer(faster, c)
    field, scales = LinearField(matrix, force), np.repeat([1.0, 1 / h], m)
    found, _ = collocate(field, t, 0 * force, lambda *ends: ends_of(*ends, scales), scales, 1e-10)
    return t, arm.torque(y, found.x[:, :m], faster, field.slopes(found.x)[:, m:])


def test_figures_of_the_linear_arm() -> None:
    """Slowest real zeros ±65.7 1/s; tip error 0.0720, 0.0180, 0.0045 mm at 4, 2, 1 ms from a forward run at a quarter
    of the step with the torque linear between knots; rigid feed-forward 49.9 mm; peaks 7.39 and 9.38 N m; drives begin
    0.03 s ahead. To the digits that are stated.
    """
    arm = LinearArm.made()
    roots = np.sqrt(np.linalg.eigvals(arm.internal()[0]).astype(complex))
    assert min(abs(roots)) == pytest.approx(65.7, abs=0.05)
    assert abs(roots.imag).max() < 1e-6
    for h, error in ((4e-3, 0.0720), (2e-3, 0.0180), (1e-3, 0.0045)):
        t, torque = linear_torque(arm, h)
        fine = np.linspace(0.0, t[-1], 4 * (len(t) - 1) + 1)
        missed = arm.forward(fine, np.interp(fine, t, torque)) - nine(fine, np.pi / 3, 0.8, 0.6)[0]
        assert 1e3 * abs(missed).max() == pytest.approx(error, abs=0.5e-4)
    assert abs(torque).max() == pytest.approx(7.39, abs=0.005)
    assert 0.8 - t[abs(torque) > 0.01 * abs(torque).max()][0] == pytest.approx(0.03, abs=1.5e-3)
    rigid = arm.mass[0, 0] * nine(fine, np.pi / 3, 0.8, 0.6)[2]
    assert abs(rigid).max() == pytest.approx(9.38, abs=0.005)
    missed = arm.forward(fine, rigid) - nine(fine, np.pi / 3, 0.8, 0.6)[0]
    assert 1e3 * abs(missed).max() == pytest.approx(49.9, abs=0.05)


def test_orthogonal_elimination_solves_what_grows_and_decays() -> None:
    """200 steps that grow by e^2.5 and decay by as much in each: e^500 over all; against the dense solution of a short
    one, and by its residual.
    """
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(4, 4)))[0]
    before = -turn @ np.diag(np.exp([2.5, 1.0, -1.0, -2.5])) @ turn.T
    left = turn.T[2:], turn.T[:2]  # decaying at the start, growing at the end
    right = rng.normal(size=(200, 4))
    sweep = Sweep(left[0], np.ones(2))
    for each in right:
        sweep.step(before, np.eye(4), each)
    found = sweep.back(left[1], np.ones(2))
    assert abs(found[1:] + found[:-1] @ before.T - right).max() < 1e-12 * abs(found).max()
    assert abs(left[0] @ found[0] - 1).max() < 1e-12
    assert abs(left[1] @ found[-1] - 1).max() < 1e-12


@pytest.fixture(scope="module")
def passive() -> Inversion:
    """The passive arm at its own step."""
    return invert(scene(PASSIVE))


def test_passive_arm_against_an_independent_solver(passive: Inversion) -> None:
    """Its own equations of motion by SciPy's two-point solver of fourth order at 1e-9: torques differ by the error of
    the step, which falls by four; zeros +26.0 and -23.0 1/s.
    """
    assert np.sort(passive.nature.zeros.real) == pytest.approx([-23.04, 26.04], abs=0.005)
    arm = PassiveArm()

    def slopes(t: Any, x: Any) -> Any:
        return np.stack([x[1], arm.internal(x[0], x[1], nine(t, np.pi / 3, 0.7, 1.5))[0]])

    def ends(first: Any, last: Any) -> Any:  # of the linear equations: nothing grows before, nothing decays after
        return np.array([first[1] - 26.0405 * first[0], last[1] + 23.0405 * last[0]])

    knots = np.linspace(0.0, 2.9, 400)
    found = solve_bvp(slopes, ends, knots, np.zeros((2, len(knots))), tol=1e-9, max_nodes=100_000)
    assert found.success
    errors = []
    for inversion in (invert(scene(PASSIVE, "simulation.step=0.01")), passive):
        x = found.sol(inversion.t)
        torque = arm.internal(x[0], x[1], nine(inversion.t, np.pi / 3, 0.7, 1.5))[1]
        errors.append(abs(inversion.efforts["hub"] - torque).max())
    assert errors[0] < 5e-3 * abs(torque).max()
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_tracking_error_falls_with_pre_actuation_and_step(passive: Inversion) -> None:
    """From rest, exp(-26.0 Δ): between 0.1 and 0.2 s of room before the motion by exp(2.60); with room by order 2."""
    short = [
        _missed(scene(PASSIVE, f"servo.0.motion.start={room}", f"simulation.duration={2.2 + room}"))
        for room in (0.1, 0.2)
    ]
    assert np.log(short[0] / short[1]) == pytest.approx(2.604, abs=0.1)
    coarse = _missed(scene(PASSIVE, "simulation.step=0.01"))
    fine = confirmed(passive, passive.efforts, passive.start).largest[0]
    assert coarse / fine == pytest.approx(4.0, rel=0.05)
    assert fine < 4e-6


def _missed(loaded: Any) -> float:
    found = invert(loaded)
    return confirmed(found, found.efforts, found.start).largest[0]


def test_what_is_cut_off_ahead_is_what_is_missed() -> None:
    """The passive arm by its own equations and a two-point solver of fourth order: of drives that begin 0.3, 0.6 and
    1 s ahead, from rest, the end misses less than 4e-6, 2e-9 and 7e-13 rad, falling as exp(-26.04 Δ) to a tenth.
    """
    arm, start = PassiveArm(), 1.2

    def slopes(t: Any, x: Any) -> Any:
        return np.stack([x[1], arm.internal(x[0], x[1], nine(t, np.pi / 3, start, 1.5))[0]])

    def ends(first: Any, last: Any) -> Any:
        return np.array([first[1] - 26.0405 * first[0], last[1] + 23.0405 * last[0]])

    knots = np.linspace(0.0, 3.4, 600)
    found = solve_bvp(slopes, ends, knots, np.zeros((2, len(knots))), tol=1e-11, max_nodes=100_000)
    errors = []
    for ahead, accuracy in ((0.3, 1e-9), (0.6, 1e-11), (1.0, 1e-12)):

        def moves(t: float, x: Any) -> list[float]:
            torque = arm.internal(*found.sol(t), nine(np.array(t), np.pi / 3, start, 1.5))[1]
            a, b, c, f, g = (float(part) for part in arm.terms(*(np.array(part) for part in x[1:])))
            return [x[2], x[3], *np.linalg.solve([[a, b], [b, c]], [torque - f, -g])]

        later = np.linspace(start, start + 1.5, 50)
        span = (start - ahead, start + 1.5)
        ran = solve_ivp(moves, span, np.zeros(4), "DOP853", later, rtol=accuracy, atol=1e-2 * accuracy)
        wanted = nine(later, np.pi / 3, start, 1.5)[0]
        errors.append(abs(ran.y[0] + ran.y[1] / 2 - wanted).max())
    assert (np.array(errors) < [4e-6, 2e-9, 7e-13]).all()
    assert np.log(errors[0] / errors[1]) == pytest.approx(26.04 * 0.3, rel=0.1)


def test_shooting_agrees_with_collocation(passive: Inversion) -> None:
    """To 1e-6 of the largest torque: both solve the same steps, by other unknowns."""
    other = invert(scene(PASSIVE), method="shooting")
    assert other.method == "shooting"
    assert abs(other.states.efforts - passive.states.efforts).max() < 1e-6 * abs(passive.states.efforts).max()


def test_shooting_agrees_on_links_that_bend() -> None:
    """The same of the arm, what is faster than 60 Hz following: two bending motions grow, in stretches of three."""
    short = ("servo.0.motion.start=0.2", "simulation.duration=1.0", "simulation.step=0.008")
    loaded = scene(ARM, *short, "inverse.bandwidth=60.0", *FEW)
    one, other = (invert(loaded, method=name).states for name in ("collocation", "shooting"))
    assert abs(other.efforts - one.efforts).max() < 1e-6 * abs(one.efforts).max()


def test_minimum_phase_is_integrated_forward() -> None:
    """The hub's own angle: the passive link swings and decays. Steps one by one give what all at once do."""
    short = ("servo.0.motion.start=0.1", "simulation.duration=1.2", "servo.0.motion.duration=0.6")
    loaded = scene(PASSIVE, "servo.0.joints={ hub = 1.0 }", "simulation.step=0.02", *short)
    found = invert(loaded)
    assert (found.method, found.nature.minimum_phase, found.warnings) == ("forward", True, ())
    assert abs(found.nature.zeros) == pytest.approx(np.sqrt(150.0), rel=1e-6)  # k over m l² / 3
    problem = problem_of(loaded)
    work = Work(problem, rigid_motion(problem))
    states, steps, reason = march(work.solved, work.scales)
    assert (steps, reason) == (len(found.t) - 1, "")
    np.testing.assert_allclose(states.efforts, found.states.efforts, atol=1e-8)


def test_naive_integration_is_refused_or_shown_to_diverge() -> None:
    """With the zero that causes it; forced, it leaves every meaning 0.27 s after the motion began."""
    with pytest.raises(SimulationError, match=r"26\.04") as caught:
        invert(scene(PASSIVE), method="forward")
    assert (caught.value.cause, caught.value.exit_code) == (Cause.UNSTABLE_INVERSE, 2)
    soon = "servo.0.motion.start=0.2"
    found = invert(scene(PASSIVE, "simulation.step=0.01", soon), method="forward", force=True)
    assert found.t[-1] - 0.2 == pytest.approx(0.27, abs=0.03)
    assert f"diverges at t = {found.t[-1]:.4g} s" in found.warnings[0]


def test_zeros_on_the_axis_are_refused() -> None:
    """An undamped passive joint swings for ever, at √150 rad/s."""
    with pytest.raises(SimulationError, match=r"12\.25 i") as caught:
        invert(scene(PASSIVE, "servo.0.joints={ hub = 1.0 }", "joints.1.damping=0.0"))
    assert (caught.value.cause, caught.value.exit_code) == (Cause.UNDAMPED_INVERSE, 2)


def test_too_few_drives() -> None:
    """Refused with both numbers."""
    path = f"{{ shape = 'line', from = {TIP}, to = [0.8, 0.4, 0.2], duration = 0.3 }}"
    demand = f"servo=[{{ point = 'end2', coordinates = ['x', 'y', 'z'], path = {path} }}]"
    with pytest.raises(SceneError, match="fewer drives") as caught:
        invert(scene(ROBOT, demand))
    assert (caught.value.cause, caught.value.value, caught.value.limit) == (Cause.TOO_FEW_DRIVES, 2, 3)
    with pytest.raises(SceneError, match="nothing is demanded"):
        invert(scene(ROBOT))


RIGID = ("links.0.flexible=false", "links.1.flexible=false", "simulation.step=0.01")


@pytest.mark.parametrize(
    ("change", "cause", "since"),
    [
        ("servo.0.path.to=[0.2, 1.2, 0.0]", Cause.OUT_OF_REACH, 0.9),
        ("servo.0.path.from=[2.0, 0.5, 0.0]", Cause.OUT_OF_REACH, 0.0),
        ("servo.0.path.to=[-0.5, -0.5, 0.0]", Cause.SINGULAR_SERVO, 0.9),
    ],
)
def test_impossible_demands_end_with_their_cause_and_time(change: str, cause: Cause, since: float) -> None:
    """Out of reach beyond 1 m, and through the shoulder, half-way at 0.9 s."""
    with pytest.raises(SimulationError) as caught:
        invert(scene(PLANAR, change, *RIGID))
    assert (caught.value.cause, caught.value.exit_code) == (cause, 3)
    time = float(caught.value.where.removeprefix("t = ").removesuffix(" s"))
    assert since <= time <= since + 0.1


def test_rigid_planar_robot_is_computed_torque() -> None:
    """Without flexibility the efforts are those of the recursive Newton-Euler method along the joint motion found."""
    from erls.mechanism.rigid_dynamics import inverse_dynamics

    found = invert(scene(PLANAR, *RIGID))
    for k in (60, 80, 100):
        at = (part[k] for part in found.states[:3])
        torque = inverse_dynamics(found.problem.mechanism, *at)
        np.testing.assert_allclose(found.states.efforts[k], torque, rtol=1e-9)


FEW = ("links.0.elastic_modes=4", "simulation.spectral_radius=1.0")


def test_flexible_arm_follows_to_second_order() -> None:
    """The nonlinear arm in its four slowest modes: tip errors of forward runs fall by four; rigid feed-forward misses
    by hundreds of times more; the slowest zeros grow and decay alike.
    """
    errors = []
    for step in ("0.008", "0.004"):
        found = invert(scene(ARM, f"simulation.step={step}", *FEW))
        errors.append(confirmed(found, found.efforts, found.start).error)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] < 2e-4
    assert confirmed(found, found.rigid_efforts, found.rigid_start).error > 100 * errors[1]
    slow = found.nature.zeros[:2]
    assert slow[0] == pytest.approx(-slow[1], rel=1e-6)
    assert 0.02 < found.pre_actuation() < 0.05


def test_formulations_agree() -> None:
    """ERLS and FFR share no equation of motion, and hold the same second-order model: torques to 1e-3 of their peak."""
    changes = ("simulation.step=0.008", *FEW)
    erls_, ffr = (
        invert(scene(ARM, f"simulation.formulation={name}", *changes)).states.efforts for name in ("erls", "ffr")
    )
    assert abs(erls_ - ffr).max() < 1e-3 * abs(ffr).max()


def test_robot_under_weight_follows_two_coordinates() -> None:
    """The spatial robot in few modes: from its sagging start, by a hundredth of what rigid feed-forward misses."""
    path = f"{{ shape = 'line', from = {TIP}, to = [0.8, 0.4, 0.2], start = 0.1, duration = 0.6 }}"
    demand = f"servo=[{{ point = 'end2', coordinates = ['y', 'z'], path = {path} }}]"
    modes = ("links.0.elastic_modes=4", "links.1.elastic_modes=4", "simulation.duration=0.9", "simulation.step=0.005")
    found = invert(scene(ROBOT, demand, *modes))
    missed = confirmed(found, found.efforts, found.start)
    assert missed.error < 1e-4
    assert confirmed(found, found.rigid_efforts, found.rigid_start).error > 100 * missed.error


@pytest.mark.parametrize("bandwidth", ["20.0", "1000.0"])
def test_corrections_take_off_what_a_forward_run_misses(bandwidth: str) -> None:
    """The error of a coarse step here, as that of another model elsewhere, whether fast motions follow or move: a tenth
    is left; of a goal that is met nothing is taken off.
    """
    found = invert(scene(ARM, "simulation.step=0.008", f"inverse.bandwidth={bandwidth}", *FEW))
    assert bool(found.left) == (bandwidth == "20.0")
    first = confirmed(found, found.efforts, found.start)
    assert corrected(found, first, 1.0).corrections == 0
    missed: list[float] = []
    better = corrected(found, first, first.error / 10, told=lambda number, miss: missed.append(miss))
    assert better.confirmation.error < first.error / 10
    assert better.corrections == len(missed) <= 3
    again = confirmed(better.inversion, better.inversion.efforts, better.inversion.start)
    assert again.error == pytest.approx(better.confirmation.error, rel=1e-9)

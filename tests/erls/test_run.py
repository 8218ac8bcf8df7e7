"""What can be asked of a run: dense output, reactions, energies, samples, summary."""

from __future__ import annotations

import json
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.errors import Cause, SceneError
from erls.integrate.base import hermite
from erls.mechanism.chain import poses
from erls.run.chain.run import ChainRun

END = 0.05
TIMES = np.array([[0.0, 0.0107, 0.02], [0.0333, 0.0499, END]])
PENDULUM = {
    "mass": 2.0,
    "centre_of_mass": [0.3, 0.0, 0.0],
    "inertia": [0.01, 0.02, 0.02],
    "points": {"root": [0.0, 0.0, 0.0], "bob": [0.3, 0.0, 0.0]},
}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> ChainRun:
    """Three flexible links, the second joint driven, a spring, a damper and a payload."""
    folder = tmp_path_factory.mktemp("run")
    path = scenes.three_links(folder, "prescribed", payloads=[{"point": "end", "mass": 0.1}])
    data = scenes.read_toml(path)
    data["joints"][2] |= {"stiffness": 3.0, "rest": 0.2, "damping": 0.01}
    data["simulation"] = {"duration": END, "step": 2e-4, "gauge": "minimum-norm", "effects": "linear"}
    data["points"] = [{"name": "middle", "link": "a", "node": "tip"}, *data["points"]]
    return erls.simulate(scenes.write_toml(path, data))


def pendulum(folder: Path, **changes: Any) -> Path:
    """A rigid pendulum about the world's y axis; θ = 0 is horizontal along x, θ > 0 lowers it."""
    links = [{"name": "l", "rigid": PENDULUM}]
    points = [{"name": "bob", "link": "l", "node": "bob"}]
    simulation = {"duration": 0.2, "step": 1e-3}
    return scenes.l_scene(folder, **{"links": links, "points": points, "simulation": simulation, **changes})


QUESTIONS = {
    "position": (lambda run, t: run.position("end", t), (3,)),
    "joint_angle": (lambda run, t: run.joint_angle("j1", t), ()),
    "joint_coordinate": (lambda run, t: run.joint_coordinate("j3", t), ()),
    "joint_rate": (lambda run, t: run.joint_rate("j2", t), ()),
    "elastic_coordinates": (lambda run, t: run.elastic_coordinates("c", t), (7,)),
    "modal_coordinates": (lambda run, t: run.modal_coordinates("a", t), (13,)),
    "force": (lambda run, t: run.reaction("j2", t)[0], (3,)),
    "moment": (lambda run, t: run.reaction("j2", t)[1], (3,)),
    "joint_effort": (lambda run, t: run.joint_effort("j3", t), ()),
    "kinetic": (lambda run, t: run.energy(t).kinetic, ()),
    "total": (lambda run, t: run.energy(t).total, ()),
}


@pytest.mark.parametrize("question", QUESTIONS)
def test_shape_of_times_stands_in_front(run: ChainRun, question: str) -> None:
    """A scalar, a list, a matrix and no times at all; the same values one by one, but for the order of sums in products
    of matrices.
    """
    ask, shape = QUESTIONS[question]
    found = ask(run, TIMES)
    assert found.shape == (*TIMES.shape, *shape)
    assert found.dtype == np.float64
    assert np.isfinite(found).all()
    rounding = 8 * np.finfo(float).eps * np.abs(found).max()
    for index in np.ndindex(TIMES.shape):
        one = ask(run, float(TIMES[index]))
        assert np.shape(one) == shape
        np.testing.assert_allclose(one, found[index], rtol=0, atol=rounding)
    np.testing.assert_allclose(ask(run, TIMES[1].tolist()), found[1], rtol=0, atol=rounding)
    assert ask(run, []).shape == (0, *shape)


@pytest.mark.parametrize("settings", [["formulation=ffr"], ["gauge=minimum-norm"], []])
def test_a_copy_answers_from_its_own_memory(settings: list[str]) -> None:
    """Reactions of a copy, and of the run that was copied, after the other one has been asked about another time."""
    path = Path(__file__).parents[2] / "data/robot/two_link.toml"
    overrides = [f"simulation.{each}" for each in ("duration=0.02", *settings)]
    run = erls.simulate(erls.load_scene(path, overrides))
    expected = run.reaction(run.joint_names[0], TIMES.ravel() * 0.02 / TIMES.max())
    twin = deepcopy(run)
    for one, other in ((twin, run), (run, twin)):
        other.reaction(run.joint_names[0], 0.0)
        found = one.reaction(run.joint_names[0], TIMES.ravel() * 0.02 / TIMES.max())
        np.testing.assert_array_equal(found, expected)


def test_position_from_first_principles(run: ChainRun) -> None:
    """Node + mode shapes times modal coordinates, carried by the rigid chain at θ: 1e-14 m."""
    mechanism = run.formulation.mechanism
    for t in TIMES.ravel():
        theta = np.array([run.joint_coordinate(j, t) for j in run.joint_names])
        frames = poses(mechanism, theta)
        for point in mechanism.points:
            model = mechanism.links[point.link].model
            q = run.modal_coordinates(run.link_names[point.link], t)
            local = model.nodes[point.node] + model.translation_shapes[point.node] @ q
            expected = frames[point.link] @ [*local, 1.0]
            np.testing.assert_allclose(run.position(point.name, t), expected[:3], atol=1e-14)


def test_knots_are_reproduced_and_both_sides_of_a_knot_agree(run: ChainRun) -> None:
    """Dense output passes through the integrator's own states."""
    s = run.solution
    found = hermite(s.t, s.y, s.v, s.a, s.t)
    np.testing.assert_allclose(found[0], s.y, atol=1e-12 * np.abs(s.y).max())
    np.testing.assert_allclose(found[1], s.v, atol=1e-9 * np.abs(s.v).max())
    assert len(run.times) == len(np.unique(s.t))
    assert run.end == END


def test_rate_is_the_derivative_of_the_angle(run: ChainRun) -> None:
    """Of every joint, in the gauge where the coordinate is not the angle: central differences, 1e-5 of the largest."""
    h = 2e-7
    times = np.linspace(0.011, 0.049, 9) + 0.37e-4  # inside steps
    for name in run.joint_names:
        difference = (run.joint_angle(name, times + h) - run.joint_angle(name, times - h)) / (2 * h)
        rate = run.joint_rate(name, times)
        np.testing.assert_allclose(rate, difference, atol=1e-5 * np.abs(rate).max())


def test_the_prescribed_joint_follows_its_motion(run: ChainRun) -> None:
    """Angle, coordinate and rate, whatever the links do."""
    drive = run.formulation.mechanism.joints[1].drive
    expected = np.array([drive.reference(t) for t in TIMES.ravel()])
    np.testing.assert_allclose(run.joint_angle("j2", TIMES.ravel()), expected[:, 0], atol=1e-15)
    np.testing.assert_allclose(run.joint_rate("j2", TIMES.ravel()), expected[:, 1], atol=1e-12)


@pytest.mark.parametrize("t", [-1e-6, END + 1e-6, np.nan, np.inf, [0.01, 7.0]])
def test_times_outside_are_refused(run: ChainRun, t: Any) -> None:
    """With the time and what the run covers."""
    for ask, _ in QUESTIONS.values():
        with pytest.raises(SceneError) as caught:
            ask(run, t)
        assert caught.value.cause == Cause.TIME_OUT_OF_RANGE
        assert caught.value.limit == f"0 to {END} s"
        assert caught.value.remedy


def test_rounding_of_a_time_is_forgiven(run: ChainRun) -> None:
    """0.1 + 0.2 asks for 0.3."""
    late = END * (1 + 1e-12)
    np.testing.assert_allclose(run.position("end", late), run.position("end", END), atol=1e-12)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda run: run.position("ende", 0.0), "did you mean 'end'?"),
        (lambda run: run.joint_angle("j4", 0.0), "known: j1, j2, j3"),
        (lambda run: run.joint_rate("", 0.0), "a name is missing"),
        (lambda run: run.reaction("jj1", 0.0), "did you mean 'j1'"),
        (lambda run: run.joint_effort("shoulder", 0.0), "known: j1, j2, j3"),
        (lambda run: run.elastic_coordinates("d", 0.0), "known: a, b, c"),
    ],
)
def test_unknown_names_get_a_suggestion(run: ChainRun, ask: Any, words: str) -> None:
    """Of points, joints and links."""
    with pytest.raises(SceneError) as caught:
        ask(run)
    assert caught.value.cause == Cause.BAD_REFERENCE
    assert words in str(caught.value)


def test_names(run: ChainRun) -> None:
    """In the order of the scene."""
    assert run.point_names == ("middle", "end")
    assert run.joint_names == ("j1", "j2", "j3")
    assert run.link_names == ("a", "b", "c")


def test_energies_of_a_rigid_pendulum(tmp_path: Path) -> None:
    """½ J θ̇², -m g z (0 at the origin), ½ k (θ - θ₀)²: 1e-9 J; their sum stays to 1e-4 J at 1 ms."""
    joint = {"name": "shoulder", "dh": {"convention": "standard", "alpha_deg": 90.0}, "stiffness": 5.0, "rest": 0.3}
    run = erls.simulate(pendulum(tmp_path, joints=[joint]))
    t = np.linspace(0.0, 0.2, 7)
    angle, rate, energy = run.joint_angle("shoulder", t), run.joint_rate("shoulder", t), run.energy(t)
    np.testing.assert_allclose(energy.kinetic, 0.5 * (0.02 + 2.0 * 0.09) * rate**2, atol=1e-9)
    np.testing.assert_allclose(energy.gravity, -2.0 * 9.81 * 0.3 * np.sin(angle), atol=1e-9)
    np.testing.assert_allclose(energy.springs, 0.5 * 5.0 * (angle - 0.3) ** 2, atol=1e-9)
    np.testing.assert_array_equal(energy.elastic, 0.0)
    assert np.ptp(energy.total) < 1e-4
    assert run.conservative


def test_reaction_of_a_pendulum_at_rest(tmp_path: Path) -> None:
    """Hanging down it carries its weight; held horizontally by a stiff spring also its moment, 1e-6 relative."""
    simulation = {"duration": 0.01, "step": 1e-3}
    joint = scenes.L_SCENE["joints"][0]
    hanging = erls.simulate(
        pendulum(tmp_path, joints=[{**joint, "initial": {"position_deg": 90.0}}], simulation=simulation)
    )
    force, moment = hanging.reaction("shoulder", [0.0, 0.01])
    np.testing.assert_allclose(force, [[0, 0, 2.0 * 9.81]] * 2, atol=1e-9)
    np.testing.assert_allclose(moment, 0.0, atol=1e-9)
    np.testing.assert_allclose(hanging.position("bob", 0.01), [0, 0, -0.3], atol=1e-12)
    motion = {"shape": "table", "times": [0.0, 1.0, 2.0, 3.0], "values": [0.0] * 4}
    held = erls.simulate(
        pendulum(tmp_path, joints=[{**joint, "drive": {"type": "motion", "motion": motion}}], simulation=simulation)
    )
    force, moment = held.reaction("shoulder", 0.005)
    np.testing.assert_allclose(force, [0, 0, 2.0 * 9.81], atol=1e-9)
    np.testing.assert_allclose(moment, [0, -2.0 * 9.81 * 0.3, 0], atol=1e-9)  # about y, against the weight
    assert held.joint_effort("shoulder", 0.005) == pytest.approx(-2.0 * 9.81 * 0.3)


def test_reaction_of_a_flexible_link_at_rest_is_its_weight(tmp_path: Path) -> None:
    """In static equilibrium, joint held: force 2.34 kg · g, moment about the root of the undeformed L within 1 %."""
    scenes.l_link(tmp_path)
    motion = {"shape": "table", "times": [0.0, 1.0, 2.0, 3.0], "values": [0.0] * 4}
    joint = {**scenes.L_SCENE["joints"][0], "drive": {"type": "motion", "motion": motion}}
    run = erls.simulate(
        scenes.l_scene(
            tmp_path, joints=[joint], initial={"deformation": "static"}, simulation={"duration": 0.01, "step": 1e-3}
        )
    )
    weight = 2.34 * 9.81
    for t in (0.0, 0.01):
        force, moment = run.reaction("shoulder", t)
        np.testing.assert_allclose(force, [0, 0, weight], atol=1e-6 * weight)
        # centre of mass of the L at (0.375, 0.125): moment = c x (weight upwards)
        np.testing.assert_allclose(moment, [0.125 * weight, -0.375 * weight, 0], atol=0.01 * weight * 0.375)


def test_reactions_balance_the_whole_mechanism(run: ChainRun) -> None:
    """The ground's force = Σ m (a - g): by second differences of the centre of mass, 1e-4 of the weight.

    The rate of change of the links' linear momentum is what the ground and gravity do.
    """
    mechanism = run.formulation.mechanism

    def momentum_over_mass(t: float) -> np.ndarray:
        """Σ m c over links, deformation included."""
        state = run.states([t])[0]
        total = np.zeros(3)
        for link, frame, q in zip(mechanism.links, state.poses, state.modal, strict=True):
            i = link.invariants
            first = (i.rigid.T @ i.m)[:3]  # mass-weighted displacement per modal coordinate
            mass = i.rigid_mass_matrix
            centre = np.array([mass[5, 1], mass[3, 2], mass[4, 0]])  # μ c from μ c×
            total += frame[:3, :3] @ (centre + first @ q) + mass[0, 0] * frame[:3, 3]
        return total

    t, h = 0.0301, 1e-5
    force, _ = run.reaction("j1", t)
    mass = sum(link.invariants.rigid_mass_matrix[0, 0] for link in mechanism.links)
    second = (momentum_over_mass(t + h) - 2 * momentum_over_mass(t) + momentum_over_mass(t - h)) / h**2
    # the interpolant's acceleration differs from the equations' by the discretization error
    np.testing.assert_allclose(force, second - mass * mechanism.gravity, atol=0.02 * np.abs(force).max())


def test_samples(run: ChainRun) -> None:
    """Joints and points at each time, as asked for one by one; plain floats."""
    found = run.samples([0.0, 0.0333])
    assert [s["t"] for s in found] == [0.0, 0.0333]
    for sample in found:
        t = sample["t"]
        assert list(sample) == ["t", "joints", "points"]
        assert {n: j["angle"] for n, j in sample["joints"].items()} == {
            n: float(run.joint_angle(n, t)) for n in run.joint_names
        }
        assert {n: j["coordinate"] for n, j in sample["joints"].items()} == {
            n: float(run.joint_coordinate(n, t)) for n in run.joint_names
        }
        assert sample["points"] == {n: run.position(n, t).tolist() for n in run.point_names}
    assert run.samples([]) == []


PROMISED = {
    "scene": str,
    "formulation": str,
    "duration": float,
    "steps": int,
    "rhs_calls": int,
    "newton_iterations": int,
    "wall_s": float,
    "energy": dict,
    "samples": list,
    "warnings": list,
}


def test_summary_keeps_its_promises(run: ChainRun) -> None:
    """Every promised key with its type; strict JSON; the driven scene has no drift."""
    summary = run.summary([0.01])
    for key, kind in PROMISED.items():
        assert type(summary[key]) is kind
    assert list(summary["energy"]) == ["initial", "final", "max_drift"]
    assert summary["energy"]["max_drift"] is None
    assert summary["duration"] == END
    assert summary["steps"] == len(run.times) - 1
    assert len(summary["samples"]) == 1
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


@pytest.mark.parametrize(
    "changes",
    [
        {"drive": {"type": "torque", "profiles": [{"shape": "constant", "value": 0.0}]}},
        {"damping": 0.1},
        {"friction": {"force": 0.1}},
        {},
    ],
    ids=["driven", "damped", "friction", "free"],
)
def test_drift_is_told_only_where_energy_should_stay(tmp_path: Path, changes: dict[str, Any]) -> None:
    """``max_drift`` is None for driven and damped scenes."""
    run = erls.simulate(pendulum(tmp_path, joints=[{**scenes.L_SCENE["joints"][0], **changes}]))
    energy = run.summary()["energy"]
    assert (energy["max_drift"] is None) == bool(changes) == (not run.conservative)
    if not changes:
        assert abs(energy["final"] - energy["initial"]) <= energy["max_drift"] < 1e-4


def test_a_run_of_one_knot_answers(run: ChainRun) -> None:
    """A run that failed at once still tells where it stood."""
    s = run.solution
    stub = replace(run, solution=replace(s, t=s.t[:1], y=s.y[:1], v=s.v[:1], a=s.a[:1]))
    np.testing.assert_array_equal(stub.position("end", 0.0), run.position("end", 0.0))
    assert stub.summary([0.0])["duration"] == 0.0

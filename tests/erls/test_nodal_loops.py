"""Trees and loops of nodal elements: against ERLS at the start and on the way, closed forms, energy, equilibrium."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import chain_cases
import loop_cases
import loop_scenes
import numpy as np
import pytest
import scenes
from loop_scenes import LENGTHS
from test_loops_rigid import RATE, one_coordinate, planar
from test_trees import two_arms

from erls.equations.dead_points import dead_point
from erls.equations.formulation import Formulation, LoopFormulation
from erls.equations.nodal.equations import Nodal
from erls.equations.registry import formulate
from erls.errors import Cause, SimulationError
from erls.integrate.base import Solution, Work
from erls.integrate.nodal_chain import closed
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.without_effects import with_rigid
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism
from erls.scene.read import load_scene
from erls.scene.settings import Simulation
from erls.simulation.simulate import simulate

SAME = 1e-9  # of the largest: rounding times the condition of both systems, 1e5 here
LOCKED = "cylindrical"  # its prescribed joint moves against a loop that locks: no accelerations do
# forces that nothing decides: the least are others about where the coordinate is zero than at the end
SHARED = ("driven slide", "driven screw")


def _both(mechanism: Mechanism) -> list[Formulation]:
    """Nodal and ERLS equations of the same rigid links."""
    rigid = with_rigid(mechanism, {link.name for link in mechanism.links})
    return [formulate(rigid, Simulation(duration=1.0, formulation=name)) for name in ("nodal", "erls")]


def _joint_accelerations(equations: Formulation, y: Array, v: Array) -> Array:
    found = equations.acceleration(0.0, y, v)
    joints = len(equations.mechanism.joints)
    if isinstance(equations, Nodal):
        return found[12 * equations.system.count :][:joints]
    free = [k for k, joint in enumerate(equations.mechanism.joints) if not joint.drive.prescribed]
    wanted = [joint.drive.reference(0.0) for joint in equations.mechanism.joints]
    result = np.array([0.0 if w is None else w[2] for w in wanted])
    result[free] = found[: len(free)]
    return result


def _same(one: Any, other: Any) -> None:
    expected = np.asarray(other, dtype=float)
    largest = max(1.0, float(np.abs(expected).max(initial=0.0)))
    np.testing.assert_allclose(np.asarray(one), expected, rtol=0, atol=SAME * largest)


def _compare(
    nodal: Formulation, erls: Formulation, forces: bool = True, accelerations: bool = True
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Of the start: energies, places, joint motion, and what acts in joints; the states."""
    one, other = nodal.initial_state(), erls.initial_state()
    here, there = nodal.state(0.0, *one), erls.state(0.0, *other)
    for name in ("poses", "angles", "rates"):
        _same(getattr(here, name), getattr(there, name))
    energies = [equations.energy(0.0, *at) for equations, at in ((nodal, one), (erls, other))]
    _same(energies[0].total, energies[1].total)
    if accelerations:
        _same(_joint_accelerations(nodal, *one), _joint_accelerations(erls, *other))
    for x, y in zip(nodal.reactions(0.0, *one), erls.reactions(0.0, *other), strict=True) if forces else ():
        for name in ("force", "moment", "effort"):
            _same(getattr(x, name), getattr(y, name))
    return one, other


@pytest.mark.parametrize("case", [name for name in loop_cases.CASES if name != LOCKED])
def test_rigid_loops_begin_as_those_of_erls(tmp_path: Path, case: str) -> None:
    """Every kind of closing joint, to ground and links, with drives, springs, dampers, friction, rotors: accelerations
    and reactions that follow from Φ̈ = 0, in frames of nodes and in joint coordinates.
    """
    nodal, erls = _both(loop_cases.mechanism(tmp_path, case))
    one, other = _compare(nodal, erls, case not in SHARED)
    loops: tuple[LoopFormulation, LoopFormulation] = nodal, erls  # type: ignore[assignment]
    forces = [equations.loop_forces(0.0, *at) for equations, at in zip(loops, (one, other), strict=True)]
    for x, y in zip(*forces, strict=True):
        for name in ("force", "moment", "place") if case not in SHARED else ("place",):
            _same(getattr(x, name), getattr(y, name))
    for k, loop in enumerate(nodal.mechanism.loops):
        if loop.freedom is not None:
            _same(loops[0].loop_motion(0.0, *one, k), loops[1].loop_motion(0.0, *other, k))
            if case not in SHARED:
                _same(loops[0].loop_effort(0.0, *one, k), loops[1].loop_effort(0.0, *other, k))


def test_a_rigid_tree_begins_as_that_of_erls(tmp_path: Path) -> None:
    """Two branches on one link, with rates."""
    starts = [{"initial": {"position": 0.3 - 0.2 * k, "rate": 0.5 + 0.3 * k}} for k in range(4)]
    path = two_arms(tmp_path)
    data = scenes.read_toml(path)
    data["joints"] = [{**joint, **start} for joint, start in zip(data["joints"], starts, strict=True)]
    _compare(*_both(scenes.mechanism(scenes.write_toml(path, data))))


@pytest.mark.parametrize("case", chain_cases.CASES)
def test_rigid_trees_begin_as_those_of_erls(tmp_path: Path, case: str) -> None:
    """Branches, everything that acts in joints, and joints of several coordinates: massless links between their
    motions, or a spherical joint at once, whose coordinates nodes do not have.
    """
    mechanism = chain_cases.mechanism(tmp_path, case)
    nodal, erls = _both(mechanism)
    _compare(nodal, erls, accelerations=not mechanism.rotation_vectors)


def _knots(run: ChainRun) -> tuple[Nodal, Array]:
    """The equations of a nodal run, and how far each condition, left out or not, is from holding at its knots."""
    equations, solution = run.formulation, run.solution
    assert isinstance(equations, Nodal)
    full = equations.chain.full
    at = zip(solution.t.tolist(), solution.y, solution.v, strict=True)
    return equations, np.array([full.constraint(t, equations.configuration(y, v)[0]) for t, y, v in at])


def test_driven_four_bar_keeps_to_the_closed_form(tmp_path: Path) -> None:
    """Pins between steps of 1 ms: 1e-11 m, where Newton's method stops (1e-12 m) and quintics between knots. Conditions
    hold at knots within what iterations may leave open, 1e-10 of an arm of 0.45 m; angles come from rates of second
    order, too, 1e-3 s · 2e-5 rad/s. Torque and forces are those of ERLS to 4e-5 of their peak once the start has
    decayed: errors of second order, (ω h)².
    """
    data = loop_scenes.driven(loop_scenes.four_bar(), loop_scenes.steady(60.0, RATE))
    run, other = (
        loop_scenes.run(tmp_path, data, name, integrator="generalized_alpha", step=1e-3, duration=0.1)
        for name in ("nodal", "erls")
    )
    t = np.linspace(0, run.end, 23)
    crank = np.radians(60.0 + RATE * t)
    at = LENGTHS[0] * np.exp(1j * crank)
    for link, length, angle in zip(("coupler", "rocker"), LENGTHS[1:], loop_scenes.four_bar_angles(crank), strict=True):
        at = at + length * np.exp(1j * angle)
        np.testing.assert_allclose(planar(run.position(f"{link} tip", t)), at, atol=1e-11)
    equations, gaps = _knots(run)
    assert np.abs(gaps).max() < 4.5e-11
    assert len(equations.chain.left_out) == 3
    assert any("follow from the others" in text for text in run.warnings)
    late = t[t > 0.06]
    np.testing.assert_allclose(run.loop_coordinate("pivot", t), other.loop_coordinate("pivot", t), atol=1e-8)
    pairs = [(run.joint_effort("j0", late), other.joint_effort("j0", late))]
    pairs += list(zip(run.loop_reaction("pivot", late), other.loop_reaction("pivot", late), strict=True))
    pairs += list(zip(run.reaction("j1", late), other.reaction("j1", late), strict=True))
    for mine, theirs in pairs:
        np.testing.assert_allclose(mine, theirs, atol=4e-5 * max(0.1, float(np.abs(theirs).max())))


def test_conditions_that_were_left_out_are_looked_at(tmp_path: Path) -> None:
    """A rocker that leaves the plane, which no condition in use forbids, is a failure; in the plane it is none."""
    nodal, _ = _both(scenes.mechanism(scenes.write_toml(tmp_path / "loop.toml", loop_scenes.four_bar())))
    assert isinstance(nodal, Nodal)
    y, v = nodal.initial_state()
    places = np.array([y, y])
    for shift, cause in ((0.0, None), (1e-3, Cause.REDUNDANT_CONSTRAINTS)):
        places[1, 24 + 1] = y[24 + 1] + shift  # of the third node, along the axes of the joints
        found = closed(nodal, Solution(np.array([0.0, 1.0]), places, np.array([v, v]), 0 * places, Work()))
        assert (found.failure and found.failure.cause) is cause


def test_free_four_bar_is_of_second_order(tmp_path: Path) -> None:
    """Crank angle against the equation of motion in that angle, steps of 4 and 2 ms; so is what energy loses, at 2 ms
    less than 3e-4 of what moves.
    """
    t = np.array([0.3])
    exact = one_coordinate(np.array([0.0, *t]))[1:]
    runs = [loop_scenes.run(tmp_path, loop_scenes.four_bar(), "nodal", step=h, duration=0.3) for h in (4e-3, 2e-3)]
    errors = [abs(float((run.joint_angle("j0", t) - exact)[0])) for run in runs]
    assert 1.8 < np.log2(errors[0] / errors[1]) < 2.2
    drifts = [float(np.ptp(run.energy(np.linspace(0.0, 0.3, 16)).total)) for run in runs]
    assert drifts[1] < drifts[0] / 3
    assert drifts[1] < 3e-4 * float(np.ptp(runs[1].energy(np.linspace(0.0, 0.3, 16)).kinetic))


def test_what_acts_along_a_closing_joint(tmp_path: Path) -> None:
    """A slider with controller, spring, damper, friction and rotor on its guide: ERLS and nodal elements, whose errors
    are both of second order in the step, come nearer to each other with it.
    """
    guide: dict[str, Any] = {"coordinate": 0.3, "stiffness": 40.0, "damping": 2.0, "motor": {"rotor_inertia": 0.3}}
    guide["friction"] = {"force": 1.0, "transition_rate": 0.1}
    motion = {"shape": "polynomial", "from": 0.5, "to": 0.4, "duration": 0.2}
    guide["drive"] = {"type": "pd", "proportional_gain": 500.0, "derivative_gain": 20.0, "motion": motion}
    data = loop_scenes.slider_crank()
    data["loops"] = [{**data["loops"][0], **guide}]
    t, apart = np.linspace(0.0, 0.1, 11), []
    for step in (2e-3, 1e-3):
        one, other = (loop_scenes.run(tmp_path, data, name, step=step, duration=0.1) for name in ("nodal", "erls"))
        asked = ("loop_coordinate", "loop_rate", "loop_effort")
        both = [[getattr(x, name)("guide", t) for name in asked] for x in (one, other)]
        apart.append([float(np.abs(x - y).max()) for x, y in zip(*both, strict=True)])
    assert (np.array(apart[1]) < np.array(apart[0]) / 2.5).all()
    assert apart[1][0] < 5e-5


def test_flexible_four_bar_from_static_equilibrium() -> None:
    """Deflections of the start (0.24 mm) agree within 3 %: the force along the coupler, 2 N to 3 N, is so much of its
    critical load of 154 N, which modes do not know. At rest it stays at rest; then its points come out as those of ERLS
    within 3 % of the bending (1.3 mm).
    """
    pages = scenes.ROOT / "data" / "four_bar" / "flexible.toml"
    undamped = [f"links.{name}.damping.ratio=0.0" for name in ("crank", "coupler", "rocker")]
    changes = ["simulation.duration=0.03", "simulation.step=5e-4", *undamped]

    def run(name: str, *more: str) -> ChainRun:
        return simulate(load_scene(pages, [*changes, f"simulation.formulation={name}", *more]), verdict=False)

    straight = run("nodal", "initial.deformation=zero", "simulation.duration=5e-4").position("coupler_middle", 0.0)
    nodal, erls = run("nodal"), run("erls")
    places = [x.position("coupler_middle", 0.0) for x in (nodal, erls)]
    sag = float(np.linalg.norm(places[0] - straight))
    assert 2e-4 < sag < 3e-4
    assert np.linalg.norm(places[0] - places[1]) < 0.03 * sag
    t = np.linspace(0.0, 0.03, 31)
    for point in nodal.point_names:
        assert np.abs(nodal.position(point, t) - erls.position(point, t)).max() < 4e-5
    equations, gaps = _knots(nodal)
    assert equations.chain.left_out == ()
    assert np.abs(gaps).max() < 4.5e-11
    still = run("nodal", "joints.crank_pivot.drive.motion.to_deg=60.0", "simulation.duration=0.01")
    moved = still.position("coupler_middle", np.linspace(0.0, 0.01, 11)) - still.position("coupler_middle", 0.0)
    assert np.abs(moved).max() < 1e-9 * sag / 1e-4


def test_flexible_tree(tmp_path: Path) -> None:
    """Two arms of beams of 0.4 m on a torso, 30 ms from rest. ERLS is of first order in deflection δ: δ²/L apart."""
    runs = []
    for name in ("nodal", "erls"):
        path = two_arms(tmp_path, simulation={"duration": 0.03, "step": 5e-4, "formulation": name, "effects": ["all"]})
        runs.append(simulate(load_scene(path), verdict=False))
    t = np.linspace(0.0, 0.03, 16)
    for point in ("left", "right"):
        moved = np.abs(runs[0].position(point, t) - runs[0].position(point, 0.0)).max()
        assert moved > 3e-3
        assert np.abs(runs[0].position(point, t) - runs[1].position(point, t)).max() < moved**2 / 0.4


@pytest.mark.parametrize("rate", [180.0, -100.0])
def test_dead_points_are_named_when_they_are_reached(tmp_path: Path, rate: float) -> None:
    """A four-bar driven by its rocker locks where crank and coupler are in line, by the law of cosines, to 1e-6 s."""
    first, second, third = LENGTHS
    path = scenes.write_toml(tmp_path / "rocker.toml", loop_scenes.rocker_first(rate))
    with pytest.raises(SimulationError, match=r"locks.*'pivot' cannot follow joint 'j0'") as caught:
        simulate(load_scene(path, ["simulation.formulation=nodal", "simulation.duration=1.0"]), verdict=False)
    assert caught.value.cause is Cause.LOOP_OPEN
    reached = caught.value.run
    assert isinstance(reached, ChainRun)
    line = first + second if rate > 0 else second - first
    between = np.degrees(np.arccos((0.5**2 + third**2 - line**2) / (2 * 0.5 * third)))
    assert reached.end == pytest.approx((between - 80.0) / rate, abs=1e-6)
    equations = reached.formulation
    assert isinstance(equations, Nodal)
    halfway = len(reached.solution.t) // 2
    q, _ = equations.configuration(reached.solution.y[halfway], reached.solution.v[halfway])
    assert dead_point(equations.system, float(reached.solution.t[halfway]), q) is None


def test_a_change_point_is_no_dead_point(tmp_path: Path) -> None:
    """A drive turns a parallelogram through the positions in which its links are in line, and is followed."""
    data = loop_scenes.parallelogram()
    for given, angle in zip(data["joints"], (0.0, 0.0, -180.0), strict=True):
        given["initial"] = {"position_deg": angle}
    path = scenes.write_toml(tmp_path / "line.toml", loop_scenes.driven(data, loop_scenes.steady(0.0, 360.0)))
    equations = Nodal(build_mechanism(load_scene(path)).mechanism)
    assert np.abs(equations.system.constraint_rate(0.0, equations.system.start)).max() > 1.0
    assert dead_point(equations.system, 0.0, equations.system.start) is None

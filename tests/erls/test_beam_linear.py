"""Beam elements whose places and turns are linear between their ends: energy, mass, derivatives, where they lead to;
elements that bend as exact beams do.
"""

from __future__ import annotations

from pathlib import Path

import nodal_cases
import numpy as np
import pytest

import erls
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.beam import Beam, Beams
from erls.equations.nodal.nodes import Nodes
from erls.errors import SceneError
from erls.maths import motion_maps as motions
from erls.maths.saddle import dense
from erls.maths.so3 import Array

DATA = Path(__file__).parents[2] / "data"
ROBOT = DATA / "optimization" / "two_link.toml"


def system(gravity: Array) -> NodalSystem:
    """Two bent beams whose sections have frames of their own."""
    rng = np.random.default_rng(5)
    poses = motions.exp(0.6 * rng.standard_normal((3, 6)))
    ends = motions.exp(0.4 * rng.standard_normal((2, 2, 6)))
    inertia = np.diag([2.0, 2.0, 2.0, 0.7, 0.3, 0.4])
    sections = [nodal_cases.section(rng) for _ in range(2)]
    beams = [
        Beam((k, k + 1), poses[k : k + 2] @ ends[k], type(sections[k])(sections[k].stiffness, inertia), linear=True)
        for k in range(2)
    ]
    return NodalSystem(poses, [Beams(beams, poses, gravity)])


def moved(known: NodalSystem) -> tuple[Nodes, Array, Array]:
    rng = np.random.default_rng(6)
    q = known.compose(known.start, 0.2 * rng.standard_normal(known.size))
    return q, rng.standard_normal(known.size), rng.standard_normal(known.size)


def test_power_is_the_rate_of_energy() -> None:
    known = system(nodal_cases.WEIGHT)
    q, v, a = moved(known)
    h = 1e-5
    ends = [known.energy(0.0, known.compose(q, s * h * v + h * h * a / 2), v + s * h * a) for s in (1, -1)]
    rate = (sum(ends[0]) - sum(ends[1])) / (2 * h)
    assert known.residual(0.0, q, v, a) @ v == pytest.approx(rate, rel=1e-8)


def test_tangents_are_those_of_the_forces() -> None:
    known = system(nodal_cases.WEIGHT)
    q, v, a = moved(known)
    stiffness, damping = (dense(x) for x in known.exact_stiffness_and_damping(0.0, q, v, a, np.zeros(0)))
    mass, h = dense(known.mass_matrix(0.0, q)), 1e-6
    for k, way in enumerate(np.eye(known.size)):
        turned = [known.residual(0.0, known.compose(q, s * h * way), v, a) for s in (1, -1)]
        pushed = [known.residual(0.0, q, v + s * h * way, a) for s in (1, -1)]
        pulled = [known.residual(0.0, q, v, a + s * h * way) for s in (1, -1)]
        for found, (above, below) in zip((stiffness, damping, mass), (turned, pushed, pulled), strict=True):
            assert found[:, k] == pytest.approx((above - below) / (2 * h), abs=2e-7 * np.abs(found).max())


def test_a_rod_that_turns_about_its_end() -> None:
    """m l²/3 + J: linear velocities are those of a rigid motion."""
    length, mass, polar = 0.7, 2.0, 0.3
    section = nodal_cases.section(np.random.default_rng(1))
    section = type(section)(section.stiffness, np.diag([mass, mass, mass, polar, polar, polar]) / length)
    frames = np.tile(np.eye(4), (2, 1, 1))
    frames[1, 0, 3] = length
    known = NodalSystem(frames, [Beams([Beam((0, 1), frames, section, linear=True)], frames, np.zeros(3))])
    v = np.array([0.0, 0, 0, 0, 0, 2.0, 0, 2.0 * length, 0, 0, 0, 2.0])
    assert known.energy(0.0, known.start, v)[0] == pytest.approx(2.0**2 / 2 * (mass * length**2 / 3 + polar), rel=1e-14)


def test_single_elements_bend_exactly() -> None:
    """F l³/(3 E I) of a cantilever, by one element; without the residual flexibility it deflects by 3/4 of that."""
    scene = DATA / "optimization" / "cantilever_scene.toml"
    near, far = (f"links.arm.model.sections.{name}.height=0.03" for name in ("near", "far"))
    exact = 10.0 * 1.0**3 / (3 * 2e11 * 0.005 * 0.03**3 / 12)
    whole = erls.simulate(erls.load_scene(scene, [near, far]), verdict=False)
    assert -whole.position("tip", 0.0)[2] == pytest.approx(exact, rel=1e-4)  # of it, the third order of the slope
    coarse = erls.load_scene(scene, [near, far, "simulation.residual_bending_flexibility=false"])
    sag = -erls.simulate(coarse, verdict=False).position("tip", 0.0)[2]
    assert sag == pytest.approx(exact * (1 - 1 / 4 / 2**2), rel=1e-4)


def test_both_interpolations_lead_to_the_same() -> None:
    """Differences of the two fall with the square of the elements' length."""
    apart = []
    for elements in (1, 2):
        ends = []
        for way in ("linear", "helicoidal"):
            changes = [f"simulation.elements_per_member={elements}", f'simulation.inertia_interpolation="{way}"']
            scene = erls.load_scene(ROBOT, [*changes, "simulation.duration=0.15"])
            run = erls.simulate(scene, verdict=False)
            ends.append(run.position("tip", np.linspace(0, 0.15, 31)))
        apart.append(float(np.abs(ends[0] - ends[1]).max()))
    assert apart[1] < apart[0] / 3
    assert apart[0] < 3e-5


@pytest.mark.parametrize("field", ["residual_bending_flexibility=true", 'inertia_interpolation="linear"'])
def test_modal_formulations_have_no_such_elements(field: str) -> None:
    with pytest.raises(SceneError, match="no elements of its own") as refusal:
        erls.load_scene(DATA / "robot" / "two_link.toml", [f"simulation.{field}"])
    assert refusal.value.where.endswith(f"simulation.{field.partition('=')[0]}")
    with pytest.raises(SceneError, match="unknown name"):
        erls.load_scene(ROBOT, ['simulation.inertia_interpolation="cubic"'])


def test_rotation_against_the_world_is_prescribed() -> None:
    """The second link's root turns as told, whatever the first one bends, by all formulations."""
    table = np.loadtxt(ROBOT.parent / "two_link_motion.csv", delimiter=",", skiprows=1)
    times, wanted = table[::25, 0], table[::25, 2]
    tips = []
    for formulation in ("nodal", "erls", "ffr"):
        plain = ["simulation.residual_bending_flexibility=false", 'simulation.inertia_interpolation="helicoidal"']
        if formulation == "nodal":
            plain = ["simulation.elements_per_member=3", "simulation.residual_bending_flexibility=true", plain[1]]
        scene = erls.load_scene(ROBOT, [*plain, f'simulation.formulation="{formulation}"'])
        run = erls.simulate(scene, verdict=False)
        turn = run.instants(times).link_axes(1)
        found = np.arctan2(turn[:, 1, 0], turn[:, 0, 0])
        assert found == pytest.approx(wanted, abs=1e-6 if formulation == "nodal" else 2e-6)
        assert run.loop_coordinate("turn", times) == pytest.approx(wanted, abs=1e-6)
        rigid = table[::25, 1] + wanted
        assert np.abs(run.joint_angle("elbow", times) - (rigid - 2 * table[::25, 1])).max() > 1e-4  # A bends
        tips.append(run.position("tip", times))
    for other in tips[1:]:
        assert np.abs(other - tips[0]).max() < 4e-6  # meshes and modes: of deflections of 0.7 mm


def test_a_planar_joint_takes_a_motion_alone() -> None:
    with pytest.raises(SceneError, match="no single coordinate"):
        erls.load_scene(ROBOT, ["loops.turn.stiffness=3.0"])
    with pytest.raises(SceneError, match="no single coordinate"):
        erls.load_scene(ROBOT, ['loops.turn.drive={type="torque", profiles=[]}'])


def test_changes_of_a_description() -> None:
    """A scene gives links other numbers than the file that they share; both ways to write it are one."""
    key = "links.forearm.model.sections.near.outer_diameter"
    scene = erls.load_scene(ROBOT, [f"{key}=0.03"])
    assert scene.record.links[1].changes == {"sections": {"near": {"outer_diameter": 0.03}}}
    same = erls.load_scene(ROBOT, ["links.forearm.changes.sections.near.outer_diameter=0.03"])
    assert same.record == scene.record
    run = erls.simulate(erls.load_scene(ROBOT, [f"{key}=0.03", "simulation.duration=0.001"]), verdict=False)
    links = run.formulation.mechanism.links
    masses = [link.model.mass_properties.mass for link in links]
    assert masses[0] - masses[1] == pytest.approx(229.02 * (0.05**2 - 0.03**2), rel=1e-4)
    with pytest.raises(Exception, match="positive"):
        erls.simulate(erls.load_scene(ROBOT, [f"{key}=-0.03"]))
    with pytest.raises(SceneError, match="said by 'reduction'"):
        erls.load_scene(ROBOT, ['links.forearm.changes.reduction.method="guyan"'])
    rigid = 'links.forearm={name="forearm", rigid={mass=1.0, points={root=[0,0,0], tip=[0.6,0,0]}}, changes={a=1}}'
    with pytest.raises(SceneError, match="this link names none"):
        erls.load_scene(ROBOT, [rigid])

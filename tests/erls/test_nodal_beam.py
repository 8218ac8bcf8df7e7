"""The geometrically exact beam: statics against published figures and closed forms, objectivity, inertia."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.beam import Beam, Beams, lumped, straight
from erls.equations.nodal.joints import GROUND, Joint
from erls.equations.nodal.loads import NodalLoad, NodalLoads
from erls.equations.nodal.rigid_body import RigidBodies, RigidBody
from erls.equations.nodal.section import BeamSection, beam_section
from erls.equations.nodal.statics import Statics, solve_statics
from erls.errors import Cause, SceneError
from erls.maths import motion_maps as motions
from erls.maths.se3 import pose
from erls.maths.so3 import Array, fixed_axes, rotation_z

UP = np.array([0.0, 0.0, 1.0])
NONE = np.zeros(3)
SOFT = beam_section(1e4, (5e3, 4e3), 8.0, (10.0, 12.0), 0.6, (2e-3, 3e-3))


def _clamped(points: Array, section: BeamSection, load: NodalLoad, world: Array | None = None) -> NodalSystem:
    """Straight elements between points (k, 3), the first node clamped; all of it moved to ``world``."""
    world = np.eye(4) if world is None else world
    poses = np.array([world @ pose(position=x) for x in points])
    places, up = poses[:, :3, 3], world[:3, :3] @ UP
    beams = [straight((k, k + 1), places[k], places[k + 1], section, up) for k in range(len(points) - 1)]
    clamp = Joint("clamp", "fixed", GROUND, 0, poses[0])
    return NodalSystem(poses, [Beams(beams, poses, NONE), NodalLoads([load])], [clamp])


def _bend(elements: int, load: float, curved: bool = False) -> NodalSystem:
    """45° bend of radius 100 in the x-y plane, E = 1e7, ν = 0, 1x1, shear factor 1, GJ = G/6; load along z."""
    angles = np.linspace(0, np.pi / 4, elements + 1)
    points = 100 * np.stack([np.sin(angles), 1 - np.cos(angles), 0 * angles], axis=1)
    section = beam_section(1e7, (5e6, 5e6), 5e6 / 6, (1e7 / 12, 1e7 / 12))
    force = NodalLoad(elements, np.array([0, 0, load]))
    if not curved:
        return _clamped(points, section, force)
    frames = np.array([pose(rotation_z(a), x) for a, x in zip(angles, points, strict=True)])
    poses = np.array([pose(position=x) for x in points])
    beams = [Beam((k, k + 1), frames[k : k + 2], section) for k in range(elements)]
    clamp = Joint("clamp", "fixed", GROUND, 0)
    return NodalSystem(poses, [Beams(beams, poses, NONE), NodalLoads([force])], [clamp])


def _tip(found: Statics) -> Array:
    assert found.failure is None
    result: Array = found.path[-1].q.poses[-1, :3, 3]
    return result


# load, tangent, load steps, iterations at most: a tenth more than was needed (with one step and the full tangent none)
BENDS = [
    (300.0, "full", 1, 8),
    (300.0, "full", 6, 38),
    (300.0, "material", 1, 18),
    (600.0, "full", 1, 9),
    (600.0, "full", 6, 38),
    (600.0, "material", 1, 22),
    (600.0, "material", 6, 97),
]
SLIDE = {300.0: (58.84, 22.30, 40.03), 600.0: (47.23, 15.76, 53.28)}
CONVERGED = {300.0: (58.780, 22.245, 40.190), 600.0: (47.152, 15.685, 53.473)}


@pytest.mark.parametrize(("load", "tangent", "steps", "iterations"), BENDS)
def test_bend_with_eight_chord_elements(load: float, tangent: str, steps: int, iterations: int) -> None:
    """The published figures to their digits, with each tangent; publication: 9 and 14 iterations."""
    system = _bend(8, load)
    found = solve_statics(system, system.start, steps, tangent)
    np.testing.assert_allclose(_tip(found), SLIDE[load], atol=0.01)
    assert sum(e.iterations for e in found.path) <= iterations


def test_bend_with_a_frozen_tangent() -> None:
    """One factorization for each load step, halved where it must be; the same equilibrium."""
    system = _bend(8, 30.0)
    found = solve_statics(system, system.start, 1, "frozen")
    exact = solve_statics(system, system.start, 1, "material")
    np.testing.assert_allclose(_tip(found), _tip(exact), atol=1e-8)
    assert found.factorizations < sum(e.iterations for e in found.path) / 5


@pytest.mark.parametrize("load", CONVERGED)
@pytest.mark.parametrize("curved", [False, True])
def test_bend_converges_with_second_order(load: float, curved: bool) -> None:
    """64 chords or arcs against converged figures, within 1e-3 and half of their last digit."""
    tips = []
    for elements in (16, 32, 64):
        system = _bend(elements, load, curved)
        tips.append(_tip(solve_statics(system, system.start, 3, "material")))
    np.testing.assert_allclose(tips[2], CONVERGED[load], atol=1.5e-3)
    order = np.log2(np.linalg.norm(tips[1] - tips[0]) / np.linalg.norm(tips[2] - tips[1]))
    assert order == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(("elements", "tangent"), [(3, "material"), (4, "material"), (8, "material")])
def test_roll_up_to_two_full_turns(elements: int, tangent: str) -> None:
    """A cantilever under an end moment 4π EI/L closes twice, exactly; with 3 elements each turns by 240°."""
    points = np.linspace(0, 10.0, elements + 1)[:, None] * np.array([1.0, 0, 0])
    moment = NodalLoad(elements, moment=np.array([0, 0, 4 * np.pi * 12.0 / 10]), follower=True)
    system = _clamped(points, SOFT, moment)
    found = solve_statics(system, system.start, 8, tangent)
    np.testing.assert_allclose(_tip(found), 0, atol=1e-10)
    beams: Any = system.elements[0]
    np.testing.assert_allclose(beams.strains(found.path[-1].q.bent)[:, 5], 4 * np.pi / 10, rtol=1e-12)
    half = found.path[3].q.poses[:, :3, 3]  # one turn: a circle of radius 10/(2π)
    radii = np.linalg.norm(half - [0, 10 / (2 * np.pi), 0], axis=1)
    np.testing.assert_allclose(radii, 10 / (2 * np.pi), rtol=1e-11)


@pytest.mark.parametrize(("direction", "expected"), [(1, 1.754e-3), (2, 5.424e-3)])
def test_twisted_beam(direction: int, expected: float) -> None:
    """MacNeal and Harder (1985), thick: L = 12, 1.1x0.32, E = 29e6, ν = .22, a quarter turn; 1 %."""
    width, thick, e = 1.1, 0.32, 29e6
    g = e / 2.44
    torsion = thick**3 * width * (1 / 3 - 0.21 * thick / width * (1 - (thick / width) ** 4 / 12))
    bending = e * width * thick**3 / 12, e * thick * width**3 / 12
    section = beam_section(e * width * thick, (5 / 6 * g * width * thick,) * 2, g * torsion, bending)
    count = 24
    turned_x = [fixed_axes(a, 0, 0) for a in np.linspace(0, np.pi / 2, count + 1)]
    frames = np.array([pose(r, [x, 0, 0]) for r, x in zip(turned_x, np.linspace(0, 12, count + 1), strict=True)])
    beams = [Beam((k, k + 1), frames[k : k + 2], section) for k in range(count)]
    load = NodalLoad(count, np.eye(3)[direction])
    clamp = Joint("clamp", "fixed", GROUND, 0)
    system = NodalSystem(frames, [Beams(beams, frames, NONE), NodalLoads([load])], [clamp])
    moved = _tip(solve_statics(system, system.start)) - [12, 0, 0]
    assert moved[direction] == pytest.approx(expected, rel=0.01)


def test_small_loads_give_the_linear_cantilever() -> None:
    """Straight and kinked: P L³/(3EI) + P L/(kGA), less the P L³/(12EI n²) that n constant curvatures miss."""
    load = NodalLoad(16, np.array([0, 1e-6, 0]))
    points = np.linspace(0, 2.0, 17)[:, None] * np.array([1.0, 0, 0])
    system = _clamped(points, SOFT, load)
    exact = 1e-6 * (8 / (3 * 12.0) * (1 - 1 / (4 * 256)) + 2 / 5e3)
    assert _tip(solve_statics(system, system.start))[1] == pytest.approx(exact, rel=1e-6)
    kink = np.concatenate([points[:9], points[8] + np.linspace(0, 1.0, 9)[1:, None] * np.array([0, 1.0, 0])])
    system = _clamped(kink, SOFT, NodalLoad(16, np.array([0, 0, 1e-6])))
    # out of plane: two bent legs of 1 m and the twist of the first
    bent = 2 * (1 / 3 * (1 - 1 / 256) / 10.0 + 1 / 4e3)
    assert _tip(solve_statics(system, system.start))[2] == pytest.approx(1e-6 * (bent + 1 / 8.0), rel=1e-5)


def test_rigid_motions_leave_strains_at_rounding_level() -> None:
    """Objectivity, and a turned world bends alike."""
    angles = np.linspace(0, 1.0, 7)
    points = 3 * np.stack([np.sin(angles), 1 - np.cos(angles), 0.2 * angles**2], axis=1)
    world = motions.exp(np.array([3.0, -4.0, 5.0, 1.0, -2.0, 0.7]))
    force, moment = np.array([0.3, -0.5, 0.8]), np.array([0.2, 0.1, -0.4])
    here = _clamped(points, SOFT, NodalLoad(6, force, moment))
    there = _clamped(points, SOFT, NodalLoad(6, world[:3, :3] @ force, world[:3, :3] @ moment), world)
    beams: Any = here.elements[0]
    moved = here.at(world @ here.start.poses)
    assert np.abs(beams.strains(moved.bent)).max() < 1e-13
    tips = [_tip(solve_statics(s, s.start)) for s in (here, there)]
    assert np.linalg.norm(tips[0] - points[-1]) > 0.3
    np.testing.assert_allclose(world[:3, :3] @ tips[0] + world[:3, 3], tips[1], atol=1e-9)


def _random_elements(kind: str, seed: int, weight: bool = True) -> tuple[NodalSystem, Array]:
    """Two curved, twisted elements that meet at an angle, far from rest, and other elements on their nodes."""
    rng = np.random.default_rng(seed)
    poses = motions.exp(rng.standard_normal((3, 6)))
    frames = motions.exp(0.7 * rng.standard_normal((2, 2, 6)))
    root = rng.standard_normal((6, 6))
    section = BeamSection(np.eye(6) + root @ root.T, SOFT.inertia)
    beams = [Beam((k, k + 1), poses[k : k + 2] @ frames[k], section) for k in (0, 1)]
    gravity = rng.standard_normal(3)
    loads = [NodalLoad(k, *rng.standard_normal((2, 3)), follower=k == 1) for k in range(3)]
    table: dict[str, Any] = {
        "beams": lambda: Beams(beams, poses, gravity if weight else NONE),
        "loads": lambda: NodalLoads(loads),
        "bodies": lambda: RigidBodies(
            [RigidBody(k, 1.0, np.eye(3), rng.standard_normal(3)) for k in range(3)], gravity
        ),
    }
    system = NodalSystem(poses, [table[kind]()])
    return system, poses @ motions.exp(0.4 * rng.standard_normal((3, 6)))


@pytest.mark.parametrize("kind", ["beams", "loads", "bodies"])
def test_exact_tangents_of_all_elements(kind: str) -> None:
    """At rest: central differences with step 1e-5; beams without weight, which moves as they bend."""
    system, poses = _random_elements(kind, 2, weight=kind != "beams")
    q, rest, e, t = system.at(poses), np.zeros(18), 1e-5, 0.8
    stiffness, _ = system.stiffness_and_damping(t, q, rest, rest, np.zeros(0))
    size = max(1.0, np.abs(np.asarray(stiffness)).max())
    for k in range(18):
        d = np.eye(18)[k] * e
        change = system.residual(t, system.compose(q, d), rest, rest) - system.residual(
            t, system.compose(q, -d), rest, rest
        )
        np.testing.assert_allclose(np.asarray(stiffness)[:, k], change / (2 * e), atol=1e-8 * size)


def test_material_tangent_is_symmetric_and_exact_without_stress() -> None:
    system, _ = _random_elements("beams", 3)
    rest = np.zeros(18)
    full, material = (
        np.asarray(system.stiffness_and_damping(0, system.start, rest, rest, np.zeros(0), material=m)[0])
        for m in (False, True)
    )
    beams: Any = system.elements[0]
    weightless = Beams([], system.start.poses, NONE)
    assert len(weightless.nodes) == 0
    turning = full - material
    assert np.abs(turning).max() < 1e-12 * np.abs(full).max()
    assert np.abs(beams.strains(system.start.bent)).max() == 0


def test_inertia_forces_follow_from_the_kinetic_energy() -> None:
    """Power of all forces is the rate of energy, M is what accelerations multiply, and a = 0 bias terms are exact."""
    system, poses = _random_elements("beams", 5)
    rng = np.random.default_rng(6)
    q, (v, a), e = system.at(poses), rng.standard_normal((2, 18)), 1e-5

    def at(s: float) -> float:
        return sum(system.energy(0.0, system.compose(q, s * v + s * s / 2 * a), v + s * a))

    power = v @ system.residual(0.0, q, v, a)
    assert power == pytest.approx((at(e) - at(-e)) / (2 * e), rel=1e-7)
    mass = np.asarray(system.mass_matrix(0.0, q))
    bias = system.residual(0.0, q, v, np.zeros(18))
    np.testing.assert_allclose(system.residual(0.0, q, v, a) - bias, mass @ a, atol=1e-12)
    assert v @ mass @ v / 2 == pytest.approx(system.energy(0.0, q, v)[0], rel=1e-13)


def test_lagrange_equations_of_the_deforming_beam() -> None:
    """d/dt ∂T/∂ν − ad(ν)ᵀ ∂T/∂ν − ∂T/∂q against the element's inertia: no part of Q̇ is missing."""
    system, poses = _random_elements("beams", 7)
    rng = np.random.default_rng(8)
    q, (v, a), e = system.at(poses), rng.standard_normal((2, 18)), 1e-5
    system.model.gravity[:] = 0.0

    def momentum(s: float) -> Array:
        moved = system.compose(q, s * v + s * s / 2 * a)
        result: Array = np.asarray(system.mass_matrix(0, moved)) @ (v + s * a)
        return result

    ad = motions.bracket(v.reshape(3, 6))
    expected = (momentum(e) - momentum(-e)) / (2 * e)
    expected -= (np.swapaxes(ad, 1, 2) @ momentum(0).reshape(3, 6, 1)).ravel()
    for k in range(18):
        d = np.eye(18)[k] * e
        lagrange = [t - u for t, u in (system.energy(0, system.compose(q, s * d), v) for s in (1, -1))]
        expected[k] -= (lagrange[0] - lagrange[1]) / (2 * e)
    np.testing.assert_allclose(system.residual(0, q, v, a), expected, atol=1e-7)


def test_rigid_rotation_has_the_kinetic_energy_of_the_rod() -> None:
    """A straight bar of one element about its end: ρA L³ ω²/6 + ρI_z L ω²/2, whatever its node frames."""
    turn = motions.poses(fixed_axes(0.3, -0.4, 0.5), np.zeros(3))
    poses = np.array([turn, pose(position=np.array([2.0, 0, 0])) @ turn])
    rod = [straight((0, 1), poses[0, :3, 3], poses[1, :3, 3], SOFT, UP)]
    omega = np.array([0, 0, 1.5])
    v = np.concatenate([np.concatenate([h[:3, :3].T @ np.cross(omega, h[:3, 3]), h[:3, :3].T @ omega]) for h in poses])
    consistent = NodalSystem(poses, [Beams(rod, poses, NONE)])
    expected = 0.6 * 8 * 1.5**2 / 6 + 3e-3 * 2 * 1.5**2 / 2
    assert consistent.energy(0.0, consistent.start, v)[0] == pytest.approx(expected, rel=1e-12)
    halves = NodalSystem(poses, [RigidBodies(lumped(rod, poses), NONE)])
    expected = 0.6 * 2.0 / 2 * 4 * 1.5**2 / 2 + 3e-3 * 2 * 1.5**2 / 2
    assert halves.energy(0.0, halves.start, v)[0] == pytest.approx(expected, rel=1e-12)


def test_no_equilibrium_is_reported_with_what_was_found() -> None:
    """A bar without support."""
    points = np.array([[0, 0, 0], [1.0, 0, 0]])
    system = _clamped(points, SOFT, NodalLoad(1, np.array([0, 1.0, 0])))
    loose = NodalSystem(system.start.poses, system.elements)
    found = solve_statics(loose, loose.start)
    assert found.failure is not None
    assert found.failure.cause is Cause.NO_EQUILIBRIUM
    assert found.path == ()


def test_faulty_beams() -> None:
    for make, field in (
        (lambda: straight((0, 1), np.zeros(3), np.array([0, 0, 1.0]), SOFT, UP), "up"),
        (lambda: straight((0, 1), np.zeros(3), np.zeros(3), SOFT, UP), "up"),
        (lambda: beam_section(1.0, (1.0, 0.0), 1.0, (1.0, 1.0)), "stiffness"),
        (lambda: beam_section(1.0, (1.0, 1.0), 1.0, (1.0, np.nan)), "stiffness"),
        (lambda: beam_section(1.0, (1.0, 1.0), 1.0, (1.0, 1.0), -1.0), "inertia"),
        (lambda: solve_statics(_bend(1, 1.0), _bend(1, 1.0).start, 1, "secant"), "tangent"),
    ):
        with pytest.raises(SceneError) as caught:
            make()
        assert caught.value.cause is Cause.BAD_FIELD
        assert caught.value.where.endswith(field)

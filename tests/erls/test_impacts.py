"""Impacts, sliding and stops: closed forms, momentum, energy, and agreement of formulations."""

from __future__ import annotations

from pathlib import Path

import loop_scenes
import numpy as np
import pytest
import scenes
from contact_scenes import MASS, STIFFNESS, G, falling, flexible, on_a_slope, pendulum, simulated, two_bodies

import erls
from erls.accuracy.audits import audits
from erls.accuracy.statement import stated
from erls.run.bodies.motion import BodyMotion

RESTITUTIONS = [0.0, 0.5, 0.9, 1.0]


@pytest.mark.parametrize("restitution", RESTITUTIONS)
def test_a_body_rebounds(tmp_path: Path, restitution: float) -> None:
    """Without gravity at e times its speed, to the 1e-4 that its steps leave; with e = 0 at less than 1e-3 m/s."""
    run = simulated(falling(tmp_path, restitution, 0.5, -2.0, 0.0))
    assert run.solution.v[-1, 0] / 2.0 == pytest.approx(restitution, abs=1e-4 if restitution else 5e-4)
    assert run.solution.work.steps < 200
    pressed = run.summary()["contacts"]["floor"]
    deepest = (MASS * 2.0**2 / 2 * 2.5 / (STIFFNESS * (1 + run.formulation.mechanism.contacts[0].law.loss))) ** 0.4
    assert pressed["least_gap"] == pytest.approx(-deepest, rel=1e-2)
    assert run.conservative == (restitution == 1.0)


@pytest.mark.parametrize("restitution", [0.5, 0.9, 1.0])
def test_a_bouncing_ball(tmp_path: Path, restitution: float) -> None:
    """Energies and heights of two bounces against the closed form with the weight within the contact,
    v₁² = e² v₀² - 2 g δ (1 - e²) at the depth δ where m v₀² / 2 + m g δ = (1 + d) k δⁿ⁺¹ / (n + 1); to 2e-4.
    """
    run = simulated(falling(tmp_path, restitution, 0.2, 0.0, G), "simulation.duration=1.3")
    law = run.formulation.mechanism.contacts[0].law
    t, speed = np.linspace(0.0, 1.3, 2001), np.sqrt(2 * G * 0.2)
    z, energy = run.position("centre", t)[:, 2], run.energy(t)
    assert energy.springs.min() == 0.0
    up = np.flatnonzero((z[:-1] < 0) & (z[1:] >= 0))
    down = np.flatnonzero((z[:-1] > 0) & (z[1:] <= 0))
    assert len(up) >= 2
    for bounce in range(2):
        depth = 0.0
        for _ in range(100):
            force = MASS * (speed**2 / 2 + G * depth)
            depth = (force * 2.5 / ((1 + law.loss) * STIFFNESS)) ** 0.4
        speed = np.sqrt(restitution**2 * speed**2 - 2 * G * depth * (1 - restitution**2))
        flight = t[up[bounce] + 1] + 1e-3
        assert run.energy(flight).total == pytest.approx(MASS * speed**2 / 2, rel=2e-4)
        after = z[up[bounce] : down[bounce + 1] if len(down) > bounce + 1 else None]
        if len(down) > bounce + 1:
            assert after.max() == pytest.approx(speed**2 / (2 * G), rel=2e-4)


def test_a_ball_comes_to_rest(tmp_path: Path) -> None:
    """After many bounces, on the depth that bears its weight; few steps are made then."""
    run = simulated(falling(tmp_path, 0.5, 0.1, 0.0, G), "simulation.duration=5.0")
    depth = (MASS * G / STIFFNESS) ** (1 / 1.5)
    assert run.position("centre", 5.0)[2] == pytest.approx(-depth, rel=1e-4)
    assert np.count_nonzero(run.solution.t > 1.0) < 0.1 * len(run.solution.t)
    contact = run.contact("floor", [0.0, 5.0])
    assert contact.normal_force == pytest.approx([0.0, MASS * G], rel=1e-4)
    assert contact.force[1] == pytest.approx([0.0, 0.0, MASS * G], rel=1e-4)
    assert contact.gap == pytest.approx([0.1, -depth], rel=1e-4)
    columns = run.columns(np.array([0.0, 5.0]))
    assert columns["floor.gap [m]"][1] == contact.gap[1]
    assert columns["floor.force.z [N]"][1] == contact.force[1, 2]
    assert run.curves(np.array([5.0]))["contacts/floor/force"].values.shape == (1, 3)


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_stated_error_holds(tmp_path: Path, restitution: float) -> None:
    """Of tolerances from 1e-3 m: the run differs from one at 1e-9 m by less than it states; audits find nothing."""
    path, t = falling(tmp_path, restitution, 0.3, 0.0, G), np.linspace(0.0, 1.0, 201)
    best = simulated(path, "simulation.tolerance=1e-9").position("centre", t)
    for changes in (["simulation.tolerance=1e-3"], ["simulation.tolerance=1e-5"], ["simulation.step=2e-4"]):
        if "step" in changes[0]:
            changes.append("simulation.integrator=generalized_alpha")
        run = simulated(path, *changes, verdict=True)
        off = float(np.abs(run.position("centre", t) - best).max())
        assert run.accuracy is not None
        assert run.accuracy.integration is not None
        assert off <= run.accuracy.integration
        assert off <= 1e-3
        assert all(audit.ok for audit in audits(run, run.accuracy.integration))


@pytest.mark.parametrize("formulation", ["erls", "ffr", "nodal", "absolute"])
def test_two_bodies_keep_their_momentum(tmp_path: Path, formulation: str) -> None:
    """2 kg m/s, to rounding, while they part at half of the speed at which they met."""
    fixed = formulation in ("nodal", "absolute")
    changes = ["simulation.step=2e-4"] if fixed else []
    named = {"absolute": ["simulation.formulation=ffr", "simulation.coordinates=absolute"]}
    run = simulated(two_bodies(tmp_path), *named.get(formulation, [f"simulation.formulation={formulation}"]), *changes)
    series = run.series(run.solution.t[:: max(1, len(run.solution.t) // 50)])
    first = series.rates[:, 0]
    second = first + series.rates[:, 1]
    np.testing.assert_allclose(2 * first + second, 2.0, atol=1e-10)
    assert second[-1] - first[-1] == pytest.approx(0.5, abs=2e-3 if fixed else 1e-4)


@pytest.mark.parametrize("formulation", ["erls", "nodal"])
def test_a_block_slides_down(tmp_path: Path, formulation: str) -> None:
    """By v₀ t + (sin α - µ cos α) g t² / 2 of a slope of 30 degrees, on the depth that bears it; to 1e-5."""
    slope, mu, speed = np.radians(30.0), 0.3, 1.0
    data = on_a_slope(30.0, speed, {"coefficient": mu, "transition_rate": 1e-3})
    changes = [f"simulation.formulation={formulation}", *(["simulation.step=1e-3"] if formulation == "nodal" else [])]
    run = simulated(scenes.write_toml(tmp_path / "slope.toml", data), *changes)
    slid = float(np.linalg.norm(np.diff(run.position("centre", [0.0, 0.5]), axis=0)))
    expected = speed * 0.5 + (np.sin(slope) - mu * np.cos(slope)) * G * 0.5**2 / 2
    assert slid == pytest.approx(expected, rel=1e-5)
    assert run.contact("slope", 0.5).normal_force == pytest.approx(MASS * G * np.cos(slope), rel=1e-4)
    assert any("at the start" in text for text in run.warnings)


KINDS: dict[str, list[str]] = {
    "erls": [],
    "minimum-norm": ["simulation.gauge=minimum-norm"],
    "ffr": ["simulation.formulation=ffr"],
    "nodal": ["simulation.formulation=nodal", "simulation.step=2e-4"],
    "generalized_alpha": ["simulation.integrator=generalized_alpha", "simulation.step=2e-4"],
}


@pytest.mark.parametrize("name", KINDS)
def test_a_joint_rebounds_from_its_stop(tmp_path: Path, name: str) -> None:
    """At half of its rate, wherever stops stand and whatever bears on; one stop is enough."""
    stops = {"upper_deg": 10.0, "stiffness": 2e4, "restitution": 0.5}
    run = simulated(pendulum(tmp_path, joint={"stops": stops}), *KINDS[name])
    fixed = name in ("nodal", "generalized_alpha")
    assert run.joint_rate("hinge", 0.6) == pytest.approx(-0.5, abs=2e-3 if fixed else 1e-4)
    assert run.energy(0.6).total == pytest.approx(0.25 * run.energy(0.0).total, rel=1e-2 if fixed else 1e-3)
    assert not run.conservative


def test_a_loop_meets_stops_and_a_plane(tmp_path: Path) -> None:
    """The rocker of a four-bar, and its coupler: ERLS and FFR within 1e-6 m, and audits find nothing."""
    data = loop_scenes.four_bar()
    stops = {"lower_deg": -25.0, "upper_deg": 30.0, "stiffness": 2e3, "restitution": 0.5}
    data["loops"] = [{**data["loops"][0], "stops": stops}]
    plane = {"normal": [0.0, 0.0, 1.0], "position": [0.0, 0.0, 0.2]}
    data["contacts"] = [{"name": "c", "point": "coupler middle", "plane": plane, "stiffness": 1e5, "restitution": 0.5}]
    runs = [loop_scenes.run(tmp_path, data, n, integrator="lobatto", duration=0.4) for n in ("erls", "ffr")]
    assert runs[0].contact("c", np.linspace(0.0, 0.4, 401)).gap.min() < 0.0
    times = np.linspace(0.0, 0.4, 9)
    one, other = (run.position("coupler tip", times) for run in runs)
    np.testing.assert_allclose(one, other, atol=1e-6)
    energy = runs[0].energy(times).total
    assert energy[-1] < 0.9 * energy[0]
    trust = stated(runs[0]).trust
    assert trust is not None
    assert trust.verdict != "broken"


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_a_rigid_link_hits_a_plane(tmp_path: Path, restitution: float) -> None:
    """Its tip meets a plane at a right angle: it turns back at e times its rate, whatever its inertia about the tip,
    to the square of the angle by which it presses in; its reaction gives what the plane does not.
    """
    plane = {"normal": [0.0, -1.0, 0.0], "position": [0.0, 0.1, 0.0]}
    contact = {"name": "wall", "point": "tip", "plane": plane, "stiffness": 1e7, "restitution": restitution}
    run = simulated(pendulum(tmp_path, contacts=[contact]))
    assert run.joint_rate("hinge", 0.6) == pytest.approx(-restitution, abs=3e-4)
    t = np.linspace(0.0, 0.6, 20001)
    force = run.contact("wall", t).force
    impulse = np.trapezoid(force[:, 1], t)
    inertia = 0.1 + 0.5**2
    assert impulse * np.cos(0.1) == pytest.approx(-(1 + restitution) * inertia, rel=1e-2)


def test_a_flexible_link_hits_a_plane(tmp_path: Path) -> None:
    """ERLS, FFR within 1e-5 m of each other, nodal elements, which have all modes, within 2e-4 m; energies are balanced
    by what the contact lost.
    """
    path = flexible(tmp_path)
    runs = [
        simulated(path, f"simulation.formulation={name}", *more, verdict=name == "erls")
        for name, more in (("erls", []), ("ffr", []), ("nodal", ["simulation.step=1e-4"]))
    ]
    times = np.linspace(0.08, 0.12, 9)
    one, other, third = (run.position("tip", times) for run in runs)
    assert runs[0].contact("floor", times).gap.min() < -1e-3
    np.testing.assert_allclose(other, one, atol=1e-5)
    np.testing.assert_allclose(third, one, atol=2e-4)
    pieces = simulated(path, "simulation.formulation=ffr", "links.a.substructures=2").position("tip", times)
    np.testing.assert_allclose(pieces, one, atol=1e-3)  # as far as each piece deflects beyond its own modes
    run = runs[0]
    assert run.accuracy is not None
    assert all(audit.ok for audit in audits(run, run.accuracy.integration))
    assert run.energy(0.12).total < run.energy(0.0).total - 1e-3


@pytest.mark.parametrize("group", ["SE(3)", "R3xSO(3)"])
def test_two_free_bodies_collide(tmp_path: Path, group: str) -> None:
    """A body that flies and spins meets one at rest, beside its centre of mass, with friction: momentum stays, in axes
    of the world to 1e-9, and in those of the bodies, like the angular one about the origin, to the 1e-5 that steps of
    second order leave; energy is lost.
    """
    first = {"name": "a", "mass": 2.0, "inertia": [0.1, 0.2, 0.3], "velocity": [1.0, 0.1, 0.0]}
    second = {"name": "b", "mass": 1.0, "inertia": [0.05, 0.02, 0.04], "position": [0.3, 0.05, 0.02]}
    plane = {"on": "b", "normal": [-1.0, 0.1, 0.0], "position": [0.2, 0.05, 0.02]}
    law = {"stiffness": 1e4, "restitution": 0.5, "exponent": 1.0, "friction": {"coefficient": 0.3}}
    path = scenes.write_toml(
        tmp_path / "bodies.toml",
        {
            "gravity": [0.0, 0.0, 0.0],
            "simulation": {"type": "dynamics", "duration": 0.3, "step": 2e-4, "group": group},
            "bodies": [{**first, "angular_velocity": [0.0, 0.5, 2.0]}, second],
            "contacts": [{"name": "bump", "node": "a", "plane": plane, **law}],
        },
    )
    run = erls.simulate(path)
    assert isinstance(run, BodyMotion)
    masses, inertias = np.array([2.0, 1.0]), (np.diag([0.1, 0.2, 0.3]), np.diag([0.05, 0.02, 0.04]))
    momenta = []
    for t in (0.0, 0.2, 0.25, 0.3):
        poses, v = run.poses([t])[0], run.velocities(np.array([t])).reshape(2, 6)
        turns, spins = poses[:, :3, :3], v[:, 3:]
        speeds = v[:, :3] if group != "SE(3)" else np.einsum("kij,kj->ki", turns, v[:, :3])
        linear = masses[:, None] * speeds
        angular = [turn @ inertia @ spin for turn, inertia, spin in zip(turns, inertias, spins, strict=True)]
        momenta.append([linear.sum(axis=0), np.sum(angular + np.cross(poses[:, :3, 3], linear), axis=0)])
    moved = np.abs(np.array(momenta) - momenta[0]).max(axis=(0, 2))
    assert moved[0] < (1e-5 if group == "SE(3)" else 1e-9)
    assert moved[1] < 1e-5
    contact = run.contact("bump", [0.0, 0.3])
    assert contact.gap[0] > 0.19
    assert contact.gap[1] > 0.0
    assert run.contact("bump", np.linspace(0.0, 0.3, 301)).normal_force.max() > 10.0
    kinetic, potential = run.energy([0.0, 0.3])
    assert kinetic[1] < 0.95 * kinetic[0]
    assert potential[1] == 0.0
    assert not run.conservative
    assert "bump.normal_force [N]" in run.columns(np.array([0.0, 0.3]))

"""Contacts and stops: the law against its closed form, rebounds, impacts, sliding, and agreement of formulations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import loop_scenes
import numpy as np
import pytest
import scenes
from scipy.integrate import quad

import erls
from erls.accuracy.audits import audits
from erls.equations.erls.formulation import Erls
from erls.equations.erls.paper.dense_chain import DenseChain
from erls.equations.ffr.formulation import Ffr
from erls.equations.nodal.equations import Nodal
from erls.errors import SceneError
from erls.integrate.base import Solution, Work
from erls.maths import contact_law
from erls.maths.jit import plain
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.contacts import ContactLaw
from erls.run.chain.run import ChainRun
from erls.run.watches.touching import passed_over
from erls.scene.build import build_mechanism
from erls.scene.read import load_scene

RESTITUTIONS = [0.0, 0.5, 0.9, 1.0]
SOFT = {"stiffness": 1e4, "restitution": 0.5, "transition_rate": 50.0}
TREES: dict[str, Callable[[Mechanism], Any]] = {
    "erls": Erls,
    "minimum-norm": DenseChain,
    "ffr": Ffr,
    "mean-axis": lambda mechanism: Ffr(mechanism, "mean-axis"),
}
G, MASS, STIFFNESS = 9.81, 2.0, 1e7
BALL = {"mass": MASS, "inertia": [0.1, 0.1, 0.1], "points": {"centre": [0.0, 0.0, 0.0], "side": [1.0, 0.0, 0.0]}}


def _simulate(path: Path, *changes: str, verdict: bool = False) -> ChainRun:
    run = erls.simulate(load_scene(path, list(changes)), verdict=verdict)
    assert isinstance(run, ChainRun)
    return run


def _falling(folder: Path, restitution: float, position: float, rate: float, gravity: float, **more: Any) -> Path:
    """A body that moves along z above the ground."""
    start = {"position": position, "rate": rate}
    law = {"stiffness": STIFFNESS, "restitution": restitution}
    return scenes.write_toml(
        folder / "ball.toml",
        {
            "gravity": [0.0, 0.0, -gravity],
            "simulation": {"duration": 1.0},
            "joints": [{"name": "fall", "type": "prismatic", "dh": {"convention": "standard"}, "initial": start}],
            "links": [{"name": "ball", "rigid": BALL}],
            "points": [{"name": "centre", "link": "ball", "node": "centre"}],
            "contacts": [{"name": "floor", "point": "centre", "plane": {"normal": [0.0, 0.0, 2.0]}, **law, **more}],
        },
    )


@pytest.mark.parametrize("restitution", RESTITUTIONS)
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_law(restitution: float, exponent: float) -> None:
    """∫ v dv / g of speeds before and after an impact are the same, but for (w / v₀)² = 1e-8; gains and energy are
    derivatives and integral of the force (differences: 1e-6); nothing pulls.
    """
    law, w = ContactLaw(3e4, exponent, restitution, 1e-4), 1e-4
    numbers = law.numbers
    force, gains = plain(contact_law.contact_force), plain(contact_law.contact_gains)

    def weighed(speed: float, way: float) -> float:
        found = quad(lambda v: v * law.stiffness / force(numbers, 1.0, way * v), 0.0, speed, points=[w], epsabs=1e-13)
        return float(found[0])

    if restitution:
        assert weighed(1.0, 1.0) == pytest.approx(weighed(restitution, -1.0), rel=3e-8)
    else:
        assert force(numbers, 1.0, -w) == 0.0
    for depth, speed in ((0.01, 0.4 * w), (0.02, -0.7 * w), (0.005, 3 * w)):
        stiffness, damping = gains(numbers, depth, speed)
        d, s = 1e-6 * depth, 1e-6 * w
        slope = (force(numbers, depth + d, speed) - force(numbers, depth - d, speed)) / (2 * d)
        assert stiffness == pytest.approx(slope, rel=1e-6)
        slope = (force(numbers, depth, speed + s) - force(numbers, depth, speed - s)) / (2 * s)
        assert damping == pytest.approx(slope, rel=1e-6, abs=1e-6 * law.stiffness * depth)
        elastic, energy = plain(contact_law.elastic_force), plain(contact_law.contact_energy)
        slope = (energy(numbers, depth + d) - energy(numbers, depth - d)) / (2 * d)
        assert elastic(numbers, depth) == pytest.approx(slope, rel=1e-6)
    assert force(numbers, -1e-3, 1.0) == force(numbers, 1e-3, -10.0) * 0.0 == 0.0
    assert all(force(numbers, 1e-3, x) >= 0.0 for x in np.linspace(-2 * w, 2 * w, 41))


def test_friction_is_smooth() -> None:
    """tanh(x) / x and its derivative over x, by x: series and closed form meet to 1e-9, and agree with differences."""
    factor = plain(contact_law.friction_factor)
    for x in (0.009, 0.011, 0.3, 2.0, 19.0, 21.0, 500.0):
        value, slope = factor(x * x)
        assert value == pytest.approx(np.tanh(x) / x, rel=1e-9)
        step = 1e-4 * x
        ahead, behind = (np.tanh(y) / y for y in (x + step, x - step))
        assert slope * x == pytest.approx((ahead - behind) / (2 * step), rel=1e-6, abs=1e-11)


def _three(folder: Path, effects: str, contacts: list[dict[str, Any]]) -> Mechanism:
    points = [{"name": n, "link": link, "node": "tip"} for n, link in (("end", "c"), ("middle", "b"), ("first", "a"))]
    path = scenes.three_links(folder, points=points, contacts=contacts, simulation={"effects": effects})
    return build_mechanism(load_scene(path)).mechanism


CONTACTS = [
    {"name": "floor", "point": "end", "plane": {"normal": [0.1, 0.2, 1.0], "position": [0.0, 0.0, 9.0]}},
    {"name": "link", "point": "end", "plane": {"on": "a", "normal": [0.3, -1.0, 0.2], "position": [9.0, -9.0, 3.0]}},
    {
        "name": "node",
        "point": "middle",
        "plane": {"on": "a", "point": "first", "normal": [0.3, 1.0, 0.2], "position": [9.0, 9.0, 3.0]},
    },
]


@pytest.mark.parametrize("effects", ["linear", "all"])
@pytest.mark.parametrize("name", TREES)
def test_power_of_contacts(tmp_path: Path, name: str, effects: str) -> None:
    """What contacts take from the residual is, times the rates, their loss less the change of their elastic energy;
    gaps change at the rate that is told; without friction the damping is that of the residual (differences: 1e-6).
    """
    friction = {"friction": {"coefficient": 0.4, "transition_rate": 3.0}}
    for more in (friction, {}):
        equations = TREES[name](_three(tmp_path, effects, [{**c, **SOFT, **more} for c in CONTACTS]))
        bare = TREES[name](replace(equations.mechanism, contacts=()))
        rng = np.random.default_rng(7)
        y, v, a = rng.standard_normal((3, equations.size))
        free = len(equations.free_joints)
        y[free:] *= 2e-3
        v[free:] *= 0.1
        found = equations.contact_series(np.zeros(1), y[None], v[None])
        assert (found.gap < -1.0).all()
        assert (np.linalg.norm(found.force, axis=2) >= found.normal_force * (1 - 1e-12)).all()
        ways = np.array([y + 1e-6 * v, y - 1e-6 * v])
        ends = equations.contact_series(np.zeros(2), ways, np.array([v, v]))
        assert found.rate[0] == pytest.approx((ends.gap[0] - ends.gap[1]) / 2e-6, rel=1e-6)
        stored = (ends.energy[0] - ends.energy[1]).sum() / 2e-6
        taken = v @ (bare.residual(0.0, y, v, a) - equations.residual(0.0, y, v, a))
        lost = equations.load_power(np.zeros(1), y[None], v[None])[0]
        assert lost < -1e5
        assert taken == pytest.approx(lost - stored, rel=1e-7)

    def off(rates: Array) -> Array:
        return np.asarray(equations.residual(0.0, y, rates, a) - bare.residual(0.0, y, rates, a))

    slopes = [(off(v + step) - off(v - step)) / 2e-5 for step in 1e-5 * np.eye(equations.size)]
    damping = equations.stiffness_and_damping(0.0, y, v)[1] - bare.stiffness_and_damping(0.0, y, v)[1]
    np.testing.assert_allclose(damping, np.transpose(slopes), atol=1e-6 * np.abs(damping).max())


def test_power_of_contacts_on_nodes(tmp_path: Path) -> None:
    """The same of the nodal formulation, against the ground and a flexible link; without friction its damping is that
    of the residual (differences: 1e-6).
    """
    rigid = {"mass": 1.0, "points": {"root": [0, 0, 0], "tip": [0.3, 0.1, 0.0], "side": [0.1, 0.3, 0.2]}}
    points = [*scenes.L_SCENE["points"], {"name": "side", "link": "r", "node": "side"}]
    second = {"name": "wrist", "dh": {"convention": "standard", "alpha_deg": 30.0}}
    scenes.l_link(tmp_path)

    def system(contacts: list[dict[str, Any]]) -> Any:
        path = scenes.l_scene(
            tmp_path,
            joints=[*scenes.L_SCENE["joints"], second],
            links=[*scenes.L_SCENE["links"], {"name": "r", "rigid": rigid}],
            points=points,
            contacts=contacts,
        )
        return Nodal(build_mechanism(load_scene(path)).mechanism)

    equations, arm = system([]), [3.0, 3.0, 0.0]
    q, v = equations.system.start, np.random.default_rng(3).standard_normal(equations.system.size)
    still = np.zeros_like(v)
    planes = [
        {"normal": [0.0, 0.3, 1.0], "position": [0.0, 0.0, 5.0]},
        {"on": "l", "point": "elbow", "normal": [1.0, 2.0, 0.0], "position": arm},
    ]
    contacts = [{"name": str(k), "point": "side", "plane": plane, **SOFT} for k, plane in enumerate(planes)]
    own, bare = system(contacts).system, equations.system
    known = own.in_contacts(q, v)
    assert (known[:, 0] < 0).all()
    ends = [own.in_contacts(own.compose(q, way * v), v) for way in (1e-6, -1e-6)]
    taken = v @ (bare.residual(0.0, q, v, still) - own.residual(0.0, q, v, still))
    stored = (ends[0] - ends[1])[:, 9].sum() / 2e-6
    assert taken == pytest.approx(known[:, 10].sum() - stored, rel=1e-6)

    def off(rates: Array) -> Array:
        return np.asarray(own.residual(0.0, q, rates, still) - bare.residual(0.0, q, rates, still))

    slopes = [(off(v + step) - off(v - step)) / 2e-5 for step in 1e-5 * np.eye(len(v))]
    none = np.zeros(own.constraints)
    found, less = (x.stiffness_and_damping(0.0, q, v, still, none)[1] for x in (own, bare))
    np.testing.assert_allclose(found - less, np.transpose(slopes), atol=1e-6 * np.abs(slopes).max())


@pytest.mark.parametrize("restitution", RESTITUTIONS)
def test_a_body_rebounds(tmp_path: Path, restitution: float) -> None:
    """Without gravity at e times its speed, to the 1e-4 that its steps leave; with e = 0 at less than 1e-3 m/s."""
    run = _simulate(_falling(tmp_path, restitution, 0.5, -2.0, 0.0))
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
    run = _simulate(_falling(tmp_path, restitution, 0.2, 0.0, G), "simulation.duration=1.3")
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
    run = _simulate(_falling(tmp_path, 0.5, 0.1, 0.0, G), "simulation.duration=5.0")
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
    path, t = _falling(tmp_path, restitution, 0.3, 0.0, G), np.linspace(0.0, 1.0, 201)
    best = _simulate(path, "simulation.tolerance=1e-9").position("centre", t)
    for changes in (["simulation.tolerance=1e-3"], ["simulation.tolerance=1e-5"], ["simulation.step=2e-4"]):
        if "step" in changes[0]:
            changes.append("simulation.integrator=generalized_alpha")
        run = _simulate(path, *changes, verdict=True)
        off = float(np.abs(run.position("centre", t) - best).max())
        assert run.accuracy is not None
        assert run.accuracy.integration is not None
        assert off <= run.accuracy.integration
        assert off <= 1e-3
        assert all(audit.ok for audit in audits(run, run.accuracy.integration))


def _two_bodies(folder: Path, **more: Any) -> Path:
    """A body of 2 kg that moves along x at 1 m/s towards one of 1 kg at rest, half a metre ahead."""
    slide = {"type": "prismatic", "dh": {"convention": "standard"}}
    first = {"name": "first", **slide, "branch": {"rotation_deg": [0.0, 90.0, 0.0]}, "initial": {"rate": 1.0}}
    second = {"name": "second", **slide, "initial": {"position": 0.5, "rate": -1.0}}
    plane = {"on": "b", "normal": [0.0, 0.0, -1.0], "position": [0.0, 0.0, -0.1]}
    return scenes.write_toml(
        folder / "two.toml",
        {
            "gravity": [0.0, 0.0, 0.0],
            "simulation": {"duration": 0.8},
            "joints": [first, second],
            "links": [{"name": "a", "rigid": BALL}, {"name": "b", "rigid": {**BALL, "mass": 1.0}}],
            "points": [{"name": x, "link": x, "node": "centre"} for x in "ab"],
            "contacts": [{"name": "bump", "point": "a", "plane": plane, "stiffness": 1e6, "restitution": 0.5, **more}],
        },
    )


@pytest.mark.parametrize("formulation", ["erls", "ffr", "nodal"])
def test_two_bodies_keep_their_momentum(tmp_path: Path, formulation: str) -> None:
    """2 kg m/s, to rounding, while they part at half of the speed at which they met."""
    changes = ["simulation.step=2e-4"] if formulation == "nodal" else []
    run = _simulate(_two_bodies(tmp_path), f"simulation.formulation={formulation}", *changes)
    series = run.series(run.solution.t[:: max(1, len(run.solution.t) // 50)])
    first = series.rates[:, 0]
    second = first + series.rates[:, 1]
    np.testing.assert_allclose(2 * first + second, 2.0, atol=1e-10)
    assert second[-1] - first[-1] == pytest.approx(0.5, abs=2e-3 if formulation == "nodal" else 1e-4)


@pytest.mark.parametrize("formulation", ["erls", "nodal"])
def test_a_block_slides_down(tmp_path: Path, formulation: str) -> None:
    """By v₀ t + (sin α - µ cos α) g t² / 2 of a slope of 30 degrees, on the depth that bears it; to 1e-5."""
    slope, mu, speed = np.radians(30.0), 0.3, 1.0
    normal = np.array([np.sin(slope), 0.0, np.cos(slope)])
    depth = (MASS * G * np.cos(slope) / STIFFNESS) ** (1 / 1.5)
    start, rate = -depth * normal, speed * np.array([np.cos(slope), 0.0, -np.sin(slope)])
    begins = (("x", float(start[0]), float(rate[0])), ("y", float(start[2]), float(rate[2])))
    coordinates = {name: {"initial": {"position": place, "rate": speed}} for name, place, speed in begins}
    free = {"name": "free", "type": "planar", "dh": {"convention": "standard"}, "coordinates": coordinates}
    law = {"stiffness": STIFFNESS, "restitution": 0.5, "friction": {"coefficient": mu, "transition_rate": 1e-3}}
    path = scenes.write_toml(
        tmp_path / "slope.toml",
        {
            "gravity": [0.0, 0.0, -G],
            "simulation": {"duration": 0.5, "formulation": formulation},
            "base": {"rotation_deg": [90.0, 0.0, 0.0]},
            "joints": [free],
            "links": [{"name": "block", "rigid": BALL}],
            "points": [{"name": "centre", "link": "block", "node": "centre"}],
            "contacts": [{"name": "slope", "point": "centre", "plane": {"normal": normal.tolist()}, **law}],
        },
    )
    run = _simulate(path, *(["simulation.step=1e-3"] if formulation == "nodal" else []))
    slid = float(np.linalg.norm(np.diff(run.position("centre", [0.0, 0.5]), axis=0)))
    expected = speed * 0.5 + (np.sin(slope) - mu * np.cos(slope)) * G * 0.5**2 / 2
    assert slid == pytest.approx(expected, rel=1e-5)
    assert run.contact("slope", 0.5).normal_force == pytest.approx(MASS * G * np.cos(slope), rel=1e-4)
    assert any("at the start" in text for text in run.warnings)


def _pendulum(folder: Path, **more: Any) -> Path:
    arm = {"mass": 1.0, "centre_of_mass": [0.5, 0.0, 0.0], "inertia": [0.01, 0.1, 0.1]}
    joint = {"name": "hinge", "dh": {"convention": "standard"}, "initial": {"rate": 1.0}}
    return scenes.write_toml(
        folder / "pendulum.toml",
        {
            "gravity": [0.0, 0.0, 0.0],
            "simulation": {"duration": 0.6},
            "links": [{"name": "arm", "rigid": {**arm, "points": {"root": [0, 0, 0], "tip": [1.0, 0.0, 0.0]}}}],
            "points": [{"name": "tip", "link": "arm", "node": "tip"}],
            "joints": [{**joint, **more.pop("joint", {})}],
            **more,
        },
    )


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
    run = _simulate(_pendulum(tmp_path, joint={"stops": stops}), *KINDS[name])
    fixed = name in ("nodal", "generalized_alpha")
    assert run.joint_rate("hinge", 0.6) == pytest.approx(-0.5, abs=2e-3 if fixed else 1e-4)
    assert run.energy(0.6).total == pytest.approx(0.25 * run.energy(0.0).total, rel=1e-2 if fixed else 1e-3)
    assert not run.conservative


def test_a_closing_joint_has_stops(tmp_path: Path) -> None:
    """The rocker of a four-bar: ERLS and FFR within 1e-7 m, and the balance of energy of the whole run."""
    data = loop_scenes.four_bar()
    stops = {"lower_deg": -25.0, "upper_deg": 30.0, "stiffness": 2e3, "restitution": 0.5}
    data["loops"] = [{**data["loops"][0], "stops": stops}]
    runs = [loop_scenes.run(tmp_path, data, n, integrator="lobatto", duration=0.4) for n in ("erls", "ffr")]
    times = np.linspace(0.0, 0.4, 9)
    one, other = (run.position("coupler tip", times) for run in runs)
    np.testing.assert_allclose(one, other, atol=1e-6)
    energy = runs[0].energy(times).total
    assert energy[-1] < 0.9 * energy[0]
    assert runs[0].trust is not None
    assert runs[0].trust.verdict != "broken"


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_a_rigid_link_hits_a_plane(tmp_path: Path, restitution: float) -> None:
    """Its tip meets a plane at a right angle: it turns back at e times its rate, whatever its inertia about the tip,
    to the square of the angle by which it presses in; its reaction gives what the plane does not.
    """
    plane = {"normal": [0.0, -1.0, 0.0], "position": [0.0, 0.1, 0.0]}
    contact = {"name": "wall", "point": "tip", "plane": plane, "stiffness": 1e7, "restitution": restitution}
    run = _simulate(_pendulum(tmp_path, contacts=[contact]))
    assert run.joint_rate("hinge", 0.6) == pytest.approx(-restitution, abs=3e-4)
    t = np.linspace(0.0, 0.6, 20001)
    force = run.contact("wall", t).force
    impulse = np.trapezoid(force[:, 1], t)
    inertia = 0.1 + 0.5**2
    assert impulse * np.cos(0.1) == pytest.approx(-(1 + restitution) * inertia, rel=1e-2)


def _flexible(folder: Path, **changes: Any) -> Path:
    scenes.arm_link(folder)
    contact = {"name": "floor", "point": "tip", "plane": {"normal": [0.0, 0.0, 1.0], "position": [0.0, 0.0, 0.05]}}
    data = {
        "simulation": {"duration": 0.12},
        "base": {"rotation_deg": [-90.0, 0.0, 0.0]},
        "joints": [{"name": "hinge", "dh": {"convention": "standard", "alpha_deg": 90.0}}],
        "links": [{"name": "a", **scenes.ARM}],
        "points": [{"name": "tip", "link": "a", "node": "tip"}],
        "contacts": [{**contact, "stiffness": 2e3, "restitution": 0.8, "exponent": 1.0}],
    }
    return scenes.write_toml(folder / "scene.toml", scenes.merged(data, changes))


def test_a_flexible_link_hits_a_plane(tmp_path: Path) -> None:
    """ERLS, FFR within 1e-5 m of each other, nodal elements, which have all modes, within 2e-4 m; energies are balanced
    by what the contact lost.
    """
    path = _flexible(tmp_path)
    runs = [
        _simulate(path, f"simulation.formulation={name}", *more, verdict=name == "erls")
        for name, more in (("erls", []), ("ffr", []), ("nodal", ["simulation.step=1e-4"]))
    ]
    times = np.linspace(0.08, 0.12, 9)
    one, other, third = (run.position("tip", times) for run in runs)
    assert runs[0].contact("floor", times).gap.min() < -1e-3
    np.testing.assert_allclose(other, one, atol=1e-5)
    np.testing.assert_allclose(third, one, atol=2e-4)
    run = runs[0]
    assert run.accuracy is not None
    assert all(audit.ok for audit in audits(run, run.accuracy.integration))
    assert run.energy(0.12).total < run.energy(0.0).total - 1e-3


def test_what_contacts_do_not_go_with(tmp_path: Path) -> None:
    """Modes that follow statically are refused; automatic effects leave nothing out."""
    path, told = _flexible(tmp_path), list[str]()
    with pytest.raises(SceneError, match="does not go with contacts"):
        load_scene(path, ["simulation.bandwidth=100.0"])
    run = erls.simulate(load_scene(path, ["simulation.effects=auto", "simulation.duration=0.01"]), tell=told.append)
    assert any("contacts or stops act" in text for text in told)
    assert isinstance(run, ChainRun)
    assert run.certificate is not None
    assert run.certificate.error == 0.0


def test_steps_that_pass_over_a_contact_are_told(tmp_path: Path) -> None:
    """Between two knots above the ground a parabola dips below it; one that stays above it does not."""
    equations = Erls(build_mechanism(load_scene(_falling(tmp_path, 0.5, 0.1, 0.0, 0.0))).mechanism)
    for rate, deep in ((-1.0, True), (-0.1, False)):
        y, v = np.full((2, 1), 0.1), np.array([[rate], [-rate]])
        found = passed_over(equations, Solution(np.array([0.0, 1.0]), y, v, np.zeros((2, 1)), Work()))
        assert (len(found) == 1 and "by 0.15 m" in found[0]) if deep else not found

"""Contacts: the law against its closed form, power in every formulation, what is told and refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from body_scenes_data import PENDULUM, body_scene
from contact_scenes import falling, flexible
from scipy.integrate import quad

import erls
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


def test_what_contacts_do_not_go_with(tmp_path: Path) -> None:
    """Modes that follow statically are refused; automatic effects leave nothing out."""
    path, told = flexible(tmp_path), list[str]()
    with pytest.raises(SceneError, match="does not go with contacts"):
        load_scene(path, ["simulation.bandwidth=100.0"])
    run = erls.simulate(
        load_scene(path, ["simulation.effects=auto", "simulation.duration=0.01"]), tell=told.append, verdict=False
    )
    assert any("contacts or stops act" in text for text in told)
    assert isinstance(run, ChainRun)
    assert run.certificate is not None
    assert run.certificate.error == 0.0


def test_steps_that_pass_over_a_contact_are_told(tmp_path: Path) -> None:
    """Between two knots above the ground a parabola dips below it; one that stays above it does not."""
    equations = Erls(build_mechanism(load_scene(falling(tmp_path, 0.5, 0.1, 0.0, 0.0))).mechanism)
    for rate, deep in ((-1.0, True), (-0.1, False)):
        y, v = np.full((2, 1), 0.1), np.array([[rate], [-rate]])
        found = passed_over(equations, Solution(np.array([0.0, 1.0]), y, v, np.zeros((2, 1)), Work()))
        assert (len(found) == 1 and "by 0.15 m" in found[0]) if deep else not found


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"node": "c"}, "node"),
        ({"plane": {"on": "bob", "normal": [0.0, 0.0, 1.0]}}, "plane.on"),
        ({"restitution": 2.0}, "restitution"),
        ({"friction": {"coefficient": 0.1, "law": "stick"}}, "friction.law"),
    ],
)
def test_faulty_contacts_of_bodies(tmp_path: Path, change: dict[str, Any], field: str) -> None:
    """Named with file and field."""
    contact = {"name": "c", "node": "bob", "plane": {"normal": [0.0, 0.0, 1.0]}, "stiffness": 1e4, "restitution": 0.5}
    path = body_scene(tmp_path, PENDULUM, contacts=[{**contact, **change}])
    with pytest.raises(SceneError) as found:
        erls.simulate(path, verdict=False)
    assert f"contacts[0].{field}" in str(found.value)

"""Bushings: frequencies of a body on a 6 x 6 spring, energy, large turns, between links, faults."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg as la

import erls
from erls.errors import SceneError
from erls.maths.so3 import skew

MASS, CENTRE, INERTIA = 2.0, np.array([0.02, 0.0, 0.01]), np.diag([0.01, 0.02, 0.03])
SPRING = np.diag([1e4, 2e4, 3e4, 50.0, 60.0, 70.0])
SPRING[0, 4] = SPRING[4, 0] = 100.0
DAMPER = np.diag([8.0, 9.0, 10.0, 0.02, 0.03, 0.04])


def mounted(bushing: dict[str, Any], initial: dict[str, Any] | None = None, **more: Any) -> Any:
    """A body that floats, on a bushing."""
    body = {"mass": MASS, "centre_of_mass": CENTRE.tolist(), "inertia": np.diagonal(INERTIA).tolist()}
    joint = {"name": "free", "type": "floating", "dh": {"convention": "standard"}, "coordinates": initial or {}}
    others = more.pop("couplings", [])
    return erls.make_scene(
        couplings=others,
        gravity=more.pop("gravity", [0.0, 0.0, 0.0]),
        initial=more.pop("start", {}),
        simulation={"duration": 0.05, **more},
        joints=[joint],
        links=[{"name": "body", "rigid": {**body, "points": {"seat": [0.0, 0.0, 0.0]}}}],
        bushings=[{"name": "mount", "link": "body", "node": "seat", "stiffness": SPRING.tolist(), **bushing}],
    )


def mass_matrix() -> np.ndarray:
    """(6, 6) about the seat."""
    arm = skew(CENTRE)
    return np.block([[MASS * np.eye(3), -MASS * arm], [MASS * arm, INERTIA - MASS * arm @ arm]])


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_poles_of_a_body_on_a_six_by_six_spring(formulation: str) -> None:
    """Those of M, C and K, by the linear model to the digits of its differences."""
    scene = mounted({"damping": DAMPER.tolist()}, formulation=formulation)
    found = np.array([mode.pole for mode in erls.linearize(scene, at=0.0).modes if mode.pole.imag > 0])
    mass = mass_matrix()
    state = np.block([[np.zeros((6, 6)), np.eye(6)], [-la.solve(mass, SPRING), -la.solve(mass, DAMPER)]])
    expected = np.array([pole for pole in la.eigvals(state) if pole.imag > 0])
    order = np.argsort(expected.imag)
    np.testing.assert_allclose(found[np.argsort(found.imag)], expected[order], rtol=1e-7)


@pytest.mark.parametrize(
    ("formulation", "integrator"), [("erls", "auto"), ("ffr", "auto"), ("erls", "generalized_alpha")]
)
def test_energy_is_kept_at_large_turns(formulation: str, integrator: str) -> None:
    """Turned by some 1.5 rad about a skew axis, where the rotation vector's rates are not the spin."""
    turned = {"turn_z": {"initial": {"rate": 60.0}}, "turn_x": {"initial": {"rate": 30.0}}}
    run = erls.simulate(mounted({}, turned, formulation=formulation, integrator=integrator, tolerance=1e-5))
    times = np.linspace(0.0, 0.05, 30)
    energies = run.energy(times)
    np.testing.assert_allclose(energies.total, energies.total[0], rtol=1e-4)
    assert np.ptp(energies.springs) > 0.3 * energies.total[0]
    turns = np.array([[run.joint_angle(f"free/turn_{x}", t) for x in "xyz"] for t in times])
    assert np.linalg.norm(turns, axis=1).max() > 1.0


def test_a_damper_takes_what_the_audit_counts() -> None:
    """The balance of energy holds with it, and the force at the start is -K d."""
    bushing = {"damping": DAMPER.tolist(), "position": [0.0, 0.0, 0.0]}
    run = erls.simulate(mounted(bushing, {"x": {"initial": {"position": 1e-3}}}))
    assert run.trust.verdict == "good"
    assert run.energy(0.05).total < 0.9 * run.energy(0.0).total
    force, moment = run.loop_reaction("mount", 0.0)
    np.testing.assert_allclose(np.concatenate([force, moment]), -SPRING[:, 0] * 1e-3, atol=1e-12)


def test_a_link_hangs_on_a_turned_bushing() -> None:
    """Static deflection under gravity: K⁻¹ m g along axes turned by 90 degrees about x."""
    spring = [1e4, 2e4, 3e4, 5e3, 6e3, 7e3]
    hung = mounted(
        {"stiffness": spring, "rotation_deg": [90.0, 0.0, 0.0], "damping": [200.0] * 3 + [5.0] * 3},
        gravity=[0.0, 0.0, -9.81],
        duration=1.0,
    )
    run = erls.simulate(hung, verdict=False)
    # gravity is along -y of the bushing; its moment about the seat turns the body a little
    assert run.joint_angle("free/z", 1.0) == pytest.approx(-MASS * 9.81 / spring[1], rel=1e-3)
    force, _ = run.loop_reaction("mount", 1.0)
    np.testing.assert_allclose(force, [0.0, 0.0, MASS * 9.81], atol=1e-3)


def test_between_two_links_forces_are_opposite() -> None:
    """Two bodies on one mount, which nothing else holds: the momenta of both add up to nothing."""
    body = {"mass": MASS, "inertia": [0.01, 0.02, 0.03], "points": {"seat": [0.0, 0.0, 0.0], "rim": [0.1, 0.0, 0.0]}}
    scene = erls.make_scene(
        gravity=[0.0, 0.0, 0.0],
        simulation={"duration": 0.05},
        joints=[
            {"name": name, "type": "prismatic", "dh": {"convention": "standard"}, "on": "ground",
             "branch": {"position": [0.0, 0.0, 0.0]}, **more}
            for name, more in (("a", {"initial": {"position": 0.002}}), ("b", {}))
        ],
        links=[{"name": f"{name} body", "rigid": body} for name in "ab"],
        bushings=[
            {"name": "mount", "link": "a body", "node": "seat", "to_link": "b body", "to_node": "seat",
             "stiffness": [1e3, 1e3, 5e3, 1.0, 1.0, 1.0]}
        ],
    )  # fmt: skip
    run = erls.simulate(scene, verdict=False)
    times = np.linspace(0.0, 0.05, 11)
    both = run.joint_angle("a", times), run.joint_angle("b", times)
    swing = 0.002 * np.cos(np.sqrt(2 * 5e3 / MASS) * times)
    np.testing.assert_allclose(both[0] - both[1], swing, atol=1e-6)
    np.testing.assert_allclose(both[0] + both[1], 0.002, atol=1e-9)


@pytest.mark.parametrize(
    ("bushing", "field", "words"),
    [
        ({"link": "boddy"}, "bushings[0].link", "body"),
        ({"node": "rim"}, "bushings[0].node", "seat"),
        ({"to_link": "body", "to_node": "seat"}, "bushings[0].to_link", "two links"),
        ({"stiffness": [-1.0, 0, 0, 0, 0, 0]}, "bushings[0].stiffness", "negative"),
        ({"stiffness": (SPRING + np.eye(6, k=1)).tolist()}, "bushings[0].stiffness", "not symmetric"),
        ({"damping": [1, 2, 3]}, "bushings[0].damping", "6"),
        ({"name": "free"}, "bushings[0].name", "must differ"),
        ({"stiffness": [1e9, 1e9, 1e9, -5e-4, 1.0, 1.0]}, "bushings[0].stiffness", "negative"),
    ],
)
def test_faults_name_their_field(bushing: dict[str, Any], field: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        erls.simulate(mounted(bushing))
    assert field in str(caught.value)
    assert words in str(caught.value)


def test_couplings_have_other_names_than_bushings() -> None:
    coupling = {"name": "mount", "joint": "free/slide_x", "follows": {"free/slide_y": 1.0}}
    with pytest.raises(SceneError, match=r"couplings\[0\]\.name: names must differ"):
        mounted({}, couplings=[coupling])


@pytest.mark.parametrize(
    "settings", [{"formulation": "nodal"}, {"formulation": "ffr", "coordinates": "absolute"}, {"bandwidth": 100.0}]
)
def test_settings_that_do_not_know_bushings_refuse_them(settings: dict[str, Any]) -> None:
    with pytest.raises(SceneError, match=r"simulation\.(formulation|coordinates|bandwidth)"):
        mounted({}, **settings)

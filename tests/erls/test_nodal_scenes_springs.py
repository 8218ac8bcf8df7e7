"""Springs and dampers: derivatives against differences, oscillations and energy against closed forms, faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from body_scenes_data import PENDULUM, body_scene

from erls import simulate
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.elements import Elements
from erls.equations.nodal.springs import Spring, Springs
from erls.equations.nodal.turning_springs import TurningSpring, TurningSprings
from erls.errors import Cause
from erls.maths import motion_maps as motions
from erls.maths import rotation_maps as rotations
from erls.run.bodies.motion import BodyMotion
from fe_import.errors import ReportedError

SLIDE = {"name": "slide", "type": "prismatic", "node": "bob", "axis": [1, 0, 0]}
LINE = {"type": "line", "node": "bob", "to_position": [0.0, 0.0, 0.0], "stiffness": 200.0}
TURN = {"type": "turning", "node": "bob", "axis": [0, 1, 0], "stiffness": 40.0}


def _elements(kind: str, nodes: tuple[int, ...], seed: int) -> Elements:
    rng = np.random.default_rng(seed)
    if kind == "line":
        return Springs([Spring(nodes, *rng.standard_normal((2, 3)), 3.0, 0.7, 0.4)])
    frames = rotations.exp(rng.standard_normal((2, 3)))
    axis = rng.standard_normal(3)
    return TurningSprings([TurningSpring(nodes, *frames, axis / np.linalg.norm(axis), 3.0, 0.7, 0.4)])


@pytest.mark.parametrize("nodes", [(1,), (0, 1)])
@pytest.mark.parametrize("kind", ["line", "turning"])
def test_exact_tangents_and_energy(kind: str, nodes: tuple[int, ...]) -> None:
    """At rest: forces are the slopes of the energy and the stiffness is theirs, by central differences; damping too."""
    rng = np.random.default_rng(7)
    system = NodalSystem(motions.exp(rng.standard_normal((2, 6))), [_elements(kind, nodes, 3)])
    q, rest, e = system.at(system.start.poses @ motions.exp(0.5 * rng.standard_normal((2, 6)))), np.zeros(12), 1e-5
    stiffness, damping = system.stiffness_and_damping(0.0, q, rest, rest, np.zeros(0))
    force = system.residual(0.0, q, rest, rest)
    for k in range(12):
        d = np.eye(12)[k] * e
        ahead, back = system.compose(q, d), system.compose(q, -d)
        slope = (system.energy(0.0, ahead, rest)[1] - system.energy(0.0, back, rest)[1]) / (2 * e)
        assert force[k] == pytest.approx(slope, abs=1e-8)
        change = system.residual(0.0, ahead, rest, rest) - system.residual(0.0, back, rest, rest)
        np.testing.assert_allclose(np.asarray(stiffness)[:, k], change / (2 * e), atol=1e-7)
        drag = system.residual(0.0, q, d, rest) - system.residual(0.0, q, -d, rest)
        np.testing.assert_allclose(np.asarray(damping)[:, k], drag / (2 * e), atol=1e-9)


@pytest.mark.parametrize("kind", ["line", "turning"])
def test_rigid_motions_do_nothing(kind: str) -> None:
    """Forces between two nodes depend on their relative pose."""
    rng = np.random.default_rng(5)
    system = NodalSystem(motions.exp(rng.standard_normal((2, 6))), [_elements(kind, (0, 1), 3)])
    moved = system.at(motions.exp(rng.standard_normal(6)) @ system.start.poses)
    v = rng.standard_normal(12)
    np.testing.assert_allclose(system.residual(0, moved, v, v), system.residual(0, system.start, v, v), atol=1e-13)


def _run(folder: Path, connection: dict[str, Any], spring: dict[str, Any], **body: Any) -> BodyMotion:
    bodies = [{**PENDULUM["bodies"][0], **body}]
    scene = {**PENDULUM, "gravity": [0.0, 0.0, 0.0], "simulation": {"type": "dynamics", "duration": 0.5, "step": 2e-3}}
    found = simulate(body_scene(folder, scene, bodies=bodies, connections=[connection], springs=[spring]))
    assert isinstance(found, BodyMotion)
    return found


def test_oscillation_on_a_line(tmp_path: Path) -> None:
    """2 kg on 200 N/m at 10 rad/s; with a damper of ζ = 0.2 it decays as exp(−2 t)."""
    t = np.linspace(0, 0.5, 11)
    free = _run(tmp_path, SLIDE, LINE, velocity=[3.0, 0.0, 0.0])
    np.testing.assert_allclose(free.position("bob", t)[:, 0], 1 + 0.3 * np.sin(10 * t), atol=4e-4)
    assert free.summary()["energy"]["max_drift"] < 1e-3 * 9.0
    damped = _run(tmp_path, SLIDE, {**LINE, "damping": 8.0}, velocity=[3.0, 0.0, 0.0])
    omega = 10 * np.sqrt(1 - 0.04)
    np.testing.assert_allclose(
        damped.position("bob", t)[:, 0], 1 + 3 / omega * np.exp(-2 * t) * np.sin(omega * t), atol=4e-4
    )
    assert damped.summary()["energy"]["max_drift"] is None


def test_rest_length_and_ends_off_the_nodes(tmp_path: Path) -> None:
    """A spring of 0.4 m built 0.5 m long, on a point 0.5 m off the body's frame: it swings about 0.9 m."""
    spring = {**LINE, "position": [0.5, 0.0, 0.0], "length": 0.4}
    t = np.linspace(0, 0.5, 11)
    found = _run(tmp_path, SLIDE, spring)
    np.testing.assert_allclose(found.position("bob", t)[:, 0], 0.9 + 0.1 * np.cos(10 * t), atol=2e-4)


@pytest.mark.parametrize("rest", [0.0, 30.0])
def test_torsion_oscillation_over_whole_turns(tmp_path: Path, rest: float) -> None:
    """0.4 kg m² on 40 N m/rad, at 10 rad/s with an amplitude of more than a turn; the rest angle shifts it."""
    hinge = {"name": "hinge", "type": "revolute", "node": "bob", "axis": [0, 1, 0], "position": [1, 0, 0]}
    inertia = {"inertia": [0.4, 0.4, 0.4], "centre_of_mass": [0.0, 0.0, 0.0]}
    found = _run(tmp_path, hinge, {**TURN, "rest_deg": rest}, angular_velocity=[0.0, 80.0, 0.0], **inertia)
    solution = found.solution
    turn = solution.y[:, 3:12].reshape(-1, 3, 3)
    angle = np.unwrap(np.arctan2(turn[:, 0, 2], turn[:, 0, 0]))
    shift, t = np.radians(rest), solution.t
    expected = shift * (1 - np.cos(10 * t)) + 8 * np.sin(10 * t)
    assert np.abs(angle).max() > 2 * np.pi
    np.testing.assert_allclose(angle, expected, atol=0.03)


def test_bodies_on_springs_between_them(tmp_path: Path) -> None:
    """Two equal masses on a line: their reduced mass swings, the centre of mass stays."""
    bodies = [{**PENDULUM["bodies"][0], "name": name, "position": [x, 0.0, 0.0], "velocity": [v, 0.0, 0.0]}
              for name, x, v in (("a", 0.0, -1.0), ("b", 1.0, 1.0))]  # fmt: skip
    spring = {**LINE, "node": "b", "to": "a"}
    spring.pop("to_position")
    scene = {**PENDULUM, "gravity": [0.0, 0.0, 0.0], "connections": []}
    found = simulate(body_scene(tmp_path, scene, bodies=bodies, springs=[spring]))
    assert isinstance(found, BodyMotion)
    a, b = found.position("a", 0.2), found.position("b", 0.2)
    np.testing.assert_allclose((a + b) / 2, [0.5, 0, 0], atol=1e-12)
    omega = np.sqrt(200.0)
    assert b[0] - a[0] == pytest.approx(1 + 2 / omega * np.sin(omega * 0.2), abs=2e-4)


FAULTS = [
    ({**LINE, "node": "bib"}, "BAD_REFERENCE", "node"),
    ({**LINE, "to": "wall"}, "BAD_REFERENCE", "to"),
    ({**LINE, "to": "bob"}, "BAD_FIELD", "to"),
    ({**LINE, "stiffness": -1.0}, "BAD_FIELD", "stiffness"),
    ({**LINE, "damping": -1.0}, "BAD_FIELD", "damping"),
    ({**LINE, "length": -1.0}, "BAD_FIELD", "length"),
    ({**LINE, "to_position": [1.0, 0.0, 0.0]}, "BAD_FIELD", "to_position"),
    ({"type": "line", "node": "bob"}, "BAD_FIELD", "to_position"),
    ({**TURN, "axis": [0, 0, 0]}, "BAD_FIELD", "axis"),
    ({**TURN, "type": "bent"}, "BAD_FIELD", "type"),
    ({**TURN, "length": 1.0}, "UNKNOWN_FIELD", "length"),
]


@pytest.mark.parametrize(("spring", "cause", "field"), FAULTS)
def test_faults(tmp_path: Path, spring: dict[str, Any], cause: str, field: str) -> None:
    """Cause and field."""
    with pytest.raises(ReportedError) as caught:
        simulate(body_scene(tmp_path, PENDULUM, springs=[spring]))
    assert caught.value.cause.name == Cause[cause].name
    assert caught.value.where.endswith(f"springs[0].{field}")

"""Inertia forces of one link: against its kinetic energy, against nodal velocities, against conservation laws."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
import scenes
from dense_link import DenseLink

from erls.maths.so3 import skew
from erls.mechanism.links import payload_invariants, rigid_model
from fe_import.description.link import load_link
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_model

STEP = 1e-5  # central differences of a quadratic energy are exact but for rounding, 1e-16 / STEP relative


def _link(mass: str) -> tuple[FEModel, ModalModel]:
    with tempfile.TemporaryDirectory() as folder:
        link = load_link(scenes.l_link(Path(folder), 2, frame={"mass": mass}))
        model = build_model(link)
        return model, reduce_model(model, link)


@pytest.fixture(scope="module", params=["consistent", "lumped"])
def link(request: pytest.FixtureRequest) -> tuple[FEModel, ModalModel]:
    """The L with a mass matrix that does not commute with nodal rotations, and with one that does."""
    return _link(request.param)


def _state(modes: int, seed: int = 1) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    return tuple(rng.standard_normal(n) for n in (6, 6, modes, modes, modes))


def test_kinetic_energy_is_that_of_the_nodes(link: tuple[FEModel, ModalModel]) -> None:
    """T = ½ wᵀ M w with nodal velocities w = v + ω × (x + u) + u̇, and ω + φ̇ + ω × φ for rotations, to rounding."""
    model, modal = link
    twist, _, q, qd, _ = _state(modal.modes)
    inertia = DenseLink(modal.invariants)
    w = np.zeros(model.mass.shape[0])
    for node, x in enumerate(modal.nodes):
        shift, turn = modal.node_shape(node)
        u, ud, phi, phid = shift @ q, shift @ qd, turn @ q, turn @ qd
        w[model.dof_map[node, :3]] = twist[:3] + np.cross(twist[3:], x + u) + ud
        w[model.dof_map[node, 3:]] = twist[3:] + phid + np.cross(twist[3:], phi)
    expected = 0.5 * w @ (model.mass @ w)
    assert inertia.kinetic_energy(twist, q, qd) == pytest.approx(expected, rel=1e-12)
    s = np.concatenate([twist, qd])
    assert 0.5 * s @ inertia.mass_matrix(q) @ s == pytest.approx(expected, rel=1e-12)


def test_forces_are_boltzmann_hamel_of_the_energy(link: tuple[FEModel, ModalModel]) -> None:
    """d/dt ∂T/∂ν + ad* and d/dt ∂T/∂q̇ - ∂T/∂q by differences of T."""
    _, modal = link
    twist, rate, q, qd, qdd = _state(modal.modes)
    inertia = DenseLink(modal.invariants)
    n = modal.modes

    def gradient(f: object, x: np.ndarray) -> np.ndarray:
        steps = STEP * np.eye(len(x))
        return np.array([(f(x + s) - f(x - s)) / (2 * STEP) for s in steps])  # type: ignore[operator]

    def momenta(t: float) -> np.ndarray:
        tw, qq, qv = twist + t * rate, q + t * qd, qd + t * qdd
        return inertia.mass_matrix(qq) @ np.concatenate([tw, qv])

    momentum = momenta(0.0)
    momentum_rate = (momenta(STEP) - momenta(-STEP)) / (2 * STEP)
    slope = gradient(lambda x: inertia.kinetic_energy(twist, x, qd), q)
    wrench, modal_forces = inertia.forces(twist, rate, q, qd, qdd)
    p, h = momentum[:3], momentum[3:6]
    expected = momentum_rate[:6] + np.concatenate(
        [np.cross(twist[3:], p), np.cross(twist[3:], h) + np.cross(twist[:3], p)]
    )
    np.testing.assert_allclose(wrench, expected, atol=1e-8 * np.abs(expected).max())
    np.testing.assert_allclose(modal_forces, momentum_rate[6:] - slope, atol=1e-8 * np.abs(modal_forces).max())
    assert inertia.mass_matrix(q).shape == (6 + n, 6 + n)


def test_mass_matrix_agrees_with_forces(link: tuple[FEModel, ModalModel]) -> None:
    """The forces are linear in the accelerations with the mass matrix as factor."""
    _, modal = link
    twist, rate, q, qd, qdd = _state(modal.modes)
    inertia = DenseLink(modal.invariants)
    with_rate = np.concatenate(inertia.forces(twist, rate, q, qd, qdd))
    without = np.concatenate(inertia.forces(twist, 0 * rate, q, qd, 0 * qdd))
    product = inertia.mass_matrix(q) @ np.concatenate([rate, qdd])
    np.testing.assert_allclose(with_rate - without, product, atol=1e-12 * np.abs(with_rate).max())


def test_power_balance(link: tuple[FEModel, ModalModel]) -> None:
    """The forces do work at the rate at which T grows: Fᵀ(ν, q̇) = Ṫ."""
    _, modal = link
    twist, rate, q, qd, qdd = _state(modal.modes)
    inertia = DenseLink(modal.invariants)
    wrench, forces = inertia.forces(twist, rate, q, qd, qdd)

    def energy(t: float) -> float:
        return inertia.kinetic_energy(twist + t * rate, q + t * qd, qd + t * qdd)

    growth = (energy(STEP) - energy(-STEP)) / (2 * STEP)
    assert wrench @ twist + forces @ qd == pytest.approx(growth, rel=1e-8)


def test_gravity_is_the_gradient_of_its_energy(link: tuple[FEModel, ModalModel]) -> None:
    """Modal force and wrench of gravity from -∂V; V is linear in q and in the translation."""
    _, modal = link
    q = _state(modal.modes)[2]
    inertia = DenseLink(modal.invariants)
    g = np.array([1.0, -2.0, -9.0])
    wrench, forces = inertia.gravity(g, q)
    steps = STEP * np.eye(modal.modes)
    slope = [
        (inertia.gravity_energy(g, np.eye(4), q + s) - inertia.gravity_energy(g, np.eye(4), q - s)) / (2 * STEP)
        for s in steps
    ]
    np.testing.assert_allclose(forces, -np.array(slope), atol=1e-8 * np.abs(forces).max())
    np.testing.assert_allclose(wrench[:3], inertia.mass * g, rtol=1e-12)
    for axis in range(3):
        turned = [np.eye(4), np.eye(4)]
        for pose, sign in zip(turned, (1, -1), strict=True):
            pose[:3, :3] += sign * STEP * skew(np.eye(3)[axis])
        work = [inertia.gravity_energy(g, pose, q) for pose in turned]
        assert wrench[3 + axis] == pytest.approx(-(work[0] - work[1]) / (2 * STEP), rel=1e-7, abs=1e-9)


def test_rigid_model_is_a_rigid_body() -> None:
    """Newton-Euler equations of a rigid body in its body frame, to rounding."""
    rng = np.random.default_rng(5)
    mass, centre = 2.5, rng.standard_normal(3)
    inertia_about_centre = np.diag([0.3, 0.4, 0.5])
    model = rigid_model("r", mass, centre, inertia_about_centre, {"root": np.zeros(3), "tip": rng.standard_normal(3)})
    properties = model.mass_properties
    assert properties.mass == pytest.approx(mass)
    np.testing.assert_allclose(properties.centre_of_mass, centre, atol=1e-12)
    np.testing.assert_allclose(properties.inertia, inertia_about_centre, atol=1e-12)
    twist, rate = rng.standard_normal(6), rng.standard_normal(6)
    wrench, _ = DenseLink(model.invariants).forces(twist, rate, *np.zeros((3, 6)))
    v, w, a, dw = twist[:3], twist[3:], rate[:3] + np.cross(twist[3:], twist[:3]), rate[3:]
    force = mass * (a + np.cross(dw, centre) + np.cross(w, np.cross(w, centre)))
    moment = inertia_about_centre @ dw + np.cross(w, inertia_about_centre @ w) + np.cross(centre, force)
    np.testing.assert_allclose(wrench, np.concatenate([force, moment]), atol=1e-12 * 100)
    assert v.shape == (3,)


def test_massless_rigid_link_is_legal() -> None:
    """A massless link still has six rigid-body modes that move its nodes."""
    model = rigid_model("r", 0.0, np.zeros(3), np.zeros((3, 3)), {"a": np.zeros(3), "b": np.array([1.0, 0, 0])})
    assert np.linalg.matrix_rank(np.vstack(model.node_shape(1))) == 6
    assert not DenseLink(model.invariants).mass_matrix(np.zeros(6)).any()


def test_payload_moves_with_its_node(link: tuple[FEModel, ModalModel]) -> None:
    """Kinetic energy of a payload with an offset, from its own velocity and spin."""
    _, modal = link
    twist, _, q, qd, _ = _state(modal.modes)
    node, offset, mass = modal.node_names["tip"], np.array([0.02, 0.03, -0.01]), 0.7
    spin = np.diag([1e-3, 2e-3, 3e-3])
    extra = payload_invariants(modal, node, offset, mass, spin)
    shift, turn = modal.node_shape(node)
    arm = modal.nodes[node] + offset
    u, ud = (shift @ x + np.cross(turn @ x, offset) for x in (q, qd))
    velocity = twist[:3] + np.cross(twist[3:], arm + u) + ud
    rotation = twist[3:] + turn @ qd + np.cross(twist[3:], turn @ q)
    expected = 0.5 * mass * velocity @ velocity + 0.5 * rotation @ spin @ rotation
    assert DenseLink(extra).kinetic_energy(twist, q, qd) == pytest.approx(expected, rel=1e-9)

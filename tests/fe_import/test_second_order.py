"""Second-order kinematics of links: nonlinear beams, energies of solids, masses, files, and where there are none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from link_files import Array, frame_link, solid_link, straight_link
from modal_models import same
from scipy.spatial.transform import Rotation

from fe_import.description.link import LinkFile
from fe_import.description.reduction import Reduction
from fe_import.elements.solid_stress import SolidStress
from fe_import.errors import Cause, FEImportError
from fe_import.modal.check import validate
from fe_import.modal.file import read_modal_file, write_modal_file
from fe_import.modal.model import ModalModel
from fe_import.modal.second_order import SecondOrder, pair_numbers
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link
from fe_import.reduction import REDUCTIONS
from fe_import.second_order.beams import POINTS, line_fields
from fe_import.second_order.composition import twice_turned
from fe_import.second_order.compute import MOST_MODES, MOST_MODES_OF_SOLIDS, second_order
from fe_import.second_order.element_forces import solid_work
from fe_import.second_order.elements import elements_second_order
from fe_import.second_order.frame import frame_second_order
from fe_import.second_order.moments import of_inertia, of_masses

THIRD, FOURTH = 7.0, 13.0  # least ratios of an error at twice the amplitude: 8 and 16, less what comes after


def orthonormal(model: FEModel, count: int, seed: int = 0) -> Array:
    """(d, 6 + count) rigid-body motions, and smooth random displacements, as modes."""
    rng = np.random.default_rng(seed)
    x = model.nodes / np.abs(model.nodes).max()
    powers = np.stack([x[:, 0] ** 2, x[:, 0] * x[:, 1], x[:, 1] ** 2, x[:, 0] ** 3, x[:, 2] * x[:, 0]], axis=1)
    fields = np.zeros((len(model.mass.indptr) - 1, count))
    for k in range(count):
        fields[model.dof_map[:, :3], k] = powers @ rng.normal(size=(5, 3))
        turning = model.dof_map[:, 3] >= 0
        fields[model.dof_map[turning, 3:], k] = 2 * powers[turning] @ rng.normal(size=(5, 3))
    if model.coupling is not None:
        fields = np.asarray(model.coupling @ fields[model.independent])
    return np.hstack([model.rigid_body_modes(), fields])


def field_at(found: SecondOrder, node: int, q: Array) -> Array:
    """(6,) second-order displacement and rotation vector of a node relative to the reference."""
    n = len(q) - 6
    pairs = pair_numbers(n)
    place = int(np.flatnonzero(found.nodes == node)[0])
    both = np.concatenate([found.translation[place], found.rotation[place]])[:, pairs]
    return np.asarray(0.5 * both @ q[6:] @ q[6:])


def turned_beam(model: FEModel, shapes: Array, q: Array, start: int) -> dict[int, tuple[Array, Array]]:
    """Position and rotation matrix of every node by the nonlinear kinematics of beams, ``start`` at rest.

    Curvature and strain are those of the linear modes at the points of the elements, interpolated; 40 steps with a
    constant curvature in each.
    """
    beams = model.beams
    assert beams is not None
    motions, rows = model.rigid_body_modes(), model.dof_map[start]
    moved = shapes @ q
    moved = moved - motions @ np.linalg.solve(motions[rows], moved[rows])
    found = {start: (model.nodes[start], np.eye(3))}
    left = list(range(len(beams.nodes)))
    while left:
        element = next(e for e in left if set(beams.nodes[e].tolist()) & set(found))
        left.remove(element)
        first, second = beams.nodes[element].tolist()
        backward = first not in found
        ends = moved[model.dof_map[[first, second]]].reshape(12, 1)
        fields = line_fields(beams, element, ends)
        steps, length = 40, float(beams.lengths[element])
        middle = (np.arange(steps) + 0.5) / steps
        powers = np.vander(middle, len(POINTS)) @ np.linalg.inv(np.vander(POINTS, len(POINTS)))
        curvature, strain = powers @ fields.curvature[:, :, 0], powers @ fields.strain[:, :, 0]
        ds = length / steps * (-1 if backward else 1)
        x, turn = found[second if backward else first]
        for k in range(steps)[:: -1 if backward else 1]:
            half = Rotation.from_rotvec(curvature[k] * ds / 2).as_matrix()
            x = x + ds * (turn @ half @ (fields.tangent + strain[k]))
            turn = turn @ half @ half
        found[first if backward else second] = x, turn
    return found


@pytest.mark.parametrize("reference", [0, 1])
@pytest.mark.parametrize("theory", ["timoshenko", "euler-bernoulli"])
def test_frames_follow_nonlinear_beams(tmp_path: Path, theory: str, reference: int) -> None:
    """What is left beside the second-order field is of third order, in places and in rotation vectors.

    The steps of the nonlinear integration add 1e-4 of the second-order displacement, (1/40)² of a sixth.
    """
    model = build_model(frame_link(tmp_path, frame={"theory": theory}))
    assert model.beams is not None
    shapes = orthonormal(model, 3)
    every = np.arange(len(model.nodes))
    found = frame_second_order(model, model.beams, shapes, reference, every)
    start = model.interface_nodes[reference].node
    motions, rows = model.rigid_body_modes(), model.dof_map[start]
    relative = shapes - motions @ np.linalg.solve(motions[rows], shapes[rows])
    direction = np.concatenate([np.zeros(6), [0.7, -0.4, 0.5]])
    errors, sizes = [], []
    for size in (0.08, 0.04):
        q = size * direction
        exact = turned_beam(model, shapes, q, start)
        error = np.zeros((len(every), 6))
        for node in every:
            second = field_at(found, node, q)
            linear = relative[model.dof_map[node]] @ q
            x, turn = exact[node]
            error[node, :3] = x - model.nodes[node] - linear[:3] - second[:3]
            error[node, 3:] = Rotation.from_matrix(turn).as_rotvec() - linear[3:] - second[3:]
            sizes.append(np.abs(second).max() / size**2)
        errors.append(np.abs(error).max())
    assert errors[1] < 0.1 * max(sizes) * 0.04**2
    assert errors[0] > THIRD * (errors[1] - 1e-4 * max(sizes) * 0.04**2)


def test_moments_are_those_of_the_masses(tmp_path: Path) -> None:
    """Lumped mass and a point mass: momenta and spin terms are sums over nodes of what the definitions say."""
    masses = [{"node": "tip", "mass": 0.4, "inertia": [1e-3, 2e-3, 3e-3]}]
    link = frame_link(tmp_path, frame={"mass": "lumped", "rotary_inertia": False}, masses=masses)
    model = build_model(link)
    assert model.beams is not None
    shapes = orthonormal(model, 3)
    shapes[:, :6] = 0.0  # at rest in the reference
    motions, rows = model.rigid_body_modes(), model.dof_map[model.interface_nodes[0].node]
    shapes -= motions @ np.linalg.solve(motions[rows], shapes[rows])
    found = frame_second_order(model, model.beams, shapes, 0, np.arange(len(model.nodes)))
    rng = np.random.default_rng(2)
    q, qd, omega = np.zeros(9), np.zeros(9), rng.normal(size=3)
    q[6:], qd[6:] = rng.normal(size=(2, 3))
    linear, angular, turning, modal = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    for node, x in enumerate(model.nodes):
        block = model.mass[model.dof_map[node]][:, model.dof_map[node]].toarray()
        mass, inertia = block[0, 0], block[3:, 3:]
        u, rate = field_at(found, node, q), field_at(found, node, q + qd) - field_at(found, node, q - qd)
        rate /= 2
        phi, phi_rate = (shapes[model.dof_map[node, 3:]] @ a for a in (q, qd))
        linear += mass * rate[:3]
        spin = inertia @ (rate[3:] - np.cross(phi, phi_rate) / 2)
        angular += mass * np.cross(x, rate[:3]) + spin
        modal += np.concatenate([mass * rate[:3], spin]) @ shapes[model.dof_map[node], 6:]
        turning += mass * np.cross(x, np.cross(omega, u[:3]))
        turning += inertia @ (np.cross(omega, u[3:]) + np.cross(phi, np.cross(phi, omega)) / 2)
    expected = np.concatenate([linear, angular])
    np.testing.assert_allclose(np.einsum("iab,a,b->i", found.momentum, q, qd), expected, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(0.5 * np.einsum("cdab,d,a,b->c", found.spin, omega, q, q), turning, rtol=1e-10)
    np.testing.assert_allclose(np.einsum("cab,a,b->c", found.modal, q, qd), modal, rtol=1e-10)


@pytest.mark.parametrize("kind", ["solid", "frame"])
def test_modal_terms_are_the_mass_between_modes_and_field(tmp_path: Path, kind: str) -> None:
    """Of modes that turn the reference: 2 φᵀM times the even part of the displacements of finite turns, to 1e-6 (its
    fourth order).
    """
    if kind == "solid":
        interfaces = [{"name": name, "face": face, "coupling": "averaged"} for name, face in (("a", "x0"), ("b", "x1"))]
        model = build_model(solid_link(tmp_path, interfaces=interfaces))
    else:
        model = build_model(frame_link(tmp_path, frame={"mass": "lumped", "rotary_inertia": False}))
    shapes, every = orthonormal(model, 3), np.arange(len(model.nodes))
    if kind == "solid":
        assert isinstance(model.stress, SolidStress)
        found = elements_second_order(model, partial(solid_work, model.stress, model.dof_map), shapes, 0, every)
    else:
        assert model.beams is not None
        found = frame_second_order(model, model.beams, shapes, 0, every)
    start = model.interface_nodes[0].node
    motions, rows = model.rigid_body_modes(), model.dof_map[start]
    q = np.random.default_rng(4).normal(size=9)

    def moved(size: float) -> Array:
        u = (shapes - motions @ np.linalg.solve(motions[rows], shapes[rows])) @ (size * q)
        at_start = shapes[rows] @ (size * q)
        curved = np.array([field_at(found, node, size * q)[:3] for node in every])
        arms = model.nodes - model.nodes[start] + u[model.dof_map[:, :3]] + curved
        result = np.zeros(len(u))
        result[model.dof_map[:, :3]] = at_start[:3] + arms @ Rotation.from_rotvec(at_start[3:]).as_matrix().T
        return result

    size = 1e-3 / np.abs(shapes @ q).max()
    second = (moved(size) + moved(-size) - 2 * moved(0.0)) / size**2
    expected = (model.mass @ shapes[:, 6:]).T @ second
    np.testing.assert_allclose(found.modal @ q @ q, expected, atol=1e-6 * np.abs(expected).max())


def test_consistent_mass_is_the_limit_of_lumped_mass(tmp_path: Path) -> None:
    """Along the elements the integrals are exact: those of 2 elements are the limit of many lumped ones."""
    found = []
    for elements, mass in ((2, "consistent"), (64, "lumped")):
        frame = {"mass": mass, "rotary_inertia": False, "theory": "euler-bernoulli"}
        model = build_model(straight_link(tmp_path, 0.8, elements, frame=frame))
        assert model.beams is not None
        x = model.nodes[:, 0]
        shapes = np.zeros((model.mass.shape[0], 7))
        shapes[:, :6] = model.rigid_body_modes()
        shapes[model.dof_map[:, 1], 6], shapes[model.dof_map[:, 5], 6] = x**3, 3 * x**2  # bends as a load at the end
        found.append(frame_second_order(model, model.beams, shapes, 0, np.arange(len(x))))
    # u₂ = -½ ∫ 9 x⁴ = -0.9 x⁵ per q²/1: S = 2 ∫ρA u₂
    expected = -2 * 0.9 * 0.8**6 / 6 * 2700.0 * 0.01 * 0.02
    assert found[0].momentum[0, 6, 6] == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(found[0].modal, found[1].modal, atol=2e-3 * np.abs(found[1].modal).max())
    assert found[1].momentum[0, 6, 6] == pytest.approx(expected, rel=2e-3)


def green_energy(model: FEModel, u: Array) -> float:
    """Elastic energy of a Saint-Venant-Kirchhoff solid at nodal displacements."""
    solid = model.stress
    assert isinstance(solid, SolidStress)
    mesh, element = solid.mesh, solid.mesh.only.element
    points, weights = element.quadrature(element.stiffness_order)
    jacobian = np.einsum("eka,kbq->eqab", mesh.nodes[mesh.only.elements], element.shape_gradients(points))
    slopes = np.einsum("kbq,eqba->eqak", element.shape_gradients(points), np.linalg.inv(jacobian))
    gradient = np.einsum("eqak,ekc->eqac", slopes, u[model.dof_map[mesh.only.elements, :3]])
    strain = (gradient + gradient.swapaxes(2, 3) + gradient @ gradient.swapaxes(2, 3)) / 2
    lam, mu = solid.lame.T
    density = lam[:, None] / 2 * np.einsum("eqaa->eq", strain) ** 2
    density += mu[:, None] * np.einsum("eqab,eqab->eq", strain, strain)
    return float(np.sum(density * weights * np.linalg.det(jacobian)))


@pytest.mark.parametrize("coupling", ["rigid", "averaged"])
def test_energy_of_solids_stays_quadratic_to_third_order(tmp_path: Path, coupling: str) -> None:
    """Energy less that of the linear modes falls with the fourth power of the amplitude; without the second-order
    field it is far larger.
    """
    interfaces = [{"name": name, "face": face, "coupling": coupling} for name, face in (("a", "x0"), ("b", "x1"))]
    model = build_model(solid_link(tmp_path, interfaces=interfaces))
    shapes = orthonormal(model, 2)
    solid = model.stress
    assert isinstance(solid, SolidStress)
    found = elements_second_order(
        model, partial(solid_work, solid, model.dof_map), shapes, 0, np.arange(len(model.nodes))
    )
    motions, rows = model.rigid_body_modes(), model.dof_map[model.interface_nodes[0].node]
    relative = shapes - motions @ np.linalg.solve(motions[rows], shapes[rows])
    left, bare = [], []
    for size in (2e-3, 1e-3):
        q = size * np.concatenate([np.zeros(6), [0.6, -0.8]])
        u = relative @ q
        second = np.zeros_like(u)
        curved = np.array([field_at(found, node, q)[:3] for node in range(len(model.nodes))])
        second[model.dof_map[:, :3].ravel()] = curved.ravel()
        linear = 0.5 * float(u @ (model.stiffness @ u))
        left.append(abs(green_energy(model, u + second) - linear))
        bare.append(abs(green_energy(model, u) - linear))
    assert left[0] > FOURTH * left[1]
    assert left[1] < 0.05 * bare[1]


def test_solid_and_frame_have_the_same_field() -> None:
    """The flat L as 100 hexahedra, as matrices of CalculiX and as beams: shortening at its tip in its three lowest
    clamped modes within 4 %, as their stiffness (`tests/erls/test_reference.py`); signs of modes are free.
    """
    import scipy.linalg as la

    tips = []
    for name in ("l_shape/links/solid", "calculix/l_hex20", "l_shape/links/steel_flat"):
        modal = reduce_link(Path(__file__).parents[2] / f"data/{name}.toml")
        field = modal.second_order
        assert field is not None
        root, tip = modal.interface_nodes
        rows = np.vstack(modal.node_shape(root.node))  # type: ignore[arg-type]
        basis = np.vstack([-np.linalg.solve(rows[:, :6], rows[:, 6:]), np.eye(modal.elastic_modes)])
        stiffness = np.diag(modal.stiffness)[6:]
        _, modes = la.eigh(np.diag(stiffness), basis.T @ modal.invariants.m @ basis)
        tips.append([field_at(field, tip.node, np.concatenate([np.zeros(6), modes[:, k]]))[:3] for k in range(3)])
    *others, frame = np.array(tips)
    assert np.abs(np.array(others) - frame).max() < 0.04 * np.abs(frame).max()


def test_truncation_takes_part_of_the_field(tmp_path: Path) -> None:
    """The field of some modes is that part of the field of all."""
    found = reduce_link(frame_link(tmp_path)).second_order
    assert found is not None
    keep = np.array([0, 1, 2, 3, 4, 5, 8, 6])
    part = found.truncated(keep)
    q = np.random.default_rng(0).normal(size=8)
    full = np.zeros(found.momentum.shape[1])
    full[keep] = q
    np.testing.assert_allclose(part.momentum @ q @ q, found.momentum @ full @ full)
    np.testing.assert_allclose(part.spin @ q @ q, found.spin @ full @ full)
    np.testing.assert_allclose(part.modal @ q @ q, (found.modal @ full @ full)[keep[6:] - 6])
    for node in found.nodes:
        np.testing.assert_allclose(field_at(part, node, q), field_at(found, node, full), rtol=1e-10, atol=1e-12)


def test_file_round_trip(tmp_path: Path) -> None:
    """A modal file gives back the field to the last bit."""
    modal = reduce_link(frame_link(tmp_path))
    assert modal.second_order is not None
    assert modal.provenance["second_order"] == "from its beams"
    write_modal_file(tmp_path / "a.h5", modal)
    assert same(read_modal_file(tmp_path / "a.h5").second_order, modal.second_order)


FAULTS: dict[str, tuple[Callable[[SecondOrder], dict[str, Any]], str]] = {
    "reference": (lambda f: {"reference": 7}, "no such interface"),
    "shape": (lambda f: {"momentum": f.momentum[:5]}, "wrong shape"),
    "type": (lambda f: {"translation": f.translation.astype(int)}, "wrong data type"),
    "modes": (lambda f: {"modal": f.modal[1:]}, "wrong shape"),
    "infinite": (lambda f: {"spin": np.full_like(f.spin, np.inf)}, "not finite"),
    "unknown node": (lambda f: {"nodes": f.nodes + 100}, "no such node"),
    "twice": (lambda f: {"nodes": np.zeros_like(f.nodes)}, "nodes must rise"),
    "one-sided": (lambda f: {"spin": f.spin + np.triu(np.ones(f.spin.shape[-2:]), 1)}, "not symmetric"),
    "interface": (
        lambda f: {"nodes": f.nodes[1:], "translation": f.translation[1:], "rotation": f.rotation[1:]},
        "every interface",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faulty_fields_are_refused(tmp_path: Path, fault: str) -> None:
    """A field that does not fit its link names what is wrong."""
    modal = reduce_link(frame_link(tmp_path))
    assert modal.second_order is not None
    change, message = FAULTS[fault]
    bad = replace(modal, second_order=replace(modal.second_order, **change(modal.second_order)))
    with pytest.raises(FEImportError, match=message) as caught:
        validate(bad, "link.h5")
    assert caught.value.cause == Cause.MODAL_FILE


def ring(folder: Path) -> LinkFile:
    """Members that form a triangle."""
    nodes = {"root": [0.0, 0.0, 0.0], "elbow": [0.3, 0.0, 0.0], "tip": [0.3, 0.4, 0.0]}
    pairs = (("root", "elbow"), ("elbow", "tip"), ("root", "tip"))
    members = [{"from": a, "to": b, "elements": 2, "material": "m", "section": "s"} for a, b in pairs]
    return frame_link(folder, frame={"nodes": nodes, "members": members})


def physical(folder: Path) -> LinkFile:
    """For other programs."""
    return frame_link(folder, reduction={"form": "physical"})


@pytest.mark.parametrize(("make", "reason"), [(ring, "form a ring; cut it"), (physical, "in physical form")])
def test_what_has_no_field_says_so(tmp_path: Path, make: Callable[[Path], LinkFile], reason: str) -> None:
    """The provenance says why, and what to do."""
    modal: ModalModel = reduce_link(make(tmp_path))
    assert modal.second_order is None
    assert reason in modal.provenance["second_order"]


def test_matrices_and_many_modes_have_no_field(tmp_path: Path) -> None:
    """Matrices of a link of few nodes do not tell; too many modes have too many pairs."""
    model = build_model(frame_link(tmp_path))
    shapes = orthonormal(model, MOST_MODES + 1)
    for bare, count, reason in (
        (replace(model, beams=None, kind="matrices"), 2, "no elements"),
        (model, MOST_MODES + 1, "keep fewer"),
        (replace(model, kind="solid"), MOST_MODES_OF_SOLIDS + 1, "modes of a meshed link"),
    ):
        field, statement = second_order(bare, shapes[:, : 6 + count], 0)
        assert field is None
        assert reason in statement


def test_a_rigid_turn_has_the_inertia_of_the_turned_body() -> None:
    """Point masses turned by exp φ: their momenta and spin terms are those of the same body as an inertia."""
    rng = np.random.default_rng(5)
    places, masses = rng.normal(size=(6, 3)), rng.uniform(1, 2, 6)
    places -= masses @ places / masses.sum()
    inertia = sum(m * (x @ x * np.eye(3) - np.outer(x, x)) for m, x in zip(masses, places, strict=True))
    phi = rng.normal(size=(3, 2))
    field = twice_turned(np.broadcast_to(phi, (6, 3, 2)), places)
    momentum, spin = of_masses(masses, places, field)
    turning = of_inertia(inertia, phi, np.zeros((3, 2, 2)))
    q, qd, omega = rng.normal(size=(3, 3))
    q, qd = q[:2], qd[:2]

    def energy(momentum: Array, spin: Array, first: float) -> float:
        second = omega @ np.einsum("iab,a,b->i", momentum[3:], q, qd)
        return float(first + second + omega @ (spin @ q @ q) @ omega / 2)

    moved = [np.cross(phi @ qd, x) + np.cross(omega, np.cross(phi @ q, x)) for x in places]
    points = sum(0.5 * m * v @ v for m, v in zip(masses, moved, strict=True))
    spin_rate = phi @ qd + np.cross(omega, phi @ q)
    assert energy(momentum, spin, points) == pytest.approx(energy(*turning, 0.5 * spin_rate @ inertia @ spin_rate))


@pytest.mark.parametrize("method", ["craig-bampton", "guyan", "craig-chang", "mode-displacement"])
@pytest.mark.parametrize("reference", [0, 1])
def test_factors_of_the_reduction_serve_for_the_field(tmp_path: Path, method: str, reference: int) -> None:
    """Held at either interface: with factors of clamped interfaces, or of the support at the first, as with its own."""
    link = solid_link(tmp_path)
    model = build_model(link)
    basis = REDUCTIONS[method](model, Reduction(method=method), "link")
    shapes, solid = orthonormal(model, 2), model.stress
    assert isinstance(solid, SolidStress)
    assert basis.held is not None
    work, nodes = partial(solid_work, solid, model.dof_map), np.arange(0, len(model.nodes), 7)
    own, shared = (elements_second_order(model, work, shapes, reference, nodes, held) for held in (None, basis.held))
    for name in ("momentum", "spin", "modal", "translation", "rotation"):
        expected = getattr(own, name)
        np.testing.assert_allclose(getattr(shared, name), expected, atol=1e-7 * np.abs(expected).max())

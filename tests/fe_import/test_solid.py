"""Solid assembly: patch test, rigid bodies, beam limits, curved geometry, another code's matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg
import skfem
from scipy.special import beta, factorial
from skfem.helpers import ddot, dot, sym_grad, trace
from skfem.mapping import MappingIsoparametric
from solid_meshes import box, mixed_box, quarter_ring

from fe_import.elements.solid import SolidMaterial, assemble_solid
from fe_import.elements.solid_elements import MESH_ELEMENTS, SOLID_ELEMENTS
from fe_import.elements.solid_mesh import SolidMesh, surface_triangles
from fe_import.elements.solid_stress import solid_stress
from fe_import.errors import Cause, FEImportError
from fe_import.mesh.checks import check_mesh
from fe_import.modal.inertia import mass_properties

STEEL = SolidMaterial(2.1e11, 0.3, 7850.0)
TYPES = sorted(SOLID_ELEMENTS)
OF_SKFEM = [name for name, e in sorted(MESH_ELEMENTS.items()) if isinstance(e.shape, str)]
TOPOLOGY = {
    "tetrahedron": skfem.MeshTet1,
    "wedge": skfem.MeshWedge1,
    "hexahedron": skfem.MeshHex1,
}
SECOND_ORDER = [name for name in TYPES if SOLID_ELEMENTS[name].midpoints]
DISTORTED = [(name, 0.2, 0.0) for name in TYPES] + [(name, 0.15, 0.05) for name in SECOND_ORDER]


def rigid_modes(nodes: np.ndarray) -> np.ndarray:
    """(3 n, 6) unit translations and rotations about the origin."""
    modes = np.zeros((len(nodes), 3, 6))
    modes[:, :, :3] = np.eye(3)
    modes[:, :, 3:] = np.cross(np.eye(3)[None], nodes[:, None, :]).transpose(0, 2, 1)
    return modes.reshape(-1, 6)


EXACT = {  # ∫ x^a y^b z^c over the reference cell
    "tetrahedron": lambda a, b, c: factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 3),
    "wedge": lambda a, b, c: factorial(a) * factorial(b) / factorial(a + b + 2) / (c + 1),
    "hexahedron": lambda a, b, c: 1 / ((a + 1) * (b + 1) * (c + 1)),
    # x = u w, y = v w, w = 1 - z: ∫u^a ∫v^b ∫w^(a+b+2) (1-w)^c, Euler's beta function
    "pyramid": lambda a, b, c: (1 - a % 2) * (1 - b % 2) * 4 / ((a + 1) * (b + 1)) * beta(a + b + 3, c + 1),
}


@pytest.mark.parametrize("name", TYPES)
def test_quadrature_integrates_its_order(name):
    """Monomials of the stated order to rounding."""
    element = SOLID_ELEMENTS[name]
    for order in (element.stiffness_order, element.mass_order):
        (x, y, z), w = element.quadrature(order)
        assert w.min() > 0
        for a in range(order + 1):
            for b in range(order + 1 - a):
                c = order - a - b
                exact = EXACT[element.cell.name](a, b, c)
                assert (w * x**a * y**b * z**c).sum() == pytest.approx(exact, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("name", TYPES)
def test_registry_gradients_follow_our_node_order(name):
    """Σ ∂φ_i/∂X x_i = 1 on the reference cell, to rounding: node order and shape functions match."""
    element = SOLID_ELEMENTS[name]
    if name in OF_SKFEM:
        assert sorted(element.skfem_order) == list(range(element.size))
    np.testing.assert_allclose(element.shape_values(element.reference_nodes.T), np.eye(element.size), atol=1e-14)
    gradients = element.shape_gradients(element.quadrature(element.mass_order)[0])
    jacobian = np.einsum("kc,kdq->qcd", element.reference_nodes, gradients)
    np.testing.assert_allclose(jacobian, np.broadcast_to(np.eye(3), jacobian.shape), atol=1e-13)


@pytest.mark.parametrize(("name", "distortion", "curvature"), DISTORTED)
def test_patch(name, distortion, curvature):
    """Constant strain: no force on inner nodes and exact strain energy, to rounding (1e-12 of the largest).

    σ = λ tr ε 1 + 2 μ ε, energy ½ σ:ε V.
    """
    mesh = box(name, (3, 3, 3), (1.0, 0.8, 1.2), distortion, curvature)
    check_mesh(mesh)
    gradient = np.array([[1.0, 0.3, -0.2], [0.5, -0.7, 0.4], [-0.1, 0.6, 0.9]]) * 1e-3
    _, stiffness = assemble_solid(mesh, [STEEL])
    u = (mesh.nodes @ gradient.T).ravel()
    forces = (stiffness @ u).reshape(-1, 3)
    on_surface = np.unique(np.concatenate(list(mesh.node_sets.values())))
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), on_surface)
    assert inner.size > 0
    assert np.abs(forces[inner]).max() < 1e-12 * np.abs(forces).max()

    strain = (gradient + gradient.T) / 2
    lam, mu = STEEL.lame
    stress = lam * np.trace(strain) * np.eye(3) + 2 * mu * strain
    energy = 0.5 * (stress * strain).sum() * 0.96
    assert u @ stiffness @ u / 2 == pytest.approx(energy, rel=1e-12)


@pytest.mark.parametrize(("name", "distortion", "curvature"), DISTORTED)
def test_rigid_bodies(name, distortion, curvature):
    """Mass, centre, inertia of a box to 1e-12 relative (rounding); the stiffness annihilates rigid motion."""
    a, b, c = size = np.array([1.0, 0.8, 1.2])
    mesh = box(name, (2, 3, 2), tuple(size), distortion, curvature)
    mass, stiffness = assemble_solid(mesh, [STEEL])
    modes = rigid_modes(mesh.nodes)
    properties = mass_properties(modes.T @ mass @ modes)
    total = 7850 * a * b * c
    inertia = total / 12 * np.diag([b**2 + c**2, a**2 + c**2, a**2 + b**2])
    assert properties.mass == pytest.approx(total, rel=1e-12)
    np.testing.assert_allclose(properties.centre_of_mass, size / 2, rtol=1e-12)
    np.testing.assert_allclose(properties.inertia, inertia, rtol=1e-12, atol=1e-12 * inertia.max())

    assert np.abs(stiffness @ modes).max() < 1e-12 * np.abs(stiffness).max()
    assert np.linalg.eigvalsh(mass.toarray())[0] > 0
    eigenvalues = np.linalg.eigvalsh(stiffness.toarray())
    assert np.sum(eigenvalues < 1e-10 * eigenvalues[-1]) == 6
    for matrix in (mass, stiffness):
        assert isinstance(matrix, sp.csc_array)
        assert abs(matrix - matrix.T).max() == 0


@pytest.mark.parametrize(("ratio", "limit"), [(0.0, 0.002), (0.3, 0.02)])
@pytest.mark.parametrize("name", SECOND_ORDER)
def test_slender_cantilever(name, ratio, limit):
    """Tip deflection F L³ / (3 E I) + F L / (κ G A) and first frequency 3.5160 √(E I / (ρ A L⁴)) / 2π.

    L / h = 20, κ = 5/6 (Timoshenko; exact for rectangles at ν = 0). ν = 0: 0.2 %, of which the mesh has
    0.1 %, and the frequency's missing shear and rotary inertia about as much. ν = 0.3: 2 %, since the
    clamped root cannot contract and 12 elements resolve that slowly (24 x 2 x 2 come within 0.8 %, rising).
    """
    length, height = 1.0, 0.05
    mesh = box(name, (12, 1, 1), (length, height, height))
    mass, stiffness = assemble_solid(mesh, [replace(STEEL, poissons_ratio=ratio)])
    free = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.node_sets["x0"])
    dofs = (3 * free[:, None] + np.arange(3)).ravel()
    k, m = stiffness[dofs][:, dofs].tocsc(), mass[dofs][:, dofs].tocsc()

    load = np.zeros((len(mesh.nodes), 3))
    load[mesh.node_sets["x1"], 2] = 1000.0 / len(mesh.node_sets["x1"])
    deflection = np.zeros((len(mesh.nodes), 3))
    deflection[free] = sp.linalg.spsolve(k, load[free].ravel()).reshape(-1, 3)
    bending = 2.1e11 * height**4 / 12
    shear = 5 / 6 * 2.1e11 / (2 * (1 + ratio)) * height**2
    tip = deflection[mesh.node_sets["x1"], 2].mean()
    assert tip == pytest.approx(1000.0 * (length**3 / (3 * bending) + length / shear), rel=limit)

    lowest = scipy.linalg.eigh(k.toarray(), m.toarray(), subset_by_index=[0, 0], eigvals_only=True)[0]
    beam = 3.5160 * np.sqrt(bending / (7850 * height**2 * length**4))
    assert np.sqrt(lowest) == pytest.approx(beam, rel=limit)


@pytest.mark.parametrize("name", TYPES)
def test_frequencies_do_not_depend_on_orientation(name):
    """Free frequencies of a turned and moved mesh, to 1e-9 relative (rounding of the eigensolver)."""
    mesh = box(name, (3, 2, 2), (1.0, 0.2, 0.3), 0.1)
    turn = scipy.linalg.expm(np.cross(np.eye(3), [0.3, -1.1, 0.7]))
    turned = replace(mesh, nodes=mesh.nodes @ turn.T + [3.0, -2.0, 1.0])
    spectra = []
    for m in (mesh, turned):
        mass, stiffness = assemble_solid(m, [STEEL])
        spectra.append(scipy.linalg.eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)[6:20])
    np.testing.assert_allclose(spectra[1], spectra[0], rtol=1e-9)


@pytest.mark.parametrize("name", SECOND_ORDER)
def test_curved_volume_converges(name):
    """Volume of a quarter ring: within 2e-4 with 4 elements, order 4 in their angle (fitted within 0.2)."""
    errors = []
    for around in (4, 8):
        mesh = quarter_ring(name, around, 0.4, 0.5, 0.1)
        check_mesh(mesh)
        mass, _ = assemble_solid(mesh, [replace(STEEL, density=1.0)])
        x = rigid_modes(mesh.nodes)[:, 0]
        errors.append(abs(x @ mass @ x / (np.pi / 4 * (0.5**2 - 0.4**2) * 0.1) - 1))
    assert errors[0] < 2e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.2)


@pytest.mark.parametrize("quadratic", [False, True])
def test_mixed_elements(quadratic):
    """Hexahedron, wedges, pyramids and tetrahedra in one mesh: constant strain, mass and rigid bodies to rounding."""
    mesh = mixed_box(quadratic)
    check_mesh(mesh)
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), surface_triangles(mesh))
    mesh.nodes[inner] += 0.05
    mass, stiffness = assemble_solid(mesh, [STEEL])
    modes = rigid_modes(mesh.nodes)
    properties = mass_properties(modes.T @ mass @ modes)
    assert properties.mass == pytest.approx(3 * 7850, rel=1e-12)
    np.testing.assert_allclose(properties.centre_of_mass, [1.5, 0.5, 0.5], rtol=1e-12)
    np.testing.assert_allclose(np.diag(properties.inertia), 7850 * np.array([0.5, 2.5, 2.5]), rtol=1e-12)
    eigenvalues = np.linalg.eigvalsh(stiffness.toarray())
    assert np.sum(eigenvalues < 1e-10 * eigenvalues[-1]) == 6
    gradient = np.array([[1.0, 0.3, -0.2], [0.5, -0.7, 0.4], [-0.1, 0.6, 0.9]]) * 1e-3
    forces = (stiffness @ (mesh.nodes @ gradient.T).ravel()).reshape(-1, 3)
    assert np.abs(forces[inner]).max() < 1e-12 * np.abs(forces).max()
    dof_map = np.arange(3 * len(mesh.nodes)).reshape(-1, 3)
    field = (mesh.nodes @ gradient.T).ravel()[:, None]
    stress = solid_stress(mesh, [STEEL]).evaluate(field, dof_map, np.arange(len(mesh.nodes)))[:, :, 0]
    strain = (gradient + gradient.T) / 2
    lam, mu = STEEL.lame
    tensor = lam * np.trace(strain) * np.eye(3) + 2 * mu * strain
    expected = tensor[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    np.testing.assert_allclose(stress, np.tile(expected, (len(stress), 1)), rtol=1e-11, atol=1e-11 * tensor.max())


def test_two_materials_add_up():
    """Matrices are linear in the materials: two halves of one material give the whole, to rounding."""
    mesh = box("hex20", (4, 1, 1), distortion=0.1)
    halves = [replace(STEEL, elements=np.arange(2)), replace(STEEL, elements=np.arange(2, 4))]
    for whole, parts in zip(assemble_solid(mesh, [STEEL]), assemble_solid(mesh, halves), strict=True):
        assert abs(whole - parts).max() < 1e-14 * abs(whole).max()
    light = [halves[0], replace(halves[1], density=1000.0)]
    mass, _ = assemble_solid(mesh, light)
    x = rigid_modes(mesh.nodes)[:, 0]
    assert x @ mass @ x == pytest.approx((7850 + 1000) / 2, rel=1e-12)


def assembled_by_scikit_fem(mesh: SolidMesh, material: SolidMaterial) -> tuple[sp.csc_array, sp.csc_array]:
    """Mass and stiffness by scikit-fem's assembly of the weak form with vectorial elements."""
    element = mesh.only.element
    local_nodes = np.ascontiguousarray(mesh.only.elements[:, element.skfem_order].T)
    shape = element.skfem_element
    mesh_class = TOPOLOGY[element.cell.name]
    topology = mesh_class(np.ascontiguousarray(mesh.nodes.T), local_nodes, elem=type(shape))
    lam, mu = material.lame
    matrices = []
    for order, form in (
        (element.mass_order, lambda u, v, _: material.density * dot(u, v)),
        (
            element.stiffness_order,
            lambda u, v, _: lam * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * mu * ddot(sym_grad(u), sym_grad(v)),
        ),
    ):
        basis = skfem.Basis(
            topology,
            skfem.ElementVector(shape),
            mapping=MappingIsoparametric(topology, shape),
            quadrature=element.quadrature(order),
        )
        row = np.empty(basis.N, dtype=np.int64)
        for k in range(len(local_nodes)):
            for component in range(3):
                row[basis.element_dofs[3 * k + component]] = 3 * local_nodes[k] + component
        coo = sp.coo_array(skfem.BilinearForm(form).assemble(basis))
        matrices.append(sp.csc_array((coo.data, (row[coo.coords[0]], row[coo.coords[1]])), shape=coo.shape))
    return matrices[0], matrices[1]


@pytest.mark.parametrize(("name", "distortion", "curvature"), [case for case in DISTORTED if case[0] in OF_SKFEM])
def test_assembly_against_scikit_fem(name, distortion, curvature):
    """Every entry of both matrices, to 1e-12 of the largest: rounding of sums over up to 125 points."""
    mesh = box(name, (3, 2, 2), (1.0, 0.8, 1.2), distortion, curvature)
    for ours, reference in zip(assemble_solid(mesh, [STEEL]), assembled_by_scikit_fem(mesh, STEEL), strict=True):
        assert abs(ours - reference).max() < 1e-12 * abs(reference).max()


def test_chunks_do_not_matter(monkeypatch):
    """Assembly element by element gives the matrices of one go, to rounding."""
    mesh = box("tet10", (2, 1, 1))
    reference = assemble_solid(mesh, [STEEL])
    monkeypatch.setattr("fe_import.elements.solid_assembly._CHUNK_VALUES", 1)
    for one_go, chunked in zip(reference, assemble_solid(mesh, [STEEL]), strict=True):
        assert abs(one_go - chunked).max() < 1e-14 * abs(one_go).max()


FAULTY_MATERIALS = {
    "modulus": ([replace(STEEL, youngs_modulus=0.0)], "materials[0].youngs_modulus"),
    "modulus not a number": ([replace(STEEL, youngs_modulus=np.nan)], "materials[0].youngs_modulus"),
    "incompressible": ([replace(STEEL, poissons_ratio=0.5)], "materials[0].poissons_ratio"),
    "ratio too low": ([replace(STEEL, poissons_ratio=-1.0)], "materials[0].poissons_ratio"),
    "density": ([replace(STEEL, density=-7850.0)], "materials[0].density"),
    "infinite density": ([replace(STEEL, density=np.inf)], "materials[0].density"),
    "unknown element": ([STEEL, replace(STEEL, elements=np.array([8]))], "materials[1].elements"),
    "no material": ([replace(STEEL, elements=np.arange(7))], "element 7"),
    "none at all": ([], "8 elements have no material"),
    "twice": ([STEEL, replace(STEEL, elements=np.array([3]))], "element 3"),
}


@pytest.mark.parametrize("fault", FAULTY_MATERIALS)
def test_faulty_materials(fault):
    materials, named = FAULTY_MATERIALS[fault]
    with pytest.raises(FEImportError) as caught:
        assemble_solid(box("hex8"), materials)
    assert caught.value.cause is Cause.BAD_FIELD
    assert named in str(caught.value)
    assert "box of hex8" in str(caught.value)


def test_node_numbers_are_the_users():
    """Renumbering nodes permutes the rows and nothing else, to rounding."""
    mesh = box("hex27", (2, 1, 1), distortion=0.1)
    new = np.random.default_rng(1).permutation(len(mesh.nodes))
    nodes = np.empty_like(mesh.nodes)
    nodes[new] = mesh.nodes
    row = (3 * new[:, None] + np.arange(3)).ravel()
    renumbered = assemble_solid(SolidMesh.uniform(nodes, new[mesh.only.elements], "hex27"), [STEEL])
    for before, after in zip(assemble_solid(mesh, [STEEL]), renumbered, strict=True):
        assert abs(before - after[row][:, row]).max() < 1e-14 * abs(before).max()

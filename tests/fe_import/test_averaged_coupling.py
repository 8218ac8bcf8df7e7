"""Averaged coupling (RBE3): least squares, virtual work, freedom of the face, and the faults of its faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse.linalg as spla
from solid_meshes import box, quarter_ring

from fe_import.elements.solid import SolidMaterial, assemble_solid
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.elements.solid_stress import solid_stress
from fe_import.errors import Cause, FEImportError
from fe_import.interfaces import averaged as coupling_averaged
from fe_import.interfaces.coupling import Coupling, couple_interfaces
from fe_import.interfaces.dependence import arm
from fe_import.interfaces.faces import InterfaceFace, interface_face
from fe_import.interfaces.weights import area_weights, nodal_areas
from fe_import.model import FEModel

E, NU, L, B = 2.1e11, 0.3, 1.0, 0.1
STEEL = SolidMaterial(E, NU, 7850.0)
ELEMENTS = {"hex20": (10, 2, 2), "tet10": (10, 2, 2)}
UNIT = np.eye(6)


def bar(element_type: str) -> SolidMesh:
    """A square bar along x, length over width 10."""
    return box(element_type, ELEMENTS[element_type], (L, B, B))


def ends(mesh: SolidMesh, coupling: str, weights: str = "uniform", **moved: np.ndarray) -> Coupling:
    """Interfaces on both ends."""
    faces = [interface_face(mesh, name, name, moved.get(name), coupling, weights) for name in ("x0", "x1")]
    return couple_interfaces(mesh.nodes, faces, mesh.source)


def model_of(mesh: SolidMesh, c: Coupling) -> FEModel:
    mass, stiffness = assemble_solid(mesh, [STEEL])
    matrices = c.extended(mass), c.extended(stiffness)
    return FEModel("bar", c.nodes, c.dof_map, *matrices, c.interface_nodes, c.independent, c.coupling, kind="solid")


def clamped(mesh: SolidMesh, c: Coupling) -> np.ndarray:
    """(d, 6) displacements of all components under unit loads at the second interface, the first held."""
    stiffness = c.coupling.T @ c.extended(assemble_solid(mesh, [STEEL])[1]) @ c.coupling
    held, loaded = (np.searchsorted(c.independent, c.dof_map[i.node]) for i in c.interface_nodes)
    free = np.setdiff1d(np.arange(len(c.independent)), held)
    loads = np.zeros((len(c.independent), 6))
    loads[loaded] = UNIT
    moved = np.zeros_like(loads)
    moved[free] = spla.spsolve(stiffness[free][:, free].tocsc(), loads[free])
    return c.coupling @ moved


def divide(monkeypatch: pytest.MonkeyPatch) -> None:
    """Patches already on small faces."""
    monkeypatch.setattr(coupling_averaged, "UNDIVIDED", 10)
    monkeypatch.setattr(coupling_averaged, "PATCH", 9)


@pytest.fixture(params=["whole", "patches"])
def division(request, monkeypatch):
    if request.param == "patches":
        divide(monkeypatch)
    return request.param


@pytest.mark.parametrize("weights", ["uniform", "area"])
@pytest.mark.parametrize("element_type", sorted(ELEMENTS))
def test_rigid_motion_passes_through(element_type, weights, division):
    """Rigid motions of all components follow from their independent rows, off-centre interface nodes too (1e-12)."""
    mesh = bar(element_type)
    c = ends(mesh, "averaged", weights, x1=np.array([L + 0.2, 0.3, -0.1]))
    assert (len(c.nodes) > len(mesh.nodes) + 2) == (division == "patches")
    assert np.isin(c.dof_map[len(mesh.nodes) : len(mesh.nodes) + 2], c.independent).all()
    model = model_of(mesh, c)
    modes = model.rigid_body_modes()
    np.testing.assert_allclose(c.coupling @ modes[c.independent], modes, atol=1e-12)
    stiffness = model.reduced_matrices()[1]
    assert np.abs(stiffness @ modes[c.independent]).max() < 1e-12 * np.abs(stiffness).max()
    assert c.coupling[c.independent].count_nonzero() == len(c.independent)


@pytest.mark.parametrize("element_type", sorted(ELEMENTS))
def test_least_squares(element_type, division):
    """The interface node moves as the rigid motion that fits the weighted displacements best, by a general solver."""
    mesh = bar(element_type)
    place = np.array([L + 0.02, 0.1, 0.0])
    c = ends(mesh, "averaged", "area", x1=place)
    u = c.coupling @ np.random.default_rng(4).normal(size=len(c.independent))
    one = c.interface_nodes[1]
    root = np.sqrt(one.weights)
    moved = u[c.dof_map[one.coupled_nodes, :3]]
    matrix = (root[:, None, None] * arm(mesh.nodes[one.coupled_nodes] - place)).reshape(-1, 6)
    fitted = np.linalg.lstsq(matrix, (root[:, None] * moved).ravel(), rcond=None)[0]
    np.testing.assert_allclose(u[c.dof_map[one.node]], fitted, rtol=1e-9, atol=1e-9 * np.abs(fitted).max())


def test_resultant_is_distributed(division):
    """Virtual work: a load at the interface equals f_k = w_k (F + (J⁻¹ M') × r_k) on the face, for any motion."""
    mesh = bar("hex20")
    place = np.array([L, 0.08, 0.02])
    c = ends(mesh, "averaged", "area", x1=place)
    random = np.random.default_rng(5)
    force, moment = random.normal(size=(2, 3))
    one = c.interface_nodes[1]
    points, w = mesh.nodes[one.coupled_nodes], one.weights
    mean = w @ points
    r = points - mean
    inertia = sum(wk * (rk @ rk * np.eye(3) - np.outer(rk, rk)) for wk, rk in zip(w, r, strict=True))
    turned = np.linalg.solve(inertia, moment + np.cross(place - mean, force))
    nodal = w[:, None] * (force + np.cross(turned, r))
    rounding = 1e-14 * np.abs(turned).max()  # forces of the moment cancel
    np.testing.assert_allclose(nodal.sum(axis=0), force, atol=rounding)
    np.testing.assert_allclose(np.cross(points - place, nodal).sum(axis=0), moment, atol=rounding)
    u = c.coupling @ random.normal(size=(len(c.independent), 3))
    work = np.concatenate([force, moment]) @ u[c.dof_map[one.node]]
    np.testing.assert_allclose(np.einsum("kc,kcm->m", nodal, u[c.dof_map[one.coupled_nodes, :3]]), work, rtol=1e-9)


@pytest.mark.parametrize("element_type", sorted(ELEMENTS))
def test_cantilever_between_the_couplings(element_type):
    """Timoshenko's cantilever: rigid ends within 2 % below its flexibility, averaged ones within 1.2 % above.

    The margins are the end zones, some width of 10 % of the length, that rigid faces stiffen and forces on nodes of a
    coarse face soften; shear factor 10 (1 + ν) / (12 + 11 ν) (Cowper 1966).
    """
    mesh = bar(element_type)
    area, second = B**2, B**4 / 12
    shear = 10 * (1 + NU) / (12 + 11 * NU) * area * E / (2 * (1 + NU))
    bending = L**3 / (3 * E * second) + L / shear
    theory = np.array([L / (E * area), bending, bending, L / (E * second), L / (E * second)])
    flexibility = {}
    for coupling, weights in (("rigid", "uniform"), ("averaged", "area")):
        c = ends(mesh, coupling, weights)
        flexibility[coupling] = clamped(mesh, c)[c.dof_map[c.interface_nodes[1].node]]
    rigid, averaged = (np.diag(f)[[0, 1, 2, 4, 5]] / theory for f in flexibility.values())
    assert ((rigid > 0.98) & (rigid < 1)).all()
    assert ((averaged > 1) & (averaged < 1.012)).all()
    more = flexibility["averaged"] - flexibility["rigid"]
    scale = 1 / np.sqrt(np.diag(flexibility["rigid"]))
    assert np.linalg.eigvalsh(more * np.outer(scale, scale)).min() > -1e-9  # the rigid face is a constraint more


def pulled(element_type: str, coupling: str) -> tuple[np.ndarray, np.ndarray, float]:
    """A thick bar under axial load: axial, other stresses of the held face per F / A, its contraction per ν σ / E."""
    mesh = box(element_type, (4, 2, 2) if element_type == "hex27" else (8, 4, 4), (0.4, B, B))
    c = ends(mesh, coupling, "area" if coupling == "averaged" else "uniform")
    u = clamped(mesh, c)[:, :1]
    face = mesh.node_sets["x0"]
    stress = solid_stress(mesh, [STEEL]).evaluate(u, c.dof_map, face)[:, :, 0] * B**2
    top, bottom = (u[c.dof_map[np.intersect1d(face, mesh.node_sets[s]), 1], 0].mean() for s in ("y1", "y0"))
    return stress[:, 0], stress[:, 1:], (bottom - top) * E * B / NU


@pytest.mark.parametrize("element_type", ["tet4", "hex8", "hex27"])
def test_the_face_may_contract(element_type):
    """A pulled bar between averaged ends is in even tension, to rounding: the stress is F / A, the ends contract.

    Exact where shares of the area are the forces of even tension: linear elements, and Simpson's rule of hex27.
    """
    axial, others, contraction = pulled(element_type, "averaged")
    np.testing.assert_allclose(axial, 1, rtol=1e-9)
    np.testing.assert_allclose(others, 0, atol=1e-9)
    assert contraction == pytest.approx(1, rel=1e-9)


@pytest.mark.parametrize(("element_type", "margin"), [("hex20", 0.1), ("tet10", 0.3)])
def test_stress_at_the_clamp(element_type, margin):
    """Elements whose corners have small shares: nearly even tension; rigid ends do not contract, and concentrate it.

    0.06 and 0.24 above F / A seen on the averaged face, 0.39 and 0.33 on the rigid one.
    """
    axial, _, contraction = pulled(element_type, "averaged")
    rigid, others, none = pulled(element_type, "rigid")
    assert np.abs(axial - 1).max() < margin < np.abs(rigid - 1).max()
    assert contraction == pytest.approx(1, abs=0.25)
    assert none == pytest.approx(0, abs=1e-9)
    assert np.abs(others).max() > 0.4


def test_patches_change_nothing():
    """A face of 225 nodes, divided by itself, against the same one in one piece (1e-7: condition of the stiffness)."""
    mesh = box("hex20", (2, 8, 8), (0.5, 0.2, 0.2))
    divided = ends(mesh, "averaged", "area")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coupling_averaged, "UNDIVIDED", 1000)
        whole = ends(mesh, "averaged", "area")
    assert len(mesh.node_sets["x1"]) == 225
    assert len(divided.nodes) > len(whole.nodes) == len(mesh.nodes) + 2
    a, b = (clamped(mesh, c)[c.dof_map[c.interface_nodes[1].node]] for c in (divided, whole))
    np.testing.assert_allclose(a, b, rtol=1e-7, atol=1e-7 * np.abs(b).max())
    full, patched = (
        (c.coupling.T @ c.extended(assemble_solid(mesh, [STEEL])[1]) @ c.coupling).nnz for c in (whole, divided)
    )
    assert patched < 0.8 * full


@pytest.mark.parametrize("second", ["rigid", "averaged"])
def test_interfaces_may_share_nodes(second):
    """Two faces with a common edge, one averaged: rigid motion is exact, and both interfaces stay independent."""
    mesh = box("hex8", (2, 2, 2))
    faces = [interface_face(mesh, "A", "x0", None, "averaged"), interface_face(mesh, "B", "y0", None, second)]
    c = couple_interfaces(mesh.nodes, faces)
    assert len(c.independent) == 81 + 12 - 6 - (27 if second == "rigid" else 6)
    modes = model_of(mesh, c).rigid_body_modes()
    np.testing.assert_allclose(c.coupling @ modes[c.independent], modes, atol=1e-13)
    mass, stiffness = model_of(mesh, c).reduced_matrices()
    values = la.eigh(stiffness.toarray(), mass.toarray() + 1e-9 * np.eye(mass.shape[0]), eigvals_only=True)
    assert values[6] > 1e4 * abs(values[:6]).max()


def test_rotations_of_shell_nodes():
    """A model with rotations, rows in any order: a rigid face turns them, an averaged one leaves them free."""
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.2]], dtype=float)
    dof_map = np.random.default_rng(0).permutation(24).reshape(4, 6)
    for coupling, independent in (("rigid", 6 + 2), ("averaged", 24 + 2)):
        face = InterfaceFace("A", np.arange(4), np.array([0.5, 0.5, 1.0]), coupling)
        c = couple_interfaces(nodes, [face], dof_map=dof_map, rows=26)  # two rows are modal coordinates
        assert len(c.independent) == independent
        np.testing.assert_array_equal(c.dof_map[4], 26 + np.arange(6))
        turn = np.zeros(32)
        turn[c.dof_map[:, 3]] = 1.0  # about x
        turn[c.dof_map[:, 1]], turn[c.dof_map[:, 2]] = -c.nodes[:, 2], c.nodes[:, 1]
        np.testing.assert_allclose(c.coupling @ turn[c.independent], turn, atol=1e-13)


SHARES = {  # of the area of one face: corner, mid-side node, centre
    "tet4": (1 / 3,),
    "tet10": (3 / 57, 16 / 57),
    "hex8": (1 / 4,),
    "hex20": (3 / 76, 16 / 76),
    "hex27": (1 / 36, 4 / 36, 16 / 36),
}


@pytest.mark.parametrize("element_type", SHARES)
def test_shares_of_the_area(element_type):
    """Diagonal-scaled shares of flat faces in closed form (Hinton, Rock & Zienkiewicz 1976), to rounding."""
    mesh = box(element_type, (1, 1, 1), (1.0, 2.0, 3.0))
    element = mesh.only.element
    face = mesh.only.elements[:1, element.faces[0]]
    found = nodal_areas(mesh.nodes, face)[face[0]]
    corners = mesh.nodes[face[0, : 4 if element.corners == 8 else 3]]
    a, b = corners[1] - corners[0], corners[-1] - corners[0]
    area = np.linalg.norm(np.cross(a, b)) / (1 if element.corners == 8 else 2)
    count = len(corners)
    kinds = np.minimum(np.arange(len(found)) // count, 2)
    np.testing.assert_allclose(found / area, np.array(SHARES[element_type])[kinds], rtol=1e-12)


def test_area_of_a_curved_face():
    """The bore of a ring: π r h / 2, to 1e-4 (eight quadratic arcs); weights positive, sum 1, alike by symmetry."""
    ring = quarter_ring("hex20", 8, 0.4, 0.5, 0.1)
    faces = ring.only.elements[:, ring.only.element.faces].reshape(-1, 8)
    bore = faces[np.isin(faces, ring.node_sets["x0"]).all(axis=1)]
    assert nodal_areas(ring.nodes, bore).sum() == pytest.approx(np.pi / 2 * 0.4 * 0.1, rel=1e-4)
    weights = area_weights(ring, ring.node_sets["x0"], "BORE")
    assert weights.min() > 0
    assert weights.sum() == pytest.approx(1, rel=1e-14)


BLOCK = replace(box("hex8", (2, 2, 2)), source="block.msh")
LINE = np.flatnonzero((BLOCK.nodes[:, 0] == 0) & (BLOCK.nodes[:, 1] == 0))
HERE = np.array([0.0, 0.5, 0.5])
A = InterfaceFace("A", BLOCK.node_sets["x0"], HERE, "averaged")


def narrow() -> Coupling:
    """An edge, one node of it a little aside."""
    nodes = BLOCK.nodes.copy()
    nodes[LINE[1], 0] += 1e-5
    return couple_interfaces(nodes, [replace(A, nodes=LINE)], "block.msh")


def tiny() -> Coupling:
    """Three nodes in a millionth of the link."""
    nodes = np.vstack([BLOCK.nodes, HERE + 1e-7 * np.eye(3)])
    return couple_interfaces(nodes, [InterfaceFace("A", np.arange(27, 30), HERE, "averaged")], "block.msh")


def too_many() -> Coupling:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coupling_averaged, "MOST", 8)
        return couple_interfaces(BLOCK.nodes, [A], "block.msh")


def a_long_line() -> Coupling:
    """A set without parts that can carry rotations: a circle of many nodes."""
    angle = np.linspace(0, 2 * np.pi, 1200, endpoint=False)
    nodes = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return couple_interfaces(nodes, [InterfaceFace("A", np.arange(1200), np.zeros(3), "averaged")], "block.msh")


def couple(*faces: InterfaceFace) -> Coupling:
    return couple_interfaces(BLOCK.nodes, faces, "block.msh")


FAULTS = {
    "edge": (lambda: couple(replace(A, nodes=LINE)), "lie on one line"),
    "nearly an edge": (narrow, "lie on one line", "limit above 0.0001"),
    "a point": (tiny, "lie in one point", "size"),
    "two nodes": (lambda: couple(replace(A, nodes=LINE[:2])), "too few nodes"),
    "same face twice": (lambda: couple(A, replace(A, name="B")), "'B' already move with other interfaces"),
    "on a rigid face": (lambda: couple(replace(A, coupling="rigid"), replace(A, name="B")), "'B' already move"),
    "negative weight": (lambda: couple(replace(A, weights=np.linspace(-1, 1, 9))), "must be positive", "the least -1"),
    "zero weight": (lambda: couple(replace(A, weights=np.arange(9.0))), "must be positive"),
    "weights of others": (lambda: couple(replace(A, weights=np.ones(8))), "8 weights for 9 nodes"),
    "weight not a number": (lambda: couple(replace(A, weights=np.full(9, np.nan))), "must be positive"),
    "nodes without area": (
        lambda: area_weights(BLOCK, np.append(BLOCK.node_sets["x0"], BLOCK.node_sets["x1"][:1]), "A"),
        "1 of the 10 nodes of interface 'A' belong to no element face",
        '"uniform"',
    ),
    "too many nodes": (too_many, "averages too many nodes", "GB", "limit 8"),
    "a line of many nodes": (a_long_line, "averages too many nodes", "1000 nodes that cannot be divided"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faulty_averages(fault):
    provoke, *named = FAULTS[fault]
    with pytest.raises(FEImportError) as caught:
        provoke()
    assert caught.value.cause is Cause.INTERFACE
    for part in ("block.msh", "'A'" if "'B'" not in named[0] else "'B'", *named):
        assert part in str(caught.value)

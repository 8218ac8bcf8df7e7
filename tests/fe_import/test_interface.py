"""Rigid coupling of faces: kinematics, reduction, and every fault as one typed error."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from solid_meshes import box, quarter_ring

from fe_import.elements.solid import SolidMaterial, assemble_solid
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.interfaces.coupling import Coupling, couple_interfaces
from fe_import.interfaces.faces import InterfaceFace, interface_face
from fe_import.mesh.read import read_mesh
from fe_import.model import FEModel

L_MESH = Path(__file__).parents[2] / "data" / "l_shape" / "meshes" / "l_hex20.msh"
STEEL = SolidMaterial(2.1e11, 0.3, 7850.0)


def beam(element_type: str = "hex20") -> SolidMesh:
    return box(element_type, (6, 1, 1), (1.0, 0.1, 0.2))


def both_ends(mesh: SolidMesh) -> Coupling:
    return couple_interfaces(mesh.nodes, [interface_face(mesh, "A", "x0"), interface_face(mesh, "B", "x1")])


def model_of(mesh: SolidMesh) -> FEModel:
    coupling = both_ends(mesh)
    mass, stiffness = assemble_solid(mesh, [STEEL])
    return FEModel(
        name="beam",
        nodes=coupling.nodes,
        dof_map=coupling.dof_map,
        mass=coupling.extended(mass),
        stiffness=coupling.extended(stiffness),
        interface_nodes=coupling.interface_nodes,
        independent=coupling.independent,
        coupling=coupling.coupling,
        kind="solid",
    )


def test_shapes_and_identity():
    """d = 3 n + 6 i; the coupling is the identity on independent dofs, and face nodes are not among them."""
    mesh = beam()
    n = len(mesh.nodes)
    c = both_ends(mesh)
    coupled = len(mesh.node_sets["x0"]) + len(mesh.node_sets["x1"])
    assert c.nodes.shape == (n + 2, 3)
    assert c.dof_map.shape == (n + 2, 6)
    assert c.coupling.shape == (3 * n + 12, 3 * (n - coupled) + 12)
    assert (c.dof_map[:n, 3:] == -1).all()
    assert sorted(c.dof_map[c.dof_map >= 0]) == list(range(3 * n + 12))
    identity = c.coupling[c.independent].toarray()
    np.testing.assert_array_equal(identity, np.eye(len(c.independent)))
    np.testing.assert_array_equal(c.independent[-12:], c.dof_map[n:].ravel())
    for k, (node, name) in enumerate(zip(c.interface_nodes, "AB", strict=True)):
        assert (node.name, node.node, node.coupling) == (name, n + k, "rigid")
        np.testing.assert_array_equal(node.position, c.nodes[node.node])
        assert node.weights.sum() == pytest.approx(1, rel=1e-14)


def test_face_follows_its_node():
    """u = u_c + φ × (x - x_c) for a random motion of one interface node, the other and the inside at rest."""
    mesh = beam()
    c = both_ends(mesh)
    displacement, rotation = np.random.default_rng(2).normal(size=(2, 3))
    independent = np.zeros(len(c.independent))
    independent[-6:] = *displacement, *rotation
    u = (c.coupling @ independent)[: 3 * len(mesh.nodes)].reshape(-1, 3)
    face = mesh.node_sets["x1"]
    expected = displacement + np.cross(rotation, mesh.nodes[face] - c.interface_nodes[1].position)
    np.testing.assert_allclose(u[face], expected, rtol=1e-14, atol=1e-15)
    assert not np.delete(u, face, axis=0).any()


def test_rigid_motion_passes_through():
    """Rigid-body modes of all components follow from their independent rows, to rounding."""
    model = model_of(beam())
    modes = model.rigid_body_modes()
    assert model.coupling is not None
    np.testing.assert_allclose(model.coupling @ modes[model.independent], modes, atol=1e-15)
    mass, stiffness = model.reduced_matrices()
    reduced = modes[model.independent]
    assert np.abs(stiffness @ reduced).max() < 1e-12 * np.abs(stiffness).max()
    np.testing.assert_allclose(
        reduced.T @ mass @ reduced, modes.T @ model.mass @ modes, rtol=1e-12, atol=1e-12
    )


def test_clamped_interface_is_a_cantilever():
    """Lowest frequency with A held: as with all nodes of the face held, to 1e-9 (eigensolver's rounding)."""
    mesh = beam("hex8")
    model = model_of(mesh)
    mass, stiffness = (m.toarray() for m in model.reduced_matrices())
    held = np.isin(model.independent, model.dof_map[model.interface_nodes[0].node])
    ours = scipy.linalg.eigh(stiffness[~held][:, ~held], mass[~held][:, ~held], eigvals_only=True)[0]

    c = couple_interfaces(mesh.nodes, [interface_face(mesh, "B", "x1")])
    m, k = (c.coupling.T @ c.extended(a) @ c.coupling for a in assemble_solid(mesh, [STEEL]))
    held = np.isin(c.independent, c.dof_map[mesh.node_sets["x0"], :3])
    k, m = k.toarray()[~held][:, ~held], m.toarray()[~held][:, ~held]
    assert ours == pytest.approx(scipy.linalg.eigh(k, m, eigvals_only=True)[0], rel=1e-9)


def test_position_is_the_faces_centre():
    """The area's centroid: on the leg's axis of the L; on a graded mesh too, unlike the mean of the nodes."""
    mesh = read_mesh(L_MESH)
    np.testing.assert_allclose(interface_face(mesh, "A", "IFA").position, [0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(interface_face(mesh, "B", "IFB").position, [0.5, 0.5, 0], atol=1e-12)
    graded = box("hex8", (1, 4, 4))
    graded = replace(graded, nodes=graded.nodes**2)
    np.testing.assert_allclose(interface_face(graded, "A", "x0").position, [0, 0.5, 0.5], atol=1e-14)
    assert graded.nodes[graded.node_sets["x0"]].mean(axis=0)[1] < 0.4


def test_position_of_a_set_without_faces():
    """Nodes that span no element face: their mean."""
    mesh = box("hex8", (2, 2, 2))
    corners = np.flatnonzero((mesh.nodes[:, 0] == 0) & np.isin(mesh.nodes[:, 1:], [0, 1]).all(axis=1))
    mesh = replace(mesh, node_sets={"CORNERS": corners})
    np.testing.assert_allclose(interface_face(mesh, "A", "CORNERS").position, [0, 0.5, 0.5], atol=1e-15)


def test_position_off_the_face():
    """A stated position is kept: the axis of a bore lies off the bore's surface."""
    ring = quarter_ring("hex20", 4, 0.4, 0.5, 0.1)
    face = interface_face(ring, "BORE", "x0", np.array([0.0, 0.0, 0.05]))
    c = couple_interfaces(ring.nodes, [face])
    np.testing.assert_array_equal(c.nodes[-1], [0, 0, 0.05])
    turn = np.zeros(len(c.independent))
    turn[-1] = 1.0
    u = (c.coupling @ turn)[: 3 * len(ring.nodes)].reshape(-1, 3)[face.nodes]
    np.testing.assert_allclose((u * ring.nodes[face.nodes]).sum(axis=1), 0, atol=1e-16)  # only along the bore
    np.testing.assert_allclose(np.linalg.norm(u, axis=1), 0.4, rtol=1e-12)


def test_no_interface_couples_nothing():
    mesh = box("tet4", (1, 1, 1))
    c = couple_interfaces(mesh.nodes, [])
    np.testing.assert_array_equal(c.coupling.toarray(), np.eye(24))
    assert c.interface_nodes == ()


MESH = replace(
    box("hex8", (2, 2, 2)),
    element_sets={"BODY": np.arange(8)},
    node_sets={
        **box("hex8", (2, 2, 2)).node_sets,
        "PAIR": np.array([0, 1]),
        "EMPTY": np.zeros(0, dtype=np.int64),
    },
    source="block.msh",
)
EDGE = np.flatnonzero((MESH.nodes[:, 0] == 0) & (MESH.nodes[:, 1] == 0))
HERE = np.array([0.0, 0.5, 0.5])
A = InterfaceFace("A", MESH.node_sets["x0"], HERE)
FAULTS = {
    "missing set": (
        lambda: interface_face(MESH, "A", "x2"),
        "'x2'",
        "not in the mesh",
        "EMPTY, PAIR, x0, x1",
    ),
    "set of elements": (lambda: interface_face(MESH, "A", "BODY"), "'BODY'", "a set of solid elements"),
    "empty set": (lambda: interface_face(MESH, "A", "EMPTY"), "'A'", "too few", "got 0"),
    "two nodes": (lambda: interface_face(MESH, "A", "PAIR"), "'A'", "too few", "got 2"),
    "one node thrice": (lambda: couple(InterfaceFace("A", np.array([4, 4, 4]), HERE)), "'A'", "got 1"),
    "collinear": (lambda: couple(InterfaceFace("A", EDGE, HERE)), "'A'", "one line"),
    "unknown node": (lambda: couple(InterfaceFace("A", np.array([0, 1, 27]), HERE)), "'A'", "got 27", "26"),
    "negative node": (lambda: couple(InterfaceFace("A", np.array([0, 1, -1]), HERE)), "'A'", "got -1"),
    "far away": (lambda: couple(replace(A, position=HERE * 1000)), "'A'", "size 1.414", "limit 14.14"),
    "two numbers": (lambda: couple(replace(A, position=HERE[:2])), "'A'", "three numbers"),
    "not a number": (lambda: couple(replace(A, position=HERE * np.nan)), "'A'", "three numbers"),
    "shared nodes": (
        lambda: couple(A, InterfaceFace("B", MESH.node_sets["y0"], np.array([0.5, 0, 0.5]))),
        "'A' and 'B' share 3 nodes",
    ),
    "one name": (lambda: couple(A, replace(A, nodes=MESH.node_sets["x1"])), "two interfaces are named 'A'"),
}


def couple(*faces: InterfaceFace) -> Coupling:
    return couple_interfaces(MESH.nodes, faces, MESH.source)


@pytest.mark.parametrize("fault", FAULTS)
def test_faulty_interfaces(fault):
    provoke, *named = FAULTS[fault]
    with pytest.raises(FEImportError) as caught:
        provoke()
    assert caught.value.cause is Cause.INTERFACE
    for part in ("block.msh", *named):
        assert part in str(caught.value)

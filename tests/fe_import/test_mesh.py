"""Mesh files: sets, node order, surface, and every fault as one typed error that names file and thing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from solid_meshes import box, quarter_ring

from fe_import.elements.solid_elements import SOLID_ELEMENTS
from fe_import.elements.solid_mesh import SolidMesh, surface_triangles
from fe_import.errors import Cause, FEImportError
from fe_import.interfaces.faces import interface_face
from fe_import.mesh.read import read_mesh

L_MESH = Path(__file__).parents[2] / "data" / "l_shape" / "meshes" / "l_hex20.msh"
TYPES = sorted(SOLID_ELEMENTS)
FACE_TYPES = {3: "triangle", 6: "triangle6", 4: "quad", 8: "quad8", 9: "quad9"}


def written(path: Path, mesh: SolidMesh, **further: object) -> Path:
    """The mesh as a file, in the format of the path's suffix."""
    cells = [(mesh.element.meshio_name, mesh.elements)]
    file_format = "gmsh22" if path.suffix == ".msh" else None  # a suffix that several formats share
    meshio.write(path, meshio.Mesh(mesh.nodes, cells, **further), file_format)
    return path


def test_gmsh_mesh_with_groups():
    """The L mesh: counts of its README, sets on the faces x = 0 and y = 0.5 (coordinates to 1e-12 m)."""
    mesh = read_mesh(L_MESH)
    assert mesh.element_type == "hex20"
    assert mesh.nodes.shape == (963, 3)
    assert mesh.elements.shape == (100, 20)
    np.testing.assert_array_equal(mesh.element_sets["LINK"], np.arange(100))
    assert sorted(mesh.node_sets) == ["IFA", "IFB"]
    for name, axis, value in (("IFA", 0, 0.0), ("IFB", 1, 0.5)):
        on_face = np.flatnonzero(abs(mesh.nodes[:, axis] - value) < 1e-12)
        np.testing.assert_array_equal(mesh.node_sets[name], on_face)
    assert mesh.source == str(L_MESH)


FORMATS = [(n, s) for n in TYPES for s in (".vtu", ".inp", ".msh") if (n, s) != ("hex27", ".inp")]


@pytest.mark.parametrize(("name", "suffix"), FORMATS)
def test_node_order_survives_formats(tmp_path, name, suffix):
    """The same elements through three formats, each with its own node order (positions to 1e-15 relative)."""
    mesh = box(name, (2, 1, 1), (1.0, 2.0, 3.0), 0.1)
    found = read_mesh(written(tmp_path / f"box{suffix}", mesh))
    assert found.element_type == name
    np.testing.assert_allclose(found.nodes[found.elements], mesh.nodes[mesh.elements], rtol=1e-15)


@pytest.mark.parametrize("name", TYPES)
def test_face_groups_become_node_sets(tmp_path, name):
    """A gmsh physical group of boundary faces holds all their nodes, mid-side ones too; MSH 4.1 and 2.2."""
    mesh = box(name, (2, 2, 1))
    faces = mesh.elements[:, mesh.element.faces].reshape(-1, mesh.element.faces.shape[1])
    ends = faces[np.isin(faces, mesh.node_sets["x1"]).all(axis=1)]
    cells = [(mesh.element.meshio_name, mesh.elements), (FACE_TYPES[faces.shape[1]], ends)]
    tags = [np.full(len(mesh.elements), 1), np.full(len(ends), 2)]
    entity = np.tile([3, 1], (len(mesh.nodes), 1))
    entity[np.unique(ends)] = [2, 2]
    for file_format in ("gmsh", "gmsh22"):
        path = tmp_path / f"{file_format}.msh"
        raw = meshio.Mesh(
            mesh.nodes,
            cells,
            cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
            field_data={"BODY": np.array([1, 3]), "END": np.array([2, 2])},
            point_data={"gmsh:dim_tags": entity},
            cell_sets={"BODY": [np.arange(len(mesh.elements)), []], "END": [[], np.arange(len(ends))]},
        )
        meshio.write(path, raw, file_format=file_format, binary=False)
        found = read_mesh(path)
        # the writer sorts nodes by entity
        np.testing.assert_array_equal(found.node_sets["END"], np.flatnonzero(found.nodes[:, 0] == 1))
        assert len(found.node_sets["END"]) == len(mesh.node_sets["x1"])
        np.testing.assert_array_equal(found.element_sets["BODY"], np.arange(len(mesh.elements)))


def test_abaqus_sets(tmp_path):
    """Node and element sets of an Abaqus deck; a deck's node set may repeat an element set's name."""
    mesh = box("hex8", (3, 1, 1))
    path = written(
        tmp_path / "box.inp",
        mesh,
        point_sets={"CLAMP": mesh.node_sets["x0"], "SOFT": np.arange(4)},
        cell_sets={"SOFT": [np.array([1, 2])]},
    )
    found = read_mesh(path)
    np.testing.assert_array_equal(found.node_sets["CLAMP"], mesh.node_sets["x0"])
    np.testing.assert_array_equal(found.node_sets["SOFT"], np.arange(4))
    np.testing.assert_array_equal(found.element_sets["SOFT"], [1, 2])


def test_nodes_of_no_element_are_dropped(tmp_path):
    """Orphans leave, the rest keeps its order, sets follow."""
    mesh = box("tet4", (1, 1, 1))
    shifted = replace(mesh, nodes=np.vstack([[[9.0, 9.0, 9.0]], mesh.nodes]), elements=mesh.elements + 1)
    found = read_mesh(written(tmp_path / "box.inp", shifted, point_sets={"A": mesh.node_sets["z1"] + 1}))
    np.testing.assert_allclose(found.nodes, mesh.nodes, rtol=1e-15)
    np.testing.assert_array_equal(found.node_sets["A"], mesh.node_sets["z1"])


@pytest.mark.parametrize("name", TYPES)
def test_surface_of_a_box(name):
    """Closed (Σ area vectors = 0) and outward (divergence theorem gives the volume), to rounding."""
    size = (1.0, 0.8, 1.2)
    mesh = box(name, (2, 3, 2), size, 0.1)
    a, b, c = mesh.nodes[surface_triangles(mesh)].transpose(1, 0, 2)
    area = np.cross(b - a, c - a) / 2
    np.testing.assert_allclose(area.sum(axis=0), 0, atol=1e-14)
    assert (area * a).sum() / 3 == pytest.approx(np.prod(size), rel=1e-12)
    assert np.linalg.norm(area, axis=1).sum() == pytest.approx(2 * (0.8 + 1.2 + 0.96), rel=1e-12)


@pytest.mark.parametrize(("name", "triangles"), [("tet10", 4), ("hex20", 6), ("hex27", 8)])
def test_curved_surface_uses_mid_side_nodes(name, triangles):
    """All nodes of the surface appear in its triangles; each face gives as many as its nodes allow."""
    mesh = quarter_ring(name, 3, 0.4, 0.5, 0.1)
    found = surface_triangles(mesh)
    on_surface = np.unique(np.concatenate(list(mesh.node_sets.values())))
    np.testing.assert_array_equal(np.unique(found), on_surface)
    assert len(found) == triangles * (14 if name != "tet10" else 28)


def fails(path: Path, cause: Cause, *named: str) -> None:
    """Reading fails with one typed error that names the file and the thing."""
    with pytest.raises(FEImportError) as caught:
        read_mesh(path)
    assert caught.value.cause is cause
    for part in (str(path), *named):
        assert part in str(caught.value)
    assert caught.value.remedy


def test_missing_file(tmp_path):
    fails(tmp_path / "none.msh", Cause.FILE_NOT_FOUND, "no such mesh file")


@pytest.mark.parametrize(
    ("file", "content"),
    [
        ("no_suffix", "hello"),
        ("unknown.xyz", "hello"),
        ("garbage.msh", "hello"),
        ("cut.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 8"),
        ("empty.vtu", ""),
        ("unknown_node.inp", "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n"),
    ],
)
def test_unreadable_files_say_so_silently(tmp_path, capfd, file, content):
    """The reader prints and exits; here it is one error, and nothing reaches the terminal."""
    (tmp_path / file).write_text(content)
    fails(tmp_path / file, Cause.NOT_READABLE, "cannot be read as a mesh: ")
    assert capfd.readouterr() == ("", "")


def test_a_folder_is_not_a_mesh(tmp_path):
    (tmp_path / "folder.msh").mkdir()
    fails(tmp_path / "folder.msh", Cause.NOT_READABLE)


def test_unsupported_elements_are_counted(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]], dtype=float)
    path = tmp_path / "wedge.vtu"
    meshio.write(path, meshio.Mesh(points, [("wedge", np.arange(6)[None])]))
    fails(path, Cause.UNSUPPORTED_ELEMENT, "1 wedge", "tetra10")
    (tmp_path / "odd.inp").write_text("*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D99\n1, 1\n2, 1\n")
    fails(tmp_path / "odd.inp", Cause.UNSUPPORTED_ELEMENT, "2 C3D99")


def test_surface_mesh(tmp_path):
    path = tmp_path / "shell.vtu"
    meshio.write(path, meshio.Mesh(np.eye(3), [("triangle", np.array([[0, 1, 2]]))]))
    fails(path, Cause.MESH, "no solid elements, found 1 triangle")


def test_mixed_types(tmp_path):
    mesh = box("hex8", (1, 1, 1))
    path = tmp_path / "mixed.vtu"
    cells = [("hexahedron", mesh.elements), ("tetra", mesh.elements[:, [0, 1, 3, 4]])]
    meshio.write(path, meshio.Mesh(mesh.nodes, cells))
    fails(path, Cause.MESH, "1 hexahedron, 1 tetra")


def test_elements_with_unknown_nodes(tmp_path):
    """Gmsh's reader numbers a missing node -1."""
    mesh = box("hex8", (1, 1, 1))
    path = written(tmp_path / "box.vtu", mesh)
    raw = meshio.read(path)
    raw.cells[0].data[0, 0] = -1
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(meshio, "read", lambda _: raw)
        fails(path, Cause.MESH, "nodes that are not in the file")


def test_sets_with_foreign_nodes(tmp_path):
    """A reference node outside of the solid: the set is left out, the rest of the mesh is read."""
    mesh = box("hex8", (1, 1, 1))
    orphaned = replace(mesh, nodes=np.vstack([mesh.nodes, [[9.0, 9.0, 9.0]]]))
    sets = {"REFERENCE": np.array([8]), "END": mesh.node_sets["x1"]}
    found = read_mesh(written(tmp_path / "box.inp", orphaned, point_sets=sets))
    assert sorted(found.node_sets) == ["END"]
    assert "1 nodes that belong to no solid element" in found.lost_sets["REFERENCE"]
    with pytest.raises(FEImportError, match="'REFERENCE', which is not usable: it holds 1 nodes"):
        interface_face(found, "A", "REFERENCE")


def test_two_sets_of_one_name(tmp_path, monkeypatch):
    """Faces and points of one name that do not agree: neither is taken."""
    mesh = box("hex8", (1, 1, 1))
    face = mesh.elements[:, [0, 1, 2, 3]]
    path = tmp_path / "box.vtu"
    raw = meshio.Mesh(
        mesh.nodes,
        [("hexahedron", mesh.elements), ("quad", face)],
        point_sets={"FACE": np.arange(3), "SAME": np.unique(face)},
        cell_sets={"FACE": [[], np.array([0])], "SAME": [[], np.array([0])]},
    )
    path.touch()
    monkeypatch.setattr(meshio, "read", lambda _: raw)
    found = read_mesh(path)
    assert sorted(found.node_sets) == ["SAME"]
    assert "two different node sets" in found.lost_sets["FACE"]


def test_faults_are_found_on_reading(tmp_path):
    """The checks run on what is read, and name the file."""
    mesh = box("hex8")
    path = written(tmp_path / "mirrored.vtu", replace(mesh, nodes=mesh.nodes * [1, 1, -1]))
    fails(path, Cause.MESH, "inverted")

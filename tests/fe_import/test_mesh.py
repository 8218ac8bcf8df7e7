"""Mesh files: sets, node order, surface, and every fault as one typed error that names file and thing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from solid_meshes import box, mixed_box, quarter_ring, side

from fe_import.elements.solid_elements import MESH_ELEMENTS
from fe_import.elements.solid_mesh import SolidMesh, surface_triangles
from fe_import.errors import Cause, FEImportError
from fe_import.interfaces.faces import interface_face
from fe_import.mesh.read import read_mesh

L_MESH = Path(__file__).parents[2] / "data" / "l_shape" / "meshes" / "l_hex20.msh"
TYPES = sorted(MESH_ELEMENTS)
FACE_TYPES = {3: "triangle", 6: "triangle6", 4: "quad", 8: "quad8", 9: "quad9"}


def written(path: Path, mesh: SolidMesh, **further: object) -> Path:
    """The mesh as a file, in the format of the path's suffix."""
    cells = [(mesh.only.element.meshio_name, mesh.only.elements)]
    file_format = "gmsh22" if path.suffix == ".msh" else None  # a suffix that several formats share
    meshio.write(path, meshio.Mesh(mesh.nodes, cells, **further), file_format)
    return path


def test_gmsh_mesh_with_groups():
    """The L mesh: counts of its README, sets on the faces x = 0 and y = 0.5 (coordinates to 1e-12 m)."""
    mesh = read_mesh(L_MESH)
    assert mesh.only.type == "hex20"
    assert mesh.nodes.shape == (963, 3)
    assert mesh.only.elements.shape == (100, 20)
    np.testing.assert_array_equal(mesh.element_sets["LINK"], np.arange(100))
    assert sorted(mesh.node_sets) == ["IFA", "IFB"]
    for name, axis, value in (("IFA", 0, 0.0), ("IFB", 1, 0.5)):
        on_face = np.flatnonzero(abs(mesh.nodes[:, axis] - value) < 1e-12)
        np.testing.assert_array_equal(mesh.node_sets[name], on_face)
    assert mesh.source == str(L_MESH)


NOT_WRITTEN = [("hex27", ".inp"), ("pyramid5", ".inp"), ("pyramid13", ".inp")]  # by meshio
FORMATS = [(n, s) for n in TYPES for s in (".vtu", ".inp", ".msh") if (n, s) not in NOT_WRITTEN]


@pytest.mark.parametrize(("name", "suffix"), FORMATS)
def test_node_order_survives_formats(tmp_path, name, suffix):
    """The same elements through three formats, each with its own node order (positions to 1e-15 relative)."""
    mesh = box(name, (2, 1, 1), (1.0, 2.0, 3.0), 0.1)
    found = read_mesh(written(tmp_path / f"box{suffix}", mesh))
    assert found.only.type == name
    np.testing.assert_allclose(found.nodes[found.only.elements], mesh.nodes[mesh.only.elements], rtol=1e-15)


@pytest.mark.parametrize("name", TYPES)
def test_face_groups_become_node_sets(tmp_path, name):
    """A gmsh physical group of boundary faces holds all their nodes, mid-side ones too; MSH 4.1 and 2.2."""
    mesh = box(name, (2, 2, 1))
    ends = side(mesh, "x1")
    cells = [(mesh.only.element.meshio_name, mesh.only.elements), (FACE_TYPES[ends.shape[1]], ends)]
    tags = [np.full(len(mesh.only.elements), 1), np.full(len(ends), 2)]
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
            cell_sets={"BODY": [np.arange(len(mesh.only.elements)), []], "END": [[], np.arange(len(ends))]},
        )
        meshio.write(path, raw, file_format=file_format, binary=False)
        found = read_mesh(path)
        # the writer sorts nodes by entity
        np.testing.assert_array_equal(found.node_sets["END"], np.flatnonzero(found.nodes[:, 0] == 1))
        assert len(found.node_sets["END"]) == len(mesh.node_sets["x1"])
        np.testing.assert_array_equal(found.element_sets["BODY"], np.arange(len(mesh.only.elements)))


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
    shifted = SolidMesh.uniform(np.vstack([[[9.0, 9.0, 9.0]], mesh.nodes]), mesh.only.elements + 1, "tet4")
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
    mesh = box("hex20", (1, 1, 1))
    path = tmp_path / "lagrange.vtu"
    cells = [("hexahedron20", mesh.only.elements), ("wedge18", np.arange(18)[None])]
    meshio.write(path, meshio.Mesh(mesh.nodes, cells))
    fails(path, Cause.UNSUPPORTED_ELEMENT, "1 wedge18", "tetra10")
    (tmp_path / "odd.inp").write_text("*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D99\n1, 1\n2, 1\n")
    fails(tmp_path / "odd.inp", Cause.UNSUPPORTED_ELEMENT, "2 C3D99")


def test_surface_mesh(tmp_path):
    path = tmp_path / "shell.vtu"
    meshio.write(path, meshio.Mesh(np.eye(3), [("triangle", np.array([[0, 1, 2]]))]))
    fails(path, Cause.MESH, "no solid elements, found 1 triangle")


@pytest.mark.parametrize("quadratic", [False, True])
@pytest.mark.parametrize("suffix", [".vtu", ".msh"])
def test_mixed_types(tmp_path, quadratic, suffix):
    """Hexahedra, wedges, pyramids and tetrahedra in one file; elements are counted through all of them."""
    mesh = mixed_box(quadratic)
    path = tmp_path / f"mixed{suffix}"
    cells = [(block.element.meshio_name, block.elements) for block in mesh.blocks]
    file_format = "gmsh22" if suffix == ".msh" else None
    meshio.write(path, meshio.Mesh(mesh.nodes, cells), file_format)
    found = read_mesh(path)
    assert [block.type for block in found.blocks] == [block.type for block in mesh.blocks]
    for ours, theirs in zip(found.blocks, mesh.blocks, strict=True):
        np.testing.assert_allclose(found.nodes[ours.elements], mesh.nodes[theirs.elements], rtol=1e-15)
    a, b, c = found.nodes[surface_triangles(found)].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a) * a).sum() / 6 == pytest.approx(3.0, rel=1e-12)
    _, rows, numbers = list(found.parts(np.array([0, 2, 9])))[3]
    assert (rows.tolist(), numbers.tolist()) == ([1], [9])


def test_sets_of_mixed_elements(tmp_path):
    """Sets of several types, and faces of each; those of the file's order, whatever comes first."""
    mesh = mixed_box()
    lines = ["*NODE", *(f"{k}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(mesh.nodes.tolist(), start=1))]
    label = 0
    for kind, block in zip(("C3D8", "C3D6", "C3D5", "C3D4"), mesh.blocks, strict=True):
        for nodes in block.elements + 1:
            label += 1
            lines += [f"*ELEMENT, TYPE={kind}, ELSET={kind}", ", ".join(map(str, [label, *nodes]))]
    lines += ["*ELSET, ELSET=SOME", "1, 3, 10", "*SURFACE, NAME=END", "C3D4, S1", "*SURFACE, NAME=ROOT", "1, S6"]
    (tmp_path / "mixed.inp").write_text("\n".join(lines))
    found = read_mesh(tmp_path / "mixed.inp")
    np.testing.assert_array_equal(found.element_sets["SOME"], [0, 2, 9])
    np.testing.assert_array_equal(found.node_sets["ROOT"], mesh.node_sets["x0"])
    np.testing.assert_array_equal(found.nodes[found.node_sets["END"]][:, 0], np.full(4, 3.0))


def test_nodes_of_incompatible_modes(tmp_path):
    """CalculiX's C3D8I may name three nodes more, of its incompatible modes; they are no part of the mesh."""
    mesh = box("hex8", (1, 1, 1))
    lines = ["*NODE", *(f"{k}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(mesh.nodes.tolist(), start=1))]
    lines += ["*ELEMENT, TYPE=C3D8I", ", ".join(map(str, [1, *(mesh.only.elements[0] + 1), 90, 91, 92]))]
    (tmp_path / "hex8i.inp").write_text("\n".join(lines))
    np.testing.assert_array_equal(read_mesh(tmp_path / "hex8i.inp").only.elements, mesh.only.elements)


def test_hexahedra_of_27_nodes_in_decks(tmp_path):
    """Abaqus begins the further nodes of C3D27 with the centre, then those of S1 to S6 (its element library)."""
    mesh = box("hex27", (2, 1, 1), (1.0, 2.0, 3.0))
    lines = ["*NODE", *(f"{k}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(mesh.nodes.tolist(), start=1))]
    lines.append("*ELEMENT, TYPE=C3D27")
    for label, nodes in enumerate((mesh.only.elements + 1).tolist(), start=1):
        *others, west, east, south, north, bottom, top, centre = nodes
        lines.append(", ".join(map(str, [label, *others, centre, bottom, top, south, east, north, west])))
    (tmp_path / "hex27.inp").write_text("\n".join(lines))
    found = read_mesh(tmp_path / "hex27.inp")
    np.testing.assert_array_equal(found.only.elements, mesh.only.elements)


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
    assert "1 nodes that belong to no element" in found.lost_sets["REFERENCE"]
    with pytest.raises(FEImportError, match="'REFERENCE', which is not usable: it holds 1 nodes"):
        interface_face(found, "A", "REFERENCE")


def test_two_sets_of_one_name(tmp_path, monkeypatch):
    """Faces and points of one name that do not agree: neither is taken."""
    mesh = box("hex8", (1, 1, 1))
    face = mesh.only.elements[:, [0, 1, 2, 3]]
    path = tmp_path / "box.vtu"
    raw = meshio.Mesh(
        mesh.nodes,
        [("hexahedron", mesh.only.elements), ("quad", face)],
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

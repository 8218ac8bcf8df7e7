"""Sets that mesh files hold and readers lose: found again, or named with the reason."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from link_files import solid_link
from solid_meshes import box, side

from fe_import.elements.solid_elements import MESH_ELEMENTS
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import as_spelt
from fe_import.mesh.read import read_mesh
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link

TYPES = sorted(MESH_ELEMENTS)
ABAQUS = {"tet4": "C3D4", "tet10": "C3D10", "hex8": "C3D8R", "hex20": "C3D20", "wedge6": "C3D6", "wedge15": "C3D15"}
ABAQUS |= {"pyramid5": "C3D5", "pyramid13": "C3D13"}
BAR = box("hex8", (3, 1, 1))
LABELS = 10 * np.arange(len(BAR.nodes)) + 7  # of nodes in decks: neither dense nor from 1


def deck(mesh: SolidMesh, *more: str, split: bool = False) -> str:
    """A deck of the mesh: node k has label 10 k + 7, element k label k + 1; ``split`` gives each a block of its own."""
    rows = [f"{10 * k + 7}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(mesh.nodes.tolist())]
    text = ["** a comment", "*Heading", "bar", "*Node, nset=Half", *rows[: len(rows) // 2]]
    text += ["*NODE", *rows[len(rows) // 2 :]]
    head = f"*Element, type={ABAQUS[mesh.only.type].lower()}, elset=Body"
    for k, nodes in enumerate(mesh.only.elements):
        if k == 0 or split:
            text.append(head)
        fields = [str(k + 1), *(str(10 * n + 7) for n in nodes)]
        text += [",".join(fields[i : i + 8]) + ("," if i + 8 < len(fields) else "") for i in range(0, len(fields), 8)]
    return "\n".join([*text, *more]) + "\n"


def read(folder: Path, *more: str, mesh: SolidMesh = BAR, split: bool = False) -> SolidMesh:
    path = folder / "bar.inp"
    path.write_text(deck(mesh, *more, split=split))
    return read_mesh(path)


END = BAR.node_sets["x1"]
SETS = {  # lines of the deck, node set, what it is
    "node block": (["*NSET, NSET=X", "half"], "X", np.arange(8)),
    "generated": (["*NSET, NSET=X, GENERATE", "7, 27, 10"], "X", np.array([0, 1, 2])),
    "generated twice": (["*NSET, NSET=X, GENERATE", "7, 17, 10", "47, 67, 10,"], "X", np.array([0, 1, 4, 5, 6])),
    "generated, parameter cut short": (["*NSET, NSET=X, GEN", "7, 27, 10"], "X", np.array([0, 1, 2])),
    "deeply nested": (
        [line for k in range(3000) for line in (f"*NSET, NSET=N{k}", f"N{k + 1}")]
        + ["*NSET, NSET=N3000", "7", "*NSET, NSET=X", "N0"],
        "X",
        np.array([0]),
    ),
    "nested twice at each of 60 levels": (
        [line for k in range(60) for line in (f"*NSET, NSET=N{k}", f"N{k + 1}, N{k + 1}")]
        + ["*NSET, NSET=N60", "7", "*NSET, NSET=X", "N0"],
        "X",
        np.array([0]),
    ),
    "generated, step 1": (["*NSET, NSET=X, GENERATE", "7, 7"], "X", np.array([0])),
    "several lines": (["*NSET, NSET=X, UNSORTED", "7,17,", "27"], "X", np.array([0, 1, 2])),
    "stands twice": (["*NSET, NSET=X", "7", "*NSET, NSET=x", "17"], "X", np.array([0, 1])),
    "set of sets": (["*NSET, NSET=X", "A, 17", "*NSET, NSET=a", "7"], "X", np.array([0, 1])),
    "of elements": (["*ELSET, ELSET=LAST", "3", "*NSET, NSET=X, ELSET=last"], "X", np.unique(BAR.only.elements[2])),
    "of elements twice": (
        ["*ELSET, ELSET=LAST", "3", "*NSET, NSET=X, ELSET=last", "*NSET, NSET=X, ELSET=Body", "*NSET, NSET=Z", "X"],
        "Z",
        np.arange(16),
    ),
    "in an assembly": (["*NSET, NSET=X, INSTANCE=BAR-1", "7, 17"], "X", np.array([0, 1])),
    "instance before the label": (["*NSET, NSET=X", "BAR-1.7, BAR-1.17"], "X", np.array([0, 1])),
    "surface": (["*SURFACE, NAME=X, TYPE=ELEMENT", "3, S4"], "X", END),
    "surface of a set": (["*ELSET, ELSET=E", "3", "*SURFACE, NAME=X", "E, s4"], "X", END),
    "surface of nodes": (["*NSET, NSET=E", "7", "*SURFACE, TYPE=NODE, NAME=X", "E,", "17, 1."], "X", np.array([0, 1])),
    "shell elements": (
        ["*ELEMENT, TYPE=S4, ELSET=X", "9," + ",".join(str(LABELS[n]) for n in BAR.only.elements[2, [1, 2, 6, 5]])],
        "X",
        END,
    ),
    "continued keyword": (["*NSET,", "NSET=X", "7, 17"], "X", np.array([0, 1])),
}


@pytest.mark.parametrize("name", SETS)
def test_sets_of_decks(tmp_path, name):
    lines, key, expected = SETS[name]
    found = read(tmp_path, *lines)
    np.testing.assert_allclose(found.nodes, BAR.nodes, atol=0)
    np.testing.assert_array_equal(found.only.elements, BAR.only.elements)
    np.testing.assert_array_equal(found.node_sets[key], expected)
    assert found.lost_sets == {}


@pytest.mark.parametrize("split", [False, True])
def test_element_sets_of_decks(tmp_path, split):
    """Sets of one or several *ELEMENT blocks, generated, made of others; lines without a section mark nodes."""
    more = [
        "*ELSET, ELSET=ENDS, GENERATE",
        "1, 3, 2",
        "*ELSET, ELSET=ALL",
        "Ends, 2",
        "*ELEMENT, TYPE=T3D2, ELSET=M",
        "8, 7, 17",
    ]
    found = read(tmp_path, *more, split=split)
    np.testing.assert_array_equal(found.element_sets["Body"], [0, 1, 2])
    np.testing.assert_array_equal(found.element_sets["ENDS"], [0, 2])
    np.testing.assert_array_equal(found.element_sets["ALL"], [0, 1, 2])
    np.testing.assert_array_equal(found.node_sets["M"], [0, 1])
    assert found.left_out == {"HEADING": 1, "T3D2": 1}


@pytest.mark.parametrize("name", sorted(ABAQUS))
def test_surfaces_of_every_element(tmp_path, name):
    """Faces S1, S2 ... of an element hold the corners and mid-side nodes of one face each; together all of them."""
    mesh = box(name, (1, 1, 1))
    faces = len(mesh.only.element.faces)
    lines = [line for k in range(1, faces + 1) for line in (f"*SURFACE, NAME=F{k}", f"1, S{k}")]
    found = read(tmp_path, *lines, mesh=mesh)
    ours = {frozenset(found.only.elements[0][face].tolist()) for face in found.only.element.faces}
    theirs = {frozenset(found.node_sets[f"F{k}"].tolist()) for k in range(1, faces + 1)}
    assert ours == theirs


LOST = {
    "unknown set": (["*NSET, NSET=X", "NOWHERE"], "needs set 'NOWHERE'"),
    "holds itself": (["*NSET, NSET=X", "Y", "*NSET, NSET=Y", "X"], "holds itself"),
    "unknown node": (["*NSET, NSET=X", "7, 8"], "names node 8"),
    "nodes of an unknown set": (["*NSET, NSET=X, ELSET=NOWHERE"], "needs set 'NOWHERE'"),
    "unknown element": (["*ELSET, ELSET=X", "1, 77"], "names element 77"),
    "no such face": (["*SURFACE, NAME=X", "1, S7"], "no face S7"),
    "free surface": (["*SURFACE, NAME=X", "Body,"], "free surface"),
    "surface of nothing": (["*SURFACE, NAME=X", "12, S1"], "element 12"),
    "surface and nodes": (["*NSET, NSET=X", "7", "*SURFACE, NAME=X", "1, S1"], "a surface with other nodes"),
    "empty": (["*NSET, NSET=X"], ""),
}


@pytest.mark.parametrize("name", LOST)
def test_sets_that_cannot_be_followed(tmp_path, name):
    """The mesh is read without them; whoever names one is told why."""
    lines, reason = LOST[name]
    found = read(tmp_path, *lines)
    assert len(found.only.elements) == 3
    if reason:
        assert reason in found.lost_sets["X"]
        assert "X" not in {**found.node_sets, **found.element_sets}
    else:
        assert len(found.node_sets["X"]) == 0


DECKS = {
    "word for a coordinate": (["*NODE", "999, a, 0, 0"], "expected a finite number"),
    "word for a node": (["*ELEMENT, TYPE=C3D8", "9, a, 2, 3, 4, 5, 6, 7, 8"], "expected a whole number"),
    "half an element": (["*ELEMENT, TYPE=C3D8", "9, 7, 17"], "an element of type C3D8 has 8 nodes"),
    "element of nothing": (["*ELEMENT, TYPE=C3D4", "9, 1, 2, 3, 4"], "needs a node that is not in the deck; got 1"),
    "node twice": (["*NODE", "7, 9., 9., 9."], "node 7 stands twice"),
    "element twice": (["*ELEMENT, TYPE=C3D8", "1, 17, 7, 27, 37, 47, 57, 67, 77"], "element 1 stands twice"),
    "no type": (["*ELEMENT", "9, 7, 17"], "lacks TYPE"),
    "no name": (["*NSET", "7"], "lacks NSET"),
    "spherical": (["*NODE, SYSTEM=S", "999, 1, 2, 3"], "spherical"),
    "include": (["*INCLUDE, INPUT=other.inp"], "no such file, or this one is packed; got 'other.inp'"),
    "includes itself": (["*INCLUDE, INPUT=bar.inp"], "includes itself"),
    "no such part": (["*INSTANCE, NAME=A, PART=P", "*END INSTANCE"], "*INSTANCE A: part P is not there"),
    "two of one name": (
        ["*INSTANCE, NAME=A, PART=P", "*END INSTANCE", "*INSTANCE, NAME=A, PART=P"],
        "an instance of this name stands twice",
    ),
    "a part without instance": (
        ["*PART, NAME=P", "*NODE", "7, 1., 2., 3.", "*END PART", "*INSTANCE, NAME=A", "*END INSTANCE"],
        "*PART P: no instance shows it",
    ),
    "a rotation without angle": (["*INSTANCE, NAME=A, PART=P", "1., 2.", "1., 2., 3."], "two points and an angle"),
    "a rotation without axis": (["*INSTANCE, NAME=A, PART=P", "1., 2.", "1.,2.,3.,1.,2.,3.,9."], "different points"),
    "backwards": (["*NSET, NSET=X, GENERATE", "1, 9, -1"], "step of -1"),
    "giant set": (["*NSET, NSET=X, GENERATE", "1, 999999999999, 1"], "members"),
    "eight fields of a node": (["*NODE", "999, 0.5, 0.5, 0.5, 7, 8, 9, 10"], "a node and three coordinates"),
    "parameters of digits": (["*ELEMENT, TYPE=C3D,8", "9, 7, 17"], "no such parameter; got '8'"),
    "data in the keyword line": (["*NSET, NSET=X, 7, 17"], "no such parameter; got '7'"),
    "misspelled": (["*NSET, NSET=X, GENERTE", "7, 27, 10"], "no such parameter"),
    "nodes of another file": (["*NODE, INPUT=nodes.txt"], "is not followed"),
    "generated nodes": (["*NGEN", "7, 27, 10"], "*NGEN is not followed"),
    "another frame": (["*SYSTEM", "0, 0, 1, 1, 0, 1", "2, 0, 1"], "lie on one line"),
    "cut off": (["*STEP", "*FREQUENCY"], "*STEP without *END STEP"),
    "number with a fraction in a set": (["*NSET, NSET=X", "7, 1.7"], "neither a number nor"),
    "a mark in a set": (["*NSET, NSET=X", "7, &"], "neither a number nor"),
    "a keyword in a set": (["*NSET, NSET=X", "7, 17*NSET, NSET=Y"], "neither a number nor"),
}


@pytest.mark.parametrize("name", DECKS)
def test_faulty_decks(tmp_path, name):
    lines, words = DECKS[name]
    with pytest.raises(FEImportError) as caught:
        read(tmp_path, *lines)
    assert caught.value.cause is Cause.NOT_READABLE
    assert words in str(caught.value)
    assert str(tmp_path / "bar.inp") in str(caught.value)


NODES = ", ".join(str(label) for label in LABELS[:4])
LOSSES = {  # lines of the deck, what the message counts, what the link may be without
    "support": (["*BOUNDARY", "7, 1, 3"], "1 BOUNDARY from line 29", ["BOUNDARY"]),
    "support in a step": (["*STEP", "*Boundary", "7, 1, 3", "*END STEP"], "joints hold it): 1 BOUND", ["Boundary"]),
    "mass without value": (["*ELEMENT, TYPE=MASS, ELSET=M", "9, 7"], "masses (elements without a value", ["MASS"]),
    "springs": (
        ["*ELEMENT, TYPE=SPRING1, ELSET=S", "9, 7", "*SPRING, ELSET=S", "1", "100."],
        "stiffness (a spring to the ground; a link is free): 1 SPRING from line",
        ["SPRING"],
    ),
    "shells": (
        ["*ELEMENT, TYPE=S4, ELSET=S", f"9, {NODES}", "*SHELL SECTION, ELSET=S, MATERIAL=M", "0.01"],
        "shells: 1 SHELL SECTION",
        ["SHELL SECTION"],
    ),
    "beams": (
        ["*ELEMENT, TYPE=B31, ELSET=B", "9, 7, 17", "*BEAM SECTION, ELSET=B, SECTION=RECT", "1., 1."],
        "beams (it lacks MATERIAL): 1 BEAM SECTION",
        ["BEAM SECTION"],
    ),
    "trusses": (
        ["*ELEMENT, TYPE=T3D2, ELSET=T", "9, 7, 17", "*SOLID SECTION, ELSET=T, MATERIAL=M", "1."],
        "trusses or plane elements: 1 T3D2",
        ["T3D2"],
    ),
    "equation": (["*EQUATION", "2", "Half, 1, 1., 17, 1, -1."], "a set of nodes (Half) in an equation", ["EQUATION"]),
    "rigid body": (["*RIGID BODY, ANALYTICAL SURFACE=Half, REF NODE=7"], "ANALYTICALSURFACE is not", ["RIGID BODY"]),
    "multi-point": (["*MPC", "PLANE, 7, 17"], "nodes (a constraint PLANE is not followed): 1 MPC", ["MPC"]),
    "tie": (["*TIE, NAME=T", "A, B"], "(surface A is not there): 1 TIE", ["TIE"]),
    "contact": (["*CONTACT PAIR, INTERACTION=I", "A, B"], "contact: 1 CONTACT PAIR", ["CONTACT PAIR"]),
    "unknown keyword": (["*ODD ONE", "1, 2"], "not known here: 1 ODD ONE", ["ODD ONE"]),
    "unknown element": (["*ELEMENT, TYPE=Q99", "9, 7, 17"], "not known here: 1 Q99", ["Q99"]),
}


@pytest.mark.parametrize("name", LOSSES)
def test_nothing_is_dropped(tmp_path, name):
    """What a link would lack is refused with count and line; asked for, it is left out and counted."""
    lines, words, ignored = LOSSES[name]
    with pytest.raises(FEImportError) as caught:
        read(tmp_path, *lines)
    assert caught.value.cause is Cause.NOT_USED
    assert words in str(caught.value)
    found = read_mesh(tmp_path / "bar.inp", ignored)
    np.testing.assert_array_equal(found.only.elements, BAR.only.elements)
    assert {name.upper() for name in ignored} <= found.left_out.keys()


def test_all_losses_in_one_message(tmp_path):
    """The remedy is the whole list, with what was asked for already; a slip in it is refused."""
    lines = ["*BOUNDARY", "7, 1", "*EQUATION", "2", "7, 1, 1., Half, 1, -1.", "*TIE, NAME=T", "A, B"]
    read_lines = [*lines, "*CLOAD", "7, 1, 2.", "*MATERIAL, NAME=M", "*ELASTIC", "1., .3", "*DENSITY", "1."]
    with pytest.raises(FEImportError, match="BOUNDARY"):
        read(tmp_path, *read_lines)
    with pytest.raises(FEImportError, match=r'ignore = \["TIE", "BOUNDARY", "EQUATION"\]'):
        read_mesh(tmp_path / "bar.inp", ["tie"])
    with pytest.raises(FEImportError, match="did you mean 'BOUNDARY'"):
        read_mesh(tmp_path / "bar.inp", ["BOUNDRY"])


def test_what_is_left_out_is_reported(tmp_path):
    """Counts in the health report and in the provenance of the modal file."""
    link = solid_link(tmp_path, solid={"ignore": ["BOUNDARY"]})
    mesh = tmp_path / "box.inp"
    mesh.write_text(mesh.read_text() + "*BOUNDARY\nx0, 1, 3\n")
    model = reduce_link(link)
    (check,) = [c for c in model.health if c.name.startswith("left out of the mesh file")]
    assert "1 BOUNDARY" in check.name
    assert check.ok
    assert '"BOUNDARY": 1' in model.provenance["left out"]


@pytest.mark.parametrize("name", sorted(ABAQUS))
@pytest.mark.parametrize("packed", [False, True])
def test_properties_of_nastran(tmp_path, name, packed):
    """PID 3 and PID 5 of a deck, through meshio and through gzip."""
    mesh = box(name, (2, 1, 1))
    path = tmp_path / "bar.bdf"
    tags = np.where(np.arange(len(mesh.only.elements)) % 2, 5, 3)
    cells = [(mesh.only.element.meshio_name, mesh.only.elements)]
    meshio.write(path, meshio.Mesh(mesh.nodes, cells, cell_data={"nastran:ref": [tags]}))
    if packed:
        path = tmp_path / "bar.bdf.gz"
        path.write_bytes(gzip.compress((tmp_path / "bar.bdf").read_bytes()))
    found = read_mesh(path)
    np.testing.assert_array_equal(found.element_sets["PID:3"], np.flatnonzero(tags == 3))
    np.testing.assert_array_equal(found.element_sets["PID:5"], np.flatnonzero(tags == 5))
    assert found.source == str(path)


def test_local_coordinates_of_nastran(tmp_path):
    path = tmp_path / "bar.bdf"
    meshio.write(
        path, meshio.Mesh(BAR.nodes, [("hexahedron", BAR.only.elements)], point_data={"nastran:ref": np.full(16, 4)})
    )
    text = path.read_text()
    assert "GRID" in text
    with pytest.raises(FEImportError, match="coordinate system 4 is not there") as caught:
        read_mesh(path)
    assert caught.value.cause is Cause.BAD_REFERENCE


def test_integer_arrays_of_vtu(tmp_path):
    """Numbers per cell and per point are sets; labels of every cell are not, and say so; reals are results."""
    path = tmp_path / "bar.vtu"
    medium = np.array([3, 3, 4])
    raw = meshio.Mesh(
        BAR.nodes,
        [("hexahedron", BAR.only.elements)],
        cell_data={"medium": [medium], "stress": [np.array([1.0, 2.0, 3.0])]},
        point_data={
            "side": (BAR.nodes[:, 0] == 3).astype(int),
            "end": (BAR.nodes[:, 0] == BAR.nodes[:, 0].max()).astype(int),
        },
    )
    meshio.write(path, raw)
    found = read_mesh(path)
    np.testing.assert_array_equal(found.element_sets["medium:3"], [0, 1])
    np.testing.assert_array_equal(found.node_sets["end:1"], END)
    assert not any("stress" in name for name in found.element_sets)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fe_import.mesh.meshio_files.MOST_GROUPS", 1)
        found = read_mesh(path)
    assert "labels and not groups" in found.lost_sets["medium"]


@pytest.mark.parametrize("name", [t for t in TYPES if t != "hex27"])
def test_families_of_med(tmp_path, name):
    """Groups of elements, faces and nodes; elements numbered inside out, as Salome writes them, are turned."""
    mesh = box(name, (2, 1, 1))
    ends = side(mesh, "x1")
    shape = {3: "triangle", 6: "triangle6", 4: "quad", 8: "quad8"}[ends.shape[1]]
    inside_out = mesh.only.elements[:, np.argsort(mesh.only.element.mirrored_order)]
    raw = meshio.Mesh(
        mesh.nodes,
        [(mesh.only.element.meshio_name, inside_out), (shape, ends)],
        cell_data={"cell_tags": [np.full(len(mesh.only.elements), -1), np.full(len(ends), -2)]},
        point_data={"point_tags": np.where(mesh.nodes[:, 0] == 0, 1, 0)},
    )
    raw.cell_tags = {-1: ["BODY"], -2: ["END", "BOTH"]}
    raw.point_tags = {1: ["ROOT"]}
    path = tmp_path / "bar.med"
    meshio.write(path, raw)
    found = read_mesh(path)
    np.testing.assert_array_equal(found.only.elements, mesh.only.elements)
    np.testing.assert_array_equal(found.element_sets["BODY"], np.arange(len(mesh.only.elements)))
    for key in ("END", "BOTH"):
        np.testing.assert_array_equal(found.node_sets[key], mesh.node_sets["x1"])
    np.testing.assert_array_equal(found.node_sets["ROOT"], mesh.node_sets["x0"])


def test_groups_of_gmsh_without_names(tmp_path):
    """Physical groups 7 and 8 that $PhysicalNames does not name."""
    path = tmp_path / "bar.msh"
    tags = [np.array([7, 7, 8])]
    raw = meshio.Mesh(
        BAR.nodes, [("hexahedron", BAR.only.elements)], cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags}
    )
    meshio.write(path, raw, file_format="gmsh22", binary=False)
    found = read_mesh(path)
    np.testing.assert_array_equal(found.element_sets["physical:7"], [0, 1])
    np.testing.assert_array_equal(found.element_sets["physical:8"], [2])


def test_a_group_without_members(tmp_path):
    """gmsh writes the names of groups whose entities were not meshed."""
    path = tmp_path / "bar.msh"
    tags = [np.array([1, 1, 1])]
    raw = meshio.Mesh(
        BAR.nodes,
        [("hexahedron", BAR.only.elements)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"BODY": np.array([1, 3]), "FACE": np.array([2, 2])},
    )
    meshio.write(path, raw, file_format="gmsh22", binary=False)
    found = read_mesh(path)
    assert sorted(found.element_sets) == ["BODY"]
    assert "holds nothing" in found.lost_sets["FACE"]


def test_gmsh_with_entities_in_no_group(tmp_path):
    """meshio cannot read them; the message says what to switch off in gmsh."""
    entities = "$Entities\n0 0 1 1\n1 0 0 0 0 1 1 0 0\n1 0 0 0 1 1 1 1 1 1 1\n$EndEntities\n"
    nodes = "$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n"
    elements = "$Elements\n2 2 1 2\n2 1 2 1\n1 1 2 3\n3 1 4 1\n2 1 2 3 4\n$EndElements\n"
    names = '$PhysicalNames\n1\n3 1 "BODY"\n$EndPhysicalNames\n'
    path = tmp_path / "tet.msh"
    path.write_text(f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{names}{entities}{nodes}{elements}")
    with pytest.raises(FEImportError, match=r"Mesh\.SaveAll = 0") as caught:
        read_mesh(path)
    assert caught.value.cause is Cause.NOT_READABLE


def test_a_lost_set_of_a_region(tmp_path):
    """A material's set that cannot be followed is refused with the reason."""
    link = solid_link(tmp_path, solid={"material": "", "regions": [{"set": "SOFT", "material": "m"}]})
    mesh = tmp_path / "box.inp"
    mesh.write_text(mesh.read_text() + "*ELSET, ELSET=SOFT\nNOWHERE\n")
    with pytest.raises(FEImportError, match="'SOFT' of the mesh is not usable: it needs set 'NOWHERE'") as caught:
        build_model(link)
    assert caught.value.where.endswith("solid.regions[0].set")


def test_names_of_sets_go_without_regard_to_case(tmp_path):
    """Of faces, regions and what is recovered, where one set alone is meant; two that differ in case keep apart."""
    asked = [{"name": "hub", "face": "X0"}, {"name": "hand", "face": "X1"}]
    changes: tuple[dict[str, Any], ...] = ({"interfaces": asked, "recovery": {"sets": ["X1"]}}, {})
    one, other = (reduce_link(solid_link(tmp_path, **each)) for each in changes)
    np.testing.assert_array_equal(one.frequencies_hz, other.frequencies_hz)
    assert as_spelt("BODY", {"Body": 1, "x0": 2}) == "Body"
    assert as_spelt("body", {"Body": 1, "BODY": 2}) == "body"
    assert as_spelt("BODY", {"Body": 1, "BODY": 2}) == "BODY"

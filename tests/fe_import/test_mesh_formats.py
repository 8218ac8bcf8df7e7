"""Universal files, Ansys archives, Exodus files: every element read back to the last digit, sets, what is refused."""

from __future__ import annotations

import gzip
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
from mesh_writers import FOLDED, archive, exodus, rows, universal
from solid_meshes import box

from fe_import.elements.solid_elements import MESH_ELEMENTS
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.mesh.read import read_mesh

DATA = Path(__file__).parents[1] / "data"
WITHOUT_HEX27 = [t for t in MESH_ELEMENTS if t != "hex27"]
IN_UNIVERSAL = [t for t in WITHOUT_HEX27 if not t.startswith("pyramid")]


def same(found: SolidMesh, mesh: SolidMesh, tolerance: float = 0.0) -> None:
    np.testing.assert_array_equal(found.only.elements, mesh.only.elements)
    np.testing.assert_allclose(found.nodes, mesh.nodes, rtol=tolerance, atol=tolerance)


def fails(path: Path, cause: Cause, *words: str) -> None:
    with pytest.raises(FEImportError) as problem:
        read_mesh(path)
    assert problem.value.cause is cause, problem.value
    assert all(word in str(problem.value) for word in (*words, path.name)), problem.value


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", IN_UNIVERSAL)
def test_universal_files(tmp_path: Path, name: str) -> None:
    """All elements that the format has, groups of nodes, elements and faces; lines only mark."""
    mesh = box(name, (2, 1, 2), distortion=0.2)
    found = read_mesh(written(tmp_path, "box.unv", universal(mesh)))
    same(found, mesh)
    for group in ("NODES", "FACES"):
        np.testing.assert_array_equal(found.node_sets[group], mesh.node_sets["x1"])
    np.testing.assert_array_equal(found.element_sets["HALF"], np.arange(len(mesh.only.elements) // 2))
    assert found.left_out["elements of type 11"] == 1


@pytest.mark.parametrize("name", IN_UNIVERSAL)
def test_universal_files_inside_out(tmp_path: Path, name: str) -> None:
    """As Salome numbers elements that were drawn by hand; all of them, so the mesh is turned."""
    mesh = box(name, (2, 1, 1))
    turned = SolidMesh.uniform(
        mesh.nodes, mesh.only.elements[:, np.argsort(mesh.only.element.mirrored_order)], name, node_sets=mesh.node_sets
    )
    same(read_mesh(written(tmp_path, "box.unv", universal(turned))), mesh)


@pytest.mark.parametrize("name", WITHOUT_HEX27)
def test_ansys_archives(tmp_path: Path, name: str) -> None:
    """Hexahedra and what they become when corners fall together; components, one of them a range."""
    mesh = box(name, (2, 1, 2), distortion=0.2)
    found = read_mesh(written(tmp_path, "box.cdb", archive(mesh)))
    same(found, mesh, 1e-13)
    np.testing.assert_array_equal(found.node_sets["NODES"], mesh.node_sets["x1"])
    half = max(len(mesh.only.elements) // 2, 1) if len(mesh.only.elements) > 3 else 1
    np.testing.assert_array_equal(found.element_sets["HALF"], np.arange(half))
    np.testing.assert_array_equal(found.element_sets["MAT:2"], np.arange(len(mesh.only.elements)))


@pytest.mark.parametrize(("name", "element"), [("tet10", 187), ("tet4", 285), ("hex8", 45), ("hex20", 95)])
def test_element_types_of_ansys(tmp_path: Path, name: str, element: int) -> None:
    mesh = box(name, (1, 1, 1))
    same(read_mesh(written(tmp_path, "box.cdb", archive(mesh, element))), mesh, 1e-13)


def test_blocks_of_types(tmp_path: Path) -> None:
    """ETBLOCK instead of ET."""
    block = "ETBLOCK,        1,        1\n(2i9,19a9)\n        1      185        0\n       -1\n"
    same(read_mesh(written(tmp_path, "box.cdb", ARCHIVE.replace("ET,        1,185\n", block))), BOX, 1e-13)


def test_middle_nodes_of_ansys(tmp_path: Path) -> None:
    """All left out make an element linear; some left out are refused."""
    mesh = box("hex8", (2, 1, 1))
    text = archive(mesh).replace(",185", ",186")
    same(read_mesh(written(tmp_path, "without.cdb", text)), mesh, 1e-13)
    curved = box("hex20", (1, 1, 1))
    last = f"{10 * int(curved.only.elements[0, 19]) + 7:9d}"
    text = archive(curved)
    at = text.index(last, text.index("EBLOCK") + 100)
    text = text[:at] + f"{0:9d}" + text[at + 9 :]
    fails(written(tmp_path, "some.cdb", text), Cause.NOT_READABLE, "element 1", "some of its middle nodes")


def test_begin_of_archives_in_columns(tmp_path: Path) -> None:
    """Workbench puts marks behind the first commands, as IGES has them, and names of materials into parameters."""
    begin = [f"{text:72}S{k:7}" for k, text in enumerate(("wbnew--Static Structural 2", "/COM,ANSYS", "NEQIT,0"), 1)]
    begin += [f"{'1H,,1H;,,11HD:/OneDrive,':72}G      1", f"{'S      3G      1P      0':72}T      1"]
    end = ["acp_material_name_5 = 'UD'", "NLDIAG,CONT,ITER", "FC,5,TEMP,,0", "FCUM,ADD", ""]
    text = "\n".join([*begin, ARCHIVE, *end])
    same(read_mesh(written(tmp_path, "box.cdb", text)), BOX, 1e-13)
    fails(written(tmp_path, "d.cdb", text.replace("NEQIT,0", "D,7,UX ")), LOST, "supports", "1 D from line 3")


@pytest.mark.parametrize("suffix", [".vtk", ".vtu"])
@pytest.mark.parametrize("name", ["wedge6", "wedge15"])
def test_wedges_of_vtk(tmp_path: Path, name: str, suffix: str) -> None:
    """VTK's own wedges look out of their first triangle, those that other programs write look in."""
    mesh = box(name, (2, 1, 1))
    turned = mesh.only.elements[:, np.argsort(mesh.only.element.mirrored_order)]
    for elements in (mesh.only.elements, turned):
        meshio.write(tmp_path / f"box{suffix}", meshio.Mesh(mesh.nodes, [(mesh.only.element.meshio_name, elements)]))
        same(read_mesh(tmp_path / f"box{suffix}"), mesh)
    some = np.vstack([turned[:1], mesh.only.elements[1:]])
    meshio.write(tmp_path / f"box{suffix}", meshio.Mesh(mesh.nodes, [(mesh.only.element.meshio_name, some)]))
    fails(tmp_path / f"box{suffix}", Cause.MESH, "1 of 4 elements are inverted")


def test_legacy_files_of_vtk(tmp_path: Path) -> None:
    """Numbers of cells, as ParaView adds them, and cells that are no elements here."""
    meshio.write(tmp_path / "box.vtk", meshio.Mesh(BOX.nodes, [("hexahedron", BOX.only.elements)]), binary=False)
    text = (tmp_path / "box.vtk").read_text()
    ids = "CELL_DATA 2\nFIELD FieldData 1\nCellId 1 2 vtkIdType\n1 2\n"
    found = read_mesh(written(tmp_path, "ids.vtk", text + ids))
    same(found, BOX)
    assert set(found.element_sets) == {"CellId:1", "CellId:2"}
    other = text.replace("CELL_TYPES 2\n12\n12", "CELL_TYPES 2\n15\n15")
    assert other != text
    fails(written(tmp_path, "other.vtk", other), NOT_READ, "cells of type penta_prism")


@pytest.mark.parametrize("suffix", [".med", ".mmed", ".rmed"])
def test_med_files_with_results(tmp_path: Path, suffix: str) -> None:
    """Suffixes of Code_Aster; fields beside the mesh are not read, whatever is in them."""
    path = tmp_path / f"box{suffix}"
    meshio.write(path, meshio.Mesh(BOX.nodes, [("hexahedron", BOX.only.elements)]), file_format="med")
    with h5py.File(path, "a") as data:
        data.create_dataset("CHA/DEPL/step", data=1.0)
    same(read_mesh(path), BOX)
    with h5py.File(path, "a") as data:
        del data["ENS_MAA"]["mesh"].attrs["ESP"]
    fails(path, NOT_READ, "MED of a version before 3", "Salome")


def test_suffixes_of_no_format(tmp_path: Path) -> None:
    fails(written(tmp_path, "box.foo", UNIVERSAL), NOT_READ, "no format of meshes is known by the suffix '.foo'")


@pytest.mark.parametrize(("name", "suffix"), [*((name, ".e") for name in MESH_ELEMENTS), ("hex8", ".g")])
def test_exodus_files(tmp_path: Path, name: str, suffix: str) -> None:
    """Blocks, node sets and side sets, whose names and numbers are kept."""
    mesh = box(name, (2, 1, 2), distortion=0.2, curvature=0.02)
    exodus(tmp_path / f"box{suffix}", mesh)
    found = read_mesh(tmp_path / f"box{suffix}")
    same(found, mesh)
    for group in ("nodeset:3", "FACES"):
        np.testing.assert_array_equal(found.node_sets[group], mesh.node_sets["x1"])
    np.testing.assert_array_equal(found.element_sets["block:5"], np.arange(len(mesh.only.elements)))


def test_an_archive_of_ansys_itself() -> None:
    """HexBeam.cdb of mapdl-archive (MIT), written by Ansys 19.1: a bar of 1 x 1 x 5 in 40 SOLID186."""
    mesh = read_mesh(DATA / "HexBeam.cdb.gz")
    assert (mesh.only.type, mesh.count, len(mesh.nodes)) == ("hex20", 40, 321)
    np.testing.assert_array_equal(np.ptp(mesh.nodes, axis=0), [1, 1, 5])
    corners = mesh.nodes[mesh.only.elements]
    for k, between in enumerate(mesh.only.element.midpoints):
        np.testing.assert_allclose(corners[:, 8 + k], corners[:, list(between)].mean(axis=1), atol=1e-12)
    counts = {name: len(members) for name, members in mesh.element_sets.items()}
    assert counts == {"ECOMP1": 22, "ECOMP2": 22, "MAT:1": 40, "TYPE:1": 40}  # by hand, from the ranges in the file


BOX = box("hex8", (2, 1, 1))
UNIVERSAL, ARCHIVE = universal(BOX), archive(BOX)
ELEMENT = rows([99, 161, 1, 1, 7, 1], 10, 8) + rows([7], 10, 8)  # a lumped mass
NOT_READ, LOST = Cause.NOT_READABLE, Cause.NOT_USED


def after(text: str, mark: str, *lines: str) -> str:
    """Lines put behind the first line that is ``mark``."""
    return text.replace(f"{mark}\n", "\n".join([mark, *lines, ""]), 1)


FAULTS = {
    "cut.unv": (UNIVERSAL[: len(UNIVERSAL) // 2], NOT_READ, "cut off"),
    "mass.unv": (after(UNIVERSAL, "  2412", *ELEMENT), LOST, "point masses: 1 elements of type 161"),
    "cubic.unv": (after(UNIVERSAL, "  2412", *rows([99, 117, 1, 1, 7, 1], 10, 8), "7"), NOT_READ, "cubic"),
    "support.unv": (UNIVERSAL + "    -1\n   755\n    -1\n", LOST, "supports", "data set 755"),
    "shells.unv": (UNIVERSAL + "    -1\n  2448\n    -1\n", LOST, "shells", "elements of type 44"),
    "unknown.unv": (UNIVERSAL + "    -1\n  9999\n    -1\n", LOST, "not known here", "data set 9999"),
    "older.unv": (UNIVERSAL + "    -1\n    15\n    -1\n", NOT_READ, "2411"),
    "binary.unv": (UNIVERSAL + "    -1\n  58b\n", NOT_READ, "binary"),
    "twice.unv": (after(UNIVERSAL, "  2411", *rows([7, 1, 1, 11], 10, 8), "1. 2. 3."), NOT_READ, "node 7 stands twice"),
    "words.unv": (after(UNIVERSAL, "  2411", *rows([1, 1, 1, 11], 10, 8), "1. 2. x"), NOT_READ, "three coordinates"),
    "no nodes.unv": ("    -1\n  2412\n    -1\n", NOT_READ, "no nodes"),
    "stray.unv": ("hello\n" + UNIVERSAL, NOT_READ, "must begin with -1", "hello"),
    "missing node.unv": (UNIVERSAL.replace(*(rows([n, 1, 1, 11], 10, 8)[0] for n in (17, 18))), NOT_READ, "node 17"),
    "cut.cdb": (ARCHIVE[: len(ARCHIVE) // 2], NOT_READ, "cut off"),
    "support.cdb": (ARCHIVE + "D,       7,UX  ,  0.0 , 0.0\n", LOST, "supports", "1 D"),
    "constraint.cdb": (ARCHIVE + "CE,R5.0,DEFN,  1,  2, 0.0\nCE,R5.0,NODE,  1,  7,UX  ,  1.0\n", LOST, "2 CE"),
    "shells.cdb": (ARCHIVE.replace("1,185", "1,181"), LOST, "shells: 2 elements of type 181"),
    "no type.cdb": (ARCHIVE.replace("ET,        1,185", "ET,        2,185"), NOT_READ, "no ET defines"),
    "one by one.cdb": (ARCHIVE + "N,R5.3,LOC, 5, 1.0, 2.0, 3.0\n", NOT_READ, "UNBLOCKED"),
    "count.cdb": (ARCHIVE.replace(f",  {len(BOX.nodes)}\n", ",  99\n"), NOT_READ, "another count of nodes"),
    "elements.cdb": (ARCHIVE.replace("EBLOCK,19,SOLID, 2, 2", "EBLOCK,19,SOLID, 2, 3"), NOT_READ, "count of elements"),
    "unknown.cdb": (ARCHIVE + "FOOBAR, 3\n", LOST, "not known here", "1 FOOBAR"),
    "no width.cdb": (ARCHIVE.replace("(19i9)", "(19i0)"), NOT_READ, "no whole numbers"),
    "giant.cdb": (ARCHIVE.replace("CMBLOCK,HALF    ,ELEM,  1\n(8i10)\n         1", "CMBLOCK,HALF    ,ELEM,  6\n(8i10)\n"
                                  + "".join(f"{n:10d}" for k in range(3) for n in (1, -9_000_000))),
                  NOT_READ, "more members than a mesh"),
    "format.cdb": (ARCHIVE.replace("(3i9,6e21.13e3)", "(3x9)"), NOT_READ, "format of a block"),
    "no head.cdb": (ARCHIVE.replace("CMBLOCK,NODES   ,NODE,  4\n", ""), NOT_READ, "numbers behind the end of a block"),
    "empty.cdb": ("/PREP7\nFINISH\n", NOT_READ, "NBLOCK"),
    "text.e": ("this is no netCDF\n", NOT_READ, "Exodus"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_faults(tmp_path: Path, name: str) -> None:
    text, cause, *words = FAULTS[name]
    fails(written(tmp_path, name, text), cause, *words)


def test_what_is_refused_can_be_left_out(tmp_path: Path) -> None:
    path = written(tmp_path, "box.cdb", FAULTS["support.cdb"][0])
    same(read_mesh(path, ["D"]), BOX, 1e-13)
    path = written(tmp_path, "box.unv", FAULTS["mass.unv"][0])
    same(read_mesh(path, ["elements of type 161"]), BOX)


def test_sides_of_exodus_that_do_not_exist(tmp_path: Path) -> None:
    """A side set that names side 7 of a hexahedron."""
    from scipy.io import netcdf_file

    exodus(tmp_path / "box.e", BOX)
    with netcdf_file(str(tmp_path / "box.e"), "a", mmap=False) as data:
        data.variables["side_ss1"][:] = 7
    fails(tmp_path / "box.e", NOT_READ, "side_ss1", "side 7")


def test_packed(tmp_path: Path) -> None:
    path = tmp_path / "box.unv.gz"
    path.write_bytes(gzip.compress(UNIVERSAL.encode()))
    same(read_mesh(path), BOX)


def test_folded_hexahedra_are_whole() -> None:
    """Every place of the twenty is one of ours, and all of ours are there."""
    for name, (corners, edges) in FOLDED.items():
        size = next(e.size for t, e in MESH_ELEMENTS.items() if t.startswith(name) and e.midpoints)
        assert set(corners) | set(edges) == set(range(size)), name

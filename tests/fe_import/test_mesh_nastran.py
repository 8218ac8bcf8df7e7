"""Bulk data of Nastran as meshes: fields, coordinate systems, sets; what a link would lack is refused, not dropped."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from solid_meshes import BAR, bulk, mixed_box

from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.mesh.read import read_mesh


def read(folder: Path, text: str, *ignore: str) -> SolidMesh:
    (folder / "bar.bdf").write_text(text)
    return read_mesh(folder / "bar.bdf", ignore)


@pytest.mark.parametrize("large", [False, True])
def test_all_shapes(tmp_path, large):
    """Four shapes in one file; fields with nine digits leave 1e-9 of the size."""
    mesh = mixed_box()
    found = read(tmp_path, bulk(mesh, large=large))
    assert [b.type for b in found.blocks] == [b.type for b in mesh.blocks]
    for ours, theirs in zip(found.blocks, mesh.blocks, strict=True):
        np.testing.assert_array_equal(ours.elements, theirs.elements)
    np.testing.assert_allclose(found.nodes, mesh.nodes, atol=3e-9)
    np.testing.assert_array_equal(found.element_sets["PID:2"], np.arange(10))
    assert found.left_out == {"PSOLID": 1, "MAT1": 1}


def test_sets(tmp_path):
    """SET1 cards, sets of the case control over two lines, and those that are none."""
    more = ["SET1,5,7,17", "SET1,6,7,THRU,18", "SET1,7,SKIN"]
    found = read(tmp_path, bulk(BAR, *more, before="SOL 103\nCEND\nSET 3 = 7,\n  17, 27\nDISP=3\n"))
    np.testing.assert_array_equal(found.node_sets["SET:5"], [0, 1])
    np.testing.assert_array_equal(found.node_sets["SET:3"], [0, 1, 2])
    assert found.lost_sets.keys() == {"SET:6", "SET:7"}


def test_surfaces_without_property_mark_nodes(tmp_path):
    face = ",".join(str(10 * n + 7) for n in BAR.only.elements[2, [1, 2, 6, 5]])
    found = read(tmp_path, bulk(BAR, f"CQUAD4,9,44,{face}"))
    np.testing.assert_array_equal(found.node_sets["PID:44"], BAR.node_sets["x1"])
    assert found.left_out["CQUAD4"] == 1


def cylindrical(x: float, y: float, z: float) -> tuple[float, ...]:
    return np.hypot(x, y), np.degrees(np.arctan2(y, x)), z


def spherical(x: float, y: float, z: float) -> tuple[float, ...]:
    polar, angle = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
    return np.sqrt(x * x + y * y + z * z), np.degrees(polar), np.degrees(angle)


@pytest.mark.parametrize(
    ("frame", "given"),
    [
        ("CORD2R,4,,1.,0.,0.,1.,0.,1.\n,1.,1.,0.", lambda x, y, z: (y, 1 - x, z)),
        ("CORD2C,4,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.", cylindrical),
        ("CORD2S,4,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.", spherical),
    ],
)
def test_coordinate_systems(tmp_path, frame, given):
    """Points in a turned, a cylindrical and a spherical system are where they were, to rounding."""
    lines = []
    for line in bulk(BAR, frame).splitlines():
        words = line.split(",")
        if words[0] == "GRID":
            local = given(*map(float, words[3:]))
            line = ",".join([*words[:2], "4", *(repr(float(v)) for v in local)])
        lines.append(line)
    np.testing.assert_allclose(read(tmp_path, "\n".join(lines)).nodes, BAR.nodes, atol=1e-14)
    unnamed = [line.replace(",4,", ",,", 1) if line.startswith("GRID,") else line for line in lines]
    default = "\n".join(unnamed).replace("ENDDATA", "GRDSET,,4\nENDDATA")
    np.testing.assert_allclose(read(tmp_path, default).nodes, BAR.nodes, atol=1e-14)


LOSSES = {  # cards, what the message says, names to ignore
    "masses": (["CMASS2,90,1.5,7,1"], "point masses: 1 CMASS2 from line 26", ["CMASS2"]),
    "turned mass": (
        ["CONM2,90,7,3,1.5", "CORD2C,3,,0.,0.,0.,0.,0.,1.", ",1.,0.,0."],
        "point masses (a CONM2 in a coordinate system that is not rectangular",
        ["CONM2"],
    ),
    "long mass": (["CONM2,90,7,,1.5", ",.1,,.1,,,.1,1."], "a CONM2 with more fields than it has", ["CONM2"]),
    "rigid in part": (["RBE2,90,7,13,17,27"], "(an RBE2 that leaves displacements free, line 26)", ["RBE2"]),
    "two averaged": (["RBE3,90,,7,123,1.,123,17,27"], "fewer than three grid points", ["RBE3"]),
    "bar": (["RBAR,90,7,17,123,456"], "constraints between nodes (an RBAR whose independent", ["RBAR"]),
    "spline": (["RSPLINE,90,.1,7,17,123,27,"], "constraints between nodes: 1 RSPLINE", ["RSPLINE"]),
    "springs": (["CELAS2,90,1.+5,7,1", "CBUSH,91,5,7,17"], "(a spring to the ground", ["CELAS2", "CBUSH"]),
    "supports": (["SPC1,1,123,7"], "supports (a link is free", ["SPC1"]),
    "beams": (["CBAR,90,3,7,17,0.,0.,1.", "PBAR,3,1,.1,.1,.1,.1"], "beams or bars (a beam without length", ["CBAR"]),
    "shells": (["CTRIA3,90,3,7,17,27", "PSHELL,3,1,.1"], "shells: 1 CTRIA3", ["CTRIA3"]),
    "supports of all points": (["GRDSET,,,,,,,123"], "1 PS of GRDSET", ["PS of GRDSET"]),
    "supports of a point": (["GRID,901,,0.,0.,0.,,123"], "1 PS of GRID", ["PS of GRID"]),
    "matrices": (["DMIG,K2GG,0,6,2,0"], "given as matrices: 1 DMIG", ["DMIG"]),
    "unknown": (["ODDONE,1,2"], "not known here: 1 ODDONE", ["ODDONE"]),
}


@pytest.mark.parametrize("name", LOSSES)
def test_nothing_is_dropped(tmp_path, name):
    cards, words, ignored = LOSSES[name]
    with pytest.raises(FEImportError) as caught:
        read(tmp_path, bulk(BAR, *cards))
    assert caught.value.cause is Cause.NOT_USED
    assert words in str(caught.value)
    found = read_mesh(tmp_path / "bar.bdf", ignored)
    np.testing.assert_array_equal(found.only.elements, BAR.only.elements)


FAULTS = {
    "superelement": (bulk(BAR, "BEGIN SUPER=1", "GRID,1,,0.,0.,0."), "BEGIN SUPER: superelements are not read"),
    "include": (bulk(BAR, "INCLUDE 'more.bdf'"), "there is no such file, or"),
    "include before the bulk": (bulk(BAR, before="INCLUDE 'more.bdf'\n"), "there is no such file, or"),
    "includes itself": (bulk(BAR, "INCLUDE 'bar.bdf'"), "it includes itself"),
    "half a name": (bulk(BAR, "INCLUDE 'bar"), "there is no such file, or"),
    "half an element": (bulk(BAR, "CHEXA,90,2,7,17,27,37,47,57"), "another number of grid points"),
    "mid-side nodes missing": (bulk(BAR, "CTETRA,90,2,7,17,27,37,47,"), "another number of grid points"),
    "unknown grid point": (bulk(BAR, "CTETRA,90,2,7,17,27,8"), "needs a grid point that is not there"),
    "element twice": (bulk(BAR, "CTETRA,1,2,7,17,27,37"), "stands twice"),
    "grid twice": (bulk(BAR, "GRID,7"), "stands twice"),
    "ten fields": (bulk(BAR, "GRID,901,,1.,2.,3.,,,,5.,6."), "more fields than a line holds"),
    "word": (bulk(BAR, "GRID,901,,a"), "finite real number"),
    "defaults twice": (bulk(BAR, "GRDSET,,4", "GRDSET,,4"), "this card stands twice"),
    "repeated": (bulk(BAR, "GRID,901,,0.,0.,0.", "=,*(1),=,*(.1)"), "repeated with = and * are not followed"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faulty_files(tmp_path, name):
    text, words = FAULTS[name]
    with pytest.raises(FEImportError) as caught:
        read(tmp_path, text)
    assert caught.value.cause is Cause.NOT_READABLE
    assert words in str(caught.value)
    assert "bar.bdf: line" in str(caught.value)

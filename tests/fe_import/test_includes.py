"""Files that decks and bulk data include: followed, named in messages, part of what a reduction depends on."""

from __future__ import annotations

import gzip

import numpy as np
import pytest
from link_files import solid_link
from solid_meshes import BAR, bulk

from fe_import.errors import FEImportError
from fe_import.mesh.read import read_mesh


def test_included_decks(tmp_path):
    """Nodes in one file, elements in another that it includes from a folder: the mesh of one file."""
    link = solid_link(tmp_path)
    mesh = tmp_path / "box.inp"
    whole, text = read_mesh(mesh), mesh.read_text()
    before = link.content_hash()
    at = text.index("*ELEMENT")
    (tmp_path / "parts").mkdir()
    mesh.write_text("*INCLUDE, INPUT=parts/nodes.inp\n")
    (tmp_path / "parts" / "nodes.inp").write_text(text[:at] + '*Include, Input="elements.inp"\n*NSET, NSET=LAST\n1\n')
    elements = tmp_path / "parts" / "elements.inp"
    elements.write_text(text[at:])
    found = read_mesh(mesh)
    np.testing.assert_array_equal(found.only.elements, whole.only.elements)
    np.testing.assert_array_equal(found.node_sets["LAST"], [0])
    assert "INCLUDE" not in found.left_out
    split = link.content_hash()
    elements.write_text(text[at:] + "*BOUNDARY\n1, 1\n")
    assert len({before, split, link.content_hash()}) == 3
    with pytest.raises(FEImportError, match=r"BOUNDARY from elements\.inp: line"):
        read_mesh(mesh)
    elements.write_text(text[at:] + "*ELEMENT, TYPE=C3D4\n1, x\n")
    with pytest.raises(FEImportError) as caught:
        read_mesh(mesh)
    assert str(elements) in str(caught.value)
    packed = tmp_path / "packed.inp.gz"
    packed.write_bytes(gzip.compress(mesh.read_bytes()))
    with pytest.raises(FEImportError, match="packed"):
        read_mesh(packed)
    elements.write_text(text[at:] + "*INCLUDE, INPUT=../box.inp\n")
    with pytest.raises(FEImportError, match="includes itself"):
        read_mesh(mesh)


def test_included_bulk_data(tmp_path):
    """Grid points in a file of their own, found from the folder of the first one; faults name the file they are in."""
    text = bulk(BAR)
    lines = text.splitlines(keepends=True)
    (tmp_path / "grids.bdf").write_text("".join(line for line in lines if line.startswith("GRID")))
    rest = "".join(line for line in lines if not line.startswith("GRID"))
    (tmp_path / "bar.bdf").write_text(rest.replace("BEGIN BULK\n", "BEGIN BULK\nINCLUDE 'grids.bdf' $ points\n"))
    found = read_mesh(tmp_path / "bar.bdf")
    np.testing.assert_array_equal(found.only.elements, BAR.only.elements)
    with (tmp_path / "grids.bdf").open("a") as file:
        file.write("GRID,7\n")
    with pytest.raises(FEImportError, match=r"grids\.bdf: line 17"):
        read_mesh(tmp_path / "bar.bdf")

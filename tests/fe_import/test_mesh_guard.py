"""Mesh files that would fill memory or disk: refused before they do."""

from __future__ import annotations

import gzip
import resource
import struct
import sys
import tracemalloc

import meshio
import numpy as np
import pytest
from solid_meshes import box

from fe_import.errors import Cause, FEImportError
from fe_import.mesh import guard as mesh_guard
from fe_import.mesh.read import read_mesh

MSH4 = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
MSH2 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
BINARY = b"$MeshFormat\n4.1 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n"
CUBE = box("hex8", (1, 1, 1))
VTU = (
    '<VTKFile type="UnstructuredGrid" version="0.1"><UnstructuredGrid>'
    '<Piece NumberOfPoints="{}" NumberOfCells="{}"/></UnstructuredGrid></VTKFile>'
)
MSH40 = "$MeshFormat\n4 0 8\n$EndMeshFormat\n"
HEADERS = {
    "nodes of MSH 4.0": ("a.msh", f"{MSH40}$Nodes\n1 1000000000000\n", "$Nodes"),
    "nodes of MSH 4": ("a.msh", f"{MSH4}$Nodes\n1 1000000000000 1 8\n", "$Nodes"),
    "blocks of MSH 4": ("a.msh", f"{MSH4}$Nodes\n1000000000000 8 1 8\n", "$Nodes"),
    "elements of MSH 4": ("a.msh", f"{MSH4}$Elements\n99999999999 8 1 8\n", "$Elements"),
    "nodes of binary MSH 4": ("a.msh", BINARY + b"$Nodes\n" + struct.pack("<QQQQ", 1, 10**12, 1, 8), "$Nodes"),
    "nodes of MSH 2": ("a.msh", f"{MSH2}$Nodes\n1000000000000\n1 0 0 0\n", "$Nodes"),
    "elements of MSH 2": ("a.msh", f"{MSH2}$Nodes\n0\n$EndNodes\n$Elements\n1000000000\n", "$Elements"),
    "negative": ("a.msh", f"{MSH2}$Nodes\n-1\n", "$Nodes"),
    "no number": ("a.msh", f"{MSH2}$Nodes\nmany\n", "$Nodes"),
    "not finite": ("a.msh", f"{MSH2}$Nodes\nnan\n", "$Nodes"),
    "points of VTU": ("a.vtu", VTU.format(10**12, 1), "NumberOfPoints"),
    "cells of VTU": ("a.vtu", VTU.format(8, 10**12), "NumberOfCells"),
}


@pytest.mark.parametrize("name", HEADERS)
def test_declared_sizes(tmp_path, name):
    """A count that the file cannot hold is refused within 10 MB."""
    file, content, words = HEADERS[name]
    path = tmp_path / file
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    tracemalloc.start()
    try:
        with pytest.raises(FEImportError) as caught:
            read_mesh(path)
        assert tracemalloc.get_traced_memory()[1] < 1e7
    finally:
        tracemalloc.stop()
    assert caught.value.cause is Cause.MESH
    assert words in str(caught.value)
    assert str(path) in str(caught.value)


def bar(**lines: str) -> str:
    """Two tetrahedra in MSH 4.1, lines replaced."""
    text = (
        f'{MSH4}$PhysicalNames\n1\n3 1 "body"\n$EndPhysicalNames\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 1 0\n'
        "$EndEntities\n$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n"
        "$Elements\n1 2 1 2\n3 1 4 2\n1 1 2 3 4\n2 2 5 3 4\n$EndElements\n"
    )
    for old, new in lines.items():
        assert old in text
        text = text.replace(old, new, 1)
    return text


DAMAGED = {
    "elements cut off": ({"2 2 5 3 4\n$EndElements\n": ""}, "$Elements does not end"),
    "nodes do not end": ({"$EndNodes\n": ""}, "$Nodes does not end"),
    "a number less": ({"0 0 1\n1 1 1\n": "0 0\n1 1 1\n"}, "$Nodes has 27 numbers, 28 are declared"),
    "a number more": ({"1 1 1\n$EndNodes": "1 1 1 1\n$EndNodes"}, "$Nodes has 29 numbers"),
    "an element less": ({"2 2 5 3 4\n": ""}, ""),
    "an element more": ({"2 2 5 3 4\n": "2 2 5 3 4\n3 1 2 3 5\n"}, "$Elements has 5 lines, 4 are declared"),
    "a name more": ({'3 1 "body"\n': '3 1 "body"\n3 2 "more"\n'}, "$PhysicalNames declares another count"),
    "a block less": ({"$Elements\n1 2 1 2\n": "$Elements\n1 3 1 3\n"}, "$Elements declares 3, 2 were found"),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_sections_of_gmsh(tmp_path, name):
    """What is cut off, lost or doubled does not fit the counts."""
    lines, words = DAMAGED[name]
    path = tmp_path / "a.msh"
    path.write_text(bar())
    assert len(read_mesh(path).only.elements) == 2
    path.write_text(bar(**lines))
    with pytest.raises(FEImportError) as caught:
        read_mesh(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)


def cube(path) -> bytes:
    meshio.write(
        path, meshio.Mesh(CUBE.nodes, [("hexahedron", CUBE.only.elements)]), "gmsh22" if path.suffix == ".msh" else None
    )
    return path.read_bytes()


@pytest.mark.parametrize("suffix", [".inp", ".vtu", ".msh", ".bdf"])
def test_packed_meshes(tmp_path, suffix):
    """A .gz file is the file in it; nothing is left behind."""
    path = tmp_path / f"cube{suffix}.gz"
    path.write_bytes(gzip.compress(cube(tmp_path / f"cube{suffix}")))
    found = read_mesh(path)
    np.testing.assert_allclose(found.nodes, CUBE.nodes)
    assert found.source == str(path)


PACKED = {
    "not gzip": (b"*NODE\n", "not a whole gzip file"),
    "cut off": (gzip.compress(b"*NODE\n" * 1000)[:-20], "not a whole gzip file"),
    "damaged": (gzip.compress(b"*NODE\n" * 1000)[:40] + b"????" + gzip.compress(b"*NODE\n" * 1000)[44:], "gzip"),
    "bomb": (gzip.compress(b"\n" * 21_000_000), "far more than meshes do"),
}


@pytest.mark.parametrize("name", PACKED)
def test_faulty_packed_meshes(tmp_path, name):
    content, words = PACKED[name]
    path = tmp_path / "cube.inp.gz"
    path.write_bytes(content)
    with pytest.raises(FEImportError) as caught:
        read_mesh(path)
    assert caught.value.cause is Cause.NOT_READABLE
    assert words in str(caught.value)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux can bound a reader's memory")
def test_memory_of_readers_is_bounded(tmp_path, monkeypatch):
    """A reader that asks for a hundred times what its file may need fails with one error; the bound is lifted again."""
    path = tmp_path / "cube.vtu"
    cube(path)
    monkeypatch.setattr(mesh_guard, "_FREE_MEMORY", 1 << 28)
    monkeypatch.setattr(meshio, "read", lambda _: np.ones(1 << 32))
    before = resource.getrlimit(resource.RLIMIT_AS)
    with pytest.raises(FEImportError, match="Unable to allocate") as caught:
        read_mesh(path)
    assert caught.value.cause is Cause.NOT_READABLE
    assert resource.getrlimit(resource.RLIMIT_AS) == before


@pytest.mark.parametrize("binary", [True, False])
def test_msh_4_0_as_gmsh_names_it(tmp_path, binary):
    """gmsh writes "4", which meshio took for 4.1; a number too many or too few is still found."""
    path = tmp_path / "cube.msh"
    cube = meshio.Mesh(CUBE.nodes, [("hexahedron", CUBE.only.elements)])
    meshio.gmsh._gmsh40.write(path, cube, ".16e", binary)
    data = path.read_bytes().replace(b"\n4.0 ", b"\n4 ", 1)
    path.write_bytes(data)
    np.testing.assert_array_equal(read_mesh(path).only.elements, CUBE.only.elements)
    if not binary:
        path.write_bytes(data.replace(b"$EndNodes", b"1.0\n$EndNodes"))
        with pytest.raises(FEImportError, match=r"\$Nodes has 39 numbers, 38 are declared"):
            read_mesh(path)


def test_msh_1(tmp_path):
    path = tmp_path / "old.msh"
    path.write_text("$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n0\n$ENDELM\n")
    with pytest.raises(FEImportError, match="MSH 1"):
        read_mesh(path)

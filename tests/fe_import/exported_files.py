"""A small solid link as other programs export it: files by name, which tests spoil one at a time."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import scipy.io
import scipy.sparse as sp
from link_files import merged, write_toml
from solid_meshes import box

from fe_import.description.link import LinkFile, load_link
from fe_import.elements.solid import SolidMaterial, assemble_solid
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.reduce import reduce_link

Files = dict[str, bytes]
Table = dict[str, Any]
MATERIAL = SolidMaterial(7e10, 0.33, 2700.0)
INTERFACES = [{"name": "hub", "face": "X0"}, {"name": "hand", "face": "X1"}]
CALCULIX = {
    "matrices": {
        "format": "calculix",
        "files": {"stiffness": "k.sti", "mass": "k.mas", "dofs": "k.dof", "mesh": "k.inp"},
    },
    "interfaces": INTERFACES,
}
MARKET = {
    "matrices": {
        "format": "matrix-market",
        "files": {"stiffness": "k.mtx", "mass": "m.mtx", "dofs": "rows.csv", "mesh": "k.inp"},
    },
    "interfaces": INTERFACES,
}
FRD = merged(CALCULIX, {"matrices": {"files": {"mesh": "k.frd", "sets": "sets.txt"}}})
NPZ = merged(MARKET, {"matrices": {"format": "npz", "files": {"stiffness": "k.npz", "mass": "m.npz"}}})


@cache
def link_matrices() -> tuple[SolidMesh, sp.csc_array, sp.csc_array]:
    """Mesh of 3 x 1 x 1 hexahedra with 8 nodes, its mass and stiffness."""
    mesh = box("hex8", (3, 1, 1), (0.3, 0.02, 0.03))
    return mesh, *assemble_solid(mesh, [MATERIAL])


def deck(mesh: SolidMesh) -> str:
    """Nodes (numbers 10, 20, ...), elements and sets."""
    kind = {"hex8": "C3D8", "tet10": "C3D10"}[mesh.only.type]
    lines = ["** a comment", "*NODE, NSET=Nall"]
    lines += [f"{10 * (k + 1)}, " + ", ".join(map(repr, p.tolist())) for k, p in enumerate(mesh.nodes)]
    lines += [f"*ELEMENT, TYPE={kind}, ELSET=EALL"]
    lines += [", ".join(map(str, [k, *(10 * (e + 1)).tolist()])) for k, e in enumerate(mesh.only.elements, start=1)]
    for name in ("x0", "x1"):
        lines += [f"*NSET, NSET={name}", *(f"{10 * (n + 1)}," for n in mesh.node_sets[name])]
    return "\n".join(lines) + "\n"


@cache
def frd_files() -> Files:
    """Nodes and elements as CalculiX writes them with its results, and the sets beside them."""
    mesh = link_matrices()[0]
    lines = ["    1C", f"    2C{len(mesh.nodes):30d}{1:38d}"]
    for k, position in enumerate(mesh.nodes.tolist(), start=1):
        lines.append(f" -1{10 * k:10d}" + "".join(f"{x:12.5E}" for x in position))
    lines += [" -3", f"    3C{len(mesh.only.elements):30d}{1:38d}"]
    for k, nodes in enumerate(mesh.only.elements.tolist(), start=1):
        lines += [f" -1{k:10d}    1    0    1", " -2" + "".join(f"{10 * (n + 1):10d}" for n in nodes)]
    sets = [f"{name.upper()} {' '.join(str(10 * (n + 1)) for n in mesh.node_sets[name])}\n" for name in ("x0", "x1")]
    return {"k.frd": ("\n".join([*lines, " -3", ""])).encode(), "sets.txt": "".join(sets).encode()}


def calculix_files(mesh: SolidMesh, mass: sp.csc_array, stiffness: sp.csc_array) -> Files:
    """The upper triangles, column by column and with one pattern, the rows and the deck."""
    pattern = sp.triu(abs(stiffness) + abs(mass)).tocsc().tocoo()
    places = sorted(zip(*(c.tolist() for c in pattern.coords), strict=True), key=lambda place: place[::-1])
    result = {
        name: "".join(f"{i + 1} {j + 1} {matrix[i, j]: .13e}\n" for i, j in places).encode()
        for name, matrix in (("k.sti", stiffness.toarray()), ("k.mas", mass.toarray()))
    }
    result["k.dof"] = "".join(f"{10 * (n + 1)}.{c}\n" for n in range(len(mesh.nodes)) for c in (1, 2, 3)).encode()
    return {**result, "k.inp": deck(mesh).encode()}


@cache
def files() -> Files:
    """The link as CalculiX, as Matrix Market, and as NPZ."""
    mesh, mass, stiffness = link_matrices()
    result = calculix_files(mesh, mass, stiffness)
    rows = [f"{10 * (n + 1)}, {c}\n" for n in range(len(mesh.nodes)) for c in ("ux", "uy", "uz")]
    result["rows.csv"] = "".join(["# a comment\n", "node, component\n", *rows]).encode()
    for name, matrix in (("k", stiffness), ("m", mass)):
        result[f"{name}.mtx"] = market(matrix)
        result[f"{name}.npz"] = npz(matrix)
    return result


def market(matrix: sp.csc_array, symmetry: str = "symmetric") -> bytes:
    """SciPy's Matrix Market file."""
    buffer = io.BytesIO()
    scipy.io.mmwrite(buffer, sp.coo_array(matrix), symmetry=symmetry, precision=15)
    return buffer.getvalue()


def npz(matrix: Any) -> bytes:
    """SciPy's NPZ file."""
    buffer = io.BytesIO()
    sp.save_npz(buffer, matrix)
    return buffer.getvalue()


def written(folder: Path, base: Table, spoiled: Files | None = None, changes: Table | None = None) -> LinkFile:
    """The link description and its files in a folder."""
    for name, content in {**files(), **(spoiled or {})}.items():
        (folder / name).write_bytes(content)
    return load_link(write_toml(folder / "link.toml", merged(base, changes or {})))


def swapped(name: str, old: str, new: str) -> Callable[[], Files]:
    """One file with its first ``old`` replaced."""

    def spoil() -> Files:
        text = files()[name].decode()
        assert old in text
        return {name: text.replace(old, new, 1).encode()}

    return spoil


def relined(name: str, change: Callable[[list[str]], list[str]]) -> Callable[[], Files]:
    """One file with its lines changed."""
    return lambda: {name: ("\n".join(change(files()[name].decode().splitlines())) + "\n").encode()}


def raw(name: str, content: bytes | Callable[[bytes], bytes]) -> Callable[[], Files]:
    """One file with another content."""
    return lambda: {name: content if isinstance(content, bytes) else content(files()[name])}


class Fault(NamedTuple):
    """What is wrong with the files or the description, and what the message says about it."""

    name: str
    base: Table
    spoiled: Callable[[], Files]
    changes: Table
    cause: Cause
    words: str


def check_fault(fault: Fault, folder: Path) -> None:
    """One typed error that names a file and a remedy."""
    with pytest.raises(FEImportError) as caught:
        reduce_link(written(folder, fault.base, fault.spoiled(), fault.changes))
    error = caught.value
    assert fault.words in str(error)
    assert error.cause is fault.cause
    assert error.exit_code == 2
    assert str(folder) in error.where
    assert error.remedy
    assert "\n" not in str(error)
    assert len(str(error)) < 600
    assert "np." not in str(error)

"""Meshes of Exodus II files (.e, .exo, .g) of Cubit, MOOSE, libMesh and others: netCDF, classic or on HDF5.

Read here because meshio needs a package for netCDF and loses side sets. Blocks become element sets, side and node sets
node sets, with their names or as ``block:1``, ``sideset:1``, ``nodeset:1``. After L. A. Schoof & V. R. Yarberry, Exodus
II: a finite element data model, SAND92-2137, 1994.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fe_import.elements.solid_elements import MESH_ELEMENTS, SolidElement
from fe_import.errors import Cause, FEImportError
from fe_import.mesh.guard import bounded_memory
from fe_import.mesh.orders import HEIGHT_FIRST
from fe_import.mesh.raw import Block, LeftOut, RawMesh
from fe_import.model import IntArray

_FAMILIES = (  # begin of a type's name: solids by number of nodes
    (r"HEX", {8: "hex8", 20: "hex20", 27: "hex27"}),
    (r"TET", {4: "tet4", 10: "tet10"}),
    (r"(WED|PRI)", {6: "wedge6", 15: "wedge15"}),
    (r"PYR", {5: "pyramid5", 13: "pyramid13"}),
)
_SHAPES = {"TRI": {3: "triangle", 6: "triangle6"}, "QUAD": {4: "quad", 8: "quad8", 9: "quad9"}}
_FLAT = re.compile(r"(?:TRI|QUAD)(?:SHELL)?|SHELL")
_LINES = re.compile(r"BEAM|TRUSS|BAR|EDGE|ROD")
_POINTS = re.compile(r"SPHERE|CIRCLE|POINT|NODEELEM")
_ORDER = {**HEIGHT_FIRST, "hex27": [*HEIGHT_FIRST["hex20"], 23, 24, 25, 26, 21, 22, 20]}
_SIDES = {  # corners of each side, from 1 on
    "hexahedron": ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7)),
    "tetrahedron": ((0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 2, 1)),
    "wedge": ((0, 1, 4, 3), (1, 2, 5, 4), (0, 3, 5, 2), (0, 2, 1), (3, 4, 5)),
    "pyramid": ((0, 1, 4), (1, 2, 4), (2, 3, 4), (0, 4, 3), (0, 3, 2, 1)),
}

Read = Callable[[str], Any]


def read_exodus(path: Path, name: str) -> RawMesh:
    """Read an Exodus II file.

    Parameters
    ----------
    path : Path
    name : str
        To name in messages.

    Raises
    ------
    FEImportError
        ``NOT_READABLE``: not netCDF, or not a mesh in three dimensions.
    """
    try:
        with bounded_memory(path), path.open("rb") as file:
            if file.read(4) == b"\x89HDF":
                import h5py  # heavy

                with h5py.File(path, "r") as data:
                    return _mesh(lambda key: data[key][...] if key in data else None, _attributes(data))
            from scipy.io import netcdf_file  # heavy

            with netcdf_file(str(path), "r", mmap=False) as data:
                known = data.variables
                return _mesh(lambda key: known[key].data if key in known else None, lambda key: known[key].elem_type)
    except FEImportError as problem:
        problem.where = name
        raise
    except Exception as problem:  # whatever stands in the header
        reason = " ".join(f"{type(problem).__name__} {problem}".replace(str(path), "").split())
        raise _fault(f"not an Exodus file, or a damaged one: {reason}", name) from None


def _fault(message: str, where: str = "") -> FEImportError:
    remedy = "write the mesh again, as Exodus II in three dimensions"
    return FEImportError(Cause.NOT_READABLE, f"cannot be read as a mesh: {message}", where=where, remedy=remedy)


def _attributes(data: Any) -> Callable[[str], Any]:
    return lambda key: data[key].attrs["elem_type"]


def _mesh(read: Read, kind_of: Callable[[str], Any]) -> RawMesh:
    mesh = RawMesh(_points(read), [])
    solids: list[SolidElement | None] = []  # of each block, empty ones too
    sizes: list[int] = []
    stated = len(_numbers(read, "eb_prop1"))
    while (cells := read(f"connect{len(sizes) + 1}")) is not None or len(sizes) < stated:
        what = f"connect{len(sizes) + 1}"
        sizes.append(0 if cells is None else len(cells))
        solids.append(None)
        if cells is None or not len(cells):
            continue
        kind = _text(kind_of(what)).upper()
        if kind.startswith("BEX"):
            raise _fault(f"its elements are isogeometric ({kind})")
        if cells.ndim != 2:
            raise _fault(f"{what} is not a table of elements")
        solids[-1] = _add_block(mesh, kind, _indices(cells, len(mesh.points), what))
        shown = _names(read, "eb", len(sizes), "block")
        mesh.cell_sets[shown] = [None] * (len(mesh.blocks) - 1) + [np.arange(len(cells))]
    _add_node_sets(read, mesh)
    _add_side_sets(read, mesh, solids, sizes)
    return mesh


def _numbers(read: Read, key: str) -> Any:
    found = read(key)
    return np.zeros(0, dtype=np.int64) if found is None else found


def _points(read: Read) -> Any:
    together = read("coord")
    axes = [read(f"coord{axis}") for axis in "xyz"] if together is None else list(together)
    if len(axes) != 3 or any(a is None or a.ndim != 1 for a in axes):
        raise _fault("the nodes do not have three coordinates")
    return np.stack([np.asarray(a, dtype=float) for a in axes], axis=1)


def _indices(values: Any, count: int, what: str) -> IntArray:
    """Numbers from 1 on, as indices."""
    index = np.asarray(values).astype(np.int64) - 1
    if index.size and not 0 <= index.min() <= index.max() < count:
        raise _fault(f"{what} refers to what is not in the file")
    return index


def _text(value: Any) -> str:
    return (value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)).strip("\0 ")


def _names(read: Read, kind: str, number: int, prefix: str) -> str:
    """Name of a block or set; by its number where it has none."""
    table, ids = read(f"{kind}_names"), _numbers(read, f"{kind}_prop1")
    row = b"" if table is None or len(table) < number else table[number - 1].tobytes()
    identity = int(ids[number - 1]) if len(ids) >= number else number
    return _text(row.split(b"\0")[0]) or f"{prefix}:{identity}"


def _add_block(mesh: RawMesh, kind: str, cells: IntArray) -> SolidElement | None:
    """A block; the element type when it is a solid one."""
    size = cells.shape[1]
    for pattern, types in _FAMILIES:
        if re.match(pattern, kind):
            if size not in types:
                mesh.blocks.append(Block(f"{kind} of {size} nodes", 3, cells))
                return None
            element = MESH_ELEMENTS[types[size]]
            mesh.blocks.append(Block(element.meshio_name, 3, cells[:, _ORDER.get(element.name, range(size))]))
            return element
    if _FLAT.match(kind):
        corners = "TRI" if size in _SHAPES["TRI"] and not kind.startswith("QUAD") else "QUAD"
        mesh.blocks.append(Block(_SHAPES[corners].get(size, kind.lower()), 2, cells))
        text = "shells" if "SHELL" in kind else ""
    elif _LINES.match(kind) and size in (2, 3):
        mesh.blocks.append(Block("line" if size == 2 else "line3", 1, cells))
        text = "" if kind.startswith("EDGE") else "beams or bars"
    else:
        mesh.blocks.append(Block(kind.lower(), 0, cells))
        text = "point masses" if _POINTS.match(kind) else "what is not known here"
    before = next((item for item in mesh.left_out if item.name == kind), None)
    if before is not None:
        mesh.left_out.remove(before)
    mesh.left_out.append(LeftOut(kind, len(cells) + (before.count if before else 0), "its blocks", text))
    return None


def _add_node_sets(read: Read, mesh: RawMesh) -> None:
    for k in range(1, len(_numbers(read, "ns_prop1")) + 1):
        members = read(f"node_ns{k}")
        if members is not None:
            mesh.point_sets[_names(read, "ns", k, "nodeset")] = _indices(members, len(mesh.points), f"node_ns{k}")


def _add_side_sets(read: Read, mesh: RawMesh, solids: list[SolidElement | None], sizes: list[int]) -> None:
    """Node sets of sides; elements count through all blocks."""
    first = np.cumsum([0, *sizes])
    for k in range(1, len(_numbers(read, "ss_prop1")) + 1):
        elements, sides = read(f"elem_ss{k}"), read(f"side_ss{k}")
        shown = _names(read, "ss", k, "sideset")
        if elements is None or sides is None:
            continue
        index = _indices(elements, int(first[-1]), f"elem_ss{k}")
        found: list[IntArray] = []
        block = np.searchsorted(first, index, side="right") - 1
        filled = np.cumsum([size > 0 for size in sizes]) - 1
        for b in np.unique(block):
            element = solids[b]
            if element is None:
                mesh.lost[shown] = "it holds sides of elements that are no solids"
                break
            cells = mesh.blocks[filled[b]].cells
            for side in np.unique(np.asarray(sides)[block == b]):
                places = _side_nodes(element, int(side), f"side_ss{k}")
                own = index[(block == b) & (np.asarray(sides) == side)] - first[b]
                found.append(cells[own][:, places].ravel())
        else:
            mesh.point_sets[shown] = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *found]))


def _side_nodes(element: SolidElement, side: int, what: str) -> IntArray:
    table = _SIDES[element.cell.name]
    if not 1 <= side <= len(table):
        raise _fault(f"{what} names side {side} of a {element.cell.name}")
    wanted = set(table[side - 1])
    face = next(k for k, corners in enumerate(element.cell.faces) if set(corners) == wanted)
    return element.faces[face]

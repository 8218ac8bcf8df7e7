"""Mesh files: everything that meshio reads -> a checked mesh of one solid element type with its named sets.

meshio stays behind this file; it prints and exits on faulty input, and keeps groups in several places.
"""

from __future__ import annotations

import contextlib
import io
import warnings
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from fe_import.errors import Cause, FEImportError
from fe_import.mesh_checks import check_mesh
from fe_import.model import IntArray
from fe_import.solid_elements import SOLID_ELEMENTS
from fe_import.solid_mesh import SolidMesh, surface_triangles

__all__ = ["SolidMesh", "read_mesh", "surface_triangles"]

_BY_MESHIO_NAME = {element.meshio_name: name for name, element in SOLID_ELEMENTS.items()}


def read_mesh(path: Path) -> SolidMesh:
    """Read and check a mesh file; its format follows from the suffix.

    Named cell sets (gmsh's physical groups, Abaqus' element sets) of solid elements become element sets;
    named cell sets of faces, lines or points, and named point sets, become node sets. Nodes outside of all
    solid elements are dropped; a set that names one is an error.

    Parameters
    ----------
    path : Path

    Returns
    -------
    SolidMesh
        In the file's unit of length.

    Raises
    ------
    FEImportError
        ``FILE_NOT_FOUND``, ``NOT_READABLE``; ``UNSUPPORTED_ELEMENT``: solid elements of another type than
        tet4/10 and hex8/20/27; ``MESH``: no or mixed solid elements, faulty sets, and what ``check_mesh``
        finds; ``DISCONNECTED``.
    """
    if not path.exists():
        raise FEImportError(
            Cause.FILE_NOT_FOUND, "no such mesh file", where=str(path), remedy="check the path"
        )
    raw = _read_with_meshio(path)
    element_type, blocks = _solid_blocks(raw, str(path))
    elements = np.concatenate([raw.cells[b].data for b in blocks]).astype(np.int64)
    points = np.asarray(raw.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or elements.min() < 0 or elements.max() >= len(points):
        raise FEImportError(
            Cause.MESH,
            "elements refer to nodes that are not in the file",
            where=str(path),
            remedy="write the mesh again",
        )
    used = np.unique(elements)
    dense = np.full(len(points), -1, dtype=np.int64)
    dense[used] = np.arange(len(used))
    element_sets, node_sets = _sets(raw, blocks, dense, str(path))
    mesh = SolidMesh(points[used], dense[elements], element_type, element_sets, node_sets, str(path))
    check_mesh(mesh)
    return mesh


def _read_with_meshio(path: Path) -> Any:
    said = io.StringIO()
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            warnings.simplefilter("ignore")
            return meshio.read(path)
    except (Exception, SystemExit) as problem:
        told = "" if isinstance(problem, SystemExit) else f"{type(problem).__name__} {problem}"
        reason = " ".join(f"{said.getvalue()} {told}".split())
        raise FEImportError(
            Cause.NOT_READABLE,
            f"cannot be read as a mesh: {reason}",
            where=str(path),
            remedy="the suffix must name the format (.msh, .inp, .bdf, .vtu, ...); of gmsh take MSH 4.1",
        ) from None


def _solid_blocks(raw: Any, where: str) -> tuple[str, list[int]]:
    blocks = [b for b, block in enumerate(raw.cells) if block.dim == 3 and len(block.data)]
    counts: Counter[str] = Counter()
    for b in blocks:
        counts[raw.cells[b].type] += len(raw.cells[b].data)
    unsupported = [name for name in counts if name not in _BY_MESHIO_NAME]
    if unsupported:
        raise FEImportError(
            Cause.UNSUPPORTED_ELEMENT,
            "solid elements that cannot be assembled: "
            + _listing((name, counts[name]) for name in unsupported),
            where=where,
            limit=", ".join(_BY_MESHIO_NAME),
            remedy="mesh with one of the supported types",
        )
    if not counts:
        found = _listing((block.type, len(block.data)) for block in raw.cells) or "no elements at all"
        raise FEImportError(
            Cause.MESH,
            f"no solid elements, found {found}",
            where=where,
            remedy="export the volume mesh, not its surface",
        )
    if len(counts) > 1:
        raise FEImportError(
            Cause.MESH,
            "mixed solid element types: " + _listing(counts.items()),
            where=where,
            remedy="mesh the link with one type",
        )
    return _BY_MESHIO_NAME[next(iter(counts))], blocks


def _listing(counts: Iterable[tuple[str, int]]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts)


def _named_cells(raw: Any) -> dict[str, list[Any]]:
    """Cells of each set, block by block; MSH 2 and 4.0 keep their groups elsewhere than MSH 4.1 does."""
    named = {str(name): list(cells) for name, cells in raw.cell_sets.items() if not name.startswith("gmsh:")}
    tags = raw.cell_data.get("gmsh:physical")
    if tags is not None and not named:
        for name, (tag, dim) in raw.field_data.items():
            named[str(name)] = [
                np.flatnonzero(t == tag) if block.dim == dim else None
                for t, block in zip(tags, raw.cells, strict=True)
            ]
    return named


def _sets(
    raw: Any, blocks: list[int], dense: IntArray, where: str
) -> tuple[dict[str, IntArray], dict[str, IntArray]]:
    """Element sets and node sets, in the numbering of the checked mesh."""
    offset: dict[int, int] = {}
    for b in blocks:
        offset[b] = sum(len(raw.cells[other].data) for other in offset)
    element_sets: dict[str, IntArray] = {}
    node_sets: dict[str, IntArray] = {}
    for name, per_block in _named_cells(raw).items():
        elements, nodes = [], []
        for b, cells in enumerate(per_block):
            if cells is None or len(cells) == 0:
                continue
            index = _indices(cells, len(raw.cells[b].data) if b < len(raw.cells) else 0, name, where)
            if b in offset:
                elements.append(offset[b] + index)
            else:
                nodes.append(raw.cells[b].data[index].ravel())
        if elements:
            element_sets[name] = np.unique(np.concatenate(elements))
        if nodes or not elements:
            members = np.concatenate(nodes) if nodes else np.zeros(0, dtype=np.int64)
            node_sets[name] = _dense_nodes(members, dense, name, where)
    for key, points in raw.point_sets.items():
        name = str(key)
        found = _dense_nodes(points, dense, name, where)
        if name in node_sets and not np.array_equal(found, node_sets[name]):
            raise FEImportError(
                Cause.MESH,
                f"two different node sets are named {name!r}",
                where=where,
                remedy="give them different names",
            )
        node_sets[name] = found
    return element_sets, node_sets


def _indices(values: Any, count: int, name: str, where: str) -> IntArray:
    try:
        index = np.asarray(values)
    except ValueError:
        index = np.zeros(0)
    integers = index.ndim == 1 and index.dtype.kind in "iu"
    if not integers or (index.size and (index.min() < 0 or index.max() >= count)):
        raise FEImportError(
            Cause.MESH,
            f"set {name!r} refers to what is not in the file",
            where=where,
            remedy="list the members themselves; sets made of other sets are not followed",
        )
    return index.astype(np.int64)


def _dense_nodes(points: Any, dense: IntArray, name: str, where: str) -> IntArray:
    index = dense[np.unique(_indices(points, len(dense), name, where))]
    if (index < 0).any():
        raise FEImportError(
            Cause.MESH,
            f"set {name!r} holds {(index < 0).sum()} nodes that belong to no solid element",
            where=where,
            remedy="remove them from the set or the set from the file; interface nodes are made here",
        )
    return index

"""Mesh files: our own readers and everything that meshio reads -> a checked mesh of solids or shells with named sets.

meshio stays behind `fe_import.mesh.meshio_files`; what it does not read, or not whole, has readers of its own.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from fe_import.elements.attachments import Attachment, nodes_of, renumbered
from fe_import.elements.shell_elements import SHELL_ELEMENTS
from fe_import.elements.solid_elements import MESH_ELEMENTS
from fe_import.elements.solid_mesh import ElementBlock, ShellCells, SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import as_spelt, choose
from fe_import.mesh.checks import check_mesh, scaled_jacobians
from fe_import.mesh.first_order import of_first_order
from fe_import.mesh.geometry_files import Meshing, is_geometry, read_geometry
from fe_import.mesh.guard import unpacked
from fe_import.mesh.raw import RawMesh
from fe_import.model import IntArray

_READERS = {  # by suffix: module and function, imported when asked for
    ".inp": ("fe_import.mesh.abaqus_files", "read_abaqus"),
    **dict.fromkeys((".bdf", ".fem", ".nas"), ("fe_import.mesh.nastran_files", "read_nastran")),
    ".cdb": ("fe_import.mesh.ansys_files", "read_ansys"),
    **dict.fromkeys((".e", ".ex2", ".exo", ".g", ".gen"), ("fe_import.mesh.exodus_files", "read_exodus")),
    ".unv": ("fe_import.mesh.universal_files", "read_universal"),
}
_OTHERS = ("fe_import.mesh.meshio_files", "read_with_meshio")
_BY_MESHIO_NAME = {element.meshio_name: name for name, element in MESH_ELEMENTS.items()}
_SHELLS_BY_MESHIO_NAME = {element.meshio_name: name for name, element in SHELL_ELEMENTS.items()}
_ONE_OF_SHELLS = "shells"  # what a link would lack without a keyword or type that belongs to its shells


@dataclass(frozen=True)
class Wanted:
    """Which elements of a mesh file make the link.

    Attributes
    ----------
    solids : bool
    shells : bool
        Triangles and quadrangles are shells; else they mark faces.
    shell_sets : tuple of str
        Those of these sets only; all of them when empty.
    """

    solids: bool = True
    shells: bool = False
    shell_sets: tuple[str, ...] = ()


def read_mesh(
    path: Path, ignore: Sequence[str] = (), wanted: Wanted = Wanted(), meshing: Meshing | None = None
) -> SolidMesh:
    """Read and check a mesh file, or a ``.gz`` of one; its format follows from the suffix. Geometries are meshed.

    Named cell sets (gmsh's physical groups, Abaqus' element sets, families of MED) of solid elements become element
    sets; named cell sets of faces, lines or points, surfaces and named point sets become node sets. Numbers per cell
    (Nastran's properties, integer arrays of VTU) become sets ``ARRAY:NUMBER``. Nodes outside of all solid elements
    are dropped. A set that cannot be followed is left out; `SolidMesh.lost_sets` says why.

    Parameters
    ----------
    path : Path
    ignore : sequence of str
        Keywords, cards and types of elements of the file that the link is to be without.
    wanted : Wanted
    meshing : Meshing, optional
        How a geometry is meshed.

    Returns
    -------
    SolidMesh
        In the file's unit of length.

    Raises
    ------
    FEImportError
        ``FILE_NOT_FOUND``, ``NOT_READABLE``; ``UNSUPPORTED_ELEMENT``: solid elements of another type than those of
        `MESH_ELEMENTS`, shells of another than `SHELL_ELEMENTS`; ``NOT_USED``: masses, springs, constraints and the
        like; ``MESH``: declared sizes that the file cannot hold, no elements that are wanted, and what ``check_mesh``
        finds; ``DISCONNECTED``.
    """
    if not path.exists():
        raise FEImportError(Cause.FILE_NOT_FOUND, "no such mesh file", where=str(path), remedy="check the path")
    raw = _read(path, meshing)
    if wanted.shells and not wanted.solids:  # beside solids they share all nodes with these
        raw = of_first_order(raw)
    left_out = _left_out(raw, ignore, str(path), wanted)
    solids = _solid_blocks(raw, str(path)) if wanted.solids else []
    if not wanted.solids:
        _refuse_solids(raw, ignore, left_out, str(path))
    shells = _shell_cells(raw, wanted, str(path)) if wanted.shells else {}
    parts = [*(raw.blocks[b].cells for b in solids), *(raw.blocks[b].cells[rows] for b, rows in shells.items())]
    used = np.unique(np.concatenate([cells.ravel() for cells in parts])).astype(np.int64)
    points = np.asarray(raw.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or used[0] < 0 or used[-1] >= len(points):
        raise FEImportError(
            Cause.MESH,
            "elements refer to nodes that are not in the file",
            where=str(path),
            remedy="write the mesh again",
        )
    dense = np.full(len(points), -1, dtype=np.int64)
    dense[used] = np.arange(len(used))
    element_sets, shell_sets, node_sets, lost = _sets(raw, solids, shells, dense)
    blocks = _joined(raw, {b: np.arange(len(raw.blocks[b].cells)) for b in solids}, dense)
    further, attachments = _attachments(raw, left_out, dense)
    names = _further_names(raw, further)
    mesh = SolidMesh(
        points[used], tuple(ElementBlock(_BY_MESHIO_NAME[name], cells) for name, cells in blocks.items()),
        element_sets, node_sets, str(path), lost, left_out, points[further], names, attachments, raw.materials,
        tuple(ShellCells(_SHELLS_BY_MESHIO_NAME[n], cells) for n, cells in _joined(raw, shells, dense).items()),
        shell_sets,
    )  # fmt: skip
    mesh = _turned(mesh, raw.mirrored)
    check_mesh(mesh)
    return mesh


def _turned(mesh: SolidMesh, types: frozenset[str]) -> SolidMesh:
    """Elements of these types turned, where all of a type are inside out."""
    if types.isdisjoint(block.type for block in mesh.blocks) or not np.isfinite(mesh.nodes).all():
        return mesh
    inside_out = scaled_jacobians(mesh) < 0
    blocks = [
        replace(block, elements=block.elements[:, block.element.mirrored_order])
        if block.type in types and inside_out[numbers].all()
        else block
        for block, _, numbers in mesh.parts()
    ]
    return replace(mesh, blocks=tuple(blocks))


def _read(path: Path, meshing: Meshing | None) -> RawMesh:
    if not path.is_file():
        raise FEImportError(
            Cause.NOT_READABLE, "cannot be read as a mesh: not a file", where=str(path), remedy="check the path"
        )
    with unpacked(path) as plain:
        if is_geometry(plain):
            return read_geometry(plain, str(path), meshing)
        module, function = _READERS.get(plain.suffix.lower(), _OTHERS)
        read: Callable[[Path, str], RawMesh] = getattr(import_module(module), function)
        return read(plain, str(path))


def _left_out(raw: RawMesh, ignore: Sequence[str], where: str, wanted: Wanted) -> dict[str, int]:
    """How many of what the link is without; a loss that nobody asked for is refused."""
    table = "solid" if wanted.solids else "shell"
    names_there = {item.name.upper(): item.name for item in raw.left_out}
    asked = [names_there.get(name.upper(), name) for name in ignore]
    for name in asked:
        choose(name, sorted(names_there.values()), f"{where}: what to ignore")
    kept = {item.name for item in raw.left_out if wanted.shells and item.loss == _ONE_OF_SHELLS} - set(asked)
    losses = [item for item in raw.left_out if item.loss and item.name not in kept and item.name not in asked]
    if losses:
        names = ", ".join(f'"{name}"' for name in dict.fromkeys([*asked, *(item.name for item in losses)]))
        raise FEImportError(
            Cause.NOT_USED,
            "the link would lack " + "; ".join(f"{i.loss}: {i.count} {i.name} from {i.where}" for i in losses),
            where=where,
            remedy="give them in the link description or the scene if they matter, "
            f"then ignore = [{names}] in [{table}]",
        )
    counts: Counter[str] = Counter()
    for item in (i for i in raw.left_out if i.name not in kept and (not i.used or i.name in asked)):
        counts[item.name] += item.count
    return dict(counts)


def _attachments(raw: RawMesh, left_out: dict[str, int], dense: IntArray) -> tuple[IntArray, tuple[Attachment, ...]]:
    """Points of no element that attachments need, and these: elements' nodes, then from -1 backwards the others."""
    chosen = [item for item in raw.attachments if item.keyword not in left_out]
    further = sorted({node for item in chosen for node in nodes_of(item) if dense[node] < 0})
    number = {node: k - len(further) for k, node in enumerate(further)}
    items = tuple(renumbered(i, lambda node: number[node] if node in number else int(dense[node])) for i in chosen)
    return np.array(further, dtype=np.int64), items


def _further_names(raw: RawMesh, further: IntArray) -> dict[str, int]:
    """Sets of one point that is none of an element."""
    place = {int(node): k - len(further) for k, node in enumerate(further)}
    found = {name: np.unique(np.asarray(points)) for name, points in raw.point_sets.items() if np.size(points)}
    return {name: place[int(own[0])] for name, own in found.items() if len(own) == 1 and int(own[0]) in place}


def _joined(raw: RawMesh, chosen: dict[int, IntArray], dense: IntArray) -> dict[str, IntArray]:
    """Cells of blocks by their type, as they come."""
    cells: dict[str, list[IntArray]] = {}
    for b, rows in chosen.items():
        cells.setdefault(raw.blocks[b].type, []).append(raw.blocks[b].cells[rows].astype(np.int64))
    return {name: dense[np.concatenate(parts)] for name, parts in cells.items()}


def _refuse_solids(raw: RawMesh, ignore: Sequence[str], left_out: dict[str, int], where: str) -> None:
    """Solid elements in a mesh of shells must be asked to stay away."""
    counts: Counter[str] = Counter()
    for block in raw.blocks:
        if block.dimension == 3 and len(block.cells):
            counts[block.type] += len(block.cells)
    left_out.update({name: count for name, count in counts.items() if name in ignore})
    there = {name: count for name, count in counts.items() if name not in ignore}
    if there:
        raise FEImportError(
            Cause.NOT_USED,
            f"the link would lack solid elements: {_listing(there.items())}",
            where=where,
            remedy="give a table [solid], too, with this mesh and their material",
        )


def _shell_cells(raw: RawMesh, wanted: Wanted, where: str) -> dict[int, IntArray]:
    """Cells of each block that are shells, type by type in the order in which types come first."""
    chosen = {b: np.arange(len(block.cells)) for b, block in enumerate(raw.blocks) if block.dimension == 2}
    if wanted.shell_sets:
        names = [as_spelt(name, raw.cell_sets) for name in wanted.shell_sets]
        for name in names:
            choose(name, raw.cell_sets, f"{where}: set of shells")
        members = [raw.cell_sets[name] for name in names]
        for b in chosen:
            own = [_indices(per_block[b], len(raw.blocks[b].cells)) for per_block in members if b < len(per_block)
                   and per_block[b] is not None]  # fmt: skip
            chosen[b] = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *own]))
    counts: Counter[str] = Counter()
    for b, rows in chosen.items():
        counts[raw.blocks[b].type] += len(rows)
    counts = +counts
    if unsupported := [name for name in counts if name not in _SHELLS_BY_MESHIO_NAME]:
        raise FEImportError(
            Cause.UNSUPPORTED_ELEMENT,
            "shells that cannot be assembled: " + _listing((name, counts[name]) for name in unsupported),
            where=where,
            limit=", ".join(_SHELLS_BY_MESHIO_NAME),
            remedy="beside solids mesh with straight-sided elements of first order",
        )
    if not counts:
        raise FEImportError(
            Cause.MESH, "no triangles and no quadrangles, which shells are made of", where=where,
            remedy="export the mesh of the surface",
        )  # fmt: skip
    order = list(counts)
    filled = [b for b, rows in chosen.items() if len(rows)]
    return {b: chosen[b] for b in sorted(filled, key=lambda b: order.index(raw.blocks[b].type))}


def _solid_blocks(raw: RawMesh, where: str) -> list[int]:
    """Which blocks hold solid elements, type by type in the order in which types come first."""
    blocks = [b for b, block in enumerate(raw.blocks) if block.dimension == 3 and len(block.cells)]
    counts: Counter[str] = Counter()
    for b in blocks:
        counts[raw.blocks[b].type] += len(raw.blocks[b].cells)
    unsupported = [name for name in counts if name not in _BY_MESHIO_NAME]
    if unsupported:
        raise FEImportError(
            Cause.UNSUPPORTED_ELEMENT,
            "solid elements that cannot be assembled: " + _listing((name, counts[name]) for name in unsupported),
            where=where,
            limit=", ".join(_BY_MESHIO_NAME),
            remedy="mesh with one of the supported types",
        )
    if not counts:
        others: Counter[str] = Counter()
        for block in raw.blocks:
            others[block.type] += len(block.cells)
        found = _listing(others.items()) or "no elements at all"
        raise FEImportError(
            Cause.MESH,
            f"no solid elements, found {found}",
            where=where,
            remedy="export the volume mesh, not its surface",
        )
    return sorted(blocks, key=lambda b: list(counts).index(raw.blocks[b].type))


def _listing(counts: Iterable[tuple[str, int]]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts)


def _sets(
    raw: RawMesh, blocks: list[int], shells: dict[int, IntArray], dense: IntArray
) -> tuple[dict[str, IntArray], dict[str, IntArray], dict[str, IntArray], dict[str, str]]:
    """Sets of solids, of shells and of nodes in the numbering of the checked mesh, and why others are not there."""
    counts = [len(block.cells) for block in raw.blocks]
    offset = dict(zip(blocks, np.cumsum([0, *(counts[b] for b in blocks)]).tolist(), strict=False))
    starts = np.cumsum([0, *map(len, shells.values())]).tolist()
    number = {}  # of each cell of a block among the shells, -1 of others
    for (b, rows), start in zip(shells.items(), starts, strict=False):
        number[b] = np.full(counts[b], -1, dtype=np.int64)
        number[b][rows] = start + np.arange(len(rows))
    element_sets: dict[str, IntArray] = {}
    shell_sets: dict[str, IntArray] = {}
    node_sets: dict[str, IntArray] = {}
    lost = dict(raw.lost)
    for name, per_block in raw.cell_sets.items():
        elements, cells_of_shells, nodes = [], [], []
        try:
            for b, cells in enumerate(per_block):
                index = _indices([] if cells is None else cells, counts[b] if b < len(counts) else 0)
                if b in offset:
                    elements.append(offset[b] + index)
                elif len(index):
                    own = number[b][index] if b in number else np.zeros(0, dtype=np.int64)
                    cells_of_shells.append(own[own >= 0])
                    nodes.append(raw.blocks[b].cells[index].ravel())
            if any(map(len, elements)):
                element_sets[name] = np.unique(np.concatenate(elements))
            if any(map(len, cells_of_shells)):
                shell_sets[name] = np.unique(np.concatenate(cells_of_shells))
            if nodes:
                node_sets[name] = _dense_nodes(np.concatenate(nodes), dense)
            if name not in element_sets and name not in shell_sets and name not in node_sets:
                lost[name] = "it holds nothing"
        except _Lost as reason:
            lost[name] = str(reason)
    for name, points in raw.point_sets.items():
        try:
            found = _dense_nodes(points, dense)
        except _Lost as reason:
            lost[name] = str(reason)
            continue
        if not np.array_equal(node_sets.setdefault(name, found), found):
            lost[name] = "two different node sets have this name"
            del node_sets[name]
    return element_sets, shell_sets, node_sets, lost


class _Lost(Exception):
    """Why a set cannot be followed."""


def _indices(values: Any, count: int) -> IntArray:
    try:
        index = np.asarray(values)
    except ValueError:
        index = np.zeros(1)
    if index.size == 0:
        return np.zeros(0, dtype=np.int64)
    if index.ndim != 1 or index.dtype.kind not in "iu" or index.min() < 0 or index.max() >= count:
        raise _Lost("it refers to what is not in the file")
    return index.astype(np.int64)


def _dense_nodes(points: Any, dense: IntArray) -> IntArray:
    index = dense[np.unique(_indices(points, len(dense)))]
    if (index < 0).any():
        raise _Lost(f"it holds {(index < 0).sum()} nodes that belong to no element; interface nodes are made here")
    return index

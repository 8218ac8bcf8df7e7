"""Mesh files through meshio, with the groups that it keeps in other places than its sets.

It prints and exits on faulty input, and keeps physical groups of gmsh, families of MED, properties of Nastran and
integer cell data of VTU as numbers per cell; here they become sets, named ``ARRAY:NUMBER`` where they have no name.
"""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from fe_import.elements.solid_elements import MESH_ELEMENTS
from fe_import.errors import Cause, FEImportError
from fe_import.mesh.guard import bounded_memory, check_declared, check_found
from fe_import.mesh.raw import Block, RawMesh

meshio._mesh.topological_dimension.update({"wedge15": 3, "pyramid13": 3})  # which meshio 5 knows but for this
meshio.gmsh.main._readers["4"] = meshio.gmsh._gmsh40  # as gmsh calls MSH 4.0; meshio takes it for 4.1
for _version in (meshio.vtk._vtk_42, meshio.vtk._vtk_51):
    _version.vtk_to_numpy_dtype_name["vtkidtype"] = "int32"  # as VTK writes its numbers of cells and points
meshio.med._med._read_data = lambda *_: None  # results beside the mesh: not needed, and some stop it
_OF_MED = (".med", ".mmed", ".rmed")  # the last two: meshes and results of Code_Aster
meshio.extension_to_filetypes.update({suffix: ["med"] for suffix in _OF_MED})
MOST_GROUPS = 1000  # different numbers in an array; more are labels, not groups
_SHORT_NAMES = {"gmsh:physical": "physical", "medit:ref": "ref"}
_MIRRORED = {  # types that a format numbers from the other side; of VTK not all programs do
    **dict.fromkeys(_OF_MED, frozenset(MESH_ELEMENTS)),
    **dict.fromkeys((".vtk", ".vtu"), frozenset({"wedge6", "wedge15"})),
}
_OTHER_MEANING = {"gmsh:geometrical", "cell_tags", "point_tags", "gmsh:dim_tags"}


def read_with_meshio(path: Path, name: str) -> RawMesh:
    """Read a file whose suffix names its format.

    Parameters
    ----------
    path : Path
    name : str
        To name in messages.

    Raises
    ------
    FEImportError
        ``NOT_READABLE``; ``MESH``: declared sizes that the file cannot hold.
    """
    raw = _read(path, name)
    blocks = [_block(b, name) for b in raw.cells]
    check_found(path, name, len(raw.points), sum(len(b.cells) for b in blocks))
    mesh = RawMesh(raw.points, blocks, mirrored=_MIRRORED.get(path.suffix.lower(), frozenset()))
    mesh.point_sets.update({str(key): points for key, points in raw.point_sets.items()})
    for key, cells in raw.cell_sets.items():
        if not str(key).startswith("gmsh:"):
            mesh.cell_sets[str(key)] = list(cells)
    _add_physical_groups(raw, mesh)
    _add_families(raw, mesh)
    for key, per_block in raw.cell_data.items():
        named = [int(tag) for tag, _ in raw.field_data.values()] if key == "gmsh:physical" else []
        for group, members in _groups(key, list(per_block), mesh, named):
            mesh.cell_sets.setdefault(group, members)
    for key, values in raw.point_data.items():
        for group, members in _groups(key, [values], mesh, []):
            mesh.point_sets.setdefault(group, members[0])
    return mesh


def _block(cells: Any, name: str) -> Block:
    data, width = np.asarray(cells.data), meshio._mesh.num_nodes_per_cell.get(cells.type)
    if data.ndim != 2 or data.dtype.kind not in "iu" or (width is not None and data.shape[1] != width):
        raise FEImportError(
            Cause.MESH,
            f"cells of type {cells.type} have another number of nodes than these have",
            where=name,
            value=" x ".join(map(str, data.shape)),
            limit=width,
            remedy="the file is damaged or cut off; write the mesh again",
        )
    return Block(cells.type, cells.dim, data)


def _read(path: Path, name: str) -> Any:
    said = io.StringIO()
    try:
        check_declared(path, name)
        with warnings.catch_warnings(), contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            warnings.simplefilter("ignore")
            with bounded_memory(path):
                return meshio.read(path)
    except FEImportError:
        raise
    except (Exception, SystemExit) as problem:
        told = "" if isinstance(problem, SystemExit) else f"{type(problem).__name__} {problem}"
        reason = " ".join(f"{said.getvalue()} {told}".replace(str(path), "").split())
        remedy = "save it again, in another format if need be; the suffix must name the format; of gmsh take MSH 4.1"
        if path.suffix.lower() not in meshio.extension_to_filetypes:
            reason = f"no format of meshes is known by the suffix {path.suffix!r}"
            remedy = "the suffix must name the format (.msh, .inp, .bdf, .vtu, .med ...)"
        elif isinstance(problem, KeyError) and problem.args[0] in meshio._vtk_common.meshio_to_vtk_type:
            reason, remedy = f"cells of type {problem.args[0]}", "mesh it without them"
        elif path.suffix.lower() in _OF_MED and "'ESP'" in reason:  # which MED has since its version 3
            reason, remedy = "MED of a version before 3", "open it with Salome and export it again"
        elif "Incompatible cell data" in reason or "gmsh:physical" in reason:
            remedy = "put every entity in a physical group and do not save all elements (Mesh.SaveAll = 0)"
        raise FEImportError(
            Cause.NOT_READABLE, f"cannot be read as a mesh: {reason}", where=name, remedy=remedy
        ) from None


def _add_physical_groups(raw: Any, mesh: RawMesh) -> None:
    """MSH 2 and 4.0 keep their groups elsewhere than MSH 4.1 does."""
    tags = raw.cell_data.get("gmsh:physical")
    for key, (tag, dimension) in raw.field_data.items() if tags is not None else ():
        if key not in mesh.cell_sets:
            mesh.cell_sets[str(key)] = [
                np.flatnonzero(t == tag) if b.dimension == dimension else None
                for t, b in zip(tags, mesh.blocks, strict=True)
            ]


def _add_families(raw: Any, mesh: RawMesh) -> None:
    """MED: each cell and point has a family, each family the names of its groups."""
    cells, points = raw.cell_data.get("cell_tags"), raw.point_data.get("point_tags")
    for group, families in _by_group(getattr(raw, "cell_tags", {})) if cells is not None else ():
        mesh.cell_sets[group] = [np.flatnonzero(np.isin(tags, families)) for tags in cells]
    for group, families in _by_group(getattr(raw, "point_tags", {})) if points is not None else ():
        mesh.point_sets[group] = np.flatnonzero(np.isin(points, families))


def _by_group(families: dict[int, list[str]]) -> Iterator[tuple[str, list[int]]]:
    names = sorted({str(name) for groups in families.values() for name in groups})
    return ((name, [f for f, groups in families.items() if name in groups]) for name in names)


def _groups(key: str, arrays: list[Any], mesh: RawMesh, named: list[int]) -> Iterator[tuple[str, list[Any]]]:
    """Members of each number of an integer array, block by block, but for numbers that have a name."""
    arrays = [np.asarray(a) for a in arrays]
    if key in _OTHER_MEANING or any(a.dtype.kind not in "iu" or a.ndim != 1 for a in arrays):
        return
    numbers = np.unique(np.concatenate(arrays)) if arrays else np.zeros(0)
    short = _SHORT_NAMES.get(key, key)
    if len(numbers) > MOST_GROUPS:
        mesh.lost[short] = f"the array has {len(numbers)} different numbers, so they are labels and not groups"
        return
    for number in np.setdiff1d(numbers, named):
        yield f"{short}:{number}", [np.flatnonzero(a == number) for a in arrays]

"""From the description of a link given by exported matrices to its finite-element model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_import.description.link import LinkFile
from fe_import.description.records import LinkDescription, Matrices
from fe_import.errors import Cause, FEImportError
from fe_import.exports import EXPORTS, Export, ExportFormat
from fe_import.files.toml import choose, convert
from fe_import.interfaces.coupling import couple_interfaces
from fe_import.model import FEModel, IntArray
from fe_import.models.export_checks import check_export
from fe_import.models.export_positions import mended_positions
from fe_import.models.export_rigid import free_of_ground
from fe_import.models.matrix_interfaces import matrices_interfaces, named_nodes


def matrices_model(link: LinkFile) -> FEModel:
    """Read the matrices, bring them to the axes of the mesh, and put the interfaces on their nodes and faces.

    Raises
    ------
    FEImportError
        A faulty file, set, node or interface; ``EXPORT``: matrices, dofs and nodes that do not belong together;
        ``GROUNDED``: not a free link.
    """
    description, where = link.description, str(link.path)
    if description.matrices is None:
        raise FEImportError(Cause.BAD_FIELD, "not a link of matrices", where=where)
    return export_model(read_export(link, description.matrices), description, where)


def export_model(export: Export, description: LinkDescription, where: str) -> FEModel:
    """The model of matrices that are read; see `matrices_model`."""
    assert description.matrices is not None
    check_export(export, f"{where}: matrices")
    export = along_mesh_axes(export)
    if "positions" in export.notes:
        export = mended_positions(export)
    names = named_nodes(description.matrices, export, where)
    kept, dense = _nodes_with_rows(export)
    faces, seats = matrices_interfaces(description, export, names, dense, where)
    nodes, dof_map = export.nodes[kept], export.dof_map[kept]
    try:
        coupled = couple_interfaces(nodes, faces, where, dof_map, export.mass.shape[0])
    except FEImportError as problem:
        problem.remedy = problem.remedy or "name a set of 3 nodes or more, not on one line, or mend its position"
        raise
    added = iter(coupled.interface_nodes)
    model = FEModel(
        name=description.name,
        nodes=coupled.nodes,
        dof_map=coupled.dof_map,
        mass=coupled.extended(export.mass),
        stiffness=coupled.extended(export.stiffness),
        interface_nodes=tuple(seats[i.name] if i.name in seats else next(added) for i in description.interfaces),
        independent=coupled.independent,
        coupling=coupled.coupling if faces else None,
        node_names={name: int(dense[node]) for name, node in names.items()},
        lines=_among(export.lines, dense),
        triangles=_among(export.triangles, dense),
        kind="matrices",
        source=where,
        notes=export.notes,
    )
    return free_of_ground(model, export.labels[kept], where)


def read_export(link: LinkFile, matrices: Matrices) -> Export:
    """Call the reader that the description names with the files that it names.

    Raises
    ------
    FEImportError
        An unknown format, role or option, a missing role or file, and what the reader finds.
    """
    where = f"{link.path}: matrices"
    choose(matrices.format, EXPORTS, f"{where}.format")
    chosen = EXPORTS[matrices.format]
    files = _files(link.folder, matrices, chosen, where)
    options = convert(matrices.options, chosen.options, f"{where}.options")
    return chosen.read(files, options, str(link.path))


def _files(folder: Path, matrices: Matrices, chosen: ExportFormat, where: str) -> dict[str, Path]:
    roles = (*chosen.required, *chosen.optional)
    files = {}
    for role, name in matrices.files.items():
        choose(role, roles, f"{where}.files")
        path = folder / name
        if not name or "\0" in name or not path.is_file():
            raise FEImportError(
                Cause.FILE_NOT_FOUND,
                "no such file",
                where=f"{where}.files.{role}",
                value=name,
                remedy="give a path that starts at the folder of the link description",
            )
        files[role] = path
    for role in chosen.required:
        if role not in files:
            raise FEImportError(
                Cause.BAD_FIELD,
                f"format {matrices.format!r} needs the file {role!r}",
                where=f"{where}.files",
                limit="needed: " + ", ".join(chosen.required),
                remedy=f'add {role} = "FILE"',
            )
    return files


def along_mesh_axes(export: Export) -> Export:
    """The export with all displacements and rotations counted along the axes of the mesh.

    With the axes O of a node's frame as columns, u_mesh = O u_node and K_mesh = T K Tᵀ.
    """
    if export.orientations is None:
        return export
    rows, columns, values = [], [], []
    for offset in (0, 3):
        dofs = export.dof_map[:, offset : offset + 3]
        present = (dofs >= 0).all(axis=1)
        rows.append(np.repeat(dofs[present], 3, axis=1).ravel())
        columns.append(np.tile(dofs[present], (1, 3)).ravel())
        values.append(export.orientations[present].reshape(-1))
    others = np.setdiff1d(np.arange(export.mass.shape[0]), np.concatenate(rows))
    data = np.concatenate([*values, np.ones(len(others))])
    place = (np.concatenate([*rows, others]), np.concatenate([*columns, others]))
    turn = sp.csc_array((data, place), shape=export.mass.shape)
    mass, stiffness = ((turn @ m @ turn.T).tocsc() for m in (export.mass, export.stiffness))
    return replace(export, mass=mass, stiffness=stiffness, orientations=None)


def _nodes_with_rows(export: Export) -> tuple[IntArray, IntArray]:
    """Nodes that have rows, and the new number of every node, -1 without rows."""
    kept = np.flatnonzero(export.dof_map[:, 0] >= 0)
    dense = np.full(len(export.nodes), -1, dtype=np.int64)
    dense[kept] = np.arange(len(kept))
    return kept, dense


def _among(cells: IntArray, dense: IntArray) -> IntArray:
    """Lines or triangles whose nodes all have rows."""
    cells = dense[cells]
    return cells[(cells >= 0).all(axis=1)]

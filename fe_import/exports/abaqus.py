"""Abaqus: matrices of ``*MATRIX GENERATE`` or of ``*SUBSTRUCTURE MATRIX OUTPUT``, nodes and sets of the input deck."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec
import numpy as np

from fe_import.description.base import Vector
from fe_import.errors import Cause, FEImportError
from fe_import.exports.abaqus_entries import read_entries
from fe_import.exports.abaqus_substructure import is_substructure, read_substructure
from fe_import.exports.base import Export, ExportFormat
from fe_import.exports.inp_elements import picture
from fe_import.exports.inp_mesh import read_inp
from fe_import.exports.points import MODAL, Points, points_of, rows_of
from fe_import.exports.superelement import assembled, refuse_cut


class AbaqusOptions(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """What matrices of Abaqus leave open.

    Attributes
    ----------
    positions : dict of (3,) floats
        Of nodes by number [m], instead of a deck.
    modal_nodes : list of int
        Nodes of a substructure that carry its modal coordinates (the retained eigenmodes).
    """

    positions: dict[str, Vector] = {}
    modal_nodes: list[int] = []


def read_abaqus(files: Mapping[str, Path], options: AbaqusOptions, where: str) -> Export:
    """Read mass and stiffness, and the nodes of their rows. See `ExportFormat.read`."""
    points = points_of(files, options.positions, where, _deck_points)
    if is_substructure(files["stiffness"]):
        return _read_reduced(files, options, points)
    return _read_full(files, points)


def _deck_points(path: Path) -> Points:
    mesh = read_inp(path)
    if mesh.keywords["TRANSFORM"]:
        raise FEImportError(
            Cause.EXPORT,
            "*TRANSFORM turns the dofs of some nodes",
            where=mesh.source,
            remedy="export a model without *TRANSFORM: matrices in the axes of the mesh",
        )
    labels = mesh.labels.tolist()
    lines, triangles = picture(mesh.elements)
    return Points(
        positions=dict(zip(labels, mesh.nodes, strict=True)),
        sets={name: mesh.labels[members].tolist() for name, members in mesh.node_sets.items()},
        lines=[(labels[a], labels[b]) for a, b in lines],
        triangles=[(labels[a], labels[b], labels[c]) for a, b, c in triangles],
    )


def _read_full(files: Mapping[str, Path], points: Points) -> Export:
    found = {role: read_entries(files[role]) for role in ("stiffness", "mass") if role in files}
    if all(f.labelled for f in found.values()):
        codes = np.unique(np.concatenate([k for f in found.values() for k in (f.rows, f.columns)]))
        rows = np.stack([codes // 8, codes % 8], axis=1)
    elif "dofs" in files and not any(f.labelled for f in found.values()):
        rows = rows_of(files["dofs"])
        codes = np.arange(1, len(rows) + 1)
    else:
        raise FEImportError(
            Cause.EXPORT,
            "FORMAT=COORDINATE does not say which node a row belongs to",
            where=next(f.path for f in found.values() if not f.labelled),
            remedy="write both with *MATRIX OUTPUT, FORMAT=MATRIX INPUT, or give the file 'dofs' with a row per line",
        )
    matrices = {role: entries.matrix(codes) for role, entries in found.items()}
    if "mass" in matrices:
        refuse_cut(matrices["mass"], rows, str(files["mass"]))
    notes = {"program": "Abaqus, *MATRIX GENERATE"}
    return assembled(matrices.get("mass"), matrices["stiffness"], rows, points, str(files["stiffness"]), notes)


def _read_reduced(files: Mapping[str, Path], options: AbaqusOptions, points: Points) -> Export:
    path = files["stiffness"]
    element = read_substructure(path)
    if "STIFFNESS" not in element.matrices:
        raise FEImportError(
            Cause.EXPORT,
            "no stiffness matrix in this substructure",
            where=str(path),
            limit=", ".join(element.matrices) or "no matrices",
            remedy="write it with *SUBSTRUCTURE MATRIX OUTPUT, STIFFNESS=YES, MASS=YES",
        )
    rows = element.dofs.copy()
    modal = np.isin(rows[:, 0], options.modal_nodes)
    rows[modal, 0] = 1 + np.flatnonzero(modal)
    rows[modal, 1] = MODAL
    stiffness = element.matrices["STIFFNESS"]
    notes = {"program": "Abaqus, *SUBSTRUCTURE MATRIX OUTPUT"}
    held = element.matrices
    if "mass" in files:
        other = read_substructure(files["mass"])
        if not np.array_equal(other.dofs, element.dofs):
            raise FEImportError(
                Cause.EXPORT,
                "mass and stiffness have different nodes or dofs",
                where=str(files["mass"]),
                remedy="write both with one *SUBSTRUCTURE MATRIX OUTPUT",
            )
        held = other.matrices
    return assembled(held.get("MASS"), stiffness, rows, points, str(path), notes)


ABAQUS = ExportFormat(
    required=("stiffness",), optional=("mass", "dofs", "mesh", "nodes", "sets"), options=AbaqusOptions, read=read_abaqus
)

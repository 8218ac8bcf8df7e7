"""From rows named by node and component to an `Export`: common to formats that may hold a reduced link.

A superelement is a link that its program has reduced already: rows are displacements and rotations of the kept nodes
and, after Craig and Bampton, modal coordinates, which belong to no node. What its inner nodes do is not in the file, so
their velocities follow those of the kept nodes in the frame of the link. That is the kinetic energy of Cardona &
Géradin (Int. J. Numer. Meth. Eng. 32, 1991): exact for rigid-body motion and for small vibrations, without the
centrifugal and Coriolis forces on modal coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.exports.base import Export
from fe_import.exports.points import MODAL, Points
from fe_import.model import Array, IntArray

_GROUNDED = 1e-5  # of the size of the terms; rounding times the condition of a slender link leaves 1e-6
_EXACT = 1e-9
_DENSE = 3000  # rows; a larger matrix is not a condensed one
_JOINED = 50  # so many kept nodes are joined by lines when the files name none
_NO_COMPONENT = "export displacements and rotations only; name modal coordinates (modal_nodes of 'abaqus')"
_NOTE = (
    "reduced before the import: {rows} modal coordinates without nodes; inertia forces of inner nodes follow the kept "
    "nodes (Cardona & Geradin 1991), so fast spinning asks for kept nodes along the link"
)


def assembled(
    mass: sp.csc_array | None,
    stiffness: sp.csc_array,
    rows: IntArray,
    points: Points,
    where: str,
    notes: dict[str, str],
    grounded: str = "export a free link: without supports (SPC, *BOUNDARY) and springs to ground",
) -> Export:
    """The export of matrices whose rows are named.

    Parameters
    ----------
    mass, stiffness : (d, d) sparse CSC
        Without a mass the stiffness is still looked at, before that is refused.
    rows : (d, 2) int array
        Number of the node and component 1 to 6 of each row; component `MODAL` for modal coordinates, whatever their
        number.
    points : Points
        At least the nodes of the rows.
    where : str
        File that names the rows, for messages.
    notes : dict of str
    grounded : str
        Remedy against a stiffness that resists rigid-body motion.

    Raises
    ------
    FEImportError
        ``EXPORT``: a component out of range, a row that stands twice, a modal coordinate without mass or stiffness;
        ``BAD_REFERENCE``: a node without position; ``GROUNDED``.
    """
    component = rows[:, 1]
    outside = (component < 0) | (component > 6)
    if outside.any():
        first = rows[int(outside.argmax())]
        message = f"node {first[0]} has a component out of range"
        raise _fault(message, where, int(first[1]), "1 to 6", _NO_COMPONENT)
    nodal = np.flatnonzero(component != MODAL)
    modal = np.flatnonzero(component == MODAL)
    _refuse_twice(rows, where)
    given = stiffness if mass is None else mass
    _refuse_empty(given, stiffness, rows, modal, where)
    labels, node = np.unique(rows[nodal, 0], return_inverse=True)
    dof_map = np.full((len(labels), 6), -1, dtype=np.int64)
    dof_map[node, component[nodal] - 1] = nodal
    missing = [int(label) for label in labels if int(label) not in points.positions]
    if missing:
        raise FEImportError(
            Cause.BAD_REFERENCE,
            f"{len(missing)} nodes of the matrices have no position",
            where=where,
            value=missing[:5],
            limit=f"{len(points.positions)} nodes with positions",
            remedy="give the file of the nodes, or matrices.options.positions",
        )
    place = {int(label): k for k, label in enumerate(labels)}
    lines = [(place[a], place[b]) for a, b in points.lines if a in place and b in place]
    triangles = [[place[k] for k in t] for t in points.triangles if all(k in place for k in t)]
    if not lines and not triangles and len(labels) <= _JOINED:
        lines = [(k, k + 1) for k in range(len(labels) - 1)]
    if len(modal):
        notes = {**notes, "superelement": _NOTE.format(rows=len(modal))}
    export = Export(
        mass=given,
        stiffness=stiffness,
        nodes=np.array([points.positions[int(label)] for label in labels]).reshape(-1, 3),
        labels=labels,
        dof_map=dof_map,
        modal_rows=modal,
        orientations=_orientations(labels, points.axes),
        node_sets=_sets(points.sets, place),
        lines=np.array(lines, dtype=np.int64).reshape(-1, 2),
        triangles=np.array(triangles, dtype=np.int64).reshape(-1, 3),
        notes=notes,
    )
    export = without_grounding(export, where, grounded)
    if mass is None:
        raise _fault("no mass matrix", where, None, remedy="export it as well; a file of its own has the role 'mass'")
    return export


def rigid_motions(export: Export) -> Array:
    """(d, 6) rows of unit translations and of unit rotations about the origin; modal coordinates rest."""
    x, y, z = export.nodes.T
    fields = np.tile(np.eye(6), (len(x), 1, 1))
    for axis, component, arm in ((0, 1, -z), (0, 2, y), (1, 0, z), (1, 2, -x), (2, 0, -y), (2, 1, x)):
        fields[:, component, 3 + axis] = arm  # rotation ω moves x by ω × x
    if export.orientations is not None:
        turned = export.orientations.transpose(0, 2, 1)
        fields = np.concatenate([turned @ fields[:, :3], turned @ fields[:, 3:]], axis=1)
    result = np.zeros((export.mass.shape[0], 6))
    kept = export.dof_map >= 0
    result[export.dof_map[kept]] = fields[kept]
    return result


def without_grounding(export: Export, where: str, remedy: str) -> Export:
    """The export with a stiffness that does not resist rigid-body motions of its nodes.

    A condensed stiffness is a small difference of large numbers, so rounding leaves it some resistance. It is taken
    away, and noted: K' = PᵀKP, P = 1 - R (RᵀMR)⁻¹ RᵀM with the rigid motions R, keeps the strain energy of all motions
    without momentum, and with it the elastic frequencies.

    Raises
    ------
    FEImportError
        ``GROUNDED``: more than rounding.
    """
    motions = rigid_motions(export)
    stiffness = export.stiffness
    force = np.abs(stiffness @ motions).max(axis=0)
    terms = (abs(stiffness) @ np.abs(motions)).max(axis=0)
    resisting = float((force / np.where(terms > 0, terms, 1.0)).max())
    if resisting > _GROUNDED:
        raise FEImportError(
            Cause.GROUNDED,
            "the stiffness matrix resists rigid-body motion: it is not that of a free link",
            where=where,
            value=resisting,
            limit=_GROUNDED,
            remedy=remedy,
        )
    if resisting <= _EXACT or len(motions) > _DENSE:
        return export
    momentum = (export.mass @ motions).T
    inertia = motions.T @ momentum.T
    if np.linalg.matrix_rank(inertia, hermitian=True) < 6:
        return export  # refused later, with its reason
    along = np.linalg.solve(inertia, momentum)
    strained = stiffness.toarray()
    strained -= (stiffness @ motions) @ along
    strained -= along.T @ (motions.T @ strained)
    notes = {**export.notes, "grounding": f"rounding of {resisting:.1e} of the stiffness removed"}
    return replace(export, stiffness=sp.csc_array(strained), notes=notes)


def _fault(message: str, where: str, value: Any, limit: Any = None, remedy: str = "") -> FEImportError:
    return FEImportError(Cause.EXPORT, message, where=where, value=value, limit=limit, remedy=remedy)


def _refuse_twice(rows: IntArray, where: str) -> None:
    order = np.lexsort((rows[:, 1], rows[:, 0]))
    again = (np.diff(rows[order], axis=0) == 0).all(axis=1)
    if again.any():
        label, component = (int(k) for k in rows[order[int(again.argmax())]])
        message = "a row of the matrices stands twice"
        raise _fault(message, where, f"node {label}, component {component}", remedy="export again")


def _refuse_empty(mass: sp.csc_array, stiffness: sp.csc_array, rows: IntArray, modal: IntArray, where: str) -> None:
    """A fixed-interface mode has inertia and resistance; a file that was cut off lacks the last of them."""
    for name, matrix in (("mass", mass), ("stiffness", stiffness)):
        empty = ~(matrix.diagonal()[modal] > 0)
        if empty.any():
            first = int(rows[modal[int(empty.argmax())], 0])
            message = f"a modal coordinate without {name}"
            raise _fault(message, where, f"point {first}", remedy="export again; the file may be cut off")


def _orientations(labels: IntArray, axes: Mapping[int, Array]) -> Array | None:
    if not any(int(label) in axes for label in labels):
        return None
    return np.array([axes.get(int(label), np.eye(3)) for label in labels])


def _sets(sets: Mapping[str, Iterable[int]], place: dict[int, int]) -> dict[str, IntArray]:
    """Sets of nodes that are all in the matrices."""
    result = {}
    for name, members in sets.items():
        found = [place[m] for m in members if m in place]
        if found and len(found) == len(list(members)):
            result[name] = np.array(sorted(found), dtype=np.int64)
    return result

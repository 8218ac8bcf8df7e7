"""From rows named by node and component to an `Export`: common to formats that may hold a reduced link.

A superelement is a link that its program has reduced already: rows are displacements and rotations of the kept nodes
and, after Craig and Bampton, modal coordinates, which belong to no node. What its inner nodes do is not in the file, so
their velocities follow those of the kept nodes in the frame of the link. That is the kinetic energy of Cardona &
Géradin (Int. J. Numer. Meth. Eng. 32, 1991): exact for rigid-body motion and for small vibrations, without the
centrifugal and Coriolis forces on modal coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.exports.base import Export
from fe_import.exports.points import MODAL, Points
from fe_import.model import Array, IntArray

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
) -> Export:
    """The export of matrices whose rows are named.

    Parameters
    ----------
    mass, stiffness : (d, d) sparse CSC
        Without a mass an empty one is taken: the stiffness is looked at before that is refused.
    rows : (d, 2) int array
        Number of the node and component 1 to 6 of each row; component `MODAL` for modal coordinates, whatever their
        number.
    points : Points
        At least the nodes of the rows.
    where : str
        File that names the rows, for messages.
    notes : dict of str

    Raises
    ------
    FEImportError
        ``EXPORT``: a component out of range, a row that stands twice, a modal coordinate without mass or stiffness;
        ``BAD_REFERENCE``: a node without position.
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
    if mass is None:
        mass = sp.csc_array(stiffness.shape)
    else:
        _refuse_empty(mass, stiffness, rows, modal, where)
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
    return Export(
        mass=mass,
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


def refuse_cut(mass: sp.csc_array, rows: IntArray, where: str) -> None:
    """Refuse a mass whose last rows are empty where all rows of the same components before them are not.

    For formats that do not say how many entries they hold. Massless rows are legal, but seldom only the last ones.

    Raises
    ------
    FEImportError
        ``EXPORT``.
    """
    held = mass.diagonal() > 0
    last = int(np.flatnonzero(held).max(initial=-1))
    for component in np.unique(rows[last + 1 :, 1]):
        alike = np.flatnonzero(rows[: last + 1, 1] == component)
        if len(alike) and held[alike].all():
            first = rows[last + 1]
            raise _fault(
                "the last rows of the mass matrix are empty: the file is cut off",
                where,
                f"node {first[0]}, component {first[1]}",
                remedy="export again; if these rows have no mass indeed, give them a little",
            )


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

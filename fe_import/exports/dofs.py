"""Which row of the matrices is which component of which node."""

from __future__ import annotations

import numpy as np

from fe_import.errors import Cause, FEImportError
from fe_import.model import IntArray

COMPONENTS = ("ux", "uy", "uz", "rx", "ry", "rz")
MODAL = -1  # component of a row that is a modal coordinate


def dof_map_of_rows(nodes: IntArray, components: IntArray, labels: IntArray, where: str) -> IntArray:
    """The map of an `Export` from node number and component of each row.

    Parameters
    ----------
    nodes : (d,) int array
        Number of the node of each row; any for modal rows.
    components : (d,) int array
        0 ... 5 of `COMPONENTS`, or `MODAL`.
    labels : (n,) int array
        Numbers of all nodes.
    where : str

    Returns
    -------
    (n, 6) int array

    Raises
    ------
    FEImportError
        ``EXPORT``: a node that is not among ``labels``, or two rows of one component.
    """
    rows = np.flatnonzero(components != MODAL)
    order = np.argsort(labels)
    place = np.searchsorted(labels, nodes[rows], sorter=order).clip(max=len(labels) - 1)
    index = order[place]
    unknown = labels[index] != nodes[rows]
    if unknown.any():
        first = int(unknown.argmax())
        raise FEImportError(
            Cause.EXPORT,
            f"row {rows[first] + 1} belongs to a node that the mesh does not have",
            where=where,
            value=int(nodes[rows[first]]),
            remedy="mesh and matrices must come from one model; beams and shells that the program expands into solids "
            "have nodes of their own",
        )
    dof_map = np.full((len(labels), 6), -1, dtype=np.int64)
    dof_map[index, components[rows]] = rows
    again = dof_map[index, components[rows]] != rows
    if again.any():
        first = int(rows[again.argmax()])
        raise FEImportError(
            Cause.EXPORT,
            f"two rows of one component of one node, the first is row {first + 1}",
            where=where,
            value=f"node {nodes[first]} {COMPONENTS[components[first]]}",
            remedy="export again; each row is one component",
        )
    return dof_map

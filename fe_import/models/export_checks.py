"""What must hold for every export, whatever its format: rows, nodes and matrices belong together."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.exports import Export
from fe_import.models.export_rigid import listed
from fe_import.models.measures import asymmetry

_ASYMMETRY = 1e-9
_LARGEST = 1e60  # of mass and stiffness in any unit; squares stay finite
_FARTHEST = 1e12


def check_export(export: Export, where: str) -> None:
    """Sizes, finite numbers, each row of the matrices one component or one modal coordinate.

    Raises
    ------
    FEImportError
        ``EXPORT``; ``NOT_DEFINITE``: not symmetric; ``GROUNDED``: a node that lacks some displacements.
    """
    size, count = export.stiffness.shape[0], len(export.nodes)
    for name, matrix in (("stiffness", export.stiffness), ("mass", export.mass)):
        if matrix.shape != (size, size):
            shape, square = " x ".join(map(str, matrix.shape)), f"{size} x {size}"
            raise _fault(f"the {name} matrix has the wrong size", where, shape, square, "take both of one export")
        if not (np.abs(matrix.data) <= _LARGEST).all():
            raise _fault(f"the {name} matrix holds a number that is not finite or absurd", where, limit=_LARGEST)
        _check_symmetry(matrix, name, where)
    if export.nodes.shape != (count, 3) or export.labels.shape != (count,):
        raise _fault("some nodes have no position or no number", where)
    if not (np.abs(export.nodes) <= _FARTHEST).all():
        raise _fault("a position is not finite or absurdly far", where, limit=_FARTHEST, remedy="check the units")
    if len(np.unique(export.labels)) < count:
        values, times = np.unique(export.labels, return_counts=True)
        raise _fault("two nodes of one number", where, int(values[times.argmax()]))
    _check_rows(export, size, where)
    _check_nodes(export, where)
    if export.orientations is not None:
        product = export.orientations.transpose(0, 2, 1) @ export.orientations
        if not np.abs(product - np.eye(3)).max(initial=0.0) < 1e-6:
            raise _fault("the axes of a node's frame are not orthonormal", where)


def _check_symmetry(matrix: sp.csc_array, name: str, where: str) -> None:
    if (found := asymmetry(matrix)) <= _ASYMMETRY:
        return
    if min(sp.triu(matrix, 1).nnz, sp.tril(matrix, -1).nnz) == 0:
        message = f"the {name} matrix holds one triangle, where its file declares all entries"
        raise _fault(message, where, remedy="declare it symmetric, or export both triangles")
    raise FEImportError(
        Cause.NOT_DEFINITE,
        f"the {name} matrix is not symmetric",
        where=where,
        value=found,
        limit=_ASYMMETRY,
        remedy="export a linear model without friction, follower loads or gyroscopic terms",
    )


def _check_rows(export: Export, size: int, where: str) -> None:
    rows = np.concatenate([export.dof_map[export.dof_map >= 0], export.modal_rows])
    if len(rows) and rows.max() >= size:
        message = "more dofs than the matrices have rows"
        raise _fault(message, where, int(rows.max()) + 1, size, "take matrices and dofs of one export")
    times = np.bincount(rows, minlength=size)
    if (times != 1).any():
        first = int((times != 1).argmax())
        what = "no node or modal coordinate" if times[first] == 0 else "more than one"
        message = f"{(times != 1).sum()} rows of the matrices belong to {what}, the first is row {first + 1}"
        raise _fault(message, where, f"{len(rows)} dofs", f"{size} rows", "take matrices and dofs of one export")


def _check_nodes(export: Export, where: str) -> None:
    present = export.dof_map >= 0
    moving, turning = present[:, :3].sum(axis=1), present[:, 3:].sum(axis=1)
    if not (moving == 3).any():
        raise _fault("no node has three displacements", where, remedy="only links in three dimensions can be imported")
    held = (moving % 3 != 0) | ((moving == 0) & (turning > 0))
    if held.any():
        raise FEImportError(
            Cause.GROUNDED,
            f"{held.sum()} nodes lack some of their three displacements: held, or dependent in an equation",
            where=where,
            value=listed(export.labels[held]),
            remedy="export the free link without supports and equations",
        )
    if (turning % 3 != 0).any():
        labels = listed(export.labels[turning % 3 != 0])
        raise _fault("a node needs all three rotations or none", where, labels, remedy="export all six components")


def _fault(message: str, where: str, value: Any = None, limit: Any = None, remedy: str = "") -> FEImportError:
    remedy = remedy or "export again"
    return FEImportError(Cause.EXPORT, message, where=where, value=value, limit=limit, remedy=remedy)

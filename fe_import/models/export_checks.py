"""What must hold for every export, whatever its format: rows, nodes and matrices belong together."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.exports import Export
from fe_import.models.export_rigid import listed, row_name
from fe_import.models.measures import asymmetry

_ASYMMETRY = 1e-9
_FEW = 2  # entries, of both triangles
_ROUNDING = 1e-12  # of the largest diagonal entry
_RESISTS_NOTHING, _RESISTS = 1e-5, 1e-2  # share of its terms; exported stiffness has 6 digits and more
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
    if export.nodes.shape != (count, 3) or export.labels.shape != (count,):
        raise _fault("some nodes have no position or no number", where)
    if not (np.abs(export.nodes) <= _FARTHEST).all():
        raise _fault("a position is not finite or absurdly far", where, limit=_FARTHEST, remedy="check the units")
    if len(np.unique(export.labels)) < count:
        values, times = np.unique(export.labels, return_counts=True)
        raise _fault("two nodes of one number", where, int(values[times.argmax()]))
    _check_rows(export, size, where)
    _check_nodes(export, where)
    for name, matrix in (("stiffness", export.stiffness), ("mass", export.mass)):
        _check_symmetry(matrix, name, where, export)
    _check_signs(export, where)
    _check_exchanged(export, where)
    if export.orientations is not None:
        product = export.orientations.transpose(0, 2, 1) @ export.orientations
        if not np.abs(product - np.eye(3)).max(initial=0.0) < 1e-6:
            raise _fault("the axes of a node's frame are not orthonormal", where)


def _check_signs(export: Export, where: str) -> None:
    """Diagonals are not negative: of one row, of a matrix, of both."""
    flipped = []
    for name, matrix in (("stiffness", export.stiffness), ("mass", export.mass)):
        diagonal = matrix.diagonal()
        negative = np.flatnonzero(diagonal < -_ROUNDING * np.abs(diagonal).max(initial=0.0))
        if not len(negative):
            continue
        if (diagonal <= 0).all():
            flipped.append(name)
            continue
        row = int(negative[0])
        raise FEImportError(
            Cause.NOT_DEFINITE,
            f"the {name} matrix is negative on its diagonal in {len(negative)} of {len(diagonal)} rows, the first is "
            f"{row_name(export.dof_map, export.labels, row)}: a sign is wrong there",
            where=where,
            value=float(diagonal[row]),
            limit="zero or more",
            remedy="mend the signs of these rows, or look for a negative mass or spring",
        )
    if flipped:
        what = " and ".join(flipped)
        raise FEImportError(
            Cause.NOT_DEFINITE,
            f"negative throughout, all signs are flipped: {what}",
            where=where,
            remedy="export K of K u = f and M of kinetic energy, not their negatives",
        )


def _check_exchanged(export: Export, where: str) -> None:
    """A mass that resists no translation, beside a stiffness that does, is the stiffness."""
    rows = export.dof_map[:, :3]
    rows = rows[(rows >= 0).all(axis=1)]
    moved = np.zeros((export.mass.shape[0], 3))
    moved[rows.ravel(), np.tile(np.arange(3), len(rows))] = 1.0
    shares = []
    for matrix in (export.stiffness, export.mass):
        forces, terms = np.abs(matrix @ moved).max(initial=0.0), (abs(matrix) @ moved).max(initial=0.0)
        shares.append(forces / terms if terms else 0.0)
    if export.mass.nnz and shares[1] < _RESISTS_NOTHING and shares[0] > _RESISTS:
        raise FEImportError(
            Cause.EXPORT,
            "mass and stiffness are exchanged: the mass matrix resists no translation of the link, the stiffness does",
            where=where,
            value=f"{shares[1]:.1e} and {shares[0]:.1e} of their terms",
            remedy="exchange the two files, or the names of the two matrices",
        )


def _check_symmetry(matrix: sp.csc_array, name: str, where: str, export: Export) -> None:
    if (found := asymmetry(matrix)) <= _ASYMMETRY:
        return
    if min(sp.triu(matrix, 1).nnz, sp.tril(matrix, -1).nnz) == 0:
        message = f"the {name} matrix holds one triangle, where its file declares all entries"
        raise _fault(message, where, remedy="declare it symmetric, or export both triangles")
    off = abs(matrix - matrix.T)
    if off.count_nonzero() <= _FEW:
        place = sp.coo_array(off)
        row, column = (int(c[place.data.argmax()]) for c in place.coords)
        places = f"{row_name(export.dof_map, export.labels, row)} and {row_name(export.dof_map, export.labels, column)}"
        message = f"the {name} matrix is not symmetric at one place: {places}"
        values = f"{matrix[row, column]:.6g} and {matrix[column, row]:.6g}"
        remedy = "mend the entry, one of the two has a wrong value or sign"
        raise FEImportError(Cause.NOT_DEFINITE, message, where=where, value=values, limit="equal", remedy=remedy)
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

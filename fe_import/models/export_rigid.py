"""Exported matrices against rigid-body motion: the mass must move as one body, the stiffness must not resist."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.exports.dofs import COMPONENTS
from fe_import.model import Array, FEModel, IntArray
from fe_import.models.measures import GROUNDING, grounding

_LOCAL = 0.3  # share of the nodes at which a link is held, beyond which the matrix is another one
_NOTICED = 1e-3  # of the largest force
_DIRECTED = 1e-6  # mass by direction: files carry 6 digits or more
_CONDENSED = 1e-5  # resistance that rounding may leave in a condensed matrix: 1e-10 times the condition of a long link
_EXACT = 1e-9
_ALL_DIGITS = 9
_PRINTED = 5.0  # resistance by rounding, per last digit
_LARGEST = 3000  # rows of a condensed matrix
_FULL = 0.5  # share of entries from which on a matrix is a condensed one


def free_of_ground(model: FEModel, labels: IntArray, where: str) -> FEModel:
    """Refuse a link that is held, or whose matrices are not those of its nodes, and say which it probably is.

    A condensed stiffness is a small difference of large numbers, so rounding leaves it some resistance. That is taken
    away, and noted: K' = PᵀKP, P = 1 - R (RᵀMR)⁻¹ RᵀM with the rigid motions R, keeps the strain energy of all motions
    without momentum, and with it the elastic frequencies.

    Parameters
    ----------
    model : FEModel
    labels : (n,) int array
        Numbers of its first nodes in the program that exported it.
    where : str

    Raises
    ------
    FEImportError
        ``GROUNDED``; ``EXPORT``: no mass, or one that is not that of a body.
    """
    rigid = model.rigid_body_modes()
    if model.mass.nnz:
        _refuse_odd_mass(model, rigid, where)
    resisting, condensed = grounding(model), _is_condensed(model, len(labels))
    limit = _CONDENSED if condensed else GROUNDING
    if resisting > limit:
        message, remedy = _reason(model, rigid, labels)
        raise FEImportError(
            Cause.GROUNDED, message, where=f"{where}: matrices", value=resisting, limit=limit, remedy=remedy
        )
    if not model.mass.nnz:
        raise FEImportError(
            Cause.EXPORT,
            "no mass matrix",
            where=f"{where}: matrices.files",
            remedy="export it as well; a file of its own has the role 'mass'",
        )
    _refuse_odd_moments(model, rigid, where)
    inertia = rigid.T @ (model.mass @ rigid)
    if resisting <= _EXACT or not condensed or np.linalg.matrix_rank(inertia, hermitian=True) < 6:
        return model
    along = np.linalg.solve(inertia, (model.mass @ rigid).T)
    strained = model.stiffness.toarray()
    strained -= (model.stiffness @ rigid) @ along
    strained -= along.T @ (rigid.T @ strained)
    notes = {**model.notes, "grounding": f"rounding of {resisting:.1e} of the stiffness removed"}
    return replace(model, stiffness=sp.csc_array(strained), notes=notes)


def _is_condensed(model: FEModel, nodes: int) -> bool:
    """Few rows and hardly a zero among those of the exported nodes: as static condensation leaves a matrix."""
    rows = np.setdiff1d(np.arange(model.stiffness.shape[0]), model.dof_map[nodes:])
    return len(rows) <= _LARGEST and model.stiffness.nnz > _FULL * len(rows) ** 2


def _refuse_odd_mass(model: FEModel, rigid: Array, where: str) -> None:
    """A body has the mass m 1 for translations."""
    moved = rigid[:, :3].T @ (model.mass @ rigid[:, :3])
    mass = float(np.trace(moved)) / 3
    if np.abs(moved - mass * np.eye(3)).max() > _DIRECTED * abs(mass):
        raise _odd("the mass of the link differs by direction", where, np.diag(moved), "equal")


def _refuse_odd_moments(model: FEModel, rigid: Array, where: str) -> None:
    """Between translations and rotations a body has the skew matrix of its static moments."""
    moments = rigid[:, :3].T @ (model.mass @ rigid[:, 3:])
    mass = float(rigid[:, 0] @ (model.mass @ rigid[:, 0]))
    if np.abs(moments + moments.T).max() > _DIRECTED * abs(mass) * float(np.abs(model.nodes).max()):
        raise _odd("the static moments of the link differ by direction", where, np.diag(moments), "zero")


def _odd(message: str, where: str, value: Array, expected: str) -> FEImportError:
    return FEImportError(
        Cause.EXPORT,
        message,
        where=f"{where}: matrices",
        value=value.tolist(),
        limit=f"{expected} to {_DIRECTED:g}",
        remedy="check the order of the dofs, the signs of the entries, and that the file is whole",
    )


def _reason(model: FEModel, rigid: Array, labels: IntArray) -> tuple[str, str]:
    """What a stiffness that resists rigid-body motion probably is, and what to do."""
    rows = model.dof_map[: len(labels), :3]
    if len(empty := _without_stiffness(model, rows)):
        first = row_name(model.dof_map, labels, int(empty[0]))
        return (
            f"{len(empty)} displacements of nodes have no stiffness while others of them have, the first is {first}",
            "export the matrix again: these rows are lost, or belong to other dofs",
        )
    force = np.abs(model.stiffness @ rigid)
    terms = (abs(model.stiffness) @ np.abs(rigid)).max(axis=0)
    if (force[:, :3].max(axis=0) <= GROUNDING * terms[:3]).all():
        message = (
            "the stiffness resists rotations of the link, not its translations: the nodes are not where the matrices "
            "have them"
        )
        if "positions" in model.notes:
            message += f" (positions have {model.notes['positions']})"
            return message, "name the deck as 'mesh', which has all digits"
        return message, "check the unit of length, the mesh, the order of the dofs and the frames of the nodes"
    if pair := _flipped_pair(model, force):
        names = " and ".join(row_name(model.dof_map, labels, row) for row in pair)
        return f"the stiffness entry between {names} has the wrong sign", "mend it, and its twin in the other triangle"
    size = force[rows, :3].max(axis=(1, 2))
    held = size > _NOTICED * size.max()
    if held.mean() <= _LOCAL:
        return (
            f"the stiffness resists rigid-body motion at nodes {listed(labels[held])}",
            "a link must be free: remove supports, springs to ground and penalty stiffness from the export; without "
            "any, entries of these nodes are lost or changed",
        )
    digits = _significant_digits(model.stiffness)
    if digits < _ALL_DIGITS and force.max() <= _PRINTED * 10.0**-digits * terms.max():
        return (
            f"the stiffness resists rigid-body motion at most nodes, by the rounding of its {digits} digits: forces of "
            "bending are smaller",
            "export the matrices with all digits",
        )
    return (
        "the stiffness resists rigid-body motion at most nodes: it is probably the block of the kept dofs of a larger "
        "matrix, not the condensed one (CalculiX 2.20 writes this for *SUBSTRUCTURE GENERATE), a held link, or one of "
        "changed numbers",
        "export the full matrices, in CalculiX by *FREQUENCY, SOLVER=MATRIXSTORAGE, or check supports and the order of "
        "the dofs",
    )


def _without_stiffness(model: FEModel, rows: IntArray) -> IntArray:
    """Rows of displacements whose stiffness is zero, at nodes that have some."""
    diagonal = model.stiffness.diagonal()
    own = rows[(rows >= 0).all(axis=1)]
    empty = diagonal[own] == 0
    return np.asarray(own[empty & (~empty).any(axis=1, keepdims=True)])


def _significant_digits(matrix: sp.csc_array) -> int:
    """Of the entries as they were printed; `_ALL_DIGITS` where they have these or more."""
    values = np.abs(matrix.data[matrix.data != 0])
    size = 10.0 ** np.floor(np.log10(values))
    for digits in range(2, _ALL_DIGITS):
        steps = values / size * 10.0 ** (digits - 1)
        if (np.abs(steps - np.round(steps)) <= 1e-13 * steps + 1e-9).all():
            return digits
    return _ALL_DIGITS


def _flipped_pair(model: FEModel, force: Array) -> tuple[int, int] | None:
    """Two rows that alone resist translations, each with twice the entry between them."""
    resisting = force[:, :3].max(axis=1)
    rows = np.flatnonzero(resisting > _NOTICED * resisting.max())
    if len(rows) != 2:
        return None
    i, j = int(rows[0]), int(rows[1])
    twice = 2 * abs(float(model.stiffness[i, j]))
    return (i, j) if np.abs(resisting[rows] - twice).max() <= _NOTICED * twice else None


def row_name(dof_map: IntArray, labels: IntArray, row: int) -> str:
    """Row, component and node, by its number; modal coordinates have none."""
    found = np.argwhere(dof_map == row)
    if not len(found):
        return f"row {row + 1}, a modal coordinate"
    node, component = found[0]
    number = labels[node] if node < len(labels) else "of an interface"
    return f"row {row + 1}, {COMPONENTS[component]} of node {number}"


def listed(labels: IntArray) -> str:
    """The first of some numbers."""
    more = f" and {len(labels) - 8} more" if len(labels) > 8 else ""
    return ", ".join(map(str, labels[:8])) + more

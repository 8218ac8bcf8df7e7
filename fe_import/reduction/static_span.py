"""Elastic modes that keep static exactness: the static fields of a reduced link, completed by its lowest modes.

Which interface holds the link does not matter. With one clamped, the fields under loads on the others are fields
under self-balanced loads on all of them; the inertia of rigid-body accelerations is balanced there by reactions. In
the complement of the rigid-body motions that inertia does no work, so its field is one under unbalanced loads at the
interfaces, inertia-relieved. Together: the inertia-relieved fields of all unit loads.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from fe_import.model import Array

_NEW = 1e-8  # share of a field (energy norm) that those before do not hold; rounding leaves 1e-10 and less


def static_span(stiffness: Array, interfaces: Array, rigid: Array) -> Array:
    """Static fields of loads at the interfaces, or of others, orthonormal in the energy norm.

    Parameters
    ----------
    stiffness : (n, n) array
        Positive definite, over coordinates of the complement of the rigid-body motions.
    interfaces : (b, n) array
        Interface displacements and rotations per unit coordinate: what unit loads there do to the coordinates.
    rigid : (b, 6) array
        Interface displacements and rotations of the rigid-body motions; zero for loads in balance.

    Returns
    -------
    (n, s) array
        s <= b.
    """
    lower = la.cholesky(stiffness, lower=True)
    fields = la.solve_triangular(lower, interfaces.T, lower=True)  # in coordinates Lᵀz the energy norm is plain
    size = np.linalg.norm(fields, axis=0)
    moved = size > 0
    fields, rigid = fields[:, moved] / size[moved], rigid[moved] / size[moved, None]
    # self-balanced loads first: where the interfaces carry most of the mass, the others add little to them
    loads = la.qr(rigid)[0]
    balanced = _directions(fields @ loads[:, 6:])
    others = fields @ loads[:, :6]
    others /= np.maximum(np.linalg.norm(others, axis=0), np.finfo(float).tiny)
    for _ in range(2):
        others -= balanced @ (balanced.T @ others)
    found = np.hstack([balanced, _directions(others)])
    return np.asarray(la.solve_triangular(lower, found, lower=True, trans="T"))


def completed(span: Array, modes: Array, stiffness: Array, count: int) -> Array:
    """The span (n, s) and the first modes (n, m) that it lacks, ``count`` columns if there are as many."""
    for mode in modes.T:
        if span.shape[1] == count:
            break
        rest = mode / np.sqrt(mode @ stiffness @ mode)
        for _ in range(2):
            rest = rest - span @ (span.T @ (stiffness @ rest))
        share = np.sqrt((rest @ stiffness @ rest).clip(min=0))
        if share > _NEW:
            span = np.column_stack([span, rest / share])
    return span


def _directions(fields: Array) -> Array:
    """Orthonormal columns that span the fields, without those that rounding adds."""
    left, values, _ = la.svd(fields, full_matrices=False)
    return np.asarray(left[:, values > _NEW])

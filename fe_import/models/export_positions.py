"""Positions of few digits, mended by the stiffness: a free link feels no force when it turns about any axis.

Its rigid-body motions are the null space of K, whatever the file says about positions. Those of the stated positions
R hold to six digits; with six dofs S held, N = R - K_S⁻¹ K R is the null space to the digits of K. Three combinations
of its columns are the rotations e_k × x of one set of positions x: combinations u_k with u_k·e_l + u_l·e_k the same
at every node. They are unique but for one scale and the origin, which the stated positions give.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg as la

from fe_import.errors import Cause, FEImportError
from fe_import.exports import Export
from fe_import.model import Array, IntArray
from fe_import.solver.sparse import factorize

_UNIT = 1e-5  # of the last of six digits, per the leading power of ten
_ROUNDING = 0.6  # of that unit
_NOISE = 5e-7  # of the size of the link: rounding of the stated positions moves scale and origin
_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def mended_positions(export: Export) -> Export:
    """The export with positions of all digits, where nodes with displacements only are within rounding of the stated.

    Any other export comes back as it is, for the checks to say what is wrong with it.
    """
    nodes = np.flatnonzero(export.dof_map[:, 0] >= 0)
    dofs = export.dof_map[nodes, :3]
    if dofs.size != export.stiffness.shape[0] or (dofs < 0).any() or len(nodes) < 3:
        return export
    stated = export.nodes[nodes]
    centre = stated.mean(axis=0)
    found = _positions(export, dofs.ravel(), stated - centre)
    if found is None:
        return export
    unit = _UNIT * 10.0 ** np.floor(np.log10(np.abs(stated).clip(min=np.finfo(float).tiny)))
    limit = _ROUNDING * unit + _NOISE * np.abs(stated - centre).max()
    if not (np.abs(found + centre - stated) <= limit).all():
        return export
    mended = export.nodes.copy()
    mended[nodes] = found + centre
    return replace(export, nodes=mended, notes={**export.notes, "positions": f"{export.notes['positions']}, mended"})


def _positions(export: Export, dofs: IntArray, stated: Array) -> Array | None:
    """(n, 3) positions whose rotations the stiffness does not feel, about the centre of the stated ones."""
    rigid = np.tile(np.eye(3, 6), (len(stated), 1))
    for k, axis in enumerate(np.eye(3)):
        rigid[:, 3 + k] = np.cross(axis, stated).ravel() / np.abs(stated).max()
    stiffness = export.stiffness[dofs][:, dofs].tocsc()
    support = la.qr(rigid.T, mode="r", pivoting=True)[1][:6]
    rest = np.setdiff1d(np.arange(len(dofs)), support)
    try:
        solve = factorize(stiffness[rest][:, rest].tocsc(), "stiffness of the link", np.repeat(stated, 3, axis=0)[rest])
    except FEImportError as problem:
        if problem.cause is Cause.NOT_DEFINITE:
            return None
        raise
    force = stiffness @ rigid[:, 3:]
    turned = rigid[:, 3:].copy()
    turned[rest] -= solve(force[rest])
    fields = turned.reshape(-1, 3, 3)  # node, direction, column
    fields = fields - fields.mean(axis=0)
    conditions = np.zeros((len(_PAIRS), len(stated), 3, 3))  # ... of [column, axis]
    for row, (k, l) in enumerate(_PAIRS):
        conditions[row, :, :, l] += fields[:, k]
        conditions[row, :, :, k] += fields[:, l]
    mix = la.svd(conditions.reshape(-1, 9), full_matrices=False)[2][-1].reshape(3, 3)
    u = fields @ mix  # node, direction, axis
    found = np.stack([u[:, 2, 1] - u[:, 1, 2], u[:, 0, 2] - u[:, 2, 0], u[:, 1, 0] - u[:, 0, 1]], axis=1) / -2
    return np.asarray(found * (np.vdot(found, stated) / np.vdot(found, found)))

"""What moves without strain in a link that its reduction found to be unstable: loose parts, hinges inside."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from fe_import.model import Array, FEModel

_MOST_DOFS = 3000  # of a dense eigenproblem
_FREE = 1e-13  # of the largest scaled eigenvalue: no strain, up to rounding
_GAP = 1e3  # from motions without strain to those with some
NOT_CLEAR = (
    "or the link is too slender for its elements, or its parts differ too much in stiffness, for double precision: use "
    "beams, or fewer and longer elements"
)


def mechanism(model: FEModel) -> str:
    """How many motions without strain there are besides those of the whole link, and where; empty if not found.

    Parameters
    ----------
    model : FEModel
    """
    loose = _loose_part(model)
    if loose or model.mass.shape[0] > _MOST_DOFS:
        return loose
    _, stiffness = model.reduced_matrices()
    dense = stiffness.toarray()
    diagonal = np.diag(dense)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, diagonal.max()))
    values, vectors = la.eigh(dense * np.outer(scale, scale))
    count = int((values <= _FREE * values[-1]).sum()) - 6
    if count > 0 and values[count + 6] < _GAP * max(values[count + 5], np.finfo(float).eps * values[-1]):
        return NOT_CLEAR
    free = scale[:, None] * vectors[:, : count + 6]
    rigid = la.orth(model.rigid_body_modes()[model.independent])
    free = free - rigid @ (rigid.T @ free)
    motions, sizes, _ = la.svd(free, full_matrices=False)
    motions = motions[:, sizes > 1e-6 * sizes.max(initial=0.0)]
    if count <= 0 or not motions.shape[1]:
        return ""
    what = "one motion" if count == 1 else f"{count} motions"
    return f"{what} without strain inside the link, largest at {_place(model, motions[:, :count])}"


def _loose_part(model: FEModel) -> str:
    """Nodes that no stiffness joins to the others; modal coordinates count as nodes of their own."""
    owner = np.full(model.mass.shape[0], -1)
    for component in range(6):
        known = np.flatnonzero(model.dof_map[:, component] >= 0)
        owner[model.dof_map[known, component]] = known
    owner = owner[model.independent]
    modal = owner < 0
    owner[modal] = len(model.nodes) + np.arange(modal.sum())
    _, stiffness = model.reduced_matrices()
    pattern = sp.coo_array(stiffness)
    count = len(model.nodes) + int(modal.sum())
    joined = sp.coo_array((np.ones(pattern.nnz), (owner[pattern.row], owner[pattern.col])), shape=(count, count))
    _, part = connected_components(joined.tocsr(), directed=False)
    nodes = np.unique(owner[~modal])
    groups = [nodes[part[nodes] == k] for k in np.unique(part[nodes])]
    if len(groups) < 2:
        return ""
    smallest = min(groups, key=len)
    centre = ", ".join(f"{x:.4g}" for x in model.nodes[smallest].mean(axis=0))
    return (
        f"{len(groups)} parts that no stiffness joins, the smallest of {len(smallest)} of {len(nodes)} nodes around "
        f"({centre})"
    )


def _place(model: FEModel, motions: Array) -> str:
    """Position of the node that moves most."""
    full = np.zeros((model.mass.shape[0], motions.shape[1]))
    full[model.independent] = motions
    if model.coupling is not None:
        full = np.asarray(sp.csr_array(model.coupling) @ motions)
    rows = model.dof_map[:, :3]
    sizes = np.where(rows[..., None] >= 0, full[rows], 0.0)
    node = int(np.linalg.norm(sizes, axis=(1, 2)).argmax())
    return "({:.4g}, {:.4g}, {:.4g})".format(*model.nodes[node])

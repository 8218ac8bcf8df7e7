"""From a modal file or a finite-element model to matrices that other programs take."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.modal.model import ModalModel
from fe_import.model import Array, FEModel
from fe_import.writers.base import MODAL, WrittenLink

_DEPENDENT = 1e-9  # singular value of the interface displacements, per the largest of its kind


def of_modal_model(model: ModalModel, where: str) -> WrittenLink:
    """A superelement in Craig-Bampton form: six dofs of each interface node, then modal coordinates.

    The span of the modes is kept. With interface displacements u = Φ_b q, coordinates are q = C u + N η: C the shapes
    of least strain energy for unit displacements, N what moves no interface, orthonormal in mass and stiffness. So the
    stiffness has no block between u and η, and free frequencies are those of the modal file.

    Raises
    ------
    FEImportError
        ``MODE_COUNT``: fewer modes than interface dofs, or modes that do not move them independently.
    """
    held = _interface_shapes(model)
    mass, stiffness = model.invariants.m, model.stiffness
    size = np.sqrt(np.diag(stiffness + mass * np.diag(stiffness).max() / np.diag(mass).max()))
    scaled = held / size
    scaled /= np.abs(scaled).max(axis=1, keepdims=True)
    values = la.svd(scaled, compute_uv=False)
    if held.shape[1] < len(held) or values[-1] <= _DEPENDENT * values[0]:
        raise FEImportError(
            Cause.MODE_COUNT,
            "the modes do not move the interface dofs independently",
            where=where,
            value=f"{held.shape[1]} modes",
            limit=f"{len(held)} interface dofs",
            remedy="keep more elastic modes (six for each interface but one, at least), or static_correction = true",
        )
    inner = la.qr(held.T)[0][:, len(held) :]  # moves no interface
    omega2, modes = la.eigh(inner.T @ stiffness @ inner, inner.T @ mass @ inner)
    inner = inner @ modes
    unit = la.lstsq(held, np.eye(len(held)))[0]
    shapes = unit - inner @ (inner.T @ stiffness @ unit / omega2[:, None])
    span = np.hstack([shapes, inner])
    reduced = [(m + m.T) / 2 for m in (span.T @ mass @ span, span.T @ stiffness @ span)]
    count = len(model.interface_nodes)
    boundary = 6 * count
    for matrix, diagonal in zip(reduced, (np.ones(len(omega2)), omega2), strict=True):
        matrix[boundary:, boundary:] = np.diag(diagonal)
    reduced[1][:boundary, boundary:] = reduced[1][boundary:, :boundary] = 0.0
    return WrittenLink(
        name=model.name,
        mass=sp.csc_array(reduced[0]),
        stiffness=sp.csc_array(reduced[1]),
        labels=np.arange(1, count + 1),
        positions=np.stack([i.position for i in model.interface_nodes]),
        node=np.concatenate([np.repeat(np.arange(count), 6), np.arange(len(omega2))]),
        component=np.concatenate([np.tile(np.arange(6), count), np.full(len(omega2), MODAL)]),
        interfaces={i.name: k for k, i in enumerate(model.interface_nodes)},
    )


def _interface_shapes(model: ModalModel) -> Array:
    """(6 n_interfaces, m) displacements and rotations per unit coordinate."""
    parts = []
    for interface in model.interface_nodes:
        moved, turned = model.node_shape(interface.node)
        assert turned is not None
        parts += [moved, turned]
    return np.concatenate(parts)


def of_model(model: FEModel, where: str) -> WrittenLink:
    """The full matrices over the independent dofs, interface faces already on their nodes.

    Raises
    ------
    FEImportError
        ``INTERFACE``: averaged interfaces, which leave face nodes with some of their displacements only.
    """
    if any(i.coupling == "averaged" for i in model.interface_nodes):
        raise FEImportError(
            Cause.INTERFACE,
            "averaged interfaces make displacements of their faces depend on each other, which no file of nodes tells",
            where=where,
            remedy='write the reduced link (its modal file), or set coupling = "rigid"',
        )
    mass, stiffness = model.reduced_matrices()
    size = model.mass.shape[0]
    node, component = np.full(size, -1), np.full(size, MODAL)
    for c in range(6):
        known = np.flatnonzero(model.dof_map[:, c] >= 0)
        node[model.dof_map[known, c]] = known
        component[model.dof_map[known, c]] = c
    node, component = node[model.independent], component[model.independent]
    modal = component == MODAL
    node[modal] = np.arange(modal.sum())
    order = np.lexsort((component, node, modal))
    node, component, modal = node[order], component[order], modal[order]
    used = np.unique(node[~modal])
    dense = np.full(len(model.nodes), -1)
    dense[used] = np.arange(len(used))
    node = np.where(modal, node, dense[np.where(modal, 0, node)])
    return WrittenLink(
        name=model.name,
        mass=sp.csc_array(mass[order][:, order]),
        stiffness=sp.csc_array(stiffness[order][:, order]),
        labels=used + 1,
        positions=model.nodes[used],
        node=node,
        component=component,
        interfaces={i.name: int(dense[i.node]) for i in model.interface_nodes},
    )

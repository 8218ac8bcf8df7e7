"""Averaged coupling (RBE3): an interface node moves as the coupled nodes do on average; the face may deform.

With weights w_k (sum 1), the weighted mean position m, r_k = x_k - m and J = Σ w_k (r_k² 1 - r_k r_kᵀ), the motion
that fits the displacements u_k best (Σ w_k |u_k - ū - φ × r_k|² least) is

    ū = Σ w_k u_k,   φ = J⁻¹ Σ w_k r_k × u_k,   u_c = ū + φ × (x_c - m).

By virtual work a force F and a moment M at the interface node act on the face as f_k = w_k (F + (J⁻¹ M') × r_k),
M' = M + (x_c - m) × F: the resultants are those given, and no stiffness is added.

In the equations six displacements of the face follow from the interface node and the rest of the face, which becomes
a dense block of the stiffness: k nodes fill (3 k)² entries. A face of many nodes is therefore divided in patches;
each has an auxiliary node, without mass or stiffness, that averages it, and larger patches, at last the interface
node, average those: Σ_j (W_j d_j × ū_j + J_j φ_j) over patches j is the same sum, and the fill grows with k only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.interfaces.dependence import Dependence, arm, block_rows
from fe_import.model import Array, IntArray

UNDIVIDED = 150  # nodes of a face that needs no patches: (3 * 150)^2 entries are 2 MB
PATCH = 24  # nodes, or patches, of a patch at most
MOST = 10_000  # nodes of a face; divided in patches it adds some 2000 entries per node, 0.25 GB
MOST_UNDIVIDED = 1_000  # nodes of a set that cannot be divided, 100 MB
_NARROW = 0.05  # width over length below which a patch's rotation about its length is not averaged well
_DEPENDENT = 1e-8  # last pivot over the first when six displacements are chosen


@dataclass(frozen=True)
class Average:
    """Six equations ``components`` @ u = ``motion`` @ [displacement; rotation] of the node that averages.

    Attributes
    ----------
    components : (6, c) array
        Over the averaged components: three per node, six per auxiliary node. The rows of rotations are lengths.
    motion : (6, 6) array
    """

    components: Array
    motion: Array


@dataclass(frozen=True)
class Patch:
    """Some of a face's nodes, or some patches, with their share of its weight.

    Attributes
    ----------
    members : (k,) int array
        Indices into the face's nodes, or into the patches of the level below.
    weight : float
    position : (3,) array
        Weighted mean.
    inertia : (3, 3) array
        Σ w_k (r_k² 1 - r_k r_kᵀ) about it, over nodes.
    """

    members: IntArray
    weight: float
    position: Array
    inertia: Array


def _moments(points: Array, weights: Array) -> tuple[Array, Array, Array]:
    """Weighted mean (3,), offsets from it (k, 3) and weighted inertia about it (3, 3)."""
    mean = weights @ points / weights.sum()
    r = points - mean
    squares = np.einsum("k,ka,kb->ab", weights, r, r)
    return mean, r, np.trace(squares) * np.eye(3) - squares


@dataclass(frozen=True)
class Items:
    """What is averaged: nodes of a face, or patches of it.

    Attributes
    ----------
    rows : (k, 3) or (k, 6) int array
        Rows of their components; patches have rotations.
    points : (k, 3) array
    weights : (k,) array
    inertia : (k, 3, 3) array
        Of patches about their points, with their weights; 0 for nodes.
    """

    rows: IntArray
    points: Array
    weights: Array
    inertia: Array

    @staticmethod
    def of_nodes(rows: IntArray, points: Array, weights: Array) -> Items:
        """Nodes of a face."""
        return Items(rows, points, weights, np.zeros((len(points), 3, 3)))

    @staticmethod
    def of_patches(rows: IntArray, patches: list[Patch]) -> Items:
        """Patches of a face, by their auxiliary nodes."""
        points, inertia = np.stack([p.position for p in patches]), np.stack([p.inertia for p in patches])
        return Items(rows, points, np.array([p.weight for p in patches]), inertia)

    def some(self, members: IntArray) -> Items:
        """A part of them."""
        return Items(self.rows[members], self.points[members], self.weights[members], self.inertia[members])

    @property
    def sizes(self) -> Array:
        """(k, 3) or (k, 6) one over the length that makes a component comparable to a displacement."""
        width = self.rows.shape[1]
        result = np.ones((len(self.rows), width))
        if width == 6:
            result[:, 3:] /= np.sqrt(np.trace(self.inertia, axis1=1, axis2=2) / (2 * self.weights))[:, None]
        return result


def average(items: Items, centre: Array) -> Average:
    """The average motion of items, seen from a node at ``centre`` (3,)."""
    whole = items.weights.sum()
    weights = np.asarray(items.weights / whole)
    mean, r, total = _moments(items.points, weights)
    total = total + items.inertia.sum(axis=0) / whole
    components = np.zeros((6, *items.rows.shape))
    components[:3, :, :3] = weights[None, :, None] * np.eye(3)[:, None, :]
    components[3:, :, :3] = np.moveaxis(weights[:, None, None] * arm(r)[:, :, 3:].transpose(0, 2, 1), 1, 0)
    if items.rows.shape[1] == 6:
        components[3:, :, 3:] = np.moveaxis(items.inertia / whole, 1, 0)
    radius = float(np.sqrt(np.trace(total) / 2))
    motion = np.zeros((6, 6))
    motion[:3] = arm((mean - centre)[None])[0]
    motion[3:, 3:] = radius * np.eye(3)
    flat = components.reshape(6, -1)
    flat[3:] = radius * la.solve(total, flat[3:], assume_a="pos")
    return Average(flat, motion)


def divided(points: Array, weights: Array, whole: bool, name: str, source: str) -> list[list[Patch]]:
    """Patches of a face, patches of those, and so on; none when it is small, must stay ``whole``, or cannot be cut.

    Raises
    ------
    FEImportError
        ``INTERFACE``: more nodes than memory allows, with the estimate.
    """
    count = len(points)
    levels: list[list[Patch]] = []
    if UNDIVIDED < count <= MOST and not whole:
        inertia = np.zeros((count, 3, 3))
        while len(points) > PATCH:
            patches = [_patch(points, weights, inertia, m) for m in _halved(points, np.arange(len(points)))]
            levels.append(patches)
            points, weights = np.stack([p.position for p in patches]), np.array([p.weight for p in patches])
            inertia = np.stack([p.inertia for p in patches])
        if any(_narrow(p.inertia) for level in levels for p in level):
            levels = []
    if count > MOST or (count > MOST_UNDIVIDED and not levels):
        raise FEImportError(
            Cause.INTERFACE,
            f"interface {name!r} averages too many nodes; its equations would fill about "
            f"{(3 * count) ** 2 * 12 / 1e9:.2g} GB",
            where=source,
            value=count,
            limit=MOST if count > MOST else f"{MOST_UNDIVIDED} nodes that cannot be divided in patches",
            remedy='name a node set with part of them, or use coupling = "rigid"',
        )
    return levels


def _patch(points: Array, weights: Array, inertia: Array, members: IntArray) -> Patch:
    mean, _, total = _moments(points[members], weights[members])
    return Patch(members, float(weights[members].sum()), mean, total + inertia[members].sum(axis=0))


def _narrow(inertia: Array) -> bool:
    """Whether the rotation about the longest direction is not averaged well."""
    least, _, most = np.linalg.eigvalsh(inertia)
    return bool(least < _NARROW**2 * most)


def _halved(points: Array, members: IntArray) -> list[IntArray]:
    """Cut across the longest side until the parts are small."""
    if len(members) <= PATCH:
        return [members]
    along = points[members, np.ptp(points[members], axis=0).argmax()]
    order = members[np.argsort(along, kind="stable")]
    half = len(order) // 2
    return _halved(points, order[:half]) + _halved(points, order[half:])


def follow_average(
    state: Dependence, nodes: Items, centre: Array, interface: IntArray, levels: list[list[Patch]], patch_rows: IntArray
) -> Dependence | None:
    """Let an interface node move as its face does on average.

    Parameters
    ----------
    state : Dependence
    nodes : Items
        Of the face.
    centre : (3,) array
        Position of the interface node.
    interface : (6,) int array
        Its rows.
    levels : list of lists of Patch
        See `divided`.
    patch_rows : (p, 6) int array
        Rows of their auxiliary nodes, level by level.

    Returns
    -------
    Dependence or None
        None when the face moves with other interfaces already.
    """
    items = nodes
    for patches in levels:
        here, patch_rows = patch_rows[: len(patches)], patch_rows[len(patches) :]
        found = [_solved(state, items.some(p.members), p.position, own) for p, own in zip(patches, here, strict=True)]
        parts = [f for f in found if f is not None]
        if len(parts) < len(found):
            return None
        state = state.following(np.concatenate([c for c, _ in parts]), sp.vstack([e for _, e in parts], format="csr"))
        items = Items.of_patches(here, patches)
    last = _solved(state, items, centre, interface)
    return None if last is None else state.following(*last)


def _solved(state: Dependence, items: Items, centre: Array, node: IntArray) -> tuple[IntArray, sp.csr_array] | None:
    """Six of the averaged components (columns), from the node that averages and from the others."""
    equations, rows = average(items, centre), items.rows.ravel()
    terms = (sp.csr_array(equations.components) @ state.matrix[rows]).tocsc()
    used = np.flatnonzero(np.diff(terms.indptr))
    values = terms[:, used].toarray()
    size = np.zeros(state.matrix.shape[0])
    size[rows] = items.sizes.ravel()  # 0 for what other interfaces move
    chosen = _well_conditioned(values * size[state.independent[used]])
    if chosen is None:
        return None
    others = np.setdiff1d(np.arange(len(used)), chosen)
    solution = la.solve(values[:, chosen], np.hstack([equations.motion, -values[:, others]]))
    columns = np.concatenate([state.columns(node), used[others]])
    return used[chosen], block_rows(solution, columns, len(state.independent))


def _well_conditioned(matrix: Array) -> IntArray | None:
    """Six columns that a pivoted QR factorization takes first; None when there are no six independent ones."""
    if matrix.shape[1] < 6:
        return None
    scaled = matrix / np.linalg.norm(matrix, axis=1, keepdims=True).clip(min=np.finfo(float).tiny)
    triangle, order = la.qr(scaled, mode="r", pivoting=True)
    pivots = np.abs(np.diag(triangle))
    return order[:6] if pivots[5] > _DEPENDENT * pivots[0] else None

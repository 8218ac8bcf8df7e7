"""Element matrices of an isotropic solid, many elements at a time, and their sum in compressed rows.

With G_ab[i, j] = ∫ ∂_a φ_i ∂_b φ_j the stiffness between component a of node i and b of node j is λ G_ab +
μ G_ba + μ δ_ab tr G (Lamé's λ, μ). The shape functions interpolate the geometry as well (isoparametric elements),
hex20's curved sides with its own twenty.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp

from fe_import.elements.solid_mesh import SolidMesh
from fe_import.model import Array, IntArray

_CHUNK_VALUES = 3_000_000  # entries of element matrices held at a time


def element_masses(mesh: SolidMesh, elements: IntArray, density: float) -> Array:
    """(e, k, k) consistent mass between the nodes of each element, the same for all three components [kg]."""
    points, weights = mesh.element.quadrature(mesh.element.mass_order)
    values = mesh.element.shape_values(points)
    products = np.einsum("iq,jq->qij", values, values).reshape(len(weights), -1)
    volume = _volumes(_tangents(mesh, elements, mesh.element.shape_gradients(points))) * weights
    masses = (density * volume @ products).reshape(len(elements), len(values), len(values))
    return np.asarray((masses + masses.swapaxes(1, 2)) / 2)


def element_stiffnesses(mesh: SolidMesh, elements: IntArray, lam: float, mu: float) -> Array:
    """(e, 3 k, 3 k) stiffness of each element, row 3 * node + component, symmetric to the last bit [N/m]."""
    points, weights = mesh.element.quadrature(mesh.element.stiffness_order)
    reference = mesh.element.shape_gradients(points)
    tangents = _tangents(mesh, elements, reference)
    volume = _volumes(tangents)
    k, q = reference.shape[0], reference.shape[2]
    # ∂φ/∂x = Σ_d (∂X_d/∂x) ∂φ/∂X_d, and ∂X_0/∂x = t_1 × t_2 / volume
    normals = np.stack([np.cross(tangents[d - 2], tangents[d - 1]) for d in range(3)], axis=-1)  # (e, q, 3, 3)
    scaled = (normals * np.sqrt(weights / volume)[:, :, None, None]) @ reference.transpose(2, 1, 0)
    scaled = scaled.transpose(0, 3, 2, 1).reshape(len(elements), 3 * k, q)
    g = (scaled @ scaled.swapaxes(1, 2)).reshape(len(elements), k, 3, k, 3)
    stiffness = lam * g + mu * g.swapaxes(2, 4)
    trace = mu * np.einsum("eiaja->eij", g)
    for a in range(3):
        stiffness[:, :, a, :, a] += trace
    stiffness = stiffness.reshape(len(elements), 3 * k, 3 * k)
    return np.asarray((stiffness + stiffness.swapaxes(1, 2)) / 2)


def _tangents(mesh: SolidMesh, elements: IntArray, gradients: Array) -> Array:
    """(3, e, q, 3) derivatives of the position by each reference coordinate."""
    corners = mesh.nodes[mesh.elements[elements]].swapaxes(1, 2)  # (e, 3, k)
    k, _, q = gradients.shape
    by_all = (corners @ gradients.reshape(k, 3 * q)).reshape(-1, 3, 3, q)
    return np.ascontiguousarray(by_all.transpose(2, 0, 3, 1))


def _volumes(tangents: Array) -> Array:
    """(e, q) volume per reference volume."""
    return np.asarray(np.einsum("eqc,eqc->eq", tangents[0], np.cross(tangents[1], tangents[2])))


def chunks(mesh: SolidMesh, elements: IntArray) -> Iterator[IntArray]:
    """A few elements at a time, which bounds the memory."""
    step = max(1, _CHUNK_VALUES // (9 * len(mesh.element.reference_nodes) ** 2))
    for start in range(0, len(elements), step):
        yield elements[start : start + step]


class NodePattern:
    """Which nodes share an element: the places of the entries of compressed matrices over all nodes.

    Parameters
    ----------
    mesh : SolidMesh
    """

    def __init__(self, mesh: SolidMesh) -> None:
        self._elements = mesh.elements
        count, k = mesh.elements.shape
        shape = (len(mesh.nodes), count)
        ends = mesh.elements.ravel(), np.arange(count).repeat(k)
        belongs = sp.csr_array((np.ones(count * k, dtype=np.int32), ends), shape)
        pattern = (belongs @ belongs.T).tocsr()
        pattern.sort_indices()
        self._start = pattern.indptr.astype(np.int64)
        self._columns = pattern.indices.astype(np.int32 if 9 * pattern.nnz < 2**31 else np.int64)
        self._keys = np.repeat(np.arange(len(mesh.nodes)), np.diff(self._start)) * len(mesh.nodes) + self._columns

    @property
    def size(self) -> int:
        """Number of pairs of nodes."""
        return len(self._columns)

    def add_masses(self, data: Array, elements: IntArray, masses: Array) -> None:
        """Add element matrices (e, k, k) to the entries (size,) of a matrix over the nodes."""
        np.add.at(data, self._places(elements).ravel(), masses.ravel())

    def add_stiffnesses(self, data: Array, elements: IntArray, stiffnesses: Array) -> None:
        """Add element matrices (e, 3 k, 3 k) to the entries (9 size,) of a matrix over the nodal components."""
        nodes, place = self._elements[elements], self._places(elements)
        start = self._start[nodes][:, :, None]
        length = self._start[nodes + 1][:, :, None] - start
        # row 3 i + a begins after 9 entries per earlier pair and 3 a per pair of this node; 3 entries per pair in it
        first = 9 * start + 3 * (place - start)
        a, b = np.arange(3)[:, None, None], np.arange(3)
        to = first[:, :, None, :, None] + 3 * a * length[:, :, None, :, None] + b
        np.add.at(data, to.ravel(), stiffnesses.ravel())

    def mass(self, data: Array) -> sp.csc_array:
        """Matrix over the nodal components, equal for each, from entries over the nodes."""
        indptr, at = self._thrice(1)
        columns = 3 * self._columns[at]
        columns += np.repeat(np.tile(np.arange(3, dtype=at.dtype), len(self._start) - 1), np.diff(indptr))
        return _symmetric(data[at], columns, indptr)

    def stiffness(self, data: Array) -> sp.csc_array:
        """Matrix over the nodal components from its entries."""
        indptr, at = self._thrice(3)
        return _symmetric(data, (3 * self._columns[:, None] + np.arange(3, dtype=at.dtype)).ravel()[at], indptr)

    def _thrice(self, each: int) -> tuple[IntArray, IntArray]:
        """Row pointers (3 n + 1,) when the row of a node, with ``each`` entries per pair, is there for each of its
        components; and which entry of the nodes' rows every entry is."""
        rows = np.repeat(each * np.diff(self._start), 3)
        indptr = np.concatenate([[0], np.cumsum(rows)])
        small = self._columns.dtype
        at = np.arange(indptr[-1], dtype=small)
        at -= np.repeat((indptr[:-1] - np.repeat(each * self._start[:-1], 3)).astype(small), rows)
        return indptr, at

    def _places(self, elements: IntArray) -> IntArray:
        """(e, k, k) entry of each pair of nodes of each element."""
        nodes, count = self._elements[elements], len(self._start) - 1
        return np.asarray(np.searchsorted(self._keys, nodes[:, :, None] * count + nodes[:, None, :]))


def _symmetric(data: Array, indices: IntArray, indptr: IntArray) -> sp.csc_array:
    """Compressed rows of a symmetric matrix are its compressed columns."""
    size = len(indptr) - 1
    return sp.csc_array((data, indices, indptr.astype(indices.dtype)), shape=(size, size))

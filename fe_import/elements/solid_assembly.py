"""Element matrices of a solid, many elements at a time, and their sum in compressed rows.

With G_ab[i, j] = ∫ ∂_a φ_i ∂_b φ_j the stiffness between component a of node i and b of node j is λ G_ab +
μ G_ba + μ δ_ab tr G (Lamé's λ, μ) of isotropic materials, Σ C_ac,bd G_cd of others. The shape functions interpolate
the geometry as well (isoparametric elements), hex20's curved sides with its own twenty.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp

from fe_import.elements.elasticity import PAIRS, lame_parameters
from fe_import.elements.solid_elements import SolidElement
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.model import Array, IntArray

_CHUNK_VALUES = 3_000_000  # entries of element matrices held at a time


def element_masses(element: SolidElement, corners: Array, density: float) -> Array:
    """(e, k, k) consistent mass between the nodes of each element, the same for all three components [kg].

    ``corners`` (e, k, 3): positions of the nodes.
    """
    points, weights = element.quadrature(element.mass_order)
    values = element.shape_values(points)
    products = np.einsum("iq,jq->qij", values, values).reshape(len(weights), -1)
    volume = _volumes(_tangents(corners, element.shape_gradients(points))) * weights
    masses = (density * volume @ products).reshape(len(corners), len(values), len(values))
    return np.asarray((masses + masses.swapaxes(1, 2)) / 2)


def element_stiffnesses(element: SolidElement, corners: Array, moduli: Array) -> Array:
    """(e, 3 k, 3 k) stiffness of each element, row 3 * node + component, symmetric to the last bit [N/m].

    ``corners`` (e, k, 3): positions of the nodes; ``moduli`` (6, 6) or (e, 6, 6), see `fe_import.elements.elasticity`.
    Incompatible modes are eliminated.
    """
    full, size = _with_modes(element, corners, moduli), 3 * element.size
    if not element.incompatible:
        return full
    motion = _motion_of_modes(full, size)
    stiffness = full[:, :size, :size] + full[:, :size, size:] @ motion
    return np.asarray((stiffness + stiffness.swapaxes(1, 2)) / 2)


def motion_of_modes(element: SolidElement, corners: Array, moduli: Array) -> Array:
    """(e, 9 or 0, 3 k) incompatible modes that go with the displacements of the nodes; ``moduli`` (e, 6, 6)."""
    size = 3 * element.size
    if not element.incompatible:
        return np.zeros((len(corners), 0, size))
    return _motion_of_modes(_with_modes(element, corners, moduli), size)


def _motion_of_modes(full: Array, size: int) -> Array:
    return np.asarray(-np.linalg.solve(full[:, size:, size:], full[:, size:, :size]))


def _with_modes(element: SolidElement, corners: Array, moduli: Array) -> Array:
    """(e, 3 k', 3 k') stiffness over nodes and incompatible modes."""
    scaled = _weighted_slopes(element, corners, *element.quadrature(element.stiffness_order))
    lame = lame_parameters(moduli)
    stiffness = _anisotropic(scaled, moduli) if lame is None else _isotropic(scaled, *lame)
    return np.asarray((stiffness + stiffness.swapaxes(1, 2)) / 2)


def _isotropic(scaled: Array, lam: Array, mu: Array) -> Array:
    """(e, 3 k, 3 k) of weighted slopes (e, q, 3, k)."""
    count, q, _, k = scaled.shape
    scaled = scaled.transpose(0, 3, 2, 1).reshape(count, 3 * k, q)
    g = scaled @ scaled.swapaxes(1, 2)
    terms = g.reshape(count, k, 3, k, 3)
    lam, mu = lam.reshape(-1, 1, 1), mu.reshape(-1, 1, 1)
    stiffness = (lam * g + mu * terms.swapaxes(2, 4).reshape(g.shape)).reshape(terms.shape)
    trace = mu * np.einsum("eiaja->eij", terms)
    for a in range(3):
        stiffness[:, :, a, :, a] += trace
    return stiffness.reshape(g.shape)


def _anisotropic(scaled: Array, moduli: Array) -> Array:
    """(e, 3 k, 3 k) of weighted slopes (e, q, 3, k)."""
    count, q, _, k = scaled.shape
    strains = np.zeros((count, q, 6, k, 3))
    for row, (a, b) in enumerate(PAIRS):
        strains[:, :, row, :, a] += scaled[:, :, b]
        if a != b:
            strains[:, :, row, :, b] += scaled[:, :, a]
    flat, whole = strains.reshape(count, q, 6, 3 * k), (count, 6 * q, 3 * k)
    stresses = (moduli[:, None] if moduli.ndim == 3 else moduli) @ flat
    return np.asarray(flat.reshape(whole).swapaxes(1, 2) @ stresses.reshape(whole))


def _weighted_slopes(element: SolidElement, corners: Array, points: Array, weights: Array) -> Array:
    """(e, q, 3, k') derivatives of shape functions and incompatible modes, times the root of weight and volume."""
    reference = element.shape_gradients(points)
    tangents = _tangents(corners, reference)
    root = np.sqrt(weights / _volumes(tangents))[:, :, None, None]
    # ∂φ/∂x = Σ_d (∂X_d/∂x) ∂φ/∂X_d, and ∂X_0/∂x = t_1 × t_2 / volume
    scaled = (_normals(tangents) * root) @ reference.transpose(2, 1, 0)
    if not element.incompatible:
        return np.asarray(scaled)
    centre = np.full((3, 1), 0.5)
    normals = _normals(_tangents(corners, element.shape_gradients(centre)))
    modes = (normals * root) @ element.incompatible_gradients(points).transpose(2, 1, 0)
    return np.concatenate([scaled, modes], axis=3)


def slopes(element: SolidElement, corners: Array, points: Array) -> tuple[Array, Array]:
    """Derivatives in space (e, q, 3, k') of shape functions, then of incompatible modes, and volume (e, q) there.

    ``corners`` (e, k, 3): positions of the nodes; ``points`` (3, q) of the reference cell.
    """
    volume = _volumes(_tangents(corners, element.shape_gradients(points)))
    scaled = _weighted_slopes(element, corners, points, np.ones(points.shape[1]))
    return scaled / np.sqrt(volume)[:, :, None, None], volume


def _normals(tangents: Array) -> Array:
    """(e, q, 3, 3) columns t_1 × t_2 ..., the reference coordinates' slopes times the volume."""
    return np.stack([np.cross(tangents[d - 2], tangents[d - 1]) for d in range(3)], axis=-1)


def _tangents(corners: Array, gradients: Array) -> Array:
    """(3, e, q, 3) derivatives of the position by each reference coordinate."""
    k, _, q = gradients.shape
    by_all = (corners.swapaxes(1, 2) @ gradients.reshape(k, 3 * q)).reshape(-1, 3, 3, q)
    return np.ascontiguousarray(by_all.transpose(2, 0, 3, 1))


def _volumes(tangents: Array) -> Array:
    """(e, q) volume per reference volume."""
    return np.asarray(np.einsum("eqc,eqc->eq", tangents[0], np.cross(tangents[1], tangents[2])))


def chunks(mesh: SolidMesh, chosen: IntArray | None = None) -> Iterator[tuple[SolidElement, IntArray, IntArray]]:
    """A few elements of one type at a time, which bounds the memory: type, nodes (e, k) and numbers (e,)."""
    for block, rows, numbers in mesh.parts(chosen):
        step = max(1, _CHUNK_VALUES // (9 * block.element.size**2))
        for start in range(0, len(rows), step):
            some = slice(start, start + step)
            yield block.element, block.elements[rows[some]], numbers[some]


class NodePattern:
    """Which nodes share an element: the places of the entries of compressed matrices over all nodes.

    Parameters
    ----------
    mesh : SolidMesh
    """

    def __init__(self, mesh: SolidMesh) -> None:
        ends = (
            np.concatenate([block.elements.ravel() for block in mesh.blocks]),
            np.concatenate([numbers.repeat(block.element.size) for block, _, numbers in mesh.parts()]),
        )
        belongs = sp.csr_array((np.ones(len(ends[0]), dtype=np.int32), ends), (len(mesh.nodes), mesh.count))
        pattern = (belongs @ belongs.T).tocsr()
        pattern.sort_indices()
        self._start = pattern.indptr.astype(np.int64)
        self._columns = pattern.indices.astype(np.int32 if 9 * pattern.nnz < 2**31 else np.int64)
        self._keys = np.repeat(np.arange(len(mesh.nodes)), np.diff(self._start)) * len(mesh.nodes) + self._columns

    @property
    def size(self) -> int:
        """Number of pairs of nodes."""
        return len(self._columns)

    def add_masses(self, data: Array, nodes: IntArray, masses: Array) -> None:
        """Add matrices (e, k, k) of elements with ``nodes`` (e, k) to the entries (size,) of one over the nodes."""
        np.add.at(data, self._places(nodes).ravel(), masses.ravel())

    def add_stiffnesses(self, data: Array, nodes: IntArray, stiffnesses: Array) -> None:
        """The same with matrices (e, 3 k, 3 k), to the entries (9 size,) of a matrix over the nodal components."""
        place = self._places(nodes)
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

    def _places(self, nodes: IntArray) -> IntArray:
        """(e, k, k) entry of each pair of nodes of each element."""
        count = len(self._start) - 1
        return np.asarray(np.searchsorted(self._keys, nodes[:, :, None] * count + nodes[:, None, :]))


def _symmetric(data: Array, indices: IntArray, indptr: IntArray) -> sp.csc_array:
    """Compressed rows of a symmetric matrix are its compressed columns."""
    size = len(indptr) - 1
    return sp.csc_array((data, indices, indptr.astype(indices.dtype)), shape=(size, size))

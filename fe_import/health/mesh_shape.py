"""Elements and nodes of a solid's mesh that no mesher makes: slivers, and nodes that were moved off their surface."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe_import.elements.solid_mesh import SolidMesh, boundary_faces
from fe_import.mesh.checks import scaled_jacobians
from fe_import.modal.model import HealthCheck
from fe_import.model import Array, IntArray

_SLIVER = 1000.0  # inverse of the scaled Jacobian; meshers leave 3 to 30, and 250 where edges of thin corners bend
_SMOOTH = 0.4  # edge lengths: where the surroundings are farther off, nothing leads back
_OFF = 0.72  # edge lengths; a sound cube of two elements along each side has √½ where three parts meet
_CORNERS = {3: 3, 4: 4, 6: 3, 8: 4, 9: 4}  # of a face with so many nodes


def check_mesh_shape(mesh: SolidMesh) -> tuple[HealthCheck, ...]:
    """The worst element, and the node that is farthest off the surface around it."""
    jacobians = scaled_jacobians(mesh)
    worst = int(jacobians.argmin())
    flatness = float(1 / jacobians[worst])
    name = "mesh: flatness of the worst element (inverse scaled Jacobian)"
    if flatness > _SLIVER:
        at = mesh.nodes[mesh.element_nodes(worst)].mean(axis=0)
        slivers = int((jacobians < 1 / _SLIVER).sum())
        name += f"; {slivers} slivers, the worst is element {worst} at {_place(at)}: refine or repair the mesh there"
    checks = [HealthCheck(name, flatness, _SLIVER)]
    nodes, off = nodes_off_surface(mesh)
    if len(nodes):
        name = "mesh: node off the surface around it, per edge length"
        if off.max() > _OFF:
            node = int(nodes[off.argmax()])
            name += f"; node {node} at {_place(mesh.nodes[node])} seems to be moved"
        checks.append(HealthCheck(name, float(off.max()), _OFF))
    return tuple(checks)


def _place(point: Array) -> str:
    return "({:.4g}, {:.4g}, {:.4g})".format(*point)


def nodes_off_surface(mesh: SolidMesh) -> tuple[IntArray, Array]:
    """How far corners of the surface are from where their neighbours lead.

    Going from a node over a neighbour j to its neighbour k, the surface leads back to 2 x_j - x_k, and between two
    neighbours to their middle: to the node itself on planes and along straight edges, near it on curved ones, and at
    cones and pyramids too. A node that was moved is far from all of these.

    Returns
    -------
    nodes : (c,) int array
    off : (c,) array
        Smallest distance, per mean length of the edges of its neighbours; 0 where the surroundings are as far off.
    """
    pairs = []
    for faces in boundary_faces(mesh):
        count = _CORNERS[faces.shape[1]]
        ring = faces[:, [*range(count), 0]]
        pairs += [ring[:, k : k + 2] for k in range(count)]
    edges = np.concatenate(pairs)
    nodes, index = np.unique(edges, return_inverse=True)
    index = index.reshape(-1, 2)
    count = len(nodes)
    both = np.concatenate([index, index[:, ::-1]])
    graph = sp.csr_array((np.ones(len(both)), both.T), shape=(count, count))
    graph.sum_duplicates()
    off = _unled(mesh.nodes[nodes], graph)
    ring = graph + graph @ graph
    ring = sp.csr_array(ring - sp.diags_array(ring.diagonal()))
    around = np.zeros(count)
    np.maximum.at(around, np.repeat(np.arange(count), np.diff(ring.indptr)), off[ring.indices] * (ring.data > 0))
    return nodes, np.where(around <= _SMOOTH, off, 0.0)


def _unled(points: Array, graph: sp.csr_array) -> Array:
    """(c,) distance of each point from the nearest place where its neighbours lead."""
    near, degree = graph.indices, np.diff(graph.indptr)
    node = np.repeat(np.arange(len(points)), degree)
    over = np.repeat(near, degree[near])  # paths node - over - beyond
    start, beyond = np.repeat(node, degree[near]), near[_ranges(graph.indptr[near], degree[near])]
    length = np.linalg.norm(points[over] - points[beyond], axis=1)
    places = np.linalg.norm(2 * points[over] - points[beyond] - points[start], axis=1)
    places[beyond == start] = np.inf
    one, two = np.repeat(near, degree[node]), near[_ranges(graph.indptr[node], degree[node])]  # pairs of neighbours
    middle = np.repeat(node, degree[node])
    between = np.linalg.norm((points[one] + points[two]) / 2 - points[middle], axis=1)
    nearest = np.full(len(points), np.inf)
    np.minimum.at(nearest, start, places)
    np.minimum.at(nearest, middle, between)
    others = beyond != start
    total = np.bincount(start[others], length[others], minlength=len(points))
    paths = np.bincount(start[others], minlength=len(points))
    return np.asarray(np.where(paths > 0, nearest * paths / np.where(total > 0, total, 1.0), 0.0))


def _ranges(starts: IntArray, counts: IntArray) -> IntArray:
    """starts[0], starts[0] + 1, ... (counts[0] of them), starts[1], ..."""
    ends = np.cumsum(counts)
    return np.asarray(np.arange(ends[-1]) + np.repeat(starts - ends + counts, counts))

"""Cross sections of a slender link of which only matrices and nodes are known: who touches whom says where they lie.

Nodes that share a stiffness are neighbours. Ways along them from the reference interface have a length; nodes at equal
lengths, as far as they hang together, are a cross section (a Reeb graph of that length). Sections that join again
farther out, as on both sides of a bore, are one, if they are close.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components, dijkstra

from fe_import.model import Array, FEModel, IntArray

_MOST = 200  # sections along the longest way
_LEAST = 10
_ONE_SECTION = 0.2  # distance of what is joined to one section, in lengths of the longest way
_TOLD_BY_TURNING = 1e-2  # weight of the rotation of a node, in squares of the distance of sections
_FLAT = 1e-9  # inertia of a section about its thinnest axis


class NoSections(Exception):
    """Why a link has no line of cross sections."""


@dataclass(frozen=True)
class CrossSections:
    """Sections of a link, each after the one that it hangs on, the first of all next to the reference.

    Attributes
    ----------
    of_node : (n,) int array
        Section of each node, -1 of those without stiffness.
    parent : (s,) int array
        -1 of the first.
    weights : (n,) array
        Lumped mass of each node [kg].
    centres : (s, 3) array
        [m]
    masses : (s,) array
    inertia : (s, 3, 3) array
        About their centres, of nodes as points, and of what turns with them [kg m²].
    turning : float
        Weight of the rotation of a node beside that of its displacement [m²].
    """

    of_node: IntArray
    parent: IntArray
    weights: Array
    centres: Array
    masses: Array
    inertia: Array
    turning: float

    def motion(self, model: FEModel, fields: Array) -> tuple[Array, Array]:
        """(s, 3, m) displacement of their centres and rotations of the rigid motions next to fields (d, m)."""
        nodes = np.flatnonzero(self.of_node >= 0)
        own, weights = self.of_node[nodes], self.weights[nodes]
        moved = fields[model.dof_map[nodes, :3]]
        arms = model.nodes[nodes] - self.centres[own]
        count = len(self.parent)
        share = sp.csr_array((weights / self.masses[own], (own, np.arange(len(nodes)))), shape=(count, len(nodes)))
        u = (share @ moved.reshape(len(nodes), -1)).reshape(count, 3, -1)
        resist = _inertia(arms)
        spin = np.cross(arms[:, :, None], moved, axis=1)
        turning = np.flatnonzero(model.dof_map[nodes, 3] >= 0)
        resist[turning] += self.turning * np.eye(3)
        spin[turning] += self.turning * fields[model.dof_map[nodes[turning], 3:]]
        resist, spin = ((share @ a.reshape(len(nodes), -1)).reshape(count, 3, -1) for a in (resist, spin))
        least = np.linalg.eigvalsh(resist)
        if not (least[:, 0] > _FLAT * least[:, 2]).all():
            raise NoSections("a cross section of nodes on one line does not tell how it turns")
        return u, np.linalg.solve(resist, spin)


def cross_sections(model: FEModel, reference: int) -> CrossSections:
    """Sections from an interface outward.

    Raises
    ------
    NoSections
    """
    rows = model.dof_map[model.dof_map >= 0]
    if len(rows) < model.mass.shape[0]:
        raise NoSections("rows of modal coordinates do not say how the link deforms between its nodes")
    graph = _neighbours(model)
    touched = np.flatnonzero(np.diff(graph.indptr))
    sources = np.intersect1d(model.interface_nodes[reference].coupled_nodes, touched)
    distance = dijkstra(graph, directed=False, indices=sources, min_only=True)[touched]
    if not np.isfinite(distance).all():
        raise NoSections("not all nodes hang together by the stiffness")
    graph = graph[touched][:, touched].tocoo()
    a, b = graph.coords
    reach = float(distance.max())
    step = max(float(np.abs(distance[a] - distance[b]).max()), reach / _MOST)
    if reach < _LEAST * step:
        raise NoSections(
            f"every node has a stiffness with nodes as far as {step / reach:.2g} of the link, as condensed matrices "
            "and compact links do"
        )
    level = np.floor(distance / step + 0.25).astype(np.int64)  # layers of nodes lie amid, not at the borders
    same = level[a] == level[b]
    first = np.searchsorted(touched, sources)
    inside = np.concatenate([a[same], np.full(len(first), first[0])]), np.concatenate([b[same], first])
    _, part = connected_components(sp.coo_array((np.ones(len(inside[0])), inside), shape=graph.shape))
    section, parent = _joined(part, level, a[~same], b[~same], model.nodes[touched], _ONE_SECTION * reach)
    of_node = np.full(len(model.nodes), -1, dtype=np.int64)
    of_node[touched] = section
    return _with_masses(model, of_node, parent, _TOLD_BY_TURNING * step**2)


def _neighbours(model: FEModel) -> sp.csr_array:
    """(n, n) distances of nodes that share a stiffness [m]."""
    node = np.full(model.stiffness.shape[0], -1, dtype=np.int64)
    for rows in model.dof_map.T:
        node[rows[rows >= 0]] = np.flatnonzero(rows >= 0)
    coo = sp.coo_array(model.stiffness)
    there = coo.data != 0
    a, b = (node[c[there]] for c in coo.coords)
    pairs = np.unique(a[a != b] * len(model.nodes) + b[a != b])
    a, b = pairs // len(model.nodes), pairs % len(model.nodes)
    apart = np.linalg.norm(model.nodes[a] - model.nodes[b], axis=1)
    return sp.csr_array((apart, (a, b)), shape=(len(model.nodes),) * 2)


def _joined(
    part: IntArray, level: IntArray, a: IntArray, b: IntArray, places: Array, close: float
) -> tuple[IntArray, IntArray]:
    """Section of each node and parent of each section: parts that one farther out joins are one section."""
    count = part.max() + 1
    depth = np.zeros(count, dtype=np.int64)
    depth[part] = level
    own = np.arange(count)  # the part that stands for those joined with it

    def standing(p: int) -> int:
        while own[p] != p:
            p = int(own[p])
        return p

    pairs = np.unique(np.stack([part[a], part[b]], axis=1), axis=0)
    pairs = pairs[depth[pairs[:, 0]] > depth[pairs[:, 1]]]
    inner: dict[int, int] = {}
    for outer, near in pairs[np.argsort(-depth[pairs[:, 0]], kind="stable")].tolist():
        outer, near = standing(outer), standing(near)
        before = standing(inner.setdefault(outer, near))
        own[near] = before
    stands = np.array([standing(p) for p in range(count)])
    members = np.bincount(part)
    centres = np.stack([np.bincount(part, x) for x in places.T], axis=1) / members[:, None]
    if np.linalg.norm(centres - centres[stands], axis=1).max() > close:
        raise NoSections("cross sections far from each other join again: the link forms a ring")
    kept = np.unique(stands)
    kept = kept[np.argsort(depth[kept], kind="stable")]
    number = np.empty(count, dtype=np.int64)
    number[kept] = np.arange(len(kept))
    parent = np.full(len(kept), -1, dtype=np.int64)
    for outer, near in inner.items():
        parent[number[standing(outer)]] = number[standing(near)]
    return number[stands[part]], parent


def _with_masses(model: FEModel, of_node: IntArray, parent: IntArray, turning: float) -> CrossSections:
    """Masses of nodes: the diagonal of the mass, in parts that add up to all of it."""
    mass = model.mass if model.added_mass is None else (model.mass - model.added_mass).tocsc()
    nodes = np.flatnonzero(of_node >= 0)
    own, count = of_node[nodes], len(parent)
    weights = np.zeros(len(model.nodes))
    weights[nodes] = mass.diagonal()[model.dof_map[nodes, :3]].mean(axis=1)
    ones = np.zeros(mass.shape[0])
    ones[model.dof_map[:, 0]] = 1.0
    weights *= float(ones @ (mass @ ones)) / weights.sum()
    w = weights[nodes]
    masses: Array = np.bincount(own, w, minlength=count).astype(float)
    if not (masses > 0).all():
        raise NoSections("a cross section has no mass")
    sums = [np.bincount(own, w * x, minlength=count) for x in model.nodes[nodes].T]
    centres = np.stack(sums, axis=1) / masses[:, None]
    inertia = np.zeros((count, 3, 3))
    np.add.at(inertia, own, w[:, None, None] * _inertia(model.nodes[nodes] - centres[own]))
    for node in nodes[model.dof_map[nodes, 3] >= 0]:
        rows = model.dof_map[node, 3:]
        inertia[of_node[node]] += mass[rows][:, rows].toarray()
    return CrossSections(of_node, parent, weights, centres, masses, inertia, turning)


def _inertia(arms: Array) -> Array:
    """(n, 3, 3) of unit masses at ``arms`` (n, 3)."""
    square = np.einsum("ni,ni->n", arms, arms)[:, None, None] * np.eye(3)
    return np.asarray(square - arms[:, :, None] * arms[:, None, :])

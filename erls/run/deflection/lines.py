"""Links as lines that bend: stations with displacement and rotation, whatever a link is made of.

Of a link made of beams the stations are nodes of its mesh, along the members that lead outward from its inboard
interface. Another link, which may know no rotations, is taken as straight beams from there to its other interfaces,
which bend as cubics with the displacements and rotations of their ends (J. S. Przemieniecki, Theory of Matrix
Structural Analysis (1968), ch. 5). Second-order data of the link are not asked for.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from erls.maths.so3 import Array, skew
from erls.mechanism.links import Link, node_shape6
from fe_import.modal.model import ModalModel
from fe_import.model import IntArray

_STATIONS = 12  # of a link in one piece, about: integrals along it are then right to a per cent
_KINK = np.cos(np.radians(5.0))
_OF_CUBIC = 8  # stations of an assumed beam


@dataclass(frozen=True)
class Lines:
    """Stations of a link with m modal coordinates, the inboard interface first; each other one ends a segment.

    Attributes
    ----------
    places : (s, 3) array
        In the mesh frame [m].
    parents : (s - 1,) int array
        Station where the segment to each station but the first begins.
    segments : (s - 1, 3) array
        From there to the station [m].
    outward : (s, s - 1) array
        1 where a segment lies between the inboard interface and a station.
    shares : (s,) array
        Of the mass of the link, spread evenly along its lines.
    translation, rotation : (s, 3, m) arrays
        Displacement and rotation per modal coordinate.
    nodes : dict of int
        Station of each node that was asked for.
    beams : bool
        Whether the stations are nodes of beams.
    """

    places: Array
    parents: IntArray
    segments: Array
    outward: Array
    shares: Array
    translation: Array
    rotation: Array
    nodes: dict[int, int]
    beams: bool


def lines(link: Link, nodes: Collection[int]) -> Lines:
    """Lines of a flexible link.

    Parameters
    ----------
    link : Link
    nodes : collection of int
        Nodes of its mesh that shall be stations; of a link that is not made of beams each is the end of a line.
    """
    return _of_beams(link, nodes) or assumed(link, nodes)


def _of_beams(link: Link, nodes: Collection[int]) -> Lines | None:
    model, root = link.model, link.inboard.node
    if len(model.rotation_nodes) != len(model.nodes) or not len(model.lines):
        return None
    neighbours: list[list[int]] = [[] for _ in model.nodes]
    for a, b in model.lines.tolist():
        neighbours[a].append(b)
        neighbours[b].append(a)
    order, before = [root], {root: -1}
    for a in order:
        for b in neighbours[a]:
            if b not in before:
                before[b] = a
                order.append(b)
    if any(node not in before for node in nodes):
        return None
    every, asked = max(1, len(order) // _STATIONS), set(nodes)
    depth, station, stations, parents = {root: 0}, {root: 0}, [root], list[int]()
    shares = [0.0]
    for a in order[1:]:
        b = before[a]
        depth[a], length = depth[b] + 1, float(np.linalg.norm(model.nodes[a] - model.nodes[b])) / 2
        start = station[b]
        if a in asked or depth[a] % every == 0 or not _straight_on(model, a, neighbours[a]):
            station[a] = len(stations)
            stations.append(a)
            parents.append(start)
            shares.append(0.0)
        else:
            station[a] = start
        shares[start] += length
        shares[station[a]] += length
    places = np.array(stations)
    turning = np.searchsorted(model.rotation_nodes, places)
    return _connected(
        model.nodes[places],
        np.array(parents, dtype=np.int64),
        np.array(shares),
        (model.translation_shapes[places], model.rotation_shapes[turning]),
        {node: station[node] for node in asked | {root}},
        beams=True,
    )


def _straight_on(model: ModalModel, node: int, neighbours: list[int]) -> bool:
    """Whether a line goes through a node without branch or bend."""
    if len(neighbours) != 2:
        return False
    one, other = (model.nodes[k] - model.nodes[node] for k in neighbours)
    return bool(one @ other <= -_KINK * np.linalg.norm(one) * np.linalg.norm(other))


def assumed(link: Link, nodes: Collection[int]) -> Lines:
    """Cubics from the inboard interface to the nodes asked for, or to the farthest one."""
    model, root = link.model, link.inboard.node
    away = np.linalg.norm(model.nodes - link.inboard.position, axis=1)
    near = 1e-9 * max(float(away.max()), 1e-300)
    ends = [node for node in sorted(set(nodes)) if away[node] > near] or [int(away.argmax())]
    start, turn = node_shape6(model, root)
    places, parents, shares = [link.inboard.position], list[int](), [0.0]
    translation, rotation = [start], [turn]
    found = dict.fromkeys(nodes, 0)
    xi = np.arange(1, _OF_CUBIC + 1) / _OF_CUBIC
    for node in ends:
        along = model.nodes[node] - link.inboard.position
        moved, turned = _cubic(model, node, along, (start, turn), xi)
        parents += [0, *range(len(places), len(places) + _OF_CUBIC - 1)]
        places += list(link.inboard.position + xi[:, None] * along)
        translation += list(moved)
        rotation += list(turned)
        length = float(np.linalg.norm(along)) / _OF_CUBIC
        shares += [length] * (_OF_CUBIC - 1) + [length / 2]
        shares[0] += length / 2
        found[node] = len(places) - 1
    return _connected(
        np.array(places),
        np.array(parents, dtype=np.int64),
        np.array(shares),
        (np.array(translation), np.array(rotation)),
        {**found, root: 0},
        beams=False,
    )


def _cubic(model: ModalModel, node: int, along: Array, root: tuple[Array, Array], xi: Array) -> tuple[Array, Array]:
    """(8, 3, m) displacements and rotations along a straight beam ``along`` (3,) from the root to a node; without a
    rotation of its own the node carries no moment.
    """
    start, turn = root
    end, twist = node_shape6(model, node)
    across = -skew(along)  # slope times length of a rotation: θ × along
    first = across @ turn
    if node in model.rotation_nodes:
        last = across @ twist
    else:
        last, twist = 1.5 * (end - start) - 0.5 * first, turn
    x = xi[:, None, None]
    chord = end - start
    moved = start + x * first + x**2 * (3 * chord - 2 * first - last) + x**3 * (first + last - 2 * chord)
    slope = first + 2 * x * (3 * chord - 2 * first - last) + 3 * x**2 * (first + last - 2 * chord)
    squared = float(along @ along)
    axial = np.outer(along, along) / squared
    turned = np.einsum("ij,sjm->sim", skew(along) / squared, slope) + axial @ (turn + x * (twist - turn))
    return np.asarray(moved), np.asarray(turned)


def _connected(
    places: Array, parents: IntArray, shares: Array, shapes: tuple[Array, Array], nodes: dict[int, int], beams: bool
) -> Lines:
    outward = np.zeros((len(places), len(parents)))
    for segment, parent in enumerate(parents.tolist()):
        outward[segment + 1] = outward[parent]
        outward[segment + 1, segment] = 1.0
    return Lines(
        places,
        parents,
        places[1:] - places[parents],
        outward,
        shares / max(float(shares.sum()), 1e-300),
        np.ascontiguousarray(shapes[0]),
        np.ascontiguousarray(shapes[1]),
        nodes,
        beams,
    )

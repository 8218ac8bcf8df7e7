"""Links split into substructures: pieces of their own, rigidly joined, in a mechanism that formulations solve.

A link is one body for whoever asks a run, and a chain of pieces for the equations of motion. All pieces share the mesh
frame of their link, and a fixed joint holds each on the one before.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from erls.maths.se3 import pose
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, Point
from erls.mechanism.compound_joints import fixed_joint
from erls.mechanism.contacts import PointContact
from erls.mechanism.joints import Joint
from erls.mechanism.links import Link, payload_invariants
from erls.mechanism.loads import CENTRE, PointLoad
from erls.mechanism.loops import LoopEnd
from fe_import.model import IntArray


@dataclass(frozen=True)
class Split:
    """A mechanism of whole links, and the one of their pieces.

    Attributes
    ----------
    whole, pieces : Mechanism
    links : tuple of range
        Pieces of each link, by their number in ``pieces``; one for a link that is not split.
    places : tuple of (n, 2) int arrays
        Piece, by that number, and node of it, for each node of each link.
    """

    whole: Mechanism
    pieces: Mechanism
    links: tuple[range, ...]
    places: tuple[IntArray, ...]

    @property
    def joints(self) -> list[int]:
        """Number in ``pieces`` of each joint of the whole links: it carries their first piece."""
        return [own.start for own in self.links]

    def expanded(self, values: Array) -> Array:
        """(joints of the pieces,) values of the whole links' joints, and 0 for welds."""
        result = np.zeros(len(self.pieces.joints))
        result[self.joints] = values
        return result


def is_split(mechanism: Mechanism) -> bool:
    """Whether any link is split."""
    return any(link.pieces for link in mechanism.links)


def split(mechanism: Mechanism) -> Split:
    """The mechanism of pieces; payloads, points, loads, contacts and loops sit on the piece that carries their node."""
    ends = np.cumsum([0, *(max(1, len(link.pieces)) for link in mechanism.links)]).tolist()
    ranges = tuple(range(a, b) for a, b in itertools.pairwise(ends))
    places = tuple(_places(link, own) for link, own in zip(mechanism.links, ranges, strict=True))
    joints: list[Joint] = []
    links: list[Link] = []
    for joint, link, where in zip(mechanism.joints, mechanism.links, places, strict=True):
        first = len(links)
        joints.append(replace(joint, **_seat(mechanism, joint, ranges, places)))
        if not link.pieces:
            links.append(link)
            continue
        joints += [_weld(link, k, first + k - 1) for k in range(1, len(link.pieces))]
        links += [_loaded(piece, link, where, first + k) for k, piece in enumerate(link.pieces)]

    def moved(end: LoopEnd) -> LoopEnd:
        if end.link is None:
            return end
        piece, node = places[end.link][end.node].tolist()
        return replace(end, link=piece, node=node)

    pieces = replace(
        mechanism,
        joints=tuple(joints),
        links=tuple(links),
        points=tuple(Point(p.name, *places[p.link][p.node].tolist()) for p in mechanism.points),
        loops=tuple(replace(loop, inner=moved(loop.inner), outer=moved(loop.outer)) for loop in mechanism.loops),
        contacts=tuple(_moved_contact(contact, places) for contact in mechanism.contacts),
        loads=tuple(moved for load in mechanism.loads for moved in _moved_loads(load, ranges, places)),
    )
    return Split(mechanism, pieces, ranges, places)


def _places(link: Link, own: range) -> IntArray:
    """(n, 2) piece and node of each node of a link; that of two pieces belongs to the inner one."""
    if not link.pieces:
        nodes = np.arange(len(link.model.nodes))
        return np.column_stack([np.full(len(nodes), own.start), nodes])
    names = {number: name for name, number in link.model.node_names.items()}
    known = [piece.model.node_names for piece in link.pieces]
    result = np.empty((len(link.model.nodes), 2), dtype=np.int64)
    for number in range(len(result)):
        place = next(k for k, nodes_of in enumerate(known) if names[number] in nodes_of)
        result[number] = own[place], known[place][names[number]]
    return result


def _seat(mechanism: Mechanism, joint: Joint, ranges: Sequence[range], places: Sequence[IntArray]) -> dict[str, Any]:
    """Piece and interface on which a joint stands."""
    if joint.seat is None:
        return {}
    whole = mechanism.links[joint.parent]
    if not whole.pieces:
        return {"parent": ranges[joint.parent].start}
    piece = int(places[joint.parent][joint.seat.node, 0])
    return {"parent": piece, "seat": whole.pieces[piece - ranges[joint.parent].start].model.interface(joint.seat.name)}


def _moved_loads(load: PointLoad, ranges: Sequence[range], places: Sequence[IntArray]) -> list[PointLoad]:
    """A load on the piece that carries its node, or on the mass of all pieces, with the axes of the node of a piece."""
    at = [(piece, CENTRE) for piece in ranges[load.link]]
    if load.node != CENTRE:
        at = [tuple(places[load.link][load.node].tolist())]
    axes = load.axes
    if axes is not None:
        of_piece, of_node = places[axes[0]][axes[1]].tolist()
        axes = of_piece, of_node
    return [replace(load, link=piece, node=node, axes=axes) for piece, node in at]


def _moved_contact(contact: PointContact, places: Sequence[IntArray]) -> PointContact:
    """A contact of the pieces that carry its node and its plane."""

    def moved(link: int, node: int) -> tuple[int, int]:
        piece, own = places[link][node].tolist()
        return piece, own

    link, node = moved(contact.link, contact.node)
    return replace(contact, link=link, node=node, base=None if contact.base is None else moved(*contact.base))


def _weld(link: Link, number: int, parent: int) -> Joint:
    """Joint that holds piece ``number`` on the one before."""
    position = link.pieces[number].inboard.position
    seat = link.pieces[number - 1].model.interface_nodes[1]
    return fixed_joint(f"{link.name}: weld {number}", pose(position=position), pose(position=-position), parent, seat)


def _loaded(piece: Link, whole: Link, places: IntArray, number: int) -> Link:
    """A piece with those payloads of the whole link that sit on it."""
    payloads = tuple(replace(p, node=int(places[p.node, 1])) for p in whole.payloads if places[p.node, 0] == number)
    invariants = piece.invariants
    for p in payloads:
        invariants = invariants + payload_invariants(piece.model, p.node, p.offset, p.mass, p.inertia)
    return replace(piece, invariants=invariants, payloads=payloads)

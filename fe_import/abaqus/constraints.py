"""Equations, multi-point constraints, rigid bodies, couplings and ties of a deck, as attachments of its solids."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fe_import.abaqus.deck import Deck, Statement
from fe_import.abaqus.elements import solid_type
from fe_import.abaqus.sets import surface_faces, surface_nodes
from fe_import.abaqus.statements import Unused, component_of, not_turned, numbers, only, option
from fe_import.abaqus.transforms import along_axes, node_axes
from fe_import.elements.attachments import Attachment, AverageNode, LinearEquation, RigidBody, TiedNodes
from fe_import.model import IntArray

_DISPLACEMENTS = (0, 1, 2)
_ALL = (0, 1, 2, 3, 4, 5)


def equation(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    """*EQUATION: nodes, not sets, in their axes of *TRANSFORM."""
    only(statement)
    not_turned(deck, statement)
    axes = node_axes(deck)
    fields = [f for row in statement.rows for f in row]
    while fields:
        count, fields = int(fields[0]), fields[1:]
        if not 1 <= count <= len(fields) // 3:
            raise Unused("an equation has another number of terms than it says")
        terms: list[tuple[int, int, float]] = []
        for k in range(count):
            node, component, coefficient = fields[3 * k : 3 * k + 3]
            if not node.isdigit():
                raise Unused(f"a set of nodes ({node}) in an equation is not followed")
            terms += along_axes(int(node), component_of(component), numbers([coefficient])[0], axes)
        yield LinearEquation("EQUATION", tuple(terms))
        fields = fields[3 * count :]


def multi_point(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    """*MPC of the types BEAM, TIE, PIN and LINK, between pairs of nodes or of sets of equal size."""
    only(statement)
    for row in statement.rows:
        kind = row[0].upper()
        if kind not in ("BEAM", "TIE", "PIN", "LINK"):
            raise Unused(f"a constraint {kind} is not followed")
        if len([f for f in row if f]) != 3:
            raise Unused(f"a constraint {kind} needs two nodes, or two sets")
        followers, leaders = (_labels(deck, text) for text in row[1:3])
        if len(leaders) == 1:
            leaders = leaders * len(followers)
        if len(leaders) != len(followers):
            raise Unused("sets of different size")
        for follower, leader in zip(followers, leaders, strict=True):
            yield from _pair(deck, kind, follower, leader)


def _labels(deck: Deck, text: str) -> list[int]:
    return [int(text)] if text.isdigit() else sorted(deck.node_sets.members(text))


def _pair(deck: Deck, kind: str, follower: int, leader: int) -> Iterator[Attachment]:
    if follower == leader:
        raise Unused("a node follows itself")
    if kind == "BEAM":
        yield RigidBody("MPC", leader, np.array([follower], dtype=np.int64))
    elif kind == "LINK":
        if follower not in deck.points or leader not in deck.points:
            raise Unused("it names a node that is not there")
        along = np.subtract(deck.points[follower], deck.points[leader])
        if not along.any():
            raise Unused("a link without length")
        along = along / np.abs(along).max()
        ends = (follower, 1.0), (leader, -1.0)
        terms = [(n, c, s * float(along[c])) for n, s in ends for c in _DISPLACEMENTS if along[c]]
        yield LinearEquation("MPC", tuple(terms))
    else:
        turning = kind == "TIE" and {follower, leader} <= _turning(deck)
        for component in _ALL if turning else _DISPLACEMENTS:
            yield LinearEquation("MPC", ((follower, component, 1.0), (leader, component, -1.0)))


def _turning(deck: Deck) -> set[int]:
    """Labels of nodes that have rotations: of beams, of rotary inertia, references."""
    kinds = [cells for kind, cells in deck.elements.items() if kind.startswith(("B3", "ROTARYI"))]
    found = {node for cells in kinds for nodes in cells.values() for node in nodes}
    return found | {_reference(deck, s) for s in deck.statements if s.name in ("RIGID BODY", "COUPLING")}


def rigid_body(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    """*RIGID BODY: its nodes follow with displacements and rotations, those of PIN NSET with displacements."""
    only(statement, "NSET", "TIENSET", "PINNSET", "ELSET", "REFNODE", "ROTNODE")
    turning = statement.options.get("ROTNODE", "")
    if turning and (deck.keywords["EQUATION"] or deck.keywords["MPC"]):
        raise Unused("a rotational node beside equations is not followed")
    nodes: set[int] = set()
    for name in ("NSET", "TIENSET"):
        if name in statement.options:
            nodes |= deck.node_sets.members(option(statement, name))
    if "ELSET" in statement.options:
        nodes |= deck.nodes_of(option(statement, "ELSET"))
    reference = _reference(deck, statement)
    if nodes:
        yield _body("RIGID BODY", reference, nodes)
    if "PINNSET" in statement.options:
        pinned = deck.node_sets.members(option(statement, "PINNSET")) - nodes
        yield _body("RIGID BODY", reference, pinned, _DISPLACEMENTS)


def coupling(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    """*COUPLING with *KINEMATIC that holds all displacements, or with *DISTRIBUTING of displacements and rotations."""
    only(statement, "CONSTRAINTNAME", "REFNODE", "SURFACE")
    kind = statement.following
    if kind is None:
        raise Unused("it lacks *KINEMATIC or *DISTRIBUTING")
    held: set[int] = set()
    for row in kind.rows or [["1", "6"]]:
        first, last = int(row[0]), int(row[1] if len(row) > 1 and row[1] else row[0])
        held |= {component for component in _ALL if first <= component + 1 <= last}
    by_nodes, rows = _surface(deck, option(statement, "SURFACE"))
    nodes = surface_nodes(rows, deck.element_sets, deck.connectivity, deck.node_sets, by_nodes)
    reference = _reference(deck, statement)
    if kind.name == "KINEMATIC":
        only(kind)
        if not held.issuperset(_DISPLACEMENTS):
            raise Unused("couplings are used that hold all displacements")
        if len(held) in (4, 5):
            not_turned(deck, statement)
        yield _body("COUPLING", reference, nodes, tuple(sorted(held)))
        return
    only(kind, "WEIGHTINGMETHOD", "COUPLING")
    if kind.options.get("WEIGHTINGMETHOD", "UNIFORM").upper() != "UNIFORM":
        raise Unused("weights of *DISTRIBUTING that fall with the distance are not followed")
    if kind.options.get("COUPLING", "CONTINUUM").upper() != "CONTINUUM" or held != set(_ALL):
        raise Unused("*DISTRIBUTING is used for displacements and rotations of a continuum")
    if by_nodes and any(f not in ("", "1", "1.", "1.0") for row in rows for f in row[1:]):
        raise Unused("weights on the surface's nodes are not followed")
    members = np.array(sorted(nodes - {reference}), dtype=np.int64)
    if len(members) < 3:
        raise Unused("a *DISTRIBUTING over fewer than three nodes")
    yield AverageNode("COUPLING", reference, members, np.ones(len(members)) if by_nodes else None)


def of_a_coupling(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    """*KINEMATIC and *DISTRIBUTING are read with their *COUPLING."""
    if not statement.follows:
        raise Unused("it belongs to no *COUPLING")
    return iter(())


def tie(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    """*TIE: the nodes of the first surface of each line go with the faces of the second."""
    only(statement, "NAME", "POSITIONTOLERANCE", "ADJUST", "TYPE", "NOROTATION")
    given = statement.options.get("POSITIONTOLERANCE", "")
    tolerance = numbers([given])[0] if given else 0.0
    if given and tolerance <= 0:
        raise Unused("a tolerance must be positive")
    for row in statement.rows:
        if len(row) != 2 or not all(row):
            raise Unused("a line needs two surfaces")
        by_nodes, rows = _surface(deck, row[0])
        nodes = surface_nodes(rows, deck.element_sets, deck.connectivity, deck.node_sets, by_nodes)
        by_nodes, rows = _surface(deck, row[1])
        if by_nodes:
            raise Unused("a second surface that is made of nodes")
        found: dict[int, list[list[int]]] = {3: [], 4: []}
        for kind, face in surface_faces(rows, deck.element_sets, deck.connectivity):
            if solid_type(kind) is None:
                raise Unused("a second surface of other elements than solids")
            corners = 3 if len(face) in (3, 6) else 4
            found[corners].append(face[:corners])
        triangles, squares = (np.array(found[k], dtype=np.int64).reshape(-1, k) for k in (3, 4))
        yield TiedNodes("TIE", _sorted(nodes), triangles, squares, tolerance)


def _surface(deck: Deck, name: str) -> tuple[bool, list[list[str]]]:
    found = {key.upper(): value for key, value in deck.surfaces.items()}
    if name.upper() not in found:
        raise Unused(f"surface {name.upper()} is not there")
    return found[name.upper()]


def _reference(deck: Deck, statement: Statement) -> int:
    text = option(statement, "REFNODE")
    if text.isdigit():
        return int(text)
    (label,) = deck.node_sets.members(text)
    return label


def _sorted(nodes: set[int]) -> IntArray:
    return np.array(sorted(nodes), dtype=np.int64)


def _body(keyword: str, reference: int, nodes: set[int], components: tuple[int, ...] = _ALL) -> RigidBody:
    return RigidBody(keyword, reference, _sorted(nodes - {reference}), components)

"""Point masses, springs, beams, rigid bodies, couplings and equations of a deck, as attachments of its solids.

What is not understood whole is not used: its reason stands in `Unused`, and the mesh reader refuses it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from fe_import.abaqus.beams import beam_section
from fe_import.abaqus.parse import Deck, Statement
from fe_import.abaqus.sets import LostSet, surface_nodes
from fe_import.abaqus.statements import Unused, component_of, elements_of, numbers, only, option
from fe_import.elements.attachments import (
    AttachedMass,
    AttachedSpring,
    Attachment,
    LinearEquation,
    RigidBody,
    nodes_of,
)
from fe_import.model import Array


@dataclass
class Attached:
    """What was understood: attachments by labels of nodes, keywords and types of elements whole, and why not others."""

    items: list[Attachment] = field(default_factory=list)
    whole: set[str] = field(default_factory=set)
    reasons: dict[str, str] = field(default_factory=dict)


def attachments(deck: Deck) -> Attached:
    """Interpret the statements of a deck; sets may stand behind them."""
    result = Attached()
    served: set[int] = set()
    statements = [statement for statement in deck.statements if statement.name in _READERS]
    for statement in statements:
        try:
            for item in _READERS[statement.name](deck, statement, served):
                if any(node not in deck.points for node in nodes_of(item)):
                    raise Unused("it names a node that is not there")
                result.items.append(item)
        except (Unused, LostSet, ValueError, IndexError) as reason:
            result.reasons.setdefault(statement.name, str(reason) or "not understood")
    for name in {statement.name for statement in statements} - result.reasons.keys():
        result.whole.add(name)
    for kind, cells in deck.elements.items():
        if kind.startswith("B3") and served.issuperset(cells):
            result.whole.add(kind)
        if kind.startswith(("MASS", "ROTARYI", "SPRING")):
            if served.issuperset(cells):
                result.whole.add(kind)
            else:
                result.reasons.setdefault(kind, "elements without a value of their own")
    return result


def _mass(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    only(statement, "ELSET")
    (row,) = statement.rows
    (value,) = numbers(row)
    if value < 0:
        raise Unused("a mass is negative")
    for kind, label in elements_of(deck, statement, "MASS", served):
        nodes = deck.elements[kind][label]
        yield AttachedMass("MASS", nodes[0], value, np.zeros((3, 3)), np.zeros(3))


def _rotary_inertia(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    only(statement, "ELSET")
    (row,) = statement.rows
    xx, yy, zz, xy, xz, yz = (*numbers(row), 0.0, 0.0, 0.0, 0.0)[:6]
    inertia: Array = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if np.linalg.eigvalsh(inertia)[0] < -1e-9 * np.abs(inertia).max():
        raise Unused("an inertia is negative")
    for kind, label in elements_of(deck, statement, "ROTARYI", served):
        nodes = deck.elements[kind][label]
        yield AttachedMass("ROTARY INERTIA", nodes[0], 0.0, inertia, np.zeros(3))


def _spring(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    only(statement, "ELSET")
    rows = [row for row in statement.rows if any(row)]
    if not rows:
        raise Unused("it lacks a stiffness")
    (stiffness,) = numbers(rows[-1])
    for kind, label in elements_of(deck, statement, "SPRING", served):
        nodes = deck.elements[kind][label]
        if kind == "SPRING1":
            raise Unused("a spring to the ground; a link is free")
        if len(rows) != (1 if kind == "SPRINGA" else 2) or stiffness < 0:
            raise Unused("one stiffness, not negative, is used")
        if kind == "SPRINGA":
            along = np.subtract(deck.points[nodes[1]], deck.points[nodes[0]])
            if not along.any():
                raise Unused("a spring without length")
            along /= np.linalg.norm(along)
            terms = [(node, c, sign * along[c]) for node, sign in zip(nodes, (-1, 1), strict=True) for c in range(3)]
        else:
            first, second = (component_of(f) for f in rows[0])
            terms = [(nodes[0], first, -1.0), (nodes[1], second, 1.0)]
        yield AttachedSpring("SPRING", stiffness, tuple(terms))


def _equation(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    only(statement)
    if deck.keywords["TRANSFORM"]:
        raise Unused("with *TRANSFORM the directions are not known here")
    fields = [f for row in statement.rows for f in row]
    while fields:
        count, fields = int(fields[0]), fields[1:]
        if not 1 <= count <= len(fields) // 3:
            raise Unused("an equation has another number of terms than it says")
        terms = []
        for k in range(count):
            node, component, coefficient = fields[3 * k : 3 * k + 3]
            if not node.isdigit():
                raise Unused(f"a set of nodes ({node}) in an equation is not followed")
            terms.append((int(node), component_of(component), numbers([coefficient])[0]))
        yield LinearEquation("EQUATION", tuple(terms))
        fields = fields[3 * count :]


def _rigid_body(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    only(statement, "NSET", "TIENSET", "ELSET", "REFNODE", "ROTNODE")
    turning = statement.options.get("ROTNODE", "")
    if turning and (deck.keywords["EQUATION"] or deck.keywords["MPC"]):
        raise Unused("a rotational node beside equations is not followed")
    nodes: set[int] = set()
    for name in ("NSET", "TIENSET"):
        if name in statement.options:
            nodes |= deck.node_sets.members(option(statement, name))
    if "ELSET" in statement.options:
        nodes |= deck.nodes_of(option(statement, "ELSET"))
    yield _body("RIGID BODY", _reference(deck, statement), nodes)


def _coupling(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    only(statement, "CONSTRAINTNAME", "REFNODE", "SURFACE")
    kind = statement.following
    if kind is None or kind.name != "KINEMATIC":
        raise Unused("couplings are used that are *KINEMATIC")
    only(kind)
    held: set[int] = set()
    for row in kind.rows or [["1", "6"]]:
        first, last = int(row[0]), int(row[1] if len(row) > 1 and row[1] else row[0])
        held |= {component for component in range(1, 7) if first <= component <= last}
    if not {1, 2, 3} <= held:
        raise Unused("couplings are used that hold all displacements")
    surface = option(statement, "SURFACE").upper()
    found = {name.upper(): rows for name, rows in deck.surfaces.items()}
    if surface not in found:
        raise Unused(f"surface {surface} is not there")
    by_nodes, rows = found[surface]
    connectivity = {e: (k, n) for k, cells in deck.elements.items() for e, n in cells.items()}
    nodes = surface_nodes(rows, deck.element_sets, connectivity, deck.node_sets, by_nodes)
    yield _body("COUPLING", _reference(deck, statement), nodes)


def _reference(deck: Deck, statement: Statement) -> int:
    text = option(statement, "REFNODE")
    if text.isdigit():
        return int(text)
    (label,) = deck.node_sets.members(text)
    return label


def _kinematic(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    if not statement.follows:
        raise Unused("it belongs to no *COUPLING")
    return iter(())


def _distributing(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    raise Unused("weights of *DISTRIBUTING are not followed")


def _body(keyword: str, reference: int, nodes: set[int]) -> RigidBody:
    return RigidBody(keyword, reference, np.array(sorted(nodes - {reference}), dtype=np.int64))


_READERS: dict[str, Callable[[Deck, Statement, set[int]], Iterator[Attachment]]] = {
    "MASS": _mass,
    "ROTARY INERTIA": _rotary_inertia,
    "SPRING": _spring,
    "BEAM SECTION": beam_section,
    "BEAM GENERAL SECTION": beam_section,
    "EQUATION": _equation,
    "RIGID BODY": _rigid_body,
    "COUPLING": _coupling,
    "KINEMATIC": _kinematic,
    "DISTRIBUTING": _distributing,
}

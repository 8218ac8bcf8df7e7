"""Point masses, springs, beams and constraints of a deck, as attachments of its solids.

What is not understood whole is not used: its reason stands in `Unused`, and the mesh reader refuses it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from fe_import.abaqus.beams import beam_section
from fe_import.abaqus.constraints import coupling, equation, multi_point, of_a_coupling, rigid_body, tie
from fe_import.abaqus.deck import Deck, Statement
from fe_import.abaqus.materials import filling
from fe_import.abaqus.sets import LostSet
from fe_import.abaqus.statements import Unused, component_of, elements_of, not_turned, numbers, only
from fe_import.abaqus.transforms import along_axes, node_axes
from fe_import.elements.attachments import (
    AttachedMass,
    AttachedSpring,
    Attachment,
    nodes_of,
)
from fe_import.elements.solid_mesh import FILLING, Filling
from fe_import.model import Array


@dataclass
class Attached:
    """What was understood: attachments by labels of nodes, keywords and types of elements whole, and why not others."""

    items: list[Attachment] = field(default_factory=list)
    fillings: list[Filling] = field(default_factory=list)
    whole: set[str] = field(default_factory=set)
    reasons: dict[str, str] = field(default_factory=dict)


def attachments(deck: Deck) -> Attached:
    """Interpret the statements of a deck; sets may stand behind them."""
    result = Attached()
    served: set[int] = set()
    statements = [s for s in deck.statements if s.name in _READERS or s.name == FILLING]
    for statement in statements:
        try:
            if statement.name == FILLING:
                result.fillings.append(filling(deck, statement))
                continue
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
    not_turned(deck, statement)
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
            not_turned(deck, statement)
            axes, components = node_axes(deck), [component_of(f) for f in rows[0]]
            ends = zip(nodes, components, (-1.0, 1.0), strict=True)
            terms = [term for node, c, sign in ends for term in along_axes(node, c, sign, axes)]
        yield AttachedSpring("SPRING", ((stiffness, tuple(terms)),))


_READERS: dict[str, Callable[[Deck, Statement, set[int]], Iterator[Attachment]]] = {
    "MASS": _mass,
    "ROTARY INERTIA": _rotary_inertia,
    "SPRING": _spring,
    "BEAM SECTION": beam_section,
    "BEAM GENERAL SECTION": beam_section,
    "EQUATION": equation,
    "MPC": multi_point,
    "RIGID BODY": rigid_body,
    "COUPLING": coupling,
    "KINEMATIC": of_a_coupling,
    "DISTRIBUTING": of_a_coupling,
    "TIE": tie,
}

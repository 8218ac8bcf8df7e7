"""What the interpreters of a deck's statements share: parameters, numbers, the elements of a set."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fe_import.abaqus.deck import Deck, Statement


class Unused(Exception):
    """Why a statement is not used."""


def elements_of(deck: Deck, statement: Statement, kind: str, served: set[int]) -> Iterator[tuple[str, int]]:
    """Type and label of the elements of the statement's set, all of types that begin with ``kind``; now served."""
    for label in sorted(deck.element_sets.members(option(statement, "ELSET"))):
        own = deck.kinds.get(label, "")
        if not own.startswith(kind):
            raise Unused(f"element {label} of its set is of another type")
        served.add(label)
        yield own, label


def option(statement: Statement, name: str) -> str:
    """A parameter that must be there."""
    value = statement.options.get(name, "")
    if not value:
        raise Unused(f"it lacks {name}")
    return value


def only(statement: Statement, *names: str) -> None:
    """Refuse parameters with other names than these."""
    further = [name for name in statement.options if name not in names]
    if further:
        raise Unused(f"parameter {further[0]} is not followed")


def not_turned(deck: Deck, statement: Statement) -> None:
    """Refuse what names directions in an instance that is turned."""
    if deck.placement(statement).turned:
        raise Unused("it names directions in an instance that is turned")


def numbers(fields: list[str]) -> list[float]:
    """Finite numbers; empty fields are 0."""
    values = [float(f.upper().replace("D", "E")) if f else 0.0 for f in fields]
    if not np.isfinite(values).all():
        raise Unused("a number is not finite")
    return values


def component_of(text: str) -> int:
    """A degree of freedom from 1 to 6, counted from 0."""
    number = int(text)
    if not 1 <= number <= 6:
        raise Unused(f"degree of freedom {number} is not followed")
    return number - 1

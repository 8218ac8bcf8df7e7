"""What cards of bulk data refer to: grid points, coordinate systems, properties, materials."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_import.model import Array
from fe_import.nastran.cards import Card
from fe_import.nastran.grid import GridPoints

_PROPERTY = re.compile(r"P(BAR|BEAM|ELAS|BUSH|SOLID|SHEL)L?\Z")
_MATERIAL = re.compile(r"MAT\d+\Z")
_MOST_DIGITS = 9


class Unused(Exception):
    """Why a card is not used."""


@dataclass
class Bulk:
    """Cards by what refers to them.

    Attributes
    ----------
    cards : list of Card
    points : GridPoints
    selected : set of int or None
        Sets of constraints that the case control selects; None where there is no case control.
    """

    cards: list[Card]
    points: GridPoints
    selected: set[int] | None = None

    @cached_property
    def properties(self) -> dict[int, list[Card]]:
        """By number; different kinds of elements may have properties of one number."""
        found: dict[int, list[Card]] = {}
        for card in self.cards:
            if _PROPERTY.match(card.name):
                for at in (1, 5) if card.name == "PELAS" and card.field(5) else (1,):  # two on a card
                    found.setdefault(card.integer(at), []).append(card)
        return found

    @cached_property
    def materials(self) -> dict[int, Card]:
        """By number."""
        return {card.integer(1): card for card in self.cards if _MATERIAL.match(card.name)}

    @cached_property
    def names(self) -> set[str]:
        """Of all cards."""
        return {card.name for card in self.cards}

    def property(self, number: int, names: Iterable[str]) -> Card:
        """The property of that number and of one of these names."""
        found = [card for card in self.properties.get(number, []) if card.name in names]
        if len(found) != 1:
            raise Unused(f"property {number} is " + ("not there" if not found else "there twice"))
        return found[0]

    def position(self, number: int, card: Card) -> Array:
        """Of a grid point."""
        if number not in self.points.positions:
            raise card.fault("it needs a grid point that is not there", number)
        return self.points.positions[number]

    def axes(self, number: int, card: Card) -> Array:
        """(3, 3) axes (columns) of the displacements of a grid point."""
        self.position(number, card)
        return self.points.axes.get(number, np.eye(3))


def digits(text: str, card: Card) -> tuple[int, ...]:
    """Components 1 ... 6 in a field, counted from 0, rising."""
    if not text.isdigit() or not set(text) <= set("123456") or len(text) > _MOST_DIGITS:
        raise card.fault("expected components from 1 to 6", text)
    return tuple(sorted({int(c) - 1 for c in text}))

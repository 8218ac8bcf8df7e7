"""Materials of a deck: isotropic ones with their density, and the element sets of its solid sections."""

from __future__ import annotations

from dataclasses import dataclass, field

from fe_import.abaqus.parse import Deck, Statement
from fe_import.abaqus.statements import Unused, numbers

USED = ("MATERIAL", "ELASTIC", "DENSITY", "SOLID SECTION")


@dataclass
class DeckMaterials:
    """What was understood.

    Attributes
    ----------
    constants : dict
        Name in capitals -> Young's modulus, Poisson's ratio, density, in the deck's units.
    sections : list of pairs
        Element set and material, in capitals.
    lack : str
        Why they cannot be used; empty when they can.
    """

    constants: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    sections: list[tuple[str, str]] = field(default_factory=list)
    lack: str = ""


def deck_materials(deck: Deck) -> DeckMaterials:
    """Materials of all solid sections."""
    result = DeckMaterials()
    try:
        for options in deck.solid_sections:
            material = options.get("MATERIAL", "").upper()
            if options.get("ORIENTATION") or options.get("COMPOSITE"):
                raise Unused("a section has an orientation or layers")
            result.constants[material] = isotropic(deck, material)
            result.sections.append((options["ELSET"].upper(), material))
    except (Unused, ValueError) as reason:
        result.lack = str(reason)
    if not deck.solid_sections:
        result.lack = "it has no *SOLID SECTION"
    return result


def isotropic(deck: Deck, name: str) -> tuple[float, float, float]:
    """Young's modulus, Poisson's ratio and density of a material (capitals).

    Raises
    ------
    Unused
        It lacks them, or is of another kind.
    """
    given = _statements(deck, name)
    elastic, density = (_constants(given[k]) if k in given else [] for k in ("ELASTIC", "DENSITY"))
    if len(elastic) < 2 or not density:
        raise Unused(f"material {name!r} lacks *ELASTIC or *DENSITY")
    return elastic[0], elastic[1], density[0]


def _statements(deck: Deck, material: str) -> dict[str, Statement]:
    """What stands behind the *MATERIAL of that name, by keyword."""
    found: dict[str, Statement] = {}
    name = None
    for statement in deck.statements:
        if statement.name == "MATERIAL":
            name = statement.options.get("NAME", "").upper()
        elif statement.name in ("ELASTIC", "DENSITY") and name == material:
            found[statement.name] = statement
    return found


def _constants(statement: Statement) -> list[float]:
    kind = statement.options.get("TYPE", "ISO").upper()
    if kind not in ("ISO", "ISOTROPIC"):
        raise Unused(f"a material is elastic of type {kind}, which is not followed")
    if len(statement.rows) != 1:
        raise Unused("a material changes with temperature")
    return numbers(statement.rows[0])

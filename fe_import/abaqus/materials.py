"""Materials of a deck: isotropic ones with their density, and the element sets of its solid sections."""

from __future__ import annotations

from dataclasses import dataclass, field

from fe_import.abaqus.parse import Deck

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
    result, found, name = DeckMaterials(), dict[str, dict[str, list[float]]](), ""
    try:
        for statement in deck.statements:
            if statement.name == "MATERIAL":
                name = statement.options.get("NAME", "").upper()
                found[name] = {}
            elif statement.name in ("ELASTIC", "DENSITY") and name:
                found[name][statement.name] = _constants(statement.options, statement.rows)
        for options in deck.solid_sections:
            material = options.get("MATERIAL", "").upper()
            if options.get("ORIENTATION") or options.get("COMPOSITE"):
                raise _Lack("a section has an orientation or layers")
            elastic, density = (found.get(material, {}).get(key, []) for key in ("ELASTIC", "DENSITY"))
            if len(elastic) < 2 or not density:
                raise _Lack(f"material {material!r} lacks *ELASTIC or *DENSITY")
            result.constants[material] = (elastic[0], elastic[1], density[0])
            result.sections.append((options["ELSET"].upper(), material))
    except (_Lack, ValueError) as reason:
        result.lack = str(reason)
    if not deck.solid_sections:
        result.lack = "it has no *SOLID SECTION"
    return result


class _Lack(Exception):
    """Why materials cannot be used."""


def _constants(options: dict[str, str], rows: list[list[str]]) -> list[float]:
    kind = options.get("TYPE", "ISO").upper()
    if kind not in ("ISO", "ISOTROPIC"):
        raise _Lack(f"a material is elastic of type {kind}, which is not followed")
    if len(rows) != 1:
        raise _Lack("a material changes with temperature")
    return [float(text.upper().replace("D", "E")) for text in rows[0] if text]

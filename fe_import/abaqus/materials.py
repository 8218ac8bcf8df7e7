"""Materials of a deck with their density, and the element sets of its solid sections."""

from __future__ import annotations

import numpy as np

from fe_import.abaqus.deck import Deck, Statement
from fe_import.abaqus.elements import solid_type
from fe_import.abaqus.orientations import orientation
from fe_import.abaqus.statements import Unused, numbers, only, option
from fe_import.elements.elasticity import checked_moduli, largest_youngs_modulus, orthotropic_moduli
from fe_import.elements.solid_mesh import Filling, MeshMaterial, MeshMaterials, MeshSection, ShellSection
from fe_import.model import Array

USED = ("MATERIAL", "ELASTIC", "DENSITY", "SOLID SECTION", "ORIENTATION")
SHELL_SECTION = "SHELL SECTION"
_ORDER = [0, 1, 2, 3, 5, 4]  # of decks: 11, 22, 33, 12, 13, 23
_KINDS = {  # type of *ELASTIC -> numbers that it has
    **dict.fromkeys(("ISO", "ISOTROPIC"), 2),
    **dict.fromkeys(("ENGINEERINGCONSTANTS", "ORTHO", "ORTHOTROPIC"), 9),
    **dict.fromkeys(("ANISO", "ANISOTROPIC"), 21),
}


def deck_materials(deck: Deck) -> MeshMaterials:
    """Materials of all solid sections; element sets as the deck first writes them."""
    constants: dict[str, MeshMaterial] = {}
    sections: list[MeshSection] = []
    orientations = {}
    lack = "" if deck.solid_sections else "it has no *SOLID SECTION"
    try:
        for options in deck.solid_sections:
            name, axes = options.get("MATERIAL", "").upper(), options.get("ORIENTATION", "").upper()
            if "COMPOSITE" in options:
                raise Unused("a section has layers")
            constants[name] = material(deck, name)
            if constants[name].moduli is None:
                axes = ""  # the same in all directions
            elif axes:
                orientations[axes] = orientation(deck, axes)
            key = options["ELSET"].upper()
            sections.append(MeshSection(deck.element_sets.names.get(key, key), name, axes))
    except (Unused, ValueError) as reason:
        lack = str(reason)
    shells, shell_lack = _shell_sections(deck, constants)
    return MeshMaterials(constants, tuple(sections), orientations, lack, USED, shells=shells, shell_lack=shell_lack)


def _shell_sections(deck: Deck, constants: dict[str, MeshMaterial]) -> tuple[tuple[ShellSection, ...], str]:
    """All of them with their materials, or why they are not used."""
    found = []
    statements = [s for s in deck.statements if s.name == SHELL_SECTION]
    if not statements:
        return (), f"it has no *{SHELL_SECTION}"
    try:
        for statement in statements:
            only(statement, "ELSET", "MATERIAL", "OFFSET", "ORIENTATION", "SECTION INTEGRATION", "POISSON")
            name = option(statement, "MATERIAL").upper()
            constants[name] = isotropic(deck, name)
            thickness = numbers(statement.rows[0])[0] if statement.rows else 0.0
            if not thickness > 0:
                raise Unused("a section of shells lacks its thickness")
            text = statement.options.get("OFFSET", "0").upper()
            share = {"SPOS": 0.5, "SNEG": -0.5}.get(text) if text.isalpha() else numbers([text])[0]
            if share is None:
                raise Unused(f"an offset {text} of shells is not followed")
            key = option(statement, "ELSET").upper()
            shown = deck.element_sets.names.get(key, key)
            found.append(ShellSection(shown, name, thickness, -share * thickness))  # nodes lie above the middle
    except (Unused, ValueError) as reason:
        return (), str(reason)
    return tuple(found), ""


def filling(deck: Deck, statement: Statement) -> Filling:
    """*NONSTRUCTURAL MASS of solid elements: per volume, or in total.

    Raises
    ------
    Unused
        What is not followed.
    """
    only(statement, "ELSET", "UNITS", "DISTRIBUTION")
    units = "".join(option(statement, "UNITS").upper().split())
    shared = "".join(statement.options.get("DISTRIBUTION", "MASSPROPORTIONAL").upper().split())
    if units not in ("TOTALMASS", "MASSPERVOLUME") or shared not in ("MASSPROPORTIONAL", "VOLUMEPROPORTIONAL"):
        raise Unused("a nonstructural mass is used per volume or in total, in proportion to mass or volume")
    (row,) = statement.rows
    (value,) = numbers(row)
    if not value > 0:
        raise Unused("a nonstructural mass must be positive")
    key = option(statement, "ELSET").upper()
    members = deck.element_sets.members(key)
    if any(solid_type(deck.kinds.get(label, "")) is None for label in members):
        raise Unused("a nonstructural mass of other elements than solids")
    name = deck.element_sets.names[key]
    if units == "MASSPERVOLUME":
        return Filling(name, density=value)
    return Filling(name, total=value, by_mass=shared == "MASSPROPORTIONAL")


def material(deck: Deck, name: str) -> MeshMaterial:
    """A material (capitals).

    Raises
    ------
    Unused
        It lacks constants or density, or is of another kind.
    ValueError
        Constants that are no numbers, or that no material has.
    """
    given = _statements(deck, name)
    if given.keys() != {"ELASTIC", "DENSITY"} or not any(map(any, given["DENSITY"].rows)):
        raise Unused(f"material {name!r} lacks *ELASTIC or *DENSITY")
    elastic, density = given["ELASTIC"], given["DENSITY"]
    kind = "".join(elastic.options.get("TYPE", "ISO").upper().split())
    if kind not in _KINDS:
        raise Unused(f"a material is elastic of type {kind}, which is not followed")
    wanted = _KINDS[kind]
    lines = -(-wanted // 8)
    if len(elastic.rows) != lines or len(density.rows) != 1:
        raise Unused("a material changes with temperature, or has another number of constants")
    values = [value for row in elastic.rows for value in numbers(row)][:wanted]
    if len(values) < wanted:
        raise Unused(f"material {name!r} has {len(values)} elastic constants of {wanted}")
    mass = numbers(density.rows[0])[0]
    if wanted == 2:
        return MeshMaterial(values[0], values[1], mass)
    if kind == "ENGINEERINGCONSTANTS":
        moduli = orthotropic_moduli(values[:3], values[3:6], values[6:])
    else:
        moduli = checked_moduli(_stiffnesses(values))
    return MeshMaterial(largest_youngs_modulus(moduli), 0.0, mass, moduli)


def isotropic(deck: Deck, name: str) -> MeshMaterial:
    """The same of an isotropic one."""
    found = material(deck, name)
    if found.moduli is not None:
        raise Unused(f"material {name!r} is not isotropic")
    return found


def _stiffnesses(values: list[float]) -> Array:
    """(6, 6) of the terms of an orthotropic or anisotropic matrix, by columns down to the diagonal."""
    own = np.zeros((6, 6))
    if len(values) == 9:
        places = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2), (3, 3), (4, 4), (5, 5)]
    else:
        places = [(i, j) for j in range(6) for i in range(j + 1)]
    for (i, j), value in zip(places, values, strict=True):
        own[i, j] = own[j, i] = value
    return np.asarray(own[np.ix_(_ORDER, _ORDER)])


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

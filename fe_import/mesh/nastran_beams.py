"""CBAR and CBEAM of bulk data with their properties, as attachments of solids.

Plane 1 of an element is its x-y plane, which holds the orientation vector.
"""

from __future__ import annotations

import math

import numpy as np

from fe_import.elements.attachments import AttachedBeam, Attachment
from fe_import.elements.frame import FrameElement, local_axes
from fe_import.elements.frame_releases import released_motion
from fe_import.elements.sections import (
    Circular,
    Rectangular,
    Section,
    SectionConstants,
    Tubular,
    box_constants,
    section_constants,
)
from fe_import.errors import FEImportError
from fe_import.mesh.nastran_bulk import Bulk, Unused, digits
from fe_import.mesh.nastran_materials import elastic_constants
from fe_import.model import Array
from fe_import.nastran.cards import Card

_ALONG = 1e-6  # sine of the angle between a beam and its orientation vector
_SIZES = {"BAR": 2, "ROD": 1, "TUBE": 2, "TUBE2": 2, "BOX": 4}  # dimensions of a PBARL


def beam(card: Card, bulk: Bulk) -> Attachment:
    """The beam of a CBAR or CBEAM.

    Raises
    ------
    Unused
        What is not followed.
    """
    if bulk.names & {"BAROR", "BEAMOR"}:
        raise Unused("defaults on a BAROR or BEAMOR card")
    if card.field(8) not in ("", "GGG") or any(f not in ("", "0") for f in card.fields[16:]):
        raise Unused("offsets that are not GGG, or warping points")
    label, first, second = card.integer(1), card.integer(3), card.integer(4)
    start, end = bulk.position(first, card), bulk.position(second, card)
    offsets = np.array(
        [
            bulk.axes(node, card) @ [card.real(k + j, 0.0) for j in range(3)]
            for node, k in ((first, 11), (second, 14))
        ]
    )
    toward = orientation(card, bulk)
    start, end = start + offsets[0], end + offsets[1]
    across = np.cross(end - start, toward)
    length = float(np.linalg.norm(end - start))
    if not np.linalg.norm(across) > _ALONG * length * np.linalg.norm(toward):
        raise Unused("a beam without length, or with an orientation vector along it")
    names = ("PBAR", "PBARL") if card.name == "CBAR" else ("PBEAM", "PBEAML")
    owner = bulk.property(card.integer(2, label), names)
    young, shear, density = _material(owner, bulk)
    section, line_mass = _READERS[owner.name](owner, young / (2 * shear) - 1)
    element = FrameElement((first, second), local_axes(start, end, across), length, section, young, shear, density)
    released = [
        digit + end_of for k, end_of in ((9, 0), (10, 6)) if card.field(k) not in ("", "0")
        for digit in digits(card.field(k), card)
    ]  # fmt: skip
    try:
        released_motion(element, tuple(released))
    except ValueError as problem:
        raise Unused(str(problem)) from None
    material = f"MAT1:{owner.integer(2)}"
    return AttachedBeam(card.name, material, element, offsets, tuple(released), line_mass)


def orientation(card: Card, bulk: Bulk) -> Array:
    """(3,) orientation vector of a CBAR, CBEAM or CBUSH, or that from its first grid point to G0; zero without one."""
    first = card.integer(3)
    if card.field(6) or card.field(7) or not card.field(5).isdigit():
        return np.asarray(bulk.axes(first, card) @ [card.real(k, 0.0) for k in (5, 6, 7)])
    return bulk.position(card.integer(5), card) - bulk.position(first, card)


def _material(owner: Card, bulk: Bulk) -> tuple[float, float, float]:
    """E, G and density of a property's MAT1."""
    card = bulk.materials.get(owner.integer(2))
    if card is None or card.name != "MAT1":
        raise Unused(f"material {owner.integer(2)} is no MAT1 of this file")
    young, shear, _ = elastic_constants(card)
    density = card.real(5, 0.0)
    if not (min(young, shear) > 0 and density >= 0):
        raise Unused(f"MAT1 {card.integer(1)} has constants that are not positive")
    return young, shear, density


def _constants(card: Card, area: float, plane_1: float, plane_2: float, torsion: float) -> SectionConstants:
    """Of given moments of inertia; the shear factors come after."""
    if not min(area, plane_1, plane_2, torsion) > 0:
        raise Unused(f"area, moments of inertia and torsion constant of {card.name} must be positive")
    return SectionConstants(area, plane_2, plane_1, torsion, math.inf, math.inf)


def _factors(card: Card, at: int, default: float) -> tuple[float, float]:
    """K1 and K2; 0 means that shear does not deform."""
    first, second = (card.real(k, default) for k in (at, at + 1))
    if min(first, second) < 0:
        raise Unused("shear factors must not be negative")
    return first or math.inf, second or math.inf


def _pbar(card: Card, nu: float) -> tuple[SectionConstants, float]:
    if card.real(19, 0.0):
        raise Unused("a product of inertia")
    found = _constants(card, *(card.real(k, 0.0) for k in (3, 4, 5, 6)))
    return _with_factors(found, _factors(card, 17, 0.0)), _line_mass(card.real(7, 0.0))


def _pbeam(card: Card, nu: float) -> tuple[SectionConstants, float]:
    given = [card.real(k, 0.0) for k in range(3, 9)]  # A, I1, I2, I12, J, nonstructural mass
    if given[3]:
        raise Unused("a product of inertia")
    k = 9
    if card.field(k).upper() not in ("YES", "YESA", "NO"):
        k += 8  # points of stress
    while (kind := card.field(k).upper()) in ("YES", "YESA", "NO"):
        if [card.real(k + 2 + j, value) for j, value in enumerate(given)] != given:
            raise Unused("a beam that tapers")
        k += 16 if kind == "YES" else 8
    if any(card.real(n, 0.0) for n in (*range(k + 2, k + 6), *range(k + 8, k + 16))):
        raise Unused("shear relief, inertia of nonstructural mass, or a centre off the axis")
    found = _constants(card, *(given[n] for n in (0, 1, 2, 4)))
    return _with_factors(found, _factors(card, k, 1.0)), _line_mass(given[5])


def _profile(card: Card, nu: float) -> tuple[SectionConstants, float]:
    """PBARL, PBEAML: dimensions along element z come first."""
    shape = card.field(4).upper()
    if card.field(3) not in ("", "MSCBML0") or shape not in _SIZES:
        raise Unused(f"a profile {shape or 'without type'}")
    count = _SIZES[shape]
    sizes = [card.real(9 + k) for k in range(count)]
    if any(card.fields[9 + count :]):
        raise Unused("a profile that tapers")
    line_mass = _line_mass(card.real(9 + count, 0.0))
    if not min(sizes) > 0:
        raise Unused("dimensions of a profile must be positive")
    if shape == "BOX":
        along_z, along_y, flange, web = sizes
        if not (2 * flange < along_y and 2 * web < along_z):
            raise Unused("the wall is thicker than half the section")
        return box_constants(along_y, along_z, flange, web), line_mass
    section: Section
    if shape == "BAR":
        section = Rectangular(sizes[1], sizes[0])
    elif shape == "ROD" or (shape == "TUBE2" and sizes[0] == sizes[1]):
        section = Circular(2 * sizes[0])
    else:
        section = Tubular(2 * sizes[0], sizes[1] if shape == "TUBE2" else sizes[0] - sizes[1])
    try:
        return section_constants(section, min(max(nu, -0.99), 0.499), "saint-venant", card.name), line_mass
    except FEImportError as problem:
        raise Unused(problem.message) from None


def _with_factors(section: SectionConstants, factors: tuple[float, float]) -> SectionConstants:
    s = section
    return SectionConstants(s.area, s.inertia_y, s.inertia_z, s.torsion_constant, *factors)


def _line_mass(value: float) -> float:
    if value < 0:
        raise Unused("a nonstructural mass is negative")
    return value


_READERS = {"PBAR": _pbar, "PBARL": _profile, "PBEAM": _pbeam, "PBEAML": _profile}

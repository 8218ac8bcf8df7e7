"""Beams of a deck: sections, directions and materials of its B31, B32, B33, as attachments of its solids.

Direction 1 of a section is local y, direction 2 local z. A B32 is two beams, from end to end through its middle node.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fe_import.abaqus.deck import Deck, Statement
from fe_import.abaqus.materials import isotropic
from fe_import.abaqus.statements import Unused, elements_of, numbers, only, option
from fe_import.elements.attachments import AttachedBeam, Attachment
from fe_import.elements.frame import FrameElement, local_axes
from fe_import.elements.sections import (
    Circular,
    Rectangular,
    RectangularTube,
    Section,
    SectionConstants,
    Tubular,
    section_constants,
)
from fe_import.errors import FEImportError
from fe_import.model import Array

_ALONG = 1e-6  # sine of the angle between a beam and its direction 1
_OF_ABAQUS = ("PART", "INSTANCE", "ASSEMBLY", "PREPRINT")  # unknown to CalculiX
_SHAPES = {"RECT": 2, "CIRC": 2, "PIPE": 2, "BOX": 6}  # numbers that a section needs


def beam_section(deck: Deck, statement: Statement, served: set[int]) -> Iterator[Attachment]:
    """Beams of a *BEAM SECTION or *BEAM GENERAL SECTION.

    Raises
    ------
    Unused
        What is not followed.
    """
    rows = statement.rows
    if statement.name == "BEAM SECTION":
        only(statement, "ELSET", "SECTION", "MATERIAL", "POISSON", "TEMPERATURE", "OFFSET1", "OFFSET2")
        shape, rows = option(statement, "SECTION").upper(), rows[:2]
        material = option(statement, "MATERIAL").upper()
        found = isotropic(deck, material)
        young, nu, density = found.youngs_modulus, found.poissons_ratio, found.density
        if not (young > 0 and -1 < nu < 0.5):
            raise Unused(f"material {material!r} is out of range")
        shear = young / (2 * (1 + nu))
    else:
        only(statement, "ELSET", "SECTION", "POISSON", "DENSITY")
        shape, material = statement.options.get("SECTION", "GENERAL").upper(), option(statement, "ELSET").upper()
        (density,) = numbers([option(statement, "DENSITY")])
        young, shear = (*numbers(rows[2] if len(rows) > 2 else []), 0.0, 0.0)[:2]
        if not (young > 0 and shear > 0 and (nu := young / (2 * shear) - 1) > -1):
            raise Unused("E and G, on its third line, must be positive")
    if not density > 0:
        raise Unused("a density must be positive")
    if not rows or len(rows) > 3:
        raise Unused("it has another number of lines than are followed")
    given = numbers(rows[0])
    if shape == "CIRC" and len(given) == 1:
        if not any(deck.keywords[name] for name in _OF_ABAQUS):
            raise Unused("one number is a radius to Abaqus, a diameter to CalculiX: write two diameters")
        given = [2 * given[0], 2 * given[0]]
    constants, sizes, turns = _section(shape, given, min(max(nu, -0.99), 0.499))
    place, direction = deck.placement(statement), None
    if len(rows) > 1 and any(rows[1]):
        direction = np.array(numbers(rows[1])[:3])
        if direction.shape != (3,):
            raise Unused("direction 1 needs three numbers")
        direction = place.rotation @ direction
    shares = numbers([statement.options.get(name, "") for name in ("OFFSET1", "OFFSET2")])
    if any(shares) and not sizes:
        raise Unused("offsets are a share of the thickness of RECT, CIRC, PIPE and BOX sections")
    across = [share * size for share, size in zip(shares, sizes or (0.0, 0.0), strict=True)]
    for kind, label in elements_of(deck, statement, "B3", served):
        if "OS" in kind:
            raise Unused("open sections that warp")
        if not set(deck.elements[kind][label]).isdisjoint(deck.normals):
            raise Unused("normals at the nodes of beams")
        section = constants
        if kind.startswith("B33"):  # Euler and Bernoulli's
            section = replace(constants, shear_factor_y=math.inf, shear_factor_z=math.inf)
        nodes = deck.elements[kind][label]
        toward = deck.orientation_nodes.get(label)
        if toward is not None:
            if toward not in deck.points:
                raise Unused("the further node of a beam is not there")
            direction = np.subtract(deck.points[toward], deck.points[nodes[0]])
        if direction is None and place.turned and not turns:
            raise Unused("a section without direction 1 in an instance that is turned")
        for first, second in pairwise(nodes):
            start, end = np.array(deck.points[first]), np.array(deck.points[second])
            axes = _axes(start, end, direction, turns)
            length = float(np.linalg.norm(end - start))
            element = FrameElement((first, second), axes, length, section, young, shear, density)
            offset = -(across @ axes[1:])
            yield AttachedBeam(statement.name, material, element, np.stack([offset, offset]))


def _axes(start: Array, end: Array, direction: Array | None, turns: bool) -> Array:
    """(3, 3) rows: along the beam, direction 1, direction 2."""
    along = end - start
    if not along.any():
        raise Unused("a beam without length")
    given = np.array([0.0, 0.0, -1.0]) if direction is None else direction
    if turns and np.linalg.norm(np.cross(along, given)) <= _ALONG * np.linalg.norm(along) * np.linalg.norm(given):
        given = np.eye(3)[int(np.abs(along).argmin())]  # a round section is the same in all directions
    across = np.cross(along, given)
    if np.linalg.norm(across) <= _ALONG * np.linalg.norm(along) * np.linalg.norm(given):
        raise Unused("direction 1 of a section lies along its beam")
    return local_axes(start, end, across)


def _section(shape: str, given: list[float], nu: float) -> tuple[SectionConstants, tuple[float, float] | None, bool]:
    """Constants, sizes in directions 1 and 2 if it has some, and whether all directions across are alike."""
    if shape == "GENERAL":
        area, across_1, product, across_2, torsion = (*given, 0.0, 0.0, 0.0, 0.0, 0.0)[:5]
        if product or any(given[5:]):
            raise Unused("a section with a product of inertia, or one that warps")
        if not min(area, across_1, across_2, torsion) > 0:
            raise Unused("area, moments of inertia and torsion constant must be positive")
        return SectionConstants(area, across_1, across_2, torsion, 1.0, 1.0), None, False
    if shape not in _SHAPES:
        raise Unused(f"a section {shape}")
    while len(given) > _SHAPES[shape] and not given[-1]:
        given = given[:-1]
    if len(given) != _SHAPES[shape]:
        raise Unused(f"a section {shape} of {len(given)} numbers")
    section: Section
    if shape == "RECT":
        section, sizes = Rectangular(*given), (given[0], given[1])
    elif shape == "BOX":
        if len(set(given[2:])) > 1:
            raise Unused("a box with walls of different thickness")
        section, sizes = RectangularTube(*given[:3]), (given[0], given[1])
    else:
        if shape == "CIRC" and given[0] != given[1]:
            raise Unused("an ellipse")
        section = Circular(given[0]) if shape == "CIRC" else Tubular(2 * given[0], given[1])
        sizes = (given[0], given[0]) if shape == "CIRC" else (2 * given[0], 2 * given[0])
    try:
        return section_constants(section, nu, "saint-venant", ""), sizes, shape in ("CIRC", "PIPE")
    except FEImportError as problem:
        raise Unused(problem.message) from None

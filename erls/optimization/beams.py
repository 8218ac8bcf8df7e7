"""Stiffness and outlines of the beams of a mechanism, from the descriptions of its links alone."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from erls.equations.nodal.parts import link_parts
from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link
from erls.optimization.frozen import Frozen, rules_of
from erls.optimization.link_numbers import LinkNumbers
from erls.scene.settings import Simulation
from fe_import.description.records import LinkDescription
from fe_import.elements.sections import Circular, Rectangular, RectangularTube, Section, Tubular
from fe_import.model import IntArray
from fe_import.models.frame_parts import frame_parts
from fe_import.models.model import unit_factors


def sections_of(mechanism: Mechanism, settings: Simulation, links: LinkNumbers, x: Array) -> Array:
    """(e, 6, 6) force and moment per twist of each element at a design (v,): stiffness of its section over its length.

    Parameters
    ----------
    mechanism : Mechanism
        Of the same lengths.
    settings : Simulation
        Of the scene, which say how beams become elements.
    links : LinkNumbers
    x : (v,) array
    """
    found = [
        links.kept("sections", k, x, partial(_stiffness, mechanism.links[number], description, settings))
        for k, number, description in _described(mechanism, links, x)
    ]
    return np.concatenate([np.zeros((0, 6, 6)), *found])


def _stiffness(link: Link, description: LinkDescription, settings: Simulation) -> Array:
    """Of the elements of a link."""
    made = link_parts(replace(link, description=description), elements_of(settings), 1, rules_of(settings))
    lengths = [float(np.linalg.norm(beam.frames[1, :3, 3] - beam.frames[0, :3, 3])) for beam in made.beams]
    return np.array([beam.section.stiffness / length for beam, length in zip(made.beams, lengths, strict=True)])


def elements_of(settings: Simulation) -> int | None:
    """Elements of each member, unless the description says."""
    return settings.elements_per_member if settings.formulation == "nodal" else None


def _described(mechanism: Mechanism, links: LinkNumbers, x: Array) -> list[tuple[int, int, LinkDescription]]:
    """Links that are made of beams and deform: numbers in the scene and in the mechanism, descriptions."""
    found = []
    for k, number in enumerate(mechanism.bodies):
        description = links.at(k, x) if mechanism.links[number].elastic_modes else None
        if description is not None and description.frame is not None:
            found.append((k, number, description))
    return found


def elements_by_link(mechanism: Mechanism, settings: Simulation, links: LinkNumbers, x: Array) -> IntArray:
    """(e,) numbers in the mechanism of the links of all elements."""
    found = [
        np.full(len(links.kept("sections", k, x, partial(_stiffness, mechanism.links[n], about, settings))), n)
        for k, n, about in _described(mechanism, links, x)
    ]
    return np.concatenate([np.zeros(0, dtype=np.int64), *found])


class Outlines(NamedTuple):
    """Of each element.

    Attributes
    ----------
    factors : (e, 3) array
        1/A, and half the height and half the width over the second moments: stress by axial force and by bendings about
        y and z.
    rounds : (e,) array
        Whether its section is round.
    links : (e,) array
        Number of its link.
    half : (e, 2) array
        Half the height and half the width [m].
    """

    factors: Array
    rounds: Array
    links: Array
    half: Array


def outlines_of(
    mechanism: Mechanism, settings: Simulation, links: LinkNumbers, x: Array, wanted: Collection[int]
) -> Outlines:
    """Of all elements of some links, by their numbers in the mechanism; others may have sections without a shape.

    Raises
    ------
    SceneError
        A section of which only constants are known.
    """
    found = [
        links.kept("outlines", k, x, partial(_outlines, number, description, settings))
        for k, number, description in _described(mechanism, links, x)
        if number in wanted
    ]
    none = Outlines(np.zeros((0, 3)), np.zeros(0, dtype=bool), np.zeros(0, dtype=np.int64), np.zeros((0, 2)))
    return Outlines(*(np.concatenate(parts) for parts in zip(none, *found, strict=True)))


def _outlines(number: int, description: LinkDescription, settings: Simulation) -> Outlines:
    """Of the elements of a link."""
    frame, factors, rounds, half = description.frame, [], [], []
    assert frame is not None
    mesh = frame_parts(description, frame, description.name, elements_of(settings)).mesh
    metre = unit_factors(description, description.name)[0]
    for member, elements in zip(frame.members, mesh.members, strict=True):
        section = description.sections[member.section]
        where = f"link {description.name!r}: sections.{member.section}"
        height, width = (metre * size for size in _half_sizes(section, where))
        for e in elements:
            own = mesh.elements[e].section
            factors.append((1 / own.area, height / own.inertia_y, width / own.inertia_z))
            rounds.append(isinstance(section, (Circular, Tubular)))
            half.append((height, width))
    count = len(rounds)
    return Outlines(np.array(factors), np.array(rounds, dtype=bool), np.full(count, number), np.array(half))


def _half_sizes(section: Section, where: str) -> tuple[float, float]:
    """Along local z and y [m]."""
    if isinstance(section, Circular):
        return section.diameter / 2, section.diameter / 2
    if isinstance(section, Tubular):
        return section.outer_diameter / 2, section.outer_diameter / 2
    if isinstance(section, (Rectangular, RectangularTube)):
        return section.height / 2, section.width / 2
    raise SceneError(
        Cause.BAD_FIELD,
        "how large this section is, and with it its stress, is not known",
        where=where,
        remedy="give a shape with dimensions, or limit stress of other links",
    )


def assembled(frozen: Frozen, elements: Array) -> Array:
    """(6 N, 6 N) of matrices of elements (e, 6, 6) on their twists."""
    result = np.zeros((6 * len(frozen.links),) * 2)
    blocks = np.einsum("eji,ejk,ekl->eil", frozen.strains, elements, frozen.strains)
    for place, block in zip(frozen.places, blocks, strict=True):
        result[np.ix_(place, place)] += block
    return result


def scattered(frozen: Frozen, forces: Array) -> Array:
    """(k, 6 N) of forces on the ends of elements (k, e, 12)."""
    result = np.zeros((len(forces), 6 * len(frozen.links)))
    for place, force in zip(frozen.places, np.moveaxis(forces, 1, 0), strict=True):
        result[:, place] += force
    return result


def clamped_flexibility(frozen: Frozen, elements: Array) -> Array:
    """(6 N, 6 N) displacements by forces on links that are held at their inboard nodes; 0 there."""
    result = np.zeros((6 * len(frozen.links),) * 2)
    free = frozen.flexible
    if len(free):
        stiffness = assembled(frozen, elements)[np.ix_(free, free)]
        result[np.ix_(free, free)] = np.linalg.inv(stiffness)
    return result



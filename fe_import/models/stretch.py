"""Meshes of other thickness: nodes move away from a plane by factors that change along the link."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np

from fe_import.description.meshes import Stretch
from fe_import.description.records import Interface, LinkDescription
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.model import Array


def stretched(mesh: SolidMesh, link: LinkDescription) -> tuple[SolidMesh, LinkDescription]:
    """The mesh, and the description with what it names by positions, after ``solid.stretch``."""
    solid = link.solid
    if solid is None or not solid.stretch:
        return mesh, link
    given = solid.stretch
    names = {name: _vector(moved(np.array([place], dtype=float), given)) for name, place in solid.nodes.items()}
    interfaces = [_interface(interface, given) for interface in link.interfaces]
    own = msgspec.structs.replace(solid, nodes=names)
    found = replace(mesh, nodes=moved(mesh.nodes, given), further_nodes=moved(mesh.further_nodes, given))
    return found, msgspec.structs.replace(link, solid=own, interfaces=interfaces)


def moved(places: Array, given: Sequence[Stretch]) -> Array:
    """(n, 3) places of a mesh after its stretches, one after the other."""
    for one in given:
        axis = "xyz".index(one.axis)
        factors = np.full(len(places), one.factors[0])
        if one.along:
            factors = np.interp(places[:, "xyz".index(one.along)], one.at, one.factors)
        places = places.copy()
        places[:, axis] = one.about + factors * (places[:, axis] - one.about)
    return places


def _interface(interface: Interface, given: Sequence[Stretch]) -> Interface:
    if interface.position is None:
        return interface
    place = _vector(moved(np.array([interface.position], dtype=float), given))
    return msgspec.structs.replace(interface, position=place)


def _vector(places: Array) -> tuple[float, float, float]:
    x, y, z = places[0].tolist()
    return x, y, z

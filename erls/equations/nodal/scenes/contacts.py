"""Contacts of a scene of bodies, from planes as they lie when all is built."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from erls.equations.nodal.contacts import Contacts, NodalContact
from erls.maths.motion_maps import inverse
from erls.maths.so3 import Array
from erls.mechanism.place import Place
from erls.scene.bodies.schema import BodySceneRecord
from erls.scene.build_contacts import against_plane, plane_of
from erls.scene.contacts import WORLD


def contacts(record: BodySceneRecord, numbers: Mapping[str, int], poses: Array, file: str) -> list[Contacts]:
    """All of a scene as one set; none without any.

    Raises
    ------
    SceneError
        BAD_FIELD: naming file, field, value and remedy.
    """
    found = []
    for k, contact in enumerate(record.contacts):
        place, node = Place(Path(), f"{file}: contacts[{k}]"), numbers[contact.node]
        given = against_plane(contact, place)
        position, normal = plane_of(contact.plane, place.at("plane"))
        nodes: tuple[int, ...] = (node,)
        if contact.plane.on != WORLD:
            base = numbers[contact.plane.on]
            back, nodes = inverse(poses[base]), (base, node)
            position, normal = back[:3, :3] @ position + back[:3, 3], back[:3, :3] @ normal
        found.append(NodalContact(nodes, np.zeros(3), replace(given, position=position, normal=normal)))
    return [Contacts(found)] if found else []

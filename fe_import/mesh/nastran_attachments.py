"""Concentrated masses and rigid elements of bulk data, as attachments of solids: CONM2, RBE2, RBE3.

What is not understood whole is not used: `Unused` says why, and the mesh reader refuses the card.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fe_import.elements.attachments import AttachedMass, Attachment, AverageNode, RigidBody
from fe_import.nastran.cards import Card

_DISPLACEMENTS = {"1", "2", "3"}


class Unused(Exception):
    """Why a card is not used."""


def attachment(card: Card) -> Attachment | None:
    """What a card attaches, by numbers of grid points; None for other cards.

    Raises
    ------
    Unused
        What is not followed.
    FEImportError
        ``EXPORT``: a faulty field.
    """
    reader = _READERS.get(card.name)
    return None if reader is None else reader(card)


def _concentrated_mass(card: Card) -> Attachment:
    if card.integer(3, 0) != 0:
        raise Unused("a CONM2 in a coordinate system of its own")
    offset = np.array([card.real(k, 0.0) for k in (5, 6, 7)])
    xx, yx, yy, zx, zy, zz = (card.real(k, 0.0) for k in (9, 10, 11, 12, 13, 14))
    inertia = np.array([[xx, -yx, -zx], [-yx, yy, -zy], [-zx, -zy, zz]])  # the card holds moments of deviation
    mass = card.real(4, 0.0)
    if mass < 0 or np.linalg.eigvalsh(inertia)[0] < -1e-9 * np.abs(inertia).max():
        raise Unused("a mass or inertia that is negative")
    return AttachedMass("CONM2", card.integer(2), mass, inertia, offset)


def _rigid(card: Card) -> Attachment:
    if not set(card.field(3)) >= _DISPLACEMENTS:
        raise Unused("an RBE2 that leaves displacements free")
    words = [f for f in card.fields[3:] if f]
    if words and not words[-1].isdigit():
        words.pop()  # thermal expansion
    if not words or not all(w.isdigit() and len(w) < 10 for w in words):
        raise Unused("an RBE2 without a plain list of grid points")
    return RigidBody("RBE2", card.integer(2), np.unique([int(w) for w in words]).astype(np.int64))


def _average(card: Card) -> Attachment:
    if not set(card.field(4)) >= _DISPLACEMENTS:
        raise Unused("an RBE3 that leaves displacements of its reference free")
    nodes: list[int] = []
    weights: list[float] = []
    k = 5
    last = max((n for n in range(1, len(card.fields) + 1) if card.field(n)), default=0)
    while k <= last:
        if card.field(k).upper() in ("UM", "ALPHA"):
            raise Unused("an RBE3 with UM or ALPHA")
        weight, components = card.real(k), card.field(k + 1)
        if not set(components) >= _DISPLACEMENTS or weight <= 0:
            raise Unused("an RBE3 that averages other components than displacements, or with weights of zero")
        k += 2
        while k <= last and (not card.field(k) or card.field(k).isdigit()):
            if card.field(k):
                nodes.append(card.integer(k))
                weights.append(weight)
            k += 1
    if len(nodes) < 3 or len(set(nodes)) < len(nodes):
        raise Unused("an RBE3 that averages fewer than three grid points, or one twice")
    return AverageNode("RBE3", card.integer(3), np.array(nodes, dtype=np.int64), np.array(weights))


_READERS: dict[str, Callable[[Card], Attachment]] = {"CONM2": _concentrated_mass, "RBE2": _rigid, "RBE3": _average}

"""Masses, springs, rigid elements and equations of bulk data, as attachments of solids.

What is not understood whole is not used: `Unused` says why, and the mesh reader refuses the card.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fe_import.elements.attachments import (
    AttachedMass,
    AttachedSpring,
    Attachment,
    AverageNode,
    LinearEquation,
    RigidBody,
    Terms,
)
from fe_import.elements.frame import local_axes
from fe_import.mesh.nastran_beams import beam, orientation
from fe_import.mesh.nastran_bulk import Bulk, Unused, digits
from fe_import.model import Array
from fe_import.nastran.cards import Card

_MOST_FIELDS = {"CONM2": 14, "CBAR": 16, "CBEAM": 18, "CELAS1": 6, "CELAS2": 8, "CBUSH": 13, "RBAR": 8}
_DISPLACEMENTS = {"1", "2", "3"}
_ALL = (0, 1, 2, 3, 4, 5)


def attached(card: Card, bulk: Bulk) -> list[Attachment] | None:
    """What a card attaches, by numbers of grid points; None for other cards.

    Raises
    ------
    Unused
        What is not followed.
    FEImportError
        ``EXPORT``: a faulty field.
    """
    reader = READERS.get(card.name)
    if reader is None:
        return None
    if any(card.fields[_MOST_FIELDS.get(card.name, len(card.fields)) :]):
        raise Unused(f"a {card.name} with more fields than it has")
    found = reader(card, bulk)
    return found if isinstance(found, list) else [found]


def _concentrated_mass(card: Card, bulk: Bulk) -> Attachment:
    node, system = card.integer(2), card.integer(3, 0)
    offset = np.array([card.real(k, 0.0) for k in (5, 6, 7)])
    axes = np.eye(3)
    if system == -1:
        offset = offset - bulk.position(node, card)
    elif system:
        frame = bulk.points.frames.get(system, card)
        if frame.kind != "R":
            raise Unused("a CONM2 in a coordinate system that is not rectangular")
        axes, offset = frame.axes, frame.axes @ offset
    xx, yx, yy, zx, zy, zz = (card.real(k, 0.0) for k in (9, 10, 11, 12, 13, 14))
    inertia = np.array([[xx, -yx, -zx], [-yx, yy, -zy], [-zx, -zy, zz]])  # the card holds moments of deviation
    mass = card.real(4, 0.0)
    if mass < 0 or np.linalg.eigvalsh(inertia)[0] < -1e-9 * np.abs(inertia).max():
        raise Unused("a mass or inertia that is negative")
    return AttachedMass("CONM2", node, mass, axes @ inertia @ axes.T, offset)


def _followers(card: Card, nodes: list[int], text: str, bulk: Bulk) -> tuple[int, ...]:
    """Components of nodes that follow a rigid element: all displacements, and some rotations."""
    chosen = digits(text, card)
    if not set(chosen) >= {0, 1, 2}:
        raise Unused(f"an {card.name} that leaves displacements free")
    if len(chosen) in (4, 5) and any(node in bulk.points.axes for node in nodes):
        raise Unused(f"an {card.name} that holds some rotations in a coordinate system of its own")
    return chosen


def _rigid(card: Card, bulk: Bulk) -> Attachment:
    words = [f for f in card.fields[3:] if f]
    if words and not words[-1].isdigit():
        words.pop()  # thermal expansion
    if not words or not all(w.isdigit() and len(w) < 10 for w in words):
        raise Unused("an RBE2 without a plain list of grid points")
    nodes = np.unique([int(w) for w in words]).astype(np.int64)
    return RigidBody("RBE2", card.integer(2), nodes, _followers(card, nodes.tolist(), card.field(3), bulk))


def _bar(card: Card, bulk: Bulk) -> Attachment:
    first, second = card.integer(2), card.integer(3)
    leads = [digits(card.field(k), card) if card.field(k) else () for k in (4, 5)]
    if leads == [(), _ALL]:
        first, second, at = second, first, 6
    elif leads == [_ALL, ()]:
        at = 7
    else:
        raise Unused("an RBAR whose independent components are not all at one end")
    if card.field(13 - at):
        raise Unused("an RBAR whose dependent components are at both ends")
    components = _followers(card, [second], card.field(at), bulk) if card.field(at) else _ALL
    return RigidBody("RBAR", first, np.array([second], dtype=np.int64), components)


def _average(card: Card, bulk: Bulk) -> Attachment:
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


def _along(card: Card, node: int, component: int, factor: float, bulk: Bulk) -> Iterator[tuple[int, int, float]]:
    """Terms, in mesh axes, of a component (0 ... 5) along the axes of a grid point."""
    turning = 3 * (component // 3)
    for k, share in enumerate(bulk.axes(node, card)[:, component % 3]):
        if share:
            yield node, turning + k, factor * float(share)


def _component(card: Card, at: int) -> int:
    (component,) = digits(card.field(at), card) if len(card.field(at)) == 1 and card.field(at) != "0" else (-1,)
    if component < 0:
        raise Unused("a scalar point, or several components in one")
    return component


def _stiff(value: float) -> float:
    if value < 0:
        raise Unused("a stiffness is negative")
    return value


def _spring(card: Card, bulk: Bulk) -> Attachment:
    if not (card.field(3) and card.field(5)):
        raise Unused("a spring to the ground; a link is free")
    if card.name == "CELAS2":
        stiffness = card.real(2)
    else:
        number = card.integer(2, card.integer(1))
        owner = bulk.property(number, ("PELAS",))
        stiffness = owner.real(2 if owner.integer(1) == number else 6)
    terms: list[tuple[int, int, float]] = []
    for at, sign in ((3, -1.0), (5, 1.0)):
        terms += _along(card, card.integer(at), _component(card, at + 1), sign, bulk)
    return AttachedSpring(card.name, ((_stiff(stiffness), tuple(terms)),))


def _bush(card: Card, bulk: Bulk) -> Attachment:
    """Six springs, along and about its axes, between points that go with the two grid points."""
    if not card.field(4):
        raise Unused("a bush to the ground; a link is free")
    if card.field(10) not in ("", "-1"):
        raise Unused("a bush with a place of its own (OCID)")
    nodes = card.integer(3), card.integer(4)
    start, end = (bulk.position(node, card) for node in nodes)
    axes = _bush_axes(card, bulk, start, end)
    owner = bulk.property(card.integer(2, card.integer(1)), ("PBUSH",))
    values = np.zeros(6)
    for at in range(2, len(owner.fields) + 1, 8):
        kind = owner.field(at).upper()
        given = [owner.field(at + k) for k in range(1, 7)]
        if kind == "K":
            if any(text.upper() == "RIGID" for text in given):
                raise Unused("a bush that is rigid in part")
            values = np.array([_stiff(owner.real(at + k, 0.0)) for k in range(1, 7)])
        elif kind == "M" and any(given):
            raise Unused("a bush with a mass")
    place = start + card.real(9, 0.5) * (end - start)
    forms: list[tuple[float, Terms]] = []
    for k, stiffness in enumerate(values):
        along = axes[:, k % 3]
        terms: list[tuple[int, int, float]] = []
        for node, point, sign in zip(nodes, (start, end), (-1.0, 1.0), strict=True):
            shares: Array = np.concatenate([along, np.cross(place - point, along)])  # (θ × r)·e = θ·(r × e)
            if k > 2:
                shares = np.concatenate([np.zeros(3), along])
            terms += [(node, c, sign * float(share)) for c, share in enumerate(shares) if share]
        if stiffness:
            forms.append((float(stiffness), tuple(terms)))
    return AttachedSpring("CBUSH", tuple(forms))


def _bush_axes(card: Card, bulk: Bulk, start: Array, end: Array) -> Array:
    """(3, 3) axes (columns) of a bush."""
    if card.field(8):
        return bulk.points.frames.get(card.integer(8), card).axes_at(start)
    along = end - start
    if not along.any():
        raise Unused("a bush between points in one place needs a coordinate system (CID)")
    toward = orientation(card, bulk)
    across = np.cross(along, toward)
    if not np.linalg.norm(across) > 1e-6 * np.linalg.norm(along) * np.linalg.norm(toward):
        raise Unused("a bush without a coordinate system, or an orientation vector across it")
    return local_axes(start, end, across).T


def _equation(card: Card, bulk: Bulk) -> list[Attachment]:
    if bulk.selected is not None and card.integer(1) not in bulk.selected:
        return []  # another case's
    if "MPCADD" in bulk.names:
        raise Unused("sets of sets (MPCADD)")
    if bulk.selected is None and len({c.integer(1) for c in bulk.cards if c.name == "MPC"}) > 1:
        raise Unused("several sets, and no case control that selects one")
    terms: list[tuple[int, int, float]] = []
    for at in range(2, len(card.fields) + 1):
        if (at - 2) % 8 in (0, 3) and card.field(at):
            terms += _along(card, card.integer(at), _component(card, at + 1), card.real(at + 2), bulk)
    return [LinearEquation("MPC", tuple(terms))]


READERS: dict[str, Callable[[Card, Bulk], Attachment | list[Attachment]]] = {
    "CONM2": _concentrated_mass,
    "CBAR": beam,
    "CBEAM": beam,
    "CELAS1": _spring,
    "CELAS2": _spring,
    "CBUSH": _bush,
    "RBE2": _rigid,
    "RBE3": _average,
    "RBAR": _bar,
    "MPC": _equation,
}

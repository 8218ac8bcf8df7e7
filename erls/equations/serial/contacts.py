"""Contacts of nodes with planes, as records; how they meet is in `erls.equations.serial.touch`."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.serial.loads import call_touch
from erls.equations.serial.records import Serial, call_contact_gains
from erls.maths.calls import address_for, address_of
from erls.maths.records import Memory, Vector, place_of, python_reader, reader, room, table_size
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from fe_import.model import IntArray


class Contact(NamedTuple):
    """A node against a plane.

    Attributes
    ----------
    place : (3,) array
        A point of the plane, in the axes of the node that carries it, or in the world [m].
    axes : (9,) array
        Unit vectors there: the normal, and two along the plane.
    law, friction : (4,), (9,) arrays
        Of `erls.maths.contact_law`.
    """

    place: Vector
    axes: Vector
    law: Vector
    friction: Vector


class ContactState(NamedTuple):
    """How they meet, in the axes of the world.

    Attributes
    ----------
    point : (12,) array
        Pose of the node.
    base : (12,) array
        Of what carries the plane.
    axes : (9,) array
        Of the plane.
    twist : (6,) array
        Velocity of the node against the plane, and of what carries it.
    arm : (3,) array
        From that to the node.
    force : (3,) array
        On the node [N].
    asked : (4,) array
        1 where the force is the next three, along the axes of the plane, instead of that of the law.
    known : (6,) array
        Gap [m] and its rate, normal force [N], friction along the two axes, elastic energy [J].
    lost : (1,) array
        Power that goes into heat, negative [W].
    slip : (4,) array
        Velocity of the node along the two axes of the plane, and its place along them from what carries the plane.
    gains : (5,) array
        Normal force per depth and per rate of depth; friction per velocity along the motion, and across it, and per
        displacement.
    """

    point: Annotated[Array, "12"]
    base: Annotated[Array, "12"]
    axes: Annotated[Array, "9"]
    twist: Annotated[Array, "6"]
    arm: Annotated[Array, "3"]
    force: Annotated[Array, "3"]
    asked: Annotated[Array, "4"]
    known: Annotated[Array, "6"]
    lost: Annotated[Array, "1"]
    slip: Annotated[Array, "4"]
    gains: Annotated[Array, "5"]


class ContactRoom(NamedTuple):
    """Room for `erls.equations.serial.contact_gains`: residuals (n,) without contacts, and what one changes."""

    without: Annotated[Array, "n"]
    row: Annotated[Array, "n"]


class Flat(Protocol):
    """A system in flat memory, of links alone or tied."""

    @property
    def reals(self) -> Array:
        """Constants."""

    @property
    def integers(self) -> IntArray:
        """Tables of records."""

    @property
    def scratch(self) -> Array:
        """Working memory."""


_see_serial = python_reader(Serial)
read_contact, read_contact_state, _see_state = reader(Contact), reader(ContactState), python_reader(ContactState)
_see_contact = python_reader(Contact)
read_contact_room = reader(ContactRoom)
CONTACT, CONTACT_STATE = table_size(Contact), table_size(ContactState)
GAP, GAP_RATE, NORMAL_FORCE, FRICTION, ENERGY = 0, 1, 2, 3, 5
"""Places in ``known``; friction has two."""


def put_contacts(
    mechanism: Mechanism, residual: Any, size: int, constants: Memory, scratch: Memory
) -> dict[str, int]:
    """Records of all contacts; by the names of fields of `Serial`.

    Parameters
    ----------
    mechanism : Mechanism
    residual : kernel
        Of the formulation, in ``size`` velocities.
    size : int
    constants, scratch : Memory
    """
    own = mechanism.contacts
    records = [Contact(c.position, c.axes, c.law.numbers, c.sliding(mechanism.reach)) for c in own]
    return {
        "touch": address_for(call_touch, bool(own)),
        "contact_gains": address_for(call_contact_gains, bool(own)),
        "residual": address_of(residual, contract.RESIDUAL) if own else -1,
        "contact_count": len(own),
        "contacts": constants.put_all(records),
        "contact_states": scratch.put_all([room(ContactState) for _ in own]),
        "contact_room": scratch.put(room(ContactRoom, n=size)) if own else -1,
    }


def friction_laws(system: Flat) -> list[Array]:
    """Views (9,) of the friction of every contact among the constants."""
    serial = _see_serial(system.reals, system.integers, int(system.integers[0]))
    places = (serial.contacts + k * CONTACT for k in range(serial.contact_count))
    return [_see_contact(system.reals, system.integers, at).friction for at in places]


def seen_places(system: Flat) -> IntArray:
    """(q, 5) places in the working memory where a residual leaves the gap of every contact, and its slip."""
    serial = _see_serial(system.reals, system.integers, int(system.integers[0]))
    found = []
    for k in range(serial.contact_count):
        at = serial.contact_states + k * CONTACT_STATE
        known, slip = (place_of(ContactState, name, system.integers, at) for name in ("known", "slip"))
        found.append([known + GAP, *range(slip, slip + 4)])
    return np.array(found, dtype=np.int64).reshape(-1, 5)


def contact_states(system: Flat) -> list[ContactState]:
    """Views of what a residual leaves of every contact."""
    serial = _see_serial(system.reals, system.integers, int(system.integers[0]))
    places = (serial.contact_states + k * CONTACT_STATE for k in range(serial.contact_count))
    return [_see_state(system.scratch, system.integers, at) for at in places]

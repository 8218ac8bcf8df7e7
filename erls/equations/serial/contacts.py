"""Contact of nodes with planes: how they meet, by the law of `erls.maths.contact_law`, and what each side feels.

The node A lies at the gap n · (x_A - x_P) above a plane that moves with a node B, or stands still, and comes to it with
the relative velocity v_A - v_B - ω_B × (x_A - x_B), whose part along n is the rate of the gap. The force acts where A
is, and its opposite there on what carries the plane: neither momentum changes.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from erls.equations import compiled_system as contract
from erls.equations.serial.loads import (
    LOAD,
    LOAD_STATE,
    TOUCH,
    Load,
    LoadState,
    call_touch,
    read_load,
    read_load_state,
)
from erls.equations.serial.nodes import NODE_STATE, NodeState, read_node_state
from erls.equations.serial.records import Serial, call_contact_gains, read_serial
from erls.maths.calls import address_for, address_of
from erls.maths.contact_law import contact_energy, contact_force, contact_gains, elastic_force, friction_factor
from erls.maths.jit import kernel, part
from erls.maths.products import clear, copy
from erls.maths.records import Memory, Vector, python_reader, reader, room, table_size
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, compose_poses, dot3, rotate, rotate_back, set_identity
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
    law : (4,) array
        Of `erls.maths.contact_law`.
    friction, friction_rate : float
        Of `erls.mechanism.contacts.PointContact`.
    """

    place: Vector
    axes: Vector
    law: Vector
    friction: float
    friction_rate: float


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
    gains : (4,) array
        Normal force per depth and per rate of depth; friction per velocity along the motion, and across it.
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
    gains: Annotated[Array, "4"]


class ContactRoom(NamedTuple):
    """Room for `erls.equations.serial.contact_gains`: residuals (n,) without contacts, and what one changes."""

    without: Annotated[Array, "n"]
    row: Annotated[Array, "n"]


read_contact, read_contact_state, _see_state = reader(Contact), reader(ContactState), python_reader(ContactState)
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
    records = [Contact(c.position, c.axes, c.law.numbers, c.friction, c.friction_rate) for c in own]
    kept = [constants.put(record) for record in records], [scratch.put(room(ContactState)) for _ in own]
    return {
        "touch": address_for(call_touch, bool(own)),
        "contact_gains": address_for(call_contact_gains, bool(own)),
        "residual": address_of(residual, contract.RESIDUAL) if own else -1,
        "contact_count": len(own),
        "contacts": kept[0][0] if own else -1,
        "contact_states": kept[1][0] if own else -1,
        "contact_room": scratch.put(room(ContactRoom, n=size)) if own else -1,
    }


def contact_states(system: contract.CompiledSystem, serial: Serial) -> list[ContactState]:
    """Views of what a residual leaves of every contact."""
    places = (serial.contact_states + k * CONTACT_STATE for k in range(serial.contact_count))
    return [_see_state(system.scratch, system.integers, at) for at in places]


@part
def _meet(contact: Contact, state: ContactState, load: Load, work: LoadState, own: NodeState, base: NodeState) -> None:
    """Places, velocities and force of a contact, seen from its node."""
    compose_poses(work.pose, own.pose, state.point)
    set_identity(state.base)
    clear(state.twist)
    velocity, spin, arm = state.twist[:3], state.twist[3:], state.arm
    rotate(state.point, work.moved[:3], velocity)
    if load.reference >= 0:
        compose_poses(work.other, base.pose, state.base)
        rotate(state.base, work.turning[:3], arm)
        for i in range(3):
            velocity[i] -= arm[i]
        rotate(state.base, work.turning[3:], spin)
    gap = 0.0 * contact.place[0]
    for k in range(3):
        rotate(state.base, contact.axes[3 * k : 3 * k + 3], state.axes[3 * k : 3 * k + 3])
    for i in range(3):
        arm[i] = state.point[9 + i] - state.base[9 + i]
    add_cross(spin, arm, -1.0, velocity)
    normal = state.axes[:3]
    rotate(state.base, contact.place, state.force)
    for i in range(3):
        gap += normal[i] * (arm[i] - state.force[i])
    state.known[0], state.known[1] = gap, dot3(normal, velocity)


@part
def _press(contact: Contact, state: ContactState) -> None:
    """Force of the law, energy, loss and gains."""
    known, gains, velocity = state.known, state.gains, state.twist[:3]
    depth, speed = -known[0], -known[1]
    push = contact_force(contact.law, depth, speed)
    along, across = dot3(state.axes[3:6], velocity), dot3(state.axes[6:], velocity)
    known[2], known[5] = push, contact_energy(contact.law, depth)
    known[3] = known[4] = 0.0 * push
    gains[0], gains[1] = contact_gains(contact.law, depth, speed)
    gains[2] = gains[3] = 0.0 * push
    state.lost[0] = (elastic_force(contact.law, depth) - push) * speed
    if contact.friction != 0.0:
        rate = contact.friction_rate
        factor, slope = friction_factor((along * along + across * across) / (rate * rate))
        strength = contact.friction * push / rate
        known[3], known[4] = -strength * factor * along, -strength * factor * across
        gains[2] = strength * (factor + slope * (along * along + across * across) / (rate * rate))
        gains[3] = strength * factor
        state.lost[0] += known[3] * along + known[4] * across


@kernel(TOUCH, counted=False)
def touch(at: int, number: int, reals: Array, integers: IntArray, scratch: Array) -> None:
    """What a contact does to the node of a load, in the axes of that node, into ``given``; the load of the node comes
    before that of the plane. ``at`` is the place of the `Serial`.
    """
    serial = read_serial(reals, integers, at)
    load = read_load(reals, integers, serial.load_records + number * LOAD)
    work = read_load_state(scratch, integers, serial.load_states + number * LOAD_STATE)
    own = read_node_state(scratch, integers, serial.load_node_states + 2 * number * NODE_STATE)
    contact = read_contact(reals, integers, serial.contacts + load.contact * CONTACT)
    state = read_contact_state(scratch, integers, serial.contact_states + load.contact * CONTACT_STATE)
    push, moment = work.given[:3], work.given[3:]
    work.power[0] = 0.0 * state.lost[0]
    clear(moment)
    if load.side == 0:
        base = read_node_state(scratch, integers, serial.load_node_states + (2 * number + 1) * NODE_STATE)
        _meet(contact, state, load, work, own, base)
        _press(contact, state)
        work.power[0] = state.lost[0]
        for i in range(3):
            state.force[i] = 0.0 * push[i]
            for k in range(3):
                part_of_it = state.known[2 + k]
                if state.asked[0] != 0.0:
                    part_of_it = 0.0 * part_of_it + state.asked[1 + k]
                state.force[i] += part_of_it * state.axes[3 * k + i]
        copy(state.force, push)
        rotate_back(state.point, push, push)
    else:
        for i in range(3):
            push[i] = -state.force[i]
        add_cross(state.arm, push, 1.0, moment)
        rotate_back(state.base, push, push)
        rotate_back(state.base, moment, moment)

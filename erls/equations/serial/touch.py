"""Contact of nodes with planes: how they meet, by the law of `erls.maths.contact_law`, and what each side feels.

The node A lies at the gap n · (x_A - x_P) above a plane that moves with a node B, or stands still, and comes to it with
the relative velocity v_A - v_B - ω_B × (x_A - x_B), whose part along n is the rate of the gap. The force acts where A
is, and its opposite there on what carries the plane: neither momentum changes.
"""

from __future__ import annotations

from erls.equations.serial.contacts import (
    CONTACT,
    CONTACT_STATE,
    ENERGY,
    FRICTION,
    GAP,
    GAP_RATE,
    NORMAL_FORCE,
    Contact,
    ContactState,
    read_contact,
    read_contact_state,
)
from erls.equations.serial.loads import LOAD, LOAD_STATE, TOUCH, Load, LoadState, read_load, read_load_state
from erls.equations.serial.nodes import NODE_STATE, NodeState, read_node_state
from erls.equations.serial.records import read_serial
from erls.maths.contact_law import (
    contact_energy,
    contact_force,
    contact_gains,
    elastic_force,
    friction_force,
    friction_gains,
)
from erls.maths.contact_places import COEFFICIENT
from erls.maths.jit import kernel, part
from erls.maths.products import clear, copy
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, compose_poses, dot3, rotate, rotate_back, set_identity
from fe_import.model import IntArray


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
    state.known[GAP], state.known[GAP_RATE] = gap, dot3(normal, velocity)
    for k in range(2):
        axis = state.axes[3 * k + 3 : 3 * k + 6]
        state.slip[k], state.slip[2 + k] = dot3(axis, velocity), dot3(axis, arm)


@part
def _press(contact: Contact, state: ContactState) -> None:
    """Force of the law, energy, loss and gains."""
    known, gains, law = state.known, state.gains, contact.friction
    depth, speed = -known[GAP], -known[GAP_RATE]
    push = contact_force(contact.law, depth, speed)
    along, across = state.slip[0], state.slip[1]
    known[NORMAL_FORCE], known[ENERGY] = push, contact_energy(contact.law, depth)
    known[FRICTION] = known[FRICTION + 1] = 0.0 * push
    gains[0], gains[1] = contact_gains(contact.law, depth, speed)
    gains[2] = gains[3] = gains[4] = 0.0 * push
    state.lost[0] = (elastic_force(contact.law, depth) - push) * speed
    if law[COEFFICIENT] != 0.0 and depth.real > 0.0:
        known[FRICTION], known[FRICTION + 1] = friction_force(law, push, along, across, state.slip[2], state.slip[3])
        gains[2], gains[3], gains[4] = friction_gains(law, push, along, across)
        state.lost[0] += known[FRICTION] * along + known[FRICTION + 1] * across


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
                strength = state.known[NORMAL_FORCE + k]
                if state.asked[0] != 0.0:
                    strength = 0.0 * strength + state.asked[1 + k]
                state.force[i] += strength * state.axes[3 * k + i]
        copy(state.force, push)
        rotate_back(state.point, push, push)
    else:
        for i in range(3):
            push[i] = -state.force[i]
        add_cross(state.arm, push, 1.0, moment)
        rotate_back(state.base, push, push)
        rotate_back(state.base, moment, moment)

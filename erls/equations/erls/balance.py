"""Forces out of balance on the independent coordinates: outward for the motion, inward for the forces.

A virtual displacement is δν_k = J_k δθ, δq = (D δq_d + G δθ, δq_d) (ERLS-CMS paper, eq. 69-75); instead of forming J, D
and G, forces on ν and on u go from link to parent with the transposes of what carries motions outward. Anchored
(`erls.equations.erls.anchored_frames`) both are one: forces on w.
"""

from __future__ import annotations

from typing import Any

from erls.equations.erls.anchored_frames import move_anchored
from erls.equations.erls.frames import move_frames
from erls.equations.erls.link_forces import link_forces, weigh_displaced
from erls.equations.erls.records import (
    LINK,
    LINK_STATE,
    Chain,
    call_loads,
    read_chain,
    read_link,
    read_link_state,
)
from erls.equations.erls.second_order import bent_forces
from erls.equations.serial.elastic import elastic_force
from erls.equations.serial.joints import effort
from erls.equations.serial.nodes import NODE, NODE_STATE, from_node_axes, read_node, read_node_state
from erls.equations.serial.records import (
    JOINT,
    JOINT_STATE,
    MODES,
    Serial,
    call_feed_forward,
    read_joint,
    read_joint_state,
    read_modes,
    read_serial,
)
from erls.maths.jit import part
from erls.maths.products import add_columns, add_rows, clear
from erls.maths.so3 import Array
from erls.maths.spatial import add_force_cross, add_motion_cross, dot6, transform_force_back
from fe_import.model import IntArray


@part
def _forces_of_links(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, accelerated: bool, bends: Any
) -> None:
    """``wrench``, ``force`` and ``modal`` of every link alone."""
    for k in range(serial.links):
        link = read_link(reals, integers, chain.links + k * LINK)
        state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
        if bends is None:
            link_forces(chain, link, state, state.twist, state.twist_rate, accelerated)
        else:
            bent_forces(chain, reals, integers, scratch, k, accelerated)
        if chain.weight:
            weigh_displaced(link, state)
        # on the ground it moves along the joint, which does not feel this
        if link.parent >= 0 or chain.complete:
            add_force_cross(state.twist, state.momentum, state.wrench)
        for i in range(6):
            state.force[i] = state.modal[i]


@part
def push_joint(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, k: int, bends: Any
) -> Any:
    """Force along a joint by those on its link and on all that it bears, before `hand_back`."""
    motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
    state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
    total = dot6(motion.screw, state.wrench)
    if bends is not None or read_link(reals, integers, chain.links + k * LINK).parent < 0:
        return total
    # the joint turns the displacement along: u̇ holds -ad(S θ̇) u
    clear(state.point)
    add_motion_cross(state.u, motion.screw, 1.0, state.point)
    return total + dot6(state.point, state.force)


@part
def hand_back(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, k: int, bends: Any
) -> None:
    """Forces of a link and of all that it bears, on its parent."""
    link = read_link(reals, integers, chain.links + k * LINK)
    state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
    before = read_link_state(scratch, integers, chain.states + link.parent * LINK_STATE)
    pose, point = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).pose, state.point
    transform_force_back(pose, state.wrench, point)
    if bends is None:
        for i in range(6):
            before.wrench[i] += point[i]
        transform_force_back(pose, state.force, point)
        for i in range(6):
            before.force[i] += point[i]
        add_rows(link.out, point, 1.0, before.modal[6:])
    else:
        if read_node(reals, integers, chain.seats + k * NODE).moves:
            moved = read_node_state(scratch, integers, chain.seat_states + k * NODE_STATE)
            from_node_axes(moved.pose, moved.tangent, point, state.other)
            add_columns(moved.rows, state.other, 1.0, before.modal[6:])
            transform_force_back(moved.pose, point, point)
        for i in range(6):
            before.wrench[i] += point[i]


@part
def balance(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array, bends: Any,
    at: int,
) -> None:  # fmt: skip
    """M a - f of the chain whose `Serial` stands at that place.

    ``bends`` is None where links have no second-order displacements, which leaves them out of the compiled code.
    """
    serial = read_serial(reals, integers, at)
    chain = read_chain(reals, integers, serial.own)
    if serial.feeds >= 0:
        call_feed_forward(serial.feeds, at, reals, integers, scratch, t)
    if bends is None:
        move_frames(serial, chain, reals, integers, scratch, t, y, v, a)
    else:
        move_anchored(serial, chain, reals, integers, scratch, t, y, v, a)
    _forces_of_links(serial, chain, reals, integers, scratch, len(a) > 0, bends)
    if serial.loads >= 0:
        call_loads(serial.loads, at, reals, integers, scratch, t, y, v, out)
    for k in range(serial.links - 1, -1, -1):
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        parent = read_link(reals, integers, chain.links + k * LINK).parent
        state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
        for i in range(len(modes.stiffness)):
            place = modes.first + i
            held = elastic_force(modes.stiffness[i], y[place], modes.rest[i])
            out[place] = state.modal[6 + i] + held + modes.damping[i] * v[place]
        total = push_joint(serial, chain, reals, integers, scratch, k, bends) + joint.rotor * motion.coordinate[2]
        motion.forces[1] = 0.0
        if joint.acts:
            motion.forces[1] = effort(
                joint, reals, integers, t, motion.coordinate[0], motion.coordinate[1], motion.feed[0]
            )
        motion.forces[0] = total - motion.forces[1]
        if joint.place >= 0:
            out[joint.place] = motion.forces[0]
        if parent >= 0:
            hand_back(serial, chain, reals, integers, scratch, k, bends)

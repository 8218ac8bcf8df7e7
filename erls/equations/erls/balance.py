"""Forces out of balance on the independent coordinates: outward for the motion, inward for the forces.

A virtual displacement is δν_k = J_k δθ, δq = (D δq_d + G δθ, δq_d) (ERLS-CMS paper, eq. 69-75); instead of forming J, D
and G, forces on ν and on u go from link to parent with the transposes of what carries motions outward.
"""

from __future__ import annotations

from typing import Any

from erls.equations.erls.frames import move_frames
from erls.equations.erls.link_forces import link_forces, weigh_displaced
from erls.equations.erls.records import (
    BEND,
    BEND_STATE,
    LINK,
    LINK_STATE,
    Bend,
    BendState,
    Chain,
    LinkState,
    read_bend,
    read_bend_state,
    read_chain,
    read_link,
    read_link_state,
)
from erls.equations.erls.second_order import bend_frames, correct_twist, feel_curvature, set_arm
from erls.equations.serial.elastic import elastic_force
from erls.equations.serial.joints import effort
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
from erls.maths.products import add_rows, clear
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, add_force_cross, add_motion_cross, dot6, transform_force_back
from fe_import.model import IntArray


@part
def _forces_of_links(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, accelerated: bool, bends: Any
) -> None:
    """``wrench``, ``force`` and ``modal`` of every link alone."""
    for k in range(serial.links):
        link = read_link(reals, integers, chain.links + k * LINK)
        state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
        twist, rate = state.twist, state.twist_rate
        if bends is not None:
            bend = read_bend(reals, integers, chain.bends + k * BEND)
            bent = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE)
            if bend.curved:
                correct_twist(bend, state, bent)
                twist, rate = bent.full, bent.full_rate
        link_forces(chain, link, state, twist, rate, accelerated)
        if bends is not None:
            bend = read_bend(reals, integers, chain.bends + k * BEND)
            bent = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE)
            if bend.curved:
                feel_curvature(bend, link, state, bent)
        if chain.weight:
            weigh_displaced(link, state)
        if link.parent >= 0 or chain.complete:  # on the ground it moves along the joint, which does not feel this
            add_force_cross(state.twist, state.momentum, state.wrench)
        for i in range(6):
            state.force[i] = state.modal[i]
        if bends is not None:
            push = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE).push
            for i in range(6):
                push[i] = state.modal[i]


@part
def _turn_arm_back(bend: Bend, state: LinkState, bent: BendState, coordinate: Any) -> None:
    """What ``push`` does to the turn of a link, by the arm from its inboard interface to its joint."""
    back = bent.share[:3]
    set_arm(bend.slide, bend.arm, coordinate, state.u[3:], bent.d, bent.b)
    clear(back)
    add_cross(bent.push, state.u[3:], 1.0, back)
    add_cross(bent.b, bent.push, 0.5, state.force[3:])
    add_cross(bent.d, back, 0.5, state.force[3:])


@part
def _push_along(bend: Bend, state: LinkState, bent: BendState, screw: Array) -> Any:
    """Force of ``push`` along a joint, which turns second-order displacements along."""
    path, turned = bent.share, bent.share_rate[:3]
    clear(path)
    add_motion_cross(bent.carried, screw, 1.0, path)
    if bend.armed:
        clear(turned)
        add_cross(state.u[3:], bend.slide, 1.0, turned)
        add_cross(state.u[3:], turned, 0.5, path)
    return dot6(path, bent.push)


@part
def push_joint(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, k: int, bends: Any
) -> Any:
    """Force along a joint by those on its link and on all that it bears, before `hand_back`."""
    motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
    state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
    total = dot6(motion.screw, state.wrench)
    if read_link(reals, integers, chain.links + k * LINK).parent < 0:
        return total
    # the joint turns the displacement along: u̇ holds -ad(S θ̇) u
    clear(state.point)
    add_motion_cross(state.u, motion.screw, 1.0, state.point)
    if bends is not None:
        bend = read_bend(reals, integers, chain.bends + k * BEND)
        bent = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE)
        if bend.armed:
            _turn_arm_back(bend, state, bent, motion.coordinate[0])
        total += _push_along(bend, state, bent, motion.screw)
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
    for i in range(6):
        before.wrench[i] += point[i]
    transform_force_back(pose, state.force, point)
    for i in range(6):
        before.force[i] += point[i]
    add_rows(link.out, point, 1.0, before.modal[6:])
    if bends is not None:
        bend = read_bend(reals, integers, chain.bends + k * BEND)
        bent = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE)
        bent_before = read_bend_state(scratch, integers, chain.bend_states + link.parent * BEND_STATE)
        transform_force_back(pose, bent.push, point)
        for i in range(6):
            bent_before.push[i] += point[i]
        if bend.bows:
            m = bent.bow.shape[1]
            forces, turns = bent.spare[:m], m - (len(before.q) - 6)
            clear(forces)
            for r in range(6):
                row, weight = bent.bow[r], point[r]
                for i in range(m):
                    forces[i] += weight * row[i]
            for i in range(turns):
                before.force[3 + i] += forces[i]
            for i in range(turns, m):
                before.modal[6 + i - turns] += forces[i]


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
    move_frames(serial, chain, reals, integers, scratch, t, y, v, a)
    if bends is not None:
        bend_frames(serial, chain, reals, integers, scratch, True)
    _forces_of_links(serial, chain, reals, integers, scratch, len(a) > 0, bends)
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

"""Energies of a chain: kinetic, elastic, gravity, springs; see `erls.equations.compiled_system`."""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.erls.anchored_frames import move_anchored, set_pose
from erls.equations.erls.frames import move_frames
from erls.equations.erls.link_forces import deform, pair_of
from erls.equations.erls.records import (
    BEND,
    BEND_STATE,
    LINK,
    LINK_STATE,
    Chain,
    Link,
    LinkState,
    read_bend,
    read_bend_state,
    read_chain,
    read_link,
    read_link_state,
)
from erls.equations.erls.second_order import correct_twist
from erls.equations.serial.elastic import elastic_energy
from erls.equations.serial.joints import joint_energy
from erls.equations.serial.modal_inertia_kernels import (
    WARP,
    WARP_STATE,
    read_warp,
    read_warp_state,
    set_warp,
    warp_energy,
)
from erls.equations.serial.records import (
    JOINT,
    JOINT_STATE,
    MODES,
    read_joint,
    read_joint_state,
    read_modes,
    read_serial,
)
from erls.maths.jit import kernel, part
from erls.maths.products import add_columns, clear, dot
from erls.maths.so3 import Array
from erls.maths.spatial import dot3
from fe_import.model import IntArray


@part
def _kinetic(chain: Chain, link: Link, state: LinkState, twist: Array) -> Any:
    """T of a link, with the twist that inertia knows."""
    s, momenta, axes = state.q_acceleration, state.modal, len(link.axes)
    for i in range(len(s)):
        s[i] = state.q_rate[i]
    for i in range(6):
        s[i] += twist[i]
    clear(momenta)
    add_columns(link.mass, s, 1.0, momenta)
    total = dot(s, momenta) / 2
    deform(chain, link, state)
    for a in range(axes):
        omega = dot3(link.axes[a], twist[3:])
        if chain.first_order:
            total += omega * dot(state.turned[a], s)
        if chain.second_order:
            for b in range(axes):
                total += omega * dot3(link.axes[b], twist[3:]) * state.moments[pair_of(axes, a, b)] / 2
    return total


@part
def add_energies(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array, bends: Any
) -> None:
    """Energies; ``bends`` as in `erls.equations.erls.balance`."""
    serial = read_serial(reals, integers, integers[0])
    chain = read_chain(reals, integers, serial.own)
    if bends is None:
        move_frames(serial, chain, reals, integers, scratch, t, y, v, y[0:0])
    else:
        move_anchored(serial, chain, reals, integers, scratch, t, y, v, y[0:0])
    clear(out)
    for k in range(serial.links):
        link = read_link(reals, integers, chain.links + k * LINK)
        state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        twist, moment, pose = state.twist, state.point[:3], motion.pose
        clear(moment)
        if bends is not None:
            set_pose(serial, chain, reals, integers, scratch, k)
            pose = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE).pose
            bend = read_bend(reals, integers, chain.bends + k * BEND)
            if bend.curved:
                bent = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE)
                correct_twist(bend, state, bent)
                twist = bent.full
                for i in range(3):
                    moment[i] = bent.moment[i]
            if bend.warped:
                warp = read_warp(reals, integers, chain.warps + k * WARP)
                warp_state = read_warp_state(scratch, integers, chain.warp_states + k * WARP_STATE)
                set_warp(warp, warp_state, state.q[6:])
                out[0] += warp_energy(warp, warp_state, state.q_rate[6:])
        out[0] += _kinetic(chain, link, state, twist) + joint.rotor * motion.coordinate[1] ** 2 / 2
        for i in range(len(modes.stiffness)):
            out[1] += elastic_energy(modes.stiffness[i], y[modes.first + i], modes.rest[i])
        # g · place of the frame, from link to link
        height = state.other
        if link.parent < 0:
            height[0] = dot3(serial.gravity, pose[9:])
        else:
            before = read_link_state(scratch, integers, chain.states + link.parent * LINK_STATE)
            height[0] = before.other[0] + dot3(before.down, pose[9:])
        for j in range(len(state.q)):
            for i in range(3):
                moment[i] += link.mass[j, i] * state.q[j]
        # rigid-body mass matrix [m, -m c̃; m c̃, J]: first moment m c
        moment[0] += link.mass[5, 1]
        moment[1] += link.mass[3, 2]
        moment[2] += link.mass[4, 0]
        out[2] -= link.mass[0, 0] * height[0] + dot3(state.down, moment)
        out[3] += joint_energy(joint, motion.coordinate[0])


@kernel(contract.ENERGY, counted=False)
def energy(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> None:
    """Kinetic (rotors included), elastic, gravity, springs [J]."""
    add_energies(reals, integers, scratch, t, y, v, out, None)

"""Poses of links and their coordinates at many times; see `erls.equations.compiled_system`."""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.erls.anchored_frames import move_anchored, set_pose
from erls.equations.erls.frames import move_frames
from erls.equations.erls.records import (
    BEND_STATE,
    LINK,
    LINK_STATE,
    read_bend_state,
    read_chain,
    read_link,
    read_link_state,
)
from erls.equations.serial.records import JOINT_STATE, read_joint_state, read_serial
from erls.maths.jit import kernel, part
from erls.maths.so3 import Array
from erls.maths.spatial import compose_poses
from fe_import.model import IntArray


@part
def put_states(
    reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, v: Array, out: Array, bends: Any
) -> None:
    """Rows of ``out``; ``bends`` as in `erls.equations.erls.balance`."""
    serial = read_serial(reals, integers, integers[0])
    chain = read_chain(reals, integers, serial.own)
    for row in range(len(t)):
        if bends is None:
            move_frames(serial, chain, reals, integers, scratch, t[row], y[row], v[row], y[row, 0:0])
        else:
            move_anchored(serial, chain, reals, integers, scratch, t[row], y[row], v[row], y[row, 0:0])
        at, found = 12 * serial.links, out[row]
        for k in range(serial.links):
            parent = read_link(reals, integers, chain.links + k * LINK).parent
            state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
            motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
            pose = found[12 * k : 12 * k + 12]
            if parent < 0:
                for i in range(12):
                    pose[i] = motion.pose[i]
            else:
                step = motion.pose
                if bends is not None:
                    set_pose(serial, chain, reals, integers, scratch, k)
                    step = read_bend_state(scratch, integers, chain.bend_states + k * BEND_STATE).pose
                compose_poses(found[12 * parent : 12 * parent + 12], step, pose)
            for values in (state.q, state.q_rate, motion.coordinate[:2]):
                for i in range(len(values)):
                    found[at + i] = values[i]
                at += len(values)


@kernel(contract.STATES, counted=False)
def states(reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, v: Array, out: Array) -> None:
    """Rows of ``out``: pose (12,) of every link; then of every link (u, q_d), its rate, θ and θ̇ of its joint."""
    put_states(reals, integers, scratch, t, y, v, out, None)

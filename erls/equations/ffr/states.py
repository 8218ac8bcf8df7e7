"""Poses of floating frames and joint coordinates at many times; see `erls.equations.compiled_system`."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.ffr.motion import place_frames
from erls.equations.ffr.records import BODY, read_body, read_frames
from erls.equations.serial.nodes import NODE, NODE_STATE, read_node, read_node_state
from erls.equations.serial.records import JOINT_STATE, read_joint_state, read_serial
from erls.maths.jit import kernel, part
from erls.maths.so3 import Array
from fe_import.model import IntArray


@part
def _go_on(pose: Array, step: Array, spare: Array) -> None:
    """Replace a pose (12,) by that of a frame at ``step`` from it."""
    for i in range(12):
        spare[i] = pose[i]
    for i in range(3):
        for j in range(3):
            pose[3 * i + j] = spare[3 * i] * step[j] + spare[3 * i + 1] * step[3 + j] + spare[3 * i + 2] * step[6 + j]
        pose[9 + i] = spare[9 + i] + (
            spare[3 * i] * step[9] + spare[3 * i + 1] * step[10] + spare[3 * i + 2] * step[11]
        )


@kernel(contract.STATES, counted=False)
def states(reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, v: Array, out: Array) -> None:
    """Rows of ``out``: pose (12,) of every floating frame in the world, then θ and θ̇ of every joint, then 12 numbers
    of working memory.
    """
    serial = read_serial(reals, integers, integers[0])
    frames = read_frames(reals, integers, serial.own)
    for row in range(len(t)):
        place_frames(serial, frames, reals, integers, scratch, t[row], y[row], v[row], y[row, 0:0])
        found = out[row]
        spare = found[len(found) - 12 :]
        for k in range(serial.links):
            parent = read_body(reals, integers, frames.bodies + k * BODY).parent
            joint = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
            pose = found[12 * k : 12 * k + 12]
            for i in range(12):
                pose[i] = found[12 * parent + i] if parent >= 0 else (1.0 if i in (0, 4, 8) else 0.0)
            if read_node(reals, integers, frames.nodes + 2 * k * NODE).moves:
                base = read_node_state(scratch, integers, frames.node_states + 2 * k * NODE_STATE)
                _go_on(pose, base.pose, spare)
            _go_on(pose, joint.pose, spare)
            if read_node(reals, integers, frames.nodes + (2 * k + 1) * NODE).moves:
                inner = read_node_state(scratch, integers, frames.node_states + (2 * k + 1) * NODE_STATE)
                _go_on(pose, inner.back, spare)
            found[12 * serial.links + 2 * k] = joint.coordinate[0]
            found[12 * serial.links + 2 * k + 1] = joint.coordinate[1]

"""The conditions of all closing joints at a state: Φ, Φ̇, Φ̈ at zero accelerations, and Φ_y of those in use."""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.equations.compiled_system import Array, IntArray
from erls.equations.loops.coupled import couple
from erls.equations.loops.records import (
    CLOSING_JOINT,
    CLOSURE,
    COORDINATE,
    LOOP_STATE,
    PUSH,
    RATE,
    TURNING,
    ClosingJoint,
    LoopRoom,
    Loops,
    LoopState,
    call_frames,
    read_closing_joint,
    read_loop_room,
    read_loop_state,
    read_loops,
)
from erls.equations.loops.rubbing import grip_force
from erls.equations.serial.joints import effort
from erls.equations.serial.records import read_joint, read_joint_state
from erls.equations.serial.time_curves import curve
from erls.equations.switches.still import still_frames
from erls.maths.coefficients import angle_of
from erls.maths.jit import kernel, part
from erls.maths.products import clear, copy
from erls.maths.screws import off_thread, turn_gradient, turn_gradient_change
from erls.maths.so3 import Array as AnyArray
from erls.maths.spatial import add_motion_cross, dot3, dot6, transform_motion
from erls.maths.vectors import Rotation, dot, three


@part
def relative_pose(inner: AnyArray, outer: AnyArray, out: AnyArray) -> None:
    """Pose of the outer frame in the inner one."""
    for i in range(3):
        for j in range(3):
            out[3 * i + j] = inner[i] * outer[j] + inner[3 + i] * outer[3 + j] + inner[6 + i] * outer[6 + j]
        out[9 + i] = 0.0
        for j in range(3):
            out[9 + i] += inner[3 * j + i] * (outer[9 + j] - inner[9 + j])


@part
def _between(joint: ClosingJoint, frames: Array, state: LoopState) -> None:
    """Pose, twist, its derivative and rows of the outer frame in the inner one."""
    moves, carried = state.moves, state.spare
    outer = frames[joint.outer, :12] if joint.outer >= 0 else joint.ground[0]
    inner = frames[joint.inner, :12] if joint.inner >= 0 else joint.ground[1]
    relative_pose(inner, outer, state.pose)
    n = moves.shape[1]
    clear(state.twist)
    clear(state.twist_rate)
    moves[:, :] = 0.0
    if joint.outer >= 0:
        found = frames[joint.outer]
        for i in range(6):
            state.twist[i], state.twist_rate[i] = found[12 + i], found[18 + i]
            for j in range(n):
                moves[i, j] = found[24 + i * n + j]
    if joint.inner >= 0:
        found = frames[joint.inner]
        transform_motion(state.pose, found[18:24], carried)
        for i in range(6):
            state.twist_rate[i] -= carried[i]
        transform_motion(state.pose, found[12:18], carried)
        for i in range(6):
            state.twist[i] -= carried[i]
        add_motion_cross(state.twist, carried, 1.0, state.twist_rate)
        for j in range(n):
            for i in range(6):
                carried[i] = found[24 + i * n + j]
            transform_motion(state.pose, carried, carried)
            for i in range(6):
                moves[i, j] -= carried[i]


@part
def _less_prescribed(reals: Array, integers: IntArray, joint: ClosingJoint, t: float, state: LoopState) -> None:
    """What is between the frames beside the prescribed coordinate, or all of it."""
    left, screw = state.left, state.spare
    copy(state.pose, left)
    copy(state.twist, state.left_twist)
    copy(state.twist_rate, state.left_rate)
    if joint.motion < 0:
        return
    value, rate, acceleration = curve(reals, integers, joint.motion, t)
    value -= joint.zero
    clear(screw)
    screw[joint.along] = 1.0
    if joint.along == 5:
        c, s = np.cos(value), np.sin(value)
        for j in range(3):
            p, q = left[j], left[3 + j]
            left[j], left[3 + j] = c * p + s * q, c * q - s * p
        p, q = left[9], left[10]
        left[9], left[10] = c * p + s * q, c * q - s * p
        left[11] -= joint.pitch * value
        screw[2] = joint.pitch
    else:
        left[11] -= value
    transform_motion(left, screw, screw)
    for i in range(6):
        state.left_twist[i] -= screw[i] * rate
        state.left_rate[i] -= screw[i] * acceleration
    add_motion_cross(state.left_twist, screw, rate, state.left_rate)


@part
def measure(line: Array, entries: Array, pose: Array, twist: Array, twist_rate: Array, gradient: Array) -> Any:
    """c · p + ⟨C, Q⟩ with its first derivative, and the second one at this derivative of the twist.

    ``gradient`` (6,) gets its derivatives over the twist: with G = Qᵀ C they are Qᵀ c and the axial vector of G - Gᵀ.
    """
    g = gradient
    v0, v1, v2, w0, w1, w2 = twist[0], twist[1], twist[2], twist[3], twist[4], twist[5]
    value = dot3(line, pose[9:])
    for j in range(3):
        g[j] = pose[j] * line[0] + pose[3 + j] * line[1] + pose[6 + j] * line[2]
        g[3 + j] = 0.0 * value
    bend = g[0] * (w1 * v2 - w2 * v1) + g[1] * (w2 * v0 - w0 * v2) + g[2] * (w0 * v1 - w1 * v0)
    speed = w0 * w0 + w1 * w1 + w2 * w2
    for i in range(3):
        along = pose[3 * i] * w0 + pose[3 * i + 1] * w1 + pose[3 * i + 2] * w2
        for j in range(3):
            factor = entries[i, j]
            if factor != 0.0:
                value += factor * pose[3 * i + j]
                bend += factor * (along * twist[3 + j] - pose[3 * i + j] * speed)
                # - r × e_j
                after, last = (j + 1) % 3, (j + 2) % 3
                g[3 + after] -= factor * pose[3 * i + last]
                g[3 + last] += factor * pose[3 * i + after]
    return value, dot6(g, twist), bend + dot6(g, twist_rate)


@part
def pull_back(force: Array, moves: Array, out: Array) -> None:
    """``out`` (n,) is what a force (6,) on the relative twist does to the coordinates."""
    clear(out)
    for i in range(6):
        weight, row = force[i], moves[i]
        if weight != 0.0:
            for j in range(len(out)):
                out[j] += weight * row[j]


@part
def fed(scratch: Array, integers: IntArray, joint: ClosingJoint, like: Any) -> Any:
    """Feed-forward along a closing joint."""
    if joint.feeding < 0:
        return 0.0 * like
    return 0.0 * like + read_joint_state(scratch, integers, joint.feeding).feed[0]


@part
def _turn_of(pose: Array) -> Rotation:
    return pose[0], pose[1], pose[2], pose[3], pose[4], pose[5], pose[6], pose[7], pose[8]


@part
def follow_thread(
    pitch: float, value: Any, bend: Any, pose: Array, twist: Array, twist_rate: Array, gradient: Array
) -> Any:
    """What `measure` found, less the advance by the turn about z; that goes into ``gradient``, too."""
    turn, spin = _turn_of(pose), three(twist, 3)
    slope = turn_gradient(turn)
    for i in range(3):
        gradient[3 + i] -= pitch * slope[i]
    bend -= pitch * (dot(turn_gradient_change(turn, spin), spin) + dot(slope, three(twist_rate, 3)))
    return off_thread(value, pitch, turn), dot6(gradient, twist), bend


@part
def _turned(loops: Loops, reals: Array, integers: IntArray, joint: ClosingJoint, t: float, y: Array) -> Any:
    """Turns of a closing joint, as those of the tree between its links add up."""
    turned = -joint.turned
    for k in range(len(loops.joints)):
        if joint.signs[k] != 0.0:
            if loops.joints[k] >= 0:
                turned += joint.signs[k] * y[loops.joints[k]]
            else:
                turned += joint.signs[k] * curve(reals, integers, loops.motions[k], t)[0]
    return turned


@part
def _act(
    loops: Loops, reals: Array, integers: IntArray, scratch: Array, joint: ClosingJoint, t: float, y: Array,
    state: LoopState,
) -> None:  # fmt: skip
    """Coordinate of a closing joint, and what acts along it."""
    pose, found = state.pose, state.effort
    value = pose[11]
    if joint.along == 5 and len(joint.factors) == 0:
        angle = angle_of(pose[3] - pose[1], pose[0] + pose[4])
        turned = pose[11] / joint.pitch if joint.pitch.real != 0.0 else _turned(loops, reals, integers, joint, t, y)
        value = angle + 2 * np.pi * np.floor((turned - angle).real / (2 * np.pi) + 0.5)
    found[COORDINATE], found[RATE] = joint.zero + value, state.twist[joint.along]
    found[TURNING] = state.twist_rate[joint.along]
    found[PUSH] = 0.0
    if joint.joint >= 0:
        forces = read_joint(reals, integers, joint.joint)
        feed = fed(scratch, integers, joint, value)
        found[PUSH] = effort(forces, reals, integers, t, found[COORDINATE], found[RATE], feed)
        if len(joint.grip) > 0:
            found[PUSH] += grip_force(joint.grip, found[COORDINATE], found[RATE])


@part
def _close(
    loops: Loops, room: LoopRoom, reals: Array, integers: IntArray, scratch: Array, number: int, t: float, y: Array,
    v: Array,
) -> None:  # fmt: skip
    joint = read_closing_joint(reals, integers, loops.first + number * CLOSING_JOINT)
    state = read_loop_state(scratch, integers, loops.states + number * LOOP_STATE)
    if len(joint.factors) > 0:
        couple(loops, reals, integers, scratch, joint, t, y, v, state)
    else:
        _between(joint, room.frames, state)
    _less_prescribed(reals, integers, joint, t, state)
    for k in range(len(joint.lines)):
        at, gradient = joint.first + k, state.gradients[k]
        value, rate, bend = measure(
            joint.lines[k], joint.entries[k], state.left, state.left_twist, state.left_rate, gradient
        )
        if joint.pitches[k].real != 0.0:
            value, rate, bend = follow_thread(
                joint.pitches[k], value, bend, state.left, state.left_twist, state.left_rate, gradient
            )
        room.violation[at], room.rate[at], room.bias[at] = value, rate, bend
        if loops.used[at] >= 0:
            pull_back(gradient, state.moves, room.gradient[loops.used[at]])
    if joint.along >= 0:
        _act(loops, reals, integers, scratch, joint, t, y, state)


@kernel(CLOSURE, counted=False)
def closure(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array) -> None:
    """Conditions and efforts of all loops into `LoopRoom` and `LoopState`."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    call_frames(loops.frames, reals, integers, scratch, t, y, v, room.frames)
    still_frames(room.held, room.frames)
    for number in range(loops.loops):
        _close(loops, room, reals, integers, scratch, number, t, y, v)

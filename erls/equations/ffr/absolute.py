"""Links in floating frames, tied by their joints, as steps of generalized-α take them (`erls.equations.stepped`).

Joints are closing joints of `erls.equations.loops` between links that float freely (`floating`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from erls.equations.compiled_system import Array, CompiledSystem, Factoring, IntArray, function_in
from erls.equations.ffr import floating
from erls.equations.ffr.pack import Given, pack_frames
from erls.equations.loops import actuated, steps
from erls.equations.loops.compiled import CompiledLoops, Turns, compile_loops
from erls.equations.loops.compiled import Given as Tied
from erls.equations.loops.records import (
    CLOSING_JOINT,
    COORDINATE,
    LOOP_STATE,
    RATE,
    TURNING,
    call_closure,
    read_closing_joint,
    read_loop_state,
    read_loops,
)
from erls.equations.loops.rows import LoopRows
from erls.equations.serial.records import JOINT_STATE, Serial, read_serial
from erls.equations.stepped import COMPOSE, SETTLE, Stepped
from erls.maths.coefficients import stumpff
from erls.maths.dense import dot
from erls.maths.jit import kernel
from erls.maths.records import python_reader
from erls.maths.rotations import turned_further, value
from erls.maths.se3 import inverse, pose
from erls.maths.vectors import dot as dot3
from erls.maths.vectors import plus, three, times
from erls.mechanism.joint_types import single
from erls.mechanism.joints import Joint
from erls.mechanism.loops import Loop, LoopEnd, LoopFreedom, loop_ends

_see_serial = python_reader(Serial)


@kernel(COMPOSE, counted=False)
def compose(
    reals: Array, integers: IntArray, scratch: Array, metres: Array, start: Array, increment: Array, out: Array
) -> float:
    """Frames ∘ exp(increment), their rotations orthogonal to rounding; turns of joints are counted by `settle`."""
    serial = read_serial(reals, integers, integers[0])
    links, largest = serial.links, 1.0
    for k in range(links):
        at, d = 12 * k, 6 * k
        turn = (
            start[at], start[at + 1], start[at + 2], start[at + 3], start[at + 4], start[at + 5], start[at + 6],
            start[at + 7], start[at + 8],
        )  # fmt: skip
        u, psi = three(increment, d), three(increment, d + 3)
        c = stumpff(dot3(psi, psi))
        place = plus(three(start, at + 9), times(turn, value(c[1], c[2], psi, u)))
        r = turned_further(turn, psi, c[0], c[1])
        for i in range(9):
            out[at + i] = r[i]
        for i in range(3):
            out[at + 9 + i] = place[i]
    for i in range(12 * links, len(out)):
        out[i] = start[i]
    for i in range(len(increment) - 6 * links):
        out[12 * links + i] += increment[6 * links + i]
    for i in range(len(metres)):
        largest = max(largest, metres[i])
    return largest


@kernel(SETTLE, counted=False)
def settle(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, knot: Array
) -> int:
    """A knot: poses of the frames, elastic coordinates and those of joints, which have turned on in ``y``."""
    serial = read_serial(reals, integers, integers[0])
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    links, n, states = serial.links, len(v), loops.states
    call_closure(loops.closure, reals, integers, scratch, t, y, v)
    for k in range(links):
        r, v0, v1, v2 = y[12 * k : 12 * k + 9], v[6 * k], v[6 * k + 1], v[6 * k + 2]
        w0, w1, w2 = v[6 * k + 3], v[6 * k + 4], v[6 * k + 5]
        b0, b1, b2 = a[6 * k + 3], a[6 * k + 4], a[6 * k + 5]
        s0, s1, s2 = a[6 * k] + w1 * v2 - w2 * v1, a[6 * k + 1] + w2 * v0 - w0 * v2, a[6 * k + 2] + w0 * v1 - w1 * v0
        for i in range(3):
            p, q, x, at = r[3 * i], r[3 * i + 1], r[3 * i + 2], 12 * k + 3 * i
            knot[0, at], knot[0, at + 1], knot[0, at + 2] = p, q, x
            knot[1, at], knot[1, at + 1], knot[1, at + 2] = q * w2 - x * w1, x * w0 - p * w2, p * w1 - q * w0
            # r (w̃² + ḃ̃) for every row r, w̃² = w wᵀ - w²
            along, speed = p * w0 + q * w1 + x * w2, w0 * w0 + w1 * w1 + w2 * w2
            knot[2, at] = along * w0 - speed * p + q * b2 - x * b1
            knot[2, at + 1] = along * w1 - speed * q + x * b0 - p * b2
            knot[2, at + 2] = along * w2 - speed * x + p * b1 - q * b0
            here = 12 * k + 9 + i
            knot[0, here], knot[1, here] = y[here], p * v0 + q * v1 + x * v2
            knot[2, here] = p * s0 + q * s1 + x * s2
    for i in range(n - 6 * links):
        at = 12 * links + i
        knot[0, at], knot[1, at], knot[2, at] = y[at], v[6 * links + i], a[6 * links + i]
    for k in range(links):
        at, along = len(y) - links + k, read_closing_joint(reals, integers, loops.first + k * CLOSING_JOINT).along
        state = read_loop_state(scratch, integers, states + k * LOOP_STATE)
        y[at] = knot[0, at] = state.effort[COORDINATE]
        knot[1, at] = state.effort[RATE]
        knot[2, at] = state.effort[TURNING] + dot(state.moves[along], a[:n])
    return 0


class _Floating:
    """Links that nothing holds; a `erls.equations.loops.compiled.Carrier`."""

    def __init__(self, compiled: CompiledSystem) -> None:
        self.compiled, self.size, self.joints = compiled, compiled.size, 0
        self.free, self.free_joints = np.arange(self.size), np.zeros(0, dtype=np.int64)


def _frame(joint: Joint) -> Array:
    """(4, 4) turn of the joint's frames that makes the axis of the motion their z axis."""
    axis = joint.freedom.axis
    return pose(np.roll(np.eye(3), axis + 1, axis=0) if axis != 2 else None)


def joint_loops(given: Given) -> list[Loop]:
    """Every joint as one that closes a chain."""
    result: list[Loop] = []
    mechanism = given.mechanism
    for joint, link in zip(mechanism.joints, mechanism.links, strict=True):
        turn, seat = _frame(joint), joint.seat
        straight = replace(joint.freedom, axis=2)
        outer = LoopEnd(
            len(result), link.inboard.node, pose(position=-link.inboard.position) @ inverse(joint.after) @ turn
        )
        inner = LoopEnd(None, 0, joint.before @ turn)
        if seat is not None:
            inner = LoopEnd(joint.parent, seat.node, pose(position=-seat.position) @ joint.before @ turn)
        free = LoopFreedom(straight, 0.0, joint.forces, joint.rotor_inertia, joint.drive)
        result.append(Loop(joint.name, single(straight), inner, outer, free))
    return result


def pack_absolute(given: Given, metres: Array) -> CompiledLoops:
    """Links as they float, with their joints as conditions; see `floating`."""
    loops = joint_loops(given)
    system = pack_frames(replace(given, every_axis=True, absolute=True, ends=loop_ends(loops)))
    serial = _see_serial(system.reals, system.integers, int(system.integers[0]))
    count = len(loops)
    n = 6 * count + sum(data.size for data in given.data)
    links = replace(
        system,
        size=n,
        residual=floating.residual,
        mass_matrix=floating.mass_matrix,
        stiffness_and_damping=floating.stiffness_and_damping,
        factoring=None,
        load_frames=function_in("erls.equations.ffr.floating", "frames"),
    )
    rows, reach = LoopRows(loops), given.mechanism.reach
    turns = Turns(np.eye(count), np.zeros(count), n + 6 * count + np.arange(count), [None] * count)
    feeding = tuple(
        serial.joint_states + k * JOINT_STATE if joint.drive.feed_forward else -1
        for k, joint in enumerate(given.mechanism.joints)
    )
    row_metres = np.where(rows.turns, reach, 1.0)
    every = np.arange(len(rows.names))
    tied = Tied(_Floating(links), rows, every, metres, row_metres, reach, 0.0, np.inf, turns, feeding=feeding)
    return compile_loops(tied)


def stepped(system: CompiledLoops, pack: Any, unpack: Any) -> Stepped:
    """As steps take it; ``pack`` and ``unpack`` make numbers of a configuration, and the other way."""
    n, r = system.size, system.kept
    return Stepped(
        n,
        r,
        n + 7 * len(system.given.rows.loops),
        True,
        system.reals,
        system.integers,
        system.scratch,
        compose,
        steps.residual,
        settle,
        system.mass_matrix,
        actuated.matrices,
        Factoring(2 * r + 1 + (n + r) * (n + r + 1), steps.factor, steps.solve, steps.factor, steps.solve),
        pack,
        unpack,
    )

"""The tree with forces and rotors along the coordinates of closing joints; `closure` at the state comes before all."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.loops.bushed import bushing_gains, push_bushing
from erls.equations.loops.closure import fed
from erls.equations.loops.coupled import gyrate, gyration_gains
from erls.equations.loops.records import (
    CLOSING_JOINT,
    COORDINATE,
    GRIPPED_JOINT,
    LOOP_STATE,
    PUSH,
    RATE,
    TURNING,
    Loops,
    call_closure,
    call_mass_matrix,
    call_masses,
    call_residual,
    call_stiffness_and_damping,
    read_closing_joint,
    read_gripped_joint,
    read_loop_room,
    read_loop_state,
    read_loops,
)
from erls.equations.loops.rubbing import grip_force, grip_gains
from erls.equations.serial.joints import gains
from erls.equations.serial.records import read_joint
from erls.equations.switches.still import still_forces, still_matrix
from erls.maths.dense import dot
from erls.maths.jit import kernel, part


@part
def _push_closing(loops: Loops, reals: Array, integers: IntArray, scratch: Array, a: Array, out: Array) -> None:
    """Add what acts along closing joints."""
    n = len(out)
    for number in range(loops.loops):
        joint = read_closing_joint(reals, integers, loops.first + number * CLOSING_JOINT)
        if joint.joint >= 0:
            state = read_loop_state(scratch, integers, loops.states + number * LOOP_STATE)
            row, turning = state.moves[joint.along, :n], state.effort[TURNING]
            if len(a) > 0:
                turning += dot(row, a)
            push = read_joint(reals, integers, joint.joint).rotor * turning - state.effort[PUSH]
            for i in range(n):
                out[i] += row[i] * push
        if len(joint.spring) > 0:
            push_bushing(read_loop_state(scratch, integers, loops.states + number * LOOP_STATE), out)
        if joint.gyration.real != 0.0:
            gyrate(joint, read_loop_state(scratch, integers, loops.states + number * LOOP_STATE), out)


@part
def _rub(loops: Loops, reals: Array, integers: IntArray, scratch: Array, y: Array, v: Array, out: Array) -> None:
    """Add friction of joints of the tree that may stick."""
    room = read_loop_room(scratch, integers, loops.room)
    for number in range(loops.gripped):
        joint = read_gripped_joint(reals, integers, loops.grips + number * GRIPPED_JOINT)
        at = joint.place
        room.gripped[number, 0], room.gripped[number, 1] = v[at], y[at]
        out[at] -= grip_force(joint.grip, y[at], v[at])


@kernel(contract.RESIDUAL, counted=False)
def forces(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """`closure`, and M a - f of the tree with what acts along closing joints; an empty ``a`` stands for zeros."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    call_closure(loops.closure, reals, integers, scratch, t, y, v)
    call_residual(loops.residual, reals, integers, scratch, t, y, v, a, out)
    if loops.active:
        _push_closing(loops, reals, integers, scratch, a, out)
    _rub(loops, reals, integers, scratch, y, v, out)
    still_forces(read_loop_room(scratch, integers, loops.room).held, a, out)


@part
def add_outer(row: Array, factor: float, out: Array) -> None:
    """Add the factor times the row's product with itself."""
    for i in range(len(row)):
        weight, line = factor * row[i], out[i]
        for j in range(len(row)):
            line[j] += weight * row[j]


@part
def _add_rotors(loops: Loops, reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    for number in range(loops.loops):
        joint = read_closing_joint(reals, integers, loops.first + number * CLOSING_JOINT)
        if joint.joint >= 0:
            moves = read_loop_state(scratch, integers, loops.states + number * LOOP_STATE).moves
            add_outer(moves[joint.along, : len(out)], read_joint(reals, integers, joint.joint).rotor, out)


@kernel(contract.MASS_MATRIX, counted=False)
def masses(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """Mass matrix with the rotors in closing joints; `closure` at this place comes first."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    call_mass_matrix(loops.mass_matrix, reals, integers, scratch, t, y, out)
    if loops.rotors:
        _add_rotors(loops, reals, integers, scratch, out)
    still_matrix(read_loop_room(scratch, integers, loops.room).held, 1.0, out)


@part
def _add_gains(
    loops: Loops, reals: Array, integers: IntArray, scratch: Array, t: float, n: int, k: Array, c: Array
) -> None:
    for number in range(loops.loops):
        joint = read_closing_joint(reals, integers, loops.first + number * CLOSING_JOINT)
        if joint.joint >= 0:
            state = read_loop_state(scratch, integers, loops.states + number * LOOP_STATE)
            row, found = state.moves[joint.along, :n], state.effort
            acting = read_joint(reals, integers, joint.joint)
            feed = fed(scratch, integers, joint, found[RATE])
            stiffness, damping = gains(acting, reals, integers, t, found[COORDINATE], found[RATE], feed)
            if len(joint.grip) > 0:
                held, damped = grip_gains(joint.grip, found[RATE])
                stiffness, damping = stiffness + held, damping + damped
            if joint.gyration.real != 0.0:
                gyration_gains(joint, state, stiffness, damping, k, c)
            else:
                add_outer(row, stiffness, k)
                add_outer(row, damping, c)
        elif len(joint.spring) > 0:
            state = read_loop_state(scratch, integers, loops.states + number * LOOP_STATE)
            bushing_gains(joint, state, k, c)
        elif joint.gyration.real != 0.0:
            state = read_loop_state(scratch, integers, loops.states + number * LOOP_STATE)
            gyration_gains(joint, state, 0.0, 0.0, k, c)


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def matrices(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """M into the room, stiffness and damping of the tree, with what acts along closing joints."""
    loops = read_loops(reals, integers, integers[len(integers) - 1])
    room = read_loop_room(scratch, integers, loops.room)
    call_masses(loops.masses, reals, integers, scratch, t, y, room.mass)
    call_stiffness_and_damping(loops.stiffness_and_damping, reals, integers, scratch, t, y, v, k, c)
    if loops.active:
        _add_gains(loops, reals, integers, scratch, t, len(v), k, c)
    for number in range(loops.gripped):
        joint = read_gripped_joint(reals, integers, loops.grips + number * GRIPPED_JOINT)
        held, damped = grip_gains(joint.grip, v[joint.place])
        k[joint.place, joint.place] += held
        c[joint.place, joint.place] += damped
    still_matrix(room.held, 0.0, k)
    still_matrix(room.held, 0.0, c)

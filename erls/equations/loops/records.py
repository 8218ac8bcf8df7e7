"""Closed loops over any tree of links, as records behind those of the tree.

The last entry of ``integers`` is the place of a `Loops`. The tree is known by its functions alone, whose addresses
stand there (`erls.maths.calls`). n independent coordinates; N of them and of prescribed joints, which come last; m
conditions, of which r are in use.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from erls.equations import compiled_system as contract
from erls.maths.calls import caller
from erls.maths.jit import ENABLED
from erls.maths.records import Indices, Matrix, Stack, Vector, python_reader, reader, table_size
from erls.maths.so3 import Array

CLOSURE: Any = None
if ENABLED:
    from numba import types as _t

    CLOSURE = _t.void(contract.REALS, contract.INTEGERS, contract.REALS, _t.float64, contract.REALS, contract.REALS)

# one for each function, so that they can be exchanged one by one (`erls.maths.jit.any_scalar`)
call_closure, call_frames = caller(CLOSURE), caller(contract.FRAMES)
call_residual, call_forces = caller(contract.RESIDUAL), caller(contract.RESIDUAL)
call_mass_matrix, call_masses = caller(contract.MASS_MATRIX), caller(contract.MASS_MATRIX)
call_stiffness_and_damping = caller(contract.STIFFNESS_AND_DAMPING)
call_matrices = caller(contract.STIFFNESS_AND_DAMPING)

COORDINATE, RATE, TURNING, PUSH = range(4)  # of `LoopState.effort`


class Loops(NamedTuple):
    """All loops.

    Attributes
    ----------
    loops, conditions, kept : int
        How many; m; r.
    gripped, grips : int
        Joints of the tree that may stick, where closing joints do; place of the first `GrippedJoint`, or -1.
    active, rotors : int
        Whether forces or rotors, and whether rotors act along closing joints.
    first, states, room : int
        Places of the first `ClosingJoint` and `LoopState`, and of the `LoopRoom`.
    frames, residual, mass_matrix, stiffness_and_damping : int
        Addresses of the functions of the tree.
    closure, forces, masses, matrices : int
        Addresses of those of `erls.equations.loops.closure` and `erls.equations.loops.actuated`.
    reach, decay, open : float
        Size of the mechanism [m]; decay of what conditions are violated by [1/s]; what a loop that has come apart is
        open by [m].
    metres : (n,) array
        Per unit of each coordinate.
    scales : (m,) array
        Metres per unit of each condition.
    used : (m,) int array
        Number of each condition among those in use, -1 when left out.
    joints, motions : (c,) int arrays
        Places in y of the coordinates that tell how often closing joints have turned, -1 where one is prescribed: then
        place of its curve.
    """

    loops: int
    conditions: int
    kept: int
    gripped: int
    grips: int
    active: int
    rotors: int
    first: int
    states: int
    room: int
    frames: int
    residual: int
    mass_matrix: int
    stiffness_and_damping: int
    closure: int
    forces: int
    masses: int
    matrices: int
    reach: float
    decay: float
    open: float
    metres: Vector
    scales: Vector
    used: Indices
    joints: Indices
    motions: Indices


class ClosingJoint(NamedTuple):
    """Constants of a loop.

    Attributes
    ----------
    outer, inner : int
        Rows of the frames that the tree moves; -1 for the ground.
    first : int
        Number of its first condition.
    motion : int
        Place of the curve that prescribes its coordinate, -1 without.
    along : int
        Component of the twist that the coordinate moves, -1 without.
    joint : int
        Place of the `erls.equations.serial.records.Joint` whose forces act along it, -1 without.
    feeding : int
        Place of the `erls.equations.serial.records.JointState` whose feed-forward acts as well, -1 without.
    zero : float
        Coordinate where the frames coincide.
    pitch : float
        How far its coordinate, an angle, advances [m/rad].
    turned : float
        Σ signs · joint coordinates at the start.
    signs : (c,) array
        By which these add to its own turns; those of a screw are told by how far it has advanced.
    ground : (2, 12) array
        Poses of the outer and the inner frame where they stand on the ground.
    lines, entries, pitches : (c, 3), (c, 3, 3), (c,) arrays
        Conditions c · p + ⟨C, Q⟩ - h ψ(Q) = 0 on place p and rotation Q of the outer frame in the inner one, less what
        is prescribed.
    grip : (9,) array
        Friction along it that may stick, as in `erls.maths.contact_law`; empty without.
    offset : float
        Of a coupling: of the coordinate that follows.
    factors : (f,) array
        Of a coupling what it changes by per unit of each coordinate; empty of a joint.
    columns, curves, others : (f,) int arrays
        Place of each coordinate among velocities and prescribed rates; of its curve, -1 unless it is prescribed; number
        of the closing joint whose coordinate it is, -1 of joints of the tree.
    """

    outer: int
    inner: int
    first: int
    motion: int
    along: int
    joint: int
    feeding: int
    zero: float
    pitch: float
    turned: float
    signs: Vector
    ground: Matrix
    lines: Matrix
    entries: Stack
    pitches: Vector
    grip: Vector
    offset: float
    factors: Vector
    columns: Indices
    curves: Indices
    others: Indices


class GrippedJoint(NamedTuple):
    """A joint of the tree that may stick.

    Attributes
    ----------
    place : int
        Of its coordinate.
    grip : (9,) array
        Friction along it, as of `ClosingJoint`.
    """

    place: int
    grip: Vector


class LoopState(NamedTuple):
    """Motion of a loop, in the axes of the outer frame.

    Attributes
    ----------
    pose, twist, twist_rate : (12,), (6,), (6,) arrays
        Of the outer frame in the inner one; the derivative at zero accelerations.
    left, left_twist, left_rate : (12,), (6,), (6,) arrays
        The same beside what is prescribed.
    moves : (6, N) array
        Twist over velocities.
    gradients : (c, 6) array
        Of conditions over the twist.
    effort : (4,) array
        Coordinate, rate, its derivative at zero accelerations, force along it.
    spare : (6,) array
    """

    pose: Vector
    twist: Vector
    twist_rate: Vector
    left: Vector
    left_twist: Vector
    left_rate: Vector
    moves: Matrix
    gradients: Matrix
    effort: Vector
    spare: Vector


class LoopRoom(NamedTuple):
    """Working memory.

    Attributes
    ----------
    frames : (ends, 24 + 6 N) array
        Of the tree, see `erls.equations.compiled_system`.
    violation, rate, bias : (m,) arrays
        Φ, Φ̇, and Φ̈ at zero accelerations.
    gradient : (r, n) array
        Φ_y of the conditions in use.
    mass, factor, damping : (n, n) arrays
        M, its factor U, and room.
    spread, loads, carried : (r, n) arrays
        Zᵀ = (U⁻ᵀ Φ_yᵀ)ᵀ, and room.
    flexible : (r, r) array
        ZᵀZ and its factor.
    reduced, multipliers : (n,), (r,) arrays
        z = U⁻ᵀ f, and λ.
    wrong : (r,) array
        Room.
    held : (n,) array
        1 of coordinates that do not move (`erls.equations.switches`), 0 of others: set from outside.
    gripped : (g, 2) array
        Rate and coordinate of every `GrippedJoint`.
    """

    frames: Matrix
    violation: Vector
    rate: Vector
    bias: Vector
    gradient: Matrix
    mass: Matrix
    factor: Matrix
    damping: Matrix
    spread: Matrix
    loads: Matrix
    carried: Matrix
    flexible: Matrix
    reduced: Vector
    multipliers: Vector
    wrong: Vector
    held: Vector
    gripped: Matrix


def loop_state(columns: int, conditions: int) -> LoopState:
    """Memory for a loop."""
    pose, left = np.zeros(12), np.zeros(12)
    six = [np.zeros(6) for _ in range(5)]
    moves, gradients = np.zeros((6, columns)), np.zeros((conditions, 6))
    return LoopState(pose, six[0], six[1], left, six[2], six[3], moves, gradients, np.zeros(4), six[4])


def room(ends: int, columns: int, n: int, m: int, r: int, gripped: int) -> LoopRoom:
    """Memory for all."""

    def square() -> Array:
        return np.zeros((n, n))

    def rows() -> Array:
        return np.zeros((r, n))

    return LoopRoom(
        frames=np.zeros((ends, 24 + 6 * columns)),
        violation=np.zeros(m),
        rate=np.zeros(m),
        bias=np.zeros(m),
        gradient=rows(),
        mass=square(),
        factor=square(),
        damping=square(),
        spread=rows(),
        loads=rows(),
        carried=rows(),
        flexible=np.zeros((r, r)),
        reduced=np.zeros(n),
        multipliers=np.zeros(r),
        wrong=np.zeros(r),
        held=np.zeros(n),
        gripped=np.zeros((gripped, 2)),
    )


read_loops, read_loop_room = reader(Loops), reader(LoopRoom)
read_closing_joint, read_loop_state = reader(ClosingJoint), reader(LoopState)
read_gripped_joint = reader(GrippedJoint)
see_loops = python_reader(Loops)
CLOSING_JOINT, LOOP_STATE = table_size(ClosingJoint), table_size(LoopState)
GRIPPED_JOINT = table_size(GrippedJoint)

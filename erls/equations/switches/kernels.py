"""Equations of motion of a tree some of whose joints stick, over those of the tree without this friction.

Functions of the tree are called by address, so that this is compiled once for all systems. Which coordinates do not
move is flagged (`erls.equations.switches.still`).
"""

from __future__ import annotations

from typing import NamedTuple

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import call_mass_matrix, call_residual, call_stiffness_and_damping
from erls.equations.switches.still import still_forces, still_matrix
from erls.maths.dense import backward, cholesky, forward
from erls.maths.jit import kernel
from erls.maths.records import Indices, Matrix, Vector, reader
from erls.maths.so3 import Array
from fe_import.model import IntArray

_SINGULAR = 1e-14  # inertia of a coordinate against what it was before the elimination of those before it


class Frictions(NamedTuple):
    """Constants; the last of the integers of a system is the place of this record.

    Attributes
    ----------
    residual, mass_matrix, stiffness_and_damping : int
        Addresses of the functions of the system without this friction.
    room : int
        Place of the `Room`.
    places : (m,) int array
        Coordinates of the joints.
    sliding : (m,) array
        Friction of each while it slides [N m or N].
    """

    residual: int
    mass_matrix: int
    stiffness_and_damping: int
    room: int
    places: Indices
    sliding: Vector


class Room(NamedTuple):
    """Working memory.

    Attributes
    ----------
    held : (n,) array
        1 of coordinates that do not move, 0 of others: set from outside.
    modes : (m,) array
        1 of a joint that slides on, -1 of one that slides back, 0 of one that sticks: set from outside.
    mass : (n, n) array
    """

    held: Vector
    modes: Vector
    mass: Matrix


read_frictions, read_room = reader(Frictions), reader(Room)


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M a - f, see `erls.equations.compiled_system`; of a joint that sticks, a_k."""
    own = read_frictions(reals, integers, integers[len(integers) - 1])
    call_residual(own.residual, reals, integers, scratch, t, y, v, a, out)
    room = read_room(scratch, integers, own.room)
    for k in range(len(room.modes)):
        out[own.places[k]] += room.modes[k] * own.sliding[k]
    still_forces(room.held, a, out)


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M, with the unit matrix in rows and columns of joints that stick."""
    own = read_frictions(reals, integers, integers[len(integers) - 1])
    call_mass_matrix(own.mass_matrix, reals, integers, scratch, t, y, out)
    still_matrix(read_room(scratch, integers, own.room).held, 1.0, out)


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, stiffness: Array, damping: Array
) -> None:
    """K and C, with zeros in rows and columns of joints that stick."""
    own = read_frictions(reals, integers, integers[len(integers) - 1])
    call_stiffness_and_damping(own.stiffness_and_damping, reals, integers, scratch, t, y, v, stiffness, damping)
    held = read_room(scratch, integers, own.room).held
    still_matrix(held, 0.0, stiffness)
    still_matrix(held, 0.0, damping)


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f."""
    own = read_frictions(reals, integers, integers[len(integers) - 1])
    factor = read_room(scratch, integers, own.room).mass
    mass_matrix(reals, integers, scratch, t, y, factor)
    residual(reals, integers, scratch, t, y, v, y[:0], out)
    status = cholesky(factor, _SINGULAR)
    if status == 0:
        for i in range(len(out)):
            out[i] = -out[i]
        forward(factor, out)
        backward(factor, out)
    return int(status)

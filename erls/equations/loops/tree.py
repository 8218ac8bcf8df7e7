"""The chain with forces and rotors along the coordinates of closing joints."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import balance, composite
from erls.equations.erls import layout as chain
from erls.equations.loops import layout as at
from erls.equations.loops.closure import closure
from erls.equations.serial import gains
from erls.equations.serial.drives import gains as gains_of
from erls.maths.dense import dot
from erls.maths.jit import kernel, part


@kernel(contract.RESIDUAL, counted=False)
def forces(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """`closure`, and M a - f of the chain with what acts along closing joints; as in it, ``a`` may be empty."""
    closure(reals, integers, scratch, t, y, v)
    balance.residual(reals, integers, scratch, t, y, v, a, out)
    n = len(y)
    if not at.place(integers, at.ACTIVE):
        return
    for number in range(at.place(integers, at.LOOPS)):
        record = integers[at.place(integers, at.RECORDS) + at.RECORD * number + at.ACTS]
        if record >= 0:
            place = at.place(integers, at.EFFORTS) + number * (n + at.EFFORT)
            row, found = scratch[place : place + n], scratch[place + n : place + n + at.EFFORT]
            turning = found[at.TURNING]
            if len(a) > 0:
                turning += dot(row, a)
            push = reals[integers[record + chain.FORCES] + chain.ROTOR] * turning - found[at.PUSH]
            for i in range(n):
                out[i] += row[i] * push


@part
def add_outer(row: Array, factor: float, out: Array) -> None:
    """Add the factor times the row's product with itself."""
    for i in range(len(row)):
        weight, line = factor * row[i], out[i]
        for j in range(len(row)):
            line[j] += weight * row[j]


@kernel(contract.MASS_MATRIX, counted=False)
def masses(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """Mass matrix with the rotors in closing joints; `closure` at this place comes first."""
    composite.mass_matrix(reals, integers, scratch, t, y, out)
    n = len(y)
    if not at.place(integers, at.ROTORS):
        return
    for number in range(at.place(integers, at.LOOPS)):
        record = integers[at.place(integers, at.RECORDS) + at.RECORD * number + at.ACTS]
        if record >= 0:
            place = at.place(integers, at.EFFORTS) + number * (n + at.EFFORT)
            rotor = reals[integers[record + chain.FORCES] + chain.ROTOR]
            add_outer(scratch[place : place + n], rotor, out)


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def matrices(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """MASS, stiffness and damping of the chain, with what acts along closing joints; `closure` here comes first."""
    n = len(y)
    masses(reals, integers, scratch, t, y, scratch[at.span(integers, at.MASS, n * n)].reshape(n, n))
    gains.stiffness_and_damping(reals, integers, scratch, t, y, v, k, c)
    if not at.place(integers, at.ACTIVE):
        return
    for number in range(at.place(integers, at.LOOPS)):
        record = integers[at.place(integers, at.RECORDS) + at.RECORD * number + at.ACTS]
        if record >= 0:
            place = at.place(integers, at.EFFORTS) + number * (n + at.EFFORT)
            stiffness, damping = gains_of(reals, integers, record, scratch[place + n + at.RATE])
            joint = integers[record + chain.FORCES]
            if abs(scratch[place + n + at.WANTED]) > reals[joint + chain.LIMIT]:  # the motor gives no more
                stiffness -= reals[joint + chain.GAIN]
                damping -= reals[joint + chain.RATE_GAIN]
            add_outer(scratch[place : place + n], stiffness, k)
            add_outer(scratch[place : place + n], damping, c)

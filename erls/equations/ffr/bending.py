"""Second-order displacements ½ ηᵀ Ψ η of a link: of its interface nodes and of its momenta.

Formulas of `erls.equations.ffr.interface_motion` and `erls.equations.ffr.second_order`.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.ffr import layout as at
from erls.equations.ffr.rows import add_rows, vector
from erls.equations.serial.linear import add_columns
from erls.maths.jit import part


@part
def bend(reals: Array, integers: IntArray, scratch: Array, record: int, q: Array) -> None:
    """BENDING and SPUN of a link, and S and ½ ηᵀ W η of its BLOCK."""
    e, memory, count = len(q), integers[record + at.MEMORY], integers[record + at.BENT]
    start, spun = vector(memory, e, at.BENDING), vector(memory, e, at.SPUN)
    rows, spinning = scratch[start : start + count * e], scratch[spun : spun + 9 * e]
    rows[:] = 0.0
    spinning[:] = 0.0
    add_columns(reals, integers[record + at.BEND], count * e, q, e, 1.0, rows)
    add_columns(reals, integers[record + at.SPIN], 9 * e, q, e, 1.0, spinning)
    block = scratch[memory + at.BLOCK : memory + at.BLOCK + 12]
    block[:] = 0.0
    add_rows(rows, 0, q, 0.5, block[:3])
    add_rows(spinning, 0, q, 0.5, block[3:])


@part
def bend_rates(reals: Array, integers: IntArray, scratch: Array, record: int, rates: Array) -> None:
    """BENDING_RATE of a link, and the rates of its BLOCK."""
    e, memory, count = len(rates), integers[record + at.MEMORY], integers[record + at.BENT]
    start = vector(memory, e, at.BENDING_RATE)
    rows = scratch[start : start + count * e]
    rows[:] = 0.0
    add_columns(reals, integers[record + at.BEND], count * e, rates, e, 1.0, rows)
    block = scratch[memory + at.BLOCK + 12 : memory + at.BLOCK + 24]
    block[:] = 0.0
    add_rows(scratch, vector(memory, e, at.BENDING), rates, 1.0, block[:3])
    add_rows(scratch, vector(memory, e, at.SPUN), rates, 1.0, block[3:])


@part
def outer_slope(integers: IntArray, record: int, number: int) -> tuple[int, int]:
    """Where rows of the outboard node start in BENDING or BENDING_RATE, and how many numbers they are."""
    e = integers[record + at.MODES]
    return vector(integers[record + at.MEMORY], e, number + 6), 6 * e if integers[record + at.BEND] >= 0 else 0


@part
def inner_slope(integers: IntArray, record: int, number: int) -> tuple[int, int]:
    """The same of the inboard node: the last rows."""
    e = integers[record + at.MODES]
    start = vector(integers[record + at.MEMORY], e, number + integers[record + at.BENT] - 6)
    return start, 6 * e if integers[record + at.BEND] >= 0 else 0

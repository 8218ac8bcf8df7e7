"""Right sides of equations solved link by link, after `erls.equations.erls.elimination`: inward, and back."""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.forces import vector
from erls.equations.erls.inertia import carry9, carry9_back
from erls.equations.serial.linear import add_columns, dot, rows_times
from erls.maths.jit import part


@part
def _collect(
    reals: Array, integers: IntArray, work: Array, blocks: Array, block: int, record: int, last: bool, b: Array
) -> None:
    """LOADING of a link by the forces on its elastic coordinates, in ``b``, and by PASSED.

    RELAXED gets what they make of z, as if nothing else moved.
    """
    e = integers[record + at.MODES]
    n = 6 + e
    memory, axes, axis = integers[record + at.MEMORY], integers[record + at.AXES], integers[record + at.AXIS]
    first, towards = integers[record + at.FIRST_MODE], block + at.towards(e)
    link = work[memory : memory + at.VECTORS]
    loading, passed = link[at.LOADING : at.LOADING + 9], link[at.PASSED : at.PASSED + 9]
    start = vector(memory, n, at.RELAXED)
    relaxed = work[start : start + e]
    loading[:] = 0.0
    relaxed[:] = 0.0
    add_columns(reals, integers[record + at.BASIS], e, b[first : first + e], e, 1.0, relaxed)
    for i in range(6):
        loading[i] += dot(blocks[towards + i * e : towards + (i + 1) * e], relaxed, 0, e)
    if integers[at.FIRST_ORDER]:
        for a in range(axes):
            start = vector(memory, n, at.COLUMN + a)
            load = dot(work[start : start + e], relaxed, 0, e)
            for j in range(3):
                loading[6 + j] += load * reals[axis + 3 * a + j]
    for i in range(e):
        relaxed[i] *= blocks[block + i]
    if last:
        return
    share, outward = block + at.out_share(e), integers[record + at.OUT_BASIS]
    square, free = link[at.SQUARE : at.SQUARE + 72], link[at.OUTPUT_FREE : at.OUTPUT_FREE + 6]
    given = link[at.GIVEN : at.GIVEN + 6]
    for i in range(6):
        total = 0.0
        for j in range(e):
            total += reals[outward + 6 * j + i] * relaxed[j]
        for m in range(6):
            total -= blocks[share + 6 * i + m] * passed[m]
        given[i] = total
    for i in range(6):
        total = 0.0
        for m in range(6):
            total += square[12 * i + 6 + m] * given[m]
        free[i] = total
    for i in range(9):
        for m in range(6):
            passed[i] += link[at.BORNE + 9 * i + m] * free[m]
        loading[i] += passed[i]
    for m in range(6):
        for i in range(9):
            loading[i] -= link[at.BOUND + 9 * m + i] * passed[m]


@part
def _move_link(reals: Array, integers: IntArray, work: Array, blocks: Array, block: int, k: int, b: Array) -> None:
    """Joint and elastic accelerations of a link whose predecessor's are known."""
    record = at.HEADER + k * at.RECORD
    e, first = integers[record + at.MODES], integers[record + at.FIRST_MODE]
    memory, axes, axis = integers[record + at.MEMORY], integers[record + at.AXES], integers[record + at.AXIS]
    link = work[memory : memory + at.VECTORS]
    move = link[at.MOVE : at.MOVE + 9]
    if k == 0:
        move[:] = 0.0
    else:
        start = integers[record - at.RECORD + at.MEMORY]
        before = work[start : start + at.VECTORS]
        for i in range(9):  # of the interface
            move[i] = before[at.MOVE + i]
        for i in range(6):
            move[i] += before[at.OUTPUT_FREE + i]
            for j in range(9):
                move[i] += before[at.OUTPUT + 9 * i + j] * before[at.MOVE + j]
        carry9(link, link, at.MOVE, link, at.MOVE)
    joint = integers[record + at.JOINT]
    if joint >= 0:
        left = b[joint]
        for i in range(9):
            left -= link[at.PULL + i] * move[i]
        left /= link[at.EFFECTIVE]
        b[joint] = left
        for i in range(9):
            move[i] += link[at.PATH + i] * left
    start, towards = vector(memory, 6 + e, at.RELAXED), block + at.towards(e)
    z = work[start : start + e]
    for i in range(6):
        row = blocks[towards + i * e : towards + (i + 1) * e]
        for j in range(e):
            z[j] -= move[i] * row[j]
    if integers[at.FIRST_ORDER]:
        for a in range(axes):
            turn = 0.0
            for i in range(3):
                turn += reals[axis + 3 * a + i] * move[6 + i]
            start = vector(memory, 6 + e, at.COLUMN + a)
            column = work[start : start + e]
            for j in range(e):
                z[j] -= turn * column[j]
    if k + 1 < integers[at.LINKS]:
        lead = block + at.out_towards(e)
        for i in range(6):  # f_w: what the links after it put on the interface
            load = link[at.PASSED + i]
            for j in range(9):
                load += link[at.PRODUCT + 9 * i + j] * move[j]
            row = blocks[lead + i * e : lead + (i + 1) * e]
            for j in range(e):
                z[j] -= load * row[j]
    rows_times(reals, integers[record + at.BASIS], e, z, b[first : first + e])


@part
def substitute(reals: Array, integers: IntArray, work: Array, blocks: Array, which: int, b: Array) -> None:
    """Replace ``b`` by the solution, after `eliminate`."""
    links = integers[at.LINKS]
    for k in range(links - 1, -1, -1):
        record = at.HEADER + k * at.RECORD
        memory, joint = integers[record + at.MEMORY], integers[record + at.JOINT]
        link = work[memory : memory + at.VECTORS]
        _collect(reals, integers, work, blocks, integers[record + which], record, k + 1 == links, b)
        if joint >= 0:
            left = b[joint]
            for i in range(9):
                left -= link[at.LOADING + i] * link[at.PATH + i]
            b[joint] = left
            if k > 0:
                for i in range(9):
                    link[at.LOADING + i] += link[at.PULL + i] * (left / link[at.EFFECTIVE])
        if k > 0:
            start = integers[record - at.RECORD + at.MEMORY]
            carry9_back(link, link, at.LOADING, 1, work[start : start + at.VECTORS], at.PASSED, 1)
    for k in range(links):
        block = integers[at.HEADER + k * at.RECORD + which]
        _move_link(reals, integers, work, blocks, block, k, b)

"""The elastic blocks M_ee + α C + β K of all links, in coordinates in which they are diagonal, and what follows."""

from __future__ import annotations

from typing import Any

from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.maths.jit import part


@part
def _rows(matrix: Array, start: int, block: int, e: int, factors: Array, out: int) -> None:
    """(6, e) a matrix, column after column, times D⁻¹."""
    for i in range(6):
        for j in range(e):
            factors[out + i * e + j] = matrix[start + 6 * j + i] * factors[block + j]


@part
def _share(rows: int, matrix: Array, start: int, e: int, factors: Array, out: int) -> None:
    """(6, 6) such rows times the transpose of another matrix."""
    for i in range(6):
        for j in range(6):
            factors[out + 6 * i + j] = 0.0
        for m in range(e):
            weight = factors[rows + i * e + m]
            for j in range(6):
                factors[out + 6 * i + j] += weight * matrix[start + 6 * m + j]


@part
def shift(reals: Array, integers: IntArray, alpha: Any, beta: Any, factors: Array) -> int:
    """Blocks for these numbers; 0, or 1 + the number of a coordinate whose motion nothing resists."""
    for k in range(integers[at.LINKS]):
        record = at.HEADER + k * at.RECORD
        e, block = integers[record + at.MODES], integers[record + at.SHIFTED]
        stiffness, damping = integers[record + at.BASIS_STIFFNESS], integers[record + at.BASIS_DAMPING]
        for i in range(e):
            whole = 1.0 + alpha * reals[damping + i] + beta * reals[stiffness + i]
            if not whole.real > 0.0:
                return int(integers[record + at.FIRST_MODE] + i + 1)
            factors[block + i] = 1.0 / whole
        out, rigid = integers[record + at.OUT_BASIS], integers[record + at.RIGID_BASIS]
        towards, out_towards = block + at.towards(e), block + at.out_towards(e)
        _rows(reals, rigid, block, e, factors, towards)
        _rows(reals, out, block, e, factors, out_towards)
        _share(towards, reals, rigid, e, factors, block + at.rigid_share(e))
        _share(out_towards, reals, rigid, e, factors, block + at.cross_share(e))
        _share(out_towards, reals, out, e, factors, block + at.out_share(e))
    return 0

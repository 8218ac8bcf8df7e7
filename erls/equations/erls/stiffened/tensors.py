"""Products of stacks of matrices and of quadratic forms with a vector, on pieces of flat arrays."""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.maths.jit import part, reordered


@reordered
def add_stack(stack: Array, at: int, size: int, x: Array, of: int, count: int, out: Array, to: int) -> None:
    """Add to ``size`` numbers of out the columns of a stack times entries of x; each from the place after its array."""
    result, j = out[to : to + size], 0
    while j + 4 <= count:  # four at once: out is read and written once
        a, b, c, d = x[of + j], x[of + j + 1], x[of + j + 2], x[of + j + 3]
        start = at + j * size
        p, q = stack[start : start + size], stack[start + size : start + 2 * size]
        r, s = stack[start + 2 * size : start + 3 * size], stack[start + 3 * size : start + 4 * size]
        for i in range(size):
            result[i] += (a * p[i] + b * q[i]) + (c * r[i] + d * s[i])
        j += 4
    while j < count:
        start = at + j * size
        column, a = stack[start : start + size], x[of + j]
        for i in range(size):
            result[i] += a * column[i]
        j += 1


@reordered
def add_three(
    stack: Array, at: int, size: int, x: Array, of: int, count: int, weights: Array, place: int, out: Array, to: int
) -> None:
    """Add to ``size`` numbers of out Σ_a weights_a A_a x, of three matrices with columns of that size."""
    result, a, b, c = out[to : to + size], weights[place], weights[place + 1], weights[place + 2]
    for j in range(count):
        start = at + 3 * j * size
        p, q = stack[start : start + size], stack[start + size : start + 2 * size]
        r, u, v, w = stack[start + 2 * size : start + 3 * size], a * x[of + j], b * x[of + j], c * x[of + j]
        for i in range(size):
            result[i] += u * p[i] + v * q[i] + w * r[i]


@reordered
def product(x: Array, at: int, y: Array, of: int, count: int) -> float:
    """Of ``count`` entries each."""
    a, b, total = x[at : at + count], y[of : of + count], 0.0
    for i in range(count):
        total += a[i] * b[i]
    return total


@part
def clear(x: Array, at: int, count: int) -> None:
    """Zeros."""
    for i in range(count):
        x[at + i] = 0.0


@part
def set_pairs(x: Array, at: int, count: int, out: Array, to: int) -> None:
    """Products of entries of x, those of the last ones first."""
    for i in range(count - 1, -1, -1):
        for j in range(i, count):
            out[to + j - i] = x[at + i] * x[at + j]
        to += count - i


@part
def add_forms(forms: Array, at: int, count: int, size: int, pairs: Array, of: int, out: Array, to: int) -> None:
    """Add to ``count`` numbers of out the forms from ``at``, of a vector of that size with these products."""
    products = size * (size + 1) // 2
    for k in range(count):
        out[to + k] += product(forms, at + k * products, pairs, of, products)


@part
def add_cross(x: Array, at: int, y: Array, of: int, factor: float, out: Array, to: int) -> None:
    """Add ``factor`` times the cross product of two vectors (3,)."""
    out[to] += factor * (x[at + 1] * y[of + 2] - x[at + 2] * y[of + 1])
    out[to + 1] += factor * (x[at + 2] * y[of] - x[at] * y[of + 2])
    out[to + 2] += factor * (x[at] * y[of + 1] - x[at + 1] * y[of])


@reordered
def add_rows(
    x: Array, at: int, stride: int, rows: int, weights: Array, of: int, step: int, out: Array, to: int, count: int
) -> None:
    """Add to ``count`` numbers of out the sum of rows of x, a multiple of three, times weights ``step`` apart."""
    result = out[to : to + count]
    for k in range(0, rows, 3):
        start, place = at + k * stride, of + k * step
        p, q = x[start : start + count], x[start + stride : start + stride + count]
        r, a = x[start + 2 * stride : start + 2 * stride + count], weights[place]
        b, c = weights[place + step], weights[place + 2 * step]
        for i in range(count):
            result[i] += a * p[i] + b * q[i] + c * r[i]

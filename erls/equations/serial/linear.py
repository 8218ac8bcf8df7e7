"""Small linear algebra on pieces of flat arrays."""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.maths.jit import part, reordered


@part
def add_columns(matrix: Array, at: int, size: int, x: Array, count: int, factor: float, out: Array) -> None:
    """Add to out (size,) the factor times a matrix (size, count), column after column from ``at``, times x."""
    for j in range(count):
        column = matrix[at + j * size : at + (j + 1) * size]
        weight = factor * x[j]
        for i in range(size):
            out[i] += weight * column[i]


@reordered
def rows_times(matrix: Array, at: int, size: int, x: Array, out: Array) -> None:
    """out (size,) is a square matrix, row after row from ``at``, times x."""
    for i in range(size):
        row = matrix[at + i * size : at + (i + 1) * size]
        total = 0.0
        for j in range(size):
            total += row[j] * x[j]
        out[i] = total


@reordered
def add_symmetric(matrix: Array, at: int, size: int, x: Array, start: int, out: Array) -> None:
    """Add to out (size,) a symmetric matrix times x (size,) whose entries before ``start`` are zero.

    Of the matrix half is read: what lies on and below the diagonal of columns from ``at``.
    """
    for j in range(start):
        column = matrix[at + j * size : at + (j + 1) * size]
        total = 0.0
        for i in range(start, size):
            total += column[i] * x[i]
        out[j] += total
    for j in range(start, size):
        below, rest, result = matrix[at + j * size + j + 1 : at + (j + 1) * size], x[j + 1 : size], out[j + 1 : size]
        weight = x[j]
        total = weight * matrix[at + j * size + j]
        for i in range(len(below)):  # from 0: otherwise it is not done on several numbers at once
            total += below[i] * rest[i]
            result[i] += weight * below[i]
        out[j] += total


@reordered
def pass_columns(
    matrix: Array, at: int, size: int, start: int, x: Array, y: Array, out_x: Array, out_y: Array, s: Array, back: Array
) -> None:
    """Add X x to out_x, X y to out_y and -Xᵀ s to back, reading the square matrix X once, from column ``start`` on."""
    for j in range(start, size):
        column = matrix[at + j * size : at + (j + 1) * size]
        p, q, total = x[j], y[j], 0.0
        for i in range(size):
            total += column[i] * s[i]
            out_x[i] += p * column[i]
            out_y[i] += q * column[i]
        back[j] -= total


@part
def add_transposed(matrix: Array, at: int, size: int, x: Array, count: int, out: Array) -> None:
    """Add to out (count,) the transpose of a matrix (size, count), column after column from ``at``, times x."""
    for j in range(count):
        total = 0.0
        for i in range(size):
            total += matrix[at + j * size + i] * x[i]
        out[j] += total


@part
def dot(x: Array, y: Array, start: int, size: int) -> float:
    """Product of x[start:size] and y[start:size]; four partial sums, which run beside each other."""
    a = b = c = d = 0.0
    i = start
    while i + 4 <= size:
        a += x[i] * y[i]
        b += x[i + 1] * y[i + 1]
        c += x[i + 2] * y[i + 2]
        d += x[i + 3] * y[i + 3]
        i += 4
    while i < size:
        a += x[i] * y[i]
        i += 1
    return (a + b) + (c + d)


@part
def carry(link: Array, x: Array, at: int, out: Array, to: int) -> None:
    """T x: a motion of the frame before as one of the link's frame, whose pose starts ``link`` (`layout.TURN`)."""
    x0, x1, x2, w0, w1, w2 = x[at], x[at + 1], x[at + 2], x[at + 3], x[at + 4], x[at + 5]
    p0, p1, p2 = link[9], link[10], link[11]
    v0, v1, v2 = x0 + w1 * p2 - w2 * p1, x1 + w2 * p0 - w0 * p2, x2 + w0 * p1 - w1 * p0
    for i in range(3):
        out[to + i] = link[i] * v0 + link[3 + i] * v1 + link[6 + i] * v2
        out[to + 3 + i] = link[i] * w0 + link[3 + i] * w1 + link[6 + i] * w2


@part
def carry_back(link: Array, f: Array, at: int, out: Array, to: int) -> None:
    """Tᵀ f: a force and moment on the link's frame as those on the frame before."""
    f0, f1, f2, m0, m1, m2 = f[at], f[at + 1], f[at + 2], f[at + 3], f[at + 4], f[at + 5]
    a0 = link[0] * f0 + link[1] * f1 + link[2] * f2
    a1 = link[3] * f0 + link[4] * f1 + link[5] * f2
    a2 = link[6] * f0 + link[7] * f1 + link[8] * f2
    p0, p1, p2 = link[9], link[10], link[11]
    out[to], out[to + 1], out[to + 2] = a0, a1, a2
    out[to + 3] = link[0] * m0 + link[1] * m1 + link[2] * m2 + p1 * a2 - p2 * a1
    out[to + 4] = link[3] * m0 + link[4] * m1 + link[5] * m2 + p2 * a0 - p0 * a2
    out[to + 5] = link[6] * m0 + link[7] * m1 + link[8] * m2 + p0 * a1 - p1 * a0


@part
def add_bracket(x: Array, at: int, y: Array, of: int, factor: float, out: Array, to: int) -> None:
    """Add ``factor`` times the Lie bracket ad(x) y of two motions [v; ω]."""
    v0, v1, v2, a0, a1, a2 = x[at], x[at + 1], x[at + 2], x[at + 3], x[at + 4], x[at + 5]
    y0, y1, y2, b0, b1, b2 = y[of], y[of + 1], y[of + 2], y[of + 3], y[of + 4], y[of + 5]
    out[to] += factor * (a1 * y2 - a2 * y1 + v1 * b2 - v2 * b1)
    out[to + 1] += factor * (a2 * y0 - a0 * y2 + v2 * b0 - v0 * b2)
    out[to + 2] += factor * (a0 * y1 - a1 * y0 + v0 * b1 - v1 * b0)
    out[to + 3] += factor * (a1 * b2 - a2 * b1)
    out[to + 4] += factor * (a2 * b0 - a0 * b2)
    out[to + 5] += factor * (a0 * b1 - a1 * b0)


@part
def add_transport(x: Array, at: int, p: Array, of: int, out: Array, to: int) -> None:
    """Add -ad(x)ᵀ p: what a momentum p in a frame that moves with x adds to its rate."""
    v0, v1, v2, a0, a1, a2 = x[at], x[at + 1], x[at + 2], x[at + 3], x[at + 4], x[at + 5]
    p0, p1, p2, m0, m1, m2 = p[of], p[of + 1], p[of + 2], p[of + 3], p[of + 4], p[of + 5]
    out[to] += a1 * p2 - a2 * p1
    out[to + 1] += a2 * p0 - a0 * p2
    out[to + 2] += a0 * p1 - a1 * p0
    out[to + 3] += a1 * m2 - a2 * m1 + v1 * p2 - v2 * p1
    out[to + 4] += a2 * m0 - a0 * m2 + v2 * p0 - v0 * p2
    out[to + 5] += a0 * m1 - a1 * m0 + v0 * p1 - v1 * p0


@part
def dot6(x: Array, at: int, y: Array, of: int) -> float:
    """Product of six numbers each."""
    return float(
        x[at] * y[of]
        + x[at + 1] * y[of + 1]
        + x[at + 2] * y[of + 2]
        + x[at + 3] * y[of + 3]
        + x[at + 4] * y[of + 4]
        + x[at + 5] * y[of + 5]
    )

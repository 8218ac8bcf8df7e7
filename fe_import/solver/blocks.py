"""Dense steps of an elimination, in place, on columns of matrices: row j of an array is column j of the matrix.

Compiled functions call BLAS and LAPACK; the same names call SciPy's wrappers where nothing is compiled.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import blas, lapack

from fe_import.compiled.fortran import letter, routine
from fe_import.compiled.jit import ENABLED, helper
from fe_import.model import Array

_dpotrf, _dtrtri = routine("cython_lapack", "dpotrf"), routine("cython_lapack", "dtrtri")
_dtrsm, _dsyrk, _dgemm = (routine("cython_blas", name) for name in ("dtrsm", "dsyrk", "dgemm"))
_L, _N, _R, _T = (letter(text) for text in "LNRT")


def _cholesky(square: Array) -> int:
    """L of the lower triangle of a square; not 0 when it is not positive definite."""
    failed = np.zeros(1, dtype=np.int32)
    _dpotrf(_L, len(square), square, square.strides[0] // 8, failed)
    return int(failed[0])


def _invert(triangle: Array) -> None:
    """L⁻¹ for L."""
    failed = np.zeros(1, dtype=np.int32)
    _dtrtri(_L, _N, len(triangle), triangle, triangle.strides[0] // 8, failed)


def _divide(across: Array, triangle: Array) -> None:
    """A L⁻ᵀ for A."""
    rows = across.shape[1]
    _dtrsm(
        _R, _L, _T, _N, rows, len(across), 1.0, triangle, triangle.strides[0] // 8, across, across.strides[0] // 8
    )  # fmt: skip


def _subtract_square(rest: Array, across: Array) -> None:
    """S - A Aᵀ for the lower triangle of S."""
    _dsyrk(
        _L, _N, len(rest), len(across), -1.0, across, across.strides[0] // 8, 1.0, rest, rest.strides[0] // 8
    )  # fmt: skip


def _subtract_product(target: Array, left: Array, right: Array) -> None:
    """C - A Bᵀ for C, all as columns: C (m, n), A (m, k), B (n, k)."""
    _dgemm(
        _N, _T, target.shape[1], len(target), len(left), -1.0, left, left.strides[0] // 8,
        right, right.strides[0] // 8, 1.0, target, target.strides[0] // 8,
    )  # fmt: skip


def _multiply(factor: float, x: Array, columns: Array, kept: float, result: Array) -> None:
    """factor A x + kept y for y, with A (m, n) as columns; x (n, k), y (m, k) as they are."""
    _dgemm(
        _N, _T, x.shape[1], len(result), len(columns), factor, x, x.strides[0] // 8,
        columns, columns.strides[0] // 8, kept, result, result.strides[0] // 8,
    )  # fmt: skip


def _multiply_transposed(factor: float, x: Array, columns: Array, kept: float, result: Array) -> None:
    """factor Aᵀ x + kept y for y, with A (m, n) as columns; x (m, k), y (n, k) as they are."""
    _dgemm(
        _N, _N, x.shape[1], len(columns), columns.shape[1], factor, x, x.strides[0] // 8,
        columns, columns.strides[0] // 8, kept, result, result.strides[0] // 8,
    )  # fmt: skip


def _plain_cholesky(square: Array) -> int:
    factor, failed = lapack.dpotrf(square.T, lower=1, clean=0)
    square[:] = factor.T
    return int(failed)


def _plain_invert(triangle: Array) -> None:
    triangle[:] = lapack.dtrtri(triangle.T, lower=1)[0].T


def _plain_divide(across: Array, triangle: Array) -> None:
    across[:] = blas.dtrsm(1.0, triangle.T, across.T, side=1, lower=1, trans_a=1).T


def _plain_subtract_square(rest: Array, across: Array) -> None:
    rest[:] = blas.dsyrk(-1.0, across.T, beta=1.0, c=rest.T, lower=1).T


def _plain_subtract_product(target: Array, left: Array, right: Array) -> None:
    target -= right.T @ left


def _plain_multiply(factor: float, x: Array, columns: Array, kept: float, result: Array) -> None:
    result[:] = factor * (columns.T @ x) + (kept * result if kept else 0.0)


def _plain_multiply_transposed(factor: float, x: Array, columns: Array, kept: float, result: Array) -> None:
    result[:] = factor * (columns @ x) + (kept * result if kept else 0.0)


if ENABLED:
    cholesky, invert, divide = helper(_cholesky), helper(_invert), helper(_divide)
    subtract_square, subtract_product = helper(_subtract_square), helper(_subtract_product)
    multiply, multiply_transposed = helper(_multiply), helper(_multiply_transposed)
else:
    cholesky, invert, divide = _plain_cholesky, _plain_invert, _plain_divide
    subtract_square, subtract_product = _plain_subtract_square, _plain_subtract_product
    multiply, multiply_transposed = _plain_multiply, _plain_multiply_transposed

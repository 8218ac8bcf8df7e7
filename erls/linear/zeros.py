"""Transmission zeros of a state-space model, where the pencil [A - s, B; C, D] loses rank."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from erls.maths.so3 import Array

_SAME = 1e-6  # of a pole: distance of a zero that lies on it, or on another one
_FAR = 1e4  # times the fastest pole: a zero at infinity


def off_poles(zeros: Array, poles: Array) -> Array:
    """Zeros that lie on no pole, each pole taken once."""
    left, kept = list(poles.tolist()), []
    for zero in zeros.tolist():
        near = [k for k, pole in enumerate(left) if abs(zero - pole) <= _SAME * abs(pole)]
        if near:
            left.pop(near[0])
        else:
            kept.append(zero)
    return np.array(kept, dtype=complex)


def transmission_zeros(a: Array, b: Array, c: Array, d: Array) -> Array:
    """(k,) finite zeros of the pencil [A - s, B; C, D], in rising order of size; of any shape.

    Where there are more outputs than inputs, or fewer, the longer side is combined into as many as the shorter one has,
    at random and twice: zeros of the whole are those that both squares have, and what is only in one of them is made by
    the combination. (For other ways: A. Emami-Naeini and P. Van Dooren, Automatica 18 (1982) 415-430.)
    """
    inputs, outputs = b.shape[1], c.shape[0]
    if inputs == outputs:
        return _square_zeros(a, b, c, d)
    mixed = np.random.default_rng(0).standard_normal((2, min(inputs, outputs), max(inputs, outputs)))
    size = max(float(np.abs(np.linalg.eigvals(a)).max(initial=0.0)), 1e-300)
    units, found = _units(b, c, d), []
    for one in mixed:
        if outputs > inputs:
            found.append(_square_zeros(a, b, one @ (c * units[1][:, None]), one @ (d * units[1][:, None])))
        else:
            found.append(_square_zeros(a, (b * units[0]) @ one.T, c, (d * units[0]) @ one.T))
    kept, left = [], found[1].tolist()
    for zero in found[0].tolist():
        near = [k for k, other in enumerate(left) if abs(zero - other) <= _SAME * max(abs(zero), _SAME * size)]
        if near:
            left.pop(near[0])
            kept.append(zero)
    return np.array(kept, dtype=complex)


def _units(b: Array, c: Array, d: Array) -> tuple[Array, Array]:
    """(r,) and (p,) factors of inputs and outputs that make them alike."""
    columns, rows = np.abs(np.vstack([b, d])).max(axis=0), np.abs(np.hstack([c, d])).max(axis=1)
    return 1 / np.where(columns > 0, columns, 1.0), 1 / np.where(rows > 0, rows, 1.0)


def _square_zeros(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Of as many inputs as outputs."""
    n, r = len(a), b.shape[1]
    if not n:
        return np.zeros(0, dtype=complex)
    fastest = float(np.abs(np.linalg.eigvals(a)).max()) or 1.0
    _, (scale, _) = la.matrix_balance(a, permute=False, separate=True)
    a, b, c = a / scale[:, None] * scale, b / scale[:, None], c * scale
    columns, rows = (np.abs(x).max(axis=k, initial=0.0) for k, x in ((0, b), (1, c)))
    columns, rows = (fastest / np.where(x > 0, x, fastest) for x in (columns, rows))  # like a
    b, c, d = b * columns, c * rows[:, None], d * columns * rows[:, None]
    pencil = np.block([[a, b], [c, d]])
    weight = np.zeros((n + r, n + r))
    weight[:n, :n] = np.eye(n)
    alpha, beta = la.eig(pencil, weight, right=False, homogeneous_eigvals=True)
    finite = np.abs(beta) * _FAR * fastest > np.abs(alpha)
    found = alpha[finite] / beta[finite]
    return np.asarray(found[np.lexsort((found.imag, np.abs(found)))])

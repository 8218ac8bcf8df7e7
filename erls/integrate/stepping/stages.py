"""The stages of a step of Lobatto IIIA: their start, iteration, factors and error (`erls.integrate.stepping.lobatto`).

Arrays: numbers in ``known``, counts in ``counts``; ``stages`` and ``last`` (stages + 1, 3, n) hold y, v, a at the nodes
of the present and of the last step; ``coefficients``, ``matrices`` and ``vectors`` are named below. ``way`` is how to
solve: the system's functions for that (`erls.equations.compiled_system.Factoring`), constants, factors in real and in
complex numbers, row exchanges of dense ones, room for n complex numbers. The factors are dense, row by row, where there
is room for row exchanges.
"""

from __future__ import annotations

import math
from typing import Any

from erls.equations.compiled_system import (
    Array,
    Functions,
    IntArray,
    call_factor,
    call_factor_complex,
    call_mass_matrix,
    call_solve,
    call_solve_complex,
    call_stiffness_and_damping,
)
from erls.maths import dense
from erls.maths.jit import guide, helper, part

# known: the leg, settings of a run, then what steps leave behind
END, FIRST, LAST = 0, 1, 2
LARGEST, SMALLEST, TOLERANCE, GOAL, ROUNDING = 3, 4, 5, 6, 7
T, H, BEFORE, RATE, NEXT = range(8, 13)  # BEFORE: the last step; NEXT: the one to try
KNOWN = 13
# counts
FACTORED, USUAL, EXCESS, REASON, HISTORY, SUSPECT, DIAGONAL = range(7)  # DIAGONAL: stiffness and damping
MAX_ITERATIONS, REFRESH_COST = 7, 8
RHS_CALLS, ITERATIONS, FACTORIZATIONS, REJECTED, CALM = range(9, 14)  # CALM: steps since one was rejected
COUNTS = 14
SINGULAR, NOT_FINITE, SLOW, INACCURATE = 1, 2, 3, 4  # reasons
# blocks of coefficients (4, 4), of `erls.integrate.lobatto`; the last one has the rows below it
RATES, PLACES, INTO_RE, INTO_IM, BACK_RE, BACK_IM, FORETELL, ROWS = range(8)
NODES, DIFFERENCE, LAMBDA_RE, LAMBDA_IM = range(4)
# blocks of matrices (n, n), transposed
MASS, DAMPING, STIFFNESS = range(3)
MATRICES = 3
# rows of vectors (n,); the residuals of the stages are followed by the changes of their accelerations
METRES, PART_RE, PART_IM, RESIDUALS = range(4)

SLOWEST, FASTEST = 0.9, 1e-3  # bounds on a convergence rate carried over from earlier steps
GROWTH, SHRINK, SAFETY = 2.0, 0.2, 0.9  # of steps
PATIENCE = 3  # steps without growth after one that was rejected
KEPT, WORTH = 0.95, 1.2  # bounds on a change of the step that is not worth new factors


@helper
def foretell(
    known: Array,
    counts: IntArray,
    coefficients: Array,
    stages: Array,
    last: Array,
    matrices: Array,
    vectors: Array,
    way: Any,
) -> None:
    """Stages from the polynomial through the last ones, made to fulfil the linear part of the equations.

    What is extrapolated is M a + C v + K y: smooth also where vibrations are not resolved.
    """
    m, n = stages.shape[0] - 1, stages.shape[2]
    nodes, basis = coefficients[ROWS, NODES], coefficients[FORETELL]
    h = known[H]
    for i in range(1, m + 1):
        x = 1.0 + nodes[i] * h / known[BEFORE]
        for j in range(m + 1):
            weight = 1.0
            for k in range(m + 1):
                if k != j:
                    weight *= (x - nodes[k]) / (nodes[j] - nodes[k])
            basis[i, j] = weight if counts[HISTORY] else (1.0 if j == m else 0.0)
    for i in range(1, m + 1):
        for q in range(n):
            stages[i, 2, q] = stages[0, 2, q]
    combine(h, coefficients, stages)
    difference = vectors[PART_RE]
    for i in range(1, m + 1):
        out = vectors[RESIDUALS + i - 1]
        out[:] = 0.0
        for kind in range(3):
            now = stages[i, 2 - kind]
            for q in range(n):
                difference[q] = now[q]
            for j in range(m + 1):
                weight, before = basis[i, j], last[j, 2 - kind]
                for q in range(n):
                    difference[q] -= weight * before[q]
            if kind > 0 and counts[DIAGONAL]:
                matrix = matrices[kind]
                for q in range(n):
                    out[q] += matrix[q, q] * difference[q]
            else:
                dense.add_product(matrices[kind], difference, out)
    correct(h, coefficients, stages, matrices, vectors, way)


@part
def combine(h: float, coefficients: Array, stages: Array) -> None:
    """Positions and velocities of the stages from their accelerations."""
    m, n = stages.shape[0] - 1, stages.shape[2]
    nodes, rates, places = coefficients[ROWS, NODES], coefficients[RATES], coefficients[PLACES]
    y, v = stages[0, 0], stages[0, 1]
    for i in range(1, m + 1):
        step = h * nodes[i]
        y_out, v_out = stages[i, 0], stages[i, 1]
        for q in range(n):
            y_out[q], v_out[q] = y[q] + step * v[q], v[q]
        for j in range(m + 1):
            to_y, to_v, a = h * h * places[i, j], h * rates[i, j], stages[j, 2]
            for q in range(n):
                y_out[q] += to_y * a[q]
                v_out[q] += to_v * a[q]


@helper
def pairs(stages: int) -> int:
    """Eigenvalues, of which conjugate ones count once."""
    return (stages + 1) // 2


@helper
def solve(
    k: int,
    real: bool,
    re: Array,
    im: Array,
    way: Any,
) -> None:
    """Replace re + i im by the solution with the matrix of eigenvalue k, or with the filter where k is -1."""
    own_solve, own_solve_complex, reals, integers, own, own_complex, pivots, mixed = way
    n, plain = len(re), pivots.shape[1] > 0
    if real and plain:
        dense.solve(own[k + 1].reshape(n, n), pivots[k + 1], re)
        return
    if real:
        call_solve(own_solve, reals, integers, own[k + 1], re)
        return
    for i in range(n):
        mixed[i] = re[i] + 1j * im[i]
    if plain:
        dense.solve(own_complex[k].reshape(n, n), pivots[k + 1], mixed)
    else:
        call_solve_complex(own_solve_complex, reals, integers, own_complex[k], mixed)
    for i in range(n):
        re[i], im[i] = mixed[i].real, mixed[i].imag


@helper
def correct(
    h: float,
    coefficients: Array,
    stages: Array,
    matrices: Array,
    vectors: Array,
    way: Any,
) -> float:
    """One iteration from the residuals of the stages; the largest change of a position, and of h v [metres]."""
    m, n = stages.shape[0] - 1, stages.shape[2]
    re, im = vectors[PART_RE], vectors[PART_IM]
    into_re, into_im = coefficients[INTO_RE], coefficients[INTO_IM]
    back_re, back_im = coefficients[BACK_RE], coefficients[BACK_IM]
    changes = vectors[RESIDUALS + m :]
    for j in range(m):
        for i in range(n):
            changes[j, i] = 0.0
    for k in range(pairs(m)):
        re[:] = 0.0
        im[:] = 0.0
        for j in range(m):
            p, q, out = into_re[k, j], into_im[k, j], vectors[RESIDUALS + j]
            for i in range(n):
                re[i] += p * out[i]
                im[i] += q * out[i]
        solve(k, coefficients[ROWS, LAMBDA_IM, k] == 0.0, re, im, way)
        for j in range(m):
            p, q, change = back_re[j, k], back_im[j, k], changes[j]
            for i in range(n):
                change[i] -= p * re[i] - q * im[i]
    rates, places, metres = coefficients[RATES], coefficients[PLACES], vectors[METRES]
    largest = 0.0
    for i in range(1, m + 1):
        re[:] = 0.0
        im[:] = 0.0
        for j in range(1, m + 1):
            to_y, to_v, change = h * h * places[i, j], h * rates[i, j], changes[j - 1]
            for q in range(n):
                re[q] += to_y * change[q]
                im[q] += to_v * change[q]
        y, v, a, change = stages[i, 0], stages[i, 1], stages[i, 2], changes[i - 1]
        total = 0.0
        for q in range(n):
            y[q] += re[q]
            v[q] += im[q]
            a[q] += change[q]
            largest = max(largest, metres[q] * max(abs(re[q]), h * abs(im[q])))
            total += re[q] + im[q] + change[q]
        if not math.isfinite(total):
            return math.inf
    return largest


@guide
def evaluate(
    system: Functions,
    reals: Array,
    integers: IntArray,
    scratch: Array,
    at: float,
    y: Array,
    v: Array,
    matrices: Array,
) -> None:
    """Mass, damping and stiffness at a state, transposed."""
    stiffness, damping = matrices[STIFFNESS], matrices[DAMPING]
    call_mass_matrix(system.mass_matrix, reals, integers, scratch, at, y, matrices[MASS])
    call_stiffness_and_damping(system.stiffness_and_damping, reals, integers, scratch, at, y, v, stiffness, damping)
    transpose(matrices[MASS])
    transpose(stiffness)
    transpose(damping)


@guide
def factorize(
    system: Functions,
    reals: Array,
    integers: IntArray,
    scratch: Array,
    at: float,
    y: Array,
    v: Array,
    h: float,
    coefficients: Array,
    matrices: Array,
    own: Array,
    own_complex: Any,
    pivots: IntArray,
) -> int:
    """Factors for steps of ``h`` after `evaluate`; 0, or 1 + where elimination broke down.

    Without room for real factors those of all eigenvalues are complex, and nothing is judged by `judge`.
    """
    if pivots.shape[1] > 0:
        return int(factor(h, coefficients, matrices, own, own_complex, pivots))
    status = 0
    if own.shape[0] > 0:
        status = call_factor(system.factor, reals, integers, scratch, at, y, v, h, h * h, own[0])
    for k in range(pairs(coefficients[RATES].shape[0] - 1)):
        p, q = h * coefficients[ROWS, LAMBDA_RE, k], h * coefficients[ROWS, LAMBDA_IM, k]
        if status == 0 and q == 0.0:
            status = call_factor(system.factor, reals, integers, scratch, at, y, v, p, p * p, own[k + 1])
        elif status == 0:
            shift = p + 1j * q
            square = shift * shift
            status = call_factor_complex(
                system.factor_complex, reals, integers, scratch, at, y, v, shift, square, own_complex[k]
            )
    return status


@helper
def factor(h: float, coefficients: Array, matrices: Array, real: Array, mixed: Any, pivots: IntArray) -> int:
    """Dense factors for steps of ``h``; 0, or 1 + the coordinate at which elimination broke down."""
    n = matrices.shape[1]
    mass, damping, stiffness = matrices[MASS], matrices[DAMPING], matrices[STIFFNESS]
    status = 0
    if real.shape[0] > 0:
        status = int(factor_one(mass, damping, stiffness, h, real[0].reshape(n, n), pivots[0]))
    for k in range(pairs(coefficients[RATES].shape[0] - 1)):
        p, q = h * coefficients[ROWS, LAMBDA_RE, k], h * coefficients[ROWS, LAMBDA_IM, k]
        if q == 0.0:
            found = factor_one(mass, damping, stiffness, p, real[k + 1].reshape(n, n), pivots[k + 1])
        else:
            found = factor_one(mass, damping, stiffness, p + 1j * q, mixed[k].reshape(n, n), pivots[k + 1])
        status = max(status, found)
    return status


@part
def factor_one(mass: Array, damping: Array, stiffness: Array, shift: Any, out: Any, pivots: IntArray) -> int:
    """Factors of M + s C + s² K, real or complex."""
    square = shift * shift
    for i in range(len(out)):
        m, c, k, row = mass[i], damping[i], stiffness[i], out[i]
        for j in range(len(row)):
            row[j] = m[j] + shift * c[j] + square * k[j]
    return int(dense.factor(out, pivots))


@helper
def is_diagonal(matrix: Array) -> bool:
    """Whether all entries off the diagonal are zero."""
    for i in range(matrix.shape[0]):
        for j in range(i):
            if matrix[i, j] != 0.0 or matrix[j, i] != 0.0:
                return False
    return True


@helper
def halfway(h: float, stages: Array) -> None:
    """Place half a step ahead, into the first stage."""
    for q in range(stages.shape[2]):
        stages[1, 0, q] = stages[0, 0, q] + h / 2 * stages[0, 1, q]


@helper
def transpose(matrix: Array) -> None:
    """In place."""
    for i in range(matrix.shape[0]):
        for j in range(i):
            matrix[i, j], matrix[j, i] = matrix[j, i], matrix[i, j]


@helper
def judge(
    h: float,
    coefficients: Array,
    stages: Array,
    matrices: Array,
    vectors: Array,
    way: Any,
) -> float:
    """Estimated error of a step [metres]: (M + h C + h² K)⁻¹ M h² times the highest difference of the accelerations."""
    m, n = stages.shape[0] - 1, stages.shape[2]
    weights, metres = coefficients[ROWS, DIFFERENCE], vectors[METRES]
    difference, error = vectors[PART_RE], vectors[PART_IM]
    for q in range(n):
        total = 0.0
        for j in range(m + 1):
            total += weights[j] * stages[j, 2, q]
        difference[q] = h * h * total
        error[q] = 0.0
    dense.add_product(matrices[MASS], difference, error)
    solve(-1, True, error, difference, way)
    largest = 0.0
    for q in range(n):
        largest = max(largest, metres[q] * abs(error[q]))
    return largest

"""The rigid-body modal coordinates follow from the elastic ones: C(θ) q = 0 (ERLS-CMS paper, eq. 3-24).

With C = [C_r, C_d] (eq. 10) and the right pseudo-inverse C_r⁺ = C_rᵀ (C_r C_rᵀ)⁻¹, which picks the smallest q_r,

    q_r = D q_d,   q̇_r = D q̇_d + G θ̇,   q̈_r = D q̈_d + G θ̈ + n.

Under the joint-angle gauge all six rows of a joint stand, C_r is square and G, n are those of the paper. Under the
minimum-norm gauge the row along the joint's freedom is missing; there the paper's G = -C_r⁺ E (eq. 14) is not
∂(D q_d)/∂θ, since C_r⁺ depends on θ too. Its derivative is kept, so that energy is conserved: q_r = C_rᵀ μ is
differentiated together with C q = 0, and what the former adds lies in the null space of C_r, onto which
1 - C_r⁺ C_r projects; of a square C_r it is empty. Massless links between the motions of a joint of several
coordinates do not count in the norm: with P that takes them out, P q_r = C_rᵀ μ, and what is said of C_r⁺ and of the
projector holds for the blocks of the inverse of [P, C_rᵀ; C_r, 0] that stand in their place.

With second-order displacements C q + e(θ, q) = 0, `erls.equations.erls.paper.second_order_rows`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.equations.erls.paper.compatibility_records import (
    JOINT_ROWS,
    ROW_STATE,
    Elimination,
    read_elimination,
    read_joint_rows,
    read_row_state,
)
from erls.equations.erls.paper.records import (
    BODY,
    BODY_STATE,
    ELIMINATE,
    Paper,
    call_extra_rows,
    read_body,
    read_body_state,
    read_paper,
)
from erls.equations.serial.records import Serial, read_serial
from erls.maths.dense import backward, cholesky, forward
from erls.maths.jit import kernel, part
from erls.maths.products import (
    add_columns,
    add_product,
    add_rows,
    add_scaled_product,
    add_transposed_product,
    clear,
    clear_matrix,
    dot,
)
from erls.maths.so3 import Array
from fe_import.model import IntArray


@part
def fill_transforms(turn: Array, slide: Array, coordinate: Any, out: Array) -> None:
    """X(θ) = exp(-θ ad ξ), X′ and X″ into ``out`` (3, 6, 6), where ad ξ is the sum of a turn's and a slide's that share
    their axis: ad³ = -ad of the former, ad² = 0 of the latter.
    """
    s, c = np.sin(coordinate), np.cos(coordinate)
    for i in range(6):
        for j in range(6):
            total = (1.0 if i == j else 0.0) - s * turn[i, j]
            for m in range(6):
                total += (1.0 - c) * turn[i, m] * turn[m, j]
            out[1, i, j] = total
    for i in range(6):
        for j in range(6):
            out[0, i, j] = out[1, i, j]
            for m in range(6):
                out[0, i, j] -= coordinate * out[1, i, m] * slide[m, j]
    for order in range(1, 3):
        for i in range(6):
            for j in range(6):
                out[order, i, j] = 0.0
                for m in range(6):
                    out[order, i, j] -= (turn[i, m] + slide[i, m]) * out[order - 1, m, j]


@part
def fill_compatibility(
    serial: Serial, paper: Paper, reals: Array, integers: IntArray, scratch: Array, c: Elimination
) -> None:
    """C_r, C_d of eq. (7), (10) and ∂C/∂θ_k, ∂²C/∂θ_k² of eq. (12), (17); mixed derivatives vanish.

    Entries that are not set here stay zero.
    """
    for k in range(serial.links):
        rows = read_joint_rows(reals, integers, paper.joint_rows + k * JOINT_ROWS)
        state = read_row_state(scratch, integers, paper.row_states + k * ROW_STATE)
        fill_transforms(rows.turn, rows.slide, c.place[k], state.transform)
        own = read_body(reals, integers, paper.bodies + k * BODY)
        _put_rows(rows.own, 1.0, rows.free_row, rows.first, k, own.elastic, c.c_r, c.c_d)
        if rows.parent >= 0:
            before = read_body(reals, integers, paper.bodies + rows.parent * BODY)
            for order in range(2, -1, -1):  # X B_k is what remains
                into_r = c.second_r if order == 2 else c.first_r if order == 1 else c.c_r
                into_d = c.second_d if order == 2 else c.first_d if order == 1 else c.c_d
                clear_matrix(state.moved)
                add_product(state.transform[order], rows.previous, state.moved)
                _put_rows(state.moved, -1.0, rows.free_row, rows.first, rows.parent, before.elastic, into_r, into_d)


@part
def _put_rows(
    block: Array, factor: float, free_row: int, first: int, link: int, elastic: int, into_r: Array, into_d: Array
) -> None:
    """The factor times the rows in use of a (6, n) block over the modal coordinates of a link."""
    at = first
    for i in range(6):
        if i != free_row:
            row = block[i]
            for j in range(6):
                into_r[at, 6 * link + j] = factor * row[j]
            for j in range(len(row) - 6):
                into_d[at, elastic + j] = factor * row[6 + j]
            at += 1


@part
def _fill_norm(c: Elimination) -> int:
    """Factors of the norm, and C_r in its coordinates into ``rows``; 0, or 1 + a coordinate that no row holds.

    Places between motions do not count. As rows times q_r are given, their squares may be added to any norm.
    """
    v, r = c.c_r.shape
    clear_matrix(c.norm)
    for j in range(v):
        row = c.c_r[j]
        size = dot(row, row)
        for i in range(r):
            c.rows[j, i] = row[i]
            for m in range(r):
                c.norm[i, m] += row[i] * row[m] / size
    for i in range(r):
        c.norm[i, i] += c.counts[i]
    status = cholesky(c.norm, 0.0)
    for j in range(v):
        forward(c.norm, c.rows[j])
    return status


@part
def _from_norm(c: Elimination) -> None:
    """C_r⁺ and the projector in the coordinates of the norm become those of q_r."""
    v, r = c.c_r.shape
    for j in range(v):
        row = c.rows[j]
        for i in range(r):
            row[i] = c.plus[i, j]
        backward(c.norm, row)
        for i in range(r):
            c.plus[i, j] = row[i]
    for _ in range(2):  # from the right, then from the left of what is symmetric
        for i in range(r):
            backward(c.norm, c.null[i])
        for i in range(r):
            for j in range(i):
                c.null[i, j], c.null[j, i] = c.null[j, i], c.null[i, j]


@part
def fill_right_inverse(c: Elimination) -> int:
    """C_r⁺ = C_rᵀ (C_r C_rᵀ)⁻¹ (before eq. 11) and 1 - C_r⁺ C_r; 0, or 1 + a row that follows from those before it.

    C_rᵀ = Q U, of which the first factors lack the digits that the square of C_r loses, and those of Q win them back
    (Y. Yamamoto, Y. Nakatsukasa, Y. Yanagisawa, T. Fukaya, Electron. Trans. Numer. Anal. 44 (2015) 306).
    """
    v, r = c.c_r.shape
    weighted = c.norm.shape[0] > 0
    status = _fill_norm(c) if weighted else 0
    for i in range(r):
        for j in range(v):
            c.plus[i, j] = c.rows[j, i] if weighted else c.c_r[j, i]
    for gram in (c.gram, c.gram_again):
        clear_matrix(gram)
        add_transposed_product(c.plus, c.plus, gram)
        found = cholesky(gram, 0.0)
        status = status if status != 0 else found
        for i in range(r):
            forward(gram, c.plus[i])
    clear_matrix(c.null)
    if v < r:
        for i in range(r):
            for j in range(r):
                c.null[i, j] = (1.0 if i == j else 0.0) - dot(c.plus[i], c.plus[j])
    for i in range(r):
        backward(c.gram_again, c.plus[i])
        backward(c.gram, c.plus[i])
    if weighted:
        _from_norm(c)
    return status


@part
def _relate(serial: Serial, paper: Paper, reals: Array, integers: IntArray, c: Elimination) -> None:
    """G, q̇_r and n of eq. (13)-(24) from C q + e = 0 at q_r, with D."""
    links = serial.links
    q_d, rate_d = c.place[links:], c.rate[links:]
    clear(c.slope)  # ∂C/∂θ_k q: the columns of E (13), each in the block row of its joint
    add_rows(c.first_r, c.q_r, 1.0, c.slope)
    add_rows(c.first_d, q_d, 1.0, c.slope)
    clear(c.mu)
    for r in range(len(c.q_r)):
        c.spare_rigid[r] = c.counts[r] * c.q_r[r]
    add_columns(c.plus, c.spare_rigid, 1.0, c.mu)
    clear_matrix(c.g)
    clear_matrix(c.turned)
    for k in range(links):
        rows = read_joint_rows(reals, integers, paper.joint_rows + k * JOINT_ROWS)
        for i in range(rows.first, rows.first + rows.kept):
            for r in range(len(c.q_r)):
                c.g[r, k] -= c.plus[r, i] * c.slope[i]  # G = -C_r⁺ E (14)
                c.turned[r, k] += c.first_r[i, r] * c.mu[i]
    for r in range(len(c.q_r)):
        for i in range(len(c.slope)):
            for k in range(links):
                c.g[r, k] -= c.plus[r, i] * c.extra_slope[i, k]
    add_product(c.null, c.turned, c.g)
    clear(c.qd_r)  # q̇_r = D q̇_d + G θ̇ (14)
    add_rows(c.d, rate_d, 1.0, c.qd_r)
    add_rows(c.g, c.rate[:links], 1.0, c.qd_r)
    clear(c.slope_rate)
    clear(c.bend)
    add_rows(c.first_r, c.qd_r, 1.0, c.slope_rate)
    add_rows(c.first_d, rate_d, 1.0, c.slope_rate)
    add_rows(c.second_r, c.q_r, 1.0, c.bend)
    add_rows(c.second_d, q_d, 1.0, c.bend)
    for r in range(len(c.q_r)):
        c.spare_rigid[r] = c.counts[r] * c.qd_r[r] - dot(c.turned[r], c.rate[:links])
    clear(c.mu_rate)
    add_columns(c.plus, c.spare_rigid, 1.0, c.mu_rate)
    clear(c.spare_rigid)
    for k in range(links):
        rows, rate = read_joint_rows(reals, integers, paper.joint_rows + k * JOINT_ROWS), c.rate[k]
        for i in range(rows.first, rows.first + rows.kept):
            c.spare[i] = c.bend[i] * rate * rate + 2 * c.slope_rate[i] * rate + c.extra_bias[i]  # h (18) + 2 c (19)
            for r in range(len(c.q_r)):
                c.spare_rigid[r] += rate * (2 * c.first_r[i, r] * c.mu_rate[i] + rate * c.second_r[i, r] * c.mu[i])
    clear(c.n)  # n = -C_r⁺ (h + 2 c) (23)
    add_rows(c.plus, c.spare, -1.0, c.n)
    add_rows(c.null, c.spare_rigid, 1.0, c.n)


@part
def _gather(
    serial: Serial, paper: Paper, reals: Array, integers: IntArray, scratch: Array, c: Elimination
) -> None:
    """q, q̇ of every link, their rows over the rates of (θ, q_d) (eq. 69) and what is left of q̈ (eq. 70)."""
    links = serial.links
    for k in range(links):
        body = read_body(reals, integers, paper.bodies + k * BODY)
        state = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
        first = links + body.elastic
        for i in range(6):
            state.q[i], state.velocity[6 + i], state.bias[6 + i] = c.q_r[6 * k + i], c.qd_r[6 * k + i], c.n[6 * k + i]
            row = state.moves[6 + i]
            for j in range(links):
                row[j] = c.g[6 * k + i, j]
            for j in range(len(row) - links):
                row[links + j] = c.d[6 * k + i, j]
        for i in range(len(state.q) - 6):
            state.q[6 + i], state.velocity[12 + i] = c.place[first + i], c.rate[first + i]


@kernel(ELIMINATE, counted=False)
def eliminate(reals: Array, integers: IntArray, scratch: Array) -> int:
    """q, q̇ and D, G, n from θ, q_d and their rates; the status of `fill_right_inverse`."""
    serial = read_serial(reals, integers, integers[0])
    paper = read_paper(reals, integers, serial.own)
    c, links = read_elimination(scratch, integers, paper.elimination), serial.links
    fill_compatibility(serial, paper, reals, integers, scratch, c)
    status = fill_right_inverse(c)
    clear_matrix(c.d)  # D = -C_r⁺ C_d (11)
    add_scaled_product(-1.0, c.plus, c.c_d, c.d)
    clear(c.q_r)
    add_rows(c.d, c.place[links:], 1.0, c.q_r)
    if paper.curved:
        clear(c.extra_bias)
        clear_matrix(c.extra_slope)
    _relate(serial, paper, reals, integers, c)
    _gather(serial, paper, reals, integers, scratch, c)
    if paper.curved:
        call_extra_rows(paper.extra_rows, reals, integers, scratch)
        add_rows(c.plus, c.extra, -1.0, c.q_r)
        for r in range(len(c.q_r)):
            for i in range(len(c.extra)):
                row, weight = c.extra_slope[i], c.plus[r, i]
                for j in range(c.d.shape[1]):
                    c.d[r, j] -= weight * row[links + j]
        _relate(serial, paper, reals, integers, c)
        _gather(serial, paper, reals, integers, scratch, c)
    return status

"""Compatibility with finite rotations and second-order displacements: C(θ) q + e(θ, q) = 0.

The frames fixed to both links in a joint are displaced by u and turned by exp φ. To second order

- a frame at an arm p from its interface node moves by ½ φ × (φ × p) and by the second-order field of the node; both
  stand in the tensors T of A_k and B_k;
- along a slide of length s the outer frame moves by ½ φ₋ × (φ₋ × s);
- where a row along the joint's freedom is free, the outer frame is the inner one moved along that freedom in the inner
  frame's displaced axes: -½ φ₋ × φ of a turn, -φ₋ × (u - u₋) of a slide,

with u₋, φ₋ of the inner frame in the axes of the outer one. So for joint k behind the parent p

    e = ½ q_kᵀ T_A q_k - X(θ) ½ q_pᵀ T_B q_p + j(A q_k, X(θ) B q_p, θ).

e is evaluated at the q of the linear compatibility; what is left out is of third order. Its derivatives are exact, so
energy is conserved.

The turn of a link with the tip of the one before it is cut here after second order, too; FFR takes it whole. While
joints turn, the kinetic energy differs by ω q² q̇: within 0.4 s from an undeformed start the shoulder torque of the
two-link robot (0.73 N m at its peak) is 3.6e-3 N m off that of exact beams in ERLS, 0.75e-3 N m in FFR.
"""

from __future__ import annotations

from typing import Any

from erls.equations.erls.paper.compatibility_records import (
    JOINT_ROWS,
    ROW_STATE,
    JointRows,
    RowState,
    read_elimination,
    read_joint_rows,
    read_row_state,
)
from erls.equations.erls.paper.records import BODY_STATE, EXTRA_ROWS, read_body_state, read_paper
from erls.equations.serial.records import read_serial
from erls.maths.jit import kernel, part
from erls.maths.products import add_rows, add_scaled_product, clear, clear_matrix, dot
from erls.maths.so3 import Array
from erls.maths.vectors import Vector, add, cross, minus, plus, scaled, three
from fe_import.model import IntArray


@part
def quadratic(matrix: Array, x: Array) -> Any:
    """xᵀ A x."""
    total = 0.0
    for i in range(len(x)):
        total += x[i] * dot(matrix[i], x)
    return total


@part
def _add_skew(a: Vector, factor: float, out: Array, row: int, column: int) -> None:
    """Add the factor times ã to the block of a matrix that begins there."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[row + j, column + k] -= factor * a[i]
        out[row + k, column + j] += factor * a[i]


@part
def _add_skews(a: Vector, b: Vector, factor: float, out: Array, row: int, column: int) -> None:
    """Add the factor times ã b̃ = b aᵀ - (a·b) 1."""
    product = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    for i in range(3):
        out[row + i, column + i] -= factor * product
        for j in range(3):
            out[row + i, column + j] += factor * b[i] * a[j]


@part
def _add_finite_motion(rows: JointRows, state: RowState, coordinate: Any, rate: Any) -> None:
    """j, its derivatives by the displacements of both frames and by θ, and the part of its second derivative in time
    that is quadratic in their rates.
    """
    clear_matrix(state.by_inner)
    clear_matrix(state.by_outer)
    u_in, phi_in = three(state.inner, 0), three(state.inner, 3)
    turning = three(state.inner_rate, 3)
    u, phi = three(state.outer, 0), three(state.outer, 3)
    if rows.slides:
        unit = three(rows.advance, 0)
        along, speed = scaled(coordinate, unit), scaled(rate, unit)
        arm = cross(phi_in, along)
        add(state.extra, 0, scaled(-0.5, cross(phi_in, arm)))
        _add_skew(arm, 0.5, state.by_inner, 0, 3)
        _add_skews(phi_in, along, 0.5, state.by_inner, 0, 3)
        add(state.extra_angle, 0, scaled(-0.5, cross(phi_in, cross(phi_in, unit))))
        both = plus(cross(turning, cross(phi_in, speed)), cross(phi_in, cross(turning, speed)))
        add(state.extra_bias, 0, scaled(-1.0, plus(cross(turning, cross(turning, along)), both)))
    if 0 <= rows.free_row < 3:
        apart = minus(u, u_in)
        parting = minus(three(state.outer_rate, 0), three(state.inner_rate, 0))
        add(state.extra, 0, scaled(-1.0, cross(phi_in, apart)))
        _add_skew(apart, 1.0, state.by_inner, 0, 3)
        _add_skew(phi_in, 1.0, state.by_inner, 0, 0)
        _add_skew(phi_in, -1.0, state.by_outer, 0, 0)
        add(state.extra_bias, 0, scaled(-2.0, cross(turning, parting)))
    elif rows.free_row >= 3:
        add(state.extra, 3, scaled(-0.5, cross(phi_in, phi)))
        _add_skew(phi, 0.5, state.by_inner, 3, 3)
        _add_skew(phi_in, -0.5, state.by_outer, 3, 3)
        add(state.extra_bias, 3, scaled(-1.0, cross(turning, three(state.outer_rate, 3))))


@part
def _add_own(rows: JointRows, state: RowState, q: Array, rates: Array) -> None:
    """½ q_kᵀ T_A q_k."""
    for i in range(rows.own_second.shape[0]):
        slope = state.extra_own[i]
        add_rows(rows.own_second[i], q, 1.0, slope)
        state.extra[i] += dot(slope, q) / 2
        state.extra_bias[i] += quadratic(rows.own_second[i], rates)


@part
def _add_previous(rows: JointRows, state: RowState, q: Array, rates: Array, rate: Any) -> None:
    """-X(θ) ½ q_pᵀ T_B q_p."""
    clear_matrix(state.square_slope)
    for i in range(6):
        slope = state.square_slope[i]
        add_rows(rows.previous_second[i], q, 1.0, slope)
        state.square[i], state.square_rate[i] = dot(slope, q) / 2, dot(slope, rates)
        state.square_bend[i] = quadratic(rows.previous_second[i], rates)
    x, first, second = state.transform[0], state.transform[1], state.transform[2]
    add_rows(x, state.square, -1.0, state.extra)
    add_rows(first, state.square, -1.0, state.extra_angle)
    add_scaled_product(-1.0, x, state.square_slope, state.extra_previous)
    add_rows(x, state.square_bend, -1.0, state.extra_bias)
    add_rows(first, state.square_rate, -2.0 * rate, state.extra_bias)
    add_rows(second, state.square, -rate * rate, state.extra_bias)


@part
def _add_joint(
    rows: JointRows, state: RowState, own: Array, own_rates: Array, q: Array, rates: Array, coordinate: Any, rate: Any
) -> None:
    """j at the displacements of the joint's frames."""
    x, first, second = state.transform[0], state.transform[1], state.transform[2]
    clear(state.frame)
    clear(state.frame_rate)
    clear(state.inner)
    clear(state.inner_rate)
    clear(state.inner_bias)
    clear(state.outer)
    clear(state.outer_rate)
    add_rows(rows.previous, q, 1.0, state.frame)
    add_rows(rows.previous, rates, 1.0, state.frame_rate)
    add_rows(x, state.frame, 1.0, state.inner)
    add_rows(x, state.frame_rate, 1.0, state.inner_rate)
    add_rows(first, state.frame, rate, state.inner_rate)
    add_rows(first, state.frame_rate, 2.0 * rate, state.inner_bias)
    add_rows(second, state.frame, rate * rate, state.inner_bias)
    add_rows(rows.own, own, 1.0, state.outer)
    add_rows(rows.own, own_rates, 1.0, state.outer_rate)
    _add_finite_motion(rows, state, coordinate, rate)
    add_scaled_product(1.0, state.by_outer, rows.own, state.extra_own)
    add_scaled_product(1.0, state.by_inner, state.moved, state.extra_previous)
    add_rows(state.by_inner, state.inner_bias, 1.0, state.extra_bias)
    clear(state.inner_bias)
    add_rows(first, state.frame, 1.0, state.inner_bias)
    add_rows(state.by_inner, state.inner_bias, 1.0, state.extra_angle)


@part
def _add_back(moves: Array, slope: Array, row: Array) -> None:
    """Add a derivative by q of a link, as one over (θ, q_d)."""
    for i in range(len(slope)):
        weight, along = slope[i], moves[6 + i]
        for j in range(len(row)):
            row[j] += weight * along[j]


@kernel(EXTRA_ROWS, counted=False)
def extra_rows(reals: Array, integers: IntArray, scratch: Array) -> None:
    """e of all rows, its derivatives over (θ, q_d), and ë at θ̈ = 0, q̈_d = 0."""
    serial = read_serial(reals, integers, integers[0])
    paper = read_paper(reals, integers, serial.own)
    c = read_elimination(scratch, integers, paper.elimination)
    for k in range(serial.links):
        rows = read_joint_rows(reals, integers, paper.joint_rows + k * JOINT_ROWS)
        state = read_row_state(scratch, integers, paper.row_states + k * ROW_STATE)
        own = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
        clear(state.extra)
        clear(state.extra_angle)
        clear(state.extra_bias)
        clear_matrix(state.extra_own)
        clear_matrix(state.extra_previous)
        _add_own(rows, state, own.q, own.velocity[6:])
        add_later = rows.parent >= 0
        if add_later:
            before = read_body_state(scratch, integers, paper.body_states + rows.parent * BODY_STATE)
            if rows.previous_second.shape[0] > 0:
                _add_previous(rows, state, before.q, before.velocity[6:], c.rate[k])
            if rows.slides or rows.free_row >= 0:
                _add_joint(
                    rows, state, own.q, own.velocity[6:], before.q, before.velocity[6:], c.place[k], c.rate[k]
                )
            add_rows(state.extra_previous, before.bias[6:], 1.0, state.extra_bias)
        add_rows(state.extra_own, own.bias[6:], 1.0, state.extra_bias)
        at = rows.first
        for i in range(6):
            if i == rows.free_row:
                continue
            row = c.extra_slope[at]
            c.extra[at], c.extra_bias[at] = state.extra[i], state.extra_bias[i]
            clear(row)
            row[k] += state.extra_angle[i]
            _add_back(own.moves, state.extra_own[i], row)
            if add_later:
                before = read_body_state(scratch, integers, paper.body_states + rows.parent * BODY_STATE)
                _add_back(before.moves, state.extra_previous[i], row)
            at += 1

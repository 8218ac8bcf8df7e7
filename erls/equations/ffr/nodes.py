"""Displaced interface nodes: pose and motion in the floating frame, moved by u and turned by exp(φ), linear in η or of
second order.

With s = φ², a = (1 - cos φ)/φ² and b = (φ - sin φ)/φ³ the turn is 1 + (1 - s b) φ̃ + a φ̃², and ω = (1 - a φ̃ + b φ̃²) φ̇ in
the node's axes; formulas of `erls.equations.ffr.interface_motion`.
"""

from __future__ import annotations

import math

from erls.equations.compiled_system import Array
from erls.equations.ffr import layout as at
from erls.equations.ffr.rows import add_rows, cross3
from erls.maths.jit import part

_SERIES = 0.5  # rad²; below, nine terms give full precision
_SMALL = 0.01  # rad²; below, six
_A = tuple((-1.0) ** k / math.factorial(2 * k + 2) for k in range(9))
_B = tuple((-1.0) ** k / math.factorial(2 * k + 3) for k in range(9))


@part
def turn_factors(s: float) -> tuple[float, float, float, float]:
    """a, da/ds, b, db/ds."""
    if s < _SERIES:
        a = a_slope = b = b_slope = 0.0
        for k in range(5 if s < _SMALL else 8, -1, -1):
            a_slope = a_slope * s + a
            a = a * s + _A[k]
            b_slope = b_slope * s + b
            b = b * s + _B[k]
        return a, a_slope, b, b_slope
    angle = math.sqrt(s)
    sine, cosine = math.sin(angle) / angle, math.cos(angle)
    a, b = (1 - cosine) / s, (1 - sine) / s
    return a, (sine / 2 - a) / s, b, ((sine - cosine) / (2 * s) - b) / s


@part
def invert_pose(pose: Array, out: Array) -> None:
    """Inverse of a pose (12,)."""
    p0, p1, p2 = pose[9], pose[10], pose[11]
    for i in range(3):
        for j in range(3):
            out[3 * i + j] = pose[3 * j + i]
        out[9 + i] = -(pose[i] * p0 + pose[3 + i] * p1 + pose[6 + i] * p2)


@part
def place_node(reals: Array, start: int, q: Array, slope: Array, rows: Array, node: Array) -> None:
    """Pose of a node whose constants begin at ``start``, and what `move_node` needs of it.

    ``rows`` (6 e,) gets u and φ per η̇; ``slope`` (6 e,) is Ψ η of second-order displacements, or empty.
    """
    e = len(q)
    place, phi = node[at.POSE + 9 : at.POSE + 12], node[at.PHI : at.PHI + 3]
    for i in range(3):
        place[i], phi[i] = reals[start + i], 0.0
    for i in range(6 * e):
        rows[i] = reals[start + 3 + i]
    add_rows(rows, 0, q, 1.0, place)
    add_rows(rows, 3 * e, q, 1.0, phi)
    if len(slope):
        add_rows(slope, 0, q, 0.5, place)
        add_rows(slope, 3 * e, q, 0.5, phi)
        for i in range(6 * e):
            rows[i] += slope[i]
    f0, f1, f2 = phi[0], phi[1], phi[2]
    s = f0 * f0 + f1 * f1 + f2 * f2
    a, a_slope, b, b_slope = turn_factors(s)
    node[at.SLOPE_A], node[at.FACTOR_B], node[at.SLOPE_B] = a_slope, b, b_slope
    # φ̃² = φ φᵀ - s
    for i in range(3):
        for j in range(3):
            square = phi[i] * phi[j]
            node[at.POSE + 3 * i + j] = a * square
            node[at.TANGENT + 3 * i + j] = b * square
        node[at.POSE + 4 * i] += 1.0 - a * s
        node[at.TANGENT + 4 * i] += 1.0 - b * s
    turn = 1.0 - s * b
    for i, j, f in ((1, 0, f2), (0, 2, f1), (2, 1, f0)):
        node[at.POSE + 3 * i + j] += turn * f
        node[at.POSE + 3 * j + i] -= turn * f
        node[at.TANGENT + 3 * i + j] -= a * f
        node[at.TANGENT + 3 * j + i] += a * f


@part
def to_node_axes(node: Array, x: Array) -> None:
    """Replace rates of (u, φ) by the twist that they make, in the node's axes."""
    u0, u1, u2, f0, f1, f2 = x[0], x[1], x[2], x[3], x[4], x[5]
    for i in range(3):
        x[i] = node[i] * u0 + node[3 + i] * u1 + node[6 + i] * u2
        tangent = at.TANGENT + 3 * i
        x[3 + i] = node[tangent] * f0 + node[tangent + 1] * f1 + node[tangent + 2] * f2


@part
def from_node_axes(node: Array, wrench: Array, out: Array) -> None:
    """Forces on (u, φ) of a wrench in the node's axes; the transpose of `to_node_axes`."""
    for i in range(3):
        turn, tangent = at.POSE + 3 * i, at.TANGENT + i
        out[i] = node[turn] * wrench[0] + node[turn + 1] * wrench[1] + node[turn + 2] * wrench[2]
        out[3 + i] = node[tangent] * wrench[3] + node[tangent + 3] * wrench[4] + node[tangent + 6] * wrench[5]


@part
def move_node(rows: Array, rates: Array, accelerations: Array, slope_rate: Array, node: Array) -> None:
    """TWIST and RATE of a node, at η̈ = 0 where ``accelerations`` is empty; ``slope_rate`` as in `place_node`."""
    twist, rate = node[at.TWIST : at.TWIST + 6], node[at.RATE : at.RATE + 6]
    for i in range(6):
        twist[i] = rate[i] = 0.0
    add_rows(rows, 0, rates, 1.0, twist)
    if len(accelerations):
        add_rows(rows, 0, accelerations, 1.0, rate)
    if len(slope_rate):
        add_rows(slope_rate, 0, rates, 1.0, rate)
    f0, f1, f2 = node[at.PHI], node[at.PHI + 1], node[at.PHI + 2]
    d0, d1, d2 = twist[3], twist[4], twist[5]
    to_node_axes(node, twist)
    to_node_axes(node, rate)
    v0, v1, v2 = cross3(twist[0], twist[1], twist[2], twist[3], twist[4], twist[5])
    rate[0] += v0
    rate[1] += v1
    rate[2] += v2
    o0, o1, o2 = cross3(f0, f1, f2, d0, d1, d2)
    t0, t1, t2 = cross3(f0, f1, f2, o0, o1, o2)
    c0, c1, c2 = cross3(d0, d1, d2, o0, o1, o2)
    s_rate = 2.0 * (f0 * d0 + f1 * d1 + f2 * d2)
    once, twice, b = -node[at.SLOPE_A] * s_rate, node[at.SLOPE_B] * s_rate, node[at.FACTOR_B]
    rate[3] += twice * t0 + once * o0 + b * c0
    rate[4] += twice * t1 + once * o1 + b * c1
    rate[5] += twice * t2 + once * o2 + b * c2

"""Displaced nodes: pose and motion in the frame of their link, moved by u, turned by exp(φ).

u and φ are linear in the elastic coordinates η of the link, with ½ ηᵀ Ψ η where they are of second order.

With s = φ², a = (1 - cos φ)/φ² and b = (φ - sin φ)/φ³ the turn is 1 + (1 - s b) φ̃ + a φ̃², and ω = T(φ) φ̇ with
T = 1 - a φ̃ + b φ̃² in the node's axes (A. Iserles, H. Munthe-Kaas, S. Nørsett, A. Zanna, Acta Numerica 2000, app. B).
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from erls.equations.serial.kept import kept, kept_record
from erls.maths.jit import part
from erls.maths.products import add_columns, add_rows, clear
from erls.maths.records import Laid, Matrix, Vector, laid, reader, table_size
from erls.maths.so3 import Array
from erls.maths.spatial import add_cross, dot3, invert_pose
from erls.mechanism.links import Link, node_shape6


class Node(NamedTuple):
    """A node of a link that its elastic coordinates move.

    Attributes
    ----------
    link : int
        Number of the link that it belongs to.
    moves : int
        Whether the elastic coordinates move it in the frame of its link.
    position : (3,) array
        Undeformed, in the frame of its link.
    shapes : (6, e) array
        Displacement u and rotation vector φ per elastic coordinate.
    second_order : (e, 6 e) array
        Ψ of u and φ, rows (6, e), for each coordinate that they are multiplied with; (0, 0) without.
    """

    link: int
    moves: int
    position: Vector
    shapes: Matrix
    second_order: Matrix


class NodeState(NamedTuple):
    """Motion of a node in the frame of its link.

    Attributes
    ----------
    pose, back : (12,) arrays
        Of the node, and its inverse.
    phi, phi_rate : (3,) arrays
        Rotation vector and its derivative.
    tangent : (3, 3) array
        T(φ), which turns φ̇ into the angular velocity in the node's axes.
    turning : (3,) array
        da/ds, b and db/ds, above.
    twist, twist_rate : (6,) arrays
        Against that frame, in the node's axes.
    rows : (6, e) array
        u̇ and φ̇ per η̇.
    slope, slope_rate : (6, e) arrays
        Ψ η and Ψ η̇.
    moves : (6, e) array
        Twist per η̇.
    """

    pose: Vector
    back: Vector
    phi: Vector
    phi_rate: Vector
    tangent: Matrix
    turning: Vector
    twist: Vector
    twist_rate: Vector
    rows: Matrix
    slope: Matrix
    slope_rate: Matrix
    moves: Matrix


def node_state(e: int, bent: bool) -> NodeState:
    """Memory for a node that so many elastic coordinates move, by second-order displacements or not."""
    rows, slope = np.zeros((6, e)), np.zeros((6, e if bent else 0))
    rest = np.concatenate([np.eye(3).ravel(), np.zeros(3)])
    six, three = np.zeros(6), np.zeros(3)
    return NodeState(rest, rest, three, three, np.eye(3), three, six, six, rows, slope, slope, rows)


def laid_node_state(node: Laid) -> Laid:
    """The same, as memory lays it, for a node."""
    return _laid_state(node.record.shapes.shape[1], len(node.record.second_order) > 0)


@cache
def _laid_state(e: int, bent: bool) -> Laid:
    return laid(node_state(e, bent))


RESTING = Node(-1, 0, np.zeros(3), np.zeros((6, 0)), np.zeros((0, 0)))
"""A node of no link, which nothing moves."""


def node_record(k: int, link: Link, basis: Array, node: int, bent: bool) -> Node:
    """A node of link k.

    Parameters
    ----------
    k : int
    link : Link
    basis : (m, e) array
        Modal coordinates of the link per elastic coordinate.
    node : int
        Number in the link's model.
    bent : bool
        Whether the link has second-order displacements.
    """
    return kept(_node_record, link, k, basis, node, bent)


def laid_node(k: int, link: Link, basis: Array, node: int, bent: bool) -> Laid:
    """The same, as memory lays it."""
    return kept_record(_node_record, link, k, basis, node, bent)


def _node_record(link: Link, k: int, basis: Array, node: int, bent: bool) -> Node:
    shapes = np.vstack(node_shape6(link.model, node)) @ basis
    second, e = np.zeros((0, 0)), basis.shape[1]
    if bent:
        assert link.second_order is not None
        second = (basis.T @ link.second_order.node(node) @ basis).transpose(2, 0, 1).reshape(e, 6 * e)
    return Node(k, int(e > 0), link.model.nodes[node], shapes, second)


def centre_record(k: int, link: Link, basis: Array, bent: bool) -> Node:
    """The centre of mass of link k with what it carries, which turns with nothing; arguments as of `node_record`."""
    momentum = (link.invariants.rigid.T @ link.invariants.m)[:3]  # per rate of modal coordinates
    moment = link.invariants.rigid_mass_matrix[3:, :3]
    mass, e = float(np.trace(link.invariants.rigid_mass_matrix[:3, :3])) / 3, basis.shape[1]
    if mass <= 0.0:
        return Node(k, 0, np.zeros(3), np.zeros((6, e)), np.zeros((0, 0)))
    second = np.zeros((0, 0))
    if bent:
        assert link.second_order is not None
        moved = np.concatenate([link.second_order.momentum[:3] / mass, np.zeros((3, *link.invariants.m.shape))])
        second = (basis.T @ moved @ basis).transpose(2, 0, 1).reshape(e, 6 * e)
    place = np.array([moment[2, 1], moment[0, 2], moment[1, 0]]) / mass
    return Node(k, int(e > 0), place, np.vstack([momentum / mass @ basis, np.zeros((3, e))]), second)


read_node, read_node_state = reader(Node), reader(NodeState)
NODE, NODE_STATE = table_size(Node), table_size(NodeState)

_SERIES = 0.5  # rad²; below, nine terms give full precision
_SMALL = 0.01  # rad²; below, six
_A = tuple((-1.0) ** k / math.factorial(2 * k + 2) for k in range(9))
_B = tuple((-1.0) ** k / math.factorial(2 * k + 3) for k in range(9))


@part
def turn_factors(s: Any) -> tuple[Any, Any, Any, Any]:
    """a, da/ds, b, db/ds."""
    if s.real < _SERIES:
        a = a_slope = b = b_slope = 0.0 * s
        for k in range(5 if s.real < _SMALL else 8, -1, -1):
            a_slope = a_slope * s + a
            a = a * s + _A[k]
            b_slope = b_slope * s + b
            b = b * s + _B[k]
        return a, a_slope, b, b_slope
    angle = np.sqrt(s)
    sine, cosine = np.sin(angle) / angle, np.cos(angle)
    a, b = (1 - cosine) / s, (1 - sine) / s
    return a, (sine / 2 - a) / s, b, ((sine - cosine) / (2 * s) - b) / s


@part
def _turn(phi: Array, pose: Array, tangent: Array, turning: Array) -> None:
    """Rotation, T and factors of a rotation vector."""
    s = dot3(phi, phi)
    a, a_slope, b, b_slope = turn_factors(s)
    turning[0], turning[1], turning[2] = a_slope, b, b_slope
    for i in range(3):  # φ̃² = φ φᵀ - s
        for j in range(3):
            square = phi[i] * phi[j]
            pose[3 * i + j] = a * square
            tangent[i, j] = b * square
        pose[4 * i] += 1.0 - a * s
        tangent[i, i] += 1.0 - b * s
    turn = 1.0 - s * b
    for i, j, k in ((1, 0, 2), (0, 2, 1), (2, 1, 0)):
        f = phi[k]
        pose[3 * i + j] += turn * f
        pose[3 * j + i] -= turn * f
        tangent[i, j] -= a * f
        tangent[j, i] += a * f


@part
def place_node(node: Node, state: NodeState, q: Array) -> None:
    """Pose of a node, and what `move_node` needs of it."""
    e, place, phi = len(q), state.pose[9:12], state.phi
    for i in range(3):
        place[i], phi[i] = node.position[i], 0.0
    add_rows(node.shapes[:3], q, 1.0, place)
    add_rows(node.shapes[3:], q, 1.0, phi)
    for i in range(6):
        for j in range(e):
            state.rows[i, j] = node.shapes[i, j]
    if state.slope.shape[1] > 0:
        slope = state.slope.reshape(6 * e)
        clear(slope)
        add_columns(node.second_order, q, 1.0, slope)
        add_rows(state.slope[:3], q, 0.5, place)
        add_rows(state.slope[3:], q, 0.5, phi)
        for i in range(6):
            for j in range(e):
                state.rows[i, j] += state.slope[i, j]
    _turn(phi, state.pose, state.tangent, state.turning)
    invert_pose(state.pose, state.back)


@part
def to_node_axes(pose: Array, tangent: Array, x: Array) -> None:
    """Replace rates of (u, φ) by the twist that they make, in the node's axes."""
    u0, u1, u2, f0, f1, f2 = x[0], x[1], x[2], x[3], x[4], x[5]
    for i in range(3):
        x[i] = pose[i] * u0 + pose[3 + i] * u1 + pose[6 + i] * u2
        x[3 + i] = tangent[i, 0] * f0 + tangent[i, 1] * f1 + tangent[i, 2] * f2


@part
def from_node_axes(pose: Array, tangent: Array, wrench: Array, out: Array) -> None:
    """Forces on (u, φ) of a wrench in the node's axes; the transpose of `to_node_axes`."""
    for i in range(3):
        out[i] = pose[3 * i] * wrench[0] + pose[3 * i + 1] * wrench[1] + pose[3 * i + 2] * wrench[2]
        out[3 + i] = tangent[0, i] * wrench[3] + tangent[1, i] * wrench[4] + tangent[2, i] * wrench[5]


@part
def _turning_rate(phi: Array, change: Array, turning: Array, out: Array) -> None:
    """Add Ṫ φ̇ to the last three of ``out``; ``change`` is φ̇."""
    f0, f1, f2, d0, d1, d2 = phi[0], phi[1], phi[2], change[0], change[1], change[2]
    o0, o1, o2 = f1 * d2 - f2 * d1, f2 * d0 - f0 * d2, f0 * d1 - f1 * d0  # φ × φ̇
    s_rate = 2.0 * (f0 * d0 + f1 * d1 + f2 * d2)
    once, twice, b = -turning[0] * s_rate, turning[2] * s_rate, turning[1]
    out[3] += twice * (f1 * o2 - f2 * o1) + once * o0 + b * (d1 * o2 - d2 * o1)
    out[4] += twice * (f2 * o0 - f0 * o2) + once * o1 + b * (d2 * o0 - d0 * o2)
    out[5] += twice * (f0 * o1 - f1 * o0) + once * o2 + b * (d0 * o1 - d1 * o0)


@part
def move_node(node: Node, state: NodeState, rates: Array, accelerations: Array) -> None:
    """Twist of a node and its rate, at η̈ = 0 where ``accelerations`` is empty."""
    e, twist, rate = len(rates), state.twist, state.twist_rate
    clear(twist)
    clear(rate)
    add_rows(state.rows, rates, 1.0, twist)
    if len(accelerations) > 0:
        add_rows(state.rows, accelerations, 1.0, rate)
    if state.slope.shape[1] > 0:
        slope_rate = state.slope_rate.reshape(6 * e)
        clear(slope_rate)
        add_columns(node.second_order, rates, 1.0, slope_rate)
        add_rows(state.slope_rate, rates, 1.0, rate)
    for i in range(3):
        state.phi_rate[i] = twist[3 + i]
    to_node_axes(state.pose, state.tangent, twist)
    to_node_axes(state.pose, state.tangent, rate)
    add_cross(twist[:3], twist[3:], 1.0, rate[:3])
    _turning_rate(state.phi, state.phi_rate, state.turning, rate)


@part
def node_moves(state: NodeState) -> None:
    """Twist of a node per η̇."""
    x = state.twist
    for j in range(state.rows.shape[1]):
        for i in range(6):
            x[i] = state.rows[i, j]
        to_node_axes(state.pose, state.tangent, x)
        for i in range(6):
            state.moves[i, j] = x[i]

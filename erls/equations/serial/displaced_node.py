"""Motion of a node of a link whose coordinates are small displacements: moved by u, turned by φ.

The turn is Cayley's, R = 1 + (φ̃ + φ̃²/2)/(1 + φ²/4), which agrees with exp φ̃ to second order; its angular velocity
in its own axes is (φ̇ - φ × φ̇/2)/(1 + φ²/4). u and φ are linear in the coordinates q, with ½ qᵀ Ψ q where they are of
second order.
"""

from __future__ import annotations

from typing import Any

from erls.maths.jit import part
from erls.maths.products import add_rows, clear
from erls.maths.so3 import Array
from erls.maths.spatial import dot3


@part
def turn_of(phi: Array, pose: Array) -> Any:
    """R into a pose (12,), whose place is left alone; 1 + φ²/4."""
    a, b, c = phi[0], phi[1], phi[2]
    size = 1.0 + (a * a + b * b + c * c) / 4
    pose[0], pose[4], pose[8] = -(b * b + c * c) / 2, -(a * a + c * c) / 2, -(a * a + b * b) / 2
    pose[1], pose[2], pose[5] = a * b / 2 - c, a * c / 2 + b, b * c / 2 - a
    pose[3], pose[6], pose[7] = a * b / 2 + c, a * c / 2 - b, b * c / 2 + a
    for i in range(9):
        pose[i] = pose[i] / size
    for i in range(3):
        pose[4 * i] += 1.0
    return size


@part
def rates_to_twist(pose: Array, phi: Array, size: Any, x: Array) -> None:
    """Rates of (u, φ) become a twist in the node's own axes: Rᵀ u̇, (φ̇ - φ × φ̇/2)/size."""
    u, v, w = x[0], x[1], x[2]
    for i in range(3):
        x[i] = pose[i] * u + pose[3 + i] * v + pose[6 + i] * w
    u, v, w = x[3], x[4], x[5]
    x[3] = (u - (phi[1] * w - phi[2] * v) / 2) / size
    x[4] = (v - (phi[2] * u - phi[0] * w) / 2) / size
    x[5] = (w - (phi[0] * v - phi[1] * u) / 2) / size


@part
def move_node(
    position: Array, shapes: Array, bows: Array, q: Array, rate: Array, acceleration: Array, pose: Array, twist: Array,
    twist_rate: Array, rows: Array, displacement: Array,
) -> None:  # fmt: skip
    """A node relative to its link's frame.

    Parameters
    ----------
    position : (3,) array
        Undeformed, in the link's frame.
    shapes : (6, n) array
        (u, φ) per coordinate.
    bows : (6, n, n) array
        Ψ; no rows where there is none.
    q, rate, acceleration : (n,) arrays
        Coordinates and derivatives.
    pose, twist, twist_rate, rows, displacement : arrays
        Get pose (12,) and twist (6,) with its derivative in the node's own axes, its rows (6, n) over the rates of the
        coordinates, and (u, φ) (6,).
    """
    clear(displacement)
    clear(twist)
    clear(twist_rate)
    add_rows(shapes, q, 1.0, displacement)
    for i in range(6):
        for j in range(len(q)):
            rows[i, j] = shapes[i, j]
    for i in range(len(bows)):
        for j in range(len(q)):
            slope = curved = 0.0 * q[j]
            for k in range(len(q)):
                slope += bows[i, j, k] * q[k]
                curved += bows[i, j, k] * rate[k]
            rows[i, j] += slope
            displacement[i] += slope * q[j] / 2
            twist_rate[i] += curved * rate[j]
    add_rows(rows, rate, 1.0, twist)
    add_rows(rows, acceleration, 1.0, twist_rate)
    phi = displacement[3:]
    size = turn_of(phi, pose)
    for i in range(3):
        pose[9 + i] = position[i] + displacement[i]
    slip = dot3(phi, twist[3:]) / (2 * size)
    rates_to_twist(pose, phi, size, twist)
    rates_to_twist(pose, phi, size, twist_rate)
    for j in range(len(q)):
        rates_to_twist(pose, phi, size, rows[:, j])
    v0, v1, v2, w0, w1, w2 = twist[0], twist[1], twist[2], twist[3], twist[4], twist[5]
    twist_rate[0] += v1 * w2 - v2 * w1
    twist_rate[1] += v2 * w0 - v0 * w2
    twist_rate[2] += v0 * w1 - v1 * w0
    twist_rate[3] -= w0 * slip
    twist_rate[4] -= w1 * slip
    twist_rate[5] -= w2 * slip

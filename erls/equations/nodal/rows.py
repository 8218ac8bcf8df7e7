"""Forces along one direction: a row over the twists of two nodes, of which either may be the ground."""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.maths.jit import part
from erls.maths.vectors import Twist, add, dot, put, scaled, three


@part
def rate_along(row: Twist, values: Array, node: int) -> float:
    """A node's share of a rate: its part of the row times the twists in ``values``; none of the ground."""
    if node < 0:
        return 0.0 * row[0][0]
    return dot(row[0], three(values, 6 * node)) + dot(row[1], three(values, 6 * node + 3))


@part
def push(out: Array, node: int, strength: float, row: Twist) -> None:
    """Add a node's share of a force along the row."""
    if node >= 0:
        add(out, 6 * node, scaled(strength, row[0]))
        add(out, 6 * node + 3, scaled(strength, row[1]))


@part
def outer_product(
    block: Array, line: Array, first: Twist, second: Twist, stiffness: float, damping: float, mass: float
) -> None:
    """Stiffness, damping and mass along the row into a block (3, 12, 12); ``line`` (12,) is memory."""
    put(line, 0, first[0])
    put(line, 3, first[1])
    put(line, 6, second[0])
    put(line, 9, second[1])
    for i in range(12):
        for j in range(12):
            both = line[i] * line[j]
            block[0, i, j] = mass * both
            block[1, i, j] = damping * both
            block[2, i, j] = stiffness * both

"""What independent coordinates y are to the steps of generalized-α: configurations that add, knots of y, v and a."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.stepped import COMPOSE, SETTLE, Stepped
from erls.maths.jit import kernel


@kernel(COMPOSE, counted=False)
def add(
    reals: Array, integers: IntArray, scratch: Array, metres: Array, start: Array, increment: Array, out: Array
) -> float:
    """Add; the largest coordinate in metres."""
    largest = 0.0
    for i in range(len(out)):
        out[i] = start[i] + increment[i]
        largest = max(largest, abs(metres[i] * out[i]))
    return largest


@kernel(SETTLE, counted=False)
def keep(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, knot: Array) -> int:
    """A knot."""
    for i in range(len(y)):
        knot[0, i], knot[1, i], knot[2, i] = y[i], v[i], a[i]
    return 0


def independent(system: contract.CompiledSystem) -> Stepped:
    """A compiled system of independent coordinates, as steps take it."""
    return Stepped(
        system.size,
        0,
        system.size,
        True,
        system.reals,
        system.integers,
        system.scratch,
        add,
        system.residual,
        keep,
        system.mass_matrix,
        system.stiffness_and_damping,
        system.factoring,
        lambda y: y,
        lambda y: y.copy(),
    )

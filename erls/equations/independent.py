"""What independent coordinates y are to the steps of generalized-α: configurations that add, knots of y, v and a.

With them stand-ins, never called: for a system without `erls.equations.compiled_system.Factoring`, whose matrices get
dense factors, and for one that has its own and no matrices.
"""

from __future__ import annotations

from typing import Any

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
def keep(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, knot: Array
) -> int:
    """A knot."""
    for i in range(len(y)):
        knot[0, i], knot[1, i], knot[2, i] = y[i], v[i], a[i]
    return 0


@kernel(contract.FACTOR, counted=False)
def _factor(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: float, b: float, factors: Array
) -> int:
    return 0


@kernel(contract.SOLVE, counted=False)
def _solve(reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
    pass


@kernel(contract.FACTOR_COMPLEX, counted=False)
def _factor_complex(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: complex, b: complex, factors: Any
) -> int:
    return 0


@kernel(contract.SOLVE_COMPLEX, counted=False)
def _solve_complex(reals: Array, integers: IntArray, factors: Any, b: Any) -> None:
    pass


@kernel(contract.MASS_MATRIX, counted=False)
def no_mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """Never called."""


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def no_stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """Never called."""


ABSENT = contract.Factoring(0, _factor, _solve, _factor_complex, _solve_complex)


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

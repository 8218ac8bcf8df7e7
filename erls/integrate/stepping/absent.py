"""Stand-ins, never called, where a system has no `erls.equations.compiled_system.Factoring`: its matrices get dense
factors.
"""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.maths.jit import kernel


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


FACTORING = contract.Factoring(0, _factor, _solve, _factor_complex, _solve_complex)

"""Solving with the factors of M + α C + β K, link by link; see `erls.equations.compiled_system`."""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.erls.link_by_link import solve_links
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.SOLVE, counted=False)
def solve(reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
    """With real numbers."""
    solve_links(reals, integers, factors, b)


@kernel(contract.SOLVE_COMPLEX, counted=False)
def solve_complex(reals: Array, integers: IntArray, factors: Any, b: Any) -> None:
    """With complex numbers."""
    solve_links(reals, integers, factors, b)

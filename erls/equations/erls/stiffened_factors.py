"""Factors of M + α C + β K of a chain whose links have second-order displacements."""

from __future__ import annotations

from typing import Any

from erls.equations import compiled_system as contract
from erls.equations.erls.link_by_link import factor_links
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.FACTOR, counted=False)
def factor(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, alpha: float, beta: float,
    factors: Array,
) -> int:  # fmt: skip
    """With real numbers."""
    return int(factor_links(reals, integers, scratch, t, y, v, alpha, beta, factors, False, True))


@kernel(contract.FACTOR_COMPLEX, counted=False)
def factor_complex(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, alpha: complex, beta: complex,
    factors: Any,
) -> int:  # fmt: skip
    """With complex numbers."""
    return int(factor_links(reals, integers, scratch, t, y, v, alpha, beta, factors, False, True))

"""What a compiled system offers: M(y, t) a = f(t, y, v) as functions on arrays, for integrators that are compiled too.

All constants of a system lie in two arrays, ``reals`` and ``integers``, laid out as its author likes; ``scratch`` is
memory that its functions may use within a call. Coordinates and norms are those of
`erls.integrators.base.SecondOrderSystem`, of which this is the compiled form:

    residual(reals, integers, scratch, t, y, v, a, out)              out (n,)   = M a - f
    mass_matrix(reals, integers, scratch, t, y, out)                 out (n, n) = M
    stiffness_and_damping(reals, integers, scratch, t, y, v, k, c)   k, c (n, n): stiff parts of -∂f/∂y and -∂f/∂v
    acceleration(reals, integers, scratch, t, y, v, out) -> status   out (n,) = M⁻¹ f; status 0, or 1 + the number of a
                                                                     coordinate whose motion nothing resists
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from erls.kernels.jit import ENABLED

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

REALS: Any
INTEGERS: Any
MATRIX: Any
RESIDUAL: Any
MASS_MATRIX: Any
STIFFNESS_AND_DAMPING: Any
ACCELERATION: Any
if ENABLED:
    from numba import types as _t

    REALS, INTEGERS, MATRIX = _t.float64[::1], _t.int64[::1], _t.float64[:, ::1]
    _constants = (REALS, INTEGERS, REALS, _t.float64)
    RESIDUAL = _t.void(*_constants, REALS, REALS, REALS, REALS)
    MASS_MATRIX = _t.void(*_constants, REALS, MATRIX)
    STIFFNESS_AND_DAMPING = _t.void(*_constants, REALS, REALS, MATRIX, MATRIX)
    ACCELERATION = _t.int64(*_constants, REALS, REALS, REALS)
else:
    REALS = INTEGERS = MATRIX = RESIDUAL = MASS_MATRIX = STIFFNESS_AND_DAMPING = ACCELERATION = None


def pointer(signature: Any) -> Any:
    """Type of an argument that is a function of this signature."""
    if not ENABLED:
        return None
    from numba import types

    return types.FunctionType(signature)


@dataclass(frozen=True)
class CompiledSystem:
    """A system in compiled form; see the module's docstring for the functions."""

    size: int
    reals: Array
    integers: IntArray
    scratch: Array
    residual: Callable[..., None]
    mass_matrix: Callable[..., None]
    stiffness_and_damping: Callable[..., None]
    acceleration: Callable[..., int]

"""What a compiled system offers: M(y, t) a = f(t, y, v) as functions on arrays, for integrators that are compiled too.

All constants of a system lie in two arrays, ``reals`` and ``integers``, laid out as its author likes; ``scratch`` is
memory that its functions may use within a call. Coordinates and norms are those of
`erls.integrate.base.SecondOrderSystem`, of which this is the compiled form:

    residual(reals, integers, scratch, t, y, v, a, out)              out (n,)   = M a - f
    mass_matrix(reals, integers, scratch, t, y, out)                 out (n, n) = M
    stiffness_and_damping(reals, integers, scratch, t, y, v, k, c)   k, c (n, n): stiff parts of -∂f/∂y and -∂f/∂v
    acceleration(reals, integers, scratch, t, y, v, out) -> status   out (n,) = M⁻¹ f; status 0, or 1 + the number of a
                                                                     coordinate whose motion nothing resists

A tree of links says how frames move that loops hold (`erls.mechanism.loops.loop_ends`):

    frames(reals, integers, scratch, t, y, v, out)                   row of out: pose (12,) in the world, twist (6,) and
                                                                     its rate (6,) at zero accelerations, rows of the
                                                                     twist (6, n + p) over the velocities and the rates
                                                                     of the p prescribed joints, in the frame's axes

A system may know better than dense factors how to solve (M + α C + β K) x = b with its mass, damping and stiffness at a
state; α and β are real or complex, like ``factors`` and ``b``:

    factor(reals, integers, scratch, t, y, v, α, β, factors) -> status
    solve(reals, integers, factors, b)                               b (n,) becomes x
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from erls.maths.calls import caller, handed
from erls.maths.jit import ENABLED

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

REALS: Any
INTEGERS: Any
MATRIX: Any
RESIDUAL: Any
MASS_MATRIX: Any
STIFFNESS_AND_DAMPING: Any
ACCELERATION: Any
COMPLEX: Any
FACTOR: Any
SOLVE: Any
FACTOR_COMPLEX: Any
SOLVE_COMPLEX: Any
ENERGY: Any
STATES: Any
FRAMES: Any
if ENABLED:
    from numba import types as _t

    REALS, INTEGERS, MATRIX = _t.float64[::1], _t.int64[::1], _t.float64[:, ::1]
    _constants = (REALS, INTEGERS, REALS, _t.float64)
    RESIDUAL = _t.void(*_constants, REALS, REALS, REALS, REALS)
    MASS_MATRIX = _t.void(*_constants, REALS, MATRIX)
    STIFFNESS_AND_DAMPING = _t.void(*_constants, REALS, REALS, MATRIX, MATRIX)
    ACCELERATION = _t.int64(*_constants, REALS, REALS, REALS)
    COMPLEX = _t.complex128[::1]
    FACTOR = _t.int64(*_constants, REALS, REALS, _t.float64, _t.float64, REALS)
    SOLVE = _t.void(REALS, INTEGERS, REALS, REALS)
    FACTOR_COMPLEX = _t.int64(*_constants, REALS, REALS, _t.complex128, _t.complex128, COMPLEX)
    SOLVE_COMPLEX = _t.void(REALS, INTEGERS, COMPLEX, COMPLEX)
    ENERGY = _t.void(*_constants, REALS, REALS, REALS)
    STATES = _t.void(REALS, INTEGERS, REALS, REALS, MATRIX, MATRIX, MATRIX)
    FRAMES = _t.void(*_constants, REALS, REALS, MATRIX)
else:
    REALS = INTEGERS = MATRIX = RESIDUAL = MASS_MATRIX = STIFFNESS_AND_DAMPING = ACCELERATION = None
    COMPLEX = FACTOR = SOLVE = FACTOR_COMPLEX = SOLVE_COMPLEX = ENERGY = STATES = FRAMES = None


call_residual, call_mass_matrix, call_acceleration = caller(RESIDUAL), caller(MASS_MATRIX), caller(ACCELERATION)
call_stiffness_and_damping = caller(STIFFNESS_AND_DAMPING)
call_factor, call_solve = caller(FACTOR), caller(SOLVE)
call_factor_complex, call_solve_complex = caller(FACTOR_COMPLEX), caller(SOLVE_COMPLEX)


class Functions(NamedTuple):
    """What compiled loops call of a system, by address (`erls.maths.calls.handed`); 0 where it has none."""

    residual: int
    mass_matrix: int
    stiffness_and_damping: int
    factor: int
    solve: int
    factor_complex: int
    solve_complex: int


FUNCTIONS: Any = _t.NamedUniTuple(_t.int64, 7, Functions) if ENABLED else None


@dataclass(frozen=True)
class Factoring:
    """How a system solves with its iteration matrices; ``size`` is that of ``factors``, which start as zeros."""

    size: int
    factor: Callable[..., int]
    solve: Callable[..., None]
    factor_complex: Callable[..., int]
    solve_complex: Callable[..., None]


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
    load_acceleration: Callable[[], Callable[..., int]]
    factoring: Factoring | None = field(default=None, kw_only=True)
    load_frames: Callable[[], Callable[..., None]] | None = field(default=None, kw_only=True)

    def functions(self) -> Functions:
        """What loops call: as long as this process lives."""
        own = self.factoring
        return Functions(
            handed(self.residual, RESIDUAL),
            handed(self.mass_matrix, MASS_MATRIX),
            handed(self.stiffness_and_damping, STIFFNESS_AND_DAMPING),
            handed(own and own.factor, FACTOR),
            handed(own and own.solve, SOLVE),
            handed(own and own.factor_complex, FACTOR_COMPLEX),
            handed(own and own.solve_complex, SOLVE_COMPLEX),
        )

    @property
    def gripped_places(self) -> IntArray:
        """(q, 2) places in the working memory where forces leave rate and coordinate of each joint that may stick
        (`erls.equations.switches.gripped`).
        """
        return np.zeros((0, 2), dtype=np.int64)

    def gripped_laws(self, reals: Array) -> list[Array]:
        """Views (9,) of the friction of these joints among constants."""
        return []

    @cached_property
    def acceleration(self) -> Callable[..., int]:
        """Compiled when it is asked for: implicit integrators do without."""
        return self.load_acceleration()

    @cached_property
    def frames(self) -> Callable[..., None] | None:
        """Compiled when it is asked for: chains without loops do without."""
        return None if self.load_frames is None else self.load_frames()


def function_in(module: str, name: str) -> Callable[[], Callable[..., Any]]:
    """What loads a function from a module of kernels, which is compiled then."""
    return lambda: getattr(import_module(module), name)


def acceleration_in(module: str) -> Callable[[], Callable[..., int]]:
    """What loads ``acceleration`` from a module of kernels."""
    return lambda: getattr(import_module(module), "acceleration")  # noqa: B009

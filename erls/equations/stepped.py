"""What generalized-α takes of a system: configurations q that need not be vectors, and conditions Φ(t, q) = 0.

    M a + Bᵀ λ = f,  Φ(t, q) = 0,  q̇ = q · ṽ

The functions go by the signatures of `erls.equations.compiled_system`, with q (c,) for y, [a; λ] for a and
[M a + Bᵀ λ - f; Φ] for the residual; independent coordinates are the case without conditions. To them come

    compose(reals, integers, scratch, metres, q, d, out) -> extent   out (c,) = q ∘ exp(d); of its largest coordinate
                                                                     [m], whose rounding no iteration can undercut
    settle(reals, integers, scratch, t, q, v, a, knot) -> status     knot (3, s): what a run keeps of a step, with first
                                                                     and second derivative; not 0 refuses it

1. ``compose`` comes before ``residual``, and ``residual`` before ``factor`` at the same state: what they leave in
   ``scratch`` is still there.
2. With conditions, the residual is followed by the norms of M a - f and of Bᵀ λ, in newtons per metre of coordinate.
3. With m conditions, ``factor`` puts metres per unit of β λ of each into the first m of its numbers, and metres per
   unit of Φ into the next m; ``solve`` then takes [b; Φ] to [x; β λ] with (M + α C + β K) x + Bᵀ β λ = b and
   B x = Φ. These stay well conditioned as the step, and β with it, tends to zero.
4. Of a configuration that is tried, ``compose`` may leave out what only the next step needs: ``settle``, which comes
   last, puts it into ``q``.
5. The first numbers of ``scratch`` are the system's samples at the time of the step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import INTEGERS, MATRIX, REALS, Array, Factoring, IntArray
from erls.maths.calls import caller, handed
from erls.maths.jit import ENABLED

COMPOSE: Any = None
SETTLE: Any = None
if ENABLED:
    from numba import types as _t

    COMPOSE = _t.float64(REALS, INTEGERS, REALS, REALS, REALS, REALS, REALS)
    SETTLE = _t.int64(REALS, INTEGERS, REALS, _t.float64, REALS, REALS, REALS, MATRIX)

call_compose, call_settle = caller(COMPOSE), caller(SETTLE)


class StepFunctions(NamedTuple):
    """What compiled steps call, by address (`erls.maths.calls.handed`); 0 where a system has none."""

    compose: int
    residual: int
    settle: int
    mass_matrix: int
    stiffness_and_damping: int
    factor: int
    solve: int


STEP_FUNCTIONS: Any = _t.NamedUniTuple(_t.int64, 7, StepFunctions) if ENABLED else None


def _not_refused(t: float, q: Any, v: Array) -> None:
    pass


def _no_samples(times: Array) -> Array:
    return np.zeros((len(times), 0))


@dataclass(frozen=True)
class Stepped:
    """A system, compiled or not, as steps of generalized-α take it.

    Attributes
    ----------
    size, conditions, kept : int
        n, m and s.
    compiled : bool
        Whether all functions are.
    mass_matrix, stiffness_and_damping : callable or None
        None where factors are its own.
    factoring : Factoring or None
        None where there are no conditions and dense factors will do.
    pack, unpack : callable
        Numbers (c,) of a configuration, and the other way.
    samples : callable
        (times, ...) numbers that depend on time alone.
    refuse : callable
        ``refuse(t, q, v)`` raises why ``settle`` refused a knot.
    """

    size: int
    conditions: int
    kept: int
    compiled: bool
    reals: Array
    integers: IntArray
    scratch: Array
    compose: Callable[..., float]
    residual: Callable[..., None]
    settle: Callable[..., int]
    mass_matrix: Callable[..., None] | None
    stiffness_and_damping: Callable[..., None] | None
    factoring: Factoring | None
    pack: Callable[[Any], Any]
    unpack: Callable[[Any], Any]
    samples: Callable[[Array], Array] = _no_samples
    refuse: Callable[[float, Any, Array], None] = _not_refused

    def functions(self) -> StepFunctions:
        """What steps call: as long as this process lives."""
        own = self.factoring
        return StepFunctions(
            handed(self.compose, COMPOSE),
            handed(self.residual, contract.RESIDUAL),
            handed(self.settle, SETTLE),
            handed(self.mass_matrix, contract.MASS_MATRIX),
            handed(self.stiffness_and_damping, contract.STIFFNESS_AND_DAMPING),
            handed(own and own.factor, contract.FACTOR),
            handed(own and own.solve, contract.SOLVE),
        )

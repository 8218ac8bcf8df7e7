"""Any system with the signatures of `erls.equations.compiled_system`, for loops that run as plain Python.

What the systems raise goes through.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from erls.equations.compiled_system import CompiledSystem, Factoring, IntArray
from erls.equations.consistency import consistent_velocity
from erls.equations.constrained_system import Configuration, ConstrainedSystem
from erls.equations.stepped import Stepped
from erls.equations.system import SecondOrderSystem, metre_scales
from erls.maths.saddle import Saddle, Scales
from erls.maths.so3 import Array


def uncompiled(system: SecondOrderSystem) -> CompiledSystem:
    """The functions of a system in independent coordinates."""
    none: IntArray = np.zeros(0, dtype=np.int64)

    def residual(
        reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
    ) -> None:
        out[:] = system.residual(t, y, v, a)

    def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
        out[:] = system.mass_matrix(t, y)

    def stiffness_and_damping(
        reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
    ) -> None:
        k[:], c[:] = system.stiffness_and_damping(t, y, v)

    def acceleration(
        reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array
    ) -> int:
        out[:] = system.acceleration(t, y, v)
        return 0

    empty = np.zeros(0)
    return CompiledSystem(
        system.size, empty, none, empty, residual, mass_matrix, stiffness_and_damping, lambda: acceleration
    )


def steps_of(system: SecondOrderSystem) -> Stepped:
    """The same as steps of generalized-α take it, with factors by LAPACK."""
    plain, per = uncompiled(system), 1 / metre_scales(system)
    known: list[tuple[Array, Array]] = []

    def compose(
        reals: Array, integers: IntArray, scratch: Array, metres: Array, start: Array, d: Array, out: Array
    ) -> float:
        out[:] = start + d
        return float(np.abs(metres * out).max())

    def settle(
        reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, knot: Array
    ) -> int:
        knot[:] = y, v, a
        return 0

    def factor(
        reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: float, b: float, out: Array
    ) -> int:
        stiffness, damping = system.stiffness_and_damping(t, y, v)
        matrix = system.mass_matrix(t, y) + a * damping + b * stiffness
        factors, pivots, status = dgetrf(per[:, None] * matrix * per)
        known[:] = [(factors, pivots)]
        return int(status)

    def solve(reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
        b[:] = per * dgetrs(*known[0], per * b)[0]

    n = system.size
    return Stepped(
        n,
        0,
        n,
        False,
        plain.reals,
        plain.integers,
        plain.scratch,
        compose,
        plain.residual,
        settle,
        plain.mass_matrix,
        plain.stiffness_and_damping,
        Factoring(1, factor, solve, factor, solve),
        lambda y: y,
        lambda y: y.copy(),
    )


class _Tied:
    """A `ConstrainedSystem` as steps take it: a configuration is one object in an array."""

    def __init__(self, system: ConstrainedSystem, project: bool) -> None:
        self.system, self.project = system, project
        self.n, self.m = system.size, system.constraints
        self.metres = metre_scales(system)
        self.reach = float(self.metres.max(initial=1.0))
        self.increment = self.accelerations = self.multipliers = np.zeros(0)
        self.saddle: Saddle

    def compose(
        self, reals: Array, integers: IntArray, scratch: Array, metres: Array, start: Any, d: Array, out: Any
    ) -> float:
        self.increment = d.copy()
        out[0] = self.system.compose(start[0], self.increment)
        return self.reach

    def residual(
        self, reals: Array, integers: IntArray, scratch: Array, t: float, q: Any, v: Array, a: Array, out: Array
    ) -> None:
        system, n, m = self.system, self.n, self.m
        self.accelerations, self.multipliers = a[:n].copy(), a[n:].copy()
        force = system.residual(t, q[0], v.copy(), self.accelerations)
        reaction = system.constraint_matrix(t, q[0]).T @ self.multipliers
        out[:n], out[n : n + m] = force + reaction, system.constraint(t, q[0])
        out[n + m :] = [float(np.linalg.norm(part / self.metres)) for part in (force, reaction)]

    def factor(
        self, reals: Array, integers: IntArray, scratch: Array, t: float, q: Any, v: Array, a: float, b: float, out: Any
    ) -> int:
        system, m = self.system, self.m
        stiffness, damping = system.stiffness_and_damping(t, q[0], v.copy(), self.accelerations, self.multipliers)
        mass, rows = system.mass_matrix(t, q[0]), system.constraint_matrix(t, q[0])
        tangent = system.tangent(self.increment)
        turned, rows_turned = (stiffness, rows) if tangent is None else (stiffness @ tangent, rows @ tangent)
        scales = Scales(self.metres, mass, rows)
        self.saddle = Saddle(mass + a * damping + b * turned, rows.T, rows_turned, scales, 1.0)
        out[:m], out[m : 2 * m] = self.saddle.force / scales.constraint, scales.constraint
        return 0 if self.saddle.singular is None else self.saddle.singular + 1

    def solve(self, reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
        saddle, n = self.saddle, self.n
        b[:] = np.concatenate(saddle.unscaled(saddle.solve(saddle.scaled(b[:n], b[n:]))))

    def settle(
        self, reals: Array, integers: IntArray, scratch: Array, t: float, q: Any, v: Array, a: Array, knot: Array
    ) -> int:
        if self.project:
            v[:] = consistent_velocity(self.system, t, q[0], v.copy())
        knot[:] = self.system.stored(t, q[0], v.copy(), a[: self.n].copy())
        return 0


def tied_steps_of(system: ConstrainedSystem, kept: int, project: bool) -> Stepped:
    """A system with constraints as steps of generalized-α take it.

    Parameters
    ----------
    system : ConstrainedSystem
    kept : int
        Numbers that it stores of a knot.
    project : bool
        Move velocities onto the constraints after every step.
    """
    tied, none = _Tied(system, project), np.zeros(0)

    def pack(q: Configuration) -> Any:
        found = np.empty(1, dtype=object)
        found[0] = q
        return found

    return Stepped(
        tied.n,
        tied.m,
        kept,
        False,
        none,
        np.zeros(0, dtype=np.int64),
        none,
        tied.compose,
        tied.residual,
        tied.settle,
        None,
        None,
        Factoring(max(1, 2 * tied.m), tied.factor, tied.solve, tied.factor, tied.solve),
        pack,
        lambda array: array[0],
    )

"""The error that other equations of motion make, from the exact error equation along a computed motion.

Let (y, v, a) be the knots of a motion that some equations gave, and R(t, y, v, a) = M a - f those of another system.
Its motion from the same start is y + e with

    R(t, y + e, v + ė, a + ë) = r(t),

where r holds what the knots themselves leave out of balance. At e = 0 the left-hand side is the force by which the two
systems differ, evaluated along the computed motion; it drives e. Nothing is linearized, and since the motion itself is
known, the steps need to resolve e alone: generalized-α with a frozen iteration matrix over every few knots, compiled
where both systems are (`erls.auto.deviation`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.auto.coordinates import embedded
from erls.equations.compiled_system import CompiledSystem
from erls.equations.quick import quick
from erls.equations.system import SecondOrderSystem, metre_scales
from erls.errors import Cause, SimulationError
from erls.maths.jit import plain
from erls.maths.so3 import Array
from fe_import.model import IntArray

RADIUS = 0.7  # numerical damping of what the steps do not resolve
_HAIR = 2e-12  # of the run: forces jump at the ends of a leg
_FINER = 4  # times as many steps, where the iteration fails


@dataclass(frozen=True)
class Knots:
    """Knots of a motion between two jumps: times (k,) at which forces may be asked for, and y, v, a (k, n)."""

    t: Array
    y: Array
    v: Array
    a: Array

    @classmethod
    def inside(cls, t: Array, y: Array, v: Array, a: Array) -> Knots:
        """Times moved by a hair from jumps at the ends."""
        hair = min(_HAIR * max(1.0, abs(t[0]), abs(t[-1])), (t[-1] - t[0]) / 4)
        return cls(np.clip(t, t[0] + hair, t[-1] - hair), y, v, a)

    def some(self, stride: int) -> Knots:
        """Every so many of them, and the last one."""
        at = np.unique(np.append(np.arange(0, len(self.t), stride), len(self.t) - 1))
        return Knots(self.t[at], self.y[at], self.v[at], self.a[at])


@dataclass(frozen=True)
class Deviation:
    """The other system's motion along a computed one.

    Attributes
    ----------
    t : (k,) array
    y, v : (k, m) arrays
        The computed motion.
    error, rate : (k, n) arrays
        e and ė.
    """

    t: Array
    y: Array
    v: Array
    error: Array
    rate: Array


def error_motion(
    system: SecondOrderSystem,
    lesser: SecondOrderSystem,
    kept: IntArray,
    legs: Sequence[Knots],
    start: tuple[Array, Array],
    strides: Sequence[int],
    accuracy: float,
) -> Deviation:
    """Integrate the error along a motion.

    Parameters
    ----------
    system : SecondOrderSystem
        R.
    lesser : SecondOrderSystem
        What gave the motion, with m coordinates.
    kept : (m,) int array
        Their places among those of ``system``.
    legs : sequence of Knots
        The motion.
    start : (n,), (n,) arrays
        e and ė at the first knot.
    strides : sequence of int
        Knots per step in each leg; less where the iteration needs it.
    accuracy : float
        Error that does not matter [m].

    Raises
    ------
    SimulationError
        NEWTON_FAILED.
    """
    follower = _Follower(system, lesser, kept, accuracy, float(legs[-1].t[-1] - legs[0].t[0]))
    e, rate = start
    parts: list[tuple[Knots, Array]] = []
    for leg, wanted in zip(legs, strides, strict=True):
        stride = wanted
        while True:
            knots = leg.some(stride)
            found = follower.leg(knots, e, rate)
            if isinstance(found, np.ndarray):
                break
            if stride == 1:
                message = "the error of what was left out cannot be followed"
                where = f"t = {knots.t[found]:.6g} s"
                raise SimulationError(Cause.NEWTON_FAILED, message, where=where, remedy="use effects = 'all'")
            stride = max(1, stride // _FINER)
        e, rate = found[-1]
        parts.append((knots, found))
    return Deviation(
        np.concatenate([k.t for k, _ in parts]),
        np.concatenate([k.y for k, _ in parts]),
        np.concatenate([k.v for k, _ in parts]),
        np.concatenate([f[:, 0] for _, f in parts]),
        np.concatenate([f[:, 1] for _, f in parts]),
    )


class _Follower:
    """Memory of the loop (`erls.auto.deviation`) over a motion."""

    def __init__(
        self, system: SecondOrderSystem, lesser: SecondOrderSystem, kept: IntArray, accuracy: float, duration: float
    ) -> None:
        from erls.auto import deviation as loop  # here: it imports the compiler

        n = system.size
        self.system, self.lesser, self.kept, self.loop = quick(system), quick(lesser), kept, loop
        self.functions, self.lesser_functions, compiled = _functions(system, lesser)
        self.called, self.called_lesser = self.functions.functions(), self.lesser_functions.functions().residual
        self.follow = loop.follow if compiled else plain(loop.follow, within=False)
        alpha_m, alpha_f = (2 * RADIUS - 1) / (RADIUS + 1), RADIUS / (RADIUS + 1)
        gamma = 0.5 + alpha_f - alpha_m
        self.known = np.zeros(loop.KNOWN)
        self.known[[loop.ALPHA_M, loop.ALPHA_F, loop.GAMMA]] = alpha_m, alpha_f, gamma
        self.known[[loop.BETA, loop.ACCURACY, loop.DURATION]] = 0.25 * (gamma + 0.5) ** 2, accuracy, duration
        self.state, self.lesser_state = np.zeros((loop.STATE, n)), np.zeros((loop.LESSER_STATE, len(kept)))
        self.state[loop.METRES] = metre_scales(system)
        self.matrices, self.pivots = np.zeros((4, n, n)), np.zeros(n, dtype=np.int64)

    def leg(self, leg: Knots, e: Array, rate: Array) -> Array | int:
        """(k, 2, n) e and ė at the knots of a leg; the number of the knot where the iteration fails."""
        loop, known, state = self.loop, self.known, self.state
        known[[loop.H, loop.FACTORED]] = 0.0
        for row, start in ((loop.E, e), (loop.RATE, rate)):
            state[row] = start
        state[[loop.ACC, loop.ALG]] = self.acceleration(leg, e, rate)
        found = np.empty((len(leg.t), 2, self.system.size))
        system, lesser = self.functions, self.lesser_functions
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # infinities are found and reported
            reached = self.follow(
                self.called,
                system.reals,
                system.integers,
                system.scratch,
                self.called_lesser,
                lesser.reals,
                lesser.integers,
                lesser.scratch,
                self.kept,
                leg.t,
                np.stack([leg.y, leg.v, leg.a], axis=1),
                known,
                state,
                self.lesser_state,
                self.matrices,
                self.pivots,
                found,
            )
        return found if reached > 0 else -reached

    def acceleration(self, leg: Knots, e: Array, rate: Array) -> Array:
        """ë at the first knot of a leg."""
        t, size = float(leg.t[0]), self.system.size
        y, v, a = (embedded(x[0], self.kept, size) for x in (leg.y, leg.v, leg.a))
        force = self.system.residual(t, y + e, v + rate, a)
        if len(self.kept):
            force = force - embedded(self.lesser.residual(t, leg.y[0], leg.v[0], leg.a[0]), self.kept, size)
        return np.asarray(np.linalg.solve(self.system.mass_matrix(t, y + e), -force), dtype=float)


def _functions(system: SecondOrderSystem, lesser: SecondOrderSystem) -> tuple[CompiledSystem, CompiledSystem, bool]:
    """Functions of both as the loop calls them, and whether they are compiled."""
    from erls.equations.uncompiled import uncompiled

    ours, other = system.compiled, lesser.compiled
    if ours is not None and (other is not None or not lesser.size):
        return ours, other or ours, True
    return uncompiled(quick(system)), uncompiled(quick(lesser)), False

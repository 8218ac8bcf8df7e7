"""The error of an integration over the whole run: phase and drift included, whatever the method.

Let P interpolate the states at the ends of the steps of a run, and R(t, y, v, a) = M a - f be its equations. The exact
motion from the same start is P + e with

    R(t, P + e, Ṗ + ė, P̈ + ë) = 0,   e = ė = 0 at the start:

an equation for the global error e, driven by what P leaves out of balance, which is what the steps did wrong
(P. E. Zadunaisky, On the estimation of errors propagated in the numerical integration of ordinary differential
equations, Numer. Math. 27 (1976); R. D. Skeel, Thirteen ways to estimate global error, Numer. Math. 48 (1986)).
Nothing is linearized, so that growth of errors in chaotic motions shows as it is. P is Newton's polynomial through
positions and velocities at six ends of steps, or positions at ten, where steps leave vibrations unresolved, whose rates
say nothing (accelerations too where a leg has few): those are smooth in the order of the method, while inner stages are
not. Since e is small and wanted to a tenth, collocation at seven Lobatto nodes,
order 12, follows it in steps of one or several of the run, with the chord iteration of `erls.integrate.lobatto`.

Vibrations that the steps of e do not resolve would enter P̈ as noise. Residuals therefore pass
M Re (1 - i cot φ)(M + τ² exp(iφ) K)⁻¹, which lets the share 1/(1 + 2 cos φ (ωτ)² + (ωτ)⁴) of a mode through;
`erls.accuracy.vibrations` adds what faster ones lose of their phase, for a known method a closed form.

Where conditions tie coordinates, P between the nodes of a run violates them, and stiff links make large forces of that:
the error of loops is not found so.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import Legendre

from erls.equations.system import SecondOrderSystem, metre_scales
from erls.errors import SimulationError
from erls.integrate.base import Solution
from erls.integrate.charts import exchanged
from erls.integrate.lobatto import coefficients
from erls.maths.jit import plain
from erls.maths.so3 import Array
from fe_import.model import IntArray

STAGES = 6
"""Nodes of a step of e, less the first; vibrations of less than a radian between two of them are followed."""

ENDS, ENDS_STIFF = 6, 10
"""Ends of steps through which P goes, with rates or without."""

MERGED_SMOOTH, MERGED_RIGID = 3, 1
"""Steps of the run in one of the error, of motions without noise, and where no link bends: those in the middle of six
ends, where P is best; two or four lie askew, and are off by ten times as much. Of 23 rigid random scenes three finds
0.21 to 37 times the error, one 0.77 to 9 times, where that is more than iterations leave.
"""

_MERGED, _MERGED_LARGE = 6, 8  # the same of others, at the least: of systems up to, and above
_SHARP = 4  # times the frequency of the filter, of motions without noise
_LARGE = 15  # coordinates, whose factors cost more than evaluations
_COST = 0.2  # of the run's evaluations: what more steps are merged for
_ITERATIONS = 1.3  # per step, about
_SHARES = 0.1, 1e-6  # of the error so far: where the iterations of a step stop, at most and at least
_ALL_STEPS, _ALL_STEPS_SMOOTH = 0.5, 0.005  # the same over all steps of a run, of motions without noise
_NEGLIGIBLE = 0.02  # of the tolerance of integration: errors that need no iteration
_ROUNDING = 1e-15  # of the reach: the same of motions without noise, where disturbances of this size may grow
_HAIR = 2e-12  # of the run: forces jump at the ends of a leg


@dataclass(frozen=True)
class GlobalError:
    """The error of a motion, exact less computed.

    Attributes
    ----------
    t : (k,) array
        [s]
    y, v : (k, n) arrays
        The computed motion.
    error, rate : (k, n) arrays
        e and ė.
    filter : (k,) array
        τ of the low-pass filter [s].
    evaluations : int
        Of residuals.
    whole : bool
        Whether it could be followed to the end.
    """

    t: Array
    y: Array
    v: Array
    error: Array
    rate: Array
    filter: Array
    evaluations: int
    whole: bool


def global_error(
    system: SecondOrderSystem,
    solution: Solution,
    tolerance: float,
    reach: float,
    disturbance: float = 0.0,
    rotation_vectors: Sequence[int] = (),
    ends: int = 6,
    merged: int = MERGED_SMOOTH,
) -> GlobalError:
    """Follow the error of a run of which all steps were kept.

    Parameters
    ----------
    system : SecondOrderSystem
        What was integrated.
    solution : Solution
    tolerance : float
        At which the integration aimed [m].
    reach : float
        Of the mechanism [m]: an error of this size is not followed further.
    disturbance : float
        Error of each coordinate at the start, relative to the largest one in metres: rounding.
    rotation_vectors : sequence of int
        As of `erls.integrate.charts.exchanged`.
    ends : int
        Of steps, through which the motion is interpolated: `ENDS`, or `ENDS_STIFF` where steps leave vibrations
        unresolved, whose rates say nothing.
    merged : int
        Steps of the run in one of the error, with `ENDS`.
    """
    follower = _Follower(system, solution, tolerance, reach, ends, merged)
    n = system.size
    size = disturbance * max(float(np.abs(follower.metres * solution.y).max(initial=0.0)), 1e-3 * reach)
    signs = np.where(np.arange(n) % 2, -1.0, 1.0)
    e, rate = size * signs / follower.metres, np.zeros(n)
    parts: list[tuple[Array, IntArray, Array, Array]] = []
    before: int | None = None
    whole = True
    for first, end in _legs(solution):
        if before is not None:
            shifted = exchanged(solution.y[before] + e, solution.v[before] + rate, rotation_vectors)
            if not np.array_equal(solution.y[before], solution.y[first]):  # a rotation vector was exchanged
                e, rate = shifted[0] - solution.y[first], shifted[1] - solution.v[first]
        at = np.unique(np.append(np.arange(first, end, solution.nodes_per_step), end - 1))
        if len(at) > 1:
            bounds, found, whole = follower.leg(at, e, rate)
            parts.append((solution.t[at[bounds]], at[bounds], found, follower.filters(solution.t[at[bounds]])))
            e, rate = found[-1]
        before = end - 1
        if not whole:
            break
    if not parts:
        one = np.zeros(1, dtype=np.int64)
        parts.append((solution.t[:1], one, np.zeros((1, 2, n)), np.zeros(1)))
    rows = np.concatenate([p[1] for p in parts])
    errors = np.concatenate([p[2] for p in parts])
    return GlobalError(
        np.concatenate([p[0] for p in parts]),
        solution.y[rows],
        solution.v[rows],
        errors[:, 0],
        errors[:, 1],
        np.concatenate([p[3] for p in parts]),
        int(follower.counts[0]),
        whole,
    )


def _legs(solution: Solution) -> list[tuple[int, int]]:
    """First knot of each stretch between jumps, and the one after its last."""
    ends = [0, *(np.flatnonzero(np.diff(solution.t) == 0) + 1).tolist(), len(solution.t)]
    return [(first, end) for first, end in itertools.pairwise(ends) if end - first > 1]


class _Follower:
    """Memory of the loop (`erls.integrate.stepping.error_steps`) over one run."""

    def __init__(
        self, system: SecondOrderSystem, solution: Solution, tolerance: float, reach: float, ends: int, merged: int
    ) -> None:
        from erls.equations.uncompiled import uncompiled  # here: they import the compiler
        from erls.integrate.stepping import error_steps as loop
        from erls.integrate.stepping import stages as at

        compiled = system.compiled
        self.system, self.solution, n = system, solution, system.size
        self.compiled = compiled or uncompiled(system)
        self.follow = loop.follow if compiled else plain(loop.follow, within=False)
        self.functions, factoring = self.compiled.functions(), self.compiled.factoring
        steps, calls = max(solution.work.steps, 1), max(solution.work.rhs_calls, 1)
        self.coefficients = coefficients(nodes())
        wanted = int(np.ceil(STAGES * _ITERATIONS * steps / (_COST * calls)))
        smooth = ends == ENDS
        merged = merged if smooth else max(_MERGED_LARGE if n > _LARGE else _MERGED, wanted)
        stages = self.coefficients.shape[1] - 1
        pairs = (stages + 1) // 2
        size, exchanges = (n * n, n) if factoring is None else (factoring.size, 0)
        self.own = np.zeros((pairs + 1 if stages % 2 else 0, size))
        self.own_complex = np.zeros((pairs + 1, size), dtype=complex)
        self.pivots, self.mixed = np.zeros((pairs + 2, exchanges), dtype=np.int64), np.zeros(n, dtype=complex)
        self.stages, self.motion = np.zeros((2, stages + 1, 3, n))
        self.matrices = np.zeros((at.MATRICES, n, n))
        self.vectors = np.zeros((at.RESIDUALS + 3 * stages + 1, n))
        self.metres = self.vectors[at.METRES] = metre_scales(system)
        self.table = np.zeros((loop.CONDITIONS, n))
        self.counts = np.zeros(loop.COUNTS, dtype=np.int64)
        self.counts[[loop.MERGED, loop.ENDS]] = merged, ends
        most, least = _SHARES
        self.known = np.zeros(loop.KNOWN)
        all_steps = _ALL_STEPS_SMOOTH if smooth else _ALL_STEPS
        self.known[loop.SHARE] = min(most, max(least, all_steps * merged / steps))
        self.known[loop.LARGEST] = _ROUNDING * reach if smooth else _NEGLIGIBLE * tolerance
        self.known[loop.CUT] = _SHARP * stages if smooth else stages
        self.known[loop.BOUND], self.known[loop.RATE] = reach, loop.SLOWEST
        self.first, self.last = loop.FIRST, loop.LAST

    def leg(self, at: IntArray, e: Array, rate: Array) -> tuple[IntArray, Array, bool]:
        """Which of the knots ``at`` bound steps of the error, (j, 2, n) e and ė there, whether to the end."""
        s = self.solution
        t, knots = s.t[at], np.stack([s.y[at], s.v[at], s.a[at]], axis=1)
        hair = min(_HAIR * max(1.0, abs(t[0]), abs(t[-1])), (t[-1] - t[0]) / 4)
        self.known[[self.first, self.last]] = t[0] + hair, t[-1] - hair
        ends, found = np.zeros(len(at), dtype=np.int64), np.zeros((len(at), 2, len(e)))
        found[0] = e, rate
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # infinities are found
            try:
                change = self.system.acceleration(float(self.known[self.first]), knots[0, 0] + e, knots[0, 1] + rate)
            except SimulationError:
                return ends[:1], found[:1], False
            self.stages[0] = e, rate, change - knots[0, 2]
            made = self.follow(
                self.functions,
                self.compiled.reals,
                self.compiled.integers,
                self.compiled.scratch,
                self.own,
                self.own_complex,
                self.pivots,
                self.mixed,
                self.known,
                self.counts,
                self.coefficients,
                self.stages,
                self.motion,
                self.matrices,
                self.vectors,
                self.table,
                t,
                knots,
                ends,
                found,
            )
        steps = made if made >= 0 else -1 - made
        return ends[: steps + 1], found[: steps + 1], bool(made >= 0)

    @staticmethod
    def filters(t: Array) -> Array:
        """τ of the steps that begin at some times, the last one's twice."""
        spans = np.diff(t) / STAGES
        return np.append(spans, spans[-1:] if len(spans) else 0.0)


@cache
def nodes() -> tuple[float, ...]:
    """Lobatto's, from 0 to 1."""
    inner = np.sort(Legendre.basis(STAGES).deriv().roots().real)
    return (0.0, *((inner + 1) / 2).tolist(), 1.0)

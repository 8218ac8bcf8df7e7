"""Integration of chains with loops: constrained coordinates for generalized-α, decaying errors for the others.

Where the conditions nearly lose rank, errors decay by forces that grow without bound, and what rounding leaves of a
violation, over the distance to that place, becomes one of the rates. There the others give way to generalized-α, which
keeps positions to the conditions themselves: its steps pass a change point, and fail at a dead point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np

from erls.equations.loops.branching import AT, Kind, singular_at
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.loops.failures import ends_singular
from erls.equations.loops.tied import OPEN
from erls.equations.switches.base import Switches
from erls.equations.system import SecondOrderSystem
from erls.errors import Cause, SimulationError
from erls.integrate.base import Integrator, Observer, Options, Solution, StopRun, Work
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.integrate.memory import time_of
from erls.integrate.registry import integrator_named
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.stepped import Stepped

NEAR = 0.05  # of the smallest singular value at the start: a run that fails nearer than this to a dead point died of it
CLOSE, PAST = 0.1, 0.2  # of the same: generalized-α takes over below, and gives back above
_STEPS = 8  # of generalized-α, at the least, while the mechanism moves by that share of its size
_FINER = 1e-3  # local error of these steps, of what is wanted of the run: energy is kept to a millionth
_ITS_OWN = (Cause.INTERRUPTED, Cause.OUT_OF_MEMORY, Cause.SINGULAR_MASS, Cause.RUNAWAY, Cause.CHANGE_POINT)
_WATCHED = (Cause.LOOP_OPEN, Cause.CHANGE_POINT)  # raised at a knot, others of the same look may lie behind it


class TiedCoordinates:
    """The coordinates of a chain with the conditions of its loops; a `ConstrainedSystem`."""

    def __init__(self, chain: ClosedChain) -> None:
        self.chain, self.kept = chain, chain.kept
        self.size, self.constraints = chain.size, len(chain.kept)
        self.constraint_names = tuple(chain.rows.names[k] for k in chain.kept)
        self.length_scales, self.breakpoints = chain.metres, chain.breakpoints
        self._still = np.zeros(chain.size)
        self.switches = chain if isinstance(chain, Switches) else None

    def compose(self, q: Array, increment: Array) -> Array:
        """q + increment."""
        return q + increment

    def tangent(self, increment: Array) -> None:
        """The identity."""
        return None

    def residual(self, t: float, q: Array, v: Array, a: Array) -> Array:
        """(n,) of the chain."""
        return self.chain.loops.forces(t, q, v, a)

    def mass_matrix(self, t: float, q: Array) -> Array:
        """(n, n) of the chain."""
        return self.chain.loops.masses(t, q)

    def stiffness_and_damping(self, t: float, q: Array, v: Array, a: Array, multipliers: Array) -> tuple[Array, Array]:
        """Those of the chain."""
        return self.chain.loops.matrices(t, q, v)

    def constraint(self, t: float, q: Array) -> Array:
        """(m,) Φ."""
        return np.asarray(self.chain.closure(t, q, self._still).violation[self.kept])

    def constraint_matrix(self, t: float, q: Array) -> Array:
        """(m, n) Φ_y."""
        return np.asarray(self.chain.closure(t, q, self._still).rows[self.kept][:, self.chain.bare.free])

    def constraint_rate(self, t: float, q: Array) -> Array:
        """(m,) Φ_t."""
        return np.asarray(self.chain.closure(t, q, self._still).rate[self.kept])

    def constraint_bias(self, t: float, q: Array, v: Array) -> Array:
        """(m,) Φ̈ at zero accelerations."""
        return np.asarray(self.chain.closure(t, q, v).bias[self.kept])

    @property
    def unlocked(self) -> TiedCoordinates:
        """The same, whose rows take nothing of what friction holds."""
        return self

    def from_stored(self, y: Array, v: Array) -> tuple[Array, Array]:
        """The coordinates themselves."""
        return y, v

    def driven(self, t: float, q: Array, v: Array) -> tuple[Array, Array]:
        """Accelerations and multipliers with the present modes, see `erls.equations.switches.base`."""
        a = self.chain.acceleration(t, q, v)
        return a, self.chain.loops.room.multipliers.copy()

    def stored(self, t: float, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """The coordinates themselves.

        Raises
        ------
        SimulationError
            LOOP_OPEN: a condition left out as redundant is violated.
        """
        self._refuse_open(t, q, v)
        return q, v, a

    def places(self, stored: Array) -> Array:
        """(k, n, 1) coordinates in metres."""
        return (stored * self.length_scales)[..., None]

    @property
    def compiled(self) -> Stepped:
        """By kernels."""
        from erls.equations.loops.steps import stepped  # here: it imports the compiler

        return stepped(self.chain.loops, self._refuse_open)

    def _refuse_open(self, t: float, q: Array, v: Array) -> None:
        self.chain.refuse_open(t, self.chain.closure(t, q, v))


def tied_options(options: Options) -> ConstrainedOptions:
    """Of generalized-α in constrained coordinates."""
    return ConstrainedOptions(
        options.step,
        options.rtol,
        options.atol,
        options.spectral_radius,
        options.newton_tolerance,
        output_step=options.output_step,
        keeper=options.keeper,
    )


def loop_integrator(name: str) -> Integrator:
    """The integrator of that name for a `ClosedChain`; failures where a loop is singular name it."""

    def integrate(
        system: SecondOrderSystem,
        times: tuple[float, float],
        y: Array,
        v: Array,
        options: Options,
        observer: Observer | None = None,
    ) -> Solution:
        assert isinstance(system, ClosedChain)
        if name == "generalized_alpha" and len(system.kept):
            solution: Solution = lie_generalized_alpha(
                TiedCoordinates(system), times, y, v, tied_options(options), observer
            )
        else:
            solution = _in_stretches(integrator_named(name), system, times, y, v, options, observer)
        failure = solution.failure
        if failure is None or failure.cause in _ITS_OWN:
            return solution
        return replace(solution, failure=_singular(system.unheld, solution) or failure)

    return integrate


def _in_stretches(
    method: Integrator,
    chain: ClosedChain,
    times: tuple[float, float],
    y: Array,
    v: Array,
    options: Options,
    observer: Observer | None,
) -> Solution:
    """By a method, and by generalized-α wherever the conditions are close to losing rank.

    Checkpoints end with the first stretch: a run that is resumed makes the others anew.
    """
    parts: list[Solution] = []
    t, near = times[0], False
    while True:
        watch = Watch(chain.unheld, observer, time_of(options.keeper), near, tuple(parts))
        if near:
            speed = float(np.linalg.norm(chain.metres * v))
            largest = CLOSE * chain.reach / (_STEPS * speed) if speed > 0 else None
            tied = replace(tied_options(options), step=largest, error_tolerance=_FINER * options.tolerance)
            found: Solution = lie_generalized_alpha(TiedCoordinates(chain), (t, times[1]), y, v, tied, watch)
        else:
            found = method(chain, (t, times[1]), y, v, options, watch)
        if watch.turned or (found.failure is not None and found.failure.cause in _WATCHED):
            found = _first(found, watch.good)
        parts.append(found)
        if not watch.turned or watch.good >= times[1]:
            return joined(parts)
        t, near, options = watch.good, not near, replace(options, keeper=None)
        y, v = chain.closed(t, found.y[-1], found.v[-1])


def joined(parts: Sequence[Solution]) -> Solution:
    """Stretches of one run."""
    first, last = parts[0], parts[-1]
    if len(parts) == 1:
        return first
    t, y, v, a = (np.concatenate([getattr(part, name) for part in parts]) for name in ("t", "y", "v", "a"))
    work, halved = Work(), first.halved
    for part in parts:
        for each in fields(Work):
            setattr(work, each.name, getattr(work, each.name) + getattr(part.work, each.name))
    for part in parts[1:]:
        halved = halved.and_then(part.halved)
    warnings = tuple(dict.fromkeys(text for part in parts for text in part.warnings))
    return Solution(t, y, v, a, work, last.failure, warnings, first.choice, halved=halved)


class Watch:
    """An observer that refuses steps at which a loop has come apart, and ends a stretch where conditions are close to
    losing rank, or no longer are; within a step a trial may.

    Parameters
    ----------
    chain : ClosedChain
    observer : callable or None
        Told of what is not refused.
    since : float or None
        Time up to which a run that goes on was looked at.
    near : bool
        Whether conditions are close to losing rank.
    before : tuple of Solution
        Earlier stretches.
    """

    def __init__(
        self,
        chain: ClosedChain,
        observer: Observer | None,
        since: float | None = None,
        near: bool = False,
        before: tuple[Solution, ...] = (),
    ) -> None:
        self.chain, self.observer = chain, observer
        self.good = -np.inf if since is None else since
        """Time of the first knot that was refused, or of the last one that was looked at."""
        self.turned = False
        """Whether the stretch ends there."""
        self._near, self._before = near, before
        self._flexible = chain.size > len(chain.bare.free_joints)

    def __call__(self, t: float, knots: Callable[[], Solution]) -> Sequence[float] | None:
        found = knots()
        suspects, last = self._suspects(found), float(found.t[-1])
        for k, turns in suspects:
            self.good = float(found.t[k])
            try:
                self._refuse(found, k)
            except SimulationError as problem:
                problem.whole = (self.good,)
                raise
            if turns:
                keep = self._tell(self.good, _first(found, self.good))
                self.turned = True
                raise StopRun(self.good, *(keep or ()))
        self.good = last
        return self._tell(t, found)

    def _tell(self, t: float, found: Solution) -> Sequence[float] | None:
        return None if self.observer is None else self.observer(t, lambda: joined([*self._before, found]))

    def _refuse(self, found: Solution, k: int) -> None:
        """Raise where a loop has come apart, or where rounding decides how it goes on."""
        chain, t, y = self.chain, float(found.t[k]), found.y[k]
        closure = chain.closure(t, y, found.v[k])
        chain.refuse_open(t, closure)
        value, start = chain.stiffest(closure)[0], chain.stiffest_at_start
        if self._flexible and value < AT * start and (at := singular_at(chain, t, y)).kind == Kind.STIFF:
            raise ends_singular(t, at, value, start)

    def _suspects(self, found: Solution) -> list[tuple[int, bool]]:
        """Numbers of new knots that are open, or singular, or end the stretch, and whether they do that."""
        chain = self.chain
        first = int(np.searchsorted(found.t, self.good))
        gaps, stiffest = chain.loops.watched(found.t[first:], found.y[first:])
        share = stiffest / chain.stiffest_at_start
        turns = share > PAST if self._near else share < CLOSE
        suspect = (gaps > OPEN * chain.reach) | turns
        if self._flexible:
            suspect |= share < AT
        return [(first + int(k), bool(turns[k])) for k in np.flatnonzero(suspect)]


def _first(solution: Solution, time: float) -> Solution:
    """Less what many steps at once made after a loop came apart or locked."""
    knots = int(np.searchsorted(solution.t, time, side="right"))
    arrays = {name: getattr(solution, name)[:knots] for name in ("t", "y", "v", "a")}
    return replace(solution, **arrays) if knots else solution


def _singular(chain: ClosedChain, solution: Solution) -> SimulationError | None:
    """A failed run that ended where a loop is singular."""
    t, y, v = float(solution.t[-1]), solution.y[-1], solution.v[-1]
    if not (np.isfinite(y).all() and np.isfinite(v).all()):
        return None
    value = chain.stiffest(chain.closure(t, y, v))[0]
    if not value < NEAR * chain.stiffest_at_start:
        return None
    return ends_singular(t, singular_at(chain, t, y), value, chain.stiffest_at_start)

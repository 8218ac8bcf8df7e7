"""Paths of equilibria by arc length: through limit points, past bifurcations, onto branches.

From an equilibrium the path goes on along its tangent; Newton's method returns to it across the tangent, with the load
parameter as one unknown more (E. Riks, J. Appl. Mech. 39 (1972) 1060-1065; M. A. Crisfield, Non-linear Finite Element
Analysis, vol. 1, 1991). Steps shorten where that is hard or the path turns sharply. Between two equilibria

- a limit point lies where the tangent's load changes its sign,
- a bifurcation where the number of unstable ways changes by more than that,

and both are found by regula falsi along the step: on the tangent's load, and on the eigenvalue of the stiffness next to
zero. A branch starts along that eigenvector, as far as it is no part of the tangent.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.bordered import (
    Bordered,
    Measure,
    Point,
    Step,
    lowest_way,
    unstable_ways,
)
from erls.equations.nodal.nodes import Nodes
from erls.equations.nodal.statics import (
    MAX_ITERATIONS,
    SHRINK,
    Equilibrium,
    LoadSteps,
    Statics,
    Turn,
    imbalance,
    turned_too_far,
)
from erls.errors import Cause, SimulationError

WANTED = 10  # iterations of a step: with more the next one is shorter, with less longer
SHARPEST = 0.5  # cosine between the tangents of both ends of a step
SMALLEST = 1e-5  # of the first step
RESOLVED = 1 / 64  # of the first step: shorter ones are taken however sharply the path turns
_LOCATED = 1e-9  # of a step: how closely points are found along it
_HALVED = 6  # times, where a step has no end
_LOOKS = 40  # along a step for one of them
_VANISHED = 1e-3  # of the eigenvalue at the ends of a step: zero, at a bifurcation


@dataclass(frozen=True)
class PathOptions:
    """What of a path is asked for.

    Attributes
    ----------
    end : float
        Load parameter at which it ends.
    steps : int
        The first step goes that share of ``end``, the others are as long at most.
    most : int
        Steps, at most.
    branch : int
        Bifurcation, from 1, at which the path leaves for the branch; negative: for its other half. 0: it stays.
    tolerance : float
        As of `erls.equations.nodal.statics.solve_statics`.
    """

    end: float = 1.0
    steps: int = 20
    most: int = 200
    branch: int = 0
    tolerance: float = 1e-12


@dataclass(frozen=True)
class _Known:
    """A point, its tangent of length one, its number of unstable ways, iterations that it took."""

    point: Point
    tangent: Step
    unstable: int
    iterations: int


def follow_path(system: NodalSystem, start: Nodes, options: PathOptions) -> Statics:
    """Equilibria from the load parameter 0 to its end, however the load parameter goes up and down between.

    Parameters
    ----------
    system : NodalSystem
        On SE(3).
    start : Nodes
        Near the equilibrium at load parameter 0.
    options : PathOptions

    Returns
    -------
    Statics
        With ``arc`` and ``unstable`` of all equilibria, and its ``turns``; with ``failure`` of cause NO_EQUILIBRIUM
        where short steps fail, too; what was found is kept. After ``most`` steps it ends without one.
    """
    return _Walk(system, options).from_(start)


class _Walk:
    """One path."""

    def __init__(self, system: NodalSystem, options: PathOptions) -> None:
        self.system, self.options = system, options
        self.measure = Measure(system, options.end)
        self.newton = LoadSteps(system, "full", options.tolerance)
        self.found: list[Equilibrium] = []
        self.turns: list[Turn] = []
        self.factorizations = self.cuts = 0
        self.stays: SimulationError | None = None
        self.arc = self.longest = 0.0

    def from_(self, start: Nodes) -> Statics:
        first = self.newton.balance(0.0, start, np.zeros(self.system.constraints))
        if first is None:
            return Statics((), self.newton.factorizations, 0, self.newton.failure(0.0))
        none = np.zeros(self.system.size), np.zeros(self.system.constraints)
        here = self._known(Point(0.0, *first), Step(*none, self.options.end), self.newton.iterations)
        self._keep(here, 0.0)
        step = self.longest = self.options.end / self.options.steps / here.tangent.load
        failure = None
        while len(self.found) <= self.options.most:
            there = self._taken(here, step)
            if there is None:
                step, self.cuts = step / 2, self.cuts + 1
                if step < SMALLEST * self.longest:
                    failure = self._failure(here)
                    break
                continue
            length, ended = step, there.point.t >= self.options.end * (1 - 1e-9)
            if ended:
                length, there = self._at_end(here, there, step)
            whole, left = self._turns(here, there, length)
            if not whole and step > RESOLVED * self.longest:
                step, self.cuts = step / 2, self.cuts + 1
                continue
            if self.stays is not None:
                failure = self.stays
                break
            if left is not None:
                here = left
            else:
                self._keep(there, length)
                here = there
                if ended:
                    break
            step = min(self.longest, step * float(np.clip(np.sqrt(WANTED / max(here.iterations, 1)), 0.5, 2.0)))
        work = self.factorizations + self.newton.factorizations
        return Statics(tuple(self.found), work, self.cuts, failure, tuple(self.turns))

    def _taken(self, here: _Known, step: float) -> _Known | None:
        """The end of a step; None where it has none, turns too sharply, or leaves points unresolved."""
        found = self._advance(here.point, here.tangent, step)
        if found is None:
            return None
        there = self._known(found[0], here.tangent, found[1])
        if step > RESOLVED * self.longest:
            if self.measure.product(here.tangent, there.tangent) < SHARPEST:
                return None
            turned = here.tangent.load * there.tangent.load < 0
            if turned and abs(there.unstable - here.unstable) != 1:
                return None
        return there

    def _advance(self, start: Point, along: Step, step: float) -> tuple[Point, int] | None:
        """Newton's method from a step along a direction, and across it; iterations."""
        at, exact = _moved(self.system, start, along.scaled(step)), False
        right, last = imbalance(self.system, at.t, at.q, at.multipliers), np.inf
        for iteration in range(1, MAX_ITERATIONS + 1):
            border = Bordered(self.system, at, along, self.measure, material=not exact)
            self.factorizations += 1
            if border.singular:
                return None
            correction, size = border.solve(*right, 0.0)
            whole = self.measure.length(correction)
            if not np.isfinite(whole) or whole > 10 * step or (iteration > 8 and whole > last):
                return None
            at, last = _moved(self.system, at, correction.scaled(-1.0)), whole
            right = imbalance(self.system, at.t, at.q, at.multipliers)
            if size <= self.newton.goal and abs(correction.load) <= 1e-10 * self.options.end:
                return at, iteration
            left = self.measure.length(border.solve(*right, 0.0)[0]) / whole
            exact = not exact or left <= SHRINK  # beyond a limit point the material tangent leads away
        return None

    def _known(self, point: Point, before: Step, iterations: int) -> _Known:
        """With its tangent, which goes on in the direction of another one."""
        border = Bordered(self.system, point, before, self.measure)
        self.factorizations += 2  # with that of the count
        none = np.zeros(self.system.size), np.zeros(self.system.constraints)
        tangent = self.measure.unit(border.solve(*none, self.measure.length(before))[0])
        unstable = unstable_ways(border.stiffness, border.rows, self.measure.metres)
        return _Known(point, tangent, unstable, iterations)

    def _turns(self, here: _Known, there: _Known, step: float) -> tuple[bool, _Known | None]:
        """Look for limit points and bifurcations between. False where the step went over to another path, on which more
        or less is unstable; and where the path leaves here, the first point of the branch.
        """
        turned = here.tangent.load * there.tangent.load < 0
        more = there.unstable - here.unstable
        limits: list[Turn] = []
        if turned:
            s, at = self._located(here, step, lambda k: k.tangent.load, (here.tangent.load, there.tangent.load))
            limits = [Turn("limit", at.point.t, self.arc + s, abs(more))]
        if more == 0 or (turned and abs(more) == 1):
            self.turns += limits
            return True, None
        ends = tuple(lowest_way(self.system, k.point, self.measure)[0] for k in (here, there))
        sign = {here.unstable: 1.0, there.unstable: -1.0}

        def passed(known: _Known) -> float:
            near = abs(lowest_way(self.system, known.point, self.measure)[0])
            side = sign.get(known.unstable) or (1.0 if (known.unstable - here.unstable) * more <= 0 else -1.0)
            return side * near

        s, at = self._located(here, step, passed, (abs(ends[0]), -abs(ends[1])))
        value, way = lowest_way(self.system, at.point, self.measure)
        if abs(value) > _VANISHED * max(map(abs, ends)):
            return False, None
        self.turns += [*limits, Turn("bifurcation", at.point.t, self.arc + s, abs(more) - int(turned))]
        number = sum(turn.kind == "bifurcation" for turn in self.turns)
        if number != abs(self.options.branch):
            return True, None
        left = self._left(at, way, s, step)
        if left is None:
            self.stays = SimulationError(
                Cause.NO_EQUILIBRIUM,
                f"no step onto the branch at load parameter {at.point.t:.6g} converges",
                where=f"load parameter {at.point.t:.9g}",
                remedy="more simulation.load_steps, or another simulation.branch",
            )
        return True, left

    def _located(
        self, here: _Known, step: float, of: Callable[[_Known], float], ends: tuple[float, float]
    ) -> tuple[float, _Known]:
        """Where along a step a function is zero, by regula falsi (Illinois), and the point there."""
        (low, high), (below, above) = (0.0, step), ends
        found, s, before = here, 0.0, 0
        base, passed = here, 0.0
        for _ in range(_LOOKS):
            s = (low * above - high * below) / (above - below)
            margin = 0.1 * _LOCATED * step
            s = float(np.clip(s, low + margin, high - margin))
            taken = self._advance(base.point, base.tangent, s - passed)
            for _ in range(_HALVED):
                if taken is not None:
                    break
                s = passed + (s - passed) / 2
                taken = self._advance(base.point, base.tangent, s - passed)
            if taken is None:
                break
            found = self._known(taken[0], base.tangent, taken[1])
            value = of(found)
            side = 1 if value * ends[0] > 0 else -1
            if side == 1:  # on from here, which is nearer
                base, passed = found, s
                low, below, above = s, value, above / 2 if before == side else above
            else:
                high, above, below = s, value, below / 2 if before == side else below
            before = side
            if high - low <= _LOCATED * step or value == 0:
                break
        return s, found

    def _left(self, at: _Known, way: Step, s: float, step: float) -> _Known | None:
        """The first point of a branch, kept with the bifurcation before it."""
        across = way.less(at.tangent, self.measure.product(way, at.tangent))
        across = self.measure.unit(across).scaled(float(np.sign(self.options.branch)))
        while step > SMALLEST * self.longest:
            found = self._advance(at.point, across, step)
            if found is not None:
                break
            step, self.cuts = step / 2, self.cuts + 1
        else:
            return None
        there = self._known(found[0], across, found[1])
        self._keep(at, s)
        self._keep(there, step)
        return there

    def _at_end(self, here: _Known, there: _Known, step: float) -> tuple[float, _Known]:
        """The equilibrium under the last load parameter, and how far along a step it is."""
        end = self.options.end
        ends = here.point.t - end, there.point.t - end
        s, at = (step, there) if ends[1] <= 0 else self._located(here, step, lambda k: k.point.t - end, ends)
        exact = self.newton.balance(end, at.point.q, at.point.multipliers)
        point = at.point if exact is None else Point(end, *exact)
        return s, _Known(point, at.tangent, at.unstable, there.iterations)

    def _keep(self, known: _Known, step: float) -> None:
        self.arc += step
        p = known.point
        self.found.append(Equilibrium(p.t, p.q, p.multipliers, known.iterations, self.arc, known.unstable))

    def _failure(self, here: _Known) -> SimulationError:
        return turned_too_far(self.system, here.point.q, here.point.t) or SimulationError(
            Cause.NO_EQUILIBRIUM,
            f"the path of equilibria cannot be followed beyond load parameter {here.point.t:.6g}, arc {self.arc:.4g}",
            where=f"load parameter {here.point.t:.9g}",
            value=f"step {SMALLEST:g} of the first",
            limit=f"{MAX_ITERATIONS} iterations",
            remedy="more simulation.load_steps; look for a bifurcation there; or let the motion be computed in time",
        )


def _moved(system: NodalSystem, at: Point, by: Step) -> Point:
    """A point moved by a step."""
    return Point(at.t + by.load, system.compose(at.q, by.move), at.multipliers + by.change)

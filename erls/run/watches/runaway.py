"""The end of runs whose links deflect beyond any meaning: linear models that lost their stability grow for ever."""

from __future__ import annotations

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.serial.state_series import state_series
from erls.equations.substructures import solved
from erls.equations.system import metre_scales
from erls.errors import Cause, SimulationError
from erls.integrate.base import Solution
from erls.maths.so3 import Array
from erls.mechanism.links import Link
from erls.run.watches.base import NOTHING, Begun, Finding, Knots, Plan, Watch
from erls.run.watches.spin_stability import spin_warnings

LARGEST = 10.0  # of the size of a link
_LOOKS = 101
_EVERY = 16  # calls of the observer, one of which looks at all knots since the last one; `output_step` would lose some


class Runaway(Watch):
    """Looks at the knots of a run as they pass."""

    def __init__(self) -> None:
        self._calls, self._since = 0, -np.inf
        self._ended: float | None = None  # time of the first knot beyond the limit

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Links that are linear in their own frames."""
        return plan.modal

    def begins(self, begun: Begun) -> Finding:
        """Nothing; it learns the sizes of links and the scales of coordinates."""
        self._every = 1 if begun.plan.settings.output_step is not None else _EVERY
        self._system: Formulation = solved(begun.formulation)
        self._links = self._system.mechanism.links
        self._sizes = np.array([link.size for link in self._links])
        self._metres = metre_scales(self._system)  # type: ignore[arg-type]
        joints = sum(not joint.drive.prescribed for joint in self._system.mechanism.joints)
        self._elastic = slice(min(joints, len(self._metres)), None)
        self._least = LARGEST * float(self._sizes[self._sizes > 0].min(initial=np.inf))  # a crank may be a point
        return NOTHING

    def during(self, t: float, knots: Knots) -> Finding:
        """Where a node of a link is displaced by more than 10 times the link's size: RUNAWAY."""
        self._calls += 1
        return NOTHING if self._calls % self._every else Finding(failure=self._look(knots()))

    def ends(self, solution: Solution) -> Finding:
        """The same of the last knots; what comes after the first one beyond the limit is not worth keeping."""
        failure = self._look(solution) if self._ended is None else None
        return Finding(failure=failure, end=self._ended)

    def _look(self, solution: Solution) -> SimulationError | None:
        """RUNAWAY, at the first knot beyond the limit."""
        first = int(np.searchsorted(solution.t, self._since))
        with np.errstate(over="ignore", invalid="ignore"):  # integrators see to what is not finite
            bounds = np.abs(solution.y[first:, self._elastic]) @ self._metres[self._elastic]
        self._since = float(solution.t[-1])
        suspects = first + np.flatnonzero((bounds > self._least) & np.isfinite(bounds))
        if not len(suspects) or self._worst(solution, int(suspects[np.argmax(bounds[suspects - first])])) is None:
            return None
        for knot in suspects.tolist():
            found = self._worst(solution, knot)
            if found is not None:
                self._ended = float(solution.t[knot])
                return self._failure(solution, knot, *found)
        return None

    def _worst(self, solution: Solution, knot: int) -> tuple[int, float] | None:
        """Number of the link that is displaced most for its size, and by how much [m]; None within the limit."""
        state = self._system.state(float(solution.t[knot]), solution.y[knot], solution.v[knot])
        moved = np.array([_moved(link, q) for link, q in zip(self._links, state.modal, strict=True)])
        shares = np.divide(moved, self._sizes, out=np.zeros_like(moved), where=self._sizes > 0)
        worst = int(np.argmax(shares))
        return (worst, float(moved[worst])) if shares[worst] > LARGEST else None

    def _failure(self, solution: Solution, knot: int, number: int, moved: float) -> SimulationError:
        link, size = self._links[number], float(self._sizes[number])
        knots = np.unique(np.linspace(0, knot, _LOOKS).astype(np.int64))
        seen = state_series(self._system, solution.t[knots], solution.y[knots], solution.v[knots])
        motion = zip(seen.times.tolist(), seen.coordinates, seen.rates, strict=True)
        remedy = "check loads, rates and units against the stiffness of the link; if they are meant, formulation nodal"
        if spin_warnings(self._system.mechanism, motion):
            remedy = (
                "its spin took away its stiffness: turn on the effects 'geometric_stiffening' and 'foreshortening', or "
                "use formulation nodal"
            )
        problem = SimulationError(
            Cause.RUNAWAY,
            f"link {link.name!r} is deflected beyond any meaning, being linear in its own frame",
            where=f"t = {solution.t[knot]:.6g} s",
            value=f"{moved:.3g} m",
            limit=f"{LARGEST:g} times its size, {LARGEST * size:.3g} m",
            remedy=remedy,
        )
        problem.whole = (float(solution.t[knot]),)
        return problem


def _moved(link: Link, q: Array) -> float:
    """Largest displacement of a node against the inboard interface [m]."""
    moved = link.model.translation_shapes @ q
    return float(np.linalg.norm(moved - moved[link.inboard.node], axis=1).max(initial=0.0))

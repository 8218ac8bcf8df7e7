"""The end of runs whose links deflect beyond any meaning: linear models that lost their stability grow for ever."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.serial.state_series import state_series
from erls.equations.substructures import solved
from erls.equations.system import metre_scales
from erls.errors import Cause, SimulationError
from erls.integrate.base import Solution
from erls.maths.so3 import Array
from erls.mechanism.links import Link
from erls.run.watches.spin_stability import spin_warnings

LARGEST = 10.0  # of the size of a link
_LOOKS = 101


class Runaway:
    """Looks at the knots of a run as they pass; to be called by its observer.

    Parameters
    ----------
    formulation : Formulation
        One whose links are linear in their own frame.
    every : int
        Of the calls of the observer, one in so many looks, at all knots since the last one.
    """

    def __init__(self, formulation: Formulation, every: int = 1) -> None:
        self._every, self._calls = every, 0
        self._system = solved(formulation)
        self._links = self._system.mechanism.links
        self._sizes = np.array([np.linalg.norm(np.ptp(link.model.nodes, axis=0)) for link in self._links])
        self._metres = metre_scales(self._system)  # type: ignore[arg-type]
        joints = sum(not joint.drive.prescribed for joint in self._system.mechanism.joints)
        self._elastic = slice(min(joints, len(self._metres)), None)
        self._least = LARGEST * float(self._sizes[self._sizes > 0].min(initial=np.inf))  # a crank may be a point
        self._since = -np.inf
        self.ended: float | None = None
        """Time of the first knot beyond the limit."""

    def pass_by(self, knots: Callable[[], Solution]) -> None:
        """Look, now and then; see `look`."""
        self._calls += 1
        if self._calls % self._every == 0:
            self.look(knots())

    def judged(self, solution: Solution) -> Solution:
        """A run that ended by itself, or failed, with what its last knots have to say as its failure."""
        try:
            self.look(solution)
        except SimulationError as problem:
            return replace(solution, failure=problem)
        return solution

    def look(self, solution: Solution) -> None:
        """Raise where a node of a link is displaced by more than 10 times the link's size.

        Raises
        ------
        SimulationError
            RUNAWAY
        """
        first = int(np.searchsorted(solution.t, self._since))
        with np.errstate(over="ignore", invalid="ignore"):  # integrators see to what is not finite
            bounds = np.abs(solution.y[first:, self._elastic]) @ self._metres[self._elastic]
        self._since = float(solution.t[-1])
        suspects = first + np.flatnonzero((bounds > self._least) & np.isfinite(bounds))
        if not len(suspects) or self._worst(solution, int(suspects[np.argmax(bounds[suspects - first])])) is None:
            return
        for knot in suspects.tolist():
            found = self._worst(solution, knot)
            if found is not None:
                self.ended = float(solution.t[knot])
                raise self._failure(solution, knot, *found)

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

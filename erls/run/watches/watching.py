"""All watches of a run: they look in turn, and what they find is told, kept, or ends the run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cache
from typing import TypeVar

from erls.errors import Cause, SimulationError
from erls.integrate.base import Solution, StopRun
from erls.run.events import cut
from erls.run.record import Run
from erls.run.watches.base import Begun, BodyPlan, Ended, Finding, Knots, Plan, Started, Watch
from erls.run.watches.registry import WATCHES

AnyRun = TypeVar("AnyRun", bound=Run)


class Warnings:
    """Warnings of a run so far, each told once.

    Parameters
    ----------
    tell : callable
        Told each of them as soon as it is known.
    """

    def __init__(self, tell: Callable[[str], None]) -> None:
        self.tell = tell
        self.texts: list[str] = []
        self._told: set[str] = set()

    def __call__(self, texts: Iterable[str]) -> None:
        for text in texts:
            if text not in self.texts:
                self.texts.append(text)
            if text not in self._told:
                self._told.add(text)
                self.tell(f"warning: {text}")

    def beside(self) -> Warnings:
        """For one of several runs of a scene: with what is known before it; nothing is told twice."""
        result = Warnings(self.tell)
        result.texts += self.texts
        result._told = self._told
        return result


class Watching:
    """The watches of one run.

    Parameters
    ----------
    plan : Plan or BodyPlan
    warnings : Warnings
        Of this run.
    more : sequence of Watch
        What the caller of a simulation looks with, after those of the registry.
    """

    def __init__(self, plan: Plan | BodyPlan, warnings: Warnings, more: Sequence[Watch] = ()) -> None:
        self._plan, self._warnings = plan, warnings
        known = [w for w in WATCHES if (w.of_bodies if isinstance(plan, BodyPlan) else w.concerns(plan))]
        self._own: list[Watch] = [watch() for watch in known]
        self._more = list(more)

    @property
    def _watches(self) -> list[Watch]:
        return [*self._own, *self._more]

    def before(self) -> None:
        """Before anything is computed."""
        if isinstance(self._plan, Plan):
            for watch in self._watches:
                self._tell(watch.before(self._plan))

    def begins(self, begun: Started) -> None:
        """When the equations of motion and their start stand."""
        for watch in self._watches if isinstance(begun, Begun) else self._more:
            self._tell(watch.begins(begun))  # type: ignore[arg-type]

    def observe(self, t: float, knots: Knots) -> Sequence[float]:
        """The `erls.integrate.base.Observer` of the run.

        Raises
        ------
        SimulationError, StopRun
            Where a watch ends the run.
        """
        found: list[float] = []
        once = cache(knots)
        for watch in self._watches:
            finding = watch.during(t, once)
            self._tell(finding)
            found += finding.keep
            if finding.failure is not None:
                raise finding.failure
            if finding.stop:
                raise StopRun(*found)
        return found

    def ended(self, solution: Solution) -> Solution:
        """What the watches leave of what was computed, with why it ended."""
        for watch in self._after(solution.failure):
            finding = watch.ends(solution)
            self._tell(finding)
            if finding.failure is not None:
                solution = replace(solution, failure=finding.failure)
            if finding.end is not None:
                solution = cut(solution, finding.end)
        return solution

    def judged(self, run: AnyRun) -> AnyRun:
        """The run with all that there is to say about it.

        Raises
        ------
        SimulationError
            It failed, or a watch finds it wrong; ``run`` of the error is the run.
        """
        ended, errors, failure = Ended(run), [], None  # type: ignore[arg-type]  # see `Watch.of_bodies`
        for watch in self._after(run.failure):
            finding = watch.after(ended)
            self._tell(finding)
            if finding.error is not None:
                errors.append(finding.error)
            failure = failure or finding.failure
        more = {"second_order_error": sum(errors)} if errors else {}
        run = replace(run, warnings=tuple(self._warnings.texts), **more)  # type: ignore[type-var]  # all runs are dataclasses
        failure = failure or run.failure
        if failure is not None:
            failure.run = run
            raise failure
        return run

    def _after(self, failure: SimulationError | None) -> list[Watch]:
        """Those that look at a run when it has come to its end; none where there is no memory left to look with."""
        return [] if failure is not None and failure.cause == Cause.OUT_OF_MEMORY else self._watches

    def _tell(self, finding: Finding) -> None:
        self._warnings(finding.warnings)
        for note in finding.notes:
            self._warnings.tell(note)

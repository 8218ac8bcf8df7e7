"""Events of the scene: crossings are looked for as knots pass, and end the run where the scene says so."""

from __future__ import annotations

from erls.integrate.base import Solution
from erls.run.events import Happening, happenings
from erls.run.watches.base import NOTHING, Begun, Finding, Knots, Plan, Watch


class Events(Watch):
    """Finds events whose knots have to be kept, or that end the run; `Run.events` finds the others afterwards."""

    def __init__(self) -> None:
        self._happened: Happening | None = None

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Scenes with events that stop a run, or that need knots which ``output_step`` would leave out."""
        events = plan.scene.record.events
        return any(event.stop for event in events) or bool(events and plan.settings.output_step is not None)

    def begins(self, begun: Begun) -> Finding:
        """Nothing; it learns which events stop the run."""
        self._events, self._formulation = begun.plan.scene.record.events, begun.formulation
        self._stops = {event.name for event in self._events if event.stop}
        self._since = begun.since
        return NOTHING

    def during(self, t: float, knots: Knots) -> Finding:
        """Times of events since the last look; their steps are to be kept, so that the run shows them."""
        solution, times = knots(), []
        for happening in happenings(self._events, self._formulation, solution, self._since):
            times.append(happening.time)
            if happening.name in self._stops:
                self._happened = happening
                return Finding(keep=times, stop=True)
        self._since = float(solution.t[-1])
        return Finding(keep=times)

    def ends(self, solution: Solution) -> Finding:
        """The event that stopped the run."""
        event = self._happened
        if event is None:
            return NOTHING
        return Finding(notes=(f"event {event.name!r} at t = {event.time:.6g} s: the run ends",), end=event.time)

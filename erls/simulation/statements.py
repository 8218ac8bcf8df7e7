"""What a finished run states of its error; whatever keeps it from being found, the run is kept."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from erls.errors import Cause, SimulationError
from erls.run.record import Run

AnyRun = TypeVar("AnyRun", bound=Run)


def with_statement(run: AnyRun, state: Callable[[AnyRun], AnyRun]) -> AnyRun:
    """``state(run)``.

    Raises
    ------
    SimulationError
        What it raises, INTERRUPTED, or OUT_OF_MEMORY; ``run`` of the error is the run.
    """
    try:
        return state(run)
    except SimulationError as problem:
        failure = problem
    except KeyboardInterrupt:
        message = "the run was finished, and interrupted before its error was known"
        failure = SimulationError(Cause.INTERRUPTED, message, remedy="the motion was kept")
    except MemoryError:
        message = "the run was finished, and there was no memory to find its error"
        remedy = "the motion was kept; --no-verdict does without, a larger simulation.output_step needs less"
        failure = SimulationError(Cause.OUT_OF_MEMORY, message, remedy=remedy)
    failure.run = run
    raise failure

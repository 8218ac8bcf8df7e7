"""Runs of one scene, each finer than the last, within a time that is given: as fine as it allows, at least two."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.scene.chain import Scene
from erls.simulation.simulate import simulate
from fe_import.errors import ReportedError

Clock = Callable[[], float]
_PATIENCE = 0.1  # of the time that is left, before a run that would take far too long is ended
_FAR_TOO_LONG = 3.0


@dataclass(frozen=True)
class Level:
    """One run: the scene, and what sets its accuracy in words."""

    label: str
    scene: Scene


@dataclass(frozen=True)
class Refined:
    """The runs that were made, from coarse to fine.

    Attributes
    ----------
    labels : tuple of str
    samples : tuple of arrays
    warnings : tuple of str
        Of the finest.
    prepared_s : float
        Time before first steps: reading, reducing, compiling [s].
    """

    labels: tuple[str, ...]
    samples: tuple[Array, ...]
    warnings: tuple[str, ...]
    prepared_s: float


class TooShort(Exception):
    """The time does not suffice for two runs; its argument is about what would [s]."""


class _OutOfTime(Exception):
    """Ends a run; its argument is the time that all of it would take [s]."""


class _Watch:
    """The time of a run from its first step on, and before it; ends it beyond what is left."""

    def __init__(self, clock: Clock, left: float) -> None:
        self.clock, self.left = clock, left
        self.called = clock()
        self.begun: float | None = None

    def __call__(self, t: float, duration: float) -> None:
        if self.begun is None:
            self.begun = self.clock()
            return
        whole = self.spent * duration / t if t > 0 else 0.0
        impatient = self.spent > _PATIENCE * self.left and whole > _FAR_TOO_LONG * self.left
        if impatient or self.spent > self.left:
            raise _OutOfTime(max(whole, self.spent))

    @property
    def spent(self) -> float:
        return self.clock() - (self.called if self.begun is None else self.begun)

    @property
    def prepared(self) -> float:
        return 0.0 if self.begun is None else self.begun - self.called


def refine(
    levels: Sequence[Level],
    sample: Callable[[ChainRun], Array],
    error: Callable[[Sequence[Array]], float],
    wanted: tuple[float, float],
    time_s: tuple[float, float],
    dearer: float,
    clock: Clock = time.perf_counter,
) -> Refined:
    """Run level after level.

    Parameters
    ----------
    levels : sequence of Level
        From coarse to fine; those whose integration fails are passed over while there is a finer one.
    sample : callable
        What to keep of a run.
    error : callable
        Of the last of two or more samples.
    wanted : tuple of float
        Error that is needed, and one that is small enough to stop.
    time_s : tuple of float
        What all runs may take, from their first steps on [s]: until the error is as needed, and then.
    dearer : float
        How much more a level takes than the one before: one that would not fit is not begun.
    clock : callable
        Now [s].

    Raises
    ------
    TooShort
    SceneError, FEImportError, SimulationError
        A run failed, or was interrupted.
    """
    made: list[tuple[str, Array]] = []
    warnings: tuple[str, ...] = ()
    spent = prepared = last = 0.0
    found = float("inf")
    for level in levels:
        left = time_s[0 if found > wanted[0] else 1] - spent
        needs = dearer * last
        if needs > left:
            break
        watch = _Watch(clock, left)
        try:
            run = simulate(level.scene, progress=watch, verdict=False)
            made.append((level.label, sample(run)))
            last, warnings = watch.spent, run.warnings
        except _OutOfTime as problem:
            needs = float(problem.args[0])
            break
        except ReportedError as problem:
            if problem.exit_code != 3 or level is levels[-1]:
                raise
            last = 0.0
        spent, prepared = spent + watch.spent, prepared + watch.prepared
        if len(made) > 1:
            found = error([samples for _, samples in made])
        if found <= wanted[1]:
            break
    if len(made) < 2:
        raise TooShort(spent + needs * (1.0 if made else 1.0 + dearer))
    labels, samples = zip(*made, strict=True)
    return Refined(labels, samples, warnings, prepared)

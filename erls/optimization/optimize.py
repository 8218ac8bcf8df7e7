"""Problem in, optimum out: the one door."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from erls.maths.so3 import Array
from erls.optimization.choices import best_of
from erls.optimization.confirm import confirmed, simulated
from erls.optimization.dynamics import Dynamics
from erls.optimization.memory import Memory
from erls.optimization.methods import outcome
from erls.optimization.problem import Problem, load_problem
from erls.optimization.result import INTERRUPTED, Analysis, Optimization, Outcome
from fe_import.files.log import log


def optimize(
    problem: Problem | Path | str,
    *,
    changes: Sequence[str] = (),
    tell: Callable[[str], None] = log,
    progress: Callable[[str, int, Analysis], None] = lambda method, count, analysis: None,
    state: Path | None = None,
    resume: bool = False,
    confirm: bool = True,
) -> Optimization:
    """Find designs that are best by all methods of a problem.

    Parameters
    ----------
    problem : Problem, Path or str
    changes : sequence of str
        KEY=VALUE: fields of the problem, where a path is given.
    tell : callable
        Told about each preparation that takes time.
    progress : callable
        Told each analysis: method, how many it has made, and what it found.
    state : Path, optional
        File that is kept of all analyses.
    resume : bool
        Begin with what that file knows.
    confirm : bool
        Whether to simulate final designs again, at all steps and by other formulations.

    Returns
    -------
    Optimization
        Whose outcomes say whether they converged; interrupted ones hold what was found so far.

    Raises
    ------
    SceneError, FEImportError
        Bad input; a method that cannot treat the problem: names what, and what to do.
    SimulationError
        A run failed.

    Examples
    --------
    >>> import erls
    >>> found = erls.optimize("data/optimization/cantilever.toml")
    >>> found.best.status, round(found.best.mass, 3)
    ('converged', 0.711)
    """
    loaded = problem if isinstance(problem, Problem) else load_problem(problem, changes)
    memory = Memory(loaded, state, resume)
    solved = partial(_solved, tell=tell, progress=progress)
    if loaded.alternatives:
        return best_of(loaded, memory, solved, confirm, tell)
    return solved(loaded, memory, confirm)


def _solved(
    loaded: Problem,
    memory: Memory,
    confirm: bool,
    *,
    tell: Callable[[str], None],
    progress: Callable[[str, int, Analysis], None],
) -> Optimization:
    """A problem without choices."""
    begun, settings = time.perf_counter(), loaded.record.settings
    dynamics = Dynamics(loaded, memory, tell)
    generator = np.random.default_rng(settings.seed)
    others = [_drawn(loaded, generator) for _ in range(settings.starts - 1)]
    found: list[Outcome] = []
    for method in settings.methods:
        own = outcome(method, dynamics, loaded.start, progress)
        for x in others if own.status != INTERRUPTED else ():
            own = _beside(own, outcome(method, dynamics, x, progress))
            if own.status == INTERRUPTED:
                break
        if confirm and own.status != INTERRUPTED:
            try:
                own = replace(own, confirmed=confirmed(dynamics, own.x, tell))
            except KeyboardInterrupt:
                own = replace(own, status=INTERRUPTED)
        if own.confirmed and not own.confirmed[0].failure:
            own = replace(own, violation=own.confirmed[0].violation)
        found.append(own)
        if own.status == INTERRUPTED:
            break
    first = next((o.history[0] for o in found if o.history), None)
    start = first or Analysis(loaded.start, dynamics.rules.objective.weighed(loaded.start), float("nan"), float("inf"))
    whole = all(o.status != INTERRUPTED for o in found)
    first_run = simulated(loaded, start.x, tell) if confirm and whole else None
    return Optimization(loaded, start, tuple(found), time.perf_counter() - begun, first_run)


def _drawn(problem: Problem, generator: np.random.Generator) -> Array:
    """A start between the bounds."""
    return np.asarray(problem.lower + generator.random(len(problem.start)) * (problem.upper - problem.lower))


def _beside(own: Outcome, other: Outcome) -> Outcome:
    """The better of two starts, what the other found beside it."""
    pair = (own, other)
    better = min(pair, key=lambda o: (o.status != "converged", o.objective))
    worse = pair[1] if better is own else pair[0]
    entry = worse.objective, worse.violation, worse.analyses, worse.status
    status = INTERRUPTED if other.status == INTERRUPTED else better.status
    return replace(
        better, status=status, further=(*own.further, entry), wall_s=own.wall_s + other.wall_s,
        run_s=own.run_s + other.run_s, gradient_s=own.gradient_s + other.gradient_s,
    )  # fmt: skip

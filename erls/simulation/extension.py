"""A run that goes on beyond its end: with the settings, effects and models that it was made with.

Its end stays the end of a step, at which the integrator starts afresh from the last state. So a run that is extended
equals one that is made and extended at once, bit for bit on the same machine, for each of its ends.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np

from erls.errors import Cause, SceneError
from erls.integrate.thinning import output_step
from erls.maths.jit import announcing
from erls.run.chain.run import ChainRun
from erls.run.checkpoints import EXTENDED, Checkpoints
from erls.run.file import self_contained
from erls.run.record import Run
from erls.run.watches.watching import Warnings
from erls.scene.chain import Scene, SceneRecord
from erls.scene.records import SceneFile
from erls.scene.settings import Simulation
from erls.simulation.asked import Asked
from erls.simulation.chains import run_mechanism

_LONGER = "simulate with a longer simulation.duration"
_RESOLVED = ("duration", "effects", "bandwidth", "output_step")  # what a run may have settled itself


def refuse_unextendable(run: Run, until: float) -> ChainRun:
    """The run of a chain that can be extended.

    Raises
    ------
    SceneError
        BAD_FIELD: why it cannot; TIME_OUT_OF_RANGE: that is not beyond its end.
    """
    problem = ""
    if not isinstance(run, ChainRun):
        problem = "a run of bodies and beams cannot be extended"
    elif run.failure is not None:
        problem = "a run that failed or was stopped cannot be extended"
    elif run.end < run.scene.record.simulation.duration:
        problem = "a run that one of its events ended cannot be extended"
    if problem:
        raise SceneError(Cause.BAD_FIELD, problem, where="--until", value=until, remedy=_LONGER)
    assert isinstance(run, ChainRun)
    refuse_time(run.scene.record.simulation, until)
    return run


def refuse_time(settings: Simulation, until: float) -> None:
    """Raise before any work where a run with these settings cannot go on up to that time.

    Raises
    ------
    SceneError
        BAD_FIELD, TIME_OUT_OF_RANGE.
    """
    if settings.bandwidth is not None:
        problem = "a run whose fast modes follow statically (simulation.bandwidth) cannot be extended"
        raise SceneError(Cause.BAD_FIELD, problem, where="--until", value=until, remedy=_LONGER)
    if not settings.duration < until < np.inf:
        message, limit = "not beyond the end of the run", f"beyond {settings.duration:.6g} s"
        where, remedy = "--until", "give a later time"
        raise SceneError(Cause.TIME_OUT_OF_RANGE, message, where=where, value=until, limit=limit, remedy=remedy)


def refuse_other(scene: SceneFile, run: Run) -> None:
    """Raise where a run is not of a scene.

    Raises
    ------
    SceneError
        CHANGED, naming the table.
    """
    now, before = (_tables(self_contained(scene)), _tables(run.scene))
    for name in now:
        if now[name] != before.get(name):
            message, remedy = "it is not what the run was made with", "take back the change, or run the scene again"
            raise SceneError(Cause.CHANGED, message, where=f"{scene.path}: {name}", remedy=remedy)


def _tables(scene: SceneFile) -> dict[str, Any]:
    """Of a scene, without what ``auto`` chooses, what an extension settles and what link descriptions say."""
    tables: dict[str, Any] = msgspec.to_builtins(scene.record)
    for name in _RESOLVED:
        tables["simulation"].pop(name, None)
    for link in tables.get("links", ()):
        link.pop("flexible", None)
    for sensor in tables.get("sensors", ()):
        sensor.pop("compliance", None)
    return tables


def extend(
    run: Run,
    until: float,
    *,
    progress: Callable[[float, float], None] | None = None,
    tell: Callable[[str], None] = lambda text: None,
    checkpoint: Checkpoints | None = None,
    verdict: bool = True,
) -> ChainRun:
    """Extend a run that was read from a file; arguments as of `erls.simulation.simulate.simulate`.

    Raises
    ------
    SceneError
        It cannot be extended (`refuse_unextendable`); CHANGED: the checkpoint is of something else.
    SimulationError
        As of a simulation.
    """
    return extended(
        refuse_unextendable(run, until), until, Asked(progress, tell, checkpoint, False, None, verdict), True
    )


def extended(run: ChainRun, until: float, asked: Asked, beside: bool = False) -> ChainRun:
    """The run up to a later time, with what it states of its error over all of it.

    Parameters
    ----------
    run : ChainRun
        One that `refuse_unextendable` does not refuse.
    until : float
        [s]
    asked : Asked
    beside : bool
        Whether the run was made before, by another simulation, which its checkpoints then name.
    """
    mechanism = run.formulation.mechanism
    if beside and asked.checkpoints is not None:
        last = b"".join(np.ascontiguousarray(x[-1]).tobytes() for x in (run.solution.t, run.solution.y, run.solution.v))
        models = [part.model for link in mechanism.links for part in (link, *link.pieces)]
        asked.checkpoints.identify(run.scene, models, {EXTENDED: hashlib.sha256(last).hexdigest()})
    found = run_mechanism(_longer(run.scene, until), mechanism, asked, Warnings(asked.tell), run)
    if not asked.verdict:
        return found
    from erls.accuracy.statement import stated  # here: runs without a verdict need none of it

    with announcing(asked.tell):
        return stated(found)


def _longer(scene: Scene, until: float) -> Scene:
    record: SceneRecord = scene.record
    settings = record.simulation
    settings = msgspec.structs.replace(settings, duration=until, output_step=output_step(settings))
    return replace(scene, record=msgspec.structs.replace(record, simulation=settings))

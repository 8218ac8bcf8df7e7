"""A run that keeps to the tolerance of its scene: repeated more accurately where that helps, or refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import msgspec

from erls.errors import Cause, SimulationError
from erls.integrate.choice import options_of
from erls.run.accuracy import GOOD, PARTS
from erls.run.chain.run import ChainRun
from erls.scene.chain import Scene

_TIMES = 2
_AIM = 0.5  # of what the other parts leave to the integration
_SMALLEST = 1e-4  # of the tolerance: what is asked of an integration at most


def kept_to(run: ChainRun, again: Callable[[Scene], ChainRun], tell: Callable[[str], None]) -> ChainRun:
    """The run, or one with a smaller error of integration, whose verdict is good.

    Parameters
    ----------
    run : ChainRun
        With its statement.
    again : callable
        Makes a run of the scene with other settings.
    tell : callable
        Told of each repetition.

    Raises
    ------
    SimulationError
        BEYOND_TOLERANCE: another part is too large, or the integration stays so; its ``run`` is the last one.
    """
    from erls.accuracy.statement import stated  # here: runs without a verdict need none of it

    wanted = run.scene.record.simulation.tolerance
    for _ in range(_TIMES):
        scene = _finer(run, wanted)
        if run.trust is None or run.trust.verdict == GOOD or scene is None:
            break
        assert run.accuracy is not None
        tell(f"the integration is stated to be off by {run.accuracy.integration:.2g} m; repeated with less")
        run = stated(again(scene), wanted)
    if run.trust is not None and run.trust.verdict != GOOD:
        total = None if run.accuracy is None else run.accuracy.total
        problem = SimulationError(
            Cause.BEYOND_TOLERANCE,
            f"the run ended, and cannot be held to its tolerance: {'; '.join(run.trust.reasons)}",
            where="simulation.tolerance",
            value=None if total is None else f"{total:.2g} m",
            limit=f"{wanted:.2g} m",
            remedy="change what the reasons name, or give a larger simulation.tolerance",
        )
        problem.run = run
        raise problem
    return run


def _finer(run: ChainRun, wanted: float) -> Scene | None:
    """The scene with a tolerance or step at which the integration leaves room; None where something else is wrong."""
    accuracy, settings = run.accuracy, run.scene.record.simulation
    if accuracy is None or not accuracy.integration:
        return None
    others = [getattr(accuracy, name) for name in PARTS if name != "integration"]
    if any(part is None for part in others):
        return None
    room = wanted - math.fsum(others)
    share = _AIM * room / accuracy.integration
    if not _SMALLEST < share < 1:
        return None
    if options_of(settings).step is not None:
        assert settings.step is not None
        finer = msgspec.structs.replace(settings, step=settings.step * math.sqrt(share))
    else:
        scale = {name: getattr(settings, name) * share for name in ("tolerance", "rtol", "atol")}
        finer = msgspec.structs.replace(settings, **{**scale, "rtol": max(scale["rtol"], 3e-14)})
    return replace(run.scene, record=msgspec.structs.replace(run.scene.record, simulation=finer))

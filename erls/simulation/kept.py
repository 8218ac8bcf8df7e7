"""A run that keeps to the tolerance of its scene: repeated more accurately where that helps, or refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import msgspec

from erls.errors import Cause, SimulationError
from erls.integrate.choice import options_of
from erls.run.accuracy import GOOD, PARTS, Accuracy
from erls.run.chain.run import ChainRun
from erls.scene.build import link_description
from erls.scene.chain import Scene
from erls.scene.links import Link
from erls.scene.settings import Simulation
from fe_import.description.reduction import Reduction
from fe_import.errors import ReportedError

_TIMES = 3
_AIM = 0.5  # of what the other parts leave to the integration
_SMALLEST = 1e-4  # of the tolerance: what is asked of an integration at most
_FAIR = 0.2  # of the tolerance: what other parts may take before they are made smaller
_MORE = 2  # times the modes
_CANDIDATES = 12  # modes of a basis whose description gives no number


def kept_to(run: ChainRun, again: Callable[[Scene], ChainRun], tell: Callable[[str], None]) -> ChainRun:
    """The run, or one with smaller parts of its error, whose verdict is good.

    Parameters
    ----------
    run : ChainRun
        With its statement.
    again : callable
        Makes a run of the scene with other settings, effects or modes.
    tell : callable
        Told of each repetition.

    Raises
    ------
    SimulationError
        BEYOND_TOLERANCE: what is too large cannot be made smaller, or stays so; its ``run`` is the last one.
    """
    from erls.accuracy.statement import stated  # here: runs without a verdict need none of it

    wanted = run.scene.record.simulation.tolerance
    for _ in range(_TIMES):
        if run.trust is None or run.trust.verdict == GOOD:
            break
        scene, changes = _better(run, wanted)
        if not changes:
            break
        tell(f"{run.trust.reasons[0]}; repeated with {', '.join(changes)}")
        try:
            run = stated(again(scene), wanted)
        except ReportedError as refused:  # what links are made of does not give more
            tell(f"it cannot be repeated so: {refused}")
            break
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


def _better(run: ChainRun, wanted: float) -> tuple[Scene, list[str]]:
    """The scene with what makes parts smaller that are too large, and what that is; nothing where a part is unknown, or
    what links leave out is too large by itself.
    """
    accuracy, record = run.accuracy, run.scene.record
    settings, links, changes = record.simulation, record.links, list[str]()
    lacking = settings.effects not in ("all", "auto")
    if accuracy is None or accuracy.total is None or ((accuracy.links or 0.0) > wanted and not lacking):
        return run.scene, []
    large = {name for name in PARTS if (getattr(accuracy, name) or 0.0) > _FAIR * wanted}
    if "modes" in large:
        links = [_with_more_modes(run.scene, link) for link in links]
        changes += ["more modes"] if links != record.links else []
    if lacking and large & {"effects", "links"}:
        settings, changes = msgspec.structs.replace(settings, effects="all"), [*changes, "all effects"]
    if "effects" in large and settings.bandwidth is not None:
        settings, changes = msgspec.structs.replace(settings, bandwidth=None), [*changes, "no bandwidth"]
    if "output" in large and settings.output_step is not None:
        settings = msgspec.structs.replace(settings, output_step=settings.output_step / _MORE)
        changes.append("output twice as often")
    finer = _integrated_better(settings, accuracy, wanted)
    if finer is not None:
        settings, changes = finer, [*changes, "less error of the integration"]
    return replace(run.scene, record=msgspec.structs.replace(record, simulation=settings, links=links)), changes


def _integrated_better(settings: Simulation, accuracy: Accuracy, wanted: float) -> Simulation | None:
    """With a tolerance or step at which the integration takes half of what the other parts leave; None where it does,
    or they leave nothing.
    """
    others = [getattr(accuracy, name) or 0.0 for name in PARTS if name != "integration"]
    room = wanted - math.fsum(min(part, _FAIR * wanted) for part in others)
    share = _AIM * room / accuracy.integration if accuracy.integration else 1.0
    if not _SMALLEST < share < 1:
        return None
    if options_of(settings).step is not None:
        assert settings.step is not None
        return msgspec.structs.replace(settings, step=settings.step * math.sqrt(share))
    scale = {name: getattr(settings, name) * share for name in ("tolerance", "rtol", "atol")}
    return msgspec.structs.replace(settings, **{**scale, "rtol": max(scale["rtol"], 3e-14)})


def _with_more_modes(scene: Scene, link: Link) -> Link:
    """The link with all modes of a basis of twice the size; as it is where it has all, or is a modal file."""
    if not link.model or not link.flexible:
        return link
    own = link_description(scene, link).description.reduction
    counts = {"craig-bampton": "fixed_interface_modes", "craig-chang": "free_modes", "mode-displacement": "free_modes"}
    if own.method not in counts or own.selection != Reduction().selection:
        return link
    more: dict[str, int | None] = {counts[own.method]: _MORE * (getattr(own, counts[own.method]) or _CANDIDATES)}
    if own.elastic_modes is not None:
        more["elastic_modes"] = None
    return msgspec.structs.replace(link, reduction={**link.reduction, **more}, elastic_modes=None)

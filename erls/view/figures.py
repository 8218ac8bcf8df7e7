"""The figure of a run of any kind."""

from __future__ import annotations

from erls.errors import Cause, SceneError
from erls.run.bodies.mode import BodyMode
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.run import BodyRun
from erls.run.chain.run import ChainRun
from erls.run.record import Run
from erls.view.bodies import BodyFigure
from erls.view.chain import ChainFigure
from erls.view.figure import DEFLECTION, STRESS, Figure
from erls.view.stress import no_stress


def holds_stress(run: Run) -> bool:
    """Whether links or shells of a run tell their stress; the amplitude of a mode means nothing, and so does its."""
    if isinstance(run, ChainRun):
        models = [run.formulation.mechanism.links[k].model for k in run.formulation.mechanism.bodies]
        return any(model.recovery is not None and model.recovery.quantity == "stress" for model in models)
    return isinstance(run, BodyRun) and not isinstance(run, BodyMode) and bool(run.assembly.shells)


def figure_of(run: Run, magnification: float = 1.0, stress: bool = False) -> Figure:
    """What is drawn of a run; ``stress`` says that colours do, rather than deflection.

    Raises
    ------
    SceneError
        BAD_FIELD: a magnification where there is nothing that displacements count from; nothing was computed; stress
        where nothing holds any, or of modes, whose amplitude means nothing.
    """
    shade = STRESS if stress else DEFLECTION
    if isinstance(run, ChainRun):
        if stress and not holds_stress(run):
            raise no_stress(run)
        return ChainFigure(run, shade)
    assert isinstance(run, BodyRun)
    if not len(run.times):
        message, remedy = "the run holds nothing to draw", "mend what stopped it, and simulate again"
        raise SceneError(Cause.BAD_FIELD, message, where=run.scene.name, value=run.failure, remedy=remedy)
    if magnification != 1.0 and isinstance(run, BodyMotion):
        message, remedy = "bodies and beams that move have no displacement to magnify", "leave it at 1"
        raise SceneError(Cause.BAD_FIELD, message, where="magnification", value=magnification, remedy=remedy)
    if stress and isinstance(run, BodyMode):
        message, remedy = "modes have no scale, and their stress neither", "leave stress out"
        raise SceneError(Cause.BAD_FIELD, message, where="stress", value=run.title, remedy=remedy)
    if stress and not holds_stress(run):
        raise no_stress(run)
    return BodyFigure(run, shade)

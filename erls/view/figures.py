"""The figure of a run of any kind."""

from __future__ import annotations

from erls.errors import Cause, SceneError
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.run import BodyRun
from erls.run.chain.run import ChainRun
from erls.run.record import Run
from erls.view.bodies import BodyFigure
from erls.view.chain import ChainFigure
from erls.view.figure import Figure


def figure_of(run: Run, magnification: float = 1.0) -> Figure:
    """What is drawn of a run.

    Raises
    ------
    SceneError
        BAD_FIELD: a magnification where there is nothing that displacements count from; nothing was computed.
    """
    if isinstance(run, ChainRun):
        return ChainFigure(run)
    assert isinstance(run, BodyRun)
    if not len(run.times):
        message, remedy = "the run holds nothing to draw", "mend what stopped it, and simulate again"
        raise SceneError(Cause.BAD_FIELD, message, where=run.scene.name, value=run.failure, remedy=remedy)
    if magnification != 1.0 and isinstance(run, BodyMotion):
        message, remedy = "bodies and beams that move have no displacement to magnify", "leave it at 1"
        raise SceneError(Cause.BAD_FIELD, message, where="magnification", value=magnification, remedy=remedy)
    return BodyFigure(run)

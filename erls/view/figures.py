"""The figure of a run of any kind."""

from __future__ import annotations

from erls.errors import Cause, SceneError
from erls.run.bodies.mode import BodyMode
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.run import BodyRun
from erls.run.chain.run import ChainRun
from erls.run.link_mode import LinkMode
from erls.run.record import Run
from erls.view.bodies import BodyFigure
from erls.view.chain import ChainFigure
from erls.view.figure import DEFLECTION, SHADES, Figure
from erls.view.link_mode import LinkModeFigure
from erls.view.stress import holds, holds_none
from fe_import.files.toml import choose


def figure_of(run: Run, magnification: float = 1.0, color: str = "deflection") -> Figure:
    """What is drawn of a run; ``color`` says what colours do: a key of `erls.view.figure.SHADES`.

    Raises
    ------
    SceneError
        BAD_FIELD: a magnification where there is nothing that displacements count from; nothing was computed; a colour
        that nothing holds, or stress of modes, whose amplitude means nothing; BAD_REFERENCE: no such colour.
    """
    choose(color, SHADES, "color", SceneError)
    shade = SHADES[color]
    if isinstance(run, ChainRun):
        if not holds(run, shade):
            raise holds_none(run, shade)
        return ChainFigure(run, shade)
    if isinstance(run, LinkMode):
        if shade is not DEFLECTION:
            raise _without_scale(run)
        return LinkModeFigure(run)
    assert isinstance(run, BodyRun)
    if not len(run.times):
        message, remedy = "the run holds nothing to draw", "mend what stopped it, and simulate again"
        raise SceneError(Cause.BAD_FIELD, message, where=run.scene.name, value=run.failure, remedy=remedy)
    if magnification != 1.0 and isinstance(run, BodyMotion):
        message, remedy = "bodies and beams that move have no displacement to magnify", "leave it at 1"
        raise SceneError(Cause.BAD_FIELD, message, where="magnification", value=magnification, remedy=remedy)
    if shade is not DEFLECTION and isinstance(run, BodyMode):
        raise _without_scale(run)
    if not holds(run, shade):
        raise holds_none(run, shade)
    return BodyFigure(run, shade)


def _without_scale(run: Run) -> SceneError:
    message, remedy = "modes have no scale, and their stress neither", "leave the colour at deflection"
    return SceneError(Cause.BAD_FIELD, message, where="color", value=run.title, remedy=remedy)

"""Pictures, films and windows of a run; and `write_view`, which picks the kind of output by the name's ending."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from erls.files.output import check_writable, replacing
from erls.files.results import MARK
from erls.run.link_mode import LinkMode
from erls.run.record import Run
from erls.view.camera import Size
from erls.view.checks import Progress, bad, check, drawing, no_picture, surveyed
from erls.view.export import export_csv, export_paraview
from erls.view.figures import figure_of
from erls.view.film import FILMS, film
from erls.view.run_page import run_page
from erls.view.stage import Stage
from erls.view.text import caption, displacement, point_labels, time_labels, written
from erls.view.window import Window

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.PngImagePlugin import PngInfo

__all__ = ["film", "picture", "show", "view_kind", "write_view"]

_INSTANTS = 6
PICTURES = (".png", ".jpg", ".jpeg")


def picture(
    run: Run,
    path: Path | str,
    times: Sequence[float] | None = None,
    magnification: float = 1.0,
    size: Size = (1280, 800),
    color: str = "deflection",
) -> None:
    """Draw a run: the mechanism at several times, the last one solid, with the paths of its points.

    Parameters
    ----------
    run : Run
    path : path
        .png or .jpg.
    times : sequence of float, optional
        [s]; six even ones unless given. The last is drawn solid, the others as ghosts, fainter the earlier.
    magnification : float
        Of the displacement against the Equivalent Rigid Link System, at rest against where all is built; 1 is true.
    size : (width, height)
        [pixel]
    color : str
        What colours say: a key of `erls.view.figure.SHADES`.

    Raises
    ------
    SceneError
        NOT_WRITABLE, TIME_OUT_OF_RANGE, BAD_FIELD.
    SimulationError
        NO_PICTURE: no drawing is possible on this machine.
    """
    check(magnification, size, path, PICTURES)
    with replacing(path) as temporary:
        image = _picture(run, times, magnification, size, color)
        if temporary.suffix.lower() == ".png":
            image.save(temporary, optimize=True, pnginfo=_remark())
        else:
            image.save(temporary, quality=95, comment=MARK)


def _remark() -> PngInfo:
    from PIL.PngImagePlugin import PngInfo

    remark = PngInfo()
    remark.add_text("Comment", MARK)
    return remark


def _picture(run: Run, times: Sequence[float] | None, magnification: float, size: Size, color: str) -> Image:
    figure = figure_of(run, magnification, color)
    poses = figure.poses(run.spread(_INSTANTS) if times is None or not len(times) else times)
    motion = surveyed(figure, magnification, poses)
    *earlier, last = poses
    with drawing(), Stage(figure, motion, magnification, size, finer=2) as stage:
        empty = stage.image()
        blended = empty.astype(np.float32)
        for k, pose in enumerate(earlier):
            stage.pose(pose, ghost=True)
            ghost = stage.image()
            weight = 0.15 + 0.4 * (k + 1) / len(earlier)
            covers = (ghost != empty).any(axis=2, keepdims=True)
            blended = np.where(covers, (1 - weight) * blended + weight * ghost, blended)
        stage.pose(last)
        solid = stage.image()
        blended = np.where((solid != empty).any(axis=2, keepdims=True), solid, blended)  # over every ghost
        sheet = written(stage, np.rint(blended).astype(np.uint8), caption(run, poses, magnification))
        labels = point_labels(stage, last)
        if len(poses) > 1:
            labels += time_labels(stage, poses)
        sheet.place(labels)
    return sheet.image


def show(run: Run, magnification: float = 1.0, size: Size = (1280, 800), color: str = "deflection") -> None:
    """Open a window that can be turned, with a slider for time; returns when it is closed.

    Raises
    ------
    SimulationError
        NO_PICTURE: there is no display.
    """
    check(magnification, size)
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        raise no_picture("there is no display for a window")
    figure = figure_of(run, magnification, color)
    motion = surveyed(figure, magnification, None)
    with drawing(), Window(figure, motion, magnification, size) as window:
        if window.hidden:
            raise no_picture("the display cannot be opened")
        window.interact(f"{run.title}  ·  {displacement(run, magnification)}")


def view_kind(path: Path | str) -> str:
    """The ending of a name, in small letters, which says what is written.

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (*PICTURES, *FILMS, ".pvd", ".csv", ".html"):
        remedy = "end it in .png, .jpg (picture), .mp4, .gif (film), .html (report), .pvd (ParaView) or .csv (table)"
        raise bad("-o", "the ending of the name does not say what to write", str(path), None, remedy)
    return suffix


def write_view(
    run: Run,
    path: Path | str,
    *,
    times: Sequence[float] | None = None,
    magnification: float = 1.0,
    fps: int = 30,
    speed: float = 1.0,
    progress: Progress | None = None,
    repeat: Sequence[str] = (),
    color: str = "deflection",
) -> None:
    """Write a picture (.png, .jpg), film (.mp4, .gif), report (.html), export for ParaView (.pvd) or table (.csv).

    Parameters
    ----------
    run : Run
    path : path
        Its ending decides.
    times : sequence of float, optional
        [s]; not for films.
    magnification : float
        Of the displacement against the Equivalent Rigid Link System; not for tables and reports.
    fps, speed : int, float
        Of films.
    progress : callable, optional
        Told how much is done, and the total.
    repeat : sequence of str
        Words of the command that made the run, for a report.
    color : str
        What colours of pictures and films say: ``deflection``; ``stress``, von Mises, of shells the largest over the
        thickness; ``section-force``, ``section-moment`` of beams. An export has it beside. Not for tables and reports.

    Raises
    ------
    SceneError
        BAD_FIELD, NOT_WRITABLE, TIME_OUT_OF_RANGE.
    SimulationError
        NO_PICTURE.
    """
    suffix = view_kind(path)
    check_writable(path)
    if suffix in FILMS:
        if times is not None and len(times):
            raise bad("times", "a film shows the whole run", list(times), None, "leave the times out, or make a .png")
        film(run, path, magnification, fps, speed, progress=progress, color=color)
    elif suffix in PICTURES:
        picture(run, path, times, magnification, color=color)
    elif suffix == ".pvd":
        export_paraview(run, path, times, magnification, progress, color)
    elif color != "deflection":
        remedy = "make a picture (.png, .jpg), a film (.mp4, .gif) or an export (.pvd)"
        raise bad("color", "tables and reports do not show it", suffix, None, remedy)
    elif magnification != 1.0:
        what = "a table holds" if suffix == ".csv" else "a report has a slider for it and shows"
        raise bad("magnification", f"{what} true values", magnification, None, "leave it at 1")
    elif suffix == ".html":
        if isinstance(run, LinkMode):
            raise bad("-o", "a report is of a run, not of a mode", suffix, None, "make a picture, film or table")
        if times is not None and len(times):
            raise bad("times", "a report shows the whole run", list(times), None, "leave the times out")
        text = run_page(run, repeat)
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    else:
        export_csv(run, path, times)

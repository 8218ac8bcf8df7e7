"""What pictures, films and windows share: checked arguments, the survey of a run, failures of the graphics library."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from erls.errors import Cause, SceneError, SimulationError
from erls.files.optional import optional_package
from erls.view.camera import Size
from erls.view.figure import Figure, Pose
from erls.view.stage import Motion

Progress = Callable[[int, int], None]  # (done, total)


def check(magnification: float, size: Size, path: Path | str = "", endings: Sequence[str] = ("",)) -> None:
    """Refuse arguments that make no picture.

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    if Path(path).suffix.lower() not in endings:
        raise bad("path", "not a suitable ending of the name", str(path), None, "end it in " + " or ".join(endings))
    if not (np.isfinite(magnification) and magnification >= 0):
        raise bad("magnification", "not a usable factor", magnification, None, "1 shows the true displacement")
    if not (len(size) == 2 and all(100 <= n <= 8000 for n in size)):
        raise bad("size", "not a usable size", size, "100 to 8000 pixels each", "give width and height")


def surveyed(figure: Figure, magnification: float, poses: Sequence[Pose] | None) -> Motion:
    """The survey of a run, for some poses or for all of it; refused where magnification makes it infinite."""
    with np.errstate(over="ignore", invalid="ignore"):
        motion = Motion.of(figure, magnification, poses)
    if motion is None:
        raise bad("magnification", "the mechanism would be infinitely large", magnification, None, "lower it")
    return motion


def bad(where: str, message: str, value: object, limit: object, remedy: str) -> SceneError:
    """A BAD_FIELD error."""
    return SceneError(Cause.BAD_FIELD, message, where=where, value=value, limit=limit, remedy=remedy)


def no_picture(message: str) -> SimulationError:
    """A NO_PICTURE error for a window."""
    return SimulationError(Cause.NO_PICTURE, message, where="view", remedy="give -o PICTURE.png")


@contextlib.contextmanager
def drawing() -> Iterator[None]:
    """Failures of the graphics library as one error, and its chatter about missing X servers kept quiet."""
    pv = optional_package("pyvista", "view")
    try:
        with pv.vtk_verbosity("off"):
            yield
    except RuntimeError as problem:
        raise SimulationError(
            Cause.NO_PICTURE,
            f"nothing can be drawn on this machine: {problem}",
            where="view",
            remedy="export with -o RUN.pvd for ParaView, or -o RUN.csv",
        ) from problem

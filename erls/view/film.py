"""Films of a run, encoded frame by frame by the ffmpeg that comes with imageio-ffmpeg."""

from __future__ import annotations

import contextlib
import os
import subprocess
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from erls.errors import Cause, SimulationError
from erls.files.output import replacing
from erls.files.results import MARK
from erls.maths.so3 import Array
from erls.run.record import Run
from erls.view.camera import Size
from erls.view.checks import Progress, bad, check, drawing, surveyed
from erls.view.figures import figure_of
from erls.view.stage import Stage
from erls.view.text import caption, point_labels, written

if TYPE_CHECKING:
    from PIL.Image import Image

_MOST_FRAMES = 100_000
# every frame of a .gif with its own 256 colours: nothing has to wait in memory for the last one
_GIF = "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=none"
_CODECS = {
    ".mp4": [
        *("-c:v", "libx264", "-crf", "16", "-preset", "medium", "-pix_fmt", "yuv420p", "-movflags", "+faststart"),
        *("-metadata", f"comment={MARK}"),
    ],
    ".gif": ["-filter_complex", _GIF, "-loop", "0"],
}
FILMS = tuple(_CODECS)


def film(
    run: Run,
    path: Path | str,
    magnification: float = 1.0,
    fps: int = 30,
    speed: float = 1.0,
    size: Size = (1280, 800),
    progress: Progress | None = None,
    color: str = "deflection",
) -> None:
    """Film a run from a fixed place.

    Parameters
    ----------
    run : Run
    path : path
        .mp4 (H.264) or .gif.
    magnification : float
        Of the displacement against the Equivalent Rigid Link System; 1 is true.
    fps : int
        Frames per second.
    speed : float
        Speed of the film; 0.5 is slow motion.
    size : (width, height)
        [pixel], rounded down to even numbers.
    progress : callable, optional
        Told the frames done and their total.
    color : str
        What colours say: a key of `erls.view.figure.SHADES`.

    Raises
    ------
    SceneError
        NOT_WRITABLE, BAD_FIELD.
    SimulationError
        NO_PICTURE: no drawing is possible on this machine, or the film could not be encoded.
    """
    check(magnification, size, path, FILMS)
    times = _frame_times(run, fps, speed, 50 if Path(path).suffix.lower() == ".gif" else 240)
    size = (size[0] - size[0] % 2, size[1] - size[1] % 2)
    with replacing(path) as temporary:
        figure = figure_of(run, magnification, color)
        motion = surveyed(figure, magnification, None)
        with drawing(), Stage(figure, motion, magnification, size) as stage, FilmWriter(temporary, size, fps) as writer:
            sides: dict[str, int] = {}
            for k, time in enumerate(times.tolist()):
                (pose,) = figure.poses(run.nearest([time]))
                stage.pose(pose)
                stage.paths(time)
                sheet = written(stage, stage.image(), caption(run, [pose], magnification, speed))
                sides = sheet.place(point_labels(stage, pose), sides)
                writer.add(sheet.image)
                if progress is not None:
                    progress(k + 1, len(times))
        if temporary.suffix.lower() == ".gif":
            _remark(temporary)


def _remark(path: Path) -> None:
    """Put a comment before the end of a .gif; its encoder has none."""
    text = MARK.encode()
    with path.open("r+b") as file:
        file.seek(-1, os.SEEK_END)
        file.write(b"\x21\xfe" + bytes([len(text)]) + text + b"\x00\x3b")


def _frame_times(run: Run, fps: int, speed: float, most: int) -> Array:
    """(n,) times of the frames, first and last of the run included."""
    if not 1 <= fps <= most:
        raise bad("fps", "not a usable frame rate", fps, f"1 to {most}", "give for example 30")
    if not (np.isfinite(speed) and speed > 0):
        raise bad("speed", "speed must be positive", speed, None, "1 is real time, 0.5 slow motion")
    frames = (run.end - run.start) * fps / speed
    if not frames <= _MOST_FRAMES:
        raise bad("speed", "the film would be too long", speed, f"{_MOST_FRAMES} frames", "raise speed, lower fps")
    return np.linspace(run.start, run.end, round(frames) + 1)


class FilmWriter:
    """Writes frames to a file; used in a ``with`` statement, which ends the encoder in any case.

    Parameters
    ----------
    path : Path
        .mp4 or .gif.
    size : (width, height)
        Of every frame [pixel]; even.
    fps : int
        Frames per second.
    """

    def __init__(self, path: Path, size: Size, fps: int) -> None:
        self._path, self._size, self._fps = path, size, fps

    def __enter__(self) -> FilmWriter:
        import imageio_ffmpeg

        width, height = self._size
        self._said: Any = tempfile.TemporaryFile()
        source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(self._fps), "-i", "-"]
        try:
            self._process = subprocess.Popen(
                [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-v", "error", *source, *_CODECS[self._path.suffix.lower()],
                 str(self._path)],
                stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=self._said,
                start_new_session=True,  # Ctrl-C is for us
            )  # fmt: skip
        except (OSError, RuntimeError) as problem:
            self._said.close()
            raise _failed(problem) from problem
        return self

    def add(self, frame: Image) -> None:
        """Write a frame."""
        try:
            self._pipe.write(frame.tobytes())
        except OSError as problem:
            self._process.wait()
            raise _failed(self._complaint() or problem) from problem

    @property
    def _pipe(self) -> Any:
        return self._process.stdin

    def _complaint(self) -> str:
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").strip().splitlines()
        return str(lines[-1]) if lines else ""

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        try:
            if kind is not None:
                self._process.kill()
            with contextlib.suppress(OSError):  # the exit code tells
                self._pipe.close()
            code = self._process.wait()
            if code and kind is None:
                raise _failed(self._complaint() or f"exit code {code}")
        except BaseException:
            self._process.kill()
            self._process.wait()
            raise
        finally:
            self._said.close()


def _failed(problem: object) -> SimulationError:
    return SimulationError(
        Cause.NO_PICTURE,
        f"the film could not be encoded: {problem}",
        where="ffmpeg",
        remedy="free disk space, or name another ffmpeg in IMAGEIO_FFMPEG_EXE",
    )

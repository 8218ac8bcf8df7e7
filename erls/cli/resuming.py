"""What an earlier ``erls simulate`` left from which another one goes on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from erls.cli.terminal import tell

if TYPE_CHECKING:
    from erls.run.checkpoints import Saved
    from erls.run.record import Run


def checkpoint_of(output: Path) -> Path:
    """The file beside an output that holds the last checkpoint of an unfinished run."""
    return output.with_name(f"{output.name}.partial")


def refuse_together(until: float | None, strict: bool) -> None:
    """Raise where options exclude one another.

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    from erls.errors import Cause, SceneError

    if until is not None and strict:
        message, remedy = "--strict repeats runs, which --until goes on with", "leave one of them out"
        raise SceneError(Cause.BAD_FIELD, message, where="--until", value=until, remedy=remedy)


def left_by(output: Path, until: float | None) -> tuple[Saved | None, Run | None]:
    """What was saved of the run that was to be written there, and the finished one that is to be extended.

    Where there is neither, which is told, the run starts anew.

    Raises
    ------
    SceneError
        A file is damaged, or cannot be gone on from; BAD_FIELD where the run is finished.
    """
    from erls.errors import Cause, SceneError
    from erls.run.checkpoints import EXTENDED, read_checkpoint
    from erls.run.file import load_run

    partial = checkpoint_of(output)
    saved = read_checkpoint(partial) if partial.exists() else None
    if saved is not None and EXTENDED not in saved.made_from:
        return saved, None
    run = load_run(output) if output.exists() else None
    if run is not None and run.failure is None:
        if until is not None:
            return saved, run
        message, remedy = "the run is finished: nothing is left to resume", "give --until to go on beyond its end"
        raise SceneError(Cause.BAD_FIELD, message, where=f"--resume {output}", remedy=remedy)
    tell(f"no checkpoint {partial}: nothing was left to go on from, so the run starts anew")
    return None, None

"""What an earlier ``erls simulate`` left from which another one goes on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from erls.cli.terminal import tell

if TYPE_CHECKING:
    from erls.run.checkpoints import Saved


def checkpoint_of(output: Path) -> Path:
    """The file beside an output that holds the last checkpoint of an unfinished run."""
    return output.with_name(f"{output.name}.partial")


def left_by(output: Path) -> Saved | None:
    """What was saved of the run that was to be written there; None, which is told, where nothing was.

    Raises
    ------
    SceneError
        The checkpoint is damaged, or cannot be gone on from; BAD_FIELD where the run is finished.
    """
    from erls.errors import Cause, SceneError
    from erls.run.checkpoints import read_checkpoint
    from erls.run.file import load_run

    partial = checkpoint_of(output)
    if partial.exists():
        return read_checkpoint(partial)
    if output.exists() and load_run(output).failure is None:
        message, remedy = "the run is finished: nothing is left to resume", "leave --resume out to run the scene again"
        raise SceneError(Cause.BAD_FIELD, message, where=f"--resume {output}", remedy=remedy)
    tell(f"no checkpoint {partial}: nothing was left to go on from, so the run starts anew")
    return None

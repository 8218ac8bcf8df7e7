"""What the commands that write reports share: options, checks, exit codes."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from erls.cli.terminal import tell

if TYPE_CHECKING:
    from erls.errors import SceneError
    from erls.studies.kept import State

Set = Annotated[list[str] | None, Parameter(name="--set", negative="")]
Workers = Annotated[int | None, Parameter(name="--workers")]
StateFile = Annotated[Path | None, Parameter(name="--state")]
Resume = Annotated[bool, Parameter(name="--resume", negative="")]


def kept_in(state: Path | None, resume: bool, force: bool) -> State | None:
    """Where a study keeps its runs."""
    from erls.studies.kept import SUFFIX, State

    if state is None:
        if resume:
            raise bad("nothing to go on from", "--resume", "no --state", "name the file with --state")
        return None
    if state.suffix != SUFFIX:
        raise bad("the ending of the file says what it is", "--state", state.name, f"end in {SUFFIX}")
    return State(state, resume, force)


def exit_code(complete: bool, failed: list[int]) -> int:
    """130 after an interrupt, else the worst of the runs that failed."""
    return 130 if not complete else max(failed, default=0)


def check_output(
    output: Path | None,
    scenes: Sequence[Path],
    changes: Sequence[str],
    suffixes: tuple[str, ...],
    force: bool,
    more: Sequence[Path] = (),
) -> None:
    """Refuse a report that must not be written (`erls.files.results.claim`), or whose ending says no form.

    ``more`` is read beside the scenes with their changes.
    """
    if output is None:
        return
    from erls.files.results import claim

    if output.suffix not in suffixes:
        remedy = "end in " + ", ".join(suffixes)
        raise bad("the ending of the report decides its form", "--output", output.name, remedy)
    claim(output, output.suffix, [*read_by(scenes, changes), *more], force)


def read_by(scenes: Sequence[Path], changes: Sequence[str]) -> list[Path]:
    """Files that commands read for scenes; of one that cannot be read itself."""
    from erls.scene.inputs import files_of
    from erls.scene.read import load_scene
    from fe_import.errors import ReportedError

    found = list(scenes)
    for scene in scenes:
        with contextlib.suppress(ReportedError):  # reported, or stated, by who runs it
            found += files_of(load_scene(scene, changes))
    return found


def bad(message: str, where: str, value: object, remedy: str) -> SceneError:
    """A BAD_FIELD error about the command line."""
    from erls.errors import Cause, SceneError

    return SceneError(Cause.BAD_FIELD, message, where=where, value=value, remedy=remedy)


def write(path: Path, text: str) -> None:
    """Write a text, completely or not at all."""
    from erls.files.output import replacing

    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def dumped(summary: dict[str, object]) -> str:
    """JSON as a file, with the mark of a result (`erls.files.results`)."""
    from erls.cli.terminal import json_text

    return json_text({"written_by": "erls", **summary}) + "\n"


def tell_written(output: Path | None) -> None:
    """Say where a report is."""
    if output is not None:
        tell(f"written to {output}")

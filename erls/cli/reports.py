"""What the commands that write reports share: options, checks, exit codes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from erls.cli.terminal import refuse_unwritable, tell

if TYPE_CHECKING:
    from erls.errors import SceneError

Set = Annotated[list[str] | None, Parameter(name="--set", negative="")]
Workers = Annotated[int | None, Parameter(name="--workers")]


def exit_code(complete: bool, failed: list[int]) -> int:
    """130 after an interrupt, else the worst of the runs that failed."""
    return 130 if not complete else max(failed, default=0)


def check_output(output: Path | None, scene: Path, suffixes: tuple[str, ...]) -> None:
    """Refuse a report that cannot be written, or whose ending says no form."""
    if output is None:
        return
    if output.suffix not in suffixes:
        remedy = "end in " + ", ".join(suffixes)
        raise bad("the ending of the report decides its form", "--output", output.name, remedy)
    refuse_unwritable(output, scene)


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
    """JSON as a file."""
    from erls.cli.terminal import json_text

    return json_text(summary) + "\n"


def tell_written(output: Path | None) -> None:
    """Say where a report is."""
    if output is not None:
        tell(f"written to {output}")

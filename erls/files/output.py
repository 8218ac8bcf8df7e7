"""Output files, written completely or not at all: refused early, made under another name, renamed at the end."""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from erls.errors import Cause, SceneError
from fe_import.files.output import refusal


def check_writable(path: Path | str) -> Path:
    """The real place of an output file, through links; refused before any work if it cannot be written.

    Raises
    ------
    SceneError
        NOT_WRITABLE.
    """
    try:
        target = Path(os.path.realpath(path))
        problem, remedy = refusal(target) or ("", "")
    except (OSError, ValueError) as failure:
        problem, remedy = str(failure), "choose another path"
    if problem:
        raise not_writable(path, problem, remedy)
    return target


def not_writable(path: Path | str, problem: object, remedy: str) -> SceneError:
    """The error for an output that cannot be written."""
    return SceneError(Cause.NOT_WRITABLE, f"cannot be written: {problem}", where=str(path), remedy=remedy)


def temporary_name(target: Path) -> Path:
    """A name beside ``target``, with its suffix, that nobody else uses."""
    return target.with_name(f".{os.getpid()}-{secrets.token_hex(8)}{target.suffix}")


@contextlib.contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """A temporary file with the right suffix that takes the place of ``path`` when the block ends well.

    Whatever the block raises is passed on, an OSError as NOT_WRITABLE; an existing file then stays as it was.
    """
    target = check_writable(path)
    temporary = temporary_name(target)
    try:
        yield temporary
        os.replace(temporary, target)
    except OSError as problem:
        raise not_writable(path, problem, "free disk space, or choose another path") from problem
    finally:
        temporary.unlink(missing_ok=True)

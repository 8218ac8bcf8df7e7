"""Output files, written completely or not at all: refused early, made under another name, renamed at the end.

Every failure is an ``error(cause, message, where=FILE, remedy=...)``.
"""

from __future__ import annotations

import contextlib
import enum
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import TypeVar

from fe_import.errors import ReportedError

Error = TypeVar("Error", bound=ReportedError)


def check_writable(path: Path | str, error: type[ReportedError], cause: enum.StrEnum) -> Path:
    """The real place of an output file, through links; refused before any work if it cannot be written."""
    try:
        target = Path(os.path.realpath(path))
        problem, remedy = _refusal(target) or ("", "")
    except (OSError, ValueError) as failure:
        problem, remedy = getattr(failure, "strerror", None) or str(failure), "choose another path"
    if problem:
        raise not_writable(path, problem, remedy, error, cause)
    return target


def not_writable(
    path: Path | str, problem: object, remedy: str, error: type[Error], cause: enum.StrEnum
) -> Error:
    """The error for an output that cannot be written."""
    return error(cause, f"cannot be written: {problem}", where=str(path), remedy=remedy)


def temporary_name(target: Path) -> Path:
    """A name beside ``target``, with its suffix, that nobody else uses."""
    return target.with_name(f".{os.getpid()}-{secrets.token_hex(8)}{target.suffix}")


@contextlib.contextmanager
def replacing(path: Path | str, error: type[ReportedError], cause: enum.StrEnum) -> Iterator[Path]:
    """A temporary file with the right suffix that takes the place of ``path`` when the block ends well.

    Whatever the block raises is passed on, an OSError as ``error``; an existing file then stays as it was.
    """
    target = check_writable(path, error, cause)
    temporary = temporary_name(target)
    try:
        yield temporary
        os.replace(temporary, target)
    except OSError as problem:
        raise not_writable(path, problem, "free disk space, or choose another path", error, cause) from problem
    finally:
        temporary.unlink(missing_ok=True)


def _refusal(target: Path) -> tuple[str, str] | None:
    """Why a path cannot be written, and what to do; None if it can."""
    folder = target.parent
    if not folder.is_dir():
        return f"no folder {str(folder)!r}", "make the folder first"
    if target.is_dir():
        return "it is a folder", "give the name of a file"
    if target.exists() and not target.is_file():
        return "it is not a regular file", "choose another path"
    if not os.access(folder, os.W_OK | os.X_OK) or (target.exists() and not os.access(target, os.W_OK)):
        return "no permission", "choose another folder, or change its permissions"
    trial = temporary_name(target)  # whatever else a file system has against it, and too long an ending
    os.close(os.open(trial, os.O_WRONLY | os.O_CREAT | os.O_EXCL))
    trial.unlink()
    return None

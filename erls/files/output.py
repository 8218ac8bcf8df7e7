"""Output files of the commands: those of `fe_import.files.output`, whose failures are errors of a scene."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path

from erls.errors import Cause, SceneError
from fe_import.files import output
from fe_import.files.output import temporary_name

__all__ = ["check_writable", "not_writable", "replacing", "temporary_name"]


def check_writable(path: Path | str) -> Path:
    """See `fe_import.files.output.check_writable`; SceneError, NOT_WRITABLE."""
    return output.check_writable(path, SceneError, Cause.NOT_WRITABLE)


def not_writable(path: Path | str, problem: object, remedy: str) -> SceneError:
    """The error for an output that cannot be written."""
    return output.not_writable(path, problem, remedy, SceneError, Cause.NOT_WRITABLE)


def replacing(path: Path | str) -> AbstractContextManager[Path]:
    """See `fe_import.files.output.replacing`; SceneError, NOT_WRITABLE."""
    return output.replacing(path, SceneError, Cause.NOT_WRITABLE)

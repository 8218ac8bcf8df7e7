"""Failures that a user can act on: one enumeration of causes, one exception with place, value, limit, remedy."""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import Any

_LONGEST = 80


def shortened(text: str) -> str:
    """The text, or its beginning and its length when it would fill the screen."""
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 25]}... ({len(text)} characters)"


def _shown(value: Any, form: Callable[[Any], str]) -> str:
    try:
        return shortened(form(value))
    except ValueError:  # Python's limit for integers in text
        return "a number of thousands of digits"


class ReportedError(Exception):
    """A failure that is reported to the user as one message, without a traceback.

    Parameters
    ----------
    cause : enum.StrEnum
        Member of the package's enumeration of causes.
    message : str
        What is wrong, in one sentence.
    where : str
        File and field (``links/l.toml: sections.leg.width``), or time and coordinate of a failed integration.
    value, limit : object
        The offending value and what it was held against.
    remedy : str
        What would be right, or what to try.
    """

    def __init__(
        self,
        cause: enum.StrEnum,
        message: str,
        *,
        where: str = "",
        value: Any = None,
        limit: Any = None,
        remedy: str = "",
    ) -> None:
        self.cause, self.message, self.where = cause, message, where
        self.value, self.limit, self.remedy = value, limit, remedy
        super().__init__(message)

    def __reduce__(self) -> tuple[Any, ...]:
        """How another process gets it."""
        return _rebuilt, (type(self), self.cause, self.message, self.where, self.value, self.limit, self.remedy)

    @property
    def exit_code(self) -> int:
        """Exit code of the command line: 2 bad input, 3 numerical failure, 4 no convergence where asked for."""
        return 2

    def __str__(self) -> str:
        parts = [f"{self.where}: {self.message}" if self.where else self.message]
        if self.value is not None:
            limit = "" if self.limit is None else f", limit {_shown(self.limit, str)}"
            parts.append(f"got {_shown(self.value, repr)}{limit}")
        elif self.limit is not None:
            parts.append(f"limit {_shown(self.limit, str)}")
        if self.remedy:
            parts.append(self.remedy)
        return "; ".join(parts)

    def as_dict(self) -> dict[str, Any]:
        """The error object that ``--json`` prints."""
        return {
            "cause": str(self.cause),
            "message": self.message,
            "where": self.where,
            "value": None if self.value is None else _shown(self.value, str),
            "limit": None if self.limit is None else _shown(self.limit, str),
            "remedy": self.remedy,
        }


def _rebuilt(
    kind: type[ReportedError], cause: enum.StrEnum, message: str, where: str, value: Any, limit: Any, remedy: str
) -> ReportedError:
    return kind(cause, message, where=where, value=value, limit=limit, remedy=remedy)


class Cause(enum.StrEnum):
    """Why a finite-element model could not be read or reduced. A test provokes each."""

    FILE_NOT_FOUND = "file not found"
    NOT_READABLE = "file not readable"
    SYNTAX = "syntax error"
    UNKNOWN_FIELD = "unknown field"
    BAD_FIELD = "bad field"
    BAD_REFERENCE = "reference to something that does not exist"
    MESH = "faulty mesh"
    UNSUPPORTED_ELEMENT = "unsupported element type"
    NOT_USED = "content that would be lost"
    EXPORT = "faulty exported matrices"
    INTERFACE = "faulty interface"
    NOT_DEFINITE = "matrix not definite"
    GROUNDED = "stiffness resists rigid-body motion"
    DISCONNECTED = "parts not connected"
    MODE_COUNT = "mode count out of range"
    EIGENSOLVER = "eigensolver failed"
    TOO_LARGE = "too large for the memory"
    MODAL_FILE = "faulty modal file"
    NOT_WRITABLE = "file not writable"


_NUMERICAL = {Cause.TOO_LARGE, Cause.EIGENSOLVER}


class FEImportError(ReportedError):
    """A faulty link description, mesh, matrix, reduction or modal file."""

    @property
    def exit_code(self) -> int:
        """2 for bad input, 3 when a solver failed on valid input."""
        return 3 if self.cause in _NUMERICAL else 2

"""TOML files into typed records (msgspec), with errors that name file, field, value and remedy."""

from __future__ import annotations

import difflib
import enum
import re
import tomllib
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from fe_import.errors import Cause, FEImportError, ReportedError

T = TypeVar("T")

_PATH = re.compile(r" - at `(?:key in )?\$(.*)`$")
_UNKNOWN = re.compile(r"unknown field `(.*?)`")
_MAX_BYTES = 50_000_000


def read_toml(path: Path, error: type[ReportedError] = FEImportError) -> dict[str, Any]:
    """Parse a TOML file.

    Raises
    ------
    ReportedError
        Of class ``error``: file missing, not readable, too large, not UTF-8 or not TOML.
    """
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise error(
                Cause.NOT_READABLE, "file is too large for a description", where=str(path), limit="50 MB"
            )
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise error(
            Cause.FILE_NOT_FOUND,
            "no such file",
            where=str(path),
            remedy="check the path, relative paths start at the file that names them",
        ) from None
    except (OSError, UnicodeDecodeError) as problem:
        raise error(
            Cause.NOT_READABLE, f"cannot be read: {problem}", where=str(path), remedy="give a UTF-8 TOML file"
        ) from None
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as problem:
        raise error(
            Cause.SYNTAX, f"not valid TOML: {problem}", where=str(path), remedy="mend the syntax at that line"
        ) from None


def convert(data: Any, kind: type[T], where: str, error: type[ReportedError] = FEImportError) -> T:
    """Convert parsed TOML to a record; unknown keys are errors with a suggestion.

    Parameters
    ----------
    data : object
        Parsed TOML.
    kind : type
        A ``msgspec.Struct`` with ``forbid_unknown_fields``.
    where : str
        Name of the file, for messages.
    """
    try:
        return msgspec.convert(data, kind, strict=True)
    except msgspec.ValidationError as problem:
        text = str(problem)
        match = _PATH.search(text)
        path = match.group(1).lstrip(".") if match else ""
        text = _PATH.sub("", text)
        unknown = _UNKNOWN.search(text)
        if unknown:
            name = unknown.group(1)
            remedy = _suggest(kind, path, name)
            place = f"{where}: {path}.{name}".replace(": .", ": ")
            raise error(Cause.UNKNOWN_FIELD, f"unknown field {name!r}", where=place, remedy=remedy) from None
        value = _value_at(data, path)
        raise error(
            Cause.BAD_FIELD, _lower(text), where=f"{where}: {path}" if path else where, value=value, remedy=""
        ) from None
    except RecursionError:
        raise error(Cause.SYNTAX, "nested too deeply", where=where) from None


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]


def _steps(path: str) -> list[str]:
    return [s for s in re.split(r"\.|(\[[^\]]*\])", path) if s]


def _value_at(data: Any, path: str) -> Any:
    for step in _steps(path):
        try:
            data = data[int(step[1:-1])] if step.startswith("[") else data[step]
        except (KeyError, IndexError, TypeError, ValueError):
            return None
    return data if isinstance(data, (str, int, float, bool)) else None


def _suggest(kind: Any, path: str, name: str) -> str:
    """Names of the fields at ``path`` of the schema, nearest first."""
    info = msgspec.inspect.type_info(kind)
    candidates = [info]
    for step in _steps(path):
        following: list[Any] = []
        for c in candidates:
            if isinstance(c, msgspec.inspect.StructType) and not step.startswith("["):
                following += [f.type for f in c.fields if f.encode_name == step]
            elif isinstance(c, (msgspec.inspect.ListType, msgspec.inspect.VarTupleType)):
                following.append(c.item_type)
            elif isinstance(c, msgspec.inspect.DictType):
                following.append(c.value_type)
        candidates = [
            u for c in following for u in (c.types if isinstance(c, msgspec.inspect.UnionType) else [c])
        ]
    fields = [
        f.encode_name for c in candidates if isinstance(c, msgspec.inspect.StructType) for f in c.fields
    ]
    close = difflib.get_close_matches(name, fields, n=1, cutoff=0.6)
    if close:
        return f"did you mean {close[0]!r}?"
    return "known fields: " + ", ".join(sorted(set(fields))) if fields else "remove it"


def choose(value: str, options: Any, where: str, error: type[ReportedError] = FEImportError) -> None:
    """Refuse a name that is not among the options of a registry, with a suggestion."""
    names = [str(o.value) if isinstance(o, enum.Enum) else str(o) for o in options]
    if value not in names:
        close = difflib.get_close_matches(value, names, n=1)
        raise error(
            Cause.BAD_REFERENCE,
            f"unknown name {value!r}",
            where=where,
            value=value,
            remedy=(f"did you mean {close[0]!r}? " if close else "") + "known: " + ", ".join(names),
        )

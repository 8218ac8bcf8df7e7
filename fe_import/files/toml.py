"""TOML files into typed records (msgspec), with errors that name file, field, value and remedy."""

from __future__ import annotations

import difflib
import enum
import re
import stat
import tomllib
from collections.abc import Collection
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from fe_import.errors import Cause, FEImportError, ReportedError, shortened
from fe_import.files.docstrings import field_text

T = TypeVar("T")

_PATH = re.compile(r" - at `(?:key in )?\$(.*)`$")
_UNKNOWN = re.compile(r"unknown field `(.*)`$", re.DOTALL)
_MISSING = re.compile(r"missing required field `(.*?)`")
_EXPECTED = re.compile(r"Expected `([^`]*)`(?: of length (\d+))?")
_WORDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text in quotes",
    "bool": "true or false",
    "object": "a table",
    "array": "a list in brackets",
}
_MAX_BYTES = 50_000_000
_SLIP = 0.85  # likeness of a slip to a field that is there already: by less, another one may be meant
_SHOWN_NAMES = 30
_EVERY = "[...]"  # how msgspec names a key of a table of the user's names

Steps = list[str | int]


def read_toml(path: Path, error: type[ReportedError] = FEImportError) -> dict[str, Any]:
    """Parse a TOML file.

    Raises
    ------
    ReportedError
        Of class ``error``: file missing, not readable, too large, not UTF-8 or not TOML.
    """
    try:
        status = path.stat()
        if not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):  # a pipe would never end
            raise error(
                Cause.NOT_READABLE, "not a file", where=str(path), remedy="give the path of a TOML description"
            )
        if status.st_size > _MAX_BYTES:
            raise error(
                Cause.NOT_READABLE,
                "file is too large for a description",
                where=str(path),
                limit="50 MB",
                remedy="give a TOML description; meshes and matrices are files of their own",
            )
        text = path.read_text(encoding="utf-8-sig")  # editors on Windows put a mark before the first line
    except FileNotFoundError:
        raise error(
            Cause.FILE_NOT_FOUND,
            "no such file",
            where=str(path),
            remedy="check the path, relative paths start at the file that names them",
        ) from None
    except UnicodeDecodeError:
        remedy = "give a TOML description in UTF-8; modal files, meshes and matrices are none"
        raise error(Cause.NOT_READABLE, "not a text in UTF-8", where=str(path), remedy=remedy) from None
    except (OSError, ValueError) as problem:  # also a path with a NUL character
        raise error(
            Cause.NOT_READABLE, f"cannot be read: {problem}", where=str(path), remedy="give a UTF-8 TOML file"
        ) from None
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as problem:  # syntax errors, and integers of thousands of digits
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
        raise _explained(str(problem), data, kind, where, error) from None
    except RecursionError:
        raise error(Cause.SYNTAX, "nested too deeply", where=where, remedy="use fewer levels of tables") from None


def _explained(text: str, data: Any, kind: Any, where: str, error: type[ReportedError]) -> ReportedError:
    """The error that msgspec's message stands for."""
    steps = _steps(text, data, kind)
    message = _PATH.sub("", text)
    unknown, missing = _UNKNOWN.search(message), _MISSING.search(message)
    records = [c for c in _types_at(kind, data, steps) if isinstance(c, msgspec.inspect.StructType)]
    if unknown:
        name = shortened(unknown.group(1))
        place = _place(where, [*steps, name])
        there = _node_at(data, steps) or {}
        fields = [f.encode_name for c in records for f in c.fields]
        remedy = _suggest(name, fields, _further_in(name, records), [field for field in fields if field in there])
        told, more = _of_variant(name, data, steps, kind, records)
        message, remedy = f"unknown field {name!r}{told}", remedy + more
        return error(Cause.UNKNOWN_FIELD, message, where=place, remedy=remedy)
    if missing:
        name = missing.group(1)
        tags = _tags(records, name)
        remedy = f"add {name} = " + (_either(tags) if tags else _meaning(name, records))
        return error(Cause.BAD_FIELD, f"required field {name!r} is missing", where=_place(where, steps), remedy=remedy)
    value, tags = _value_at(data, steps), []
    if steps:
        tags = _tags(_types_at(kind, data, steps[:-1]), steps[-1])
    remedy = f"give {_either(tags)}" if tags else _expected(message)
    message = f"unknown {steps[-1]}" if tags else _lower(message)  # msgspec repeats the value, however long
    return error(Cause.BAD_FIELD, message, where=_place(where, steps), value=value, remedy=remedy)


def _meaning(name: str, records: list[Any]) -> str:
    """What a field is, as documentation says it."""
    known = ((c.cls, f.name) for c in records for f in c.fields if f.encode_name == name)
    text = next((found for cls, own in known if (found := field_text(cls, own))), "")
    return f"... ({text.rstrip('.')})" if text else "..."


def _of_variant(name: str, data: Any, steps: Steps, kind: Any, records: list[Any]) -> tuple[str, str]:
    """Of a table of one of several kinds: which it is, and of a field that others have, how to change the kind."""
    if not steps or len(records) != 1 or records[0].tag is None:
        return "", ""
    own = records[0]
    others = _types_at(kind, data, steps[:-1])
    every = [f.type for c in others for f in getattr(c, "fields", ()) if f.encode_name == steps[-1]]
    kinds = [t for each in every for t in _alternatives(each, None) if isinstance(t, msgspec.inspect.StructType)]
    having = [str(t.tag) for t in kinds if any(f.encode_name == name for f in t.fields)]
    tag = f"{own.tag_field} = {str(own.tag)!r}"
    more = f"; it belongs to {_either(having)}, so give the whole table, {steps[-1]} = {{ {tag} }}" if having else ""
    return f" where {tag}", more


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]


def _either(tags: list[str]) -> str:
    return " or ".join(f"'{tag}'" for tag in tags)


def _expected(message: str) -> str:
    """The type that a message of msgspec asks for, in words."""
    match = _EXPECTED.search(message)
    if not match:
        return "give a value within range"
    words = [_WORDS.get(name, name) for name in match.group(1).split(" | ") if name != "null"]
    return "give " + " or ".join(words) + (f" of {match.group(2)} values" if match.group(2) else "")


def _place(where: str, steps: Steps) -> str:
    path = "".join(f"[{s}]" if isinstance(s, int) else f".{shortened(s)}" for s in steps).lstrip(".")
    return f"{where}: {path}" if path else where


def _steps(text: str, data: Any, kind: Any) -> Steps:
    """Keys and indices from the root of ``data`` to the fault.

    msgspec does not say which key of a table of the user's names is meant: the one that alone gives the same message.
    """
    match = _PATH.search(text)
    steps: Steps = []
    for step in re.findall(r"\[[^\]]*\]|[^.\[]+", match.group(1)) if match else ():
        if step == _EVERY:
            table = _node_at(data, steps)
            steps.append(next((k for k in table if _message(_only(data, steps, k), kind) == text), _EVERY))
        else:
            steps.append(int(step[1:-1]) if step.startswith("[") else step)
    return steps


def _message(data: Any, kind: Any) -> str:
    try:
        msgspec.convert(data, kind, strict=True)
    except msgspec.ValidationError as problem:
        return str(problem)
    return ""


def _only(data: Any, steps: Steps, key: str) -> Any:
    """A copy of ``data`` in which the table at ``steps`` has one key only."""
    if not steps:
        return {key: data[key]}
    copy = data.copy()
    copy[steps[0]] = _only(data[steps[0]], steps[1:], key)
    return copy


def _node_at(data: Any, steps: Steps) -> Any:
    for step in steps:
        try:
            data = data[step]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _value_at(data: Any, steps: Steps) -> Any:
    """The faulty value when it is short enough to show: not a table."""
    value = _node_at(data, steps)
    return value if steps and isinstance(value, (str, int, float, bool, list)) else None


def _types_at(kind: Any, data: Any, steps: Steps) -> list[Any]:
    """Types that the schema allows at ``steps``; of tagged records the one that the data's tag names."""
    types = _alternatives(msgspec.inspect.type_info(kind), data)
    for depth, step in enumerate(steps, start=1):
        node = _node_at(data, steps[:depth])
        following: list[Any] = []
        for t in types:
            if isinstance(t, msgspec.inspect.StructType):
                following += [f.type for f in t.fields if f.encode_name == step]
            elif isinstance(t, (msgspec.inspect.ListType, msgspec.inspect.VarTupleType)):
                following.append(t.item_type)
            elif isinstance(t, msgspec.inspect.DictType):
                following.append(t.value_type)
        types = [a for t in following for a in _alternatives(t, node)]
    return types


def _alternatives(kind: Any, node: Any) -> list[Any]:
    types: list[Any] = list(kind.types) if isinstance(kind, msgspec.inspect.UnionType) else [kind]
    if isinstance(node, dict):
        tagged = [t for t in types if getattr(t, "tag", None) is not None and node.get(t.tag_field) == t.tag]
        return tagged or types
    return types


def _tags(types: list[Any], field: str | int) -> list[str]:
    """Tags of the records that ``field`` tells apart."""
    return [str(t.tag) for t in types if getattr(t, "tag", None) is not None and t.tag_field == field]


def _further_in(name: str, records: list[Any]) -> list[str]:
    """Tables in these records that have a field of this name, as ``table.name``."""
    found = []
    for table in (f for record in records for f in record.fields):
        kinds = [t for t in _alternatives(table.type, None) if isinstance(t, msgspec.inspect.StructType)]
        if any(f.encode_name == name for t in kinds for f in t.fields):
            found.append(f"{table.encode_name}.{name}")
    return list(dict.fromkeys(found))


def _suggest(name: str, fields: list[str], further_in: list[str], there: list[str]) -> str:
    """The field that was probably meant, or all there are; where that one is ``there``, the others too."""
    if further_in:
        return "did you mean " + " or ".join(repr(field) for field in further_in) + "?"
    close = difflib.get_close_matches(name[:200], fields, n=1, cutoff=0.6)
    if close and close[0] in there and not difflib.get_close_matches(name[:200], close, cutoff=_SLIP):
        others = ", ".join(sorted(set(fields) - set(there)))
        return f"did you mean {close[0]!r}? It is there already" + (f"; other fields: {others}" if others else "")
    if close:
        return f"did you mean {close[0]!r}?"
    return "known fields: " + ", ".join(sorted(set(fields))) if fields else "remove it"


def place_of(
    data: dict[str, Any], key: str, where: str, error: type[ReportedError] = FEImportError
) -> tuple[Any, Any]:
    """The table or list that holds what a dotted key names, and its key or number there; tables on the way are made.

    Parameters
    ----------
    data : dict
        Parsed TOML.
    key : str
        Members of lists go by name or number.
    where : str
        For messages.

    Raises
    ------
    ReportedError
        Of class ``error``: no such place.
    """
    steps = key.split(".")
    at: Any = data
    for step, following in zip(steps, [*steps[1:], None], strict=True):
        if isinstance(at, list):
            names = [str(k) for k in range(len(at))]
            names += [str(item["name"]) for item in at if isinstance(item, dict) and "name" in item]
            named = [k for k, item in enumerate(at) if isinstance(item, dict) and item.get("name") == step]
            place: Any = named[0] if named else int(step) if step in names[: len(at)] else None
            if place is None:
                known = ", ".join(names) or "none"
                raise error(
                    Cause.BAD_REFERENCE,
                    f"no member {step!r}",
                    where=where,
                    value=step,
                    remedy=f"known: {known}",
                )
        elif isinstance(at, dict):
            place = step
            if following is not None:
                at.setdefault(step, {})
        else:
            raise error(Cause.BAD_FIELD, f"{step!r} is not inside a table", where=where, remedy="check the key")
        if following is None:
            return at, place
        at = at[place]
    raise AssertionError("a key has steps")


def as_spelt(value: str, names: Collection[str]) -> str:
    """A name of a set as its file spells it: the only one that differs in case alone; else the value as it is."""
    if value in names:
        return value
    alike = [name for name in names if name.casefold() == value.casefold()]
    return alike[0] if len(alike) == 1 else value


def choose(value: str, options: Any, where: str, error: type[ReportedError] = FEImportError) -> None:
    """Refuse a name that is not among the options of a registry, with a suggestion."""
    if isinstance(options, (dict, list, tuple)) and value in options:
        return
    names = [str(o.value) if isinstance(o, enum.Enum) else str(o) for o in options]
    if value not in names:
        more = len(names) - _SHOWN_NAMES
        known = ", ".join(names[:_SHOWN_NAMES]) + (f" and {more} more" if more > 0 else "")
        close = difflib.get_close_matches(value[:200], names, n=1)
        raise error(
            Cause.BAD_REFERENCE,
            f"unknown name {shortened(value)!r}" if value else "a name is missing",
            where=where,
            value=value or None,
            remedy=(f"did you mean {close[0]!r}? " if close else "")
            + (f"known: {known}" if names else "none is defined"),
        )

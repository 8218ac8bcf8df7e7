"""JSON schemas of scenes and link descriptions, for editors that complete and check TOML.

Names, types and defaults are those of the records that read the files, descriptions and options those of the
documentation (`erls.report.fields`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec
from msgspec import inspect

from erls.report.fields import OPTIONS, PAGES, Record, documentation

DIALECT = "https://json-schema.org/draft/2020-12/schema"
KINDS = {"scene": "scene", "link": "link description", "bodies": "scene of bodies", "problem": "problem"}
"""What ``erls schema`` calls a kind of file, and what the documentation does."""


def json_schema(kind: str) -> dict[str, Any]:
    """The schema of a kind of file.

    Parameters
    ----------
    kind : str
        A name from `KINDS`.

    Returns
    -------
    dict
        JSON Schema, draft 2020-12.
    """
    root = PAGES[KINDS[kind]][1]
    made = msgspec.json.schema(root)
    tables = made["$defs"]
    for record in _records(inspect.type_info(root)):
        whole = f"{record.__module__}.{record.__qualname__}"  # of records that share a name
        _describe(tables[record.__name__ if record.__name__ in tables else whole], record)
    return {"$schema": DIALECT, "title": KINDS[kind], **made}


def _records(kind: Any, seen: set[Any] | None = None) -> Iterator[Record]:
    """All records within a type."""
    seen = set() if seen is None else seen
    if isinstance(kind, inspect.StructType):
        if kind.cls in seen:
            return
        seen.add(kind.cls)
        yield kind.cls
        inner: list[Any] = [field.type for field in kind.fields]
    else:
        inner = [getattr(kind, name) for name in ("item_type", "key_type", "value_type") if hasattr(kind, name)]
        inner += [*getattr(kind, "types", ()), *(t for t in getattr(kind, "item_types", ()))]
    for each in inner:
        yield from _records(each, seen)


def _describe(table: dict[str, Any], record: Record) -> None:
    """Put the words of the documentation in place of a docstring, and the names that a field takes."""
    told, entries = documentation(record)
    table["description"] = _plain(told)
    texts = {name: text for names, text in entries for name in names}
    for field in msgspec.structs.fields(record):
        stated = table["properties"][field.encode_name]
        stated["description"] = _plain(texts[field.name])
        if (record, field.name) in OPTIONS:
            names = list(OPTIONS[record, field.name])
            own = stated.get("default")
            stated["enum"] = names + ([own] if "default" in stated and own not in names else [])


def _plain(text: str) -> str:
    return " ".join(text.replace("`", "").split())

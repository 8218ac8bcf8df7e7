"""What the docstrings of records say of their fields, for documentation, schemas and messages."""

from __future__ import annotations

import inspect
import re

import msgspec

_ENTRY = re.compile(r"^(\w+(?:, \w+)*) : ")


def record_texts(record: type[msgspec.Struct]) -> tuple[str, list[tuple[list[str], str]]]:
    """What the docstring of a record says of itself, and of its fields (``Attributes``); bases included, backquotes
    single.
    """
    told, entries = "", list[tuple[list[str], str]]()
    for base in reversed(record.__mro__):
        if base is msgspec.Struct or not issubclass(base, msgspec.Struct):
            continue
        text, _, listed = inspect.cleandoc(base.__doc__ or "").replace("``", "`").partition("Attributes\n----------\n")
        told = text.strip()
        for line in listed.splitlines():
            entry = _ENTRY.match(line)
            if entry:
                entries.append((entry[1].split(", "), ""))
            elif line.strip() and entries:
                names, before = entries.pop()
                entries.append((names, f"{before} {line.strip()}".strip()))
    return told, entries


def field_text(record: type[msgspec.Struct], name: str) -> str:
    """What is said of one field; empty where nothing is."""
    return next((text for names, text in record_texts(record)[1] if name in names), "")

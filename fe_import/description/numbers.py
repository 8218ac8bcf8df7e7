"""Numbers of descriptions by dotted keys."""

from __future__ import annotations

import math
from typing import Any

import msgspec

from fe_import.errors import Cause
from fe_import.files.toml import place_of


def number_in(data: dict[str, Any], key: str, where: str, error: type[Any]) -> float:
    """The number in tables that a dotted key names.

    Raises
    ------
    ReportedError
        Of class ``error``: there is none.
    """
    if not all(key.split(".")):
        raise error(Cause.BAD_FIELD, "not a dotted key", where=where, value=key, remedy="e.g. sections.bar.width")
    table, place = place_of(data, key, where, error)
    value = table[place] if isinstance(table, list) else table.get(place)
    if value is None:
        message, remedy = "this field is not given, or there is none of that name", "give it a value in the file"
        raise error(Cause.BAD_REFERENCE, message, where=where, value=place, remedy=remedy)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        message, remedy = "not a number", "name a field that holds a number; members of lists go by number"
        raise error(Cause.BAD_FIELD, message, where=where, value=value, remedy=remedy)
    return float(value)


def tables_of(record: msgspec.Struct) -> dict[str, Any]:
    """A record as parsed TOML would be: tables and lists whose members can be set."""

    def opened(value: Any) -> Any:
        if isinstance(value, (list, tuple)):
            return [opened(member) for member in value]
        return {key: opened(member) for key, member in value.items()} if isinstance(value, dict) else value

    found: dict[str, Any] = opened(msgspec.to_builtins(record))
    return found

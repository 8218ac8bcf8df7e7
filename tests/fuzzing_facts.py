"""Facts of records and arrays, and whether a record holds all that its TOML file states."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
from fuzzing import Facts


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every value of nested tables, records and arrays with its place."""
    if hasattr(value, "__dataclass_fields__"):
        value = {name: getattr(value, name) for name in value.__dataclass_fields__}
    elif isinstance(value, msgspec.Struct):
        value = msgspec.to_builtins(value)
    if isinstance(value, dict):
        for key, item in value.items():
            yield from leaves(item, (*path, key))
    elif isinstance(value, (list, tuple)):
        yield (*path, "length", len(value))
        for k, item in enumerate(value):
            yield from leaves(item, (*path, k))
    elif isinstance(value, np.ndarray):
        yield (*path, value.shape, value.dtype.str, value.tobytes())
    else:
        yield (*path, value)


def content(value: Any) -> Facts:
    """Facts of records."""
    return frozenset(leaves(value))


def taken(text: bytes, record: Any) -> bool:
    """Whether every value of a TOML file is in the record as it stands."""

    def flat(value: Any, path: tuple[Any, ...] = ()) -> dict[tuple[Any, ...], Any]:
        if isinstance(value, dict):
            items: Any = value.items()
        elif isinstance(value, (list, tuple)):
            items = enumerate(value)
        else:
            return {path: value}
        return {k: v for key, item in items for k, v in flat(item, (*path, key)).items()}

    held = flat(msgspec.to_builtins(record))
    stated = flat(tomllib.loads(text.decode()))
    return all(held.get(path) == (float(value) if type(value) is int else value) for path, value in stated.items())

"""Link descriptions: reading a file, and what its reduction depends on. The tables are in `records`."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from fe_import.description.check import check_link
from fe_import.description.numbers import tables_of
from fe_import.description.records import LinkDescription
from fe_import.description.reduction import Reduction
from fe_import.files.includes import with_included
from fe_import.files.toml import convert, place_of, read_toml

_METHOD = Reduction().method


@dataclass(frozen=True)
class LinkFile:
    """A link description with the file that it came from; relative paths start at ``folder``.

    ``content`` is what it depends on besides, of a link that was made in Python.
    """

    path: Path
    description: LinkDescription
    content: bytes = b""

    @property
    def folder(self) -> Path:
        """Folder of the file."""
        return self.path.parent

    def content_hash(self) -> str:
        """SHA-256 of everything that the reduction depends on: the description and the files it names."""
        digest = hashlib.sha256(msgspec.json.encode(self.description, order="deterministic") + self.content)
        for name in self.description.files():
            with contextlib.suppress(OSError, ValueError):  # reported with its name when it is read
                for file in with_included(self.folder / name):
                    digest.update(file.read_bytes())
        return digest.hexdigest()


def leaves(tables: dict[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Values in nested tables, by dotted keys."""
    for name, value in tables.items():
        if isinstance(value, dict) and value:
            yield from leaves(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", value


def load_link(
    path: Path | str,
    overrides: dict[str, Any] | None = None,
    expands: bool = False,
    changes: dict[str, Any] | None = None,
) -> LinkFile:
    """Read and check a link description.

    Parameters
    ----------
    path : Path or str
    overrides : dict, optional
        Fields of the ``reduction`` table that replace those of the file (``method``, ``elastic_modes`` ...).
    expands : bool
        Prepare its reduction for a temperature change, also where the file gives none.
    changes : dict, optional
        Tables with values that replace those of the file; members of lists go by name or number.

    Raises
    ------
    FEImportError
        Naming file, field, value and remedy.
    """
    path = Path(path)
    data = read_toml(path)
    for key, value in leaves(changes or {}):
        table, place = place_of(data, key, f"{path}: changes.{key}")
        table[place] = value
    if overrides:
        table = data.setdefault("reduction", {})
        if isinstance(table, dict):
            if overrides.get("method", table.get("method", _METHOD)) != table.get("method", _METHOD):
                for field in set(table) - {"form"}:  # they belong to the file's method
                    del table[field]
            table.update(overrides)
    if expands:
        data.setdefault("temperature_change", 0.0)
    description = convert(data, LinkDescription, str(path))
    if not description.name:
        description = msgspec.structs.replace(description, name=path.name.removesuffix(".toml"))
    check_link(description, str(path))
    return LinkFile(path, description)


def with_numbers(link: LinkFile, values: Mapping[str, float]) -> LinkFile:
    """The description with other values of numbers, by dotted keys.

    Raises
    ------
    FEImportError
        They are refused.
    """
    data = tables_of(link.description)
    for key, value in values.items():
        table, place = place_of(data, key, f"{link.path}: {key}")
        table[place] = value
    description = convert(data, LinkDescription, str(link.path))
    check_link(description, str(link.path))
    return replace(link, description=description)

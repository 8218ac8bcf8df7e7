"""Changes of a scene on the command line: KEY=VALUE applied to parsed TOML."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from erls.errors import Cause, SceneError
from fe_import.files.toml import place_of

_SHORT = {"effects": "simulation.effects"}
_DESCRIBED = re.compile(r"(links\.[^.]+)\.model\.(?=.)")


def in_scene(key: str) -> str:
    """Where a scene holds what a key says: behind ``links.NAME.model`` keys go on in that link description, whose
    ``changes`` the scene holds.
    """
    return _DESCRIBED.sub(r"\1.changes.", key, count=1)


def apply_override(data: dict[str, Any], text: str) -> None:
    """Set one KEY=VALUE in parsed TOML, as `load_scene` does.

    Raises
    ------
    SceneError
        No such place, or not of this form.
    """
    key, equals, value = text.partition("=")
    where = f"--set {text}"
    if not equals or not all(key.strip().split(".")):
        raise SceneError(Cause.BAD_FIELD, "not of the form KEY=VALUE", where=where, remedy="e.g. simulation.step=1e-4")
    set_field(data, key, value_of(value), where)


def set_field(data: dict[str, Any], key: str, value: Any, where: str) -> None:
    """Set a value, as TOML has it, in parsed TOML; ``where`` stands in messages.

    Raises
    ------
    SceneError
        No such place.
    """
    at, place = place_of(data, in_scene(_SHORT.get(key.strip(), key.strip())), where, SceneError)
    at[place] = value


def value_of(text: str) -> Any:
    """What a value on the command line says, as TOML has it; a bare word is a string."""
    try:
        found = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text.strip()
    return found["value"] if len(found) == 1 else text.strip()

"""Changes of a scene on the command line: KEY=VALUE applied to parsed TOML."""

from __future__ import annotations

import tomllib
from typing import Any

from erls.errors import Cause, SceneError

_SHORT = {"effects": "simulation.effects"}


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
    try:
        found = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        found = {}
    at, place = place_of(data, key, where)
    at[place] = found["value"] if len(found) == 1 else value.strip()  # a bare word is a string


def place_of(data: dict[str, Any], key: str, where: str) -> tuple[Any, Any]:
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
    SceneError
        No such place.
    """
    steps = _SHORT.get(key.strip(), key.strip()).split(".")
    at: Any = data
    for step, following in zip(steps, [*steps[1:], None], strict=True):
        if isinstance(at, list):
            names = [str(k) for k in range(len(at))]
            names += [str(item["name"]) for item in at if isinstance(item, dict) and "name" in item]
            named = [k for k, item in enumerate(at) if isinstance(item, dict) and item.get("name") == step]
            place: Any = named[0] if named else int(step) if step in names[: len(at)] else None
            if place is None:
                known = ", ".join(names) or "none"
                raise SceneError(
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
            raise SceneError(Cause.BAD_FIELD, f"{step!r} is not inside a table", where=where, remedy="check the key")
        if following is None:
            return at, place
        at = at[place]
    raise AssertionError("a key has steps")

"""Which numbers of a scene are fitted: keys, and patterns of keys."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Any

from erls.errors import Cause, SceneError
from erls.scene.chain import Scene
from fe_import.description.numbers import tables_of


def fitted_keys(scene: Scene, asked: Sequence[str]) -> list[str]:
    """Keys, with patterns in their place.

    Parameters
    ----------
    scene : Scene
    asked : sequence of str
        As ``--set`` takes them; ``*`` stands for any part of a field of the scene: ``joints.*.damping``.

    Raises
    ------
    SceneError
        BAD_REFERENCE: nothing fits a pattern; BAD_FIELD: no keys, or one twice.
    """
    known = [key for key, value in _numbers(tables_of(scene.record), "") if value]
    found: list[str] = []
    for key in (part.strip() for text in asked for part in text.split(",")):
        fits = [name for name in known if fnmatchcase(name, key)] if "*" in key else [key]
        if not fits:
            message, remedy = "no number of the scene that is not zero", "name one, or --set where its fit begins"
            raise SceneError(Cause.BAD_REFERENCE, message, where="--fit", value=key, remedy=remedy)
        found += fits
    if not found or not all(found) or len(set(found)) < len(found):
        message = "each number is fitted once" if asked else "there is nothing to fit"
        remedy = "e.g. --fit joints.elbow.damping"
        raise SceneError(Cause.BAD_FIELD, message, where="--fit", value=", ".join(asked), remedy=remedy)
    return found


def _numbers(value: Any, key: str) -> Iterator[tuple[str, float]]:
    """Keys of all numbers; members of lists by their names."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _numbers(inner, f"{key}.{name}" if key else str(name))
    elif isinstance(value, (list, tuple)):
        for k, inner in enumerate(value):
            name = inner.get("name") if isinstance(inner, dict) else None
            yield from _numbers(inner, f"{key}.{name or k}")
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield key, float(value)

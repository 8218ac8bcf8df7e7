"""What a run can be differentiated by: numbers of its scene, and of the descriptions of its links.

A parameter is a dotted key as ``--set`` takes it. Behind ``links.NAME.model`` it goes on in the description of that
link: ``links.arm.model.sections.bar.width``. Its unit is that of the field.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import msgspec

from erls.errors import Cause, SceneError
from erls.scene.build import link_description
from erls.scene.chain import Scene
from erls.scene.overrides import place_of
from erls.scene.read import checked
from fe_import.description.check import check_link
from fe_import.description.link import LinkFile
from fe_import.description.records import LinkDescription
from fe_import.files.toml import convert

_NOT_SMOOTH = {
    "simulation": "it says how a motion is computed, not what moves",
    "points": "its nearest mesh node changes by jumps",
    "events": "it says what is told of a motion, not what moves",
    "name": "it is a name",
}
_NOT_SMOOTH_IN_LINKS = {"reduction": "it chooses modes, which change by jumps"}
_DESCRIBED = "model"


@dataclass(frozen=True)
class Parameter:
    """A number that a run depends on.

    Attributes
    ----------
    key : str
        Dotted, as ``--set`` takes it.
    value : float
        In the unit of the field.
    size : float
        A change of about this size is large: steps of differences are small shares of it.
    link : int or None
        The link of the scene whose modal model depends on it.
    within : str
        Key within the description of that link; empty where it is a field of the scene.
    """

    key: str
    value: float
    size: float
    link: int | None = None
    within: str = ""


def parameters_of(scene: Scene, given: Sequence[str] | Mapping[str, float]) -> list[Parameter]:
    """Look parameters up.

    Parameters
    ----------
    scene : Scene
    given : sequence of str, or mapping of str to float
        Keys; with sizes of changes that are large, for those whose value does not tell (zero).

    Raises
    ------
    SceneError, FEImportError
        No such field, one that is no number or is not given, or one on which motions do not depend smoothly.
    """
    if isinstance(given, str) or not len(given):
        message, remedy = "parameters come as a list of keys", 'e.g. ["payloads.0.mass"]'
        raise SceneError(Cause.BAD_FIELD, message, where="parameters", value=given, remedy=remedy)
    sizes = dict(given) if isinstance(given, Mapping) else dict.fromkeys(given, None)
    return [_parameter(scene, key, size) for key, size in sizes.items()]


def scene_with(scene: Scene, parameter: Parameter, value: float) -> Scene:
    """The scene with another value of a field of its own.

    Raises
    ------
    SceneError
        The value is refused.
    """
    data = _tables(scene.record)
    table, place = place_of(data, parameter.key, f"parameter {parameter.key}")
    table[place] = value
    found = checked(data, scene.path, str(scene.path))
    assert isinstance(found, Scene)
    return found


def description_with(scene: Scene, parameter: Parameter, value: float) -> LinkFile:
    """The description of its link with another value.

    Raises
    ------
    FEImportError
        The value is refused.
    """
    assert parameter.link is not None
    given = link_description(scene, scene.record.links[parameter.link])
    data = _tables(given.description)
    table, place = place_of(data, parameter.within, f"parameter {parameter.key}")
    table[place] = value
    description = convert(data, LinkDescription, str(given.path))
    check_link(description, str(given.path))
    return replace(given, description=description)


def _parameter(scene: Scene, key: str, size: float | None) -> Parameter:
    steps, where = key.split("."), f"parameter {key}"
    data = _tables(scene.record)
    if not all(steps):
        raise SceneError(Cause.BAD_FIELD, "not a dotted key", where=where, value=key, remedy="e.g. payloads.0.mass")
    _refuse(steps[0], _NOT_SMOOTH, where)
    link, within, table, place = None, "", data, ""
    if steps[0] == "links" and len(steps) > 2:
        links, link = place_of(data, ".".join(steps[:2]), where)
        _refuse(steps[2], _NOT_SMOOTH_IN_LINKS, where)
        if steps[2] == _DESCRIBED and len(steps) > 3:
            if not links[link]["model"]:
                message, remedy = "this link has no description", "links with a model have one"
                raise SceneError(Cause.BAD_REFERENCE, message, where=where, value=steps[1], remedy=remedy)
            _refuse(steps[3], _NOT_SMOOTH_IN_LINKS, where)
            within = ".".join(steps[3:])
            data = _tables(link_description(scene, scene.record.links[link]).description)
    table, place = place_of(data, within or key, where)
    value = table[place] if isinstance(table, list) else table.get(place)
    if value is None:
        message, remedy = "this field is not given, or there is none of that name", "give it a value in the file"
        raise SceneError(Cause.BAD_REFERENCE, message, where=where, value=place, remedy=remedy)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        message, remedy = "not a number", "name a field that holds a number; members of lists go by number"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=value, remedy=remedy)
    large = abs(float(value)) or 1.0 if size is None else float(size)
    if not (math.isfinite(large) and large > 0):
        message, remedy = "the size of a change must be positive", "give about the change that would be large"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=size, remedy=remedy)
    return Parameter(key, float(value), large, link, within)


def _tables(record: msgspec.Struct) -> dict[str, Any]:
    """A record as parsed TOML would be: tables and lists whose members can be set."""

    def opened(value: Any) -> Any:
        if isinstance(value, (list, tuple)):
            return [opened(member) for member in value]
        return {key: opened(member) for key, member in value.items()} if isinstance(value, dict) else value

    found: dict[str, Any] = opened(msgspec.to_builtins(record))
    return found


def _refuse(step: str, kinds: dict[str, str], where: str) -> None:
    if step in kinds:
        message = f"nothing can be differentiated by a field of {step}: {kinds[step]}"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=step, remedy="name another field")

"""What a run can be differentiated by: numbers of its scene, and of the descriptions of its links.

A parameter is a dotted key as ``--set`` takes it. Behind ``links.NAME.model`` it goes on in the description of that
link: ``links.arm.model.sections.bar.width``. Its unit is that of the field.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from erls.errors import Cause, SceneError
from erls.scene.build import link_description
from erls.scene.chain import Scene
from erls.scene.read import checked
from fe_import.derivatives import number_at
from fe_import.description.link import LinkFile, with_numbers
from fe_import.description.numbers import number_in, tables_of
from fe_import.files.toml import place_of

_NOT_SMOOTH = {
    "simulation": "it says how a motion is computed, not what moves",
    "points": "its nearest mesh node changes by jumps",
    "events": "it says what is told of a motion, not what moves",
    "name": "it is a name",
}
_DESCRIBED = "model"
_OF_SECTIONS = ("sections", "materials", "masses", "damping", "temperature_change")


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


def leaves_nodes(within: str) -> bool:
    """Whether a number of a description, by its key there, changes nothing of where nodes and interfaces are."""
    return within.split(".")[0] in _OF_SECTIONS


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
    if isinstance(given, str) or not len(given) or not all(isinstance(key, str) for key in given):
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
    data = tables_of(scene.record)
    table, place = place_of(data, parameter.key, f"parameter {parameter.key}", SceneError)
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
    return with_numbers(link_description(scene, scene.record.links[parameter.link]), {parameter.within: value})


def _parameter(scene: Scene, key: str, size: float | None) -> Parameter:
    steps, where = key.split("."), f"parameter {key}"
    data = tables_of(scene.record)
    if steps[0] in _NOT_SMOOTH:
        message = f"nothing can be differentiated by a field of {steps[0]}: {_NOT_SMOOTH[steps[0]]}"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=steps[0], remedy="name another field")
    link: int | None = None
    within = ""
    if steps[0] == "links" and len(steps) > 2 and all(steps):
        links, link = place_of(data, ".".join(steps[:2]), where, SceneError)
        if steps[2] == _DESCRIBED and len(steps) > 3:
            if not links[link]["model"]:
                message, remedy = "this link has no description", "links with a model have one"
                raise SceneError(Cause.BAD_REFERENCE, message, where=where, value=steps[1], remedy=remedy)
            within = ".".join(steps[3:])
    if within and link is not None:
        value = number_at(link_description(scene, scene.record.links[link]), within)
    else:
        value = number_in(data, key, where, SceneError)
    large = abs(value) or 1.0 if size is None else size
    if isinstance(large, bool) or not isinstance(large, (int, float)) or not (math.isfinite(large) and large > 0):
        message, remedy = "the size of a change must be positive", "give about the change that would be large"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=size, remedy=remedy)
    return Parameter(key, value, float(large), link, within)

"""Conditions that scenes of every kind share: names, numbers, directions, settings of motions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import msgspec

from erls.errors import Cause, SceneError
from erls.mechanism.joint_types import JOINT_TYPES, OWN_FIELDS
from erls.mechanism.place import LARGEST, LATEST
from erls.scene.records import Record, SceneTables, Stepping
from fe_import.files.toml import choose

MOST_STEPS = 100_000_000  # fill any memory; more are a slip
SHORTEST = 1e-9  # s, a thousand times what separates two breakpoints


def bad(where: str, message: str, value: Any, remedy: str) -> SceneError:
    """A BAD_FIELD error."""
    return SceneError(Cause.BAD_FIELD, message, where=where, value=value, remedy=remedy)


def check_tables(scene: SceneTables, file: str) -> None:
    """Every number is finite and plausible, and the scene's name a line."""
    tables = msgspec.to_builtins(scene)
    if not _plausible(tables):
        path, value = next((path, value) for path, value in _every_number(tables) if not _plausible(value))
        remedy = f"give a number between {-LARGEST:g} and {LARGEST:g}"
        raise bad(f"{file}: {path}", "not a finite number of plausible size", value, remedy)
    if not scene.name.isprintable():
        raise bad(f"{file}: name", "a name is one line of printable characters", scene.name, "rename it")


def _plausible(value: Any) -> bool:
    """Of all numbers of nested tables and lists: their places, which take longer, are looked for where one is not."""
    if isinstance(value, dict):
        return all(map(_plausible, value.values()))
    if isinstance(value, (list, tuple)):
        return all(map(_plausible, value))
    return not isinstance(value, (int, float)) or abs(value) <= LARGEST


def _every_number(value: Any, path: str = "") -> Iterable[tuple[str, float]]:
    """All numbers of nested tables and lists with their places."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _every_number(item, f"{path}.{key}" if path else key)
    elif isinstance(value, (list, tuple)):
        for k, item in enumerate(value):
            yield from _every_number(item, f"{path}[{k}]")
    elif isinstance(value, (int, float)):
        yield path, value


def check_names(places: Iterable[tuple[str, str]]) -> None:
    """Names, each behind its place, differ and can stand in tables and, as keys, in files."""
    seen: set[str] = set()
    for place, name in places:
        if not name or name == "." or "/" in name or not name.isprintable():
            message = "a name is one line of printable characters without '/'"
            raise bad(place, message, name, "rename it")
        if name in seen:
            raise bad(place, "names must differ", name, "rename one")
        seen.add(name)


def check_ends(end: Any, links: list[str], place: str, what: str) -> None:
    """Of what connects a link with another one or with the ground.

    Parameters
    ----------
    end : Loop or Bushing
    links : list of str
        Names of those that there are.
    place : str
        ``FILE: loops[0]``
    what : str
        Subject and verb of the message, "a loop closes between".

    Raises
    ------
    SceneError
        BAD_FIELD, BAD_REFERENCE: naming file, field, value and remedy.
    """
    choose(end.link, links, f"{place}.link", SceneError)
    if end.to_link:
        choose(end.to_link, links, f"{place}.to_link", SceneError)
    if end.to_link == end.link:
        message = f"{what} two links, or a link and the ground"
        raise bad(f"{place}.to_link", message, end.to_link, "name another link, or leave it out for the ground")
    if bool(end.to_link) != bool(end.to_node):
        remedy = "give both 'to_link' and 'to_node', or neither for the ground"
        raise bad(f"{place}.to_node", "a link and a node belong together", end.to_node, remedy)
    if end.to_link and end.position is not None:
        message = "between two links the nodes say where it is"
        raise bad(f"{place}.position", message, end.position, "remove it")


def refuse_settings(settings: Any, file: str, what: str, fields: Sequence[str]) -> None:
    """Refuse those of some settings that do not go with what ties the joint coordinates of a tree.

    Parameters
    ----------
    settings : Simulation
    file : str
    what : str
        "[[couplings]]"
    fields : sequence of str
        Of ``gauge``, ``coordinates`` and ``formulation``.

    Raises
    ------
    SceneError
        BAD_FIELD
    """
    dense = settings.formulation == "erls" and settings.gauge != "joint-angle"
    found = {
        "gauge": (dense, "use gauge = 'joint-angle'"),
        "coordinates": (settings.coordinates != "independent", "use coordinates = 'independent'"),
        "formulation": (settings.formulation == "nodal", "use formulation = 'erls' or 'ffr'"),
    }
    for field in fields:
        refused, remedy = found[field]
        if refused:
            raise bad(f"{file}: simulation.{field}", f"does not go with {what}", getattr(settings, field), remedy)


def check_joint_fields(joint: Record, kind: str, place: str) -> None:
    """A joint has those fields that only some kinds have, if its own does."""
    for field, meaning in OWN_FIELDS.items():
        value, wanted = getattr(joint, field), field in JOINT_TYPES[kind].fields
        if value and not wanted:
            raise bad(f"{place}.{field}", f"a {kind} joint has none", value, "remove it")
        if wanted and not value:
            raise bad(f"{place}.{field}", f"a {kind} joint needs it", value, f"give {meaning}")


def check_stepping(s: Stepping, place: str) -> None:
    """Duration, step and numerical damping of a motion."""
    for name in ("duration", "step"):
        positive(f"{place}.{name}", getattr(s, name))
    if s.duration < SHORTEST:
        raise bad(f"{place}.duration", "shorter than any run", s.duration, f"give at least {SHORTEST:g} s")
    if s.duration > LATEST:
        raise bad(f"{place}.duration", "longer than any run", s.duration, f"give at most {LATEST:g} s")
    if s.duration / MOST_STEPS > (s.step or 1e-3):
        name = "duration" if s.step is None else "step"
        remedy = f"a run has at most {MOST_STEPS:.0e} steps: shorten it, or give a larger step"
        raise bad(f"{place}.{name}", "too many steps", getattr(s, name), remedy)
    if not 0 <= s.spectral_radius <= 1:
        raise bad(f"{place}.spectral_radius", "out of range", s.spectral_radius, "give 0 to 1")


def positive(where: str, value: float | None) -> None:
    """A number above 0, if there is one."""
    if value is not None and not value > 0:
        raise bad(where, f"{where.rpartition('.')[2]} must be positive", value, "give a number above 0")


def not_negative(where: str, value: float, message: str = "must not be negative") -> None:
    """A number of 0 or more."""
    if value < 0:
        raise bad(where, message, value, "give 0 or more")


def check_wrench(where: str, force: Sequence[float], moment: Sequence[float]) -> None:
    """A load has a force or a moment."""
    if not any(force) and not any(moment):
        raise bad(where, "neither a force nor a moment", None, "give one, or remove the load")


def directed(where: str, axis: Sequence[float] | None) -> None:
    """An axis, if there is one, has a direction."""
    if axis is not None and not any(axis):
        raise bad(where, "an axis needs a direction", axis, "give three numbers, not all zero")

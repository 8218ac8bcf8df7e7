"""Sets of effects that a study tries: how they are written in one word, and which of them are the same."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

from erls.errors import Cause, SceneError
from erls.mechanism.effects import ALL, EFFECTS, LINEAR, SECOND_KINEMATICS, in_order, named_effects

NOTHING = "none"


def parse_sets(values: Iterable[str], where: str = "effects") -> tuple[str, ...]:
    """Sets as labels, each once.

    Parameters
    ----------
    values : iterable of str
        Each holds one set, or several separated by commas. A set is ``all``, ``linear``, ``auto``, or names joined by
        ``+``, those to leave out by ``-``: ``linear+geometric_stiffening-coriolis``.
    where : str
        For messages.

    Raises
    ------
    SceneError
        BAD_REFERENCE: unknown name; BAD_FIELD: ``auto`` among other names, or one effect alone, as of a set that was
        joined by commas.
    """
    found = []
    for text in (part.strip() for value in values for part in value.split(",")):
        if not text:
            continue
        names = split_set(text)
        named_effects(names[0] if len(names) == 1 else names, where)
        if len(names) == 1 and names[0] in EFFECTS:
            message = "one effect alone would leave out all others, flexibility or gravity too"
            remedy = f"join the names of a set by +, for instance all+{names[0]}"
            raise SceneError(Cause.BAD_FIELD, message, where=where, value=text, remedy=remedy)
        found.append(_joined(names))
    return each_once(found)


def split_set(label: str) -> list[str]:
    """Names of a set, as a scene takes them."""
    parts = label.replace("-", "+-").split("+")
    return [] if label == NOTHING else [name.strip() for name in parts if name.strip()]


def own_set(effects: str | Sequence[str]) -> str:
    """The label of the set that a scene states."""
    return _joined([name.strip() for name in effects.split(",")] if isinstance(effects, str) else list(effects))


def _joined(names: Sequence[str]) -> str:
    return "+".join(names).replace("+-", "-") or NOTHING


def as_field(label: str) -> str:
    """The set as a value of ``simulation.effects``."""
    names = split_set(label)
    return names[0] if len(names) == 1 else json.dumps(names)


def each_once(labels: Iterable[str]) -> tuple[str, ...]:
    """Labels without those that mean the same set as one before."""
    found: dict[object, str] = {}
    for label in labels:
        found.setdefault(label if label == "auto" else named_effects(split_set(label), "effects"), label)
    return tuple(found.values())


def label_of(effects: Iterable[str]) -> str:
    """A label that counts from ``linear`` where links are, otherwise from ``all``."""
    given = set(effects)
    name, base = ("linear", LINEAR) if given.isdisjoint(SECOND_KINEMATICS) else ("all", ALL)
    return name + "".join(f"-{name}" for name in in_order(base - given))

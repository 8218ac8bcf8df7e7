"""Choices that are no numbers, such as that of a material: all combinations of their options."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

import msgspec

from erls.optimization.records import ProblemRecord
from erls.scene.checks import bad, check_names

_MOST = 100  # combinations

Options = dict[str, str]
"""What is chosen, by the names of the choices."""


def check_choices(record: ProblemRecord, file: str) -> None:
    """Refuse choices of nothing, or of too much.

    Raises
    ------
    SceneError
    """
    check_names((f"{file}: choices[{k}].name", choice.name) for k, choice in enumerate(record.choices))
    for k, choice in enumerate(record.choices):
        place = f"{file}: choices[{k}].options"
        check_names((f"{place}.{name}", name) for name in choice.options)
        if len(choice.options) < 2:
            raise bad(place, "nothing to choose from", len(choice.options), "give two options at least")
    count = math.prod(len(choice.options) for choice in record.choices)
    if count > _MOST:
        raise bad(f"{file}: choices", "too many combinations, each of which is optimized", count, f"leave {_MOST}")


def combinations(record: ProblemRecord) -> Iterator[tuple[Options, ProblemRecord]]:
    """Of all options, each with the problem that it makes."""
    for names in product(*(choice.options for choice in record.choices)):
        chosen = {choice.name: name for choice, name in zip(record.choices, names, strict=True)}
        changes = [change for choice in record.choices for change in choice.options[chosen[choice.name]]]
        yield chosen, msgspec.structs.replace(record, set=[*record.set, *changes], choices=[])

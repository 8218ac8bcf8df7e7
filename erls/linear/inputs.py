"""Inputs of a linear model by name, ``joint.elbow.effort``; a further one is one line in `INPUTS`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from erls.linear.channels import Bound, bound, checked
from erls.linear.plants import Plant

_PUSHED = ("free", "torque", "pd")
_MOVED = ("motion", "pd")


class InputKind(NamedTuple):
    """A kind of input.

    Attributes
    ----------
    subject, quantity : str
        ``subject.NAME.quantity``
    motion : bool
        Whether it is the acceleration of something whose place and rate become states.
    names : callable
        Of what it can act on.
    unit : callable
    applied : callable
        A plant under place, rate and acceleration of a motion; of others the last is the input.
    """

    subject: str
    quantity: str
    motion: bool
    names: Callable[[Plant], Sequence[str]]
    unit: Callable[[Plant, str], str]
    applied: Callable[[Plant, str, tuple[float, float, float]], Plant]


class Input(Bound[InputKind]):
    """One input of a plant."""

    def applied(self, plant: Plant, place: float, rate: float, last: float) -> Plant:
        """The plant under it."""
        return self.kind.applied(plant, self.subject, (place, rate, last))


def _driven(kinds: Sequence[str]) -> Callable[[Plant], list[str]]:
    return lambda plant: [name for name, kind in plant.joints.items() if kind in kinds]


def _on_point(axis: int) -> Callable[[Plant, str, tuple[float, float, float]], Plant]:
    return lambda plant, name, amounts: plant.with_wrench(name, amounts[2] * np.eye(6)[axis])


INPUTS: tuple[InputKind, ...] = (
    InputKind(
        "joint",
        "effort",
        False,
        _driven(_PUSHED),
        lambda plant, name: plant.units(name)[1],
        lambda plant, name, amounts: plant.with_effort(name, amounts[2]),
    ),
    InputKind(
        "joint",
        "acceleration",
        True,
        _driven(_MOVED),
        lambda plant, name: f"{plant.units(name)[0]}/s²",
        lambda plant, name, amounts: plant.with_motion(name, *amounts),
    ),
    InputKind(
        "load",
        "factor",
        False,
        lambda plant: plant.loads,
        lambda plant, name: "1",
        lambda plant, name, amounts: plant.with_factor(name, amounts[2]),
    ),
    *(
        InputKind(
            "point", f"force.{axis}", False, lambda plant: plant.points, lambda plant, name: "N", _on_point(k)
        )
        for k, axis in enumerate("xyz")
    ),
    *(
        InputKind(
            "point", f"moment.{axis}", False, lambda plant: plant.turning, lambda plant, name: "N m", _on_point(3 + k)
        )
        for k, axis in enumerate("xyz")
    ),
)
"""Efforts of drives, prescribed and wanted motions, factors of loads, forces and moments on points in the world."""


def inputs_of(plant: Plant, names: Sequence[str] | None = None) -> tuple[Input, ...]:
    """Inputs by name; unless given, efforts of all drives and prescribed motions.

    Raises
    ------
    SceneError
        BAD_REFERENCE: there is no such input, or it is named twice.
    """
    known = {found.name: found for found in bound(plant, INPUTS, Input)}
    if names is None:
        return tuple(
            found
            for found in known.values()
            if found.kind.subject == "joint" and found.kind.motion == (plant.joints[found.subject] == "motion")
        )
    return tuple(known[name] for name in checked("input", names, list(known)))

"""Outputs of a linear model by name, ``point.tip.z``; a further one is one line in `OUTPUTS`.

Velocities and accelerations are derivatives of what places give, taken along the motion and not of its coordinates, so
that they are exact at any state; every other output is a function of time, coordinates, rates and accelerations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from erls.linear.channels import Bound, bound, checked
from erls.linear.plants import Plant, Sight
from erls.maths.so3 import Array


class OutputKind(NamedTuple):
    """A kind of output.

    Attributes
    ----------
    subject, quantity : str
        ``subject.NAME.quantity``, or ``subject.NAME`` without a quantity.
    order : int or None
        Of places alone: how often they are differentiated by time. None of what depends on rates and accelerations.
    names : callable
        Of what it is known.
    unit : callable
    value : callable
        (k,) at states.
    """

    subject: str
    quantity: str
    order: int | None
    names: Callable[[Plant], Sequence[str]]
    unit: Callable[[Plant, str], str]
    value: Callable[[Sight, str], Array]


class Output(Bound[OutputKind]):
    """One output of a plant."""

    def value(self, sight: Sight) -> Array:
        """(k,) of states."""
        return self.kind.value(sight, self.subject)


_RATES = ("", "/s", "/s²")


def _point(axis: int, order: int) -> OutputKind:
    quantity = ("", "velocity.", "acceleration.")[order] + "xyz"[axis]
    unit = f"m{_RATES[order]}"
    return OutputKind(
        "point", quantity, order, lambda plant: plant.points, lambda plant, name: unit, lambda s, n: s.place(n)[:, axis]
    )


def _joint(quantity: str, order: int) -> OutputKind:
    return OutputKind(
        "joint",
        quantity,
        order,
        _moving,
        lambda plant, name: plant.units(name)[0] + _RATES[order],
        lambda sight, name: sight.angle(name),
    )


def _moving(plant: Plant) -> list[str]:
    return [name for name, kind in plant.joints.items() if kind != "fixed"]


OUTPUTS: tuple[OutputKind, ...] = (
    *(_joint(quantity, order) for order, quantity in enumerate(("angle", "rate", "acceleration"))),
    OutputKind(
        "joint",
        "effort",
        None,
        _moving,
        lambda plant, name: plant.units(name)[1],
        lambda sight, name: sight.effort(name),
    ),
    *(_point(axis, order) for order in range(3) for axis in range(3)),
    OutputKind(
        "sensor",
        "",
        None,
        lambda plant: list(plant.readings),
        lambda plant, name: plant.readings[name],
        lambda sight, name: sight.reading(name),
    ),
)
"""Physical angles of joints and their efforts, places of points in the world, readings of the sensors of the scene."""


def outputs_of(plant: Plant, names: Sequence[str] | None = None) -> tuple[Output, ...]:
    """Outputs by name; unless given, angles of joints, places of points, and all that sensors read.

    Raises
    ------
    SceneError
        BAD_REFERENCE: there is no such output, or it is named twice.
    """
    known = {found.name: found for found in bound(plant, OUTPUTS, Output)}
    if names is None:
        return tuple(x for x in known.values() if x.kind.order == 0 or x.kind.subject == "sensor")
    return tuple(known[name] for name in checked("output", names, list(known)))

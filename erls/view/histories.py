"""Plots of what a run tells over its axis: places, coordinates, energies, loads, sensors."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import TypeAlias

import numpy as np

from erls.maths.so3 import Array
from erls.report.html import Curve, Plot, figure, heading, paragraph
from erls.run.tables import Quantity

Quantities: TypeAlias = Sequence[tuple[str, Quantity]]

_NOTHING = 1e-9  # of the largest load of a kind: what rounding leaves
_TWICE = ("angle", "coordinate")
_GROUPS = {
    "angle": "Joint angles",
    "coordinate": "Joint coordinates",
    "rate": "Joint rates",
    "effort": "Joint efforts",
}


def histories(
    x: str, along: Array, found: Quantities, sensors: Collection[str], conservative: bool = False
) -> Iterator[str]:
    """Plots of all columns: vectors by themselves, scalars of a kind together, and what sensors read.

    Parameters
    ----------
    x : str
        What they go along, with its unit.
    along : (k,) array
    found : sequence of (name, Quantity)
    sensors : collection of str
        Names of sensors, whose vectors need not be in world axes.
    conservative : bool
        Whether the total energy should stay as it is, so that what it changes by is worth a plot.
    """
    names = {name for name, _ in found if name in sensors or name.rpartition(".")[0] in sensors}
    read, known = ([one for one in found if (one[0] in names) == of] for of in (True, False))
    vectors = [(name, q) for name, q in known if q.values.ndim == 2]
    yield from _vectors("Places", x, along, [(name, q) for name, q in vectors if q.unit == "m"])
    yield from _scalars(x, along, [(name, q) for name, q in known if q.values.ndim == 1], conservative)
    yield from _vectors("Forces and moments", x, along, [(name, q) for name, q in vectors if q.unit != "m"])
    if read:
        yield heading("Sensors")
    for name, q in read:
        parts = [("", q.values)] if q.values.ndim == 1 else list(zip("xyz", q.values.T, strict=True))
        yield figure(Plot(name, x, f"reading [{q.unit}]", [Curve(part, along, values) for part, values in parts]))


def _scalars(x: str, along: Array, found: Quantities, conservative: bool) -> Iterator[str]:
    """A plot for each kind and unit; angles that are the coordinates are not shown twice."""
    grouped: dict[tuple[str, str], list[Curve]] = {}
    for name, q in found:
        base, _, last = name.rpartition(".")
        kind = "Energy" if base == "energy" else _GROUPS.get(last, "Further readings")
        label = last if kind == "Energy" else base if kind in _GROUPS.values() else name
        grouped.setdefault((kind, q.unit), []).append(Curve(label, along, q.values))
    angles, coordinates = (
        [curve for (kind, _), curves in grouped.items() if kind == _GROUPS[of] for curve in curves] for of in _TWICE
    )
    same = _alike(angles, coordinates)
    for kind in dict.fromkeys(kind for kind, _ in grouped):
        if same and kind == _GROUPS["angle"]:
            continue
        yield heading(kind)
        if same and kind == _GROUPS["coordinate"]:
            yield paragraph("Joint angles are the same.", "note")
        for (one, unit), curves in grouped.items():
            if one != kind:
                continue
            if any(_largest(curve.y) > 0 for curve in curves):
                yield figure(Plot("", x, f"{kind.lower()} [{unit}]", curves))
            else:
                yield paragraph(f"{', '.join(curve.label for curve in curves)}: 0 {unit} all along.", "note")
            if kind == "Energy" and conservative:
                changes = [Curve(c.label, along, c.y - c.y[0]) for c in curves if c.label == "total"]
                yield figure(Plot("Total since the start: nothing drives or damps", x, f"change [{unit}]", changes))


def _alike(some: Sequence[Curve], others: Sequence[Curve]) -> bool:
    """Whether curves of the same names are there, and the same but for rounding."""
    known = {curve.label: curve.y for curve in others}
    return len(some) == len(known) > 0 and all(
        curve.label in known and np.allclose(curve.y, known[curve.label], rtol=1e-12, atol=1e-12, equal_nan=True)
        for curve in some
    )


def _vectors(title: str, x: str, along: Array, found: Quantities) -> Iterator[str]:
    """A plot for each; those that are nothing beside the largest of their unit are named."""
    if not found:
        return
    yield heading(title)
    largest = {q.unit: max(_largest(one.values) for _, one in found if one.unit == q.unit) for _, q in found}
    small: dict[str, list[str]] = {}
    for name, q in found:
        if _largest(q.values) <= _NOTHING * largest[q.unit]:
            small.setdefault(q.unit, []).append(name)
            continue
        curves = [Curve(axis, along, q.values[:, k]) for k, axis in enumerate("xyz")]
        what = "coordinate" if q.unit == "m" else name.rpartition(".")[2]
        yield figure(Plot(name, x, f"{what} [{q.unit}]", curves, note="world axes"))
    for unit, names in small.items():
        least = _NOTHING * largest[unit]
        bound = f"at most {least:.1g} {unit}, which is rounding" if least else f"0 {unit} all along"
        yield paragraph(f"{', '.join(names)}: {bound}.", "note")


def _largest(values: Array) -> float:
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))

"""What the sensors of a scene read, as columns of tables, curves of files and entries of reports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from erls.errors import SceneError
from erls.maths.so3 import Array
from erls.mechanism.sensors.base import Seen, Sensor
from erls.run.record import Curve, plain
from fe_import.files.toml import choose


def outputs(sensors: Sequence[Sensor], seen: Seen, count: int) -> Array:
    """(k, m) readings of all sensors beside each other, at the ``count`` = k times of ``seen``."""
    return np.concatenate([np.zeros((count, 0)), *(sensor.read(seen) for sensor in sensors)], axis=1)


def output_names(sensors: Sequence[Sensor]) -> list[str]:
    """(m) heads of these columns: name, component, unit."""
    return [
        f"{plain(sensor.name)}{part and '.' + part} [{unit}]" for sensor in sensors for part, unit in sensor.columns
    ]


def reading(sensors: Sequence[Sensor], name: str, seen: Seen, shape: tuple[int, ...]) -> Array:
    """(...) or (..., c) of one sensor, at the times of ``seen`` in this shape.

    Raises
    ------
    SceneError
        BAD_REFERENCE.
    """
    names = [sensor.name for sensor in sensors]
    choose(name, names, "sensor", SceneError)
    return shaped(sensors[names.index(name)], seen, shape)


def shaped(sensor: Sensor, seen: Seen, shape: tuple[int, ...]) -> Array:
    """The same: a sensor of one component has no axis of its own."""
    found = sensor.read(seen)
    return found.reshape(shape if len(sensor.columns) == 1 else (*shape, len(sensor.columns)))


def reading_columns(sensors: Sequence[Sensor], seen: Seen, count: int) -> dict[str, Array]:
    """(k,) readings by name with unit."""
    return dict(zip(output_names(sensors), outputs(sensors, seen, count).T, strict=True))


def reading_curves(sensors: Sequence[Sensor], seen: Seen, count: int) -> dict[str, Curve]:
    """Curves of a run file."""
    found = {}
    for sensor in sensors:
        units = dict.fromkeys(unit for _, unit in sensor.columns)
        parts = ", ".join(part for part, _ in sensor.columns)
        text = f"sensor; time{parts and ': ' + parts}"
        found[f"sensors/{sensor.name}"] = Curve(shaped(sensor, seen, (count,)), ", ".join(units), text)
    return found


def reading_samples(sensors: Sequence[Sensor], seen: Seen, count: int) -> list[dict[str, Any]]:
    """Readings by name at each time, numbers or lists of them."""
    if not count:  # no motion to read
        return []
    found = {sensor.name: shaped(sensor, seen, (count,)).tolist() for sensor in sensors}
    return [{name: values[k] for name, values in found.items()} for k in range(count)]

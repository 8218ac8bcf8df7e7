"""Damaged structure of HDF5 files: items dropped, renamed, of another type or shape, values that are none."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import h5py
import numpy as np
from fuzzing_damage import Damage

_VALUES = (np.nan, np.inf, -np.inf, -1.0, 1e300, 0.0)


def _datasets(file: h5py.File) -> list[str]:
    found: list[str] = []
    file.visititems(lambda name, item: found.append(name) if isinstance(item, h5py.Dataset) else None)
    return found


def _items(file: h5py.File) -> list[str]:
    found: list[str] = []
    file.visit(found.append)
    return found


def _pick(names: list[str], rng: np.random.Generator) -> str:
    return names[int(rng.integers(len(names)))]


def _drop(file: h5py.File, rng: np.random.Generator) -> None:
    del file[_pick(_items(file), rng)]


def _rename(file: h5py.File, rng: np.random.Generator) -> None:
    name = _pick(_items(file), rng)
    file.move(name, name + "x")


def _swap(file: h5py.File, rng: np.random.Generator) -> None:
    a, b = _pick(_datasets(file), rng), _pick(_datasets(file), rng)
    if a != b:
        file.move(a, "waiting")
        file.move(b, a)
        file.move("waiting", b)


def _replaced(file: h5py.File, name: str, change: Callable[[Any], Any]) -> None:
    values, attributes = file[name][()], dict(file[name].attrs)
    del file[name]
    dataset = file.create_dataset(name, data=change(values))
    dataset.attrs.update(attributes)


def _retype(file: h5py.File, rng: np.random.Generator) -> None:
    kinds = ("f4", "i8", "f8", "i4", "S8", "u1")
    kind = kinds[int(rng.integers(len(kinds)))]

    def change(values: Any) -> Any:
        array = np.asarray(values)
        if array.dtype.kind in "SO":
            return np.zeros(array.shape, kind)
        with np.errstate(all="ignore"):
            return array.astype(kind)

    _replaced(file, _pick(_datasets(file), rng), change)


def _reshape(file: h5py.File, rng: np.random.Generator) -> None:
    changes: tuple[Callable[[Any], Any], ...] = (
        np.ravel,
        np.transpose,
        lambda v: np.atleast_1d(v)[:-1],
        lambda v: np.concatenate([np.atleast_1d(v)] * 2),
        lambda v: np.asarray(v)[None],
        lambda v: np.atleast_1d(v)[:0],
    )
    _replaced(file, _pick(_datasets(file), rng), changes[int(rng.integers(len(changes)))])


def _value(file: h5py.File, rng: np.random.Generator) -> None:
    dataset = file[_pick(_datasets(file), rng)]
    values = np.array(dataset[()])
    if not values.size or values.dtype.kind not in "fi":
        return
    value = _VALUES[int(rng.integers(len(_VALUES)))]
    if values.dtype.kind == "i":
        value = float(rng.choice([-1, 0, 1, 10**9]))
    values.flat[int(rng.integers(values.size))] = value
    dataset[...] = values


def _attribute(file: h5py.File, rng: np.random.Generator) -> None:
    names = ["/", *_items(file)]
    held = [name for name in names if len(file[name].attrs)]
    attributes = file[_pick(held, rng)].attrs
    name = _pick(sorted(attributes), rng)
    change = int(rng.integers(4))
    if change == 0:
        del attributes[name]
    elif change == 1:
        attributes[f"{name}x"] = attributes[name]
        del attributes[name]
    else:
        options = (np.nan, -1, 10**12, "other", b"\xff", np.zeros(3), "")
        attributes[name] = options[int(rng.integers(len(options)))]


EDITS = {
    "drop an item": _drop,
    "rename an item": _rename,
    "swap two datasets": _swap,
    "another type": _retype,
    "another shape": _reshape,
    "another value": _value,
    "an attribute": _attribute,
}


def edited(data: bytes, rng: np.random.Generator) -> Damage:
    """One edit of a file."""
    kind = _pick(list(EDITS), rng)
    buffer = io.BytesIO(data)
    with h5py.File(buffer, "r+") as file:
        EDITS[kind](file, rng)
    return Damage(kind, buffer.getvalue())

"""Values inside an HDF5 file: a typed reader that names what is wrong and where, and the writers.

The reader expects a file that passed `fe_import.files.hdf5.audit.audit`.
"""

from __future__ import annotations

import contextlib
import enum
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import h5py
import numpy as np
from numpy.typing import NDArray

from fe_import.errors import Cause, FEImportError, ReportedError
from fe_import.model import Array, IntArray

REMEDY = "make the file again with the tool that wrote it"
_BLOCK = 16_000_000  # bytes of an array that are copied at a time
_MAX_TEXT = 16_000_000  # bytes of all strings of one dataset

Shape = tuple[int | None, ...]
"""Expected shape; None stands for any length."""

T = TypeVar("T", str, int, float)


@contextlib.contextmanager
def translated(where: str, error: type[ReportedError], cause: enum.StrEnum) -> Iterator[None]:
    """Turn whatever h5py raises on a damaged file into ``error``; for code that touches only the file."""
    try:
        yield
    except ReportedError:
        raise
    except Exception as problem:  # OSError, KeyError, RuntimeError, ValueError, TypeError, MemoryError ...
        text = f"damaged: {type(problem).__name__}: {_shown(str(problem))}"
        raise error(cause, text, where=where, remedy=REMEDY) from problem


@dataclass(frozen=True)
class Reader:
    """A group of a file; every read is checked and fails with ``error(cause, ...)``.

    Attributes
    ----------
    group : h5py.Group
    where : str
        Name of the file, for messages.
    error, cause
        What to raise.
    """

    group: h5py.Group
    where: str
    error: type[ReportedError] = FEImportError
    cause: enum.StrEnum = Cause.MODAL_FILE

    def place(self, name: str) -> str:
        """``FILE: /group/name``."""
        return f"{self.where}: {(self.group.name or '').rstrip('/')}/{name}"

    def fail(self, name: str, message: str, value: Any = None, limit: Any = None) -> ReportedError:
        """The error to raise about an item of this group."""
        return self.error(
            self.cause, message, where=self.place(name), value=_shown(value), limit=limit, remedy=REMEDY
        )

    def names_inside(self) -> tuple[str, ...]:
        """Names of the groups and datasets here."""
        with translated(self.place(""), self.error, self.cause):
            return tuple(str(name) for name in self.group)

    def attribute_names(self) -> tuple[str, ...]:
        """Names of the attributes here."""
        with translated(self.place("@"), self.error, self.cause):
            return tuple(str(name) for name in self.group.attrs)

    def subgroup(self, name: str) -> Reader:
        """The reader of a group inside."""
        with translated(self.place(name), self.error, self.cause):
            return replace(self, group=self._item(name, h5py.Group))

    def array(self, name: str, shape: Shape) -> Array:
        """A float64 dataset of that shape, all values finite."""
        with translated(self.place(name), self.error, self.cause):
            values = np.asarray(self._dataset(name, shape, "f", "float64")[()], dtype=np.float64)
        self._refuse_first(name, ~np.isfinite(values), values, "not finite")
        return values

    def integers(self, name: str, shape: Shape, low: int | None = None, high: int | None = None) -> IntArray:
        """An int64 dataset of that shape, all values in [low, high)."""
        with translated(self.place(name), self.error, self.cause):
            values = np.asarray(self._dataset(name, shape, "i", "int64")[()], dtype=np.int64)
        if low is not None:
            self._refuse_first(name, values < low, values, "too small", f"at least {low}")
        if high is not None:
            self._refuse_first(name, values >= high, values, "too large", f"below {high}")
        return values

    def numbers(self, name: str) -> Array | IntArray:
        """A float64 dataset, all values finite, or an int64 dataset, of any shape."""
        with translated(self.place(name), self.error, self.cause):
            dataset = self._item(name, h5py.Dataset)
            whole, shape = dataset.dtype.kind == "i", (None,) * dataset.ndim
        return self.integers(name, shape) if whole else self.array(name, shape)

    def scalar(self, name: str) -> float:
        """A float64 dataset of one finite value."""
        return float(self.array(name, ()))

    def text(self, name: str) -> str:
        """A dataset of one UTF-8 string."""
        return self._strings(name, ())[0]

    def names(self, name: str, count: int | None = None) -> tuple[str, ...]:
        """A one-dimensional dataset of UTF-8 strings."""
        return self._strings(name, (count,))

    def attribute(self, name: str, kind: type[T]) -> T:
        """An attribute of type str, int or float (finite)."""
        at = f"@{name}"
        with translated(self.place(at), self.error, self.cause):
            if name not in self.group.attrs:
                raise self.fail(at, "this attribute is missing")
            value = self.group.attrs[name]
            if isinstance(value, (bytes, str)):
                raw = value if isinstance(value, bytes) else value.encode("utf-8", "surrogateescape")
                if kind is not str:
                    raise self.fail(at, f"must be of type {kind.__name__}", raw.decode("utf-8"))
                return kind(raw.decode("utf-8"))
            expected = {int: "i", float: "f"}.get(kind)
            if np.shape(value) != () or np.asarray(value).dtype.kind != expected or not np.isfinite(value):
                raise self.fail(at, f"must be one value of type {kind.__name__}", str(value))
            return kind(value.item())

    def _item(self, name: str, kind: type) -> Any:
        what = "dataset" if kind is h5py.Dataset else "group"
        if name not in self.group:
            raise self.fail(name, f"this {what} is missing")
        item = self.group[name]
        if not isinstance(item, kind):
            raise self.fail(name, f"must be a {what}")
        return item

    def _dataset(self, name: str, shape: Shape, kind: str, wanted: str) -> Any:
        dataset = self._item(name, h5py.Dataset)
        text = h5py.check_string_dtype(dataset.dtype) is not None
        if text != (kind == "S") or not (text or dataset.dtype.kind == kind):
            raise self.fail(name, "wrong data type", "string" if text else dataset.dtype.name, wanted)
        same = len(dataset.shape) == len(shape)
        if not same or any(w not in (None, n) for w, n in zip(shape, dataset.shape, strict=True)):
            expected = ", ".join("any" if n is None else str(n) for n in shape)
            raise self.fail(name, f"wrong shape, expected ({expected})", dataset.shape)
        return dataset

    def _strings(self, name: str, shape: Shape) -> tuple[str, ...]:
        with translated(self.place(name), self.error, self.cause):
            dataset = self._dataset(name, shape, "S", "UTF-8 string")
            if h5py.check_string_dtype(dataset.dtype).length is not None:
                return tuple(bytes(v).decode("utf-8") for v in np.ravel(dataset[()]))
            texts, total = [], 0
            for index in np.ndindex(dataset.shape):  # one by one: all may point to the same long text
                texts.append(bytes(dataset[index]).decode("utf-8"))
                total += len(texts[-1])
                if total > _MAX_TEXT:
                    raise self.fail(name, "too much text", f"over {_MAX_TEXT} bytes", _MAX_TEXT)
            return tuple(texts)

    def _refuse_first(
        self, name: str, bad: NDArray[np.bool_], values: NDArray[Any], what: str, limit: str | None = None
    ) -> None:
        if bad.any():
            index = tuple(int(i) for i in np.unravel_index(int(np.argmax(bad)), bad.shape))
            raise self.fail(name, f"value at {list(index)} is {what}", values[index].item(), limit)


def _shown(value: Any) -> Any:
    return value if not isinstance(value, str) or len(value) < 120 else value[:117] + "..."


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "backslashreplace")  # a file name may hold bytes that are not UTF-8


def write_array(group: h5py.Group, name: str, values: Any, unit: str, description: str) -> None:
    """Store float64 or int64 values with their unit and meaning; groups in ``name`` are made.

    Large arrays go a block at a time: a run that ended for lack of memory has none for copies.
    """
    values = np.asarray(values)
    dtype = np.int64 if values.dtype.kind in "iu" else np.float64
    if values.nbytes <= _BLOCK:
        dataset = group.create_dataset(name, data=values.astype(dtype, copy=False), track_times=False)
    else:
        dataset = group.create_dataset(name, values.shape, dtype, track_times=False)
        rows = max(1, _BLOCK * len(values) // values.nbytes)
        for begin in range(0, len(values), rows):
            dataset[begin : begin + rows] = values[begin : begin + rows]
    write_attribute(dataset, "unit", unit)
    write_attribute(dataset, "description", description)


def write_strings(group: h5py.Group, name: str, values: str | tuple[str, ...], description: str) -> None:
    """Store one string or a list of strings as UTF-8 of fixed length."""
    encoded = _bytes(values) if isinstance(values, str) else [_bytes(v) for v in values]
    longest = max((len(v) for v in ([encoded] if isinstance(encoded, bytes) else encoded)), default=0)
    dtype = h5py.string_dtype("utf-8", max(1, longest))
    dataset = group.create_dataset(name, data=np.array(encoded, dtype=dtype), dtype=dtype, track_times=False)
    write_attribute(dataset, "unit", "")
    write_attribute(dataset, "description", description)


def write_attribute(item: h5py.HLObject, name: str, value: str | int | float) -> None:
    """Store a text (UTF-8 of fixed length) or a number as an attribute."""
    if isinstance(value, str):
        data = _bytes(value)
        dtype = h5py.string_dtype("utf-8", max(1, len(data)))
        item.attrs.create(name, np.array(data, dtype=dtype), dtype=dtype)
    else:
        item.attrs.create(name, value, dtype=np.int64 if isinstance(value, int) else np.float64)

"""Look over an HDF5 file before any of its data is read: a modal or run file is data, and only data.

A foreign file can point elsewhere (links, external storage, virtual datasets), declare arrays far larger than
itself, nest without end, or carry types that need code to interpret. The walk uses link, type and storage
information only.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import h5py
from h5py import h5a, h5d, h5g, h5l, h5o, h5s, h5t, h5z

from fe_import.errors import ReportedError

Fail = Callable[..., ReportedError]
"""``fail(object path, message, value=None, limit=None)`` makes the error to raise."""

_FILTERS = {h5z.FILTER_DEFLATE: "gzip", h5z.FILTER_SHUFFLE: "shuffle", h5z.FILTER_FLETCHER32: "fletcher32"}
_FLOATS = (h5t.IEEE_F64LE, h5t.IEEE_F64BE)
_STRING_IN_FILE = 16  # bytes: length, address and index of a string of variable length
_INTEGERS = (h5t.STD_I64LE, h5t.STD_I64BE)


@dataclass(frozen=True)
class Limits:
    """What a file may hold.

    ``file_bytes`` is its size on disk, ``max_bytes`` bounds all declared data together.
    """

    file_bytes: int
    max_bytes: float
    max_objects: int = 20_000
    max_depth: int = 16
    max_rank: int = 6
    max_ratio: int = 1100  # deflate reaches 1032
    max_attributes: int = 1000
    max_attribute_bytes: int = 1_000_000
    max_strings: int = 100_000  # of variable length, per dataset
    max_idle_chunk: int = 16_000_000  # bytes of a chunk that may be larger than its data


@dataclass
class _Totals:
    objects: int = 0
    declared: int = 0
    stored: int = 0


def audit(file: h5py.File, limits: Limits, fail: Fail) -> None:
    """Refuse a file that holds anything but groups and plain arrays of its own.

    Raises
    ------
    ReportedError
        Made by ``fail``. Exceptions of h5py on a damaged file pass through.
    """
    root = h5g.open(file.id, b"/")
    seen = {h5o.get_info(root).addr}
    totals = _Totals()
    todo: list[tuple[Any, str, int]] = [(root, "/", 0)]
    _check_attributes(root, "/", limits, fail)
    while todo:
        group, path, depth = todo.pop()
        for name, kind in _links(group, limits.max_objects):
            child = path.rstrip("/") + "/" + name.decode("utf-8", "backslashreplace")
            if kind != h5l.TYPE_HARD:
                raise fail(child, "soft and external links are refused")
            totals.objects += 1
            if totals.objects > limits.max_objects:
                raise fail(
                    path, "too many objects in the file", f"over {limits.max_objects}", limits.max_objects
                )
            item = h5o.open(group, name)
            address = h5o.get_info(item).addr
            if address in seen:
                raise fail(child, "the object is linked twice")
            seen.add(address)
            _check_attributes(item, child, limits, fail)
            if isinstance(item, h5g.GroupID):
                if depth + 1 > limits.max_depth:
                    raise fail(child, "groups are nested too deeply", depth + 1, limits.max_depth)
                todo.append((item, child, depth + 1))
            elif isinstance(item, h5d.DatasetID):
                _check_dataset(item, child, limits, totals, fail)
            else:
                raise fail(child, "neither a group nor a dataset")


def _links(group: Any, most: int) -> list[tuple[bytes, int]]:
    """Names and kinds of the links of a group, without following them; stops just above ``most``."""
    found: list[tuple[bytes, int]] = []

    def add(name: bytes, info: Any) -> bool | None:
        found.append((name, info.type))
        return True if len(found) > most else None

    group.links.iterate(add, info=True)
    return found


def _check_type(kind: Any, path: str, fail: Fail) -> bool:
    """Refuse all but float64, int64 and UTF-8 (ASCII) strings; True for strings of variable length."""
    if isinstance(kind, h5t.TypeStringID):
        return bool(kind.is_variable_str())
    if not any(kind.equal(t) for t in _FLOATS + _INTEGERS):
        raise fail(
            path, "data type refused; known: float64, int64, strings", type(kind).__name__.removesuffix("ID")
        )
    return False


def _shape(space: Any, path: str, limits: Limits, fail: Fail) -> tuple[int, ...]:
    if space.get_simple_extent_type() == h5s.NULL:
        raise fail(path, "holds no value")
    rank = space.get_simple_extent_ndims()
    if rank > limits.max_rank:
        raise fail(path, "too many dimensions", rank, limits.max_rank)
    return tuple(int(n) for n in space.get_simple_extent_dims())


def _check_attributes(item: Any, path: str, limits: Limits, fail: Fail) -> None:
    count = h5a.get_num_attrs(item)
    if count > limits.max_attributes:
        raise fail(path, "too many attributes", count, limits.max_attributes)
    for index in range(count):
        attribute = h5a.open(item, index=index)
        place = f"{path}@{attribute.name.decode('utf-8', 'backslashreplace')}"
        kind = attribute.get_type()
        variable = _check_type(kind, place, fail)
        shape = _shape(attribute.get_space(), place, limits, fail)
        if math.prod(shape) * kind.get_size() > min(limits.max_attribute_bytes, limits.file_bytes):
            raise fail(place, "attribute too large", shape)
        if variable and shape:
            raise fail(place, "an attribute may hold one string", shape)


def _check_dataset(dataset: Any, path: str, limits: Limits, totals: _Totals, fail: Fail) -> None:
    """Refuse storage elsewhere, unknown filters, and sizes that the file cannot hold."""
    creation = dataset.get_create_plist()
    layout = creation.get_layout()
    if layout == h5d.VIRTUAL:
        raise fail(path, "virtual datasets are refused")
    if creation.get_external_count():
        raise fail(path, "external storage is refused")
    if layout not in (h5d.COMPACT, h5d.CONTIGUOUS, h5d.CHUNKED):
        raise fail(path, "unknown storage layout", layout)
    filters = (
        [creation.get_filter(k)[0] for k in range(creation.get_nfilters())] if layout == h5d.CHUNKED else []
    )
    unknown = [f for f in filters if f not in _FILTERS]
    if unknown:
        raise fail(path, f"unknown filter; known: {', '.join(_FILTERS.values())}", unknown[0])
    kind = dataset.get_type()
    variable = _check_type(kind, path, fail)
    shape = _shape(dataset.get_space(), path, limits, fail)
    if variable and math.prod(shape) > limits.max_strings:
        raise fail(path, "too many strings", math.prod(shape), limits.max_strings)

    item = _STRING_IN_FILE if variable else kind.get_size()
    stored = dataset.get_storage_size()
    declared = math.prod(shape) * item
    totals.declared += declared
    totals.stored += stored
    if totals.declared > limits.max_bytes:
        raise fail(
            path, "declares more data than is allowed", f"{totals.declared} bytes", f"{limits.max_bytes:.0f}"
        )
    if totals.stored > limits.file_bytes:
        raise fail(path, "declares more stored bytes than the file has", totals.stored, limits.file_bytes)
    if layout == h5d.CHUNKED:
        most = stored * (limits.max_ratio if h5z.FILTER_DEFLATE in filters else 1)
        chunk = math.prod(creation.get_chunk()) * item
        if declared > most:
            raise fail(path, "declares far more data than is stored", f"{declared} bytes", f"{most} bytes")
        if chunk > max(declared, limits.max_idle_chunk):
            raise fail(path, "chunks are far larger than the data", f"{chunk} bytes", f"{declared} bytes")
        return
    if stored != declared:
        raise fail(path, "declared size and stored size differ", f"{declared} bytes", f"{stored} bytes")
    offset = dataset.get_offset() if layout == h5d.CONTIGUOUS and declared else 0
    if offset is None or offset + stored > limits.file_bytes:
        raise fail(path, "the data would lie beyond the end of the file", offset, limits.file_bytes)

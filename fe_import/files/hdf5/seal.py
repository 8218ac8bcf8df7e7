"""A seal over the content of a file: what was damaged, dropped, renamed or changed by hand does not fit it any more.

HDF5's own checksums cover names and shapes, not the numbers of plain datasets, and nothing says what is missing.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5o, h5s

ATTRIBUTE = "content_sha256"  # of the root group
_BLOCK = 16_000_000  # bytes of a dataset that are held at a time


def seal_of(file: h5py.Group) -> str:
    """SHA-256 over names, types, shapes and values of all datasets and attributes but the seal itself."""
    digest, root = hashlib.sha256(), file.id
    names: list[bytes] = []
    h5o.visit(root, names.append)
    for name in [b"/", *sorted(names)]:
        item = h5o.open(root, name)
        digest.update(b"\n" + name + b"\n")
        attributes = [h5a.open(item, index=k) for k in range(h5a.get_num_attrs(item))]
        for key, attribute in sorted((each.name, each) for each in attributes):
            if (name, key) != (b"/", ATTRIBUTE.encode()):
                digest.update(b"\n@" + key + b"\n")
                _add(digest, _value(attribute))
        if isinstance(item, h5d.DatasetID):
            digest.update(f"{item.shape}".encode())
            for block in _blocks(item):
                _add(digest, block)
    return digest.hexdigest()


def _value(attribute: Any) -> np.ndarray[Any, Any]:
    """Of an attribute; of a string of variable length, its text."""
    values = np.zeros(attribute.shape, attribute.dtype)
    attribute.read(values)
    if values.dtype.hasobject and not values.shape:
        return np.asarray(bytes(values[()]).decode("utf-8", "surrogateescape"))
    return values


def _add(digest: Any, values: np.ndarray[Any, Any]) -> None:
    digest.update(values.dtype.str.encode())
    if values.dtype.hasobject or values.dtype.kind == "U":  # strings of variable length
        for text in values.ravel():
            data = text if isinstance(text, bytes) else str(text).encode("utf-8", "surrogateescape")
            digest.update(len(data).to_bytes(8, "little") + data)
    else:
        digest.update(np.ascontiguousarray(values).data)


def _blocks(dataset: Any) -> Iterator[np.ndarray[Any, Any]]:
    bytes_each = dataset.dtype.itemsize * math.prod(dataset.shape[1:])
    if not dataset.shape or dataset.shape[0] * bytes_each <= _BLOCK:
        values = np.zeros(dataset.shape, dataset.dtype)
        if values.size:
            dataset.read(h5s.ALL, h5s.ALL, values)
        yield values
        return
    step = max(1, _BLOCK // bytes_each)
    for begin in range(0, dataset.shape[0], step):
        yield np.asarray(h5py.Dataset(dataset)[begin : begin + step])

"""A seal over the content of a file: what was damaged, dropped, renamed or changed by hand does not fit it any more.

HDF5's own checksums cover names and shapes, not the numbers of plain datasets, and nothing says what is missing.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any

import h5py
import numpy as np

ATTRIBUTE = "content_sha256"  # of the root group
_BLOCK = 16_000_000  # bytes of a dataset that are held at a time


def seal_of(file: h5py.Group) -> str:
    """SHA-256 over names, types, shapes and values of all datasets and attributes but the seal itself."""
    digest = hashlib.sha256()
    names: list[str] = []
    file.visit(names.append)
    for name in ["/", *sorted(names)]:
        item = file[name]
        digest.update(f"\n{name}\n".encode())
        for key in sorted(item.attrs):
            if (name, key) != ("/", ATTRIBUTE):
                digest.update(f"\n@{key}\n".encode())
                _add(digest, np.asarray(item.attrs[key]))
        if isinstance(item, h5py.Dataset):
            digest.update(f"{item.shape}".encode())
            for block in _blocks(item):
                _add(digest, block)
    return digest.hexdigest()


def _add(digest: Any, values: np.ndarray[Any, Any]) -> None:
    digest.update(values.dtype.str.encode())
    if values.dtype.hasobject or values.dtype.kind == "U":  # strings of variable length
        for text in values.ravel():
            data = text if isinstance(text, bytes) else str(text).encode("utf-8", "surrogateescape")
            digest.update(len(data).to_bytes(8, "little") + data)
    else:
        digest.update(np.ascontiguousarray(values).data)


def _blocks(dataset: h5py.Dataset) -> Iterator[np.ndarray[Any, Any]]:
    if not dataset.shape or dataset.size == 0:
        yield np.asarray(dataset[()])
        return
    step = max(1, _BLOCK * dataset.shape[0] // max(1, dataset.nbytes))
    for begin in range(0, dataset.shape[0], step):
        yield np.asarray(dataset[begin : begin + step])

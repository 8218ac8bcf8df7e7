"""What equations make of a link, kept beside it: variants of a mechanism share the links that they leave alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from erls.mechanism.links import Link

T = TypeVar("T")
_ROOM = 4
"""Values of one kind that are kept for a link: as many as mechanisms are compared at a time."""


def kept(make: Callable[..., T], link: Link, *given: Any) -> T:
    """``make(link, *given)``, made once as long as what is given stays the same: arrays, numbers and truth values.

    The result is shared, and must not be changed.
    """
    values: dict[Any, T] = link.__dict__.setdefault("kept", {}).setdefault(make.__qualname__, {})
    key = tuple((x.shape, x.tobytes()) if isinstance(x, np.ndarray) else x for x in given)
    if (found := values.get(key)) is not None:
        return found
    while len(values) >= _ROOM:
        values.pop(next(iter(values)), None)
    return values.setdefault(key, make(link, *given))

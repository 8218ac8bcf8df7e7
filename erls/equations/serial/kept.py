"""What equations make of a link, kept beside it: variants of a mechanism share the links that they leave alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from erls.maths.records import Laid, laid
from erls.mechanism.links import Link

T = TypeVar("T")


def kept(make: Callable[..., T], link: Link, *given: Any) -> T:
    """``make(link, *given)``, made once as long as what is given stays the same: arrays, numbers and truth values.

    The result is shared, and must not be changed.
    """
    key = tuple((x.shape, x.tobytes()) if isinstance(x, np.ndarray) else x for x in given)
    return link.once((make.__qualname__, key), lambda: make(link, *given))


def kept_record(make: Callable[..., Any], link: Link, *given: Any) -> Laid:
    """The same of a record, as memory lays it."""
    return kept(_laid, link, make, *given)


def _laid(link: Link, make: Callable[..., Any], *given: Any) -> Laid:
    return laid(make(link, *given))

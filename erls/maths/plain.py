"""Compiled loops run as plain Python, over what cannot be compiled."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])


@cache
def plain(function: F) -> F:
    """A compiled function (`erls.maths.jit`) as plain Python, with all that it calls by name."""
    inner = getattr(function, "py_func", None)
    if inner is None:
        return function
    known = inner.__globals__
    called = {name: plain(known[name]) for name in inner.__code__.co_names if hasattr(known.get(name), "py_func")}
    found: Any = FunctionType(inner.__code__, {**known, **called}, inner.__name__, inner.__defaults__)
    return cast(F, found)

"""A part of a stated error."""

from __future__ import annotations

from typing import NamedTuple


class Judged(NamedTuple):
    """Metres, or None, and what is to be said of it; ``grown`` if it holds what the motion makes of small errors."""

    error: float | None
    note: str = ""
    grown: bool = False

"""What a caller of a simulation looks with: a bar that advances."""

from __future__ import annotations

from collections.abc import Callable

from erls.run.watches.base import NOTHING, Finding, Knots, Started, Watch


class Progress(Watch):
    """Calls ``advance`` with (time, duration) after each step."""

    def __init__(self, advance: Callable[[float, float], None]) -> None:
        self._advance, self._duration = advance, 0.0

    def begins(self, begun: Started) -> Finding:
        """Nothing; it learns the duration."""
        self._duration = begun.duration
        return NOTHING

    def during(self, t: float, knots: Knots) -> Finding:
        """Nothing; it calls."""
        self._advance(t, self._duration)
        return NOTHING

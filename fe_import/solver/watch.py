"""Messages of long computations to whoever asked for them, without handing a function down through every caller."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar

_INTERVAL = 5.0  # seconds between messages on the way

_tell: ContextVar[Callable[[str], None] | None] = ContextVar("tell", default=None)


@contextlib.contextmanager
def telling(tell: Callable[[str], None] | None) -> Iterator[None]:
    """Send messages of what runs inside to ``tell``; nowhere when None."""
    token = _tell.set(tell)
    try:
        yield
    finally:
        _tell.reset(token)


def say(message: str) -> None:
    """Send a message to the listener, if there is one."""
    listener = _tell.get()
    if listener is not None:
        listener(message)


class Progress:
    """Says every few seconds how far a computation is.

    Parameters
    ----------
    what : str
        Begins each message.
    total : float
        Amount of work.
    """

    def __init__(self, what: str, total: float) -> None:
        self._what, self._total, self._done = what, total, 0.0
        self._told = time.monotonic()

    def advance(self, work: float) -> None:
        """Some more work is done."""
        self._done += work
        now = time.monotonic()
        if now - self._told > _INTERVAL:
            self._told = now
            say(f"{self._what}: {100 * self._done / self._total:.0f} % done")

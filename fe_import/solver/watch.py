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
    """Send messages of what runs inside to ``tell``; when None, to whom they went before."""
    token = _tell.set(tell or _tell.get())
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
    """Says every few seconds how far a computation is; called with the operations that are done.

    Parameters
    ----------
    what : str
        Begins each message.
    work : float
        Operations of all.
    """

    def __init__(self, what: str, work: float) -> None:
        self._what, self._work = what, work
        self._told = time.monotonic()

    def __call__(self, done: float) -> None:
        """So many operations are done."""
        now = time.monotonic()
        if now - self._told > _INTERVAL:
            self._told = now
            say(f"{self._what}: {100 * done / self._work:.0f} % done")

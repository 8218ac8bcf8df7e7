"""What the workers of the pool tests do; light to import."""

from __future__ import annotations

import os

from erls.errors import Cause, SimulationError


def square(number: int) -> int:
    """Some numbers fail, one kills its process."""
    if number == 13:
        raise SimulationError(Cause.NOT_FINITE, "unlucky", where="t = 1 s", value=13.0, remedy="try another")
    if number == 99:
        os._exit(1)
    return number * number


def process(number: int) -> int:
    """Which one does it."""
    return os.getpid()

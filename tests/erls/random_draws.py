"""Seeded draws for random scenes: the same on every machine and with every version of Python.

Every subject of a scene has a stream of its own, so that a change of how one is drawn leaves the others as they were.
Numbers are rounded to four digits, far above what libraries of mathematical functions differ by.
"""

from __future__ import annotations

import math
import random
from collections.abc import Mapping, Sequence
from typing import TypeVar

T = TypeVar("T")


def rounded(value: float, digits: int = 4) -> float:
    """A number to so many significant digits."""
    return float(f"{value:.{digits - 1}e}")


class Draws:
    """A stream of draws; all come from `random.Random.random`, whose sequence Python guarantees.

    Parameters
    ----------
    seed : int
    subject : str
        What is drawn.
    """

    def __init__(self, seed: int, subject: str) -> None:
        self._random = random.Random(f"{seed} {subject}").random

    def chance(self, share: float) -> bool:
        """Whether something is so that is so in this share of all cases."""
        return self._random() < share

    def uniform(self, low: float, high: float) -> float:
        """A number between two others."""
        return rounded(low + (high - low) * self._random())

    def log_uniform(self, low: float, high: float) -> float:
        """A number between two positive ones, whose logarithm is evenly spread."""
        return rounded(low * (high / low) ** self._random())

    def signed(self, low: float, high: float) -> float:
        """The same as `uniform`, with either sign."""
        value = self.uniform(low, high)
        return -value if self.chance(0.5) else value

    def whole(self, low: int, high: int) -> int:
        """A whole number, both ends included."""
        return low + min(int((high - low + 1) * self._random()), high - low)

    def one_of(self, members: Sequence[T]) -> T:
        """One of several, all alike."""
        return members[self.whole(0, len(members) - 1)]

    def pick(self, weights: Mapping[T, float]) -> T:
        """One of several by weight."""
        left = math.fsum(weights.values()) * self._random()
        for member, weight in weights.items():
            left -= weight
            if left < 0:
                return member
        return next(reversed(list(weights)))

    def turn_deg(self) -> list[float]:
        """Three angles [deg]: about any axis by anything."""
        return [self.uniform(-180.0, 180.0), self.uniform(-90.0, 90.0), self.uniform(-180.0, 180.0)]

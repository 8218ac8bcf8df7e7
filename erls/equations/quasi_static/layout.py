"""Where the constants of a reduced chain lie: behind those of the chain itself, found from the end of ``integers``."""

from __future__ import annotations

# from the end of integers
LIGHT = -7  # where integers of the chain without what deformation adds to inertia start; they end before these numbers
ENDS = -6  # number of times at which forces jump
SIZE = -5  # n, coordinates of the chain
SLOW = -4  # s
STATIC = -3  # h
CONSTANTS = (
    -2
)  # where in reals: W and H column after column, κ (h,), Wᵀ K W and Wᵀ C W (s, s) of the links, lapse, ends
MEMORY = -1  # where in scratch: vectors (n,), (h,), (s,), then matrices (n, n) twice, (n, s) and (s, s)
TAIL = 7

PLACE, RATE, ACCELERATION, FORCE = range(4)  # (n,)
FULL = 4
ETA, FOUND, FOUND_RATE, CHANGE = range(4)  # (h,)
STATICS = 4
NEAR_PLACE, NEAR_RATE, NEAR_ACCELERATION, LEFT = range(4)  # (s,)
SLOWS = 4


def memory_size(n: int, s: int, h: int) -> int:
    """Working memory of a reduction from n to s coordinates with h static ones."""
    return FULL * n + STATICS * h + SLOWS * s + 2 * n * n + n * s + s * s

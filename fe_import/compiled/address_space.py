"""Limits of address space (``ulimit -v``), and what is left of it before libraries take some that survive no refusal.

LLVM ends the process where it gets no memory for code, without a word; OpenBLAS waits for ever.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

TO_LOAD, TO_COMPILE = 2**24, 2**26
"""Bytes that must be left to load code from disk, and to compile it."""

_PAGES = Path("/proc/self/statm")


def address_space() -> int | None:
    """Bytes that the user limits this process to; None without a limit."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    soft = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if soft == resource.RLIM_INFINITY else soft


def require_room(needed: int) -> None:
    """Refuse what would take more than is left, where that is known.

    Raises
    ------
    MemoryError
    """
    limit = address_space()
    if limit is None:
        return
    try:
        taken = int(_PAGES.read_bytes().split()[0]) * _page()
    except OSError:  # other systems, or no file may be opened
        return
    if limit - taken < needed:
        raise MemoryError(f"{(limit - taken) // 2**20} MB of address space are left")


@cache
def _page() -> int:
    import resource

    return resource.getpagesize()


@cache
def take_buffers() -> None:
    """Let the linear algebra of NumPy and SciPy take its working memory, as it does at its first large product."""
    if address_space() is None:
        return
    import numpy as np
    import scipy.linalg as la

    square = np.eye(256)
    _ = square @ square, np.linalg.solve(square, square), la.cho_solve(la.cho_factor(square), square)
    _ = la.blas.dgemm(1.0, square, square)

"""How much memory there is, and refusing a job that needs more before it starts."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from fe_import.errors import Cause, FEImportError

_GROUPS = (  # limit, use, statistics and the entry there of what the system can take back
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current", "/sys/fs/cgroup/memory.stat", "inactive_file"),
    (
        "/sys/fs/cgroup/memory/memory.limit_in_bytes",
        "/sys/fs/cgroup/memory/memory.usage_in_bytes",
        "/sys/fs/cgroup/memory/memory.stat",
        "total_inactive_file",
    ),
)
SMALL = 100_000_000  # bytes; less is not worth asking the system for


def available_memory() -> int | None:
    """Bytes that this process can still get: of the machine, of its container, of its own limit; None if unknown."""
    found = [*_machine(), *_container(), *_own_limit()]
    return max(0, min(found)) if found else None


def refuse_too_large(needed: int, what: str) -> None:
    """Refuse a job that does not fit into memory.

    Raises
    ------
    FEImportError
        TOO_LARGE.
    """
    available = available_memory() if needed > SMALL else None
    if available is not None and needed > available:
        raise FEImportError(
            Cause.TOO_LARGE,
            f"the {what} needs more memory than there is",
            value=gigabytes(needed),
            limit=f"{gigabytes(available)} available",
            remedy="take a coarser mesh or fewer modes, end other programs, or use a machine with more memory",
        )


def gigabytes(size: float) -> str:
    """A size in bytes for people to read."""
    return f"{size / 1e9:.2g} GB"


def _number(path: str, name: str = "") -> int:
    """The number in a file of one, or in the line of that name."""
    text = Path(path).read_text(encoding="ascii")
    lines = [line.split() for line in text.splitlines()]
    return int(next(words[1] for words in lines if words[0].rstrip(":") == name) if name else lines[0][0])


_UNREADABLE = (OSError, ValueError, StopIteration, IndexError, AttributeError, ImportError)


def _machine() -> Iterator[int]:
    with contextlib.suppress(*_UNREADABLE):
        yield 1024 * _number("/proc/meminfo", "MemAvailable")
        return
    with contextlib.suppress(*_UNREADABLE):  # without /proc, what is free is unknown; three quarters of all is a guess
        yield os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") * 3 // 4


def _container() -> Iterator[int]:
    for limit, use, statistics, name in _GROUPS:
        with contextlib.suppress(*_UNREADABLE):
            yield _number(limit) - _number(use) + _number(statistics, name)


def _own_limit() -> Iterator[int]:
    with contextlib.suppress(*_UNREADABLE):
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            yield limit - _number("/proc/self/statm") * os.sysconf("SC_PAGE_SIZE")

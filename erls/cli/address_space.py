"""Limits of address space (``ulimit -v``), which libraries do not survive: they abort, or spin for ever."""

from __future__ import annotations

import os
from collections.abc import Sequence

from fe_import.compiled.address_space import address_space

LEAST = 3 * 2**28  # bytes; equations are compiled in 0.7 GB, and read from disk in 0.55 GB


def require_address_space(tokens: Sequence[str]) -> None:
    """Refuse a command that its libraries would not survive; with little room they get one thread, as each takes some.

    Raises
    ------
    SimulationError
        OUT_OF_MEMORY.
    """
    limit = address_space()
    if limit is None or not {"--help", "-h", "--version"}.isdisjoint(tokens):
        return
    if limit < 2**32:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if limit < LEAST:
        from erls.errors import Cause, SimulationError

        raise SimulationError(
            Cause.OUT_OF_MEMORY,
            "too little address space to load and compile equations",
            where="ulimit -v",
            value=f"{limit // 2**20} MB",
            limit=f"at least {LEAST // 2**20} MB",
            remedy="raise the limit, or remove it",
        )

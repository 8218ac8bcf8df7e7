"""The contract of a sparse solver.

Rules for adding one:

1. One file with a function ``(matrix, elimination, advance) -> Factor`` and one line in the registry of
   ``fe_import/solver/__init__.py``.
2. The matrix is symmetric, sparse CSC in canonical form with both triangles; it is not changed. ``elimination`` holds
   a fill-reducing order, to be used, and the counts that follow from it.
3. A matrix that is not positive definite to working precision, a pivot at most `SINGULAR` times its diagonal entry,
   raises `SingularMatrix`.
4. ``Solver.bytes_needed`` does not promise too little: a job is refused by it before it starts.
5. Packages that may be missing are imported inside the function.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import scipy.sparse as sp

from fe_import.model import Array
from fe_import.solver.elimination import Elimination

SINGULAR = 1e-13  # pivot per diagonal entry: rounding


class SingularMatrix(Exception):
    """The matrix is not positive definite to working precision."""


class Factor(Protocol):
    """A factorized matrix."""

    def solve(self, right: Array) -> Array:
        """Solutions for dense right-hand sides (n,) or (n, k)."""
        ...


@dataclass(frozen=True)
class Solver:
    """One way to factorize.

    Attributes
    ----------
    name : str
        In files and messages.
    factorize : callable
        ``(matrix, elimination, advance) -> Factor``; ``advance(done)`` may be told the operations that are done.
    bytes_needed : callable
        ``(elimination) -> int``: memory of the factorization at its largest.
    package : str
        What must be installed, as pip knows it; empty for what the base installation has.
    """

    name: str
    factorize: Callable[[sp.csc_array, Elimination, Callable[[float], None]], Factor]
    bytes_needed: Callable[[Elimination], int]
    package: str = ""

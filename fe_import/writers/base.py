"""The contract of a writer of matrices.

Rules for adding a format:

1. One file with a `MatrixFormat` and one line in the registry of ``fe_import/writers/__init__.py``.
2. ``write(link, folder, stem)`` writes into a folder that is empty but for what it wrote itself; file names begin with
   ``stem``. It returns the files by their role in a link description, and the options that this needs, so that the
   files can be read again; a format that is not read here returns roles that no description knows.
3. Numbers carry all digits that the format has; SI.
4. Text files begin with a line that says who wrote them, where the format has comments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_import.model import Array, IntArray

MODAL = -1  # component of a row that is a modal coordinate
MARK = "written by erls"


@dataclass(frozen=True)
class WrittenLink:
    """A link as other programs take it, SI.

    Attributes
    ----------
    name : str
    mass, stiffness : (d, d) sparse CSC
        Both triangles.
    labels : (n,) int array
        Numbers of the nodes, from 1.
    positions : (n, 3) array
        [m], mesh frame.
    node, component : (d,) int arrays
        Of each row: index of its node and 0 ... 5 (ux uy uz rx ry rz); of modal coordinates their number from 0, and
        `MODAL`. Rows are ordered by node, then component, modal coordinates last.
    interfaces : dict of int
        Name -> index of its node.
    """

    name: str
    mass: sp.csc_array
    stiffness: sp.csc_array
    labels: IntArray
    positions: Array
    node: IntArray
    component: IntArray
    interfaces: dict[str, int]

    @property
    def modal(self) -> int:
        """Number of modal coordinates."""
        return int((self.component == MODAL).sum())

    def points(self) -> IntArray:
        """(d, 2) number and component 1 ... 6 of each row; modal coordinates have numbers of their own, component 0."""
        first = int(self.labels.max(initial=0)) + 1
        modal = self.component == MODAL
        number = np.where(modal, first + self.node, self.labels[np.where(modal, 0, self.node)])
        return np.stack([number, np.where(modal, 0, self.component + 1)], axis=1)


def lower_columns(matrix: sp.csc_array) -> Iterator[tuple[int, IntArray, Array]]:
    """Each column that holds something from its diagonal on: its number, rows, values."""
    lower = sp.csc_array(sp.tril(matrix))
    lower.sort_indices()
    for column in range(lower.shape[1]):
        begin, end = lower.indptr[column], lower.indptr[column + 1]
        if end > begin:
            yield column, lower.indices[begin:end].astype(np.int64), lower.data[begin:end]


@dataclass(frozen=True)
class Written:
    """Files of a link by role, and what a link description says besides to read them; ``readable``: whether one can."""

    files: dict[str, str]
    options: dict[str, Any]
    readable: bool = True


@dataclass(frozen=True)
class MatrixFormat:
    """One format.

    Attributes
    ----------
    suffix : str
        Of its main file, empty where another format has that, so that the format must be named.
    write : callable
        ``write(link, folder, stem) -> Written``.
    """

    suffix: str
    write: Callable[[WrittenLink, Path, str], Written]

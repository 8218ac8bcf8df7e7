"""Abaqus ``*SUBSTRUCTURE MATRIX OUTPUT``: a reduced link as ``*USER ELEMENT, LINEAR`` with its matrices.

Comment lines behind ``** ELEMENT NODES`` list the kept nodes; data lines list the dofs, the first those of the first
node, each further one those from the node at a given place on. Symmetric matrices stand as rows of the lower triangle,
unsymmetric ones (UNSYM) whole, column by column. CalculiX writes such files as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_import.errors import FEImportError
from fe_import.files.text import TextFile
from fe_import.model import Array, IntArray

_MOST_NODES = 100_000


@dataclass(frozen=True)
class Substructure:
    """Kept dofs (d, 2): node and dof; the matrices that the file holds, by kind (STIFFNESS, MASS ...)."""

    dofs: IntArray
    matrices: dict[str, sp.csc_array]


def is_substructure(path: Path) -> bool:
    """Whether a file begins like one, behind its comments."""
    with TextFile(path) as text:
        line = text.line()
        while line is not None and (not line.strip() or line.startswith("**")):
            line = text.line()
    return line is not None and _keyword(line)[0] == "USERELEMENT"


def read_substructure(path: Path) -> Substructure:
    """Read a file of ``*SUBSTRUCTURE MATRIX OUTPUT, OUTPUT FILE=USER DEFINED``.

    Raises
    ------
    FEImportError
        ``EXPORT``: not such a file, or another count of nodes, dofs or numbers than it states.
    """
    with TextFile(path) as text:
        return _Reader(text).read()


def _keyword(line: str) -> tuple[str, dict[str, str]]:
    """``*USER ELEMENT, NODES= 4, LINEAR`` -> ``USERELEMENT`` and its parameters."""
    name, *rest = line.lstrip("*").upper().replace(" ", "").split(",")
    return name if line.startswith("*") else "", dict((p.partition("=")[::2]) for p in rest if p)


class _Reader:
    def __init__(self, text: TextFile) -> None:
        self.text = text
        self.nodes: list[int] = []
        self.places: list[list[int]] = []
        self.numbers: dict[str, list[float]] = {}
        self.parameters: dict[str, str] = {}

    def read(self) -> Substructure:
        section, listing = "", False
        for line in self.text.lines():
            if line.startswith("**"):
                body = line.strip("* ").upper()
                if body == "ELEMENT NODES":
                    listing = True
                elif listing:
                    self.nodes += self.integers(body)
                continue
            listing = False
            if line.startswith("*"):
                name, parameters = _keyword(line)
                section = parameters.get("TYPE", "") if name == "MATRIX" else name
                if name == "USERELEMENT":
                    if self.parameters:
                        raise self.fault("a second element; give a file of one substructure")
                    self.parameters = parameters
                elif name == "MATRIX":
                    if section in self.numbers:
                        raise self.fault(f"a second matrix of type {section}")
                    self.numbers[section] = []
            elif section == "USERELEMENT" and line.strip():
                self.places.append(self.integers(line))
            elif section in self.numbers:
                self.numbers[section] += self.reals(line)
        return self.result()

    def fault(self, message: str, value: object = None, limit: object = None) -> FEImportError:
        remedy = "write it again with *SUBSTRUCTURE MATRIX OUTPUT, OUTPUT FILE=USER DEFINED; it may be cut off"
        return self.text.failure(message, line=self.text.number, value=value, limit=limit, remedy=remedy)

    def integers(self, line: str) -> list[int]:
        texts = [t.strip() for t in line.split(",") if t.strip()]
        if not all(t.isascii() and t.removeprefix("-").isdigit() and len(t) < 19 for t in texts):
            raise self.fault("whole numbers expected", line.strip()[:60])
        return [int(t) for t in texts]

    def reals(self, line: str) -> list[float]:
        try:
            values = [float(t) for t in line.upper().replace("D", "E").split(",") if t.strip()]
        except ValueError:
            raise self.fault("numbers expected", line.strip()[:60]) from None
        if not np.isfinite(values).all():
            raise self.fault("a number is not finite", line.strip()[:60])
        return values

    def result(self) -> Substructure:
        stated = self.parameters.get("NODES", "")
        if not self.nodes or stated != str(len(self.nodes)) or len(self.nodes) > _MOST_NODES:
            raise self.fault("the list of kept nodes has another length than stated", len(self.nodes), stated or "none")
        dofs = self.dofs()
        whole = "UNSYM" in self.parameters
        held = self.numbers.items()
        return Substructure(dofs, {kind: self.matrix(kind, np.array(v), len(dofs), whole) for kind, v in held})

    def dofs(self) -> IntArray:
        """Each line but the first names the place of the node that it begins to hold for."""
        starts: dict[int, list[int]] = {}
        for k, numbers in enumerate(self.places):
            place, held = (1, numbers) if k == 0 else (numbers[0], numbers[1:])
            if not held or place in starts or not 0 < place <= len(self.nodes):
                raise self.fault("a line of dofs that belongs to no node", numbers[:6])
            starts[place] = held
        if 1 not in starts:
            raise self.fault("no dofs are stated")
        rows, held = [], starts[1]
        for place, node in enumerate(self.nodes, start=1):
            held = starts.get(place, held)
            rows += [(node, dof) for dof in held]
        return np.array(rows, dtype=np.int64)

    def matrix(self, kind: str, values: Array, count: int, whole: bool) -> sp.csc_array:
        if len(values) == count * (count + 1) // 2:
            matrix = np.zeros((count, count))
            matrix[np.tril_indices(count)] = values
            matrix += np.tril(matrix, -1).T
        elif whole and len(values) == count**2:
            matrix = values.reshape(count, count).T
        else:
            expected = count**2 if whole else count * (count + 1) // 2
            message = f"the {kind.lower()} matrix of {count} dofs has another count of numbers"
            raise self.fault(message, len(values), expected)
        return sp.csc_array(matrix)

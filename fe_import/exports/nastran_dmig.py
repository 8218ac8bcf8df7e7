"""Nastran DMIG matrices of a punch file, with the grid points of the same or another file.

Symmetric ones (form 6) hold one of each pair of entries, square ones (form 1) all. Entries at a grid point name a
component 1 to 6, those at a scalar point component 0: a modal coordinate.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np
import scipy.sparse as sp

from fe_import.description.base import Vector
from fe_import.errors import Cause, FEImportError
from fe_import.exports.base import Export, ExportFormat
from fe_import.exports.entries import matrix_of_entries
from fe_import.exports.points import Points, points_of
from fe_import.exports.superelement import assembled, refuse_cut
from fe_import.files.text import TextFile
from fe_import.model import IntArray
from fe_import.nastran.cards import Card, read_cards
from fe_import.nastran.grid import CARDS, grid_points

_SQUARE, _SYMMETRIC = 1, 6
_FORMS = {2: "rectangular", 9: "rectangular"}
_LARGEST_POINT = 10**12  # Nastran's own limit is 10^8


class DmigOptions(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """What punched matrices of Nastran leave open.

    Attributes
    ----------
    stiffness, mass : str
        Names of the matrices.
    positions : dict of (3,) floats
        Of grid points by number [m], when no file holds them.
    """

    stiffness: str = "KAAX"
    mass: str = "MAAX"
    positions: dict[str, Vector] = {}


@dataclass
class _Dmig:
    """Entries of one matrix as they stand: codes 8 · point + component of rows and columns, and their cards."""

    name: str
    form: int
    count: int
    where: str
    rows: list[int] = field(default_factory=list)
    columns: list[int] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    places: list[str] = field(default_factory=list)


def read_dmig(files: Mapping[str, Path], options: DmigOptions, where: str) -> Export:
    """Read the two matrices and the grid points. See `ExportFormat.read`."""
    wanted = {role: getattr(options, role).upper() for role in ("stiffness", "mass")}
    matrices: dict[str, _Dmig] = {}
    cards: list[Card] = []
    for path in dict.fromkeys([files["stiffness"], files.get("mass", files["stiffness"])]):
        _read_file(path, frozenset(wanted.values()), matrices, cards)
    for role, name in wanted.items():
        if name not in matrices:
            raise FEImportError(
                Cause.EXPORT,
                f"no DMIG matrix {name} for the {role}",
                where=str(files.get(role, files["stiffness"])),
                remedy=f"set matrices.options.{role} to the name of the matrix in the file",
            )
    given = bool(options.positions) or bool({"nodes", "mesh"} & set(files))
    points = nastran_points(files, options.positions, where) if given else _points(cards)
    return _export(matrices[wanted["stiffness"]], matrices[wanted["mass"]], points)


def nastran_points(files: Mapping[str, Path], positions: dict[str, Vector], where: str) -> Points:
    """Grid points of the description, of file ``nodes``, or of file ``mesh`` (bulk data)."""
    return points_of(files, positions, where, _bulk_points)


def _bulk_points(path: Path) -> Points:
    with TextFile(path) as text:
        return _points(read_cards(text.lines(), CARDS, text.where))


def _points(cards: Iterable[Card]) -> Points:
    found = grid_points(cards)
    return Points(found.positions, found.axes, lines=found.lines)


def _read_file(path: Path, names: frozenset[str], matrices: dict[str, _Dmig], others: list[Card]) -> None:
    with TextFile(path) as text:
        for card in read_cards(text.lines(), CARDS | {"DMIG"}, text.where):
            if card.name != "DMIG":
                others.append(card)
                continue
            name = card.field(1).upper()
            if name not in names:
                continue
            if card.field(2) == "0":
                if name in matrices:
                    raise card.fault(f"matrix {name} has two headers")
                matrices[name] = _header(card, name)
            elif name not in matrices:
                raise card.fault(f"matrix {name} has no header before its first column")
            else:
                _add_column(card, matrices[name])


def _header(card: Card, name: str) -> _Dmig:
    form, kind = card.integer(3), card.integer(4)
    if form not in (_SQUARE, _SYMMETRIC) or kind not in (1, 2):
        found = "complex numbers" if form in (_SQUARE, _SYMMETRIC) else f"form {form} ({_FORMS.get(form, 'unknown')})"
        remedy = "export real matrices of form 6 (symmetric) or 1 (square)"
        raise card.fault(f"matrix {name} has {found}", remedy=remedy)
    return _Dmig(name, form, card.integer(8, 0), card.where)


def _add_column(card: Card, matrix: _Dmig) -> None:
    column = _code(card, 2, 3)
    for at in range(5, len(card.fields) + 1, 4):
        if not any(card.field(at + k) for k in range(4)):
            continue
        if card.field(at + 3):
            raise card.fault(f"matrix {matrix.name} is real, but an entry has an imaginary part", card.field(at + 3))
        matrix.rows.append(_code(card, at, at + 1))
        matrix.columns.append(column)
        matrix.values.append(card.real(at + 2))
        matrix.places.append(card.where)


def _code(card: Card, point: int, component: int) -> int:
    number, part = card.integer(point), card.integer(component, 0)
    if not 0 < number < _LARGEST_POINT:
        raise card.fault("the number of a point is out of range", number)
    if not 0 <= part <= 6:
        raise card.fault(f"point {number} has a component out of range", part, "0 for scalar points, 1 to 6 for grids")
    return 8 * number + part


def _export(stiffness: _Dmig, mass: _Dmig, points: Points) -> Export:
    codes = np.unique(np.array([*stiffness.rows, *stiffness.columns, *mass.rows, *mass.columns], dtype=np.int64))
    for matrix in (stiffness, mass):
        if matrix.count and matrix.count != len(codes):
            raise FEImportError(
                Cause.EXPORT,
                f"the header of {matrix.name} states another number of columns than the entries have",
                where=matrix.where,
                value=matrix.count,
                limit=len(codes),
                remedy="export again; the file may be cut off",
            )
    rows = np.stack([codes // 8, codes % 8], axis=1)
    for point, component in rows:
        if component == 0 and int(point) in points.positions:
            raise FEImportError(
                Cause.EXPORT,
                f"grid point {point} has component 0, as only scalar points have",
                where=stiffness.where,
                remedy="export displacements and rotations of grid points",
            )
    where = stiffness.where.rpartition(": line ")[0]
    notes = {"program": "Nastran, DMIG", "matrices": f"{stiffness.name}, {mass.name}"}
    inertia = _matrix(mass, codes)
    refuse_cut(inertia, rows, mass.where.rpartition(": line ")[0])
    return assembled(inertia, _matrix(stiffness, codes), rows, points, where, notes)


def _matrix(entries: _Dmig, codes: IntArray) -> sp.csc_array:
    rows, columns = (np.searchsorted(codes, np.array(k, dtype=np.int64)) for k in (entries.rows, entries.columns))
    values, places = np.array(entries.values), entries.places
    return matrix_of_entries(rows, columns, values, len(codes), places.__getitem__, triangle=entries.form == _SYMMETRIC)


NASTRAN_DMIG = ExportFormat(
    required=("stiffness",), optional=("mass", "mesh", "nodes", "sets"), options=DmigOptions, read=read_dmig
)

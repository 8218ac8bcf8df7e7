"""Nodes by the number that their program gave them, from wherever a link description says; and the rows of matrices."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fe_import.description.base import Vector
from fe_import.errors import Cause, FEImportError
from fe_import.exports.row_files import read_dofs, read_place
from fe_import.model import Array, IntArray

MODAL = 0  # component of a row that is a modal coordinate


@dataclass(frozen=True)
class Points:
    """Nodes by their number in the program: positions, axes of their displacement frames, sets, lines, triangles."""

    positions: Mapping[int, Array]
    axes: Mapping[int, Array] = field(default_factory=dict)
    sets: Mapping[str, Iterable[int]] = field(default_factory=dict)
    lines: Iterable[tuple[int, int]] = ()
    triangles: Iterable[tuple[int, int, int]] = ()


def points_of(
    files: Mapping[str, Path], positions: Mapping[str, Vector], where: str, mesh: Callable[[Path], Points]
) -> Points:
    """Nodes from what the link description gives: ``positions``, file ``nodes`` (with ``sets``), or file ``mesh``.

    Parameters
    ----------
    files : mapping of Path
        By role.
    positions : mapping
        By number, as text.
    where : str
        Name of the link description.
    mesh : callable
        Reads the file ``mesh``.

    Raises
    ------
    FEImportError
        ``BAD_FIELD``: more than one of them, or sets without nodes; and what the readers find.
    """
    given = [name for name in ("nodes", "mesh") if name in files] + ["positions"] * bool(positions)
    if len(given) > 1 or ("sets" in files and "nodes" not in files):
        raise FEImportError(
            Cause.BAD_FIELD,
            "positions of nodes from more than one place" if len(given) > 1 else "file 'sets' goes with file 'nodes'",
            where=f"{where}: matrices.files",
            value=" and ".join(given) or None,
            remedy="give one of the files 'nodes' (with 'sets') and 'mesh', or matrices.options.positions",
        )
    if "mesh" in files:
        return mesh(files["mesh"])
    if "nodes" not in files:
        return stated_points(positions, where)
    place = read_place({role: files[role] for role in ("nodes", "sets") if role in files}, where)
    labels = place.labels.tolist()
    return Points(
        positions=dict(zip(labels, place.nodes, strict=True)),
        axes={} if place.orientations is None else dict(zip(labels, place.orientations, strict=True)),
        sets={name: place.labels[members].tolist() for name, members in place.node_sets.items()},
    )


def rows_of(path: Path) -> IntArray:
    """Rows as `assembled` wants them, from a file ``dofs``."""
    nodes, components = read_dofs(path)
    rows = np.stack([nodes, components + 1], axis=1)  # modal: -1 there, 0 here
    modal = np.flatnonzero(rows[:, 1] == MODAL)
    rows[modal, 0] = 1 + modal
    return rows


def stated_points(positions: Mapping[str, Vector], where: str) -> Points:
    """Nodes whose positions the link description states, by their number.

    Raises
    ------
    FEImportError
        ``BAD_FIELD``: a number that is none, or a position that is not finite.
    """
    result = {}
    for text, position in positions.items():
        place = np.array(position, dtype=float)
        if not (text.isascii() and text.isdigit() and len(text) < 19) or not np.isfinite(place).all():
            raise FEImportError(
                Cause.BAD_FIELD,
                "a position needs the number of its node and three finite coordinates",
                where=f"{where}: matrices.options.positions",
                value=f"{text} = {list(position)}",
                remedy='write "12" = [0.5, 0.0, 0.0]',
            )
        result[int(text)] = place
    return Points(result)

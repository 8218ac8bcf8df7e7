"""Frames condensed to some of their nodes, and the files that Nastran and Abaqus would write of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg as la
from link_files import FRAME, merged, write_toml
from numpy.typing import NDArray

from fe_import.description.link import LinkFile, load_link
from fe_import.model import FEModel
from fe_import.models.model import build_model

Array = NDArray[np.float64]
Table = dict[str, Any]
MODAL_POINT = 900_000


@dataclass(frozen=True)
class Reduced:
    """Mass and stiffness of kept nodes (six dofs each, numbers 11, 21, ...) and modal coordinates behind them."""

    mass: Array
    stiffness: Array
    positions: Array

    @property
    def labels(self) -> list[int]:
        """Numbers of the kept nodes."""
        return [10 * k + 11 for k in range(len(self.positions))]

    @property
    def rows(self) -> list[tuple[int, int]]:
        """Point and component of each row; scalar points for modal coordinates."""
        modal = len(self.mass) - 6 * len(self.labels)
        nodal = [(label, component) for label in self.labels for component in range(1, 7)]
        return nodal + [(MODAL_POINT + k, 0) for k in range(1, modal + 1)]


def frame_model(folder: Path, **changes: Any) -> FEModel:
    """The frame of `link_files`, 7 nodes."""
    return build_model(frame_description(folder, **changes))


def frame_description(folder: Path, **changes: Any) -> LinkFile:
    """Its link description."""
    return load_link(write_toml(folder / "frame.toml", merged(FRAME, changes)))


def condensed(model: FEModel, kept: Sequence[int], modes: int = 0) -> Reduced:
    """Static condensation to the kept nodes (exact when none is left out), and modes with these clamped."""
    mass, stiffness = model.mass.toarray(), model.stiffness.toarray()
    outer = np.concatenate([model.dof_map[k] for k in kept])
    inner = np.setdiff1d(np.arange(len(mass)), outer)
    basis = np.zeros((len(mass), len(outer) + modes))
    basis[outer, np.arange(len(outer))] = 1.0
    k_ii, m_ii = stiffness[np.ix_(inner, inner)], mass[np.ix_(inner, inner)]
    if len(inner):
        basis[inner, : len(outer)] = -la.solve(k_ii, stiffness[np.ix_(inner, outer)], assume_a="pos")
    if modes:
        basis[inner, len(outer) :] = la.eigh(k_ii, m_ii, subset_by_index=(0, modes - 1))[1]
    full = (basis.T @ m @ basis for m in (mass, stiffness))
    return Reduced(*((m + m.T) / 2 for m in full), model.nodes[list(kept)])


def grid_cards(reduced: Reduced, extra: str = "") -> str:
    """GRID cards in free format; ``extra`` is the displacement frame."""
    lines = [
        f"GRID,{label},," + ",".join(repr(float(x)) for x in place) + f",{extra}"
        for label, place in zip(reduced.labels, reduced.positions, strict=True)
    ]
    return "\n".join(lines) + "\n"


def dmig(name: str, matrix: Array, rows: Sequence[tuple[int, int]], form: int = 6) -> str:
    """A DMIG matrix in free format, all digits."""
    lines = [f"DMIG,{name},0,{form},2,0,,,{len(rows) if form == 9 else ''}"]
    for j, column in enumerate(rows):
        found = [i for i in range(j if form == 6 else 0, len(rows)) if matrix[i, j]]
        if found:
            lines.append(f"DMIG*,{name},{column[0]},{column[1]},")
            lines += [f"*,{rows[i][0]},{rows[i][1]},{float(matrix[i, j])!r}".replace("e", "D") for i in found]
    return "\n".join(lines) + "\n"


def punch(reduced: Reduced) -> str:
    """A punch file with grid points and both matrices."""
    matrices = (("KAAX", reduced.stiffness), ("MAAX", reduced.mass))
    return grid_cards(reduced) + "".join(dmig(name, m, reduced.rows) for name, m in matrices)


def matrix_input(matrix: Array, rows: Sequence[tuple[int, int]], triangle: str = "lower") -> str:
    """Abaqus FORMAT=MATRIX INPUT: ``node,dof, node,dof, value``."""
    lines = ["** Assembled nodal matrix"]
    for j, (node, dof) in enumerate(rows):
        found = {"lower": range(j, len(rows)), "upper": range(j + 1), "both": range(len(rows))}[triangle]
        lines += [f"{rows[i][0]},{rows[i][1]}, {node},{dof}, {float(matrix[i, j])!r}" for i in found if matrix[i, j]]
    return "\n".join(lines) + "\n"


def coordinate(matrix: Array) -> str:
    """Abaqus FORMAT=COORDINATE: ``row, column, value``, both triangles."""
    places = zip(*np.nonzero(matrix), strict=True)
    return "".join(f"{i + 1} {j + 1} {float(matrix[i, j])!r}\n" for i, j in places)


def substructure(reduced: Reduced, whole: bool = False) -> str:
    """Abaqus *SUBSTRUCTURE MATRIX OUTPUT; modal coordinates at one more node with dofs 1, 2, ..."""
    modal = len(reduced.mass) - 6 * len(reduced.labels)
    nodes = reduced.labels + [MODAL_POINT] * bool(modal)
    lines = [
        "**",
        "** GENERATION OF SUBSTRUCTURE Z1",
        f"*USER ELEMENT, NODES= {len(nodes)}, LINEAR" + ", UNSYM" * whole,
    ]
    lines.append("** ELEMENT NODES")
    lines += [
        "** " + ", ".join(map(str, nodes[k : k + 10])) + ", " * (k + 10 < len(nodes)) for k in range(0, len(nodes), 10)
    ]
    lines.append("1, 2, 3, 4, 5, 6")
    if modal:
        lines.append(", ".join(map(str, [len(nodes), *range(1, modal + 1)])))
    for kind, matrix in (("STIFFNESS", reduced.stiffness), ("MASS", reduced.mass)):
        lines.append(f"*MATRIX,TYPE={kind}")
        for k in range(len(matrix)):
            row = list(map(repr, map(float, matrix[k] if whole else matrix[k, : k + 1])))
            lines += [", ".join(row[at : at + 4]) + " ," for at in range(0, len(row), 4)]
    return "\n".join(lines) + "\n"


def deck(reduced: Reduced) -> str:
    """Nodes of an Abaqus deck, two sets."""
    lines = ["*NODE"]
    lines += [
        f"{n}, " + ", ".join(map(repr, p.tolist())) for n, p in zip(reduced.labels, reduced.positions, strict=True)
    ]
    return "\n".join([*lines, "*NSET, NSET=ENDS", f"{reduced.labels[0]}, {reduced.labels[-1]}", "*END STEP"]) + "\n"


def description(folder: Path, kind: str, files: dict[str, str], reduced: Reduced, **changes: Any) -> LinkFile:
    """A link of exported files in the folder, its interfaces on the first and the last node."""
    base: Table = {
        "matrices": {"format": kind, "files": files},
        "interfaces": [
            {"name": "hub", "node": str(reduced.labels[0])},
            {"name": "hand", "node": str(reduced.labels[-1])},
        ],
        "reduction": {"method": "none"},
    }
    return load_link(write_toml(folder / "link.toml", merged(base, changes)))

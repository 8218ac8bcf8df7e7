"""Meshes of shells over the unit square, their matrices without a link around them, and files of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from fe_import.elements.laminates import Lamina, Laminate, plane_stress
from fe_import.elements.shell import ShellBlock, element_matrices
from fe_import.elements.shell_elements import SHELL_ELEMENTS

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class ShellGrid:
    """Nodes (n, 3), elements (m, k) of one type, and the numbers of the nodes over the square (nx + 1, ny + 1)."""

    nodes: Array
    elements: IntArray
    kind: str
    at: IntArray

    def matrices(self, make: Laminate, drilling: float = 0.01) -> tuple[sp.csc_array, sp.csc_array]:
        """Mass and stiffness, row 6 * node + component."""
        count = len(self.elements)
        whole = np.tile(make.stiffness(), (count, 1, 1)), np.tile(make.moments(), (count, 1))
        block = ShellBlock(SHELL_ELEMENTS[self.kind], self.elements, *whole)
        mass, stiffness, _ = element_matrices(block, self.nodes[self.elements], drilling)
        rows = (6 * self.elements[:, :, None] + np.arange(6)).reshape(count, -1)
        places = np.repeat(rows, rows.shape[1], axis=1).ravel(), np.tile(rows, (1, rows.shape[1])).ravel()
        size = 6 * len(self.nodes)
        both = (sp.coo_array((m.ravel(), places), shape=(size, size)).tocsc() for m in (mass, stiffness))
        return next(both), next(both)


def shell_grid(nx: int, ny: int, place: Callable[[float, float], tuple[float, float, float]], kind: str) -> ShellGrid:
    """nx by ny quadrangles, or twice as many triangles."""
    x, y = np.meshgrid(np.linspace(0, 1, nx + 1), np.linspace(0, 1, ny + 1), indexing="ij")
    nodes = np.array([place(a, b) for a, b in zip(x.ravel(), y.ravel(), strict=True)])
    at = np.arange(len(nodes)).reshape(nx + 1, ny + 1)
    cells = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    if kind == "tri3":
        cells = np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])
    return ShellGrid(nodes, cells, kind, at)


def plate(youngs: float, ratio: float, thickness: float, density: float = 1.0, offset: float = 0.0) -> Laminate:
    """One isotropic layer."""
    shear = youngs / (2 * (1 + ratio))
    layer = Lamina(plane_stress(youngs, youngs, ratio, shear), np.full(2, shear), density, thickness)
    return Laminate((layer,), offset)


def dofs(nodes: IntArray, components: Iterable[int] = range(6)) -> IntArray:
    """Rows of components of nodes."""
    return np.asarray((6 * np.ravel(nodes)[:, None] + np.array(list(components))).ravel(), dtype=np.int64)


def held(stiffness: sp.csc_array, force: Array, fixed: IntArray) -> Array:
    """Displacements where some rows are at rest."""
    free = np.setdiff1d(np.arange(len(force)), fixed)
    moved = np.zeros(len(force))
    moved[free] = sla.spsolve(stiffness[free][:, free], force[free])
    return moved


def write_deck(path: Path, grid: ShellGrid, ends: bool = True, **sets: IntArray) -> Path:
    """An Abaqus deck with sets PLATE, ROOT (the first nodes along x) and TIP, or others in place of these two."""
    lines = ["*NODE", *(f"{k + 1}, {x:.12g}, {y:.12g}, {z:.12g}" for k, (x, y, z) in enumerate(grid.nodes.tolist()))]
    lines.append(f"*ELEMENT, TYPE={'S4' if grid.kind == 'quad4' else 'S3'}, ELSET=PLATE")
    lines += [", ".join(map(str, [k + 1, *(np.array(row) + 1)])) for k, row in enumerate(grid.elements.tolist())]
    if ends and not sets:
        sets = {"ROOT": grid.at[0], "TIP": grid.at[-1]}
    for name, row in sets.items():
        lines += [f"*NSET, NSET={name}", *(f"{node + 1}," for node in row)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path

"""Matrices of clamped boxes for tests of solvers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.sparse as sp
from solid_meshes import box

from fe_import.elements.solid import SolidMaterial, assemble_solid

STEEL = SolidMaterial(2.1e11, 0.3, 7850.0)


@dataclass(frozen=True)
class Clamped:
    """Matrices of a box clamped at x = 0, and where its dofs sit."""

    stiffness: sp.csc_array
    mass: sp.csc_array
    positions: np.ndarray


MESHES = {
    "cube of hex20": ("hex20", (6, 6, 6), (1.0, 1.0, 1.0)),
    "beam of tet10": ("tet10", (20, 2, 2), (1.0, 0.1, 0.1)),
    "plate of hex8": ("hex8", (24, 24, 2), (1.0, 1.0, 0.05)),
}


@cache
def clamped(element: str, divisions: tuple[int, int, int], size: tuple[float, float, float]) -> Clamped:
    mesh = box(element, divisions, size)
    mass, stiffness = assemble_solid(mesh, [STEEL])
    free = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.node_sets["x0"])
    dofs = (3 * free[:, None] + np.arange(3)).ravel()
    return Clamped(
        stiffness[dofs][:, dofs].tocsc(), mass[dofs][:, dofs].tocsc(), np.repeat(mesh.nodes[free], 3, axis=0)
    )


def silent(done: float) -> None:
    pass

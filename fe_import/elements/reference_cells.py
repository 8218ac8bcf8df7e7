"""Reference cells of solid elements: corners, edges, faces, quadrature. The one table of faces of this package.

Corners are in VTK's order, which is meshio's and that of Abaqus. Faces are anticlockwise seen from outside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.special

from fe_import.model import Array

Tuples = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Cell:
    """One shape.

    Attributes
    ----------
    name : str
    corners : tuple
        Coordinates.
    edges, faces : tuple of tuples
        Corners of each.
    deck_faces : tuple of int
        Which of the faces is S1, S2 ... in decks of Abaqus and CalculiX.
    mirrored : tuple of int
        Corners in the order of a program that numbers elements inside out (MED).
    collapsed : tuple of int
        Powers of the weights (1 - t) of the quadrature along its three directions, see `quadrature`.
    """

    name: str
    corners: Tuples
    edges: Tuples
    faces: Tuples
    deck_faces: tuple[int, ...]
    mirrored: tuple[int, ...]
    collapsed: tuple[int, int, int]

    def quadrature(self, order: int) -> tuple[Array, Array]:
        """Points (3, q) and positive weights (q,) of a rule that is exact to ``order``.

        Gauss-Legendre products on the cube; the others are cubes of which sides are collapsed, with Gauss-Jacobi
        points there (A. H. Stroud, Approximate Calculation of Multiple Integrals, 1971), because scikit-fem 12's
        tabulated rules have negative weights at orders 3 and 4 and miss their stated order from 5 on. Rational
        functions of pyramids are polynomials on the cube.
        """
        n = order // 2 + 1
        rules = [scipy.special.roots_jacobi(n, power, 0) for power in self.collapsed]
        # roots_jacobi integrates (1 - t)^power over [-1, 1]; here over [0, 1]
        points = [(t + 1) / 2 for t, _ in rules]
        weights = [w / w.sum() for _, w in rules]
        x, y, z = (g.ravel() for g in np.meshgrid(*points, indexing="ij"))
        w = np.einsum("i,j,k->ijk", *weights).ravel()
        if self is TETRAHEDRON:
            return np.stack([x, (1 - x) * y, (1 - x) * (1 - y) * z]), w / 6
        if self is WEDGE:
            return np.stack([x, (1 - x) * y, z]), w / 2
        if self is PYRAMID:
            return np.stack([(1 - z) * (2 * x - 1), (1 - z) * (2 * y - 1), z]), w * 4 / 3
        return np.stack([x, y, z]), w


TETRAHEDRON = Cell(
    "tetrahedron",
    corners=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    edges=((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)),
    faces=((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    deck_faces=(0, 1, 2, 3),
    mirrored=(0, 2, 1, 3),
    collapsed=(2, 1, 0),
)
PYRAMID = Cell(
    "pyramid",
    corners=((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 1)),
    edges=((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
    faces=((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    deck_faces=(0, 1, 2, 3, 4),
    mirrored=(0, 3, 2, 1, 4),
    collapsed=(0, 0, 2),
)
WEDGE = Cell(
    "wedge",
    corners=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)),
    edges=((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    faces=((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    deck_faces=(0, 1, 2, 3, 4),
    mirrored=(0, 2, 1, 3, 5, 4),
    collapsed=(1, 0, 0),
)
HEXAHEDRON = Cell(
    "hexahedron",
    corners=((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
    edges=(
        *((0, 1), (1, 2), (2, 3), (3, 0)),
        *((4, 5), (5, 6), (6, 7), (7, 4)),
        *((0, 4), (1, 5), (2, 6), (3, 7)),
    ),
    faces=((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
    deck_faces=(4, 5, 2, 1, 3, 0),
    mirrored=(0, 3, 2, 1, 4, 7, 6, 5),
    collapsed=(0, 0, 0),
)

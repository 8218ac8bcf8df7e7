"""Shape functions of the wedge of 15 and the pyramids of 5 and 13 nodes, which scikit-fem lacks.

A space is spanned by x^a y^b w^c with w = 1 - z; the shape functions are those of its members that are 1 at one node
and 0 at the others. On pyramids with base [-1, 1]² and apex (0, 0, 1) the powers of w may be negative: x y / w and its
products with x and y are polynomials on each face, so that pyramids fit their neighbours (G. Bedrosian, Int. J. Numer.
Methods Eng. 35 (1992) 95-108).
"""

from __future__ import annotations

import numpy as np

from fe_import.model import Array, IntArray

Powers = tuple[tuple[int, int, int], ...]

_PLANE = ((0, 0), (1, 0), (0, 1))
_PLANE_2 = (*_PLANE, (2, 0), (1, 1), (0, 2))
WEDGE_15: Powers = (
    *((a, b, c) for a, b in _PLANE_2 for c in (0, 1)),
    *((a, b, 2) for a, b in _PLANE),
)
PYRAMID_5: Powers = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, -1))
PYRAMID_13: Powers = (
    *((a, b, c) for a in range(3) for b in range(3 - a) for c in range(3 - a - b)),
    *((1, 1, -1), (2, 1, -1), (1, 2, -1)),
)
_APEX = 1e-100  # nearest w: there x = y = 0, and terms over powers of w vanish


def nodal_coefficients(powers: Powers, nodes: Array) -> Array:
    """(k, k) columns: the shape function of each node (k, 3) in terms of the space."""
    return np.asarray(np.linalg.inv(_terms(np.array(powers), nodes.T).T))


def values(powers: Powers, coefficients: Array, points: Array) -> Array:
    """(k, q) shape functions at points (3, q)."""
    return np.asarray(coefficients.T @ _terms(np.array(powers), points))


def gradients(powers: Powers, coefficients: Array, points: Array) -> Array:
    """(k, 3, q) their derivatives by x, y, z."""
    exponents = np.array(powers)
    slopes = []
    for axis, sign in enumerate((1.0, 1.0, -1.0)):
        lowered = exponents - np.eye(3, dtype=np.int64)[axis]
        factor = sign * exponents[:, axis]
        lowered[factor == 0] = 0
        slopes.append(coefficients.T @ (factor[:, None] * _terms(lowered, points)))
    return np.stack(slopes, axis=1)


def _terms(exponents: IntArray, points: Array) -> Array:
    """(k, q) x^a y^b w^c."""
    x, y, z = points
    bases = np.stack([x, y, np.maximum(1 - z, _APEX)])
    return np.asarray(np.prod(bases[None] ** exponents[:, :, None].astype(float), axis=1))

"""The fields of first-order strains along the elements of a frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_import.elements.frame import bending_shapes
from fe_import.model import Array, BeamLines

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
POINTS, WEIGHTS = (_POINTS + 1) / 2, _WEIGHTS / 2
"""Five Gauss points of an element: rates of the second-order field are of degree 4, its moments of degree 6."""
# integrals from 0 to each point, and to 1, of the polynomial through values at the points
_POWERS = np.arange(5)
_FIT = np.linalg.inv(POINTS[:, None] ** _POWERS)
INTEGRALS = (np.append(POINTS, 1.0)[:, None] ** (_POWERS + 1) / (_POWERS + 1)) @ _FIT


@dataclass(frozen=True)
class LineFields:
    """First-order fields at the points of an element, mesh axes, in its own direction.

    ``displacement`` and ``rotation`` (5, 3, m); their sources, ``curvature`` (5, 3, m) = dθ/ds and ``strain``
    (5, 3, m) = du/ds - θ × t, stretch and shear; ``tangent`` (3,).
    """

    displacement: Array
    rotation: Array
    curvature: Array
    strain: Array
    tangent: Array


def line_fields(beams: BeamLines, element: int, ends: Array) -> LineFields:
    """Fields of one element from its nodal components (12, m) in the mesh frame: displacement and rotation of its first
    node, then of its second.
    """
    axes, length, count = beams.axes[element], float(beams.lengths[element]), ends.shape[1]
    local = np.einsum("ij,kjm->kim", axes, ends.reshape(4, 3, count))
    u, theta, curvature, strain = np.zeros((4, len(POINTS), 3, count))
    for fields, first, second in ((u, local[0, 0], local[2, 0]), (theta, local[1, 0], local[3, 0])):
        fields[:, 0] = np.outer(1 - POINTS, first) + np.outer(POINTS, second)
    strain[:, 0] = (local[2, 0] - local[0, 0]) / length
    curvature[:, 0] = (local[3, 0] - local[1, 0]) / length
    for phi, across, about, sign in ((beams.shear[element, 0], 1, 2, 1.0), (beams.shear[element, 1], 2, 1, -1.0)):
        nodal = np.stack([local[0, across], sign * local[1, about], local[2, across], sign * local[3, about]])
        deflection, slope = bending_shapes(POINTS, length, phi)
        bend, drop = _slopes(POINTS, length, phi)
        u[:, across], turn = deflection @ nodal, slope @ nodal
        theta[:, about], curvature[:, about] = sign * turn, sign * (bend @ nodal)
        strain[:, across] = drop @ nodal - turn
    back = axes.T
    turned = [np.asarray(np.einsum("ij,pjm->pim", back, f)) for f in (u, theta, curvature, strain)]
    return LineFields(turned[0], turned[1], turned[2], turned[3], axes[0])


def _slopes(xi: Array, length: float, phi: float) -> tuple[Array, Array]:
    """Derivatives along the element of rotation and deflection of `bending_shapes`, each (points, 4)."""
    one, x2 = np.ones_like(xi), xi**2
    bend = np.stack(
        [6 / length * (2 * xi - 1), -4 + 6 * xi - phi, 6 / length * (1 - 2 * xi), 6 * xi - 2 + phi], axis=-1
    )
    bubble = phi / 2 * (1 - 2 * xi)
    drop = np.stack(
        [
            -6 * xi + 6 * x2 - phi,
            length * (one - 4 * xi + 3 * x2 + bubble),
            6 * xi - 6 * x2 + phi,
            length * (3 * x2 - 2 * xi - bubble),
        ],
        axis=-1,
    )
    return bend / ((1 + phi) * length), drop / ((1 + phi) * length)

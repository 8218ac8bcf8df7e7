"""The fields of first-order strains along the elements of a frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_import.elements.frame import bending_shapes
from fe_import.model import Array, BeamLines, IntArray

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
POINTS, WEIGHTS = (_POINTS + 1) / 2, _WEIGHTS / 2
"""Five Gauss points of an element: rates of the second-order field are of degree 4, its moments of degree 6."""
# integrals from 0 to each point, and to 1, of the polynomial through values at the points
_POWERS = np.arange(5)
_FIT = np.linalg.inv(POINTS[:, None] ** _POWERS)
INTEGRALS = (np.append(POINTS, 1.0)[:, None] ** (_POWERS + 1) / (_POWERS + 1)) @ _FIT


@dataclass(frozen=True)
class LineFields:
    """First-order fields at the points of elements, mesh axes, in their own directions.

    ``displacement`` and ``rotation`` (..., 5, 3, m); their sources, ``curvature`` (..., 5, 3, m) = dθ/ds and ``strain``
    (..., 5, 3, m) = du/ds - θ × t, stretch and shear; ``tangent`` (..., 3).
    """

    displacement: Array
    rotation: Array
    curvature: Array
    strain: Array
    tangent: Array


def line_fields(beams: BeamLines, elements: int | IntArray, ends: Array) -> LineFields:
    """Fields of an element, or of elements (...), from nodal components (..., 12, m) in the mesh frame: displacement
    and rotation of the first node, then of the second.
    """
    axes, length = beams.axes[elements], np.asarray(beams.lengths[elements])[..., None]
    *several, _, count = ends.shape
    local = axes[..., None, :, :] @ ends.reshape(*several, 4, 3, count)
    u, theta, curvature, strain = np.zeros((4, *several, len(POINTS), 3, count))
    ways = np.stack([1 - POINTS, POINTS], axis=1)
    for fields, rates, k in ((u, strain, 0), (theta, curvature, 1)):
        along = local[..., k::2, 0, :]  # of the first node, and of the second
        fields[..., 0, :] = ways @ along
        rates[..., 0, :] = ((along[..., 1, :] - along[..., 0, :]) / length)[..., None, :]
    for plane, across, about, sign in ((0, 1, 2, 1.0), (1, 2, 1, -1.0)):
        moved, turned = local[..., 0::2, across, :], sign * local[..., 1::2, about, :]
        nodal = np.stack([moved[..., 0, :], turned[..., 0, :], moved[..., 1, :], turned[..., 1, :]], axis=-2)
        phi = np.asarray(beams.shear[elements, plane])[..., None]
        deflection, slope = bending_shapes(POINTS, length, phi)
        bend, drop = _slopes(POINTS, length, phi)
        turn = slope @ nodal
        u[..., across, :] = deflection @ nodal
        theta[..., about, :], curvature[..., about, :] = sign * turn, sign * (bend @ nodal)
        strain[..., across, :] = drop @ nodal - turn
    back = axes.swapaxes(-1, -2)[..., None, :, :]
    return LineFields(back @ u, back @ theta, back @ curvature, back @ strain, axes[..., 0, :])


def _slopes(xi: Array, length: Array, phi: Array) -> tuple[Array, Array]:
    """Derivatives along the elements of rotation and deflection of `bending_shapes`, each (..., points, 4)."""
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
    whole = ((1 + phi) * length)[..., None]
    return bend / whole, drop / whole

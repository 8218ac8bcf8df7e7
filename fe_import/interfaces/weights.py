"""Positive weights of the nodes of a face, for its average motion: uniform, or shares of its area.

Consistent nodal areas are negative at the corners of quadratic faces with eight nodes and zero at those with six, so
the area is shared in proportion to the diagonal of the face's consistent mass (Hinton, Rock & Zienkiewicz,
Earthquake Engng Struct. Dyn. 4, 1976): 3/76 and 16/76 on an eight-node rectangle, 3/57 and 16/57 on a triangle.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import skfem

from fe_import.elements.solid_mesh import SolidMesh, boundary_faces
from fe_import.errors import Cause, FEImportError
from fe_import.model import Array, IntArray

_SHAPES: dict[int, Any] = {  # nodes of a face -> element whose shape functions it has
    3: skfem.ElementTriP1(),
    6: skfem.ElementTriP2(),
    4: skfem.ElementQuad1(),
    8: skfem.ElementQuadS2(),
    9: skfem.ElementQuad2(),
}
_CORNERS = {3: ((0, 0), (1, 0), (0, 1)), 4: ((0, 0), (1, 0), (1, 1), (0, 1))}


def face_shapes(count: int, points: Array) -> tuple[Array, Array]:
    """Shape functions (count, q) of a face of ``count`` nodes, and their gradients (count, 2, q), at points (2, q)."""
    element = _SHAPES[count]
    values, gradients = np.empty((count, points.shape[1])), np.empty((count, *points.shape))
    for local, node in enumerate(_local_nodes(count)):
        values[node], gradients[node] = element.lbasis(points, local)
    return values, gradients


@cache
def _local_nodes(count: int) -> tuple[int, ...]:
    """Our node at each of scikit-fem's, matched by place."""
    corners = np.array(_CORNERS[3 if count in (3, 6) else 4], dtype=float)
    edges = (corners + np.roll(corners, -1, axis=0)) / 2
    ours = np.vstack([corners, edges, corners.mean(axis=0)])[:count]
    return tuple(int(np.abs(ours - place).sum(axis=1).argmin()) for place in _SHAPES[count].doflocs)


@cache
def _face_rule(count: int) -> tuple[Array, Array, Array]:
    """Shape functions (count, q), their gradients (count, 2, q) and weights (q,) at quadrature points of a face."""
    x, w = np.polynomial.legendre.leggauss(4)
    x, w = (x + 1) / 2, w / 2
    s, t = (g.ravel() for g in np.meshgrid(x, x, indexing="ij"))
    weights = np.outer(w, w).ravel()
    if count in (3, 6):  # the square collapsed onto the triangle
        t, weights = (1 - s) * t, weights * (1 - s)
    return *face_shapes(count, np.stack([s, t])), weights


def nodal_areas(nodes: Array, faces: IntArray) -> Array:
    """Area of faces, shared among their nodes by positive parts.

    Parameters
    ----------
    nodes : (n, 3) array
    faces : (f, k) int array
        Corners, then mid-edge nodes, then the centre: k = 3, 4, 6, 8 or 9.

    Returns
    -------
    (n,) array
        Sums to the area; 0 at nodes of no face.
    """
    values, gradients, weights = _face_rule(faces.shape[1])
    tangents = np.einsum("fkc,kdq->fqdc", nodes[faces], gradients)
    density = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=2) * weights
    diagonal = np.einsum("kq,fq->fk", values**2, density)
    shares = diagonal * (density.sum(axis=1) / diagonal.sum(axis=1))[:, None]
    return np.asarray(np.bincount(faces.ravel(), shares.ravel(), minlength=len(nodes)), dtype=float)


def area_weights(mesh: SolidMesh, chosen: IntArray, name: str) -> Array:
    """(k,) shares, sum 1, of the nodes of an interface in the area of the surface faces among them.

    Raises
    ------
    FEImportError
        ``INTERFACE``: a node of no such face.
    """
    within = [faces[np.isin(faces, chosen).all(axis=1)] for faces in boundary_faces(mesh)]
    areas = sum((nodal_areas(mesh.nodes, faces) for faces in within), np.zeros(len(mesh.nodes)))[chosen]
    bare = np.flatnonzero(areas <= 0)
    if bare.size:
        raise FEImportError(
            Cause.INTERFACE,
            f"{bare.size} of the {len(chosen)} nodes of interface {name!r} belong to no element face within its set, "
            f"the first is node {chosen[bare[0]]}, and have no area",
            where=mesh.source,
            remedy='use weights = "uniform", or a set of whole faces',
        )
    return np.asarray(areas / areas.sum())

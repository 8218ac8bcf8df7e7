"""Stress of nodal shells at bottom, middle and top of their nodes, from the strains of their elements.

Strains at the 2 x 2 points are extrapolated to the corners, turned there into stress, in the axes of the nodes, which
turn with these, and averaged over the elements that meet: as `fe_import.elements.shell_stress` does for linear shells.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from erls.equations.nodal.parts import LinkParts
from erls.equations.nodal.shell import POINTS, Shell, Shells, slopes
from erls.maths import motion_maps as motions
from erls.maths.se3 import pose
from erls.maths.so3 import Array
from fe_import.elements.elasticity import PAIRS
from fe_import.modal.model import ModalModel
from fe_import.model import IntArray

_TRIED = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))  # reference coordinates of the corners


def _to_corners() -> Array:
    """(4, 4) from the points of the quadrature, by the bilinear polynomial through them."""
    points = np.array([(r, s) for r in POINTS for s in POINTS])
    terms = [np.stack([np.ones(4), x[:, 0], x[:, 1], x[:, 0] * x[:, 1]], axis=1) for x in (np.array(_TRIED), points)]
    return np.asarray(terms[0] @ np.linalg.inv(terms[1]))


_TO_CORNERS = _to_corners()


def link_stress(parts: LinkParts, model: ModalModel) -> SurfaceStress | None:
    """Of a link of shells, at the nodes of its model; None of others, and of shells that do not tell."""
    if not parts.shells or parts.shells[0].surfaces is None:
        return None
    built = np.array([pose(position=x) for x in parts.nodes])
    return SurfaceStress(parts.shells, built, parts.corners, len(model.nodes))


class SurfaceStress:
    """Where to look for the stress of some shells.

    Parameters
    ----------
    shells : sequence of Shell
        Each with its ``surfaces``.
    built : (k, 4, 4) array
        All nodes as built.
    cells : (q, 4) int array
        Which node of a mesh each corner is.
    count : int
        Nodes of the mesh that are asked for, its first ones.
    """

    def __init__(self, shells: Sequence[Shell], built: Array, cells: IntArray, count: int) -> None:
        self._shells, self._cells, self._count = Shells(shells, built), cells, count
        self._own = motions.inverse(built[self._shells.corners]) @ np.array([s.frames for s in shells])
        self._surfaces = np.array([s.surfaces for s in shells])

    def at(self, poses: Array) -> Array:
        """(n, 3, 6) stress xx, yy, zz, xy, yz, zx [Pa] at poses (k, 4, 4); nodes of no shell bear none."""
        strains = np.einsum("cp,qpi->qci", _TO_CORNERS, self._strains(poses))
        plane = np.einsum("qsij,qcj->qcsi", self._surfaces, strains)
        local = np.zeros((*plane.shape[:3], 3, 3))
        for row, (i, j) in enumerate(((0, 0), (1, 1), (0, 1), (0, 2), (1, 2))):
            local[..., i, j] = local[..., j, i] = plane[..., row]
        axes = self._own[..., None, :3, :3]
        turned = axes @ local @ np.swapaxes(axes, -2, -1)
        each = np.stack([turned[..., i, j] for i, j in PAIRS], axis=-1)
        count = max(self._count, int(self._cells.max()) + 1)
        total, met = np.zeros((count, *each.shape[2:])), np.zeros(count)
        np.add.at(total, self._cells, each)
        np.add.at(met, self._cells, 1.0)
        return np.asarray(total / np.maximum(met, 1.0)[:, None, None])[: self._count]

    def _strains(self, poses: Array) -> Array:
        """(q, 4, 8) at the points, as of `erls.equations.nodal.shell_forces`."""
        found = self._shells
        change = slopes(poses[found.corners] @ self._own) - found.built.reshape(-1, 4, 2, 6)
        g, h = np.moveaxis(found.rises.reshape(-1, 4, 2, 2) @ change, 2, 0)
        membrane = g[..., 0], h[..., 1], g[..., 1] + h[..., 0]
        return np.stack([*membrane, g[..., 4], -h[..., 3], h[..., 4] - g[..., 3], g[..., 2], h[..., 2]], axis=-1)

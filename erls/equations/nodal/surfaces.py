"""Surfaces as meshes of four-node shells: frames at the corners of elements, and elements cut into four.

A triangle is an element whose third and fourth corner are one: its slopes are finite at all points of the quadrature,
which lie inside, and it strains evenly under even strains.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths import motion_maps as motions
from erls.maths.motion_maps import poses as as_poses
from erls.maths.so3 import Array
from fe_import.elements.shell_elements import middle_axis
from fe_import.model import IntArray

FOLD_DEG = 25.0
"""Between normals: from where on a surface is folded rather than curved."""

_ALONG = 1e-3  # sine of the angle between a direction and the normal of a surface


def corner_frames(places: Array, cells: IntArray, fold_deg: float, where: str, reference: Array | None = None) -> Array:
    """(e, 4, 4, 4) frames at the corners: z the mean normal of the elements there that meet at no fold.

    x comes nearest to ``reference``, (3,) or (e, 3); in its place or where that is zero, to the axis in the middle of
    each element.

    Raises
    ------
    SceneError
        BAD_FIELD: an element without area, a corner that turns back, a reference along a normal.
    """
    corners, triangle = places[cells], cells[:, 2] == cells[:, 3]
    next_ones = np.where(triangle[:, None], [1, 2, 0, 0], [1, 2, 3, 0])
    last_ones = np.where(triangle[:, None], [2, 0, 1, 1], [3, 0, 1, 2])
    ahead, back = (np.take_along_axis(corners, k[..., None], axis=1) - corners for k in (next_ones, last_ones))
    normals = np.cross(ahead, back)
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    turned = np.einsum("ekc,ec->ek", normals, normals.sum(axis=1)) <= 0
    if turned.any() or not lengths.all():
        bad = int(turned.any(axis=1).argmax())
        raise SceneError(
            Cause.BAD_FIELD, "an element without area, or with a corner that turns back", where=where,
            value=f"about {np.round(corners[bad].mean(axis=0), 6).tolist()}", remedy="mend the mesh there",
        )  # fmt: skip
    normals /= lengths
    means = _smooth(normals, cells, triangle, fold_deg, len(places))
    one = corners[:, 1] + corners[:, 2] - corners[:, 0] - corners[:, 3]
    two = corners[:, 2] + corners[:, 3] - corners[:, 0] - corners[:, 1]
    middle = middle_axis((one, two))
    given = np.zeros_like(middle) if reference is None else np.broadcast_to(reference, middle.shape)
    along = given.any(axis=1)
    middle[along] = given[along] / np.linalg.norm(given[along], axis=1, keepdims=True)
    x = middle[:, None] - np.einsum("ekc,ec->ek", means, middle)[..., None] * means
    sizes = np.linalg.norm(x, axis=-1, keepdims=True)
    short = along & (sizes.min(axis=(1, 2)) < _ALONG)
    if short.any():
        raise SceneError(
            Cause.BAD_FIELD, "the direction of layers stands on the surface of some shells", where=where,
            value=given[short][0].tolist(), remedy="give another direction, or split the link",
        )  # fmt: skip
    x /= sizes
    return as_poses(np.stack([x, np.cross(means, x), means], axis=-1), corners)


def _smooth(normals: Array, cells: IntArray, triangle: Array, fold_deg: float, count: int) -> Array:
    """(e, 4, 3) means of the normals (e, 4, 3) that meet at the same of ``count`` nodes, and at no fold."""
    means, least = normals.copy(), np.cos(np.radians(fold_deg))
    flat, owner = normals.reshape(-1, 3), cells.ravel()
    counted = np.ones(cells.shape)
    counted[triangle, 3] = 0.0  # the third corner once more
    order = np.argsort(owner, kind="stable")
    starts = np.searchsorted(owner[order], np.arange(count + 1))
    for first, end in itertools.pairwise(starts):
        meeting = order[first:end]
        near = (flat[meeting] @ flat[meeting].T >= least) * counted.ravel()[meeting]
        means.reshape(-1, 3)[meeting] = near @ flat[meeting]
    return np.asarray(means / np.linalg.norm(means, axis=-1, keepdims=True))


@dataclass(frozen=True)
class Quartered:
    """A surface with all elements cut: quadrangles into four, triangles into three quadrangles.

    Attributes
    ----------
    places : (n + k, 3) array
        Old nodes keep their numbers.
    cells : (c, 4) int array
    parents : (c,) int array
        Element that each of them is a part of.
    between : tuple of (int array, (m, j) int array)
        Numbers of new nodes, and the old ones between which they lie.
    """

    places: Array
    cells: IntArray
    parents: IntArray
    between: tuple[tuple[IntArray, IntArray], ...]

    def grown(self, nodes: IntArray) -> IntArray:
        """A set of nodes with the new ones between its own alone."""
        return np.concatenate([nodes, *(new[np.isin(of, nodes).all(axis=1)] for new, of in self.between)])


def quartered(places: Array, cells: IntArray, frames: Array) -> Quartered:
    """New nodes lie on the surface as its elements interpolate it, H_A exp(½ log(H_A⁻¹ H_B)) in the middle of an edge
    and likewise between two of these in the middle of an element; where the elements on both sides of an edge see it a
    little differently, in between.

    Parameters
    ----------
    places : (n, 3) array
    cells : (e, 4) int array
    frames : (e, 4, 4, 4) array
        From `corner_frames`.
    """
    triangle = cells[:, 2] == cells[:, 3]
    middles = _between(frames, np.roll(frames, -1, axis=1), 0.5)  # of the edges, from each corner to the next
    centres = _between(middles[:, 0], middles[:, 2], np.where(triangle, 1 / 3, 0.5))[:, :3, 3]
    ends = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1), axis=2)
    kept = np.ones(cells.shape, dtype=bool)
    kept[triangle, 2] = False  # from the third corner to itself
    edges, found = np.unique(ends[kept], axis=0, return_inverse=True)
    own = np.full(cells.shape, -1, dtype=np.int64)
    own[kept] = found.ravel()
    seen = np.zeros((len(edges), 3))
    np.add.at(seen, own[kept], middles[kept][:, :3, 3])
    seen /= np.bincount(own[kept])[:, None]
    first = len(places)
    inner = first + len(edges) + np.arange(len(cells))
    around = first + own
    around[triangle, 2] = around[triangle, 3]  # before and after a corner that stands for two
    parts = np.stack([cells, around, np.tile(inner[:, None], 4), np.roll(around, 1, axis=1)], axis=-1)
    quarters = np.ones(cells.shape, dtype=bool)
    quarters[triangle, 3] = False
    parents = np.tile(np.arange(len(cells))[:, None], 4)
    between = ((first + np.arange(len(edges)), edges), (inner, cells))
    return Quartered(np.concatenate([places, seen, centres]), parts[quarters], parents[quarters], between)


def _between(a: Array, b: Array, share: float | Array) -> Array:
    """(..., 4, 4) at a share of the way from a to b."""
    shape = a.shape
    a, b = a.reshape(-1, 4, 4), b.reshape(-1, 4, 4)
    way = motions.log(motions.inverse(a) @ b)
    return np.asarray(a @ motions.exp(np.broadcast_to(np.asarray(share)[..., None], (len(a), 1)) * way)).reshape(shape)

"""Points tied to faces: where they meet the face, and how they move with it.

A point at x whose foot on the face is at x_f = Σ N_i x_i moves by Σ N_i u_i + θ × (x - x_f). The rotation θ of the face
there follows from the derivatives along it: with the normal n, tangents a_α = ∂x/∂ξ_α and their duals a^α,

    θ = Σ_α ½ n (n × a^α) · ∂u/∂ξ_α - (n × a^α) n · ∂u/∂ξ_α,

so that rigid-body motion passes exactly whatever the gap; without one it is the shape functions alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from fe_import.interfaces.weights import face_shapes
from fe_import.model import Array, IntArray

MOST_FACE_NODES = 9
_STEPS = 30  # of the projection; it converges in few on faces that are nearly flat
_CONVERGED = 1e-14  # of the local coordinates
_BULGE = 1.1  # a curved face may stand out beyond its nodes
_POINTS = 2000  # looked at together


@dataclass(frozen=True)
class Feet:
    """The nearest points of faces to points.

    Attributes
    ----------
    nodes : (k, 9) int array
        Of the face, filled up with -1.
    motions : (k, 9, 3, 3) array
        Displacement of the point per displacement of each of these nodes.
    gaps : (k,) array
        Distance from the face.
    sizes : (k,) array
        Largest distance of the face's nodes from its centre.
    """

    nodes: IntArray
    motions: Array
    gaps: Array
    sizes: Array


def feet_on_faces(points: Array, positions: Array, faces: Sequence[IntArray]) -> Feet:
    """Nearest points of faces.

    Parameters
    ----------
    points : (k, 3) array
    positions : (n, 3) array
        Of the nodes.
    faces : sequence of (f, w) int arrays
        Corners, then mid-edge nodes, then the centre: w = 3, 4, 6, 8 or 9.
    """
    count = len(points)
    result = Feet(
        np.full((count, MOST_FACE_NODES), -1, dtype=np.int64),
        np.zeros((count, MOST_FACE_NODES, 3, 3)),
        np.full(count, np.inf),
        np.zeros(count),
    )
    for group in faces:
        width, placed = group.shape[1], positions[group]
        middle = np.full((2, 1), 1 / 3 if width in (3, 6) else 0.5)
        centres = np.einsum("w,fwc->fc", face_shapes(width, middle)[0][:, 0], placed)
        sizes = np.linalg.norm(placed - centres[:, None], axis=2).max(axis=1)
        for chosen, face in _near(points, centres, sizes):
            local, gaps = _feet(points[chosen], placed[face])
            order = np.lexsort((gaps, chosen))
            first = np.unique(chosen[order], return_index=True)[1]
            best = order[first][gaps[order[first]] < result.gaps[chosen[order[first]]]]
            at, own = chosen[best], face[best]
            result.nodes[at] = -1
            result.nodes[at, :width] = group[own]
            result.motions[at] = 0.0
            result.motions[at, :width] = _motions(points[at], placed[own], local[:, best])
            result.gaps[at], result.sizes[at] = gaps[best], sizes[own]
    return result


def _near(points: Array, centres: Array, sizes: Array) -> Iterator[tuple[IntArray, IntArray]]:
    """Pairs of points and of all faces that may be their nearest, some points at a time."""
    tree, reach = cKDTree(centres), _BULGE * sizes
    nearest = tree.query(points)[0]  # the foot is no farther than this centre
    for start in range(0, len(points), _POINTS):
        some = slice(start, start + _POINTS)
        lists = tree.query_ball_point(points[some], nearest[some] + reach.max())
        chosen = start + np.repeat(np.arange(len(lists)), [len(found) for found in lists])
        face = np.concatenate([np.asarray(found, dtype=np.int64) for found in lists])
        distance = np.linalg.norm(points[chosen] - centres[face], axis=1)
        usable = distance - reach[face] <= nearest[chosen]
        yield chosen[usable], face[usable]


def _feet(points: Array, placed: Array) -> tuple[Array, Array]:
    """Local coordinates (2, p) of the nearest point of a face (p, w, 3) to each point (p, 3), and its distance."""
    width = placed.shape[1]
    triangle = width in (3, 6)
    local = np.full((2, len(points)), 1 / 3 if triangle else 0.5)
    for _ in range(_STEPS):
        values, gradients = face_shapes(width, local)
        rest = points - np.einsum("wp,pwc->pc", values, placed)
        tangents = np.einsum("wdp,pwc->pdc", gradients, placed)
        metric = tangents @ tangents.swapaxes(1, 2)
        step = np.linalg.solve(metric, (tangents @ rest[:, :, None]))[:, :, 0].T
        before, local = local, _inside(local + step, triangle)
        if np.abs(local - before).max(initial=0.0) < _CONVERGED:
            break
    values, _ = face_shapes(width, local)
    return local, np.linalg.norm(points - np.einsum("wp,pwc->pc", values, placed), axis=1)


def _inside(local: Array, triangle: bool) -> Array:
    if not triangle:
        return np.clip(local, 0.0, 1.0)
    excess = np.maximum(local.sum(axis=0) - 1.0, 0.0) / 2
    moved = np.clip(local - excess, 0.0, 1.0)  # across the slanted side, then along the others
    return np.asarray(moved / np.maximum(moved.sum(axis=0), 1.0))


def _motions(points: Array, placed: Array, local: Array) -> Array:
    """(p, w, 3, 3) displacement of each point per displacement of the nodes of its face."""
    values, gradients = face_shapes(placed.shape[1], local)
    foot = np.einsum("wp,pwc->pc", values, placed)
    tangents = np.einsum("wdp,pwc->pdc", gradients, placed)
    normal = np.cross(tangents[:, 0], tangents[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    duals = np.linalg.solve(tangents @ tangents.swapaxes(1, 2), tangents)
    around = np.cross(normal[:, None], duals)  # n × a^α
    turns = np.einsum("pc,pad->pacd", normal / 2, around) - np.einsum("pac,pd->pacd", around, normal)
    rotation = np.einsum("wap,pacd->pwcd", gradients, turns)
    arm = points - foot
    across = np.zeros((len(points), 3, 3))
    across[:, [2, 0, 1], [1, 2, 0]], across[:, [1, 2, 0], [2, 0, 1]] = arm, -arm  # arm ×
    moved = np.einsum("wp,cd->pwcd", values, np.eye(3))
    return np.asarray(moved - np.einsum("pce,pwed->pwcd", across, rotation))

"""Averaged coupling (RBE3): an interface node moves as the coupled nodes do on average; the face may deform.

With weights w_k (sum 1), the weighted mean position m, r_k = x_k - m and J = Σ w_k (r_k² 1 - r_k r_kᵀ), the motion
that fits the displacements u_k best, Σ w_k |u_k - ū - φ × r_k|² least, is

    ū = Σ w_k u_k,   φ = J⁻¹ Σ w_k r_k × u_k,   u_c = ū + φ × (x_c - m).

By virtual work a force F and a moment M at the interface node act on the face as
f_k = w_k (F + (J⁻¹ M') × r_k), M' = M + (x_c - m) × F: no stiffness is added, and the resultants are those given.

In the equations, six displacements of the face depend on the interface node and on the rest of the face. That rest
becomes a dense block of the stiffness: k nodes fill (3 k)² entries. A face of many nodes is therefore divided in
patches of some fifty; each has an auxiliary node that averages it, and the interface node averages those. The sums
are the same to the last term (J = Σ of the patches' about m), the fill is that of the patches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from fe_import.dependence import Dependence, arm, block_rows
from fe_import.model import Array, IntArray

UNDIVIDED = 150  # nodes of a face that is not divided in patches: (3 * 150)^2 entries are 2 MB
PATCH = 48  # nodes of a patch at most
MOST = 20_000  # nodes of a face; 600 patches, whose own block takes some 100 MB
_INDEPENDENT = 1e-6  # smallest pivot over the largest, when six displacements are chosen


@dataclass(frozen=True)
class Average:
    """Six equations ``displacements`` @ u = ``motion`` @ (displacement and rotation of the averaging node).

    Attributes
    ----------
    displacements : (6, c) array
        Over the components that are averaged; rotations are multiplied by ``radius``.
    motion : (6, 6) array
    radius : float
        Weighted radius of gyration of what is averaged [m].
    """

    displacements: Array
    motion: Array
    radius: float


@dataclass(frozen=True)
class Patch:
    """Some nodes of a face (indices into its list), and their weighted mean position."""

    members: IntArray
    position: Array


def average(points: Array, weights: Array, centre: Array) -> Average:
    """The average motion of points about their weighted mean, seen from a node at ``centre``."""
    return _average(points, weights, np.zeros((len(points), 3, 3)), arm, centre)


def _average(points: Array, weights: Array, inertia: Array, motion: object, centre: Array) -> Average:
    raise NotImplementedError

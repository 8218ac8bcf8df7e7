"""Lowest modes by Lanczos iteration with blocks of vectors.

The largest eigenvalues μ = 1/ω² of A = K⁻¹M are sought in the span of X, AX, A²X, ... . Blocks cost little more
than single vectors to solve for, and find the modes of a repeated frequency together. All vectors are kept
mass-orthonormal twice over, so that nothing is found twice (R. G. Grimes, J. G. Lewis & H. D. Simon, SIAM J. Matrix
Anal. Appl. 15, 1994). A massless direction is never entered: blocks are in the range of A.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from fe_import.model import Array
from fe_import.solver import products

_CONVERGED = 1e-9  # error of A φ = μ φ, per μ, in the mass norm
_NEW = 1e-10  # part of a vector that is new, per its size; below is rounding


class NotConverged(Exception):
    """The iteration used up the vectors that it may."""


def block_size(count: int) -> int:
    """Vectors to a block."""
    return min(max(2 * count // 3, 4), 12)


def most_vectors(count: int) -> int:
    """How many vectors the iteration may use; regular spectra need 1.5 to 3 per mode."""
    return 8 * count + 120


def lowest_eigenpairs(solve: Callable[[Array], Array], mass: sp.csc_array, count: int) -> tuple[Array, Array]:
    """Largest μ of K⁻¹M and their modes.

    Parameters
    ----------
    solve : callable
        K⁻¹ times (n, k) right-hand sides.
    mass : (n, n) sparse
        Positive semidefinite.
    count : int

    Returns
    -------
    mu : (m,) array
        Falling; fewer than ``count`` when there are no more.
    modes : (n, m) array
        Nearly mass-orthonormal.

    Raises
    ------
    NotConverged
    """
    size = mass.shape[0]
    start = np.random.default_rng(0).standard_normal((size, block_size(count)))  # fixed: reductions are reproducible
    new, weighted, *_ = _orthonormal(solve(mass @ start), [], mass)
    blocks: list[Array] = []
    projected = np.zeros((0, 0))
    while True:
        blocks.append(new)
        new, weighted, along, across = _orthonormal(solve(weighted), blocks, mass)
        known = len(projected)
        projected = la.block_diag(projected, np.zeros((along.shape[1], along.shape[1])))
        projected[:, known:] = along
        projected[known:] = along.T
        mu, turn = la.eigh(projected)
        mu, turn = mu[::-1], turn[:, ::-1]
        left = across @ turn[known:, :count]  # A φ - μ φ in the vectors of the new block
        needed = mu[:count] > _NEW * mu[0]
        done = np.linalg.norm(left, axis=0) <= _CONVERGED * mu[:count]
        if new.shape[1] == 0 or (len(mu) >= count and done[needed].all()):
            break
        if len(mu) + new.shape[1] > max(most_vectors(count), 2 * count):
            raise NotConverged
    mu, turn, left = mu[:count][needed], turn[:, :count][:, needed], left[:, needed]
    # A φ / μ instead of φ costs nothing and is free of what rounding mixed in
    modes = new @ (left / mu)
    products.take_out(modes, blocks, -turn)
    return mu, modes


def _orthonormal(vectors: Array, blocks: list[Array], mass: sp.csc_array) -> tuple[Array, Array, Array, Array]:
    """What is new in some vectors, which are lost.

    Returns
    -------
    new : (n, p) array
        Mass-orthonormal among themselves and to the blocks; p may be less than there are vectors.
    weighted : (n, p) array
        The mass times these.
    along : (b, k) array
        Products of the vectors with those of the blocks.
    across : (p, k) array
        The vectors less what is along the blocks, in terms of the new ones.
    """
    along = np.zeros((sum(block.shape[1] for block in blocks), vectors.shape[1]))
    across = np.eye(vectors.shape[1])
    new, weighted = vectors, products.times(mass, vectors)
    least = _NEW * np.sqrt(np.einsum("nk,nk->k", new, weighted).max().clip(min=0))
    for _ in range(2):  # twice is enough
        if blocks:
            part = products.along(blocks, weighted)
            products.take_out(new, blocks, part)
            along += part @ across
            weighted = products.times(mass, new)
        gram = new.T @ weighted
        values, turn = la.eigh((gram + gram.T) / 2)
        size = np.sqrt(values.clip(min=0))
        kept = size > least
        least = 0.1
        turn, size = turn[:, kept], size[kept]
        new, weighted = (products.combined(fields, turn / size) for fields in (new, weighted))
        across = (turn * size).T @ across
    return new, weighted, along, across

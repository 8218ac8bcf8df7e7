"""Factorization and lowest eigenpairs of sparse symmetric matrices, behind one small interface, verified.

The solvers are in `fe_import.solver`. Large jobs are announced (`fe_import.solver.watch`), and refused before they
start when they do not fit into memory.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.model import Array, magnitudes
from fe_import.solver import Elimination, Factor, SingularMatrix, analyse, chosen_solver
from fe_import.solver.dense import dense_modes, polishing, singular_matrix
from fe_import.solver.lanczos import NotConverged, lowest_eigenpairs, most_vectors
from fe_import.solver.memory import gigabytes, refuse_too_large
from fe_import.solver.multifrontal import bytes_needed, negative_pivots
from fe_import.solver.pieces import OutsidePattern
from fe_import.solver.products import times
from fe_import.solver.threads import one_thread_each
from fe_import.solver.watch import Progress, say

__all__ = ["Factorization", "dense_modes", "factorize", "lowest_modes", "modes_below", "polishing"]

_DENSE = 600  # below this size LAPACK is faster than Lanczos and finds every mode
_RESIDUAL = 1e-6  # of an accepted eigenpair, see `_residual`; Lanczos to working precision gives below 1e-9
_ROUNDING = 10 * np.finfo(float).eps  # of the terms of a product K φ: a slender link's are far larger than their sum
_GAP = 1e-4  # between ω² of neighbours, per ω²: a narrower one, as within a pair, is no place to count
_ANNOUNCED = 3.0  # seconds; shorter jobs are done before the message is read


class MassMatrix(Protocol):
    """What is asked of a symmetric positive semidefinite matrix: a sparse one, or one that is not held as such."""

    def __matmul__(self, fields: Array) -> Array: ...

    @property
    def shape(self) -> tuple[int, int]:
        """Of a square matrix."""

    def diagonal(self) -> Array:
        """Not zero where there is mass."""

    def count_nonzero(self) -> int:
        """Zero when there is no mass."""

    def toarray(self) -> Array:
        """Dense."""


@dataclass(frozen=True)
class Factorization:
    """A factorized matrix; called with right-hand sides (n,) or (n, k), it solves.

    Attributes
    ----------
    solver : str
    elimination : Elimination
        With the size of the factor, and to be used again for matrices of the same pattern.
    factor : Factor
    """

    solver: str
    elimination: Elimination
    factor: Factor

    def __call__(self, right: Array) -> Array:
        """Solutions."""
        return self.factor.solve(right)


def factorize(matrix: sp.csc_array, what: str, positions: Array | None = None, reserve: int = 0) -> Factorization:
    """Factorize a symmetric positive definite matrix.

    Parameters
    ----------
    matrix : (n, n) sparse CSC
        Both triangles.
    what : str
        Names the matrix in messages.
    positions : (n, 3) array, optional
        Where each dof sits; the order of elimination is found faster with it, and is better for compact solids.
    reserve : int
        Bytes that will be needed beside the factor.

    Raises
    ------
    FEImportError
        NOT_DEFINITE: the matrix is singular to working precision; TOO_LARGE: it does not fit into memory.
    """
    matrix, solver = _canonical(matrix), chosen_solver()
    elimination = analyse(matrix, positions)
    needed = solver.bytes_needed(elimination)
    refuse_too_large(needed + reserve, f"factorization of the {what}, {matrix.shape[0]} dofs,")
    progress = _announced(elimination, f"factorizing the {what}", needed)
    try:
        factor = solver.factorize(matrix, elimination, progress)
    except SingularMatrix:
        raise singular_matrix(what) from None
    return Factorization(solver.name, elimination, factor)


def _announced(elimination: Elimination, doing: str, needed: int) -> Progress:
    """Say what a large job takes; hears of its progress."""
    seconds = elimination.expected_seconds
    if seconds > _ANNOUNCED:
        say(f"{doing}: {len(elimination.order)} dofs, {gigabytes(needed)}, about {seconds:.0f} s")
    return Progress(doing, float(elimination.operations.sum()))


def _canonical(matrix: sp.csc_array) -> sp.csc_array:
    matrix = matrix.tocsc()
    if not matrix.has_canonical_format:
        matrix = matrix.copy()
        matrix.sum_duplicates()
    return matrix


def lowest_modes(
    stiffness: sp.csc_array,
    mass: MassMatrix,
    count: int,
    what: str,
    *,
    positions: Array | None = None,
    solve: Factorization | None = None,
    below: Callable[[float], int | None] | None = None,
) -> tuple[Array, Array]:
    """Lowest modes of K φ = ω² M φ with K positive definite and M positive semidefinite.

    Massless directions have no mode: fewer than ``count`` may come back.

    Parameters
    ----------
    stiffness : (d, d) sparse CSC
    mass : (d, d) sparse CSC or another `MassMatrix`
    count : int
    what : str
        Names the link in messages.
    positions : (d, 3) array, optional
        Where each dof sits, see `factorize`.
    solve : Factorization, optional
        Of the stiffness, if there is one already.
    below : callable, optional
        How many modes there are below some ω², or None where that cannot be told; by `modes_below` unless given.

    Returns
    -------
    omega : (k,) array
        Circular frequencies in rising order [rad/s].
    modes : (d, k) array
        Mass-orthonormal.

    Raises
    ------
    FEImportError
        K is not positive definite (NOT_DEFINITE), the solver failed (EIGENSOLVER), or there is too little memory
        (TOO_LARGE).
    """
    size = stiffness.shape[0]
    if count == 0 or size == 0 or not mass.count_nonzero():
        return np.zeros(0), np.zeros((size, 0))
    count = min(count, int((mass.diagonal() > 0).sum()))
    if size <= _DENSE or count > size // 4:
        refuse_too_large(6 * 8 * size**2, f"eigenproblem of the {what}, {count} modes of {size} dofs,")
        return dense_modes(stiffness.toarray(), mass.toarray(), count, what)
    vectors = 8 * size * (most_vectors(count) // 2 + 4 * count)  # most spectra take less than half
    if solve is None:
        solve = factorize(stiffness, f"stiffness of the {what}", positions, vectors)
    else:
        refuse_too_large(vectors, f"iteration for {count} modes of the {what}, {size} dofs,")
    try:
        with one_thread_each():  # those of the linear algebra wait for work on the processors of ours
            mu, modes = lowest_eigenpairs(solve, mass, count)
    except NotConverged:
        raise FEImportError(
            Cause.EIGENSOLVER, f"modes of the {what} did not converge", value=count, remedy="ask for fewer modes"
        ) from None
    values = 1 / mu
    residual = _residual(stiffness, mass, solve, values, modes)
    if residual > _RESIDUAL:
        raise FEImportError(
            Cause.EIGENSOLVER,
            f"modes of the {what} did not converge: share of ω² that is not sure",
            value=residual,
            limit=_RESIDUAL,
            remedy="ask for fewer modes",
        )
    elimination = solve.elimination
    _check_complete(values, what, below or (lambda shift: modes_below(stiffness, mass, shift, elimination=elimination)))
    omega, change = polishing(stiffness, mass, np.sqrt(values), modes)
    return omega, modes @ change


def _residual(stiffness: sp.csc_array, mass: MassMatrix, solve: Factorization, values: Array, modes: Array) -> float:
    """Bound of the relative error of the squared frequencies.

    With the forces r = Kφ - ω²Mφ that are left there is an eigenvalue within η ω² of ω², η² = rᵀK⁻¹r / φᵀKφ. Forces
    are compared first, less their rounding: that takes no solution, and is the larger figure, as rounding in stiff
    parts makes large forces that do little work. What the sums Kφ are rounded by has a figure η of its own, which
    nobody can tell from what is left: it is taken off.
    """
    force = times(stiffness, modes)
    left = force - times(mass, modes) * values
    size = np.linalg.norm(force, axis=0)
    share = np.linalg.norm(left, axis=0) / size
    if share.max() <= _RESIDUAL:
        return float(share.max())
    terms = magnitudes(stiffness) @ np.abs(modes)
    figure = float((share - _ROUNDING * np.linalg.norm(terms, axis=0) / size).max())
    if figure <= _RESIDUAL:
        return figure
    signs = np.random.default_rng(0).choice([-1.0, 1.0], terms.shape)
    rounded = np.finfo(float).eps * signs * terms
    energy = np.einsum("dk,dk->k", modes, force)
    found, made_up = (
        np.sqrt(np.einsum("dk,dk->k", part, solve(part)).clip(min=0) / energy) for part in (left, rounded)
    )
    return float((found - made_up).max())


def _check_complete(values: Array, what: str, count: Callable[[float], int | None]) -> None:
    """Refuse a spectrum with a gap: Lanczos may miss one of several modes of equal frequency.

    Modes are counted where the found spectrum leaves most room, above its middle if there is any; where there is the
    second most, should a pivot be too small there.
    """
    gaps, first = np.diff(np.log(values)), len(values) // 2
    upper, lower = (np.argsort(-part, kind="stable") for part in (gaps[first:], gaps[:first]))
    wide = [k for k in (*(first + upper), *lower) if gaps[k] > _GAP]
    for last in wide[:2]:
        shift = float(np.sqrt(values[last] * values[last + 1]))
        below = count(shift)
        if below is None:
            continue
        if below != last + 1:
            raise FEImportError(
                Cause.EIGENSOLVER,
                f"modes of the {what} were missed",
                value=f"{last + 1} found below {np.sqrt(shift) / (2 * np.pi):.6g} Hz",
                limit=f"there are {below}",
                remedy="ask for more or for fewer modes",
            )
        return


def modes_below(
    stiffness: sp.csc_array,
    mass: sp.csc_array,
    shift: float,
    *,
    positions: Array | None = None,
    elimination: Elimination | None = None,
) -> int | None:
    """Number of eigenvalues of K φ = λ M φ below ``shift`` (Sylvester: negative pivots of K - λM).

    Parameters
    ----------
    stiffness, mass : (d, d) sparse CSC
    shift : float
    positions : (d, 3) array, optional
        Where each dof sits, see `factorize`.
    elimination : Elimination, optional
        Of the stiffness, if there is one already.

    Returns
    -------
    int or None
        None when a pivot is too small to tell.

    Raises
    ------
    FEImportError
        TOO_LARGE: there is too little memory.
    """
    stiffness, mass = _canonical(stiffness), _canonical(mass)
    elimination = elimination or analyse(stiffness, positions)
    try:
        return _count(stiffness, mass, shift, elimination)
    except OutsidePattern:  # masses that couple what no stiffness does
        return _count(stiffness, mass, shift, analyse(_pattern(stiffness) + _pattern(mass), positions))


def _pattern(matrix: sp.csc_array) -> sp.csc_array:
    """Ones wherever an entry is stored: a zero among them would be lost in a sum."""
    return sp.csc_array((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape)


def _count(stiffness: sp.csc_array, mass: sp.csc_array, shift: float, elimination: Elimination) -> int | None:
    needed = bytes_needed(elimination, keep=False)
    refuse_too_large(needed, f"count of modes of {stiffness.shape[0]} dofs")
    return negative_pivots(stiffness, elimination, _announced(elimination, "counting modes", needed), mass, shift)

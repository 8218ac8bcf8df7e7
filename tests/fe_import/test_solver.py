"""Sparse solvers: one answer from all, exact counts of what they take, refusal of what does not fit, inertia."""

from __future__ import annotations

import contextlib
import importlib.util
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from clamped_boxes import MESHES, STEEL, clamped, silent
from solid_meshes import box

import fe_import.solver
import fe_import.solver.sparse
from fe_import.elements.solid import assemble_solid
from fe_import.errors import Cause, FEImportError
from fe_import.solver import SOLVERS, SingularMatrix, analyse, multifrontal
from fe_import.solver.dense import dense_modes
from fe_import.solver.lanczos import block_size
from fe_import.solver.pieces import OutsidePattern
from fe_import.solver.sparse import factorize, lowest_modes, modes_below

INSTALLED = [s.name for s in SOLVERS.values() if not s.package or importlib.util.find_spec("sksparse")]


# ----- order of elimination


@pytest.mark.parametrize("mesh", MESHES)
def test_order_without_positions(mesh: str) -> None:
    """From the graph alone: the same answer, with at most 2.5 times the entries (a cube is the worst case)."""
    model = clamped(*MESHES[mesh])
    right = np.random.default_rng(0).standard_normal((model.stiffness.shape[0], 2))
    seen, blind = factorize(model.stiffness, "x", model.positions), factorize(model.stiffness, "x")
    assert blind.elimination.nonzeros <= 2.5 * seen.elimination.nonzeros
    np.testing.assert_allclose(blind(right), seen(right), rtol=0, atol=1e-9 * np.abs(seen(right)).max())


def test_parts_without_connection_and_full_graphs() -> None:
    """Three equal chains side by side, lone dofs, and a matrix in which everything touches everything."""
    chain = sp.diags_array([[-1.0] * 99, [2.1] * 100, [-1.0] * 99], offsets=[-1, 0, 1])
    dense = np.random.default_rng(0).standard_normal((90, 90))
    for matrix in (
        sp.block_diag([chain, chain, chain, sp.eye_array(50)], format="csc"),
        sp.csc_array(dense @ dense.T + 90 * np.eye(90)),
        sp.csc_array([[2.0]]),
    ):
        right = np.arange(1.0, matrix.shape[0] + 1)
        np.testing.assert_allclose(matrix @ factorize(matrix, "x")(right), right, rtol=1e-12)
    chain_fill = factorize(chain.tocsc(), "x").elimination.nonzeros
    assert chain_fill < 100 * 21  # a chain cut into leaves of 20, not a full matrix


# ----- factorization


@pytest.mark.parametrize("name", INSTALLED)
@pytest.mark.parametrize("mesh", MESHES)
def test_solvers_agree(name: str, mesh: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Solutions to 1e-9 of those of SciPy's default solver, for one and for several right-hand sides."""
    model = clamped(*MESHES[mesh])
    right = np.random.default_rng(1).standard_normal((model.stiffness.shape[0], 5))
    reference = spla.splu(model.stiffness).solve(right)
    monkeypatch.setenv("ERLS_SOLVER", name)
    solve = factorize(model.stiffness, "x", model.positions)
    assert solve.solver == name
    scale = np.abs(reference).max()
    np.testing.assert_allclose(solve(right), reference, rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(solve(right[:, 0]), reference[:, 0], rtol=0, atol=1e-9 * scale)


@pytest.mark.parametrize("name", INSTALLED)
def test_loose_and_indefinite_matrices_are_refused(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A free cube moves without strain; a clamped one of negative stiffness is unstable."""
    monkeypatch.setenv("ERLS_SOLVER", name)
    mesh = box("hex8", (5, 5, 5))
    _, free = assemble_solid(mesh, [STEEL])
    model = clamped(*MESHES["beam of tet10"])
    for matrix in (free, -model.stiffness, (model.stiffness - 1e9 * model.mass).tocsc()):
        with pytest.raises(FEImportError, match="x is singular or unstable") as caught:
            factorize(matrix, "x")
        assert caught.value.cause is Cause.NOT_DEFINITE


def test_how_a_matrix_is_stored_does_not_matter() -> None:
    """Entries given in parts, rows out of order, and zeros that are stored on one side of the diagonal only."""
    model = clamped(*MESHES["beam of tet10"])
    coo = model.stiffness.tocoo()
    row, column = coo.coords
    far = np.array([0, 7]), np.array([len(model.positions) - 1, len(model.positions) - 5])
    data = np.concatenate([0.25 * coo.data, [0.0, 0.0], 0.75 * coo.data])
    order = np.lexsort((-np.arange(len(data)), np.concatenate([column, far[1], column])))
    rows = np.concatenate([row, far[0], row])[order]
    columns = np.concatenate([column, far[1], column])[order]
    counts = np.bincount(columns, minlength=len(model.positions))
    parts = sp.csc_array((data[order], rows, np.concatenate([[0], np.cumsum(counts)])), shape=coo.shape)
    before = parts.copy()
    right = np.ones(len(model.positions))
    expected = factorize(model.stiffness, "x")(right)
    found = factorize(parts, "x")(right)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_array_equal(parts.data, before.data)


def test_choosing_a_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ERLS_SOLVER", raising=False)
    assert fe_import.solver.chosen_solver().name == "multifrontal"
    monkeypatch.setenv("ERLS_SOLVER", "gauss")
    with pytest.raises(FEImportError, match="unknown solver") as caught:
        factorize(sp.csc_array(np.eye(3)), "x")
    assert caught.value.cause is Cause.BAD_FIELD
    assert "multifrontal" in caught.value.remedy
    monkeypatch.setenv("ERLS_SOLVER", "cholmod")
    monkeypatch.setattr(fe_import.solver.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(FEImportError, match="scikit-sparse") as caught:
        factorize(sp.csc_array(np.eye(3)), "x")
    assert caught.value.cause is Cause.BAD_FIELD
    assert "ERLS_SOLVER" in caught.value.where


def test_cholmod_adapter(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scaling and permutation around a stand-in of scikit-sparse 0.5's interface, and its refusals."""

    class NotDefinite(Exception):
        pass

    def cho_factor(matrix: sp.csc_array, order: str) -> SimpleNamespace:
        assert order == "natural"
        assert matrix.has_sorted_indices
        dense = matrix.toarray()
        np.testing.assert_allclose(np.diag(dense), 1.0, rtol=1e-14)
        try:
            lower = la.cholesky(dense, lower=True)
        except la.LinAlgError:
            raise NotDefinite from None
        rcond = (np.diag(lower).min() / np.diag(lower).max()) ** 2
        return SimpleNamespace(rcond=rcond, solve=lambda right: la.cho_solve((lower, True), right))

    module = SimpleNamespace(
        cho_factor=cho_factor, CholmodNotPositiveDefiniteError=NotDefinite, CholmodWarning=UserWarning
    )
    monkeypatch.setitem(__import__("sys").modules, "sksparse", SimpleNamespace(cholmod=module))
    model = clamped("hex8", (3, 3, 3), (1.0, 1.0, 1.0))
    elimination = analyse(model.stiffness, model.positions)
    right = np.random.default_rng(2).standard_normal((len(model.positions), 3))
    factor = fe_import.solver.cholmod.factorize(model.stiffness, elimination, silent)
    expected = la.solve(model.stiffness.toarray(), right, assume_a="pos")
    np.testing.assert_allclose(factor.solve(right), expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    np.testing.assert_allclose(factor.solve(right[:, 1]), factor.solve(right)[:, 1], rtol=1e-9)
    _, free = assemble_solid(box("hex8", (3, 3, 3)), [STEEL])
    for matrix in (free, -free, sp.csc_array(np.ones((3, 3)))):
        with pytest.raises(SingularMatrix):
            fe_import.solver.cholmod.factorize(matrix, analyse(matrix), silent)


# ----- counting modes


@pytest.mark.parametrize("given", ["positions", "nothing"])
def test_modes_are_counted(given: str) -> None:
    """Against LAPACK's spectrum, between its frequencies, from none to most of it below the shift."""
    model = clamped("tet10", (6, 2, 2), (1.0, 0.2, 0.2))
    values = la.eigh(model.stiffness.toarray(), model.mass.toarray(), eigvals_only=True)
    apart = np.flatnonzero(np.diff(values) > 1e-3 * values[:-1])
    positions = model.positions if given == "positions" else None
    for last in apart[:: max(1, len(apart) // 9)]:
        shift = np.sqrt(values[last] * values[last + 1])
        assert modes_below(model.stiffness, model.mass, shift, positions=positions) == last + 1
    assert modes_below(model.stiffness, model.mass, 0.5 * values[0]) == 0


def test_a_count_at_an_eigenvalue_is_not_trusted() -> None:
    stiffness = sp.diags_array(np.arange(1.0, 101.0)).tocsc()
    mass = sp.eye_array(100, format="csc")
    assert modes_below(stiffness, mass, 50.5) == 50
    assert modes_below(stiffness, mass, 50.0) is None


def test_masses_that_couple_what_no_stiffness_does() -> None:
    """The order of elimination then follows from both matrices; given that of the stiffness, it is found anew."""
    model = clamped("hex8", (9, 5, 3), (1.0, 1.0, 1.0))
    size = len(model.positions)
    extra = sp.lil_array((size, size))
    extra[0, size - 1] = extra[size - 1, 0] = 0.2 * model.mass.diagonal().min()
    mass = (model.mass + extra).tocsc()
    values = la.eigh(model.stiffness.toarray(), mass.toarray(), eigvals_only=True)
    shift = np.sqrt(values[9] * values[10])
    elimination = factorize(model.stiffness, "x").elimination
    with pytest.raises(OutsidePattern):
        multifrontal.negative_pivots(model.stiffness, elimination, silent, mass, shift)
    stored = model.stiffness.copy()
    stored.data[np.abs(stored.data) < 1e-9 * stored.data.max()] = 0.0  # as rounding may leave them, in the pattern yet
    for stiffness in (model.stiffness, stored):
        assert modes_below(stiffness, mass, shift, elimination=elimination) == 10


# ----- modes


def test_multiplicities_beyond_the_block_are_found() -> None:
    """Three equal cantilevers of square section, in one mesh without connection: bending in sixes, the rest in threes.

    Blocks have four vectors. Against the spectrum of one of them by LAPACK, to 1e-9.
    """
    one = clamped("hex20", (12, 1, 1), (1.0, 0.1, 0.1))
    expected = la.eigh(one.stiffness.toarray(), one.mass.toarray(), eigvals_only=True, subset_by_index=[0, 3])
    stiffness, mass = (sp.block_diag([m] * 3, format="csc") for m in (one.stiffness, one.mass))
    count = 6
    assert block_size(count) == 4
    omega, modes = lowest_modes(stiffness, mass, count, "bundle")
    np.testing.assert_allclose(omega, np.repeat(np.sqrt(expected[:2]), 3), rtol=1e-9)
    np.testing.assert_allclose(modes.T @ (mass @ modes), np.eye(count), atol=1e-9)
    omega, _ = lowest_modes(stiffness, mass, 12, "bundle")
    np.testing.assert_allclose(omega, np.repeat(np.sqrt(expected), 3), rtol=1e-9)


def test_factorization_serves_again() -> None:
    """Modes with a factorization that is there already are the same to the last bit."""
    model = clamped(*MESHES["beam of tet10"])
    solve = factorize(model.stiffness, "x", model.positions)
    for again, first in zip(
        lowest_modes(model.stiffness, model.mass, 10, "x", solve=solve),
        lowest_modes(model.stiffness, model.mass, 10, "x", positions=model.positions),
        strict=True,
    ):
        np.testing.assert_array_equal(again, first)


@pytest.mark.parametrize("massive", [7, 120])
def test_few_masses(massive: int) -> None:
    """Masses on a few dofs only: all modes there are, or the lowest, as LAPACK has them, to 1e-8."""
    model = clamped(*MESHES["plate of hex8"])
    dofs = np.random.default_rng(3).choice(model.stiffness.shape[0], massive, replace=False)
    diagonal = np.zeros(model.stiffness.shape[0])
    diagonal[dofs] = np.linspace(1.0, 2.0, massive)
    mass = sp.diags_array(diagonal).tocsc()
    omega, modes = lowest_modes(model.stiffness, mass, 12, "plate")
    unit = np.zeros((len(diagonal), massive))
    unit[dofs, np.arange(massive)] = 1.0
    flexibility = spla.splu(model.stiffness).solve(unit)[dofs]
    condensed = la.inv((flexibility + flexibility.T) / 2)
    expected = dense_modes(condensed, np.diag(diagonal[dofs]), 12, "plate")[0]
    np.testing.assert_allclose(omega, expected, rtol=1e-8)
    np.testing.assert_allclose(modes.T @ (mass @ modes), np.eye(len(omega)), atol=1e-9)


# ----- memory and messages


@pytest.mark.parametrize("wrong", [0, 1])
def test_an_untrusted_count_is_taken_elsewhere(wrong: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second shift is tried where the first met a small pivot, and the modes are judged there."""
    model = clamped(*MESHES["beam of tet10"])
    count, shifts = fe_import.solver.sparse.modes_below, []

    def doubtful(stiffness: sp.csc_array, mass: sp.csc_array, shift: float, **options: Any) -> int | None:
        shifts.append(shift)
        return None if len(shifts) == 1 else count(stiffness, mass, shift, **options) + wrong

    monkeypatch.setattr(fe_import.solver.sparse, "modes_below", doubtful)
    with pytest.raises(FEImportError, match="were missed") if wrong else contextlib.nullcontext():
        lowest_modes(model.stiffness, model.mass, 10, "beam", positions=model.positions)
    assert len(set(shifts)) == 2

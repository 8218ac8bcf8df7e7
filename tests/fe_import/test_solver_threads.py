"""Threads of the solver: the same numbers whatever their number, fronts that all of them share, interrupts."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from clamped_boxes import MESHES, clamped, silent

from fe_import.solver import SingularMatrix, analyse, layout, multifrontal, pieces, products
from fe_import.solver.sparse import factorize, lowest_modes, modes_below
from fe_import.solver.threads import side_by_side, threads


@pytest.fixture
def many_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small matrices are cut into pieces as large ones are, and the largest fronts are shared by all threads."""
    monkeypatch.setattr(layout, "_LEAST", 1.0)
    monkeypatch.setattr(pieces, "_WIDE", 1e6)
    monkeypatch.setattr(pieces, "_STRIP", 100)
    monkeypatch.setattr(products, "_LARGE", 1)
    monkeypatch.setattr(products, "_STRIP", 500)


def test_pieces_partition_the_fronts(many_pieces: None) -> None:
    """Every front is in one piece; what a piece touches beyond itself belongs to pieces of later waves."""
    for mesh in MESHES:
        model = clamped(*MESHES[mesh])
        found = analyse(model.stiffness, model.positions).layout
        ends = [(piece.first, piece.stop) for piece in found.pieces]
        assert [first for first, _ in ends] == [0, *(stop for _, stop in ends[:-1])]
        assert ends[-1][1] == len(found.operations)
        assert len(found.pieces) > 16
        places = [found.table[stop, 0] - found.table[first, 0] for first, stop in ends]
        owner = np.repeat([piece.wave for piece in found.pieces], places)
        for piece in found.pieces:
            assert (owner[piece.boundary] > piece.wave).all()
        share = max(found.operations[p.first : p.stop].sum() for p in found.pieces if p.wave == 0)
        assert share <= found.operations.sum() / 16


@pytest.mark.parametrize("mesh", MESHES)
def test_the_number_of_threads_changes_no_bit(mesh: str, many_pieces: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Solutions, modes and counts with one thread, two, and more than processors; and that they are right."""
    model = clamped(*MESHES[mesh])
    right = np.random.default_rng(0).standard_normal((model.stiffness.shape[0], 5))
    found: list[tuple[Any, ...]] = []
    for number in (1, 2, 5):
        monkeypatch.setenv("OMP_NUM_THREADS", str(number))
        assert threads() == number
        solve = factorize(model.stiffness, "x", model.positions)
        omega, modes = lowest_modes(model.stiffness, model.mass, 10, "x", solve=solve)
        shift = (omega[3] ** 2 + omega[4] ** 2) / 2
        count = modes_below(model.stiffness, model.mass, shift, elimination=solve.elimination)
        found.append((solve(right), omega, modes, count))
    solution, omega, _, count = found[0]
    for other in found[1:]:
        for one, two in zip(found[0], other, strict=True):
            np.testing.assert_array_equal(one, two)
    left = model.stiffness @ solution - right
    assert np.abs(left).max() <= 1e-13 * np.abs(model.stiffness).max() * np.abs(solution).max()
    values = np.sort(sla.eigsh(model.stiffness, 10, model.mass, sigma=0.0, return_eigenvectors=False))
    np.testing.assert_allclose(omega**2, values, rtol=1e-8)
    assert count == (values < (omega[3] ** 2 + omega[4] ** 2) / 2).sum()


def test_counts_through_shared_fronts(many_pieces: None) -> None:
    """Negative pivots in fronts above the pieces are counted, too: more than half of all, against LAPACK."""
    model = clamped("tet10", (8, 2, 2), (1.0, 0.2, 0.2))
    values = la.eigh(model.stiffness.toarray(), model.mass.toarray(), eigvals_only=True)
    for last in (0, 20, len(values) // 2, 9 * len(values) // 10):
        assert modes_below(model.stiffness, model.mass, (values[last] + values[last + 1]) / 2) == last + 1


def test_products_are_those_of_scipy(many_pieces: None) -> None:
    """To the last bit, for any number of fields."""
    model = clamped(*MESHES["beam of tet10"])
    for count in (1, 3, 4, 9):
        fields = np.random.default_rng(count).standard_normal((model.mass.shape[0], count))
        np.testing.assert_array_equal(products.times(model.mass, fields), model.mass @ fields)


def test_singular_fronts_above_the_pieces(many_pieces: None) -> None:
    """Between the first two eigenvalues the last front alone fails; where all fail, threads end in order."""
    model = clamped(*MESHES["cube of hex20"])
    first = lowest_modes(model.stiffness, model.mass, 3, "x", positions=model.positions)[0]
    loose = (model.stiffness - first[0] * first[2] * model.mass).tocsc()
    for matrix in (loose, sp.csc_array(model.stiffness * -1)):
        with pytest.raises(SingularMatrix):
            multifrontal.factorize(matrix, analyse(matrix, model.positions), silent)
    factorize(model.stiffness, "x", model.positions)


@pytest.mark.parametrize("number", [1, 3])
def test_interrupts_end_all_threads(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is raised in one thread, here as Ctrl-C would, comes out when all have ended; nothing else is begun."""
    monkeypatch.setenv("OMP_NUM_THREADS", str(number))
    begun: list[int] = []
    ready = threading.Barrier(number, timeout=30)

    def work(item: int) -> None:
        begun.append(item)
        ready.wait()
        if item == 0:
            raise KeyboardInterrupt
        ended.wait(30)

    ended = threading.Event()
    work_of: Callable[[int], None] = work
    threading.Timer(0.2, ended.set).start()
    with pytest.raises(KeyboardInterrupt):
        side_by_side(work_of, list(range(20)))
    assert sorted(begun) == list(range(number))
    assert side_by_side(lambda item: item * item, list(range(20))) == [k * k for k in range(20)]


def test_an_interrupted_factorization_starts_afresh(many_pieces: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    model = clamped(*MESHES["plate of hex8"])
    elimination = analyse(model.stiffness, model.positions)
    right = np.ones(model.stiffness.shape[0])
    expected = multifrontal.factorize(model.stiffness, elimination, silent).solve(right)

    def interrupted(done: float) -> None:
        if done > 0.5 * elimination.operations.sum():
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        multifrontal.factorize(model.stiffness, elimination, interrupted)
    np.testing.assert_array_equal(multifrontal.factorize(model.stiffness, elimination, silent).solve(right), expected)


_PLAIN = """
import sys
import numpy as np
from clamped_boxes import clamped
from fe_import.solver.sparse import factorize, modes_below
model = clamped("tet10", (10, 2, 2), (1.0, 0.2, 0.2))
solve = factorize(model.stiffness, "x", model.positions)
right = np.random.default_rng(0).standard_normal((model.stiffness.shape[0], 2))
np.save(sys.argv[1], solve(right))
assert modes_below(model.stiffness, model.mass, 5e6, elimination=solve.elimination) == int(sys.argv[2])
assert "numba" not in sys.modules
"""


def test_the_same_source_runs_as_plain_python(tmp_path: Path) -> None:
    """With ERLS_JIT=0 nothing is compiled, and solutions agree to rounding times the condition."""
    model = clamped("tet10", (10, 2, 2), (1.0, 0.2, 0.2))
    solve = factorize(model.stiffness, "x", model.positions)
    expected = solve(np.random.default_rng(0).standard_normal((model.stiffness.shape[0], 2)))
    count = modes_below(model.stiffness, model.mass, 5e6, elimination=solve.elimination)
    assert count == 2
    environment = {**os.environ, "ERLS_JIT": "0", "PYTHONPATH": str(Path(__file__).parent)}
    command = [sys.executable, "-c", _PLAIN, str(tmp_path / "x.npy"), str(count)]
    subprocess.run(command, check=True, env=environment)
    np.testing.assert_allclose(np.load(tmp_path / "x.npy"), expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_fronts_wider_than_a_block(many_pieces: None) -> None:
    """A full matrix is one front of several blocks."""
    random = np.random.default_rng(0).standard_normal((1300, 1300))
    matrix = sp.csc_array(random @ random.T + 1300 * np.eye(1300))
    right = np.arange(2600.0).reshape(1300, 2)
    np.testing.assert_allclose(matrix @ factorize(matrix, "x")(right), right, rtol=0, atol=1e-9)

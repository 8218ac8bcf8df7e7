"""Large jobs of the solver: memory known beforehand, refusals, and what is said before a long one."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from clamped_boxes import MESHES, clamped, silent

import fe_import.solver
import fe_import.solver.sparse
from fe_import.errors import Cause, FEImportError
from fe_import.reduce import reduce_link, reduction_summary
from fe_import.solver import SOLVERS, analyse, memory, multifrontal, pieces, watch
from fe_import.solver.sparse import factorize, lowest_modes, modes_below


@pytest.mark.parametrize("mesh", MESHES)
def test_fill_is_counted_before_it_is_there(mesh: str) -> None:
    """Against SuperLU's own count of L in our order: never less, at most a quarter more (fronts are full).

    And no more than 1.5 times that with SuperLU's own order, minimum degree, which is better on small slender meshes
    and worse on compact ones.
    """
    model = clamped(*MESHES[mesh])
    counted = analyse(model.stiffness, model.positions)
    np.testing.assert_array_equal(np.sort(counted.order), np.arange(len(counted.order)))
    permuted = model.stiffness[counted.order][:, counted.order].tocsc()
    options = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    stored = spla.splu(permuted, permc_spec="NATURAL", **options).L.nnz
    assert stored <= counted.nonzeros <= 1.25 * stored
    own = spla.splu(model.stiffness, permc_spec="MMD_AT_PLUS_A", **options).L.nnz
    assert counted.nonzeros <= (1.0 if mesh == "cube of hex20" else 1.5) * own


@pytest.mark.parametrize("keep", [True, False])
@pytest.mark.parametrize("mesh", MESHES)
def test_memory_is_known_beforehand(mesh: str, keep: bool) -> None:
    """Peak of what is allocated during a factorization and a count: within 15 % of what was predicted."""
    model = clamped(*MESHES[mesh])
    elimination = analyse(model.stiffness, model.positions)
    tracemalloc.start()
    try:
        if keep:
            factor = multifrontal.factorize(model.stiffness, elimination, silent)
            assert factor.elimination is elimination
        else:
            multifrontal.negative_pivots(model.stiffness, elimination, silent, model.mass, 0.0)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert 1 / 1.15 < peak / multifrontal.bytes_needed(elimination, keep) < 1.15


@pytest.mark.parametrize("job", ["factorize", "modes", "more modes", "all modes", "count"])
def test_too_large_jobs_are_refused_before_they_start(job: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = clamped(*MESHES["cube of hex20"])
    solve = factorize(model.stiffness, "cube", model.positions)
    monkeypatch.setattr(memory, "SMALL", 0)
    monkeypatch.setattr(memory, "available_memory", lambda: 1_000_000)
    unstarted = replace(SOLVERS["multifrontal"], factorize=lambda *_: pytest.fail("started"))
    monkeypatch.setitem(SOLVERS, "multifrontal", unstarted)
    for name in ("negative_pivots", "lowest_eigenpairs", "dense_modes"):
        monkeypatch.setattr(fe_import.solver.sparse, name, lambda *_: pytest.fail("started"))
    jobs = {
        "factorize": lambda: factorize(model.stiffness, "cube", model.positions),
        "modes": lambda: lowest_modes(model.stiffness, model.mass, 4, "cube", positions=model.positions),
        "more modes": lambda: lowest_modes(model.stiffness, model.mass, 4, "cube", solve=solve),
        "all modes": lambda: lowest_modes(model.stiffness, model.mass, 3000, "cube"),
        "count": lambda: modes_below(model.stiffness, model.mass, 1.0, positions=model.positions),
    }
    with pytest.raises(FEImportError, match="needs more memory than there is") as caught:
        jobs[job]()
    error = caught.value
    assert error.cause is Cause.TOO_LARGE
    assert error.exit_code == 3
    assert "GB" in str(error.value)
    assert error.limit == "0.001 GB available"
    assert "coarser mesh" in error.remedy
    assert str(model.stiffness.shape[0]) in error.message


def test_modes_reserve_memory_for_their_vectors(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the factorization leaves must hold the vectors of the iteration."""
    model = clamped(*MESHES["cube of hex20"])
    monkeypatch.setattr(memory, "SMALL", 0)
    needed = multifrontal.bytes_needed(analyse(model.stiffness, model.positions))
    monkeypatch.setattr(memory, "available_memory", lambda: needed + 1000)
    factorize(model.stiffness, "cube", model.positions)
    with pytest.raises(FEImportError) as caught:
        lowest_modes(model.stiffness, model.mass, 40, "cube", positions=model.positions)
    assert caught.value.cause is Cause.TOO_LARGE


def test_available_memory_is_the_smallest_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Machine, container and own limit; what cannot be read says nothing."""
    for name, text in (("limit", "5000"), ("use", "3000"), ("stat", "anon 7\ninactive_file 1000\n"), ("max", "max")):
        (tmp_path / name).write_text(text)
    group = (*(str(tmp_path / n) for n in ("limit", "use", "stat")), "inactive_file")
    unlimited = (str(tmp_path / "max"), *group[1:])
    free = memory.available_memory()
    assert free is None or free > 0
    monkeypatch.setattr(memory, "_own_limit", lambda: iter(()))
    monkeypatch.setattr(memory, "_machine", lambda: iter([4000]))
    monkeypatch.setattr(memory, "_GROUPS", (unlimited, group))
    assert memory.available_memory() == 3000
    monkeypatch.setattr(memory, "_GROUPS", (unlimited, (str(tmp_path / "absent"), *group[1:])))
    assert memory.available_memory() == 4000
    monkeypatch.setattr(memory, "_machine", lambda: iter(()))
    assert memory.available_memory() is None
    monkeypatch.setattr(memory, "SMALL", 0)
    memory.refuse_too_large(10**18, "job")  # nothing is known: not refused


def test_long_jobs_are_announced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Size and time before, percentages on the way; nothing to anyone else."""
    model = clamped(*MESHES["cube of hex20"])
    monkeypatch.setattr(fe_import.solver.sparse, "_ANNOUNCED", 0.0)
    monkeypatch.setattr(watch, "_INTERVAL", 0.0)
    monkeypatch.setattr(pieces, "_SLICE", 1.0)  # one front
    heard: list[str] = []
    with watch.telling(heard.append), watch.telling(None):
        solve = factorize(model.stiffness, "stiffness of the cube", model.positions)
    assert str(model.stiffness.shape[0]) in heard[0]
    assert "GB, about" in heard[0]
    shares = [float(line.split(": ")[1].split(" %")[0]) for line in heard[1:]]
    assert len(shares) > 10
    assert shares == sorted(shares)
    assert shares[-1] == 100
    assert len(solve.elimination.rows) >= len(shares)
    said = len(heard)
    factorize(model.stiffness, "stiffness of the cube", model.positions)
    assert len(heard) == said


def test_a_reduction_says_so_at_the_door(monkeypatch: pytest.MonkeyPatch) -> None:
    """Through `reduce_link`: the solver in the provenance, messages to the caller, refusal of what does not fit."""
    link = Path(__file__).parents[2] / "data/l_shape/links/solid.toml"
    monkeypatch.setattr(fe_import.solver.sparse, "_ANNOUNCED", 0.0)
    heard: list[str] = []
    model = reduce_link(link, heard.append)
    assert model.provenance["solver"] == reduction_summary(model)["solver"] == "multifrontal"
    assert {line.split(":")[0] for line in heard} >= {"factorizing the stiffness of the inner nodes", "counting modes"}
    monkeypatch.setattr(memory, "SMALL", 0)
    monkeypatch.setattr(memory, "available_memory", lambda: 1_000_000)
    with pytest.raises(FEImportError) as caught:
        reduce_link(link)
    assert caught.value.cause is Cause.TOO_LARGE

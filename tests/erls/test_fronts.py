"""Sparse factors front by front: against dense solutions and bands, and what says which of them a system takes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from test_shell_chains import arm, described, strip

from erls.equations.nodal import assembly, elimination, matrix
from erls.equations.nodal.equations import Nodal
from erls.equations.nodal.joints import JointRows
from erls.equations.nodal.nodes import numbers_of
from erls.maths import fronts
from erls.maths.front_plan import FrontPlan, front_plan, least_degree
from erls.maths.jit import plain
from erls.scene.build import build_mechanism
from erls.scene.read import load_chain

Array = NDArray[np.float64]


def _grid(nx: int, ny: int) -> NDArray[np.int64]:
    """Pairs of nodes that meet in quadrangles."""
    at = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    cells = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    return np.concatenate([cells[:, [i, j]] for i in range(4) for j in range(i)])


def _random(plan: FrontPlan, sizes: NDArray[np.int64], pairs: NDArray[np.int64]) -> tuple[Array, Array]:
    """A matrix with the pattern of a plan, dense and as entries."""
    rng, n = np.random.default_rng(3), int(sizes.sum())
    begins = np.zeros(len(sizes), dtype=np.int64)
    begins[plan.groups] = np.cumsum(sizes[plan.groups]) - sizes[plan.groups]
    dense, entries = np.zeros((n, n)), np.zeros(plan.entries)
    own = np.arange(len(sizes))
    every = np.unique(np.concatenate([pairs, pairs[:, ::-1], np.stack([own, own], axis=1)]), axis=0)
    for a, b in every.tolist():
        block = rng.normal(size=(sizes[a], sizes[b])) + 9.0 * (a == b) * np.eye(sizes[a], sizes[b])
        dense[begins[a] : begins[a] + sizes[a], begins[b] : begins[b] + sizes[b]] = block
        at, apart = plain(fronts.spot)(plan.fronts, plan.later, plan.front_of, int(begins[a]), int(begins[b]))
        for i, row in enumerate(block):
            entries[at + i * apart : at + i * apart + len(row)] = row
    return dense, entries


def test_fronts_solve_as_dense_factors_do() -> None:
    """Groups of one to three unknowns on a grid, with row exchanges, forward and transposed; where it is singular."""
    pairs, sizes = _grid(8, 7), 1 + np.arange(72) % 3
    plan = front_plan(least_degree(72, pairs), sizes, pairs)
    assert len(plan.fronts) > 8
    dense, entries = _random(plan, sizes, pairs)
    n = len(dense)
    kept, stack, pivots = entries.copy(), np.zeros(plan.stack), np.zeros(n)
    assert plain(fronts.factor)(entries, plan.fronts, plan.into, stack, pivots) == 0
    right = np.random.default_rng(4).normal(size=n)
    for full, solve in ((dense, fronts.solve), (dense.T, fronts.solve_transposed)):
        values = right.copy()
        plain(solve)(entries, plan.fronts, plan.later, pivots, values)
        np.testing.assert_allclose(values, np.linalg.solve(full, right), rtol=0, atol=1e-12 * np.abs(values).max())
    kept[plan.fronts[-1, fronts.BEGIN] :] = 0.0  # the last front meets what the others leave, and no entry of its own
    alone = kept.copy()
    alone[: plan.fronts[1, fronts.BEGIN]] = 0.0
    assert plain(fronts.factor)(alone, plan.fronts, plan.into, stack, pivots) == 1


def test_fronts_and_bands_solve_the_same_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a plate on a hinge: the solution with either."""
    described(tmp_path, strip(5, 4))
    mechanism = build_mechanism(load_chain(arm(tmp_path, "nodal"))).mechanism
    found = []
    for way in (elimination.fronted, elimination.banded):
        monkeypatch.setattr(assembly, "elimination", lambda *given, way=way: way(*given[:3]))
        system = Nodal(mechanism).system
        assert (system.elimination.width < 0) == (not found)
        memory, rest = (system.flat.reals, system.flat.integers, system.flat.scratch), np.zeros(system.size)
        factors = np.zeros(system.flat.factors)
        system.residual(0.0, system.start, rest, rest)
        assert matrix.factor(*memory, 0.0, numbers_of(system.start), rest, 0.0, 1e-6, factors) == 0
        values = np.random.default_rng(5).normal(size=system.size + system.constraints)
        matrix.solve(*memory[:2], factors, values)
        found.append(values)
    np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-9 * np.abs(found[1]).max())


def test_what_is_less_work_is_taken() -> None:
    """Surfaces take fronts, chains keep bands; a node without mass asks for exchanges at will."""
    rows, chain = JointRows([]), np.stack([np.arange(40), np.arange(1, 41)], axis=1)
    assert elimination.elimination(41, chain, rows, True).width == 11
    assert elimination.elimination(17 * 17, _grid(16, 16), rows, True).width < 0
    assert elimination.elimination(17 * 17, _grid(16, 16), rows, False).width > 100

"""Forces, mass matrices and conditions of loops at many states: those of one state after the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scenes

from erls.equations.formulation import TreeFormulation
from erls.equations.loops.tied import Tied
from erls.equations.registry import TREES
from erls.equations.serial.formulation import residual
from erls.equations.series import mass_series, places_within, residual_series
from erls.scene.build import build_mechanism
from erls.scene.read import load_chain

TIMES = np.array([0.0, 0.03, 0.2])


def states(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(3)
    return tuple(scale * random.standard_normal((len(TIMES), n)) for scale in (1e-3, 1.0, 10.0))  # type: ignore[return-value]


def tree_of(path: Path, formulation: str) -> TreeFormulation:
    scene = load_chain(path, [f"simulation.formulation={formulation}"])
    return TREES[formulation](build_mechanism(scene).mechanism, scene.record.simulation)


def test_trees_one_by_one(tmp_path: Path) -> None:
    for formulation in TREES:
        system = tree_of(scenes.three_links(tmp_path), formulation)
        assert system.compiled is not None
        y, v, a = states(system.size)
        found = residual_series(system.compiled, TIMES, y, v, a)
        assert np.array_equal(found, [system.residual(*at) for at in zip(TIMES, y, v, a, strict=True)])
        still = residual_series(system.compiled, TIMES, y, v, np.zeros((3, 0)))
        expected = [system.residual(*at, np.zeros(0)) for at in zip(TIMES, y, v, strict=True)]
        assert np.array_equal(still, expected)
        masses = mass_series(system.compiled, TIMES, y)
        assert np.array_equal(masses, [system.mass_matrix(t, q) for t, q in zip(TIMES, y, strict=True)])


def test_what_residuals_leave_one_by_one(tmp_path: Path) -> None:
    """Links' wrenches and efforts read at places of flat memory are those that stand there after each residual."""
    for formulation in TREES:
        system = tree_of(scenes.three_links(tmp_path), formulation)
        y, v, a = states(system.size)
        views = [view for views in system.borne() for view in views]
        found = system.left_by_residuals(views, TIMES, y, v, a)
        for i, (t, *at) in enumerate(zip(TIMES.tolist(), y, v, a, strict=True)):
            residual(system.complete, t, *at)
            assert all(np.array_equal(of[i], view) for of, view in zip(found, views, strict=True))


def test_places_of_views() -> None:
    memory, other = np.arange(12.0), np.arange(3.0)
    views = [memory[3:5], memory[:8].reshape(2, 4)[:, 1:3], memory[11:]]
    places = places_within(memory, views)
    assert places is not None
    assert places.tolist() == [3, 4, 1, 2, 5, 6, 11]
    assert places_within(memory, [memory[3:5], other]) is None


def test_loops_one_by_one() -> None:
    tied = Tied(tree_of(scenes.ROOT / "data" / "four_bar" / "flexible.toml", "erls"))
    whole = tied.whole
    y, v, a = states(tied.size)
    rows = np.array([whole.closure(t, q, 0 * q).rows[:, tied.bare.free] for t, q in zip(TIMES, y, strict=True)])
    assert np.allclose(whole.gradients(TIMES, y), rows, rtol=1e-12, atol=1e-12)
    multipliers = np.random.default_rng(4).standard_normal((len(TIMES), whole.kept))
    expected = [whole.forces(*at) + row.T @ m for *at, row, m in zip(TIMES, y, v, a, rows, multipliers, strict=True)]
    assert np.allclose(whole.held(TIMES, y, v, a, multipliers), expected, rtol=1e-12, atol=1e-12)

"""Compiled closed chains: against dense solutions, against the same source uncompiled, and in runs."""

from __future__ import annotations

from pathlib import Path

import loop_cases
import loop_scenes
import numpy as np
import pytest
from chain_cases import State, evaluate
from twins import distance, uncompiled

from erls.equations.loops.closed_chain import DECAY, ClosedChain
from erls.errors import Cause, SimulationError
from erls.integrate.base import Options, Solution
from erls.integrate.closed_loops import Watch, loop_integrator

SOME = dict.fromkeys(loop_scenes.FORMULATIONS, ("controlled turn", "driven slide", "spherical", "two loops"))
SOME["erls"] = tuple(loop_cases.CASES)
DENSE = 1e-10  # relative: two orders of summation, through about a hundred terms
LIKE_TWIN = 1e-11  # relative: sums in another order, through matrices of a condition of about 1e3


def _acting(closed: ClosedChain, at: State) -> tuple[np.ndarray, np.ndarray]:
    """Mass matrix and M a - f at a = 0 of the chain, with rotors and forces along closing joints put in by hand."""
    tree, found = closed.bare, closed.closure(at.t, at.y, at.v)
    mass, force = tree.mass_matrix(at.t, at.y), tree.residual(at.t, at.y, at.v, np.zeros(closed.size))
    for loop, moves, acts in zip(closed.mechanism.loops, found.moves, found.efforts, strict=True):
        if (free := loop.freedom) is not None:
            row = moves[free.freedom.row, tree.free]
            mass = mass + free.rotor_inertia * np.outer(row, row)
            force = force + row * (free.rotor_inertia * acts.turning - acts.force)
    return mass, force


@pytest.mark.parametrize(("form", "name"), [(form, name) for form in loop_scenes.FORMULATIONS for name in SOME[form]])
def test_accelerations_solve_the_whole_system(form: str, name: str, tmp_path: Path) -> None:
    """[M, Φᵀ; Φ, 0] solved at once, over the equations of every formulation."""
    closed = ClosedChain(loop_scenes.tree(loop_cases.mechanism(tmp_path, name), form))
    at = loop_cases.states(closed, name)[1]
    assert closed.compiled is not None
    found, closure, n = evaluate(closed.compiled, at), closed.closure(at.t, at.y, at.v), closed.size
    mass, force = _acting(closed, at)
    rows = closure.rows[closed.kept][:, closed.bare.free]
    wanted = (closure.bias + 2 * DECAY * closure.rate + DECAY**2 * closure.violation)[closed.kept]
    whole = np.block([[mass, rows.T], [rows, np.zeros((len(rows), len(rows)))]])
    scale = 1 / np.sqrt(np.concatenate([np.diag(mass), np.diag(rows @ np.linalg.solve(mass, rows.T))]))
    solved = scale * np.linalg.solve(scale[:, None] * whole * scale, -scale * np.concatenate([force, wanted]))
    assert distance(found["mass"], mass) <= DENSE
    assert distance(found["acceleration"] * closed.metres, solved[:n] * closed.metres) <= DENSE
    assert distance(found["residual"], mass @ at.a + force + rows.T @ solved[n:]) <= DENSE


def test_kernels_equal_their_uncompiled_twin(tmp_path: Path) -> None:
    """The same source as plain Python (``ERLS_JIT=0``) in a process of its own, steps included."""
    found, twin = loop_cases.all_results(tmp_path), uncompiled(loop_cases, tmp_path)
    assert set(twin) == set(found)
    for key, values in found.items():
        # all but masses have been solved for, as accelerations of open chains
        limit = LIKE_TWIN if key.endswith("mass") else DENSE
        assert distance(values, twin[key]) <= limit, key


@pytest.mark.parametrize("name", ["torque on a slide", "controlled turn", "two loops"])
def test_compiled_steps_are_those_of_single_steps(name: str, tmp_path: Path) -> None:
    """Generalized-α: the same knots and the same work over breakpoints of drives; loops closed as well."""
    closed = loop_cases.chain(tmp_path, name)
    y, v = closed.initial_state()
    fast, slow = (loop_cases.steps(closed, y, v, 0.06, 2e-3, compiled) for compiled in (True, False))
    assert fast.failure is slow.failure is None
    np.testing.assert_array_equal(fast.t, slow.t)
    np.testing.assert_allclose(fast.y * closed.metres, slow.y * closed.metres, atol=1e-9)
    assert fast.work.steps == slow.work.steps
    # where an estimate meets the tolerance to rounding, one iteration more or less
    assert fast.work.rhs_calls == pytest.approx(slow.work.rhs_calls, rel=0.02)
    assert fast.work.factorizations == pytest.approx(slow.work.factorizations, abs=4)
    gaps = [
        max(np.abs(closed.openings(closed.closure(*knot))).max() for knot in zip(s.t.tolist(), s.y, s.v, strict=True))
        for s in (fast, slow)
    ]
    assert gaps[0] <= max(1e-12, 2 * gaps[1])


def test_compiled_steps_fail_alike(tmp_path: Path) -> None:
    """Friction that sticks at once in the closing joint: halved steps, and at the end the same cause."""
    data = loop_scenes.four_bar()
    data["joints"][0]["initial"]["rate"] = 5.0
    data["loops"][0]["friction"] = {"force": 3e4, "transition_rate": 1e-7}
    closed = loop_scenes.chain(tmp_path, data)
    y, v = closed.initial_state()
    fast, slow = (loop_cases.steps(closed, y, v, 0.01, 1e-3, compiled) for compiled in (True, False))
    assert fast.work.rejected_steps == slow.work.rejected_steps > 0
    assert fast.failure is not None
    assert slow.failure is not None
    assert (fast.failure.cause, fast.failure.where) == (slow.failure.cause, slow.failure.where)


def test_lobatto_runs_compiled_loops(tmp_path: Path) -> None:
    """A run in compiled chunks is that of single steps: knots to a tenth of the tolerance 1e-5 m."""
    closed = loop_cases.chain(tmp_path, "torque on a slide")
    y, v = closed.initial_state()
    plain = ClosedChain(closed.bare)
    plain.compiled = None
    fast, slow = (loop_integrator("lobatto")(chain, (0.0, 0.04), y, v, Options()) for chain in (closed, plain))
    assert fast.failure is slow.failure is None
    assert fast.work.rhs_calls == pytest.approx(slow.work.rhs_calls, rel=0.05)
    ends = [closed.closed(0.04, s.y[-1], s.v[-1])[0] * closed.metres for s in (fast, slow)]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-6)


def test_what_nothing_resists_is_named(tmp_path: Path) -> None:
    """A rocker without mass: the status says so, and the run names its joint."""
    data = loop_scenes.four_bar()
    data["links"][2]["rigid"] |= {"mass": 0.0, "inertia": [0.0, 0.0, 0.0]}
    closed = loop_scenes.chain(tmp_path, data)
    y, v = closed.initial_state()
    system = closed.compiled
    assert system is not None
    assert system.acceleration(system.reals, system.integers, system.scratch, 0.0, y, v, np.empty(closed.size)) > 0
    failure = loop_integrator("lobatto")(closed, (0.0, 0.01), y, v, Options()).failure
    assert failure is not None
    assert failure.cause == Cause.SINGULAR_MASS
    assert "joint 'j2'" in str(failure)


def test_a_lock_ends_compiled_chunks_there(tmp_path: Path) -> None:
    """Conditions that a chunk of steps met on its way are refused where they were: no knot lies behind."""
    closed = loop_scenes.chain(tmp_path, loop_scenes.four_bar())
    assert closed.compiled is not None
    y, v = closed.initial_state()
    away = y + np.array([0.0, 0.3, 0.0])
    gaps, stiffest = closed.compiled.watched(np.zeros(3), np.array([y, away, y]))
    expected = [closed.closure(0.0, place, v) for place in (y, away)]
    np.testing.assert_allclose(gaps[:2], [np.abs(closed.openings(found)).max() for found in expected], atol=1e-12)
    np.testing.assert_allclose(stiffest[:2], [closed.stiffest(found)[0] for found in expected], rtol=1e-6)
    watch = Watch(closed, None)
    knots = Solution(np.arange(4.0), *(np.array([y, y, away, y]),) * 3)
    with pytest.raises(SimulationError, match="comes apart") as caught:
        watch(3.0, lambda: knots)
    assert caught.value.cause == Cause.LOOP_OPEN
    assert watch.good == knots.t[2]

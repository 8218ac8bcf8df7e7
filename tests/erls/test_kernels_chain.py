"""Compiled chains: against the NumPy equations, against the same source uncompiled, and under generalized-α."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import chain_cases
import numpy as np
import pytest
import scenes
from twins import Plain, distance, uncompiled

from erls.equations.erls.paper.dense_chain import DenseChain
from erls.integrate.base import Options
from erls.integrate.generalized_alpha import generalized_alpha

LIKE_NUMPY = 1e-10  # relative: two orders of summation, through about a hundred terms
LIKE_TWIN = 1e-12


@pytest.mark.parametrize("name", chain_cases.DENSE)
def test_the_recursion_equals_the_dense_equations_of_the_paper(name: str, tmp_path: Path) -> None:
    """Residual (joints and modes apart), mass, stiffness, damping, acceleration (condition up to 1e8)."""
    recursion = chain_cases.equations(tmp_path, name)
    chain = DenseChain(recursion.mechanism, "joint-angle")
    f = len(chain.free_joints)
    for at in chain_cases.states(recursion, name):
        found = chain_cases.evaluate(recursion.compiled, at)
        residual = chain.residual(at.t, at.y, at.v, at.a)
        assert distance(found["residual"][:f], residual[:f]) <= LIKE_NUMPY
        assert distance(found["residual"][f:], residual[f:]) <= LIKE_NUMPY
        assert distance(found["mass"], chain.mass_matrix(at.t, at.y)) <= LIKE_NUMPY
        stiffness, damping = chain.stiffness_and_damping(at.t, at.y, at.v)
        assert distance(found["stiffness"], stiffness) <= LIKE_NUMPY
        assert distance(found["damping"], damping) <= LIKE_NUMPY
        if np.linalg.eigvalsh(found["mass"])[0] > 0:  # inertia linear in the deformation alone need not be positive
            assert distance(found["acceleration"], chain.acceleration(at.t, at.y, at.v)) <= LIKE_NUMPY
        else:
            assert name in ("without inertia_second_order", "only inertia_first_order")


def test_modes_alone_feel_what_the_elastic_forces_hide(tmp_path: Path) -> None:
    """Undeformed, without the stiffness that dwarfs them, inertia forces on the modes agree too."""
    for name in ("axes that part", "parallel axes", "controllers"):
        recursion = chain_cases.equations(tmp_path, name)
        chain = DenseChain(recursion.mechanism, "joint-angle")
        at = chain_cases.states(recursion, name)[0]
        f = len(chain.free_joints)
        y = np.concatenate([at.y[:f], 0 * at.y[f:]])
        found = chain_cases.evaluate(recursion.compiled, chain_cases.State(at.t, y, at.v, at.a))["residual"]
        assert distance(found[f:], chain.residual(at.t, y, at.v, at.a)[f:]) <= LIKE_NUMPY


def test_kernels_equal_their_uncompiled_twin(tmp_path: Path) -> None:
    """The same source as plain Python (``ERLS_JIT=0``) in a process of its own."""
    found, twin = chain_cases.all_results(tmp_path), uncompiled(chain_cases, tmp_path)
    assert set(twin) == set(found)
    for key, values in found.items():
        # rounding counts with the condition of what is solved, up to 1e8
        limit = LIKE_NUMPY if key.endswith("acceleration") or "solved" in key else LIKE_TWIN
        assert distance(values, twin[key]) <= limit, key


def test_what_nothing_resists_is_named(tmp_path: Path) -> None:
    """The status counts the joint whose motion no inertia opposes: a massless link behind a flexible one."""
    scenes.arm_link(tmp_path)
    data = {
        "simulation": {"duration": 1.0},
        "joints": [
            {"name": n, "dh": {"convention": "standard", "a": 0.4, "alpha_deg": a}}
            for n, a in (("a", 30.0), ("b", 0.0))
        ],
        "links": [
            {"name": "a", "model": "arm.toml", "mesh_pose": {"frame": "joint"}},
            {"name": "b", "rigid": {"mass": 0.0, "points": {"start": [0, 0, 0], "end": [1, 0, 0]}}},
        ],
    }
    chain = scenes.equations(scenes.write_toml(tmp_path / "light.toml", data))
    system = chain.compiled
    assert system is not None
    y, v = chain.initial_state()
    status = system.acceleration(system.reals, system.integers, system.scratch, 0.0, y, v, np.empty(chain.size))
    assert status == 1 + 1


RUNS = ("one link, payload, spring", "parallel axes with a slide", "prescribed in the middle")


@pytest.mark.parametrize("name", RUNS)
def test_generalized_alpha_takes_the_same_steps(name: str, tmp_path: Path) -> None:
    """Compiled loop and NumPy algorithm: the same knots and the same work over breakpoints of drives."""
    chain = chain_cases.equations(tmp_path, name)
    y, v = chain.initial_state()
    options = Options(step=2e-3)
    fast = generalized_alpha(chain, (0.0, 0.2), y, v, options)
    slow = generalized_alpha(Plain(chain), (0.0, 0.2), y, v, options)
    assert fast.failure is None
    np.testing.assert_array_equal(fast.t, slow.t)
    np.testing.assert_allclose(fast.y, slow.y, atol=1e-10 * np.abs(slow.y).max())
    assert fast.work.steps == slow.work.steps
    # where an estimate meets the tolerance to rounding, one iteration more or less
    assert fast.work.rhs_calls == pytest.approx(slow.work.rhs_calls, rel=0.02)
    assert fast.work.factorizations == pytest.approx(slow.work.factorizations, abs=4)


@pytest.mark.parametrize("of", [lambda chain: chain, Plain], ids=["compiled", "NumPy"])
def test_motors_at_their_limit_do_not_stall_the_integrator(of: Any, tmp_path: Path) -> None:
    """Budget: while a motor gives all it can its gains are none; with them 63,774 steps were taken instead of 237."""
    chain = chain_cases.equations(tmp_path, "controllers")
    y, v = chain.initial_state()
    work = generalized_alpha(of(chain), (0.0, 0.2), y, v, Options(step=2e-3)).work
    assert work.steps <= 300
    assert work.rejected_steps <= 50


def test_generalized_alpha_halves_and_fails_alike(tmp_path: Path) -> None:
    """Friction that sticks at once: halved steps, and at the end the same cause."""
    scenes.l_link(tmp_path)
    hard = {"friction": {"force": 3e4, "transition_rate": 1e-7}, "initial": {"rate": 2.0}}
    chain = scenes.equations(scenes.l_scene(tmp_path, joints=[{**scenes.L_SCENE["joints"][0], **hard}]))
    y, v = chain.initial_state()
    fast = generalized_alpha(chain, (0.0, 0.01), y, v, Options(step=1e-3))
    slow = generalized_alpha(Plain(chain), (0.0, 0.01), y, v, Options(step=1e-3))
    assert fast.work.rejected_steps == slow.work.rejected_steps > 0
    assert fast.failure is not None
    assert slow.failure is not None
    assert (fast.failure.cause, fast.failure.where) == (slow.failure.cause, slow.failure.where)


def test_work_of_the_l() -> None:
    """Budget: at h = 1 ms at most 2.4 residuals a step and a factorization every 15 steps (measured 2.3 and 16.4)."""
    chain = scenes.equations(scenes.ROOT / "data/l_shape/steel_flat.toml")
    y, v = chain.initial_state()
    work = generalized_alpha(chain, (0.0, 2.0), y, v, Options(step=1e-3)).work
    assert (work.steps, work.rejected_steps) == (2000, 0)
    assert work.rhs_calls <= 2.4 * work.steps
    assert work.factorizations <= work.steps / 15

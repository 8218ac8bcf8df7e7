"""Compiled floating frames: against the same source uncompiled, and in runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import chain_cases
import ffr_cases
import numpy as np
import pytest
import scenes
from twins import Plain, distance, uncompiled

from erls.equations.erls.formulation import Erls
from erls.equations.ffr.formulation import Ffr
from erls.equations.registry import formulate
from erls.equations.serial.nodes import turn_factors
from erls.equations.substructures import Substructured
from erls.integrate.base import Options
from erls.integrate.generalized_alpha import generalized_alpha
from erls.integrate.lobatto import lobatto
from erls.maths.coefficients import stumpff
from erls.maths.jit import plain
from erls.scene.build import build_mechanism
from erls.scene.read import load_scene

LIKE_NUMPY = 1e-10  # relative: two orders of summation, through about a hundred terms
LIKE_TWIN = 1e-12
LIKE_SOLVED = 1e-9


@pytest.mark.parametrize("case", ffr_cases.CASES)
def test_mass_matrices_are_symmetric(case: str, tmp_path: Path) -> None:
    """To the last digit; their values and those of all functions stand in `test_frozen_values`."""
    chain = ffr_cases.equations(tmp_path, case)
    for at in chain_cases.states(chain, case):
        mass = chain.mass_matrix(at.t, at.y)
        np.testing.assert_array_equal(mass, mass.T)
        if np.linalg.eigvalsh(mass)[0] <= 0:  # inertia linear in the deformation alone need not be positive
            assert case in ("tangent: without inertia_second_order", "tangent: only inertia_first_order")


def test_kernels_equal_their_uncompiled_twin(tmp_path: Path) -> None:
    """The same source as plain Python (``ERLS_JIT=0``) in a process of its own."""
    found, twin = ffr_cases.all_results(tmp_path), uncompiled(ffr_cases, tmp_path)
    assert set(twin) == set(found)
    for key, values in found.items():
        # rounding counts with the condition of what is solved: up to 1e8, and 1e9 of complex matrices on mean axes
        limit = LIKE_SOLVED if "solved" in key else LIKE_NUMPY if key.endswith("acceleration") else LIKE_TWIN
        assert distance(values, twin[key]) <= limit, key


@pytest.mark.parametrize("s", [0.0, 1e-9, 9.99e-3, 1.001e-2, 0.499, 0.501, 4.0])
def test_turn_factors(s: float) -> None:
    """(1 - cos φ)/φ² and (φ - sin φ)/φ³ with their derivatives: both lengths of the series and the closed form, which
    takes differences of numbers of 0.3.
    """
    _, c2, c3, c4, c5, _, _ = plain(stumpff)(s)  # c_k' = (k c_k+2 - c_k+1)/2
    expected = c2, (2 * c4 - c3) / 2, c3, (3 * c5 - c4) / 2
    np.testing.assert_allclose(plain(turn_factors)(s), expected, rtol=2e-15, atol=3e-16)


def _l(tolerance: float, duration: float) -> tuple[Ffr, Any]:
    chain = Ffr(scenes.mechanism(scenes.ROOT / "data/l_shape/steel_tall.toml"))
    y, v = chain.initial_state()
    return chain, lobatto(chain, (0.0, duration), y, v, Options(tolerance=tolerance))


def test_a_compiled_run_keeps_its_energy() -> None:
    """The tall L falls: what Lobatto's steps lose goes with the tolerance, to 1e-9 of the energy that moves."""
    drifts = []
    for tolerance in (1e-6, 1e-9):
        chain, found = _l(tolerance, 0.2)
        assert found.failure is None
        some = range(0, len(found.t), max(1, len(found.t) // 200))
        energies = [chain.energy(found.t[k], found.y[k], found.v[k]) for k in some]
        drifts.append(float(np.ptp([e.total for e in energies]) / max(e.kinetic for e in energies)))
    assert drifts[1] <= 1e-9
    assert drifts[1] <= drifts[0] / 100


def test_one_link_runs_as_in_erls() -> None:
    """In its tangent frame the link on the ground is that of ERLS: compiled runs of both, 1e-9 m."""
    chain, ours = _l(1e-8, 0.2)
    other = Erls(chain.mechanism)
    theirs = lobatto(other, (0.0, 0.2), *other.initial_state(), Options(tolerance=1e-8))
    apart = (ours.y[-1] - theirs.y[-1]) * chain.length_scales
    assert np.abs(apart).max() <= 1e-9


RUNS = ("tangent stiffened: prescribed in the middle", "mean-axis: parallel axes with a slide")


@pytest.mark.parametrize("case", RUNS)
def test_generalized_alpha_takes_the_same_steps(case: str, tmp_path: Path) -> None:
    """Compiled loop and NumPy algorithm: the same knots and the same work over breakpoints of drives."""
    chain = ffr_cases.equations(tmp_path, case)
    y, v = chain.initial_state()
    options = Options(step=2e-3)
    fast = generalized_alpha(chain, (0.0, 0.1), y, v, options)
    slow = generalized_alpha(Plain(chain), (0.0, 0.1), y, v, options)
    assert fast.failure is None
    np.testing.assert_array_equal(fast.t, slow.t)
    np.testing.assert_allclose(fast.y, slow.y, atol=1e-10 * np.abs(slow.y).max())
    # where an estimate meets the tolerance to rounding, one iteration more or less
    assert fast.work.rhs_calls == pytest.approx(slow.work.rhs_calls, rel=0.02)
    assert fast.work.factorizations == pytest.approx(slow.work.factorizations, abs=4)


def test_pieces_of_links_run_compiled() -> None:
    """Substructures are a chain of more links."""
    changes = ["links.0.substructures=2", "simulation.formulation=ffr"]
    scene = load_scene(scenes.ROOT / "data/robot/two_link.toml", changes)
    mechanism = build_mechanism(scene).mechanism
    pieces = formulate(mechanism, scene.record.simulation)
    assert isinstance(pieces, Substructured)
    assert getattr(pieces.inner, "compiled", None) is not None


def _status(chain: Ffr, y: np.ndarray) -> int:
    system = chain.compiled
    assert system is not None
    constants = system.reals, system.integers, system.scratch
    return system.acceleration(*constants, 0.0, y, 0 * y, np.empty(chain.size))


def test_what_nothing_resists_is_named(tmp_path: Path) -> None:
    """The status counts the joint whose motion no inertia opposes: a massless link behind a flexible one."""
    scenes.arm_link(tmp_path)
    data = {
        "simulation": {"duration": 1.0},
        "joints": [{"name": n, "dh": {"convention": "standard", "a": 0.4, "alpha_deg": 30.0}} for n in "ab"],
        "links": [
            {"name": "a", "model": "arm.toml", "mesh_pose": {"frame": "joint"}},
            {"name": "b", "rigid": {"mass": 0.0, "points": {"start": [0, 0, 0], "end": [1, 0, 0]}}},
        ],
    }
    chain = Ffr(scenes.mechanism(scenes.write_toml(tmp_path / "light.toml", data)))
    assert _status(chain, chain.initial_state()[0]) == 1 + 1


def test_what_is_not_positive_or_not_finite_has_a_status(tmp_path: Path) -> None:
    """Inertia linear in a large deformation alone; an infinite coordinate."""
    chain = ffr_cases.equations(tmp_path, "tangent: only inertia_first_order")
    y, _ = chain.initial_state()
    assert _status(chain, y) == 0
    rng = np.random.default_rng(5)
    states = [np.concatenate([y[:2], rng.uniform(-10, 10, chain.size - 2)]) for _ in range(20)]
    for state in states:
        assert (_status(chain, state) > 0) == (np.linalg.eigvalsh(chain.mass_matrix(0.0, state))[0] <= 0)
    assert any(_status(chain, state) > 0 for state in states)
    y[-1] = np.nan
    assert _status(chain, y) > 0

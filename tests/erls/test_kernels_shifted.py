"""Iteration matrices solved link by link: against dense ones, and under both implicit integrators."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import chain_cases
import ffr_cases
import numpy as np
import pytest
import scenes

from erls.equations.erls.formulation import Erls
from erls.equations.erls.pack import combined_modes, pack_chain
from erls.equations.ffr.formulation import Ffr
from erls.equations.ffr.pack import pack_frames
from erls.equations.serial.decoupled_modes import decoupled_modes
from erls.integrate.base import Options
from erls.integrate.generalized_alpha import generalized_alpha
from erls.integrate.lobatto import lobatto


def _damping(chain: Erls, whole: np.ndarray) -> np.ndarray:
    """The damping matrix without what couples coordinates that diagonalize mass and stiffness of a link."""
    result, first = whole.copy(), len(chain.free_joints)
    for k, link in enumerate(chain.mechanism.links):
        places = first + np.arange(link.elastic_modes)
        first += link.elastic_modes
        part = np.ix_(places, places)
        modes = combined_modes(link, chain.mechanism.joints[k])
        own_mass = (modes.T @ link.invariants.m @ modes)[6:, 6:]
        vectors = decoupled_modes(own_mass, link.stiffness, link.damping).vectors
        if len(places):
            inverse = np.linalg.inv(vectors)
            result[part] = inverse.T @ np.diag(np.diag(vectors.T @ whole[part] @ vectors)) @ inverse
    return result


@pytest.mark.parametrize("name", chain_cases.CASES)
def test_link_by_link_solves_what_dense_factors_solve(name: str, tmp_path: Path) -> None:
    """Real and complex shifts, after factors of other shifts and states in the same memory."""
    chain = chain_cases.equations(tmp_path, name)
    at = chain_cases.states(chain, name)[1]
    assert chain.compiled is not None
    matrices = chain_cases.evaluate(chain.compiled, at)
    damping = _damping(chain, matrices["damping"])
    for kind, found in chain_cases.solved(pack_chain(chain.mechanism, dense=0), at).items():
        expected, rounding = chain_cases.solved_densely(matrices, damping, at, kind)
        np.testing.assert_allclose(found, expected, rtol=0, atol=rounding)


@pytest.mark.parametrize("case", ffr_cases.CASES)
def test_floating_frames_solve_what_dense_factors_solve(case: str, tmp_path: Path) -> None:
    """The same for FFR: both body frames, with second-order displacements and without, rigid links among others."""
    chain = ffr_cases.equations(tmp_path, case)
    at = chain_cases.states(chain, case)[1]
    assert chain.compiled is not None
    matrices = chain_cases.evaluate(chain.compiled, at)
    for kind, found in chain_cases.solved(pack_frames(chain.given, dense=0), at).items():
        expected, rounding = chain_cases.solved_densely(matrices, matrices["damping"], at, kind)
        np.testing.assert_allclose(found, expected, rtol=0, atol=rounding)


@pytest.mark.parametrize("integrate", [generalized_alpha, lobatto])
@pytest.mark.parametrize("name", ["five links", "axes that part", "prescribed in the middle"])
@pytest.mark.parametrize("frames", [False, True], ids=["ERLS", "FFR"])
def test_integrators_go_the_same_way(
    name: str, frames: bool, integrate: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With dense factors and link by link: the same motion within the iterations' error, at about the same work."""
    chain: Any = ffr_cases.equations(tmp_path, f"tangent: {name}") if frames else chain_cases.equations(tmp_path, name)
    y, v = chain.initial_state()
    options = Options(2e-3 if integrate is generalized_alpha else None, tolerance=1e-5)
    runs = []
    for dense in (10**6, 0):
        system = pack_frames(chain.given, dense) if frames else pack_chain(chain.mechanism, dense)
        assert system is not None
        assert (system.factoring is None) == (dense > 0)
        monkeypatch.setitem(chain.__dict__, "compiled", system)  # in place of the cached property
        runs.append(integrate(chain, (0.0, 0.1), y, v, options))
    one, other = runs
    assert one.failure is other.failure is None
    scales = chain.length_scales
    assert float(np.abs((one.y[-1] - other.y[-1]) * scales).max()) <= 1e-5
    assert other.work.steps <= 1.2 * one.work.steps + 2
    assert other.work.rhs_calls <= 1.2 * one.work.rhs_calls + 10


def test_chains_choose_by_their_size(tmp_path: Path) -> None:
    """Six links are solved link by link, stiffened ones too; not so with strong damping, which couples modes."""
    chain = long_chain(tmp_path, 6)
    assert chain.compiled is not None
    assert chain.compiled.factoring is not None
    damped = [replace(link, damping=np.sqrt(link.stiffness)) for link in chain.mechanism.links]
    other = Erls(replace(chain.mechanism, links=tuple(damped)))
    assert other.compiled is not None
    assert other.compiled.factoring is None
    stiffened = Erls(replace(chain.mechanism, effects=chain.mechanism.effects | {"geometric_stiffening"}))
    assert stiffened.stiffened
    assert stiffened.compiled.factoring is not None
    small = chain_cases.equations(tmp_path, "one link").compiled
    assert small is not None
    assert small.factoring is None


def test_accelerations_of_a_long_chain_of_frames(tmp_path: Path) -> None:
    """Nine links are solved link by link there too: against the NumPy equations, by the rounding of their condition."""
    chain = Ffr(long_chain(tmp_path, 9).mechanism)
    assert chain.compiled is not None
    assert chain.compiled.factoring is not None
    at = chain_cases.states(chain, "nine links")[0]
    found = chain_cases.evaluate(chain.compiled, at)
    expected = chain.acceleration(at.t, at.y, at.v)
    rounding = 100 * np.finfo(float).eps * np.linalg.cond(found["mass"])
    assert rounding < 1e-2
    np.testing.assert_allclose(found["acceleration"], expected, rtol=0, atol=rounding * np.abs(expected).max())


def test_mixing_bounds_the_rate_of_iterations() -> None:
    """The spectral radius of D⁻¹ α (Vᵀ C V - its diagonal), for the α of both integrators, against the bound."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        n = 6
        arms = rng.normal(size=(n, 3))
        mass, stiffness = np.eye(n) + arms @ arms.T, 10 ** rng.uniform(3, 8, n)
        damping = 0.1 * np.sqrt(stiffness) * rng.uniform(0, 1, n)
        basis = decoupled_modes(mass, stiffness, damping)
        np.testing.assert_allclose(basis.vectors.T @ mass @ basis.vectors, np.eye(n), atol=1e-12)
        whole = basis.vectors.T @ np.diag(damping) @ basis.vectors
        beside = whole - np.diag(np.diag(whole))
        largest = 0.0
        for alpha in np.outer([1.0, np.exp(1j * np.pi / 4)], 10.0 ** np.arange(-5, -1, 0.25)).ravel():
            diagonal = 1 + alpha * basis.damping + alpha**2 * basis.stiffness
            largest = max(largest, np.abs(np.linalg.eigvals(alpha * beside / diagonal[:, None])).max())
        assert 0.2 * basis.mixing <= largest <= basis.mixing


def test_work_of_a_long_chain_link_by_link(tmp_path: Path) -> None:
    """Budget of ten links with eight modes: at h = 1 ms, at most 8 residuals and 1.2 factorizations a step."""
    chain = long_chain(tmp_path, 10)
    y, v = chain.initial_state()
    work = generalized_alpha(chain, (0.0, 0.1), y, v, Options(step=1e-3)).work
    assert work.rhs_calls <= 8 * work.steps
    assert work.factorizations <= 1.2 * work.steps


def long_chain(folder: Path, links: int) -> Erls:
    """Equal links on joints in all directions."""
    scenes.arm_link(folder)
    joints = [
        {"name": f"j{k}", "dh": {"convention": "standard", "a": 0.4, "alpha_deg": 35.0 + 20 * (k % 3)}}
        for k in range(links)
    ]
    arms = [{"name": f"l{k}", "model": "arm.toml", "mesh_pose": {"frame": "joint"}} for k in range(links)]
    data = {"simulation": {"duration": 1.0}, "joints": joints, "links": arms}
    return Erls(scenes.mechanism(scenes.write_toml(folder / "chain.toml", data)))

"""Compiled chains with geometric stiffening: against floating frames, the same source uncompiled, and in runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import chain_cases
import numpy as np
import pytest
import scenes
import stiffened_cases
from twins import Plain, distance, uncompiled

import erls
from erls.equations.erls.formulation import Erls
from erls.equations.erls.paper.dense_chain import DenseChain
from erls.equations.ffr.formulation import Ffr
from erls.errors import SimulationError
from erls.integrate.base import Options
from erls.integrate.generalized_alpha import generalized_alpha
from erls.run.chain.places import node_positions

LIKE_FFR = 1e-10  # relative: two orders of summation, through some hundred terms
LIKE_TWIN = 1e-12
STIFF = 'simulation.effects=["all", "geometric_stiffening", "foreshortening"]'


@pytest.mark.parametrize("modal_inertia", [False, True])
@pytest.mark.parametrize("name", stiffened_cases.CASES)
def test_anchored_links_move_like_floating_frames(name: str, modal_inertia: bool, tmp_path: Path) -> None:
    """Residual (joints and modes apart), mass, stiffness, damping, poses, energy, and what accelerations leave out of
    balance, against FFR in tangent frames, which has the same coordinates and shares no equation.
    """
    mechanism = stiffened_cases.mechanism(tmp_path, name)
    if modal_inertia:
        mechanism = replace(mechanism, effects=mechanism.effects | {"modal_inertia"})
    recursion, floating = Erls(mechanism), Ffr(mechanism)
    assert recursion.stiffened
    f = len(recursion.free_joints)
    for at in stiffened_cases.states(recursion, name):
        found = chain_cases.evaluate(recursion.compiled, at)
        residual = floating.residual(at.t, at.y, at.v, at.a)
        assert distance(found["residual"][:f], residual[:f]) <= LIKE_FFR
        assert distance(found["residual"][f:], residual[f:]) <= LIKE_FFR
        assert distance(found["mass"], floating.mass_matrix(at.t, at.y)) <= LIKE_FFR
        stiffness, damping = floating.stiffness_and_damping(at.t, at.y, at.v)
        assert distance(found["stiffness"], stiffness) <= LIKE_FFR
        assert distance(found["damping"], damping) <= LIKE_FFR
        poses = [np.array(one.state(at.t, at.y, at.v).poses) for one in (recursion, floating)]
        assert distance(*poses) <= LIKE_FFR
        energies = [one.energy(at.t, at.y, at.v) for one in (recursion, floating)]
        assert distance(*(np.array([e.kinetic, e.elastic, e.gravity]) for e in energies)) <= LIKE_FFR
        eigenvalues = np.linalg.eigvalsh(found["mass"])
        if eigenvalues[0] > 1e-12 * eigenvalues[-1]:
            left = floating.residual(at.t, at.y, at.v, found["acceleration"])
            taken = np.abs(found["mass"]) @ np.abs(found["acceleration"])
            assert (np.abs(left) <= LIKE_FFR * taken.max()).all()
        elif eigenvalues[0] < -1e-12 * eigenvalues[-1]:
            # linear in the deformation alone it need not be positive; nor where ½ qᵀΨq moves as fast as the modes
            assert modal_inertia or name in ("without inertia_second_order", "only inertia_first_order")
            system, out = recursion.compiled, np.empty(recursion.size)
            assert system.acceleration(system.reals, system.integers, system.scratch, at.t, at.y, at.v, out) > 0
            with pytest.raises(SimulationError):
                floating.acceleration(at.t, at.y, at.v)


@pytest.mark.parametrize("name", ["arms, mixed", "five links"])
def test_the_rigid_chain_leaves_out_third_order(name: str, tmp_path: Path) -> None:
    """Displacements counted from a rigid chain, in the dense form, are right to second order: with deflections
    halved the place of the tip is off by an eighth.
    """
    recursion = stiffened_cases.equations(tmp_path, name)
    chain = recursion.mechanism
    dense = DenseChain(chain, "joint-angle")
    f, at = len(recursion.free_joints), stiffened_cases.states(recursion, name)[0]
    tip = np.array([chain.links[-1].model.interface_nodes[-1].node])
    apart = []
    for size in (0.02, 0.01):
        y, v = (np.concatenate([x[:f], size * x[f:]]) for x in (at.y, at.v))
        one, other = (
            node_positions(chain, system.state(at.t, y, v), len(chain.links) - 1, tip) for system in (recursion, dense)
        )
        apart.append(np.linalg.norm(one - other))
    assert np.log2(apart[0] / apart[1]) == pytest.approx(3.0, abs=0.1)


def test_second_order_is_felt(tmp_path: Path) -> None:
    """The cases tell: without second-order terms the same states give forces that differ by more than a hundredth."""
    chain = stiffened_cases.equations(tmp_path, "arms, mixed")
    linear = Erls(replace(chain.mechanism, effects=chain.mechanism.effects - {"geometric_stiffening"}))
    at = stiffened_cases.states(chain, "arms, mixed")[0]
    forces = [one.residual(at.t, at.y, at.v, at.a) for one in (linear, chain)]
    assert distance(*forces) > 1e-2


def test_kernels_equal_their_uncompiled_twin(tmp_path: Path) -> None:
    """The same source as plain Python (``ERLS_JIT=0``) in a process of its own."""
    found, twin = stiffened_cases.all_results(tmp_path), uncompiled(stiffened_cases, tmp_path)
    assert set(twin) == set(found)
    for key, values in found.items():
        if key.endswith("acceleration"):  # the condition of the mass matrix is up to 1e9: forces that they take
            mass = found[key.replace("acceleration", "mass")]
            apart, size = np.abs(mass @ (values - twin[key])), np.abs(mass) @ np.abs(values)
            assert apart.max() <= LIKE_TWIN * max(size.max(), 1e-300), key
        else:
            assert distance(values, twin[key]) <= LIKE_TWIN, key


def _status(chain: Erls, y: np.ndarray) -> int:
    system = chain.compiled
    assert system is not None
    constants = system.reals, system.integers, system.scratch
    return int(system.acceleration(*constants, 0.0, y, np.zeros(chain.size), np.empty(chain.size)))


def test_what_nothing_resists_is_named(tmp_path: Path) -> None:
    """The status counts the joint whose motion no inertia opposes; a state that is not finite has one, too."""
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
    mechanism = scenes.mechanism(scenes.write_toml(tmp_path / "light.toml", data))
    chain = Erls(replace(mechanism, effects=stiffened_cases.STIFFENED))
    y, _ = chain.initial_state()
    assert _status(chain, y) == 1 + 1
    whole = stiffened_cases.equations(tmp_path, "parallel axes")
    assert _status(whole, np.zeros(whole.size)) == 0
    assert _status(whole, np.full(whole.size, np.nan)) > 0


def test_generalized_alpha_takes_the_same_steps(tmp_path: Path) -> None:
    """Compiled loop and NumPy algorithm: the same knots, steps and motion."""
    chain = stiffened_cases.equations(tmp_path, "arms, prescribed")
    y, v = chain.initial_state()
    options = Options(step=2e-3)
    fast = generalized_alpha(chain, (0.0, 0.06), y, v, options)
    slow = generalized_alpha(Plain(chain), (0.0, 0.06), y, v, options)
    assert fast.failure is None
    np.testing.assert_array_equal(fast.t, slow.t)
    np.testing.assert_allclose(fast.y, slow.y, atol=1e-10 * np.abs(slow.y).max())
    assert fast.work.steps == slow.work.steps


def test_energy_is_conserved_in_a_compiled_run(tmp_path: Path) -> None:
    """Two soft links with a slide between ground and first, swinging freely, by `lobatto`, which damps nothing."""
    scenes.arm_link(
        tmp_path,
        sections={"s": {"width": 0.012, "height": 0.008}},
        reduction={"fixed_interface_modes": 2, "elastic_modes": 4},
    )
    joints = [
        {"name": n, "dh": {"convention": "standard", "a": 0.5, "alpha_deg": 90.0}, "initial": {"rate_deg": 200.0}}
        for n in ("a", "b")
    ]
    links = [{"name": n, "model": "arm.toml", "mesh_pose": {"frame": "joint"}} for n in ("upper", "lower")]
    data = {
        "simulation": {"duration": 0.5, "integrator": "lobatto", "tolerance": 1e-8},
        "joints": joints,
        "links": links,
    }
    run = erls.simulate(erls.load_scene(scenes.write_toml(tmp_path / "swing.toml", data), [STIFF]), verdict=False)
    assert run.conservative
    energy = run.energy(np.linspace(0.0, 0.5, 51))
    assert np.ptp(energy.total) < 1e-7 * np.max(energy.kinetic)

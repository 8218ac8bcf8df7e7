"""Compiled nodal systems: against NumPy, against the same source uncompiled; their steps, budgets and references."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import heavy_top
import nodal_cases
import numpy as np
import pytest
from test_nodal_dynamics import _l_shape
from test_nodal_scene import _rigid_chain

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.equations import Nodal
from erls.equations.system import metre_scales
from erls.errors import Cause
from erls.integrate.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.maths.saddle import Scales, dense
from erls.maths.so3 import Array
from erls.scene.build import build_mechanism
from erls.scene.read import load_scene
from erls.simulation.simulate import simulate

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import nodal_reference

LIKE_NUMPY, LIKE_TWIN = 1e-11, 1e-12  # of the largest entry: two orders of summation; one


def _same(found: Array, expected: Array, limit: float) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=limit * max(1.0, np.abs(expected).max(initial=0.0)))


@pytest.mark.parametrize("group", nodal_cases.GROUPS)
def test_the_band_solves_with_the_matrices(group: str) -> None:
    """Solutions with the factored band against those with mass, damping, stiffness and tangent (condition 5e7)."""
    system = nodal_cases.system(group)
    increment, v, a, multipliers = nodal_cases.state(system)
    found = nodal_cases.evaluate(system)
    q, t = system.compose(system.start, increment), nodal_cases.TIME
    rows = dense(system.constraint_matrix(t, q))
    force = system.residual(t, q, v, a)
    reaction = rows.T @ multipliers
    norms = [np.linalg.norm(part / system.length_scales) for part in (force, reaction)]
    _same(found["residual"], np.concatenate([force + reaction, system.constraint(t, q), norms]), LIKE_NUMPY)
    stiffness, damping = (dense(x) for x in system.stiffness_and_damping(t, q, v, a, multipliers))
    tangent = dense(system.tangent(increment))
    mass = dense(system.mass_matrix(t, q))
    block = mass + nodal_cases.ALPHA * damping + nodal_cases.BETA * stiffness @ tangent
    none = np.zeros((len(rows), len(rows)))
    expected = np.linalg.solve(np.block([[block, rows.T], [rows @ tangent, none]]), nodal_cases.right(system))
    assert found["status"][0] == 0
    _same(found["unknowns"], expected, LIKE_NUMPY)
    scales = Scales(metre_scales(system), mass, rows)
    of_forces, of_gaps = np.split(found["scales"], 2)
    _same(of_gaps, scales.constraint, LIKE_NUMPY)
    _same(of_forces * of_gaps, np.full(len(rows), of_forces[0] * of_gaps[0]), LIKE_NUMPY)  # one mass


def test_kernels_equal_their_uncompiled_twin(tmp_path: Path) -> None:
    """The same source as plain Python (``ERLS_JIT=0``) in a process of its own."""
    kept = {}
    for jit in ("0", "1"):
        path = tmp_path / f"{jit}.npz"
        subprocess.run(
            [sys.executable, nodal_cases.__file__, str(path)], check=True, env={**os.environ, "ERLS_JIT": jit}
        )
        kept[jit] = dict(np.load(path))
    assert kept["0"].keys() == kept["1"].keys()
    for name, expected in kept["0"].items():
        _same(kept["1"][name], expected, LIKE_TWIN)


@pytest.mark.parametrize("matrix", ["auto", "update", "frozen"])
def test_steps_are_those_of_numpy(matrix: str) -> None:
    """The same work and the same motion; accelerations hold 1e-14 m of an increment over β h²."""
    runs = []
    for compiled in (False, True):
        system = _l_shape(2)
        options = ConstrainedOptions(step=1e-3, iteration_matrix=matrix, compiled=compiled)
        runs.append(lie_generalized_alpha(system, (0, 0.02), system.start, np.zeros(system.size), options))
    assert runs[0].work == runs[1].work
    _same(runs[1].y, runs[0].y, 1e-13)
    _same(runs[1].v, runs[0].v, 1e-9)
    _same(runs[1].accelerations, runs[0].accelerations, 1e-6)
    _same(runs[1].multipliers, runs[0].multipliers, 1e-7)


@pytest.mark.parametrize("start", ["zero", "last"])
def test_all_that_acts_in_joints(tmp_path: Path, start: str) -> None:
    """Controllers with feed-forward, springs, dampers, friction, rotors, torques: joint coordinates that pass π too."""
    mechanism = build_mechanism(load_scene(_rigid_chain(tmp_path)), lambda text: None).mechanism
    system = Nodal(mechanism)
    runs = []
    for compiled in (False, True):
        options = ConstrainedOptions(step=1e-3, compiled=compiled, start_from=start, newton_tolerance=1e-13)
        q, v = system.configuration(*system.initial_state())
        runs.append(lie_generalized_alpha(system.system, (0, 0.2), q, v, options))
        assert runs[-1].failure is None
    _same(runs[1].y, runs[0].y, 1e-9)
    _same(runs[1].v, runs[0].v, 1e-8)
    assert np.abs(runs[0].y[:, -1]).max() > np.pi


class _Heavier(NodalSystem):
    """Changes a method."""

    def residual(self, t: float, q: Any, v: Array, a: Array) -> Array:
        return 2 * super().residual(t, q, v, a)


def test_changed_systems_go_the_other_way() -> None:
    """By steps that call the methods of the system."""
    good = _l_shape(1)
    assert good.compiled is not None
    assert _Heavier(good.start.poses, good.elements, good.rows.joints).compiled is None

    class Alike(NodalSystem):
        def residual(self, t: float, q: Any, v: Array, a: Array) -> Array:
            return super().residual(t, q, v, a)

    other = Alike(good.start.poses, good.elements, good.rows.joints)
    found = lie_generalized_alpha(other, (0, 5e-3), other.start, np.zeros(other.size), ConstrainedOptions(step=1e-3))
    alike = lie_generalized_alpha(good, (0, 5e-3), good.start, np.zeros(good.size), ConstrainedOptions(step=1e-3))
    _same(found.y, alike.y, 1e-13)


def test_an_element_without_functions_is_refused() -> None:
    """A kind that the arrays have no place for."""

    class Strange:
        nodes, breakpoints = np.zeros((1, 1), dtype=np.int64), ()

    with pytest.raises(TypeError, match="Strange"):
        NodalSystem(np.eye(4)[None], [Strange()])


def _swing(elements: int, matrix: str) -> tuple[ConstrainedSolution, float]:
    """The L over 2 s at 1 ms, and processor time."""
    system = _l_shape(elements)
    options = ConstrainedOptions(step=1e-3, iteration_matrix=matrix, newton_tolerance=1e-13, start_from="last")
    begun = time.process_time()
    found = lie_generalized_alpha(system, (0, 2.0), system.start, np.zeros(system.size), options)
    assert found.failure is None
    return found, time.process_time() - begun


def test_one_matrix_for_two_seconds() -> None:
    """16 elements a leg: at most 3 factorizations, the motion of a fresh matrix in every iteration to 1e-8 m, at less
    than half the cost (a quarter, measured).
    """
    fresh, dear = _swing(16, "update")
    assert fresh.work.factorizations > 4000
    for matrix in ("frozen", "auto"):
        found, cheap = _swing(16, matrix)
        assert found.work.factorizations <= 3
        np.testing.assert_allclose(found.y, fresh.y, atol=1e-8)
        assert cheap < dear / 2


def test_the_band_is_as_wide_for_any_number_of_elements() -> None:
    """So that cost is linear: two neighbouring nodes, or a node and its joint."""
    assert [_l_shape(n).elimination.width for n in (2, 16, 64)] == [11, 11, 11]


@pytest.mark.parametrize("compiled", [False, True])
def test_adaptive_steps(compiled: bool) -> None:
    """An eighth of the local error takes half the step, and the distance falls as with equal steps of half the size."""
    errors, steps = [], []
    for tolerance in (1e-5, 1.25e-6):
        options = ConstrainedOptions(step=1e-2, error_tolerance=tolerance, compiled=compiled)
        found = heavy_top.spin("SE(3)", 0.3, options)
        assert found.failure is None
        assert found.work.steps == len(found.t) - 1
        sizes = np.diff(found.t)
        assert sizes.max() <= 1e-2
        exact = heavy_top.spin("SE(3)", 0.3, ConstrainedOptions(step=2.5e-5))
        errors.append(np.linalg.norm(found.y[-1, :3] - exact.y[-1, :3]))
        steps.append(found.work.steps)
    assert steps[1] / steps[0] == pytest.approx(2.0, rel=0.2)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.4)


def test_adaptive_steps_of_a_scene() -> None:
    """``integrator = "auto"``: a share of ``tolerance`` as local error, with ``step`` as the largest."""
    changes = ['simulation.formulation="nodal"', 'simulation.integrator="auto"', "simulation.elements_per_member=4"]
    changes += ["simulation.step=1e-2", "simulation.duration=0.2"]
    path = Path(__file__).parents[2] / "data" / "l_shape" / "steel_tall.toml"
    tips, steps = [], []
    for tolerance in (1e-4, 1e-6):
        run = simulate(load_scene(path, [*changes, f"simulation.tolerance={tolerance}"]), verdict=False)
        tips.append(run.position("tip", 0.2))
        steps.append(run.solution.work.steps)
    assert steps[1] > 2 * steps[0]
    assert np.linalg.norm(tips[1] - tips[0]) < 1e-4


def test_a_jump_stops_adaptive_steps() -> None:
    """A force that jumps without breakpoint, by more than the tolerance allows at any step."""
    good = heavy_top.heavy_top("SE(3)")

    class Jump(NodalSystem):
        def residual(self, t: float, q: Any, v: Array, a: Array) -> Array:
            return super().residual(t, q, v, a) + (1e12 if t > 0.01234 else 0.0)

    system = Jump(good.start.poses, good.elements, good.rows.joints)
    options = ConstrainedOptions(step=1e-3, error_tolerance=1e-9)
    found = lie_generalized_alpha(system, (0, 0.1), system.start, np.zeros(6), options)
    assert found.failure is not None
    assert found.failure.cause is Cause.STEP_TOO_SMALL
    assert found.t[-1] == pytest.approx(0.01234, abs=1e-4)


REFERENCES = [  # of `nodal_reference.CASES`, elements of each member
    (0, 16),
    (1, 16),
    (2, 16),
    (3, 32),
]


@pytest.mark.parametrize(("case", "elements"), REFERENCES)
def test_references(case: int, elements: int, capsys: pytest.CaptureFixture[str]) -> None:
    """Whole runs at 0.25 ms against the public package's extrapolated trajectories, within the limits of the issue."""
    nodal_reference.judge(nodal_reference.CASES[case], [elements], 2.5e-4, False)
    line = capsys.readouterr().out
    distances = [float(word.split(" m")[0].split()[-1]) for word in line.split(": ")[1].split(" (")[0].split(", ")]
    assert max(distances) <= nodal_reference.CASES[case][3]

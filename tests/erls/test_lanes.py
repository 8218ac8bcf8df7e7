"""Eightfold numbers: their arithmetic against closed forms, and equations of motion in them against single numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import erls
from erls.equations import side_by_side
from erls.equations.compiled_system import CompiledSystem
from erls.equations.serial.equilibrium import elastic_on_diagonal, size_of
from erls.equations.series import residual_series
from erls.equations.side_by_side import WORTH, eightfold_forces, eightfold_kernels
from erls.equations.system import metre_scales
from erls.equations.tangents import Evaluation, Knots, steps_of
from erls.maths.jit import ENABLED

DATA = Path(__file__).parents[2] / "data"
ROBOT = DATA / "robot" / "two_link.toml"
LINEAR = 'simulation.effects=["flexibility", "gravity", "coriolis", "inertia_first_order", "joint_friction"]'
FORMS = {
    "linear": [LINEAR],
    "second order": [],
    "floating frames": ['simulation.formulation="ffr"'],
}
ACTING = [
    "simulation.duration=0.02",
    'joints.0.drive={type="free"}',
    "joints.0.friction={force=0.3, transition_rate=0.3}",
    'loads=[{point="end1", force=[0.0, 1.0, 2.0], factor=[{shape="step", start=0.01, value=1.0}]}]',
]

compiled_only = pytest.mark.skipif(not ENABLED, reason="eightfold numbers are for compiled code")


def _functions() -> tuple[Any, Any]:
    """A function of three numbers with every operation, in lanes, of memory (3, 8) into (1, 8), and of any numbers."""
    from numba import njit

    from erls.maths.lanes import as_lanes

    def formula(z, r):  # type: ignore[no-untyped-def]
        x, y, c = z[0], z[1], z[2]
        q = 0.0
        q += x * y / c + np.cos(x) * np.sqrt(y) - 2 * c**2 + 3 / y - np.tanh(x) / 4
        q -= np.exp(-x) * np.log(y) + np.sin(c) * np.tan(x) - np.cosh(x) / np.sinh(y) + np.arctan(r * c)
        if q.real < 100.0 and abs(q) >= 0 and q != 7.0 and not q == 3.0 and x <= y and c > x:  # noqa: SIM201
            q = abs(-q) + y.imag
        return 1.5 - q

    compiled = njit(formula, error_model="numpy")

    @njit(error_model="numpy")
    def in_lanes(x, r, out):  # type: ignore[no-untyped-def]
        as_lanes(out)[0] = compiled(as_lanes(x), r)

    return in_lanes, formula


@compiled_only
def test_arithmetic() -> None:
    """States against single ones; those that go different ways are told."""
    from erls.maths.lanes import WIDTH, Apart, eightfold

    in_lanes, formula = _functions()
    rng, out, x = np.random.default_rng(2), eightfold(1), eightfold(3)
    x[:] = np.array([[0.3], [0.8], [1.7]]) + 0.1 * rng.uniform(size=(3, WIDTH))
    in_lanes(x, 0.7, out)
    np.testing.assert_allclose(out[0], [formula(one, 0.7) for one in x.T], rtol=1e-14, atol=1e-14)  # terms up to 8
    x[1, 3] = x[0, 3] / 2
    with pytest.raises(Apart):
        in_lanes(x, 0.7, out)


def _case(form: str) -> tuple[Any, CompiledSystem, Knots]:
    scene: Any = erls.load_scene(ROBOT, [*ACTING, *FORMS[form]])
    chain = erls.simulate(scene, verdict=False).formulation
    rng, steps = np.random.default_rng(5), _steps(chain)
    y, v, a = (scale * steps * rng.uniform(-1, 1, (21, len(steps))) for scale in (3e2, 3e4, 1e6))
    y[:, 0] += rng.uniform(-1, 1, 21)
    t = np.linspace(0.0, 0.02, 21)  # a load begins within one of the eights
    return chain, chain.compiled, Knots(t, y, v, a)  # type: ignore[attr-defined]


def _steps(chain: Any) -> np.ndarray:
    return steps_of(metre_scales(chain), size_of(chain.mechanism), elastic_on_diagonal(chain)[0])


@compiled_only
@pytest.mark.parametrize("form", FORMS)
def test_equations(form: str) -> None:
    """Forces to rounding, tangents to what differences leave: 1e-10 of the largest, and of forces over their steps."""
    chain, system, knots = _case(form)
    expected = residual_series(system, *knots)
    kernels = eightfold_kernels(system, WORTH)
    forces = eightfold_forces(kernels, system, *knots)
    assert np.abs(forces - expected).max() <= 1e-13 * np.abs(expected).max()
    steps = _steps(chain)
    rounding = 1e-15 * np.abs(expected).max() / steps
    taped = Evaluation(steps, kernels, True).tangents(system, knots)
    differences = Evaluation(steps).tangents(system, knots)
    assert np.abs(taped.mass - differences.mass).max() <= 1e-13 * np.abs(taped.mass).max()
    for found, of in zip(taped[1:], differences[1:], strict=True):
        assert (np.abs(found - of) <= 1e-10 * np.abs(of).max() + rounding).all()
        assert not np.array_equal(found, of)  # it is the tape that was asked


@compiled_only
def test_states_that_go_different_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    """The load begins between states of one eight: these are taken one by one, and no others."""
    _, system, knots = _case("second order")
    taken = []

    def noted(system: CompiledSystem, t: np.ndarray, *state: np.ndarray) -> np.ndarray:
        taken.extend(t.tolist())
        return residual_series(system, t, *state)

    monkeypatch.setattr(side_by_side, "residual_series", noted)
    eightfold_forces(eightfold_kernels(system, WORTH), system, *knots)
    assert taken == knots.t[8:16].tolist()


def test_what_is_not_worth_it() -> None:
    _, system, _ = _case("second order")
    assert eightfold_kernels(system, WORTH - 1) is None


@compiled_only
def test_tangents_of_loops() -> None:
    """A four-bar, whose conditions close by the angle of a joint: the tape against differences, as above."""
    changes = ['simulation.integrator="lobatto"', "simulation.duration=0.001", "initial.deformation=zero"]
    scene: Any = erls.load_scene(
        DATA / "four_bar" / "flexible.toml", [*changes, *(f"links.{k}.elastic_modes=1" for k in range(3))]
    )
    run: Any = erls.simulate(scene, verdict=False)
    s, system, steps = run.solution, run.formulation.compiled, _steps(run.formulation.bare)
    knots = Knots(*(x[1:9] for x in (s.t, s.y, s.v, s.a)))
    taped, differences = (Evaluation(steps, None, on).tangents(system, knots) for on in (True, False))
    for found, of in zip(taped, differences, strict=True):
        assert np.abs(found - of).max() <= 1e-9 * np.abs(of).max()
    assert not np.array_equal(taped.stiffness, differences.stiffness)

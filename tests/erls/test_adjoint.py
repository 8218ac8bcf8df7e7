"""The adjoint method: against direct differentiation, which it transposes; what it asks of outputs; its memory."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import erls
from erls.errors import SceneError, SimulationError
from erls.run.chain.run import ChainRun
from erls.sensitivity import equations
from erls.sensitivity.adjoint import gradients
from erls.sensitivity.forward import differentiated
from erls.sensitivity.gradients import Asking
from erls.sensitivity.parameters import parameters_of
from erls.sensitivity.schemes import Scheme
from erls.sensitivity.sensitivities import scheme_of
from erls.sensitivity.variants import differences

DATA = Path(__file__).parents[2] / "data"
L, ROBOT = DATA / "l_shape" / "steel_tall.toml", DATA / "robot" / "two_link.toml"
JUMPING = [
    "simulation.duration=0.02",
    'payloads=[{point="end2", mass=0.2, offset=[0.0, 0.01, 0.0]}]',
    'loads=[{point="end1", force=[0.0, 1.0, 2.0], factor=[{shape="step", start=0.008, value=1.0}]}]',
    'joints.0.drive={type="free"}',
    "joints.0.initial={position_deg=-2.0, rate=0.5}",
    "joints.0.damping=0.2",
]
BY = ["gravity.2", "payloads.0.offset.1", "loads.0.force.2", "joints.0.initial.rate", "joints.0.dh.a"]
STATIC = ["simulation.step=2e-3", "simulation.duration=0.02", "initial.deformation=static", JUMPING[3]]
CLOSED = ['simulation.integrator="lobatto"', "simulation.duration=0.02"]
CASES: dict[str, tuple[Path, list[str], list[str], str]] = {
    "generalized-alpha": (ROBOT, [*JUMPING, "simulation.step=2e-3"], BY, "end2"),
    "lobatto": (ROBOT, [*JUMPING, 'simulation.integrator="lobatto"'], BY[:3], "end2"),
    "static start, a link": (
        ROBOT,
        STATIC,
        ["links.forearm.model.sections.bar.width", "joints.0.dh.a"],
        "end2",
    ),
    "loop": (
        DATA / "four_bar" / "flexible.toml",
        [*CLOSED, *(f"links.{k}.elastic_modes=1" for k in range(3))],
        ["gravity.2", "joints.1.dh.a"],
        "coupler_middle",
    ),
}
AGREE = 1e-9
NOTHING = 1e-12  # of a value, over the size of a parameter: rounding of differences


def _run(path: Path, overrides: list[str]) -> ChainRun:
    scene: Any = erls.load_scene(path, overrides)
    return erls.simulate(scene, verdict=False)


@pytest.mark.parametrize("case", CASES)
def test_both_methods(case: str) -> None:
    """At 1e-9, through the motion: λᵀ ∂R/∂p against ∂g/∂(y, v, a) · d(y, v, a)/dp, with ∂g made up at some knots."""
    path, overrides, keys, _ = CASES[case]
    run = _run(path, overrides)
    found = differences(run, parameters_of(run.scene, keys))
    k, n = run.solution.y.shape
    rng = np.random.default_rng(3)
    seeds = {knot: rng.normal(size=(3, n, 2)) for knot in {0, 1, k // 3, k // 2, k - 2, k - 1}}
    if case.startswith("static"):  # near rest, rates and accelerations are what large forces leave, in rounding too
        seeds = {knot: seed * [[[1.0]], [[0.0]], [[0.0]]] for knot, seed in seeds.items()}
    forward = differentiated(run, found, scheme_of(run))
    terms = np.concatenate([forward[knot][..., None] * seed[:, :, None] for knot, seed in seeds.items()])
    backward = gradients(run, found, scheme_of(run), seeds, 2)
    limits = AGREE * np.abs(terms).sum(axis=(0, 1))
    assert (np.abs(backward - terms.sum(axis=(0, 1))) <= limits).all()


def test_steps_that_change(monkeypatch: pytest.MonkeyPatch) -> None:
    """The algorithmic acceleration that a change of the step moves along, transposed: as if each step changed."""
    rescaled = np.eye(4)
    rescaled[3, 2:] = 0.3, 0.7
    monkeypatch.setattr(Scheme, "rescaled", lambda self, h, before: rescaled)
    test_both_methods("generalized-alpha")


@pytest.mark.parametrize("case", ["generalized-alpha", "static start, a link"])
def test_outputs(case: str) -> None:
    """A place, places at times on either side of a jump, a reaction, energy.

    To 1e-8, as outputs are differenced; reactions have the rounding of the forces of stiff modes, about 1e-7.
    """
    path, overrides, keys, point = CASES[case]
    run = _run(path, overrides)
    outputs: dict[str, Callable[[ChainRun], Any]] = {
        "height": lambda run: run.position(point, 0.013)[2],
        "places": lambda run: run.position(point, [0.0, 0.008, 0.02])[:, 1:],
        "mean": lambda run: np.mean(run.position(point, np.linspace(0.0, 0.02, 3))[:, 2] ** 2),
        "moment": lambda run: run.reaction(run.joint_names[0], 0.02)[1],
        "energy": lambda run: run.energy(0.011).total,
        "constant": lambda run: 2.0,
    }
    forward = erls.sensitivities(run, outputs, keys, "forward")
    adjoint = erls.sensitivities(run, outputs, keys, method="adjoint")
    assert (forward.method, adjoint.method) == ("forward", "adjoint")
    sizes = {parameter.key: parameter.size for parameter in parameters_of(run.scene, keys)}
    for name, expected in forward.derivatives.items():
        np.testing.assert_array_equal(forward.values[name], adjoint.values[name])
        largest = max(sizes[key] * np.abs(x).max() for key, x in expected.items())
        for key, x in expected.items():
            found = adjoint.derivatives[name][key]
            assert isinstance(found, np.ndarray)
            assert found.shape == x.shape
            limit = (1e-7 if name == "moment" else 1e-8) * largest + NOTHING * np.abs(adjoint.values[name]).max()
            assert np.abs(found - x).max() <= limit / sizes[key], (name, key)


def test_times_that_share_no_component() -> None:
    """Places at many times cost as much as one: those are moved together; a mean over them is not."""
    run = _run(L, ["simulation.duration=0.01"])
    times = np.linspace(0.0, 0.01, 7)
    one, many, mean = (
        Asking(output, "tip", run)
        for output in (
            lambda run: run.position("tip", 0.003),
            lambda run: run.position("tip", times),
            lambda run: run.position("tip", times).mean(),
        )
    )
    assert one.evaluations == many.evaluations == mean.evaluations // 7 == 4 * run.formulation.size  # type: ignore[attr-defined]
    assert (list(one.parts), len(many.groups), len(mean.groups)) == ([0], 1, 7)


def test_choice() -> None:
    """Whichever asks outputs less often."""
    run = _run(L, ["simulation.duration=2e-3", "simulation.step=1e-3", "links.l.elastic_modes=2"])
    tip = {"tip": lambda run: run.position("tip", 2e-3)[2]}
    keys = ["gravity.0", "gravity.1", "gravity.2", "base.position.2", "joints.0.dh.a", "joints.0.dh.d"]
    few, many = erls.sensitivities(run, tip, keys[:2]), erls.sensitivities(run, tip, keys)
    whole = erls.sensitivities(run, {"tip": lambda run: run.position("tip", [0.0, 1e-3, 2e-3])}, keys)
    own = erls.sensitivities(run, {"end": lambda run: run.solution.y[-1, 0]}, keys)
    assert [found.method for found in (few, many, whole, own)] == ["forward", "adjoint", "forward", "forward"]


def test_refusals() -> None:
    run = _run(L, ["simulation.duration=1e-3"])
    with pytest.raises(SceneError, match="no such method"):
        erls.sensitivities(run, {}, ["gravity.2"], "backward")  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="by other ways"):
        erls.sensitivities(run, {"end": lambda run: run.solution.y[-1, 0]}, ["gravity.2"], "adjoint")
    with pytest.raises(SceneError, match="nothing is differentiated"):
        erls.sensitivities(run, {}, ["gravity.2"], "adjoint")


def test_singular_steps() -> None:
    """Neither way is a matrix taken for another, nor a singular one for any."""
    block, right = np.array([[2.0, 1.0], [0.0, 4.0]]), np.array([[1.0], [2.0]])
    np.testing.assert_allclose(block @ equations.solve(block.copy(), right, False, 0.0), right, rtol=1e-15)
    np.testing.assert_allclose(block.T @ equations.solve(block.copy(), right, True, 0.0), right, rtol=1e-15)
    with pytest.raises(SimulationError, match=r"t = 0\.5 s.*singular"):
        equations.solve(np.zeros((2, 2)), right, False, 0.5)


def test_no_coordinates() -> None:
    """Rigid links that follow motors: a parameter changes the output by itself alone."""
    run = _run(ROBOT, ["links.0.flexible=false", "links.1.flexible=false", "simulation.duration=0.01"])
    found = erls.sensitivities(run, {"end": lambda run: run.position("end2", 0.0)}, ["joints.0.dh.a"], "adjoint")
    np.testing.assert_allclose(found.derivatives["end"]["joints.0.dh.a"], [1.0, 0.0, 0.0], rtol=0, atol=1e-9)


def test_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stretch at a time: four times the steps take no more, where tangents of all of them would take 40 MB."""
    monkeypatch.setattr(equations, "_ROOM", 100_000)
    peaks = []
    for duration in (0.35, 1.4):
        run = _run(L, [f"simulation.duration={duration}", "simulation.step=1e-3"])
        found = differences(run, parameters_of(run.scene, ["gravity.2"]))
        n = run.formulation.size  # type: ignore[attr-defined]
        seeds = {len(run.solution.t) - 1: np.ones((3, n, 1))}
        gradients(run, found, scheme_of(run), seeds, 1)  # what is made once
        tracemalloc.start()
        gradients(run, found, scheme_of(run), seeds, 1)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] <= 1.1 * peaks[0] <= 1e7

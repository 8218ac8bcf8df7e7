"""The adjoint method for nodal runs: against direct differentiation, which it transposes, step for step."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_sensitivities import DRIVEN

import erls
from erls.equations.nodal import assembly, elimination
from erls.maths.band import factor as factored
from erls.maths.band_transposed import solve_transposed
from erls.maths.jit import plain
from erls.run.chain.run import ChainRun
from erls.sensitivity import nodal_adjoint
from erls.sensitivity.nodal_forward import differentiated
from erls.sensitivity.nodal_motion import walks_of
from erls.sensitivity.parameters import parameters_of
from erls.sensitivity.variants import differences

DATA = Path(__file__).parents[2] / "data"
ROBOT = DATA / "robot" / "two_link.toml"
COARSE = ['simulation.formulation="nodal"', "simulation.elements_per_member=2"]
BY = ["gravity.2", "payloads.0.offset.1", "loads.0.force.2", "joints.0.initial.rate", "joints.0.dh.a"]
CASES: dict[str, tuple[Path, list[str], list[str]]] = {
    "jumps": (ROBOT, [*COARSE, *DRIVEN, "simulation.step=2e-3"], BY),
    "steps that change": (ROBOT, [*COARSE, *DRIVEN, "simulation.tolerance=1e-3", "simulation.duration=4e-3"], BY[:3]),
    "loop, static start": (
        DATA / "four_bar" / "flexible.toml",
        [
            *COARSE,
            "simulation.duration=4e-3",
            "simulation.step=1e-3",
            "links.crank.flexible=false",
            "links.coupler.damping={ratio=0.0}",
            "links.rocker.damping={ratio=0.0}",
            "initial.deformation=static",
        ],
        ["links.coupler.model.sections.bar.width", "joints.1.dh.a", "gravity.2"],
    ),
}
AGREE = 1e-9
ACCELERATED = 1e-7  # of accelerations of stiff elements: what rounding leaves of large forces
NOTHING = 1e-10  # of the motion, over the size of a parameter: rounding of differences


def _run(path: Path, overrides: list[str]) -> ChainRun:
    scene: Any = erls.load_scene(path, overrides)
    run: ChainRun = erls.simulate(scene, verdict=False)
    return run


@pytest.mark.parametrize("case", CASES)
def test_both_methods(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """With what an output asks of knots made up: of frames, their rates and accelerations, and of accelerations and
    multipliers; stretches of a few steps, so that configurations are found again from those that are kept.
    """
    monkeypatch.setattr(nodal_adjoint, "_ROOM", 3_000)
    by_fronts = case == "steps that change"
    way = elimination.fronted if by_fronts else elimination.banded
    monkeypatch.setattr(assembly, "elimination", lambda *given: way(*given[:3]))
    path, overrides, keys = CASES[case]
    run = _run(path, overrides)
    assert case != "jumps" or len(list(walks_of(run))) > 1
    given = parameters_of(run.scene, keys)
    found = differences(run, given)
    k, n = run.solution.y.shape
    system = run.formulation.system  # type: ignore[attr-defined]
    assert (system.elimination.width < 0) == by_fronts
    frames = 12 * system.count + len(system.model.actuators)
    forward = differentiated(run, found)
    rng = np.random.default_rng(3)
    knots = sorted({0, 1, k // 2, k - 1})
    for order in range(3):
        for some, limit in ((slice(0, frames), AGREE), (slice(frames, None), ACCELERATED)):
            if case.startswith("loop") and (order, some.start) != (0, 0):
                continue  # near rest, rates and accelerations are what large forces leave, in rounding too
            seeds = {knot: np.zeros((3, n, 2)) for knot in knots}
            for seed in seeds.values():
                seed[order, some] = rng.normal(size=seed[order, some].shape)
            backward = nodal_adjoint.gradients(run, found, seeds, 2)
            terms = np.array([forward[knot][..., None] * seed[:, :, None] for knot, seed in seeds.items()])
            sizes = np.abs(terms).sum(axis=(0, 1, 2))
            scales = np.array([parameter.size for parameter in given])[:, None]
            floor = NOTHING * (sizes * scales).max() / scales
            apart = np.abs(backward - terms.sum(axis=(0, 1, 2)))
            assert (apart <= limit * sizes + floor).all(), (order, some, apart / sizes)


def test_outputs() -> None:
    """A place, places on either side of a jump, what moves there, a reaction, an angle: through the one door."""
    run = _run(ROBOT, [*COARSE, *DRIVEN, "simulation.step=2e-3"])
    outputs: Any = {
        "height": lambda run: run.position("end2", 0.0073)[2],
        "places": lambda run: run.position("end2", [0.0, 0.004, 0.01])[:, 1:],
        "rate": lambda run: run.velocity("end2", 0.0073)[2],
        "acceleration": lambda run: run.acceleration("end2", 0.01)[1],
        "turning": lambda run: run.angular_velocity("end2", 0.01)[2],
        "moment": lambda run: run.reaction("shoulder", 0.01)[1],
        "angle": lambda run: run.joint_angle("shoulder", 0.01),
    }
    keys = BY[:1] + BY[-1:]
    forward = erls.sensitivities(run, outputs, keys, "forward")
    adjoint = erls.sensitivities(run, outputs, keys, "adjoint")
    assert adjoint.method == "adjoint"
    sizes = {parameter.key: parameter.size for parameter in parameters_of(run.scene, keys)}
    for name, expected in forward.derivatives.items():
        largest = max(sizes[key] * np.abs(x).max() for key, x in expected.items())
        limit = 1e-7 if name == "moment" else AGREE
        for key, x in expected.items():
            assert np.abs(adjoint.derivatives[name][key] - x).max() <= limit * largest / sizes[key], (name, key)


def test_transposed_bands() -> None:
    """Row exchanges too: against a dense solution."""
    rng, n, width = np.random.default_rng(0), 12, 3
    dense, band = np.zeros((n, n)), np.zeros((n, 3 * width + 1))
    for i in range(n):
        for j in range(max(0, i - width), min(n, i + width + 1)):
            dense[i, j] = band[i, j - i + width] = rng.normal()
    pivots, values = np.zeros(n), rng.normal(size=n)
    expected = np.linalg.solve(dense.T, values)
    assert plain(factored)(band, pivots) == 0
    assert (pivots != np.arange(n)).any()
    plain(solve_transposed)(band, pivots, values)
    np.testing.assert_allclose(values, expected, rtol=1e-11)

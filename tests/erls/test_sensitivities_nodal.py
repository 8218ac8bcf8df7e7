"""Derivatives of nodal runs: against complex steps through the scheme, differences of tightened runs, a law of scale, a
closed form.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import complex_nodal_runs
import numpy as np
import pytest
from held_runs import tightened
from test_sensitivities import DRIVEN, OF_MECHANISM

import erls
from erls.run.chain.run import ChainRun
from erls.sensitivity.nodal_forward import changes_of
from erls.sensitivity.parameters import parameters_of
from erls.sensitivity.variants import differences

DATA = Path(__file__).parents[2] / "data"
ROBOT, L, FOUR_BAR = DATA / "robot" / "two_link.toml", DATA / "l_shape" / "steel_tall.toml", DATA / "four_bar"
NODAL = 'simulation.formulation="nodal"'
COARSE = [NODAL, "simulation.elements_per_member=2"]

EXACT = 1e-8  # what is promised
NOTHING = 1e-11  # of the motion per size of a parameter: one on which it does not depend


def _run(path: Path, overrides: list[str]) -> ChainRun:
    scene: Any = erls.load_scene(path, overrides)
    return erls.simulate(scene, verdict=False)


@pytest.mark.parametrize(("method", "keys"), [("step=2e-3", OF_MECHANISM), ("tolerance=1e-4", OF_MECHANISM[2::7])])
def test_parameters_of_mechanisms(method: str, keys: list[str]) -> None:
    """Two-link robot, one joint controlled, one prescribed, a load that jumps: a complex step through the scheme."""
    run = _run(ROBOT, [*COARSE, *DRIVEN, f"simulation.{method}"])
    given = parameters_of(run.scene, keys)
    found = changes_of(run, differences(run, given))
    n = run.formulation.system.size  # type: ignore[attr-defined]
    for k, parameter in enumerate(given):
        by = complex_nodal_runs.given(run, parameter, 1e-3 * parameter.size)
        expected = complex_nodal_runs.differentiated(run, by)
        places, rates = np.abs(expected).max(axis=(0, 2))
        for of, scale in enumerate((places, rates + places / run.end)):
            own = found[:, k, of * n : (of + 1) * n]
            limit = EXACT * scale + NOTHING / parameter.size
            assert np.abs(own - expected[:, of]).max() <= limit, (parameter.key, of)


FLOOR = {"end": 1e-6, "turn": 1e-6, "middle": 1e-6, "moment": 1e-5, "force": 1e-5}
"""Of differences of runs, which hold the rounding of iterations; forces have that of accelerations."""
LOOP = [
    *COARSE,
    "simulation.duration=0.02",
    "simulation.step=1e-3",
    "links.crank.flexible=false",
    "links.coupler.damping={ratio=0.0}",
    "links.rocker.damping={ratio=0.0}",
    "initial.deformation=static",
]


@pytest.mark.parametrize(
    ("path", "overrides", "keys", "outputs"),
    [
        (
            ROBOT,
            [
                *COARSE,
                "simulation.duration=0.02",
                "simulation.step=1e-3",
                "initial.deformation=static",
                'joints.0.drive={type="free"}',
                "joints.0.initial.position_deg=-30",
                "gravity=[0.0, -5.0, -9.81]",
            ],
            {
                "links.forearm.model.sections.bar.width": 0.01,
                "links.upper_arm.model.frame.nodes.tip.0": 0.02,
                "links.upper_arm.model.materials.aluminium.density": 2700.0,
                "joints.0.initial.position_deg": 10.0,
                "joints.0.dh.a": 0.02,
            },
            {
                "end": lambda run: run.position("end2", [0.01, 0.02]),
                "turn": lambda run: run.joint_angle("shoulder", 0.02),
                "moment": lambda run: run.reaction("shoulder", 0.02)[1],
            },
        ),
        (
            ROBOT,
            [
                *COARSE,
                "simulation.duration=0.02",
                "simulation.step=1e-3",
                'joints.0.type="spherical"',
                'joints.0.drive={type="free"}',
            ],
            {"links.upper_arm.model.sections.bar.width": 0.01, "joints.0.dh.a": 0.02},
            {"end": lambda run: run.position("end2", [0.01, 0.02])},
        ),
        (
            FOUR_BAR / "flexible.toml",
            LOOP,
            # lengths move enough: rounding of places times the axial stiffness (1e7 N/m) is 1e-9 N of the forces
            {"links.coupler.model.sections.bar.width": 0.003, "joints.1.dh.a": 0.2, "gravity.2": 9.81},
            {
                "middle": lambda run: run.position("coupler_middle", [0.01, 0.02]),
                "force": lambda run: run.loop_reaction("rocker_pivot", 0.02)[0],
            },
        ),
    ],
    ids=["chain", "spherical", "loop"],
)
def test_differences_of_tightened_runs(
    path: Path, overrides: list[str], keys: dict[str, float], outputs: dict[str, Callable[[ChainRun], Any]]
) -> None:
    """From static starts, by dimensions of links and of joints; central differences of fourth order have floors."""
    first = _run(path, overrides)
    run = tightened(first, first.formulation, 1e-16)
    found = erls.sensitivities(run, outputs, keys)
    for difference in differences(run, parameters_of(run.scene, keys)):
        key, others = difference.parameter.key, [variant.formulation for variant in difference.variants]
        tight = [tightened(run, other, 1e-16) for other in others]
        weights = [variant.weight for variant in difference.variants]
        for name, output in outputs.items():
            expected = sum(w * np.asarray(output(other)) for w, other in zip(weights, tight, strict=True))
            apart = np.abs(found.derivatives[name][key] - expected).max()
            assert apart <= FLOOR[name] * np.abs(expected).max(), (key, name)

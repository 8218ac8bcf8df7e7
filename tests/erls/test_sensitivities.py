"""Derivatives of runs: against complex steps through the schemes, differences of tightened runs, laws of scale, closed
forms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import complex_runs
import numpy as np
import pytest
from held_runs import tightened

import erls
from erls.equations import side_by_side
from erls.equations.tangents import Evaluation
from erls.errors import SceneError
from erls.run.chain.run import ChainRun
from erls.sensitivity.forward import differentiated
from erls.sensitivity.parameters import parameters_of
from erls.sensitivity.schemes import generalized_alpha, lobatto
from erls.sensitivity.sensitivities import scheme_of
from erls.sensitivity.variants import differences
from fe_import.errors import FEImportError, ReportedError

DATA = Path(__file__).parents[2] / "data"
L, ROBOT = DATA / "l_shape" / "steel_tall.toml", DATA / "robot" / "two_link.toml"
FOUR_BAR = DATA / "four_bar"

POLYNOMIAL = 'motion={shape="polynomial", from_deg=0.0, to_deg=60.0, duration=0.03, degree=7}'
DRIVEN = [
    "simulation.duration=0.01",
    'payloads=[{point="end2", mass=0.2, inertia=[1.2e-4, 1.2e-4, 2e-4], offset=[0.0, 0.01, 0.0]}]',
    'loads=[{point="end1", force=[0.0, 1.0, 2.0], factor=[{shape="step", start=0.004, value=1.0}]}]',
    f'joints.0.drive={{type="pd", {POLYNOMIAL}, proportional_gain=200.0, derivative_gain=10.0}}',
    "joints.0.initial={position_deg=-2.0, rate=0.5}",
    "joints.0.stiffness=3.0",
    "joints.0.rest_deg=5.0",
    "joints.0.damping=0.2",
    "joints.0.friction={force=0.3, transition_rate=0.3}",
    "joints.0.motor={rotor_inertia=1e-4, gear_ratio=30.0}",
    "joints.1.motor={mass=0.3}",
    f"joints.1.drive.{POLYNOMIAL}",
]
OF_MECHANISM = [
    "gravity.2",
    "base.position.0",
    "joints.0.dh.a",
    "joints.0.dh.alpha_deg",
    "joints.0.drive.proportional_gain",
    "joints.0.drive.derivative_gain",
    "joints.0.drive.motion.to_deg",
    "joints.0.stiffness",
    "joints.0.rest_deg",
    "joints.0.damping",
    "joints.0.friction.force",
    "joints.0.friction.transition_rate",
    "joints.0.motor.rotor_inertia",
    "joints.0.motor.gear_ratio",
    "joints.0.initial.position_deg",
    "joints.0.initial.rate",
    "joints.1.drive.motion.to_deg",
    "joints.1.motor.mass",
    "payloads.0.mass",
    "payloads.0.offset.1",
    "payloads.0.inertia.2",
    "loads.0.force.2",
]
EXACT = 1e-9  # with exact tangents; measured 7e-10, of the offset of a payload, and 1e-11 of most
NOTHING = 1e-11  # of the motion per size of a parameter: one on which it does not depend


def _run(path: Path, overrides: list[str]) -> ChainRun:
    scene: Any = erls.load_scene(path, overrides)
    return erls.simulate(scene, verdict=False)


@pytest.mark.parametrize(
    ("method", "keys"), [("step=2e-3", OF_MECHANISM), ('integrator="lobatto"', OF_MECHANISM[1::6])]
)
def test_parameters_of_mechanisms(method: str, keys: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Two-link robot, one joint controlled, one prescribed, loads that jump: a complex step through the scheme.

    By collocation with forces by complex steps, too, as loops have them.
    """
    monkeypatch.setattr(side_by_side, "WORTH", 0)
    monkeypatch.setattr(Evaluation, "complex_steps", "lobatto" in method)
    run = _run(ROBOT, [*DRIVEN, f"simulation.{method}"])
    given = parameters_of(run.scene, keys)
    found = differentiated(run, differences(run, given), scheme_of(run))
    radius = run.scene.record.simulation.spectral_radius if method.startswith("step") else None
    for k, parameter in enumerate(given):
        by = complex_runs.given(run, parameter, 1e-3 * parameter.size)
        expected = complex_runs.differentiated(run, by, radius)
        for of in (0, 1):
            limit = EXACT * np.abs(expected[:, of]).max() + NOTHING / parameter.size
            assert np.abs(found[:, of, :, k] - expected[:, of]).max() <= limit, (parameter.key, of)


@pytest.mark.parametrize("key", ["links.forearm.model.sections.bar.width", "joints.0.initial.position_deg"])
def test_differences_of_tightened_runs(key: str) -> None:
    """From a static start, links of square section, of which one side grows: a pair of equal frequencies parts.

    Central differences of fourth order have a floor of 2e-6 here; with the static start's own tolerance 1e-7.
    """
    overrides = ["simulation.step=2e-3", "simulation.duration=0.04", "initial.deformation=static"]
    overrides += ['joints.0.drive={type="free"}', "joints.0.initial.position_deg=-30"]
    first = _run(ROBOT, overrides)
    run = tightened(first, first.formulation)
    outputs: dict[str, Callable[[ChainRun], Any]] = {
        "end": lambda run: run.position("end2", [0.02, 0.04]),
        "moment": lambda run: run.reaction("shoulder", 0.04)[1],
    }
    found = erls.sensitivities(run, outputs, [key])
    (difference,) = differences(run, parameters_of(run.scene, [key]))
    tight = {variant.weight: tightened(run, variant.formulation) for variant in difference.variants}
    for name, output in outputs.items():
        expected = difference.of(lambda variant, output=output: np.asarray(output(tight[variant.weight])))
        assert np.abs(found.derivatives[name][key] - expected).max() <= 2e-6 * np.abs(expected).max(), name


SCALES = ["youngs_modulus", "density"]


@pytest.mark.parametrize(
    ("path", "overrides", "links", "point"),
    [
        (
            L,
            ['simulation.formulation="ffr"', "simulation.step=1e-3", "simulation.duration=0.02"],
            {"l": "steel"},
            "tip",
        ),
        (
            L,
            [
                'simulation.formulation="nodal"',
                "simulation.elements_per_member=2",
                "simulation.step=1e-3",
                "simulation.duration=0.02",
            ],
            {"l": "steel"},
            "tip",
        ),
        (
            FOUR_BAR / "flexible.toml",
            [
                "links.crank.flexible=false",  # it follows its motor, whatever it is made of
                'simulation.integrator="lobatto"',
                "simulation.tolerance=1e-7",
                "simulation.duration=0.05",
            ],
            {"coupler": "aluminium", "rocker": "aluminium"},
            "coupler_middle",
        ),
    ],
    ids=["FFR", "nodal", "loop"],
)
def test_stiffness_and_mass_scale_out(path: Path, overrides: list[str], links: dict[str, str], point: str) -> None:
    """Under weight and prescribed motions, stiffness and mass that grow alike change nothing: E ∂/∂E + ρ ∂/∂ρ = 0.

    As far as forces balance: R itself is what is left of the sum. To 1e-8 of the parts where iterations end at
    rounding, to 1e-6 where they end at 3e-12 m. The mass of these links goes with the densities.
    """
    keys = [f"links.{name}.model.materials.{material}.{of}" for name, material in links.items() for of in SCALES]
    end = float(overrides[-1].partition("=")[2])
    run, stepped = _run(path, overrides), "integrator" not in "".join(overrides)
    run = tightened(run, run.formulation) if stepped else run
    found = erls.sensitivities(run, {"place": lambda run: run.position(point, [end / 2, end]), "mass": _mass}, keys)
    masses = [found.parameters[key] * found.derivatives["mass"][key] for key in keys]
    np.testing.assert_allclose(masses[::2], 0.0, atol=1e-9 * _mass(run))
    np.testing.assert_allclose(sum(masses[1::2]), sum(_link_mass(run, name) for name in links), rtol=1e-9)
    parts = [found.parameters[key] * found.derivatives["place"][key] for key in keys]
    assert np.abs(sum(parts)).max() <= (1e-8 if stepped else 1e-6) * np.abs(parts).max()


def test_four_bar_of_rigid_links() -> None:
    """The coupler's far end by the coupler's length: the triangle of coupler, rocker and pivot, in closed form.

    To 1e-6: the run is right to its tolerance of 1e-7 m, and keeps its loops closed to that.
    """
    run = _run(FOUR_BAR / "rigid.toml", ["simulation.duration=0.2", "simulation.tolerance=1e-6"])
    key, times = "links.coupler.rigid.points.tip.0", np.array([0.0, 0.1, 0.2])
    own = {"end": lambda run: run.position("rocker_pin", times)}
    found = erls.sensitivities(run, own, [key, "joints.1.dh.a"]).derivatives["end"]
    end, pin = run.position("rocker_pin", times), run.position("pin", times)
    pivot = np.array([0.5, 0.0, 0.0])
    for k in range(3):
        along, back = end[k] - pin[k], end[k] - pivot
        length = np.linalg.norm(along)
        expected = np.linalg.solve(np.array([along, back])[:, [0, 2]], [length, 0.0])
        moved = sum(found.values())[k]  # the joint of the rocker goes with the point
        np.testing.assert_allclose(moved[[0, 2]], expected, rtol=0, atol=1e-6)


def test_values_at_their_bounds() -> None:
    """A payload and a damper that are not there yet: differences to one side, of an output without motion too."""
    rigid = ["links.l.flexible=false", "payloads=[{point='tip'}]"]
    run = _run(L, ["simulation.duration=2e-3", "simulation.step=1e-3", *rigid])
    own = {"mass": _mass, "tip": lambda run: run.position("tip", 2e-3)}
    found = erls.sensitivities(run, own, ["payloads.0.mass", "joints.0.damping"]).derivatives
    np.testing.assert_allclose(found["mass"]["payloads.0.mass"], 1.0, rtol=1e-9)
    assert abs(found["mass"]["joints.0.damping"]) <= 1e-9 * _mass(run)
    assert found["tip"]["joints.0.damping"][2] > 0  # it falls more slowly


def _link_mass(run: ChainRun, name: str) -> float:
    return float(run.formulation.mechanism.links[run.link_number(name)].invariants.rigid_mass_matrix[0, 0])


def _mass(run: ChainRun) -> float:
    return sum(_link_mass(run, name) for name in run.link_names)


def test_motions_without_coordinates() -> None:
    """Rigid links that all follow motors: what is left is the place of a point, straight out along the second link."""
    rigid = ["links.0.flexible=false", "links.1.flexible=false", "simulation.duration=0.01"]
    run = _run(ROBOT, rigid)
    key = "joints.0.dh.a"
    found = erls.sensitivities(run, {"end": lambda run: run.position("end2", 0.0)}, [key])
    np.testing.assert_allclose(found.derivatives["end"][key], [1.0, 0.0, 0.0], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("overrides", "keys", "told"),
    [
        ([], ["payloads.0.mass"], "no member '0'"),
        ([], ["joints.shoulder.nothing"], "not given"),
        ([], ["joints.shoulder.name"], "not a number"),
        ([], ["joints..a"], "not a dotted key"),
        ([], ["simulation.duration"], "how a motion is computed"),
        ([], ["links.l.model.reduction.elastic_modes"], "chooses modes"),
        ([], ["links.l.model.frame.members.0.elements"], "whole number"),
        ([], ["links.l.elastic_modes"], "not given"),
        ([], "gravity.2", "a list of keys"),
        ([], [2], "a list of keys"),
        ([], {"gravity.2": 0.0}, "must be positive"),
        ([], {"gravity.2": "large"}, "must be positive"),
        (["simulation.integrator='rk45'"], ["gravity.2"], "steps of rk45"),
        (["simulation.output_step=0.01"], ["gravity.2"], "only some of its steps"),
        (["simulation.gauge='minimum-norm'"], ["gravity.2"], "minimum-norm gauge"),
        (["joints.0.type='spherical'"], ["gravity.2"], "rotation vectors"),
    ],
)
def test_refusals(overrides: list[str], keys: Any, told: str) -> None:
    scene: Any = erls.load_scene(L, ["simulation.duration=1e-3", *overrides])
    with pytest.raises(ReportedError, match=told):
        erls.sensitivities(scene, {"tip": lambda run: run.position("tip", 0.0)}, keys)


def test_no_outputs_are_refused() -> None:
    """Before anything runs."""
    with pytest.raises(ReportedError, match="one function of a run at least"):
        erls.sensitivities(erls.load_scene(L), {}, ["gravity.2"])


def test_halved_steps() -> None:
    """The algorithmic acceleration moves along as `erls.integrate.alpha_steps.Steps.set_step` moves it."""
    y, v, a, algorithmic = np.random.default_rng(1).normal(size=4)
    expected = [y, v, a, a + (algorithmic - a) * 0.5]
    np.testing.assert_allclose(generalized_alpha(0.8).rescaled(1e-3, 2e-3) @ [y, v, a, algorithmic], expected)
    for scheme, before in ((generalized_alpha(0.8), None), (generalized_alpha(0.8), 1e-3), (lobatto(), 2e-3)):
        np.testing.assert_array_equal(scheme.rescaled(1e-3, before), np.eye(4))


def test_bodies_are_refused() -> None:
    with pytest.raises(SceneError, match="no chain of joints and links"):
        erls.sensitivities(erls.load_scene(DATA / "heavy_top" / "slow.toml"), {}, ["gravity.2"])


def test_times_of_jumps_are_refused() -> None:
    scene: Any = erls.load_scene(ROBOT, ["simulation.duration=0.01"])
    with pytest.raises(SceneError, match="forces jump depend on this parameter"):
        erls.sensitivities(scene, {"end": lambda run: run.position("end2", 0.0)}, ["joints.0.drive.motion.duration"])


def test_outputs_that_are_no_numbers() -> None:
    run = _run(L, ["simulation.duration=1e-3"])
    for output, told in ((lambda run: "tip", "not a number"), (lambda run: np.nan, "not finite")):
        with pytest.raises(SceneError, match=told):
            erls.sensitivities(run, {"tip": output}, ["gravity.2"])


def test_faulty_descriptions_are_refused() -> None:
    scene: Any = erls.load_scene(L, ["simulation.duration=1e-3"])
    with pytest.raises((SceneError, FEImportError), match="nothing"):
        erls.sensitivities(scene, {"tip": lambda run: 0.0}, ["links.l.model.sections.leg.nothing"])


def test_links_that_are_kept() -> None:
    """Constants of equations whose links are shared with others are those of equations with links of their own."""
    run = _run(ROBOT, ["simulation.duration=0.002", 'payloads=[{point="end2", mass=0.2}]'])
    keys = ["gravity.2", "joints.0.dh.a", "joints.0.dh.alpha_deg", "payloads.0.mass"]
    for parameter in parameters_of(run.scene, keys):
        for shared in (variant.formulation for variant in differences(run, [parameter])[0].variants):
            links = tuple(replace(link) for link in shared.mechanism.links)
            alone = type(shared)(replace(shared.mechanism, links=links))
            for name in ("reals", "integers"):
                np.testing.assert_array_equal(getattr(shared.compiled, name), getattr(alone.compiled, name))

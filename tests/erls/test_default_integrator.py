"""``auto``: which method it takes for a system, that it says so, and that the scene's tolerance reaches it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scenes
from compiled_modes import CompiledElasticPendulum
from small_systems import DoublePendulum, ElasticPendulum, Modes

from erls import load_scene, simulate
from erls.equations.system import SecondOrderSystem
from erls.errors import Cause, SceneError
from erls.integrate.automatic import choose
from erls.integrate.base import Options
from erls.integrate.registry import integrator_named
from erls.scene.integrators import FIXED_STEP

DATA = Path(__file__).parents[2] / "data"
SYSTEMS: dict[str, tuple[SecondOrderSystem, str, str]] = {
    "soft": (DoublePendulum(), "dop853", "0 Hz"),
    "vibrating slowly": (ElasticPendulum(100.0), "dop853", "15.9"),
    "stiff": (ElasticPendulum(1e5), "lobatto", "1.59"),
    "compiled": (CompiledElasticPendulum(10.0), "lobatto", "compiled"),
}


@pytest.mark.parametrize("kind", SYSTEMS)
def test_the_choice_follows_the_system(kind: str) -> None:
    system, name, words = SYSTEMS[kind]
    found, why = choose(system, (0, 1), np.array([1.0, 0.0]), np.zeros(2))
    assert found == name
    assert words in why


@pytest.mark.parametrize("omega", [[2.0, 30.0], [2.0, 30.0, 1e5]])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_what_it_chooses_meets_the_tolerance(omega: list[float], tolerance: float) -> None:
    """Within a factor of five, on free vibrations."""
    start = 0.1 / np.array(omega) ** 2
    found = integrator_named("auto")(Modes(omega), (0, 2), start, np.zeros(len(omega)), Options(tolerance=tolerance))
    assert found.choice.startswith("lobatto" if len(omega) == 3 else "dop853")
    exact = start * np.cos(np.outer(found.t, omega))
    assert np.abs(found.y - exact).max() <= 5 * tolerance


def test_a_scene_may_leave_the_choice_and_is_told() -> None:
    settings = ("simulation.duration=0.05", "simulation.integrator=auto", "simulation.tolerance=1e-5")
    told: list[str] = []
    run = simulate(load_scene(DATA / "l_shape/steel_flat.toml", settings), tell=told.append, verdict=False)
    assert "integrator: lobatto: the equations are compiled" in told
    assert run.summary()["integrator"] == "lobatto: the equations are compiled"
    # a tolerance ten times smaller: more steps, by about 10^(1/5)
    fine = simulate(
        load_scene(DATA / "l_shape/steel_flat.toml", (*settings, "simulation.tolerance=1e-6")), verdict=False
    )
    assert fine.solution.work.steps > 1.3 * run.solution.work.steps
    assert np.abs(fine.position("tip", 0.05) - run.position("tip", 0.05)).max() <= 5e-6


def test_a_tolerance_must_be_positive() -> None:
    with pytest.raises(SceneError) as caught:
        load_scene(DATA / "l_shape/steel_flat.toml", ["simulation.tolerance=0"])
    assert caught.value.cause is Cause.BAD_FIELD
    assert "tolerance" in caught.value.where


@pytest.mark.parametrize(
    ("scene", "settings", "expected"),
    [
        ("l_shape/steel_flat.toml", (), "auto"),
        ("l_shape/steel_flat.toml", ("simulation.step=1e-3",), FIXED_STEP),
        ("l_shape/steel_flat.toml", ("simulation.integrator=auto",), "auto"),
        ("four_bar/flexible.toml", (), "auto"),  # a loop
    ],
)
def test_a_scene_that_names_none(scene: str, settings: tuple[str, ...], expected: str) -> None:
    assert load_scene(DATA / scene, settings).record.simulation.integrator == expected


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({}, "auto"),
        ({"step": 1e-3}, FIXED_STEP),
        ({"formulation": "ffr"}, "auto"),
        ({"formulation": "ffr", "coordinates": "absolute"}, "auto"),
        ({"formulation": "nodal"}, "auto"),
        ({"formulation": "nodal", "step": 1e-3}, FIXED_STEP),
        ({"step": 1e-3, "integrator": "lobatto"}, "lobatto"),
    ],
)
def test_what_is_taken_unless_given(tmp_path: Path, settings: dict[str, object], expected: str) -> None:
    scene = scenes.write_toml(tmp_path / "s.toml", {**scenes.L_SCENE, "simulation": {"duration": 1.0, **settings}})
    assert load_scene(scene).record.simulation.integrator == expected

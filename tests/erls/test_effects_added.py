"""Stiffening that ``auto`` adds: for lost stability and, strictly, for deflections beyond the tolerance; what it cannot
cure ends a strict run.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.auto.automatic import automatic, refuse_beyond
from erls.auto.choice import choose_effects
from erls.auto.operations import operations, stiffened_operations
from erls.auto.stiffening import STIFFENING, can_stiffen
from erls.cli.main import main
from erls.errors import Cause, SimulationError
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import DEFAULT
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene
from erls.scene.read import load_scene

DATA = scenes.ROOT / "data"
SPIN_UP, FAST, L_SHAPE = (DATA / f for f in ("spin_up/beam.toml", "slider_crank/fast.toml", "l_shape/steel_tall.toml"))
ADDED = "effects: added: geometric_stiffening, foreshortening: "


def _auto(path: Path, *changes: str, strict: bool = False) -> tuple[ChainRun, list[str]]:
    told: list[str] = []
    return erls.simulate(load_scene(path, ["effects=auto", *changes]), tell=told.append, strict=strict), told


def test_a_spin_that_takes_the_stiffness_is_foreseen() -> None:
    """From the planned speed alone, without a look; the lag of exact beams, -0.57384 m, to 0.5 %."""
    run, told = _auto(SPIN_UP, strict=True)
    assert any(t.startswith(ADDED) and "loses stability at 3.797 rad/s" in t for t in told)
    assert run.formulation.mechanism.effects == DEFAULT | STIFFENING
    assert not run.warnings
    assert run.certificate is not None
    assert run.certificate.ok
    times = np.linspace(0.0, 20.0, 2001)
    turned = np.array([s.coordinates[0] for s in run.states(times)])
    tip = run.position("tip", times)
    lag = tip[:, 1] * np.cos(turned) - tip[:, 0] * np.sin(turned)
    assert lag.min() == pytest.approx(-0.57384, rel=5e-3)


def test_links_beyond_their_range_are_told_of_and_stiffened_strictly() -> None:
    """By the estimate of the first run, 7e-3 m or 2 % of the rod: a strict run is repeated, once."""
    changes = ["simulation.duration=0.03", "simulation.formulation=ffr", "simulation.effects_tolerance=2e-3"]
    run, told = _auto(FAST, *changes)
    assert not run.formulation.mechanism.effects & STIFFENING
    assert any("--strict adds" in w for w in run.warnings)
    run, told = _auto(FAST, *changes, strict=True)
    assert run.formulation.mechanism.effects >= STIFFENING
    assert sum(t.startswith(ADDED) and "a step takes about" in t for t in told) == 1


@pytest.mark.parametrize("name", ["l_shape/steel_flat", "l_shape/steel_tall", "l_shape/steel_soft", "robot/two_link"])
def test_links_within_their_range_cost_no_more_than_all(name: str) -> None:
    """Off by up to 7e-4 m, 0.1 % of a link: that is told beyond the tolerance, and left to the user."""
    path = DATA / f"{name}.toml"
    scene = load_scene(path, ["effects=auto"])
    assert choose_effects(scene, build_mechanism(scene).mechanism).addition.names == frozenset()
    run, _ = _auto(path)
    assert run.formulation.mechanism.effects <= DEFAULT
    assert run.second_order_error is not None
    beyond = run.second_order_error > scene.record.simulation.effects_tolerance
    assert any("--strict adds" in w for w in run.warnings) == beyond


def test_stiffening_brings_auto_to_exact_beams(tmp_path: Path) -> None:
    """The tall L over 1 s against frames of exact beams, strictly: nearer than without by more than a factor of 3."""
    changes = ["simulation.duration=1.0", "simulation.step=1e-3"]
    run, _ = _auto(L_SHAPE, *changes, "simulation.effects_tolerance=2e-5", strict=True)
    assert run.formulation.mechanism.effects >= STIFFENING
    bare = erls.simulate(load_scene(L_SHAPE, [*changes, "effects=all"]))
    exact = erls.simulate(load_scene(L_SHAPE, [*changes, "simulation.formulation=nodal"]))
    times = np.linspace(0.0, 1.0, 101)
    apart = [np.abs(r.position("tip", times) - exact.position("tip", times)).max() for r in (run, bare)]
    assert 3 * apart[0] < apart[1]


def test_an_estimate_after_the_run_warns_or_repeats() -> None:
    """A run beyond the tolerance warns; a strict one is repeated, once, and with what it then needs."""
    changes = ["simulation.duration=0.5", "simulation.step=1e-3", "simulation.effects_tolerance=1e-5"]
    run, _ = _auto(L_SHAPE, *changes)
    assert run.formulation.mechanism.effects == DEFAULT
    assert any("estimated to be off by" in w and "--strict adds" in w for w in run.warnings)
    run, told = _auto(L_SHAPE, *changes, strict=True)
    assert run.formulation.mechanism.effects == DEFAULT | STIFFENING
    assert sum(t.startswith(ADDED) for t in told) == 1


def test_what_cannot_be_cured_ends_a_strict_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Matrices alone know no stiffening: exit code 4, the run kept; without --strict a warning."""
    arguments = ["simulate", str(DATA / "calculix/l_pendulum.toml"), "--set", "effects=auto"]
    arguments += ["--set", "simulation.effects_tolerance=1e-7", "--set", "simulation.duration=0.1"]
    assert main([*arguments, "--json"]) == 0
    assert any("estimated to be off" in w for w in json.loads(capsys.readouterr().out)["warnings"])
    output = tmp_path / "run.h5"
    assert main([*arguments, "--strict", "--json", "-o", str(output)]) == 4
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["cause"] == Cause.BEYOND_TOLERANCE
    assert "nodal or substructures" in error["remedy"]
    assert erls.load_run(output).end == pytest.approx(0.1)


def test_what_runs_themselves_call_meaningless_is_refused() -> None:
    """Lost stability, and static modes too near their loads; a run within the tolerance passes."""
    run = erls.simulate(load_scene(L_SHAPE, ["simulation.duration=0.01", "effects=auto"]))
    refuse_beyond(run)
    for text in ("link 'l': the linear model loses stability at 3 rad/s", "modes above the bandwidth, 3 Hz, follow"):
        with pytest.raises(SimulationError) as caught:
            refuse_beyond(replace(run, warnings=(text,)))
        assert caught.value.cause == Cause.BEYOND_TOLERANCE
        assert caught.value.exit_code == 4
        assert text in caught.value.message


def test_runs_that_fail_change_the_physics_once() -> None:
    """A runaway is repeated with stiffening; where that fails too, the cause is told."""
    scene = load_scene(L_SHAPE, ["effects=auto", "simulation.duration=0.01"])
    whole = build_mechanism(scene).mechanism

    def failing(stiffened: bool, cause: Cause) -> Any:
        def integrate(given: Scene, mechanism: Mechanism) -> ChainRun:
            if (mechanism.effects >= STIFFENING) == stiffened:
                raise SimulationError(cause, "as the test wants")
            return erls.simulate(replace(given))

        return integrate

    told: list[str] = []
    run = automatic(scene, whole, failing(False, Cause.RUNAWAY), told.append, False)
    assert run.formulation.mechanism.effects == DEFAULT | STIFFENING
    assert any(t.startswith(ADDED) for t in told)
    with pytest.raises(SimulationError) as caught:
        automatic(scene, whole, failing(False, Cause.NEWTON_FAILED), told.append, False)
    assert caught.value.cause == Cause.NEWTON_FAILED
    tight = load_scene(L_SHAPE, ["effects=auto", "simulation.duration=0.01", "simulation.effects_tolerance=1e-9"])
    with pytest.raises(SimulationError) as caught:
        automatic(tight, whole, failing(True, Cause.NEWTON_FAILED), told.append, True)
    assert caught.value.cause == Cause.BEYOND_TOLERANCE  # with what could be computed, which is without
    assert any("repeated without" in t for t in told)


def test_only_modal_links_with_second_order_can_be_stiffened() -> None:
    """Not beams of the nodal formulation, bare matrices, rigid links, or what is stiffened already."""
    for path, change, possible in (
        (L_SHAPE, "effects=auto", True),
        (L_SHAPE, "simulation.formulation=nodal", False),
        (L_SHAPE, "links.l.flexible=false", False),
        (SPIN_UP, "simulation.step=1e-2", False),
        (DATA / "calculix/l_pendulum.toml", "effects=auto", False),
    ):
        scene = load_scene(path, [change])
        assert can_stiffen(build_mechanism(scene).mechanism, scene.record.simulation) == possible


def test_stiffening_is_counted() -> None:
    """Once or twice as much again, however the equations are implemented: alone, and in a loop."""
    for path in (L_SHAPE, DATA / "four_bar/flexible.toml"):
        mechanism = build_mechanism(load_scene(path)).mechanism
        ratio = stiffened_operations(mechanism).iteration / operations(mechanism).iteration
        assert 1.5 < ratio < 2.5


def test_links_solved_one_by_one_are_counted_so(tmp_path: Path) -> None:
    """Factors and solutions of long chains grow with the links, not with the square and cube of the coordinates."""
    costs = []
    for count in (8, 16):
        scenes.arm_link(tmp_path)
        dh = {"convention": "standard", "a": 0.3}
        data = {
            "simulation": {"duration": 0.1},
            "joints": [{"name": f"j{k}", "dh": dh} for k in range(count)],
            "links": [{"name": f"l{k}", "model": "arm.toml", "mesh_pose": {"frame": "joint"}} for k in range(count)],
        }
        scene = load_scene(scenes.write_toml(tmp_path / "chain.toml", data))
        costs.append(operations(build_mechanism(scene).mechanism))
    for name in ("solution", "factors"):
        assert getattr(costs[1], name) == pytest.approx(2 * getattr(costs[0], name), rel=0.1)
    assert costs[1].factors < costs[1].evaluation

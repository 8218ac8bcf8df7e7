"""Second-order displacements and ``auto``: kept where they matter, counted; what no effect cures ends a strict run."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scenes

import erls
from erls.auto.automatic import refuse_beyond
from erls.auto.operations import operations
from erls.cli.main import main
from erls.errors import Cause, SimulationError
from erls.mechanism.effects import ALL, LINEAR, SECOND_KINEMATICS
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism
from erls.scene.read import load_scene

DATA = scenes.ROOT / "data"
SPIN_UP, L_SHAPE = (DATA / f for f in ("spin_up/beam.toml", "l_shape/steel_tall.toml"))


def _auto(path: Path, *changes: str, strict: bool = False) -> tuple[ChainRun, list[str]]:
    told: list[str] = []
    return erls.simulate(load_scene(path, ["effects=auto", *changes]), tell=told.append, strict=strict), told


def test_a_spin_that_takes_the_stiffness_keeps_them() -> None:
    """Second-order displacements stay; the lag of exact beams, -0.57384 m, to 0.5 %, which is told in metres."""
    run, _ = _auto(SPIN_UP)
    assert run.formulation.mechanism.effects >= SECOND_KINEMATICS - {"modal_inertia"}
    (warning,) = run.warnings
    assert "are estimated to be off by about" in warning
    assert run.certificate is not None
    assert run.certificate.ok
    assert run.accuracy is not None
    assert run.trust is not None
    assert run.trust.verdict == "limited"
    assert 1.35e-3 <= run.accuracy.links <= 15 * 1.35e-3  # off by that much, tests/erls/test_links_error.py
    times = np.linspace(0.0, 20.0, 2001)
    turned = np.array([s.coordinates[0] for s in run.states(times)])
    tip = run.position("tip", times)
    lag = tip[:, 1] * np.cos(turned) - tip[:, 0] * np.sin(turned)
    assert lag.min() == pytest.approx(-0.57384, rel=5e-3)


def test_what_cannot_be_cured_ends_a_strict_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Members that form a ring know no stiffening: exit code 4, the run kept; without --strict a warning."""
    arguments = ["simulate", str(DATA / "thermal/bimetal.toml"), "--set", "effects=auto"]
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


def test_stiffening_is_counted() -> None:
    """Once or twice as much again, however the equations are implemented: alone, and in a loop."""
    for path in (L_SHAPE, DATA / "four_bar/flexible.toml"):
        mechanism = build_mechanism(load_scene(path)).mechanism
        linear = replace(mechanism, effects=LINEAR)
        stiffened = replace(mechanism, effects=ALL - {"modal_inertia"})
        assert 1.5 < operations(stiffened).iteration / operations(linear).iteration < 2.5
        assert operations(mechanism).iteration > operations(stiffened).iteration


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

"""What runs state of their error: cases that were once told nothing or too little, files, JSON, verdicts, --strict."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from scipy.special import ellipj, ellipk

import erls
from erls.accuracy import statement
from erls.accuracy.audits import Audit
from erls.accuracy.judged_integration import Integrated
from erls.accuracy.statement import stated
from erls.accuracy.vibrations import swing_between_knots
from erls.cli.main import main
from erls.integrate.base import Solution, Work, hermite
from erls.maths.so3 import Array
from erls.run.accuracy import PARTS
from erls.run.bodies.rest import BodyRest
from erls.run.chain.run import ChainRun

DATA = scenes.ROOT / "data"
GRAVITY = 9.81


def rods(folder: Path, count: int, duration: float, **simulation: Any) -> Path:
    """Rigid rods of 1 m in a row, let go from the horizontal."""
    nodes = {"root": [0.0, 0.0, 0.0], "tip": [1.0, 0.0, 0.0]}
    member = {"from": "root", "to": "tip", "elements": 2, "material": "m", "section": "s"}
    scenes.arm_link(folder, frame={"nodes": nodes, "members": [member]})
    hinges = [{"name": f"hinge {k}", "dh": {"convention": "standard", "a": 1.0}} for k in range(count)]
    links = [
        {"name": f"rod {k}", "model": "arm.toml", "flexible": False, "mesh_pose": {"frame": "joint"}}
        for k in range(count)
    ]
    scene = {
        "gravity": [0.0, -GRAVITY, 0.0],
        "simulation": {"duration": duration, **simulation},
        "joints": hinges,
        "links": links,
        "points": [{"name": "tip", "link": f"rod {count - 1}", "node": "tip"}],
    }
    return scenes.write_toml(folder / "rods.toml", scene)


def rod_angle(run: ChainRun, t: Array) -> Array:
    """Of a rod let go from the horizontal, by Jacobi's sn: sin(φ/2) = k sn(K - ωt, k), φ from the vertical."""
    omega = np.sqrt(-run.formulation.acceleration(0.0, np.zeros(1), np.zeros(1))[0])  # with the section's inertia
    k = np.sin(np.pi / 4)
    sn = ellipj(ellipk(k**2) - omega * t, k**2)[0]
    return 2 * np.arcsin(k * sn) - np.pi / 2


@pytest.mark.parametrize("duration", [6.0, 60.0, 600.0])
def test_a_pendulum_states_how_far_it_drifts(tmp_path: Path, duration: float) -> None:
    """Against the closed form: at least the actual error, and no more than ten times; 3e-4 m after ten minutes."""
    run = erls.simulate(rods(tmp_path, 1, duration))
    assert isinstance(run, ChainRun)
    assert run.accuracy is not None
    assert run.trust is not None
    times = np.linspace(0.0, duration, 4001)
    angle = rod_angle(run, times)
    exact = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    actual = float(np.linalg.norm(run.position("tip", times) - exact, axis=1).max())
    total = run.accuracy.total
    assert total is not None
    assert actual <= total <= 10 * actual
    assert run.trust.verdict == ("good" if total <= 1e-4 else "limited")
    assert (run.accuracy.horizon is None) == (total <= 1e-4)
    if run.accuracy.horizon is not None:
        within = times <= run.accuracy.horizon
        assert np.linalg.norm(run.position("tip", times[within]) - exact[within], axis=1).max() <= 1e-4


@pytest.mark.parametrize(
    ("duration", "changes"), [(10.0, ()), (5.0, ("simulation.integrator=generalized_alpha", "simulation.step=1e-3"))]
)
def test_a_tumbling_triple_pendulum_is_told(tmp_path: Path, duration: float, changes: tuple[str, ...]) -> None:
    """It was 0.05 m off after 5 s with `lobatto`, 0.9 m with generalized-α at 1 ms, and nothing was said."""
    path = rods(tmp_path, 3, duration)
    run = erls.simulate(erls.load_scene(path, changes))
    tight = erls.simulate(erls.load_scene(path, ["simulation.tolerance=1e-8"]), verdict=False)
    times = np.linspace(0.0, duration, 1001)
    apart = np.linalg.norm(run.position("tip", times) - tight.position("tip", times), axis=1)
    assert run.accuracy is not None
    assert run.trust is not None
    assert run.accuracy.total is not None
    assert apart.max() <= run.accuracy.total
    assert run.trust.verdict == "limited"
    assert run.accuracy.horizon is not None
    assert apart[times <= run.accuracy.horizon].max(initial=0.0) <= 1e-4


def test_a_soft_l_with_linear_links_says_how_far_it_is_off(tmp_path: Path) -> None:
    """E/100: 0.75 m from exact beams (`benchmarks/links_error.py`), said within a factor of five."""
    scenes.l_link(tmp_path, elements=8, materials={"m": {"youngs_modulus": 2e9}})
    run = erls.simulate(scenes.l_scene(tmp_path, simulation={"effects": "linear"}))
    assert run.accuracy is not None
    assert run.trust is not None
    assert run.accuracy.links is not None
    assert 0.75 <= run.accuracy.links <= 5 * 0.75
    assert run.trust.verdict != "good"


@pytest.mark.parametrize(
    ("scene", "beams"),
    [
        ("l_shape/steel_tall.toml", 1.1e-5),
        ("l_shape/steel_flat.toml", 2.4e-5),
        ("l_shape/aluminium.toml", 3.0e-5),
        ("robot/two_link.toml", 2.0e-5),
        ("robot/three_link.toml", 4.0e-5),
    ],
)
def test_shipped_scenes_are_good_and_cover_their_distance_from_exact_beams(scene: str, beams: float) -> None:
    """Distances: tests/erls/test_reference.py; of which those of the reference's own mesh, 1e-5 m, are a part."""
    run = erls.simulate(DATA / scene)
    assert run.accuracy is not None
    assert run.trust is not None
    assert run.accuracy.total is not None
    assert beams - 1e-5 <= run.accuracy.total <= 10 * beams
    assert run.trust.verdict == ("good" if run.accuracy.total <= 1e-4 else "limited")


def test_what_is_interpolated_swings_no_farther_than_is_found() -> None:
    """q = A cos ωt between knots 20 rad apart: by J. Hermite's polynomial farther than its places tell."""
    amplitude, omega = 1e-6, 1.5e4
    t = np.cumsum(np.tile([0.0011, 0.0017, 0.0014], 40))
    y, v, a = (x[:, None] for x in (np.cos(omega * t), -omega * np.sin(omega * t), -(omega**2) * np.cos(omega * t)))
    run = Solution(t, amplitude * y, amplitude * v, amplitude * a, Work())
    middle = (t[1:-2] + t[2:-1]) / 2
    actual = np.abs(hermite(run.t, run.y, run.v, run.a, middle)[0]).max()
    found = swing_between_knots(run, np.arange(len(t)), np.ones((1, 1)))
    assert actual > 10 * amplitude
    assert actual - 3 * amplitude <= found[0] <= actual + 3 * amplitude
    slow = Solution(t, np.sin(40 * t)[:, None], 40 * np.cos(40 * t)[:, None], -1600 * np.sin(40 * t)[:, None], Work())
    assert swing_between_knots(slow, np.arange(len(t)), np.ones((1, 1)))[0] < 1e-6  # (40 h)^4 / 24, h = 1.4 ms


def test_disturbances_that_grow_are_told_from_those_that_add_up() -> None:
    t = np.linspace(0.0, 2.0, 101)
    for error, amplified in ((t, 1.0), (t**2, 4 / 3), (np.exp(4 * t), np.exp(4.0) / 3)):
        assert Integrated(t, 1e-6 * error, {}, {}).amplified() == pytest.approx(amplified, rel=1e-3)


def test_a_horizon_is_given_up_to_where_half_of_the_rest_is_left() -> None:
    """Of an error that is t, 0.2 of other parts and a tolerance of 1: until 2 t = 0.8."""
    t = np.linspace(0.0, 2.0, 201)
    found = Integrated(t, t, {}, {})
    assert found.horizon(1.0, 0.2) == pytest.approx(0.4, abs=0.011)  # an instant of the curve
    assert found.horizon(2.5, 0.2) is None
    assert found.horizon(0.1, 0.2) is None


def test_files_and_json_hold_the_statement(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A run that was read states the same; without a verdict nothing stands there."""
    scene, file = str(DATA / "l_shape/steel_tall.toml"), tmp_path / "run.h5"
    short = ["--set", "simulation.duration=0.1", "--json"]
    assert main(["simulate", scene, *short, "-o", str(file)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert set(told["accuracy"]) == {"total", *PARTS, "efforts", "reactions", "horizon", "judged_at"}
    assert told["accuracy"]["judged_at"] == ["elbow", "tip"]
    assert told["accuracy"]["total"] == pytest.approx(sum(told["accuracy"][part] for part in PARTS))
    assert told["trust"] == {"verdict": "good", "reasons": []}
    again = erls.load_run(file)
    assert again.stated() == {key: told[key] for key in ("accuracy", "trust")}
    assert main(["info", str(file)]) == 0
    assert "verdict: good" in capsys.readouterr().out
    assert main(["simulate", scene, *short, "--no-verdict"]) == 0
    assert {"accuracy", "trust"}.isdisjoint(json.loads(capsys.readouterr().out))


def test_an_unknown_part_or_a_breach_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """No total without all parts; a balance that does not hold is told before anything else."""
    run = erls.simulate(erls.load_scene(DATA / "l_shape/steel_tall.toml", ["simulation.duration=0.05"]), verdict=False)
    assert run.accuracy is None
    with monkeypatch.context() as patch:
        patch.setattr(statement, "modes_error", lambda run: (None, "a superelement"))
        found = stated(run)
    assert found.accuracy is not None
    assert found.trust is not None
    assert found.accuracy.total is None
    assert found.trust.verdict == "broken"
    assert "modes is not known: a superelement" in found.trust.reasons[0]
    monkeypatch.setattr(statement, "audits", lambda run, error: (Audit("energy", 2.0, 1.0, "", False, "half is lost"),))
    found = stated(run)
    assert found.trust is not None
    assert found.trust.verdict == "broken"
    assert found.trust.reasons == ("audit: half is lost",)


def test_strict_runs_are_repeated_until_they_keep_the_tolerance(tmp_path: Path) -> None:
    """Ten minutes of a pendulum; where other parts are too large, exit code 4 and the run kept."""
    path = rods(tmp_path, 1, 600.0)
    assert isinstance(loose := erls.simulate(path), ChainRun)
    run = erls.simulate(path, strict=True)
    assert isinstance(run, ChainRun)
    assert loose.trust is not None
    assert run.trust is not None
    assert run.accuracy is not None
    assert loose.trust.verdict == "limited"
    assert run.trust.verdict == "good"
    assert (run.accuracy.total or 1.0) <= 1e-4
    assert main(["simulate", str(DATA / "spin_up/beam.toml"), "--strict", "--set", "simulation.duration=0.5", "--set",
                 "links.0.reduction.elastic_modes=2", "--set", "simulation.tolerance=1e-9"]) == 4  # fmt: skip


def test_strict_runs_get_the_modes_and_effects_that_they_lack() -> None:
    """Two modes, linear: limited by both; repeated with all, within the tolerance."""
    lacking = ["links.0.reduction.elastic_modes=2", "simulation.effects='linear'", "simulation.duration=0.3"]
    loose = erls.simulate(erls.load_scene(DATA / "l_shape/steel_tall.toml", lacking))
    assert isinstance(loose, ChainRun)
    assert loose.accuracy is not None
    assert (loose.accuracy.modes or 0.0) > 1e-4
    run = erls.simulate(erls.load_scene(DATA / "l_shape/steel_tall.toml", lacking), strict=True)
    assert isinstance(run, ChainRun)
    assert run.trust is not None
    assert run.trust.verdict == "good"
    assert run.formulation.mechanism.links[0].elastic_modes > 2


def test_equilibria_state_what_their_mesh_leaves() -> None:
    """Eight chords of the 45° bend, against 64 elements on the arc; the roll-up is exact with any mesh."""
    coarse = erls.simulate(DATA / "statics/bend_45.toml")
    assert isinstance(coarse, BodyRest)
    fine = erls.simulate(
        erls.load_scene(DATA / "statics/bend_45.toml", ["beams.0.elements=64"]), verdict=False
    )
    end = coarse.end
    actual = float(np.linalg.norm(coarse.position("tip", end) - fine.position("tip", end)))
    assert coarse.accuracy is not None
    assert coarse.trust is not None
    assert coarse.accuracy.total is not None
    assert actual <= coarse.accuracy.total <= 3 * actual
    assert coarse.trust.verdict == "limited"
    exact = erls.simulate(DATA / "statics/roll_up.toml")
    assert exact.accuracy is not None
    assert exact.trust is not None
    assert (exact.accuracy.total or 0.0) < 1e-10
    assert exact.trust.verdict == "good"


def test_a_copy_with_other_knots_is_not_trusted() -> None:
    """Velocities a thousandth too large: an audit tells."""
    run = erls.simulate(erls.load_scene(DATA / "l_shape/steel_tall.toml", ["simulation.duration=0.5"]), verdict=False)
    s = run.solution
    found = stated(replace(run, solution=replace(s, v=1.001 * s.v)))
    assert found.trust is not None
    assert found.trust.verdict != "good"

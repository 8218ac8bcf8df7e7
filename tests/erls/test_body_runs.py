"""Runs of bodies and beams: coordinates of connections, energy, load steps, files, what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scenes
from body_scenes_data import PENDULUM, STRIP, body_scene
from checkpoint_times import at_every_look

import erls
from erls.errors import Cause, SceneError
from erls.mechanism.place import Place
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.rest import BodyRest
from erls.view import write_view
from erls.view.figures import figure_of

BOB = PENDULUM["bodies"][0]
SPINNING = {**BOB, "velocity": [0.0, 0.0, -60.0], "angular_velocity": [0.0, 60.0, 0.0]}


def _motion(path: Path, *changes: str) -> BodyMotion:
    run = erls.simulate(erls.load_scene(path, changes))
    assert isinstance(run, BodyMotion)
    return run


def test_turns_are_counted(tmp_path: Path) -> None:
    """Two turns without weight: coordinate and place say the same at any time."""
    run = _motion(body_scene(tmp_path, PENDULUM, bodies=[SPINNING], gravity=[0.0, 0.0, 0.0]))
    t = np.linspace(0, 0.2, 7)
    np.testing.assert_allclose(run.joint_angle("pin", t), 60 * t, atol=1e-9)
    place = np.stack([np.cos(60 * t), 0 * t, -np.sin(60 * t)], axis=1)
    np.testing.assert_allclose(run.position("bob", t), place, atol=1e-6)
    assert run.samples([0.2])[0]["joints"]["pin"]["angle"] == run.joint_angle("pin", 0.2)


def test_prescribed_and_sliding_coordinates() -> None:
    """The crank of the fast slider-crank follows its motion, the guide the slider."""
    path = scenes.ROOT / "data" / "slider_crank" / "fast_beams.toml"
    run = _motion(path, "simulation.duration=0.01", "simulation.step=2e-4")  # 4 ms is one: nothing is interpolated
    motion = run.scene.record.connections[0].motion
    assert motion is not None
    curve = motion.build(Place(path.parent, "motion", revolute=True))
    t = np.array([0.0, 0.004, 0.01])
    np.testing.assert_allclose(run.joint_angle("pivot", t), [curve.value(x) for x in t.tolist()], atol=1e-9)
    np.testing.assert_allclose(run.joint_angle("guide", t), run.position("slider", t)[:, 0] - 0.45, atol=1e-12)


@pytest.mark.parametrize("group", ["SE(3)", "R3xSO(3)"])
def test_energy_at_any_time(tmp_path: Path, group: str) -> None:
    """That of the knots, and of a pendulum on its way down."""
    run = _motion(body_scene(tmp_path, PENDULUM), f"simulation.group={group}")
    t, totals = run.energies()
    kinetic, potential = run.energy(t)
    np.testing.assert_allclose(kinetic + potential, totals, atol=1e-9)
    fallen = run.position("bob", t)[:, 2]
    np.testing.assert_allclose(kinetic, -2 * 9.81 * fallen, atol=2e-3)


def test_load_steps_are_known_and_nothing_between(tmp_path: Path) -> None:
    """Load parameters at which no equilibrium was computed are refused, with those that are known."""
    run = erls.simulate(body_scene(tmp_path, STRIP, simulation={"load_steps": 4}))
    assert isinstance(run, BodyRest)
    assert run.times.tolist() == [0.25, 0.5, 0.75, 1.0]
    assert run.nearest([0.0, 0.4, 0.9]).tolist() == [0.25, 0.5, 1.0]
    assert run.spread(2).tolist() == [0.25, 1.0]
    with pytest.raises(SceneError, match=r"0\.25, 0\.5, 0\.75, 1") as caught:
        run.position("tip", 0.3)
    assert caught.value.cause is Cause.TIME_OUT_OF_RANGE


def test_magnification(tmp_path: Path) -> None:
    """At rest from where all is built; a motion has nothing to count from."""
    rest = erls.simulate(body_scene(tmp_path, STRIP))
    figure = figure_of(rest, 5.0)
    (pose,) = figure.poses([1.0])
    (root, tip), (built, _) = pose.points(5.0), pose.points(0.0)
    moved = rest.position("tip", 1.0) - [2, 0, 0]
    np.testing.assert_allclose(tip, [2, 0, 0] + 5 * moved, atol=1e-12)
    np.testing.assert_allclose(root, built, atol=1e-12)
    assert len(pose.outline()) == 1
    motion = _motion(body_scene(tmp_path, PENDULUM), "simulation.duration=0.01")
    with pytest.raises(SceneError, match="no displacement to magnify"):
        write_view(motion, tmp_path / "a.png", magnification=2.0)


def test_beams_are_drawn_along_their_interpolation() -> None:
    """The rolled-up strip: every drawn point on the circle that three elements hold, past half a turn of each."""
    run = erls.simulate(scenes.ROOT / "data" / "statics" / "roll_up.toml")
    (pose,) = figure_of(run).poses([1.0])
    (line,) = pose.nodes(1.0)
    radius = 10 / (4 * np.pi)
    np.testing.assert_allclose(np.linalg.norm(line - [0, radius, 0], axis=1), radius, rtol=1e-9)
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    assert length == pytest.approx(10, rel=2e-3)


def test_films_hold_every_load_step(tmp_path: Path) -> None:
    """A film of equilibria shows the nearest load step at each of its times."""
    run = erls.simulate(body_scene(tmp_path, STRIP, simulation={"load_steps": 2}))
    told: list[tuple[int, int]] = []
    write_view(run, tmp_path / "a.gif", fps=6, progress=lambda *done: told.append(done))
    assert told == [(k, 4) for k in range(1, 5)]


def test_files_need_nothing_else(tmp_path: Path) -> None:
    """A table that a load names is in the file; damage is reported."""
    (tmp_path / "up.csv").write_text("0, 0\n1, 1\n", encoding="utf-8")
    load = {**STRIP["loads"][0], "factor": [{"shape": "table", "file": "up.csv"}]}
    run = erls.simulate(body_scene(tmp_path, STRIP, loads=[load]))
    erls.save_run(tmp_path / "run.h5", run)
    (tmp_path / "up.csv").unlink()
    loaded = erls.load_run(tmp_path / "run.h5")
    assert loaded.summary() == run.summary()
    erls.save_run(tmp_path / "again.h5", loaded)
    assert (tmp_path / "again.h5").read_bytes() == (tmp_path / "run.h5").read_bytes()


def test_checkpoints_and_interrupts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A long motion saves what it has."""
    at_every_look(monkeypatch)
    told: list[float] = []
    erls.simulate(body_scene(tmp_path, PENDULUM), checkpoint=tmp_path / "p.h5", progress=lambda t, d: told.append(t))
    assert told[-1] == pytest.approx(0.2)
    left = erls.load_run(tmp_path / "p.h5")
    assert left.failure is not None
    assert left.failure.cause is Cause.INTERRUPTED
    assert left.end > 0


def test_stress_is_of_links(tmp_path: Path) -> None:
    """What only chains have is refused."""
    run = erls.simulate(body_scene(tmp_path, STRIP))
    with pytest.raises(SceneError, match="those of links"):
        erls.stress(run, "strip", 1.0)

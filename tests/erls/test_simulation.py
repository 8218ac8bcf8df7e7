"""Scene in, run out: failures with what was computed, warnings, progress, breakpoints, checkpoints."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from body_scenes_data import PENDULUM, body_scene
from checkpoint_times import at_every_look

import erls
from erls.cli.main import main
from erls.errors import Cause, SceneError, SimulationError
from erls.run.file import load_run
from erls.scene.integrators import INTEGRATORS

JOINT = scenes.L_SCENE["joints"][0]
RIGID = [{"name": "l", "model": "link.toml", "flexible": False}]
PASSIVE = [{"name": "l", "rigid": {"mass": 0.0, "points": {"elbow": [0, 0, 0], "tip": [1, 0, 0]}}}]


def torque(*profiles: dict[str, Any]) -> dict[str, Any]:
    return {"drive": {"type": "torque", "profiles": list(profiles)}}


def step(value: float) -> dict[str, Any]:
    return torque({"shape": "step", "start": 0.002, "value": value})


def scene(folder: Path, joint: dict[str, Any] | None = None, **changes: Any) -> Path:
    """The L pendulum for 10 ms, changed."""
    scenes.l_link(folder)
    simulation = {"duration": 0.01, "step": 5e-4, **changes.pop("simulation", {})}
    return scenes.l_scene(folder, joints=[{**JOINT, **(joint or {})}], simulation=simulation, **changes)


# joint, other changes, cause, whether anything was computed
FAILURES: dict[str, tuple[dict[str, Any], dict[str, Any], Cause, bool]] = {
    "torque beyond reason": (step(1e29), {}, Cause.NOT_FINITE, True),
    "rate beyond reason": ({"initial": {"rate": 1e29}}, {}, Cause.NOT_FINITE, False),
    "friction that sticks at once": (
        {"friction": {"force": 1e10, "transition_rate": 1e-6}, "initial": {"rate": 1e8}},
        {"links": RIGID, "simulation": {"integrator": "bdf", "step": None}},
        Cause.STEP_TOO_SMALL,
        True,
    ),
    "nothing that resists": ({}, {"links": PASSIVE}, Cause.SINGULAR_MASS, False),
}


@pytest.mark.parametrize("kind", FAILURES)
def test_failures(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Time, remedy and the run until then; exit code 3; the run file holds it if there is anything to hold."""
    joint, changes, cause, computed = FAILURES[kind]
    if "simulation" in changes:
        changes = {**changes, "simulation": {k: v for k, v in changes["simulation"].items() if v is not None}}
    path = scene(tmp_path, joint, **changes)
    with pytest.raises(SimulationError) as caught:
        erls.simulate(path)
    error = caught.value
    assert error.cause == cause
    assert error.where.startswith("t = ")
    assert error.where.endswith(" s")
    assert error.remedy
    assert error.exit_code == 3
    assert error.run is not None
    assert error.run.failure is error
    assert (error.run.end > 0) == computed
    assert float(error.where.split()[2]) == pytest.approx(error.run.end, abs=1e-4)
    assert np.isfinite(error.run.position("tip", error.run.end)).all()

    output = tmp_path / "out.h5"
    assert main(["simulate", str(path), "-o", str(output)]) == 3
    out, text = capsys.readouterr()
    assert out == ""
    assert text.splitlines()[-1].startswith(f"error: {error.where}: ")
    assert output.exists() == computed
    assert not list(tmp_path.glob(".*"))
    assert not list(tmp_path.glob("*.partial"))
    if computed:
        assert f"up to t = {error.run.end:.6g} s, is in {output}" in text
        loaded = load_run(output)
        assert loaded.failure is not None
        assert (loaded.failure.cause, loaded.end) == (cause, error.run.end)
        assert main(["info", str(output), "--json"]) == 0  # whatever the numbers are
        assert json.loads(capsys.readouterr().out)["failure"]["cause"] == str(cause)
        assert main(["info", str(output)]) == 0
        assert "stopped early: t = " in capsys.readouterr().out
    assert main(["simulate", str(path), "--json"]) == 3
    assert json.loads(capsys.readouterr().out)["error"]["cause"] == str(cause)


def test_no_equilibrium(tmp_path: Path) -> None:
    """A failure before the first step has no run, and names the field that asked for it."""
    path = scene(tmp_path, initial={"deformation": "static"}, gravity=[0, 0, -9e6], simulation={"effects": "linear"})
    with pytest.raises(SimulationError) as caught:
        erls.simulate(path)
    assert caught.value.cause == Cause.NO_EQUILIBRIUM
    assert caught.value.where == "initial.deformation"
    assert caught.value.run is None
    assert main(["simulate", str(path), "-o", str(tmp_path / "out.h5")]) == 3
    assert not (tmp_path / "out.h5").exists()


def test_an_interrupt_keeps_what_was_computed(tmp_path: Path) -> None:
    """Ctrl-C after five steps."""
    times: list[float] = []

    def interrupt(t: float, end: float) -> None:
        times.append(t)
        if len(times) == 5:
            raise KeyboardInterrupt

    with pytest.raises(SimulationError) as caught:
        erls.simulate(scene(tmp_path), progress=interrupt)
    assert caught.value.cause == Cause.INTERRUPTED
    assert caught.value.exit_code == 130
    assert caught.value.run is not None
    assert caught.value.run.end == pytest.approx(times[-1])


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_summary_of_every_integrator_is_json(tmp_path: Path, integrator: str) -> None:
    """Counts are plain integers, whatever a foreign solver counts in."""
    path = scene(tmp_path, links=RIGID, simulation={"integrator": integrator, "duration": 0.002})
    run = erls.simulate(path)
    summary = run.summary([0.001])
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    assert type(summary["factorizations"]) is int
    erls.save_run(tmp_path / "r.h5", run)
    assert load_run(tmp_path / "r.h5").solution.work == run.solution.work


# warnings


def told(path: Path, **arguments: Any) -> tuple[list[str], list[str]]:
    """Warnings as they are told, and those of the run."""
    messages: list[str] = []
    run = erls.simulate(path, tell=messages.append, **arguments)
    return [m.removeprefix("warning: ") for m in messages if m.startswith("warning: ")], list(run.warnings)


def test_a_sound_scene_has_no_warnings(tmp_path: Path) -> None:
    assert told(scene(tmp_path)) == ([], [])


def test_large_deflections_are_warned_of(tmp_path: Path) -> None:
    """Beyond 10 % of the link's size, or 0.2 rad; a tenth of the load is fine."""
    down = {"duration": 0.1, "step": 1e-3, "effects": "linear"}
    now, later = told(scene(tmp_path, simulation=down, gravity=[0, 0, -2000.0]))
    assert now == later
    for text in ("link 'l' moves by up to", "small displacements", "link 'l': expect errors of about"):
        assert any(text in w for w in now)
    assert told(scene(tmp_path, simulation=down, gravity=[0, 0, -20.0])) == ([], [])


@pytest.mark.parametrize(
    ("motion", "warned"),
    [
        ({"shape": "sine", "amplitude": 0.1, "frequency_hz": 1.0, "start": 0.005}, True),
        ({"shape": "sine", "amplitude": 0.1, "frequency_hz": 1.0}, True),  # a start at full rate
        ({"shape": "sine", "amplitude": 0.1, "frequency_hz": 1.0, "start": 0.5}, False),  # after the end
        ({"shape": "sine", "amplitude": 0.1, "frequency_hz": 1.0, "start": 0.005, "phase_deg": 90.0}, False),
        ({"shape": "polynomial", "from": 0.0, "to": 0.1, "duration": 0.005, "degree": 3}, False),
    ],
    ids=["jump", "jump at the start", "jump after the end", "no jump", "acceleration jumps"],
)
def test_jumps_of_a_prescribed_rate_are_warned_of(tmp_path: Path, motion: dict[str, Any], warned: bool) -> None:
    """They would need an infinite force; jumps of the acceleration are fine."""
    now, later = told(scene(tmp_path, {"drive": {"type": "motion", "motion": motion}}, links=RIGID))
    assert now == later
    assert len(now) == warned
    if warned:
        assert f"'shoulder': the prescribed rate jumps at t = {motion.get('start', 0.0):g} s" in now[0]


def test_explicit_methods_warn_at_the_start(tmp_path: Path) -> None:
    """Frequency, step limit and way out, before the long run and not after it; the implicit default does not."""
    scenes.l_link(tmp_path, 8, reduction={"method": "craig-bampton", "fixed_interface_modes": 24})
    simulation = {"duration": 20.0, "integrator": "dop853"}
    path = scenes.l_scene(tmp_path, simulation=simulation)
    messages: list[str] = []

    def stop(t: float, end: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(SimulationError) as caught:
        erls.simulate(path, progress=stop, tell=messages.append)
    (warning,) = [m for m in messages if m.startswith("warning: ")]
    assert "dop853 is explicit: the highest frequency" in warning
    assert "limits its step" in warning
    assert "generalized_alpha" in warning
    assert caught.value.run is not None
    assert caught.value.run.warnings == (warning.removeprefix("warning: "),)
    assert told(scenes.l_scene(tmp_path, simulation={"duration": 0.002})) == ([], [])


def test_warnings_of_a_failed_run_are_told_on_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A wrong mesh pose may be why it failed."""
    pose = {"name": "l", "model": "link.toml", "mesh_pose": {"position": [0.1, 0.0, 0.0]}}
    assert main(["simulate", str(scene(tmp_path, step(1e29), links=[pose]))]) == 3
    text = capsys.readouterr().err
    assert text.index("warning: link 'l': interface 'root' lies 0.1 m off the axis") < text.index("error: ")


# progress, breakpoints, checkpoints


def test_progress_rises_to_the_end(tmp_path: Path) -> None:
    """Called with the time after every step, and the duration."""
    calls: list[tuple[float, float]] = []
    run = erls.simulate(scene(tmp_path), progress=lambda t, end: calls.append((t, end)))
    times = [t for t, _ in calls]
    assert times == sorted(set(times))
    assert times[-1] == 0.01
    assert {end for _, end in calls} == {0.01}
    assert len(calls) == run.solution.work.steps == 20


@pytest.mark.parametrize("integrator", ["generalized_alpha", "dop853", "bdf"])
def test_breakpoints_of_drives_are_knots(tmp_path: Path, integrator: str) -> None:
    """Twice, with the acceleration on either side; those outside the run are not."""
    profile = {"shape": "trapezoid", "start": 0.0021, "rise": 0.0, "hold": 0.00333, "fall": 0.1, "value": 0.5}
    path = scene(tmp_path, torque(profile), simulation={"integrator": integrator}, links=RIGID)
    t = erls.simulate(path).solution.t
    for event in (0.0021, 0.00543):
        assert np.count_nonzero(np.abs(t - event) < 1e-12) == 2
    assert t[-1] == 0.01
    assert len(np.unique(t)) == len(t) - 2


def test_checkpoints(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A long run saves what it has; the file loads, is marked unfinished, and gives the same answers."""
    at_every_look(monkeypatch)
    partial, found = tmp_path / "r.h5.partial", []

    def look(t: float, end: float) -> None:
        if partial.exists() and t < 0.004:
            found.append(load_run(partial))

    run = erls.simulate(scene(tmp_path), progress=look, checkpoint=partial)
    assert len(found) > 3
    for saved in found:
        assert saved.failure is not None
        assert saved.failure.cause == Cause.INTERRUPTED
        assert 0 < saved.end < 0.004
        np.testing.assert_allclose(saved.position("tip", saved.end), run.position("tip", saved.end), atol=1e-15)


def test_the_command_line_removes_its_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Once the run itself is written; also after a failure. One from before stays until then."""
    at_every_look(monkeypatch)
    output, partial = tmp_path / "r.h5", tmp_path / "r.h5.partial"
    assert main(["simulate", str(scene(tmp_path)), "-o", str(output)]) == 0
    output.rename(partial)  # as a run that was killed leaves it
    assert main(["simulate", str(scene(tmp_path)), "-o", str(output), "--set", "links.l.model=nix.toml"]) == 2
    assert partial.exists()
    assert main(["simulate", str(scene(tmp_path)), "-o", str(output)]) == 0
    assert not partial.exists()
    assert main(["simulate", str(scene(tmp_path, step(1e29))), "-o", str(output)]) == 3
    assert sorted(p.name for p in tmp_path.iterdir()) == ["link.toml", "r.h5", "scene.toml"]


def test_a_checkpoint_that_cannot_be_written_does_not_end_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk may have room again at the end."""
    at_every_look(monkeypatch)
    messages: list[str] = []
    path = scene(tmp_path)
    run = erls.simulate(path, tell=messages.append, checkpoint=tmp_path / "nix" / "r.partial")
    assert run.end == 0.01
    assert any("no checkpoint" in m and "make the folder first" in m for m in messages)


def test_formulation_is_checked_before_work(tmp_path: Path) -> None:
    """An unknown one, with those there are."""
    tell: Callable[[str], None] = lambda text: pytest.fail("worked already")  # noqa: E731
    with pytest.raises(SceneError, match="known: erls") as caught:
        erls.simulate(scene(tmp_path, simulation={"formulation": "x"}), tell=tell)
    assert caught.value.cause == Cause.BAD_REFERENCE


HALVED: dict[str, dict[str, Any]] = {
    "erls": {"integrator": "generalized_alpha"},
    "ffr": {"integrator": "generalized_alpha", "formulation": "ffr"},
    "nodal": {"formulation": "nodal"},
    "absolute": {"integrator": "generalized_alpha", "formulation": "ffr", "coordinates": "absolute"},
}


def told_of_halved(run: Any, end: float, step: float) -> None:
    """One warning, that says which of the given steps have knots inside."""
    grid = np.linspace(0.0, end, round(end / step) + 1)
    parts = np.flatnonzero(np.histogram(run.solution.t, grid + 1e-9)[0] > 1)
    told = [text for text in run.warnings if "halved" in text]
    assert len(told) == 1
    count, first = f"{len(parts)} of {len(grid) - 1} steps were halved", f"first at t = {grid[parts[0]]:.6g} s"
    assert told[0].startswith(f"{count}, {first}, since Newton's method did not converge: use a smaller")


@pytest.mark.parametrize("name", HALVED)
def test_halved_steps_are_told_once(name: str, tmp_path: Path) -> None:
    """Of a joint whose friction turns over within a step; nothing without friction."""
    settings = {**HALVED[name], "step": 1e-3, "duration": 0.02}
    sticks = {"initial": {"rate": 0.5}, "friction": {"force": 20.0, "transition_rate": 0.05}}
    told_of_halved(erls.simulate(scene(tmp_path, sticks, simulation=settings)), 0.02, 1e-3)
    free = erls.simulate(scene(tmp_path, {"initial": {"rate": 0.5}}, simulation=settings))
    assert not any("halved" in text for text in free.warnings)


def test_halved_steps_of_bodies_are_told(tmp_path: Path) -> None:
    """A pendulum of 2 s with steps of a quarter of that."""
    told_of_halved(erls.simulate(body_scene(tmp_path, PENDULUM, simulation={"step": 0.5, "duration": 2.0})), 2.0, 0.5)


@pytest.mark.parametrize("name", ["erls", "nodal"])
def test_friction_that_turns_over_within_a_step_is_named(name: str, tmp_path: Path) -> None:
    """Newton's method goes to and fro between both signs of 20 N m, at all steps that are tried."""
    settings = {**HALVED[name], "step": 1e-3, "duration": 0.02}
    sticks = {"initial": {"rate": 0.5}, "friction": {"force": 20.0, "transition_rate": 1e-3}}
    with pytest.raises(SimulationError, match="friction has too small a transition_rate") as caught:
        erls.simulate(scene(tmp_path, sticks, simulation=settings))
    assert caught.value.cause == Cause.NEWTON_FAILED

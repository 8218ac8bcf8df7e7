"""Runs that go on from a checkpoint: equal, bit for bit, to those that nothing stopped."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from body_scenes_data import PENDULUM, body_scene
from checkpoint_times import at_every_look
from contact_scenes import on_a_slope
from loop_scenes import parallelogram
from resumed_runs import chunks_of, equal, l_scene, refused
from test_limited_motors import DRIVE
from test_sticking_loops import LEVEL
from test_sticking_loops import parallelogram as four_bar

import erls
from erls.cli.main import main
from erls.equations.registry import formulate
from erls.errors import Cause, SceneError, SimulationError
from erls.integrate.base import Solution
from erls.integrate.choice import integrator, options_of
from erls.integrate.memory import Memory
from erls.run.checkpoints import Checkpoints, key_of, read_checkpoint
from erls.run.file import load_run
from erls.scene.build import build_mechanism
from erls.scene.read import load_chain

DATA = scenes.ROOT / "data"
L, CRANK = DATA / "l_shape/steel_tall.toml", DATA / "slider_crank/flexible.toml"
TOP: dict[str, Any] = {
    "gravity": [0.0, 0.0, 0.0],
    "simulation": {"duration": 0.5, "integrator": "lobatto", "tolerance": 1e-6},
    "joints": [
        {
            "name": "ball",
            "type": "spherical",
            "dh": {"convention": "modified"},
            "coordinates": {"turn_x": {"initial": {"rate": 3.0}}, "turn_z": {"initial": {"rate": 70.0}}},
        }
    ],
    "links": [{"name": "top", "rigid": {"mass": 2.0, "inertia": [0.03, 0.03, 0.05], "points": {"centre": [0, 0, 0]}}}],
}
PIN = {"name": "pin", "dh": {"convention": "modified"}, "initial": {"rate": 3.0}}
HALVED: dict[str, Any] = {
    "simulation": {"duration": 0.5, "step": 0.01, "integrator": "generalized_alpha"},
    "joints": [{**PIN, "friction": {"force": 0.5, "transition_rate": 0.01}}],
    "links": TOP["links"],
}
STICKS: dict[str, Any] = {  # five times, and for good
    "simulation": {"duration": 1.2, "integrator": "lobatto"},
    "joints": [{**PIN, "stiffness": 20.0, "friction": {"force": 0.5, "static_force": 0.7, "law": "stick"}}],
    "links": TOP["links"],
}
RUBS = {"friction": {"force": 0.12, "law": "stick"}}
LINKAGE: dict[str, Any] = {  # three joints that come to rest together, and for good
    **four_bar({"stiffness": 40.0, "rest": LEVEL, **RUBS}, RUBS, {}, LEVEL + 0.07),
    "simulation": {"duration": 1.0},
}
SLOPE = on_a_slope(25.0, -1.0, {"coefficient": 0.3, "law": "stick"})
LIMITED: dict[str, Any] = {**STICKS, "joints": [{**PIN, "drive": DRIVE}]}
CASES: dict[str, tuple[Path | dict[str, Any], list[str]]] = {
    "lobatto": (L, ["duration=0.3"]),
    "stored output": (L, ["duration=0.3", "output_step=0.004"]),
    "static modes": (L, ["duration=0.3", "bandwidth=200.0"]),
    "equal steps": (L, ["duration=0.05", "step=1e-3"]),
    "halved steps": (HALVED, []),
    "loop": (CRANK, ["duration=0.05"]),
    "loop, equal steps": (CRANK, ["duration=0.02", "step=2e-4"]),
    "change point": (parallelogram(), ["duration=0.3", "integrator=lobatto"]),
    "rotation vectors": (TOP, []),
    "rk45": (TOP, ["integrator=rk45", "rtol=1e-9", "atol=1e-10"]),
    "sticking": (STICKS, []),
    "sticking, equal steps": (STICKS, ["integrator=generalized_alpha", "step=5e-3"]),
    "sticking, nodal": (STICKS, ["formulation=nodal", "integrator=generalized_alpha", "step=5e-3"]),
    "sticking, loop": (LINKAGE, ["integrator=lobatto"]),
    "sticking, loop, equal steps": (LINKAGE, ["integrator=generalized_alpha", "step=5e-3"]),
    "limits": (LIMITED, ["integrator=lobatto"]),
    "limits, nodal": (LIMITED, ["formulation=nodal", "integrator=generalized_alpha", "step=5e-3"]),
    "points that stick": (SLOPE, ["duration=0.3"]),
    "points that stick, nodal": (SLOPE, ["duration=0.3", "formulation=nodal", "step=5e-3"]),
    "sticking, dop853": (STICKS, ["integrator=dop853", "output_step=0.01"]),
    "dop853": (TOP, ["integrator=dop853", "rtol=1e-9", "atol=1e-10"]),
    "nodal": (L, ["duration=0.02", "step=1e-3", "formulation=nodal"]),
    "absolute": (L, ["duration=0.02", "step=1e-3", "formulation=ffr", "coordinates=absolute"]),
}


class Kept:
    """A keeper of copies of everything."""

    def __init__(self, memory: Memory | None = None) -> None:
        self.memory, self.all = memory, list[Memory]()

    def offer(self, memory: Callable[[], Memory]) -> None:
        self.all.append({name: values.copy() for name, values in memory().items()})


@pytest.mark.parametrize("name", CASES)
def test_integrators_go_on(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From any of five moments, with other chunks of steps than before; offering changes nothing."""
    chunks_of(random.Random(1), monkeypatch)
    source, changes = CASES[name]
    path = source if isinstance(source, Path) else scenes.write_toml(tmp_path / "scene.toml", source)
    scene = load_chain(path, [f"simulation.{change}" for change in changes])
    mechanism, settings = build_mechanism(scene).mechanism, scene.record.simulation

    def run(keeper: Kept | None) -> Solution:
        formulation, options = formulate(mechanism, settings), replace(options_of(settings), keeper=keeper)
        span = (0.0, settings.duration)
        return integrator(mechanism, settings)(
            formulation, span, *formulation.initial_state(), options, lambda t, knots: None
        )

    kept = Kept()
    whole = run(kept)
    assert whole.failure is None
    assert bool(whole.halved.steps) == (name == "halved steps")
    # steps beyond an exchange are made again, as many as were made at once
    counted = name not in ("rotation vectors", "change point")
    assert equal(run(None), whole, counted)
    assert len(kept.all) > 5
    for k in sorted({*np.linspace(0, len(kept.all) - 1, 5).astype(int).tolist()}):
        resumed = Kept(kept.all[k])
        found = run(resumed)
        assert equal(found, whole, counted), f"from {kept.all[k]['time']}"
        assert found.halved == whole.halved
        assert all(offered["time"] > kept.all[k]["time"] for offered in resumed.all)


def stopped(scene: Path, checkpoint: Path, looks: int, changes: tuple[str, ...] = ()) -> float:
    """Time up to which a run was saved that was interrupted after so many looks."""
    left = [looks]

    def look(t: float, end: float) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt

    with pytest.raises(SimulationError):
        erls.simulate(erls.load_scene(scene, changes), progress=look, checkpoint=Checkpoints(checkpoint, changes))
    (part,) = read_checkpoint(checkpoint).parts.values()
    return float(part.memory["time"][0])


def test_runs_go_on_through_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With what runs state of themselves, and events whose steps the run keeps; nothing is computed twice."""
    at_every_look(monkeypatch)
    chunks_of(random.Random(2), monkeypatch)
    crossing = {"name": "down", "coordinate": "angle", "joint": "shoulder", "value_deg": 3.0}
    scene = l_scene(tmp_path, events=[crossing], simulation={"output_step": 1e-3})
    whole, path = erls.simulate(scene), tmp_path / "r.partial"
    for looks in (3, 8):
        saved, seen = stopped(scene, path, looks), list[float]()
        going = Checkpoints(path, saved=read_checkpoint(path))
        run = erls.simulate(scene, progress=lambda t, end, seen=seen: seen.append(t), checkpoint=going)
        assert min(seen) > saved > 0
        assert equal(run.solution, whole.solution)
        assert run.summary([0.1])["samples"] == whole.summary([0.1])["samples"]
        assert (run.accuracy, run.trust, run.warnings, run.events) == (
            whole.accuracy,
            whole.trust,
            whole.warnings,
            whole.events,
        )


def test_an_event_ends_a_resumed_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last checkpoint lies before it."""
    at_every_look(monkeypatch)
    chunks_of(random.Random(9), monkeypatch)
    ends = {"name": "end", "coordinate": "angle", "joint": "shoulder", "value_deg": 3.0, "stop": True}
    scene, path = l_scene(tmp_path, events=[ends]), tmp_path / "r.partial"
    whole = erls.simulate(scene, checkpoint=path, verdict=False)
    assert 0 < whole.end < 0.2
    run = erls.simulate(scene, checkpoint=Checkpoints(path, saved=read_checkpoint(path)), verdict=False)
    assert equal(run.solution, whole.solution, work=False)  # steps beyond the event count
    assert run.events == whole.events


def test_motions_of_bodies_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With multipliers."""
    at_every_look(monkeypatch)
    scene, path = body_scene(tmp_path, PENDULUM, simulation={"step": 1e-3}), tmp_path / "r.partial"
    whole = erls.simulate(scene)
    stopped(scene, path, 9)
    run = erls.simulate(scene, checkpoint=Checkpoints(path, saved=read_checkpoint(path)))
    assert equal(run.solution, whole.solution)
    assert np.array_equal(run.solution.multipliers, whole.solution.multipliers)


def test_effects_that_were_chosen_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """``auto`` chooses the same again; its run is not made again once it had ended."""
    at_every_look(monkeypatch)
    chunks_of(random.Random(3), monkeypatch)
    scene, path = l_scene(tmp_path, simulation={"effects": "auto"}), tmp_path / "r.partial"
    whole = erls.simulate(scene, checkpoint=path)
    seen: list[float] = []
    going = Checkpoints(path, saved=read_checkpoint(path))
    run = erls.simulate(scene, checkpoint=going, progress=lambda t, end: seen.append(t))
    assert seen == []
    assert list(going.finished) == [key_of(whole.scene)]  # later checkpoints hold it, too
    assert equal(run.solution, whole.solution)
    assert run.certificate is not None
    assert whole.certificate is not None
    assert run.certificate.error == whole.certificate.error
    assert key_of(run.scene) == key_of(whole.scene)


# the command


def test_the_command_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With what --set gave before; it writes the run and removes the checkpoint. Then nothing is left to resume."""
    at_every_look(monkeypatch)
    chunks_of(random.Random(4), monkeypatch)
    scene, output = l_scene(tmp_path), tmp_path / "r.h5"
    changes = ("simulation.duration=0.1",)
    stopped(scene, tmp_path / "r.h5.partial", 6, changes)
    assert main(["simulate", str(scene), "--resume", str(output), "--no-verdict"]) == 0
    assert equal(load_run(output).solution, erls.simulate(erls.load_scene(scene, changes)).solution)
    assert not (tmp_path / "r.h5.partial").exists()
    assert "the run is finished" in refused(capsys, str(scene), "--resume", str(output))
    output.unlink()
    assert main(["simulate", str(scene), "--resume", str(output), "--set", changes[0], "--no-verdict"]) == 0
    assert "the run starts anew" in capsys.readouterr().err
    assert output.exists()


def test_what_changed_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A setting, a joint, the material of a link, the program; the checkpoint stays as it was."""
    at_every_look(monkeypatch)
    chunks_of(random.Random(5), monkeypatch)
    scene, path = l_scene(tmp_path), tmp_path / "r.h5.partial"
    stopped(scene, path, 6)
    before, resume = path.read_bytes(), ("--resume", str(tmp_path / "r.h5"))
    text = refused(capsys, str(scene), *resume, "--set", "simulation.duration=0.3")
    assert str(Cause.CHANGED) in text or "table 'simulation' of the scene" in text
    assert "'joints'" in refused(capsys, str(scene), *resume, "--set", "joints.0.initial.rate=1.0")
    heavier = {"materials": {"m": {**scenes.L_LINK["materials"]["m"], "density": 7801.0}}}
    scenes.write_toml(tmp_path / "link.toml", scenes.merged(scenes.L_LINK, heavier))
    assert "modal model 0 ('l" in refused(capsys, str(scene), *resume)
    scenes.l_link(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr("erls.run.checkpoints.made_with", lambda: "another program")
        assert "another program" in refused(capsys, str(scene), *resume)
    assert path.read_bytes() == before
    assert not (tmp_path / "r.h5").exists()


def test_damage_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Bytes that are missing or flipped, a memory of something else, a file that is none, one without a checkpoint."""
    at_every_look(monkeypatch)
    chunks_of(random.Random(6), monkeypatch)
    scene, path = l_scene(tmp_path), tmp_path / "r.h5.partial"
    stopped(scene, path, 6)
    whole, draw, saved, causes = path.read_bytes(), random.Random(7), read_checkpoint(path), set()
    for _ in range(8):
        damaged = bytearray(whole)
        damaged[draw.randrange(len(damaged))] ^= 1 << draw.randrange(8)
        path.write_bytes(damaged)
        try:
            found = read_checkpoint(path)
        except SceneError as problem:
            causes.add(problem.cause)
        else:  # a byte between what is stored
            assert found.made_from == saved.made_from
            for key, part in found.parts.items():
                assert all(np.array_equal(v, saved.parts[key].memory[k]) for k, v in part.memory.items())
    assert causes
    assert causes <= {Cause.RUN_FILE, Cause.NOT_READABLE}
    for damaged in (whole[: len(whole) // 2], b"", b"not HDF5"):
        path.write_bytes(damaged)
        assert str(path) in refused(capsys, str(scene), "--resume", str(tmp_path / "r.h5"))
    ((key, part),) = saved.parts.items()
    for name, values in (("steps.known", np.zeros(3)), ("leg", np.array([-1])), ("recorder.t", np.zeros(0))):
        other = replace(saved, parts={key: part._replace(memory={**part.memory, name: values})})
        with pytest.raises(SceneError) as caught:
            erls.simulate(scene, checkpoint=Checkpoints(path, saved=other))
        assert caught.value.cause == Cause.RUN_FILE
    path.unlink()
    erls.save_run(path, erls.simulate(scene, verdict=False))
    assert "no checkpoint" in refused(capsys, str(scene), "--resume", str(tmp_path / "r.h5"))


def test_integrators_that_cannot_go_on_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Their checkpoints can be read, and are no more than that."""
    at_every_look(monkeypatch)
    path = tmp_path / "r.h5.partial"
    changed = scenes.merged(TOP, {"simulation": {"integrator": "radau", "duration": 0.005}})
    scene = scenes.write_toml(tmp_path / "scene.toml", changed)
    erls.simulate(scene, checkpoint=path, verdict=False)
    assert load_run(path).end > 0
    assert "cannot go on from a checkpoint" in refused(capsys, str(scene), "--resume", str(tmp_path / "r.h5"))


START = """
import sys
import erls.run.watches.checkpoint as checkpoint
from erls.cli.main import main

checkpoint.FIRST_S = checkpoint.LEAST_S = 0.05
sys.exit(main())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX systems")
def test_killed_processes_go_on(tmp_path: Path) -> None:
    """SIGKILL twice, soon after a checkpoint each, then to the end: as though nothing had happened."""
    settings = {"duration": 20.0, "integrator": "generalized_alpha", "step": 5e-4, "output_step": 1e-2}
    scene, output = l_scene(tmp_path, simulation=settings), tmp_path / "r.h5"
    partial = tmp_path / "r.h5.partial"

    def start(*more: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-c", START, "simulate", str(scene), "--no-verdict", *more]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    reached = [0.0]
    for more in (("-o", str(output)), ("--resume", str(output))):
        before, process = partial.stat().st_mtime_ns if partial.exists() else 0, start(*more)
        for _ in range(3000):
            if process.poll() is not None or (partial.exists() and partial.stat().st_mtime_ns > before):
                break
            time.sleep(0.01)
        process.kill()
        _, told = process.communicate()
        assert partial.exists(), told
        (part,) = read_checkpoint(partial).parts.values()
        reached.append(float(part.memory["time"][0]))
    assert 0.0 < reached[1] < reached[2] < 20.0
    process = start("--resume", str(output))
    _, told = process.communicate(timeout=120)
    assert process.returncode == 0, told
    assert equal(load_run(output).solution, erls.simulate(scene, verdict=False).solution)
    assert not partial.exists()

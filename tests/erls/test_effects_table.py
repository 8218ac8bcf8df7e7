"""What `erls effects` prints: complete, with reasons, for every formulation, and where motions fail."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from unittest import mock

import pytest
import scenes
from effect_scenes import random_chain

from erls.auto import sizes as sizes_module
from erls.auto.sizes import FAILS, UNSTABLE
from erls.auto.survey import survey
from erls.cli.main import main
from erls.errors import Cause, SimulationError
from erls.mechanism.effects import EFFECTS

DATA = scenes.ROOT / "data"
FLAT = DATA / "l_shape/steel_flat.toml"


def _arguments(path: Path, *changes: str) -> list[str]:
    return ["effects", str(path), *(part for change in changes for part in ("--set", change))]


def _table(capsys: pytest.CaptureFixture[str], path: Path, *changes: str) -> tuple[dict[str, Any], dict[str, Any], str]:
    """The JSON, its rows by name, and the text, of one survey: both commands would make the same."""
    made: list[Any] = []

    def once(*given: Any) -> Any:
        made.extend([] if made else [survey(*given)])
        return made[0]

    with mock.patch("erls.auto.survey.survey", once):
        assert main([*_arguments(path, *changes), "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert main(_arguments(path, *changes)) == 0
    return found, {row["name"]: row for row in found["effects"] if not row["link"]}, capsys.readouterr().out


def test_an_effect_without_which_there_is_no_motion_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The mass matrix of this chain turns indefinite without `inertia_second_order`; the other rows stand."""
    path = random_chain(tmp_path, 0)
    found, rows, text = _table(capsys, path, "simulation.duration=0.05", "simulation.effects=linear")
    assert rows["inertia_second_order"]["outcome"] == FAILS
    assert rows["inertia_second_order"]["error"] is None
    assert rows["inertia_second_order"]["why"] == "needed"
    assert rows["gravity"]["outcome"] is None
    assert rows["gravity"]["error"] > 0
    assert FAILS in next(line for line in text.split("\n") if line.startswith("inertia_second_order"))
    assert "fails: no motion without it, or none that four times the work follows" in text.replace("\n", " ")
    assert len(rows) + len(found["left_out"]) == len(EFFECTS)


def test_interrupts_are_not_swallowed() -> None:
    """They end the command."""

    def interrupted() -> float:
        raise SimulationError(Cause.INTERRUPTED, "as the test wants")

    with pytest.raises(SimulationError):
        sizes_module._or_fails(interrupted, 0.0)


def test_motions_that_leave_their_links_are_unstable(capsys: pytest.CaptureFixture[str]) -> None:
    """The spun-up beam: with all effects every size means something, and without stiffening nothing does."""
    _, rows, text = _table(capsys, DATA / "spin_up/beam.toml", "effects=auto")
    assert rows["geometric_stiffening"]["outcome"] == UNSTABLE
    assert rows["geometric_stiffening"]["auto"]
    assert rows["spin_softening"]["error"] < 10.0
    assert "e+" not in text.split("not asked for")[0].replace("e+03", "")  # forces of kilonewtons


REASONS: list[tuple[Path, tuple[str, ...], dict[str, str]]] = [
    (
        FLAT,
        (),
        {
            "spin_softening": "needed",  # 4e-5 m of 3e-5 m
            "inertia_second_order": "goes with spin_softening",  # 1e-6 m, and saves nothing alone
            "gravity": "saves nothing",
        },
    ),
    (FLAT, ("simulation.effects_tolerance=1e-3",), {"spin_softening": "deciding costs more"}),
    (DATA / "calculix/l_pendulum.toml", (), {"spin_softening": "deciding costs more"}),
]


@pytest.mark.parametrize(("path", "changes", "whys"), REASONS)
def test_reasons(
    path: Path, changes: tuple[str, ...], whys: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    """The column agrees with the verdict below it, and says why an effect stays."""
    found, rows, text = _table(capsys, path, *changes)
    assert "all kept" in found["decision"]
    assert all(row["auto"] for row in found["effects"])
    assert {name: rows[name]["why"] for name in whys} == whys
    assert all(len(line) <= 116 for line in text.split("\n\n")[-1].split("\n"))


def test_what_auto_leaves_out_is_off(capsys: pytest.CaptureFixture[str]) -> None:
    """Stiff links in a long run: the verdict, and the rows."""
    slow = [f"joints.{j}.drive.motion.duration=40.0" for j in ("shoulder", "elbow_joint")]
    led = ["drive.type=\"pd\"", "drive.proportional_gain=3000.0", "drive.derivative_gain=60.0"]
    led += ["drive.feed_forward=true", "motor.rotor_inertia=5e-3"]
    changes = [*slow, *(f"joints.{j}.{c}" for j in ("shoulder", "elbow_joint") for c in led)]
    changes += ['initial.deformation="static"', "simulation.duration=60.0", "simulation.step=5e-4"]
    assert main([*_arguments(DATA / "robot/two_link.toml", *changes), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    off = {row["name"] for row in found["effects"] if not row["auto"]}
    assert off >= {"coriolis", "centrifugal_load", "spin_softening"}
    assert all(row["why"] is None for row in found["effects"] if not row["auto"])
    assert "auto leaves out" in found["decision"]


def test_links_say_why_they_have_no_stiffening(capsys: pytest.CaptureFixture[str]) -> None:
    """As a run does."""
    effects = "effects=all,geometric_stiffening"
    found, rows, text = _table(capsys, DATA / "thermal/bimetal.toml", effects, "simulation.duration=0.1")
    assert not rows["geometric_stiffening"]["present"]
    assert "has no geometric stiffening and foreshortening" in found["missing"][0]
    assert "has no geometric stiffening and foreshortening" in text.replace("\n", " ")


def test_nodal_says_what_to_do(capsys: pytest.CaptureFixture[str]) -> None:
    """One message, bad input."""
    assert main([*_arguments(FLAT, "simulation.formulation=nodal"), "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["cause"] == Cause.BAD_FIELD
    assert "simulation.formulation" in error["where"]
    assert "simulation.formulation=erls" in error["remedy"]


KINDS: list[tuple[str, ...]] = [
    ("simulation.formulation=ffr",),
    ("simulation.formulation=ffr", "simulation.coordinates=absolute"),
    ("simulation.gauge=minimum-norm",),
    ("simulation.formulation=ffr", "links.l.substructures=2"),
    ("simulation.bandwidth=30",),
    ("links.l.flexible=false",),
    ('joints.0.drive={type="motion", motion={shape="spin_up", rate=1.0, duration=0.05}}',),
]


@pytest.mark.parametrize("changes", KINDS, ids=lambda changes: changes[-1][:40])
def test_every_kind_of_scene_has_a_table(
    tmp_path: Path, changes: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    """With few modes, for a short time, also where stiffening is added."""
    scenes.l_link(tmp_path, reduction={"elastic_modes": 4})
    path = scenes.l_scene(tmp_path, simulation={"duration": 0.05, "step": 1e-3})
    for tolerance in (1e-4, 1e-9):
        assert main([*_arguments(path, *changes, f"simulation.effects_tolerance={tolerance}"), "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["decision"]
        assert all(row["outcome"] is None for row in found["effects"])

"""Departure against deflection over several scenes: table, order, what cannot be compared, all forms of the report."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
import scenes
from body_scenes_data import STRIP, body_scene

from erls.cli.main import main
from erls.errors import Cause, SceneError
from erls.report.scenes_page import scenes_csv, scenes_page, scenes_text
from erls.studies.compare_scenes import SceneComparison, compare_scenes, scenes_summary

SHORT = {"duration": 0.02, "step": 5e-4}


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> SceneComparison:
    """The L under ten and thirty times its weight, the L with modal damping, a scene of bodies."""
    folder = tmp_path_factory.mktemp("compared")
    paths = []
    scenes.l_link(folder, 8)
    for name, g in (("light", 100.0), ("heavy", 300.0)):
        scene = scenes.l_scene(folder, name=name, gravity=[0.0, 0.0, -g], simulation={**SHORT, "effects": "linear"})
        paths.append(scene.rename(folder / f"{name}.toml"))
    damped = {**scenes.read_toml(paths[0]), "name": "damped"}
    damped["links"] = [{**damped["links"][0], "damping": {"ratio": 0.01}}]
    paths += [scenes.write_toml(folder / "damped.toml", damped), body_scene(folder, STRIP)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("erls.studies.compare._SAMPLES", 40)
        return compare_scenes(paths, ["ffr", "nodal"], workers=1)


def test_departures_are_of_second_order(compared: SceneComparison) -> None:
    """Three times the weight: three times the deflection, nine times the departure, within a tenth of an order."""
    light, heavy = compared.departures
    assert [Path(d.scene).stem for d in (light, heavy)] == ["light", "heavy"]
    assert light.as_expected
    assert heavy.as_expected
    assert heavy.deflection == pytest.approx(3 * light.deflection, rel=0.15)
    assert compared.order("ffr") == pytest.approx(2.0, abs=0.1)
    assert compared.order("erls") is None
    assert compared.reference == "nodal"


def test_what_is_not_comparable_is_said(compared: SceneComparison) -> None:
    """Modal damping, which nodal elements have not, and a scene of bodies; the others go on."""
    assert [Path(s).name for s in compared.refused] == ["damped.toml", "bodies.toml"]
    text = scenes_text(compared)
    assert "damped.toml is not comparable: link 'l': the nodal formulation has no modes" in text
    assert "bodies.toml is not comparable" in text
    assert "2 of 2 scenes second order in the deflection" in text
    assert text.index("light") < text.index("heavy")


def test_all_forms_say_the_same(compared: SceneComparison) -> None:
    """Text, page, table and JSON."""
    summary = scenes_summary(compared)
    shown = f"{summary['departures'][1]['departure']:.3g}"
    assert shown in scenes_text(compared)
    assert f"<td>{shown}</td>" in scenes_page(compared)
    rows = list(csv.reader(scenes_csv(compared).splitlines()))
    assert [float(r[4]) for r in rows[1:]] == [d["departure"] for d in summary["departures"]]
    assert summary["orders"] == {"ffr": compared.order("ffr")}
    assert len(summary["scenes"]) == 3


def test_command_on_several_scenes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """JSON on stdout and in the file; 2 when nothing could be compared, with the reasons."""
    monkeypatch.setattr("erls.studies.compare._SAMPLES", 10)
    scenes.l_link(tmp_path)
    scene = str(scenes.l_scene(tmp_path, simulation={"duration": 0.005, "step": 1e-3}))
    bodies, output = str(body_scene(tmp_path, STRIP)), tmp_path / "c.json"
    arguments = ["compare", scene, bodies, "--formulations", "ffr,nodal", "--workers", "1"]
    assert main([*arguments, "-o", str(output), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["output"] == str(output)
    assert list(found["not_comparable"]) == [bodies]
    assert json.loads(output.read_text(encoding="utf-8"))["departures"][0]["scene"] == scene
    other = tmp_path / "other"
    other.mkdir()
    nothing = [bodies, str(body_scene(other, STRIP))]
    assert main(["compare", *nothing, "--formulations", "ffr,nodal"]) == 2
    assert capsys.readouterr().out.count("not comparable") == 2


@pytest.mark.parametrize(("names", "cause"), [(["nodal"], Cause.BAD_FIELD), (["ffr", "nodel"], Cause.BAD_REFERENCE)])
def test_faulty_columns(tmp_path: Path, names: list[str], cause: Cause) -> None:
    """As with one scene."""
    with pytest.raises(SceneError) as caught:
        compare_scenes([tmp_path / "a.toml", tmp_path / "b.toml"], names)
    assert str(caught.value.cause) == str(cause)

"""Sensors that cannot be meant, or cannot read where they sit: refused with file, field and remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import scenes
from sensor_cases import ENDS, refused, sensor

from erls.cli.main import main


@pytest.mark.parametrize(
    ("given", "place", "said"),
    [
        ({"type": "thermometer"}, "sensors[0]", "thermometer"),
        ({"point": "top"}, "sensors[0].point", "tip"),
        (sensor("joint_angle", joint="elbow"), "sensors[0].joint", "shoulder"),
        ({"name": "tip"}, "sensors[0].name", "rename"),
        ({"name": "a/b"}, "sensors[0].name", "rename"),
        ({"direction": [0.0, 0.0, 0.0]}, "sensors[0].direction", "not all 0"),
        ({"axes": "mesh"}, "sensors[0].axes", "node, link, world"),
        ({"colour": 1}, "sensors[0]", "colour"),
        (sensor("effort", side="gear"), "sensors[0].side", "load, motor"),
        (sensor("stress"), "sensors[0].point", "section_force"),
        (sensor("section_force", component="Q"), "sensors[0].component", "Vy"),
        (sensor("section_force", element=3), "sensors[0].element", "7"),
        (sensor("section_force", point="elbow"), "sensors[0].point", "[recovery]"),
        (sensor("strain_gauge", direction=[1.0, 0.0, 0.0]), "sensors[0].direction", "[0.0, 1.0, 0.0]"),
        (sensor("strain_gauge", compliance=[1.0]), "sensors[0].compliance", "give 6"),
    ],
)  # fmt: skip
def test_bad_sensors_arerefused(tmp_path: Path, given: dict[str, Any], place: str, said: str, capsys: Any) -> None:
    """With file, field and remedy, exit code 2, before anything moves."""
    scenes.l_link(tmp_path, 4, **ENDS)
    first = given if len(given) > 1 else {**sensor("accelerometer", axes="node"), **given}
    path = scenes.l_scene(tmp_path, sensors=[first], simulation={"duration": 0.01})
    assert main(["simulate", str(path)]) == 2
    told = capsys.readouterr().err
    assert place in told
    assert said in told


def test_what_links_do_not_say_is_asked_for(tmp_path: Path) -> None:
    """A link without [recovery]; and one that is a modal file, which takes its strain per component from the scene."""
    scenes.l_link(tmp_path, 4)
    path = scenes.l_scene(tmp_path, sensors=[sensor("section_force")], simulation={"duration": 0.01})
    assert "[recovery]" in refused(path, [])

"""Faulty loops: one message with file, field and remedy each; loops that cannot be closed say how far they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import loop_scenes
import pytest
import scenes

from erls.errors import Cause, SceneError, SimulationError
from erls.simulation.simulate import simulate
from fe_import.errors import Cause as FECause
from fe_import.errors import ReportedError

MOVE = {"shape": "polynomial", "from": 0.0, "to": 0.1, "duration": 1.0}
PD = {"type": "pd", "motion": MOVE, "proportional_gain": 1.0, "derivative_gain": 0.1}

FIELDS: dict[str, tuple[dict[str, Any], str, str]] = {
    "unknown link": ({"link": "rockr"}, "loops[0].link", "rocker"),
    "unknown node": ({"node": "tipp"}, "loops[0].node", "tip"),
    "unknown other link": ({"to_link": "crnk", "to_node": "tip", "position": None}, "loops[0].to_link", "crank"),
    "unknown other node": ({"to_link": "crank", "to_node": "top", "position": None}, "loops[0].to_node", "tip"),
    "unknown type": ({"type": "revolut"}, "loops[0].type", "revolute"),
    "unknown field": ({"stifness": 1.0}, "loops[0].stifness", "stiffness"),
    "no name": ({"name": ""}, "loops[0].name", "rename"),
    "itself": ({"to_link": "rocker", "to_node": "root", "position": None}, "loops[0].to_link", "another link"),
    "link without node": ({"to_link": "crank", "position": None}, "loops[0].to_node", "both"),
    "node without link": ({"to_node": "tip"}, "loops[0].to_node", "both"),
    "position between links": ({"to_link": "crank", "to_node": "tip"}, "loops[0].position", "remove"),
    "no axis": ({"type": "prismatic"}, "loops[0].axis", "direction"),
    "axis of a ball": ({"type": "spherical", "axis": [0.0, 1.0, 0.0]}, "loops[0].axis", "remove"),
    "zero axis": ({"axis": [0.0, 0.0, 0.0]}, "loops[0].axis", "three numbers"),
    "infinite position": ({"position": [1e300, 0.0, 0.0]}, "loops[0].position[0]", "number between"),
}


def _run(folder: Path, data: dict[str, Any]) -> None:
    simulate(scenes.write_toml(folder / "faulty.toml", data), verdict=False)


@pytest.mark.parametrize("case", FIELDS)
def test_faulty_field(tmp_path: Path, case: str) -> None:
    """Refused before anything is computed."""
    changes, where, remedy = FIELDS[case]
    data = loop_scenes.four_bar()
    loop = {**data["loops"][0], **changes}
    data["loops"] = [{k: v for k, v in loop.items() if v is not None}]
    with pytest.raises(ReportedError) as caught:
        _run(tmp_path, data)
    assert isinstance(caught.value, SceneError)
    assert caught.value.cause in (Cause.BAD_FIELD, Cause.BAD_REFERENCE, FECause.UNKNOWN_FIELD)
    assert f"faulty.toml: {where}" in str(caught.value)
    assert remedy in str(caught.value)


def test_two_loops_of_one_name(tmp_path: Path) -> None:
    """Messages name loops."""
    data = loop_scenes.four_bar()
    data["loops"] *= 2
    with pytest.raises(SceneError, match="names must differ"):
        _run(tmp_path, data)


def test_feed_forward_does_not_know_loops(tmp_path: Path) -> None:
    """The inverse dynamics of the open chain would be wrong."""
    data = loop_scenes.driven(loop_scenes.four_bar(), {**PD, "feed_forward": True})
    with pytest.raises(SceneError, match="feed_forward: the inverse dynamics"):
        _run(tmp_path, data)


def test_node_without_rotation(tmp_path: Path) -> None:
    """A mesh node of a solid link cannot carry a joint."""
    solid = scenes.ROOT / "data/l_shape/links/solid.toml"
    data = loop_scenes.four_bar()
    few = {"fixed_interface_modes": 1, "elastic_modes": 1}
    data["links"][2] = {"name": "rocker", "model": str(solid), "reduction": few}
    data["points"] = []
    data["loops"][0]["node"] = "elbow"
    with pytest.raises(SceneError, match=r"loops\[0\].node: this node has no rotation"):
        _run(tmp_path, data)


@pytest.mark.parametrize(("position", "gap"), [((1.5, 0.0, 0.0), "m"), ((0.5, 0.3, 0.0), "0.3 m")])
def test_loops_out_of_reach(tmp_path: Path, position: tuple[float, ...], gap: str) -> None:
    """Too far, or out of the plane: says which loop, how far it is, and exits with 3."""
    data = loop_scenes.four_bar()
    data["loops"][0]["position"] = list(position)
    with pytest.raises(SimulationError, match="the links do not reach: loop 'pivot'") as caught:
        _run(tmp_path, data)
    assert caught.value.cause == Cause.LOOP_OPEN
    assert caught.value.exit_code == 3
    assert str(caught.value.value).endswith(gap)
    assert "initial.position" in str(caught.value)


def test_driven_joints_stay_as_they_are(tmp_path: Path) -> None:
    """A crank that its motion puts out of reach of the others is not moved."""
    data = loop_scenes.driven(loop_scenes.four_bar(), loop_scenes.steady(180.0, 10.0))
    data["links"][2]["rigid"] = loop_scenes.bar(0.1, 0.5)
    with pytest.raises(SimulationError, match="the links do not reach"):
        _run(tmp_path, data)

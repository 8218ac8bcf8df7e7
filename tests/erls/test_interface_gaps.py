"""Interfaces off their joints: told in metres, across and along the axis, and nothing where they meet."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import scenes

from erls.scene.build import build_mechanism
from erls.scene.read import load_scene

ROW = {"convention": "standard", "a": 0.5}


def _warnings(folder: Path, links: list[dict[str, Any]], joints: list[dict[str, Any]]) -> tuple[str, ...]:
    """Of straight links of 0.5 m along x."""
    scenes.arm_link(folder, frame={"nodes": {"tip": [0.5, 0.0, 0.0]}})
    data = {
        "simulation": {"duration": 1.0},
        "joints": [{"name": f"j{k}", "dh": ROW, **joint} for k, joint in enumerate(joints)],
        "links": [
            {"name": f"l{k}", "model": "arm.toml", "mesh_pose": {"frame": "joint", **pose}}
            for k, pose in enumerate(links)
        ],
    }
    return build_mechanism(load_scene(scenes.write_toml(folder / "chain.toml", data))).warnings


@pytest.mark.parametrize(
    ("links", "joints"),
    [
        ([{}, {}], [{}, {}]),
        # an offset d along the axis: interfaces meet behind it, or before it
        ([{}, {"position": [0, 0, -0.1]}], [{}, {"dh": {**ROW, "d": 0.1}}]),
        ([{}, {}], [{"dh": {**ROW, "d": 0.1}}, {}]),
        # a slide has no place of its own along its axis
        ([{}, {"position": [0, 0, 0.05]}], [{}, {"type": "prismatic"}]),
    ],
)
def test_interfaces_that_meet(tmp_path: Path, links: Any, joints: Any) -> None:
    """Nothing is told."""
    assert not _warnings(tmp_path, links, joints)


OFF = [
    # a mesh pose along the axis, as where d is given twice
    ([{"position": [0, 0, 0.05]}], [{}], ["link 'l0': interface 'root' lies 0.05 m along the axis of joint 'j0'"]),
    ([{"position": [0, 0, 0.1]}], [{"dh": {**ROW, "d": 0.1}}], ["interface 'root' lies 0.1 m along the axis"]),
    ([{"position": [0, 0.02, 0]}], [{}], ["interface 'root' lies 0.02 m off the axis"]),
    # a row longer than its link, across the axis of the next joint
    ([{}, {}], [{"dh": {**ROW, "a": 0.53}}, {}], ["link 'l0': interface 'tip' lies 0.03 m off the axis of joint 'j1'"]),
    # an offset that no link spans
    ([{}, {}], [{}, {"dh": {**ROW, "d": 0.1}}], ["lies 0.1 m along the axis of joint 'j1'"]),
    # a ball has no axis: the distance
    (
        [{}, {"position": [0.03, 0.04, 0]}],
        [{}, {"type": "spherical"}],
        ["link 'l1': interface 'root' lies 0.05 m off the axis of joint 'j1'"],
    ),
    (
        [{"position": [0, 0, 0.05]}, {}],
        [{}, {}],
        ["'root' lies 0.05 m along the axis of joint 'j0'", "'tip' lies 0.05 m along the axis of joint 'j1'"],
    ),
]


@pytest.mark.parametrize(("links", "joints", "told"), OFF)
def test_gaps_are_told(tmp_path: Path, links: Any, joints: Any, told: list[str]) -> None:
    """One message for each, with the length of the gap and what to look at."""
    found = _warnings(tmp_path, links, joints)
    assert len(found) == len(told)
    for text, expected in zip(found, told, strict=True):
        assert expected in text
        assert "a rigid arm bridges the gap" in text
    if "root" in found[0]:
        assert "behind theta and d of the joint's row" in found[0]

"""More drives than conditions: the motion of least effort."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scenes

import erls
from erls.errors import SceneError
from erls.inverse.inversion import Inversion

INVERSE = scenes.ROOT / "data" / "inverse"
PLANAR, LEGS = INVERSE / "two_link_planar.toml", INVERSE / "three_legs.toml"
RIGID = ("links.0.flexible=false", "links.1.flexible=false", "simulation.step=0.02")
POINT = "points = { root = [0.0, 0.0, 0.0], tip = [0.0, 0.0, 0.3] }"
CARRIAGE = """
[[joints]]
name = "{name}"
type = "prismatic"
dh = {{ convention = "standard" }}

[[links]]
name = "{name}"
mesh_pose = {{ frame = "joint" }}
rigid = {{ mass = {mass}, {point} }}
"""


def test_a_carriage_recoils(tmp_path: Path) -> None:
    """Two carriages on one rail, m₁ and m₂ on top of it: u₁ = m₁ s̈₁ + m₂ ẍ and u₂ = m₂ ẍ, so that the least effort is
    u₁ = 0, s₁ = -m₂/m₁ x: momentum is kept. The motion of degree 9 is among the laws, so that only rounding is left.
    """
    scene = tmp_path / "carriages.toml"
    head = 'name = "carriages"\ngravity = [0.0, 0.0, 0.0]\n[simulation]\nduration = 1.0\nstep = 0.02\n'
    parts = [CARRIAGE.format(name=name, mass=mass, point=POINT) for name, mass in (("lower", 2.0), ("upper", 1.0))]
    demand = (
        '[[points]]\nname = "tip"\nlink = "upper"\nnode = "tip"\n[inverse]\ndrives = ["lower", "upper"]\n'
        '[[servo]]\npoint = "tip"\ncoordinates = ["z"]\n'
        'motion = { shape = "polynomial", from = 0.3, to = 0.6, start = 0.2, duration = 0.6, degree = 9 }\n'
    )
    scene.write_text(head + "".join(parts) + demand, encoding="utf-8")
    found = erls.invert(scene)
    assert np.abs(found.efforts["upper"]).max() == pytest.approx(7.8, abs=0.1)
    assert np.abs(found.efforts["lower"]).max() < 1e-8
    assert found.angles["lower"][-1] == pytest.approx(-0.15, abs=1e-9)
    assert found.warnings == ("lower: moved for the least effort of rigid links",)


def _effort(found: Inversion) -> float:
    return sum(float(x @ x) for x in found.efforts.values())


def test_no_motion_beside_it_takes_less() -> None:
    """Of the planar robot whose tip has one coordinate demanded: less than along a line or with the elbow held, and
    more again with the shoulder moved on by a hundredth either way.
    """
    least = erls.invert(erls.load_scene(PLANAR, ['servo.0.coordinates=["x"]', *RIGID]))
    assert _effort(least) < _effort(erls.invert(erls.load_scene(PLANAR, RIGID))) / 5
    end = float(least.angles["shoulder"][-1])
    path = 'point="tip", coordinates=["x"], path={shape="line", from=[0.5, 0.5, 0.0], to=[0.2, 0.7, 0.0], start=0.6, '
    square = []
    for share in (0.9, 1.0, 1.1):
        motion = f'motion={{shape="polynomial", from=0.0, to={share * end}, start=0.6, duration=0.6, degree=9}}'
        demand = f'servo=[{{{path}duration=0.6}}}}, {{joints={{shoulder=1.0}}, {motion}}}]'
        square.append(_effort(erls.invert(erls.load_scene(PLANAR, [demand, *RIGID]))))
    assert _effort(least) < min(square)


def test_loops_with_more_drives_are_refused() -> None:
    motion = '{shape="polynomial", from_deg=78.0, to_deg=80.0, start=0.2, duration=0.3}'
    with pytest.raises(SceneError, match=r"more drives \(motor_1, motor_2, motor_3\) than conditions"):
        erls.invert(erls.load_scene(LEGS, [f"servo=[{{joints={{motor_1=1.0}}, motion={motion}}}]"]))

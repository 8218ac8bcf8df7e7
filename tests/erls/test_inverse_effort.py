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
PLANAR = INVERSE / "two_link_planar.toml"
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


DRIVEN = """
[[points]]
name = "tip"
link = "upper"
node = "tip"

[inverse]
drives = {drives}

[[servo]]
point = "tip"
coordinates = ["z"]
motion = {{ shape = "polynomial", from = 0.3, to = 0.6, start = 0.2, duration = 0.6, degree = 9 }}
"""
BESIDE = """
[[loops]]
name = "closing"
link = "beside"
node = "tip"
to_link = "upper"
to_node = "tip"
"""


def _carriages(tmp_path: Path, masses: dict[str, float], drives: tuple[str, ...] = ("lower", "upper")) -> Inversion:
    """On one rail, each on top of the one before; ``beside`` from the ground, and held to the upper one by a loop."""
    scene = tmp_path / "carriages.toml"
    parts = [CARRIAGE.format(name=name, mass=mass, point=POINT) for name, mass in masses.items()]
    head = 'name = "carriages"\ngravity = [0.0, 0.0, 0.0]\n[simulation]\nduration = 1.0\nstep = 0.02\n'
    whole = head + "".join(parts)
    if "beside" in masses:
        whole = whole.replace('name = "beside"\ntype', 'name = "beside"\non = "ground"\ntype') + BESIDE
    scene.write_text(whole + DRIVEN.format(drives=list(drives)), encoding="utf-8")
    return erls.invert(scene)


@pytest.mark.parametrize("masses", [{"lower": 2.0, "upper": 1.0}, {"lower": 2.0, "upper": 0.25, "beside": 0.75}])
def test_a_carriage_recoils(tmp_path: Path, masses: dict[str, float]) -> None:
    """Two carriages on one rail, m₁ and m₂ on top of it: u₁ = m₁ s̈₁ + m₂ ẍ and u₂ = m₂ ẍ, so that the least effort is
    u₁ = 0, s₁ = -m₂/m₁ x: momentum is kept. The motion of degree 9 is among the laws, so that only rounding is left.
    The same where a loop holds a part of m₂ that goes on its own rail.
    """
    found = _carriages(tmp_path, masses)
    assert np.abs(found.efforts["upper"]).max() == pytest.approx(7.8, abs=0.1)
    assert np.abs(found.efforts["lower"]).max() < 1e-8
    assert found.angles["lower"][-1] == pytest.approx(-0.15, abs=1e-9)
    assert [told.partition(": ")[2] for told in found.warnings] == ["moved for the least effort of rigid links"]


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


def test_drives_that_loops_leave_no_motion_are_refused(tmp_path: Path) -> None:
    """Three carriages that a loop holds to each other move in two ways, however many of them are driven."""
    with pytest.raises(SceneError, match=r"more drives \(lower, upper, beside\) than motions") as caught:
        _carriages(tmp_path, {"lower": 2.0, "upper": 0.25, "beside": 0.75}, ("lower", "upper", "beside"))
    assert (caught.value.value, caught.value.limit) == (3, 2)

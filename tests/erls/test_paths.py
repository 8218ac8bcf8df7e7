"""Paths of equilibria by arc length: limit points, bifurcations and branches, against closed forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from body_scenes_data import body_scene
from scenes import ROOT
from scipy.optimize import brentq
from scipy.special import ellipk
from test_nodal_scenes_spectrum import EULER, LENGTH, _column

import erls
from erls.errors import SceneError
from erls.maths.so3 import Array
from erls.run.bodies.rest import BodyPath, BodyRest
from erls.view.run_page import run_page

TWO_BARS = ROOT / "data" / "statics" / "two_bars.toml"


def _path(file: Path, *changes: str) -> BodyPath:
    found = erls.simulate(erls.load_scene(file, changes), verdict=False)
    assert isinstance(found, BodyPath)
    return found


def test_two_bars_snap_through() -> None:
    """The load in every equilibrium, its two limits and what is unstable between, in closed form to rounding."""
    run = _path(TWO_BARS, "simulation.load_steps=8", "simulation.load=0.6")
    built, stiffness = np.hypot(1.0, 0.2), 1e6 * 2.5e-2

    def load(height: Array) -> Array:
        long = np.hypot(1.0, height)
        return np.asarray(-stiffness * (long / built - 1) * height / long)

    heights = run.position("top", run.times)[:, 2]
    np.testing.assert_allclose(run.loads(run.times), load(heights) / 100.0, atol=1e-9)
    limit = float(load(np.sqrt(np.array(built ** (2 / 3) - 1)))) / 100.0
    assert [(turn.kind, turn.ways) for turn in run.statics.turns] == [("limit", 1), ("limit", 1)]
    assert [turn.t for turn in run.statics.turns] == pytest.approx([limit, -limit], rel=1e-9)
    first, last = (turn.arc for turn in run.statics.turns)
    assert [e.unstable for e in run.statics.path] == [int(first < arc < last) for arc in run.times]
    assert run.statics.path[-1].t == 0.6
    page = run_page(run)
    assert "Load and displacement" in page
    assert "limit points" in page


def _buckled(folder: Path, elements: int, branch: int, load: float = 1.0) -> BodyPath:
    """A hinged column under 1.2 of its load."""
    scene = _column("hinged", "hinged", type="path", load_steps=6, branch=branch, load=load)
    del scene["simulation"]["count"]
    scene["beams"][0]["elements"] = elements
    scene["loads"][0]["force"] = [-1.2 * EULER, 0.0, 0.0]
    return _path(body_scene(folder, scene))


def _turned(run: BodyPath) -> float:
    """Angle of the column at its foot."""
    turn = run.statics.path[-1].q.poses[run.assembly.numbers["root"], :3, :3]
    return float(np.arctan2(turn[2, 0], turn[0, 0]))


def test_a_column_buckles_onto_the_elastica(tmp_path: Path) -> None:
    """It bifurcates at Euler's load; on either branch the angle at 1.2 of it is that of Euler's elastica,
    P/P_E = (2 K(sin α/2)/π)². Meshes of 8 and 16 extrapolated, the error of the fourth order and strains of 1e-4 left.
    """
    meshes = [_buckled(tmp_path, n, 1) for n in (8, 16)]
    loads = [1.2 * run.statics.turns[0].t for run in meshes]
    assert [run.statics.turns[0].kind for run in meshes] == ["bifurcation"] * 2
    assert (4 * loads[1] - loads[0]) / 3 == pytest.approx(1.0, rel=5e-4)
    exact = brentq(lambda a: (2 * ellipk(np.sin(a / 2) ** 2) / np.pi) ** 2 - 1.2, 0.1, 3.0)
    angles = [abs(_turned(run)) for run in meshes]
    assert (4 * angles[1] - angles[0]) / 3 == pytest.approx(exact, rel=1e-3)
    assert all(e.unstable == 0 for e in meshes[0].statics.path)
    other = _buckled(tmp_path, 8, -1)
    assert _turned(other) == pytest.approx(-_turned(meshes[0]), rel=1e-6)
    straight = _buckled(tmp_path, 8, 0)
    assert _turned(straight) == pytest.approx(0.0, abs=1e-9)
    assert straight.statics.path[-1].unstable == 1
    assert straight.statics.turns[0].t == pytest.approx(meshes[0].statics.turns[0].t, rel=1e-9)
    below = straight.statics.turns[0].t * 0.999  # steps reach beyond, where the path has ended
    short = _buckled(tmp_path, 8, 1, below)
    assert short.statics.path[-1].t == below
    assert short.statics.turns == ()


def test_a_strip_of_shells_buckles_as_one_of_beams(tmp_path: Path) -> None:
    """Clamped, without contraction across: a quarter of Euler's load, and the tip of the branch, shells and beams."""
    wide, thick, e = 0.1, 0.01, 1e9
    critical = np.pi**2 * e * wide * thick**3 / 12 / (4 * LENGTH**2)
    material = {"m": {"youngs_modulus": e, "poissons_ratio": 0.0, "density": 1.0}}
    shared: dict[str, Any] = {
        "gravity": [0.0, 0.0, 0.0],
        "simulation": {"type": "path", "load_steps": 5, "branch": 1},
        "materials": material,
    }
    beam = {
        **shared,
        "sections": {"s": {"shape": "constants", "area": wide * thick, "inertia_y": wide * thick**3 / 12,
                           "inertia_z": 1.0, "torsion_constant": 1.0}},
        "nodes": {"a": [0, 0, 0], "b": [LENGTH, 0, 0]},
        "beams": [{"name": "s", "from": "a", "to": "b", "elements": 8, "material": "m", "section": "s"}],
        "connections": [{"name": "clamp", "node": "a", "type": "fixed"}],
        "loads": [{"node": "b", "force": [-1.2 * critical, 0.0, 0.0]}],
    }  # fmt: skip
    corners = {"a": [0, 0, 0], "b": [LENGTH, 0, 0], "c": [LENGTH, wide, 0], "d": [0, wide, 0]}
    shell = {
        **shared,
        "nodes": corners,
        "shells": [{"name": "s", "corners": list(corners), "elements": [8, 1], "material": "m", "thickness": thick}],
        "connections": [{"name": "clamp", "node": "s:start", "type": "fixed"}],
        "loads": [{"node": "s:end", "force": [-1.2 * critical, 0.0, 0.0]}],
    }
    beams, shells = (_path(body_scene(tmp_path, scene)) for scene in (beam, shell))
    assert shells.statics.turns[0].t == pytest.approx(beams.statics.turns[0].t, rel=1e-3)
    assert 1.2 * shells.statics.turns[0].t == pytest.approx(1.0, rel=0.01)  # 8 elements
    tips = [np.abs(run.position("b", run.end)) for run in (beams, shells)]
    np.testing.assert_allclose(tips[1], tips[0], atol=2e-3 * LENGTH)
    assert tips[0][2] > 0.5 * LENGTH


def test_line_search_passes_load_steps_that_were_halved() -> None:
    """Two turns of beams in one load step: the same place in fewer iterations, and nothing halved."""
    file = ROOT / "data" / "statics" / "roll_up.toml"
    changes = ["simulation.load_steps=1", 'simulation.tangent="full"']
    plain, searched = (
        erls.simulate(erls.load_scene(file, [*changes, f"simulation.line_search={word}"]), verdict=False)
        for word in ("false", "true")
    )
    assert isinstance(plain, BodyRest)
    assert isinstance(searched, BodyRest)
    assert (plain.statics.cut_steps, searched.statics.cut_steps) == (1, 0)
    assert searched.statics.path[0].iterations < 0.7 * plain.statics.path[0].iterations
    np.testing.assert_allclose(searched.position("tip", 1.0), plain.position("tip", 1.0), atol=1e-9)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ('simulation.tangent="material"', "paths need the full tangent"),
        ("simulation.load=0.0", "simulation.load"),
        ("simulation.most_steps=0", "simulation.most_steps"),
    ],
)
def test_paths_that_cannot_be_meant(change: str, told: str) -> None:
    """One message each."""
    with pytest.raises(SceneError, match=told):
        erls.load_scene(TWO_BARS, [change])


def test_what_was_not_reached_is_told() -> None:
    """A path that is cut off, and a bifurcation that is not there."""
    run = _path(TWO_BARS, "simulation.most_steps=3", "simulation.branch=2")
    assert len(run.times) == 4
    assert "after 3 steps at load parameter" in run.warnings[0]
    assert "0 bifurcations" in run.warnings[1]

"""Static starts that know stability: columns under their weight, the side to which they bend, roots, what is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.equations.linearization import Linearization, roots, stiffness_left, ways_left
from erls.equations.registry import formulate
from erls.equations.serial.formulation import SerialFormulation
from erls.equations.stability import Started
from erls.errors import Cause, SimulationError
from erls.report.tables import chain_report
from erls.run.chain.places import point_position
from erls.run.chain.run import ChainRun
from erls.run.watches.growing_disturbances import growth_warnings
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene
from erls.scene.read import load_scene

GREENHILL = 7.8373  # EI / L², weight of a standing column that buckles
G = 9.81
BAR = 0.5  # m


def _column(folder: Path, times: float, tilt_deg: float = 0.0, **initial: Any) -> Path:
    """A standing column, tilted about an axis across it, under ``times`` its buckling weight: 1 m, EI = 1, g = 9.81."""
    density = times * GREENHILL / G  # of an area of 1
    data = scenes.merged(
        scenes.ARM_LINK,
        {
            "units": {"unusual": True},
            "materials": {"m": {"youngs_modulus": 1e6, "density": density}},
            "frame": {"nodes": {"root": [0.0, 0.0, 0.0], "tip": [1.0, 0.0, 0.0]}, "theory": "euler-bernoulli"},
        },
    )
    constants = {"area": 1.0, "inertia_y": 1e-6, "inertia_z": 4e-6, "torsion_constant": 2e-6}  # soft across one axis
    data["sections"] = {"s": {"shape": "constants", **constants}}
    data["frame"]["members"] = [{**data["frame"]["members"][0], "elements": 8}]
    data["reduction"] = {"method": "craig-bampton", "fixed_interface_modes": 8}
    scenes.write_toml(folder / "column.toml", data)
    scene = {
        "simulation": {"duration": 0.01, "step": 1e-3, "effects": ["all", "geometric_stiffening"]},
        "base": {"rotation_deg": [0.0, -90.0 + tilt_deg, 0.0]},  # mesh x upwards
        "initial": {"deformation": "static", **initial},
        "joints": [{"name": "clamp", "type": "fixed", "dh": {"convention": "standard"}}],
        "links": [{"name": "column", "model": "column.toml", "mesh_pose": {"frame": "joint"}}],
        "points": [{"name": "tip", "link": "column", "node": "tip"}],
    }
    return scenes.write_toml(folder / "scene.toml", scene)


def _started(path: Path, formulation: str = "erls", *changes: str) -> Any:
    """Equations that know their static start."""
    scene = load_scene(path, [f"simulation.formulation={formulation}", *changes])
    assert isinstance(scene, Scene)
    found = formulate(build_mechanism(scene).mechanism, scene.record.simulation)
    assert isinstance(found, Started)
    return found


def _equations(path: Path) -> SerialFormulation:
    found = _started(path)
    assert isinstance(found, SerialFormulation)
    return found


@pytest.mark.parametrize("formulation", ["erls", "ffr", "nodal"])
def test_column_loses_its_stiffness_at_greenhills_weight(tmp_path: Path, formulation: str) -> None:
    """What is left is linear in the weight, zero within 1 % of it; 1 % less bears, 1 % more is refused."""
    left = [_started(_column(tmp_path, times), formulation).stability.stiffness_left for times in (0.5, 0.9)]
    crossing = 0.5 + 0.4 * left[0] / (left[0] - left[1])
    assert crossing == pytest.approx(1.0, abs=1e-2)
    assert _started(_column(tmp_path, 0.99), formulation).stability.stiffness_left > 0
    with pytest.raises(SimulationError, match="link 'column' buckles") as caught:
        _started(_column(tmp_path, 1.01), formulation).initial_state()
    assert caught.value.cause == Cause.UNSTABLE_START


@pytest.mark.parametrize(
    ("formulation", "tilt_deg"), [("erls", 0.0), ("erls", 1.0), ("ffr", 0.0), ("ffr", 1.0), ("nodal", 0.0)]
)
def test_far_beyond_buckling_is_refused(tmp_path: Path, formulation: str, tilt_deg: float) -> None:
    """30 times: neither straight nor bent against its tilt; exit code 2, and how far beyond."""
    with pytest.raises(SimulationError, match="link 'column' buckles") as caught:
        _started(_column(tmp_path, 30.0, tilt_deg), formulation).initial_state()
    assert caught.value.cause == Cause.UNSTABLE_START
    assert caught.value.exit_code == 2
    assert caught.value.where == "initial.deformation"
    if not tilt_deg:
        assert float(str(caught.value.value).split()[0]) == pytest.approx(30.0, rel=1e-2)


def test_tilted_column_bends_with_its_tilt(tmp_path: Path) -> None:
    """At half its buckling weight the tip goes down from where a rigid column would have it."""
    equations = _equations(_column(tmp_path, 0.5, 1.0))
    y, v = equations.initial_state()
    stiff = equations.state(0.0, 0 * y, v)
    bent = equations.state(0.0, y, v)
    upright, sagging = (point_position(equations.mechanism, s, 0)[0] for s in (stiff, bent))
    assert abs(upright) == pytest.approx(np.sin(np.radians(1.0)))
    assert sagging / upright > 1.1


def test_beams_follow_the_branch_on_the_given_side(tmp_path: Path) -> None:
    """Tilted by 1° under 1.2 times what a straight one buckles at, they hang over to that side, with stiffness left,
    and swing; so does one of the other side, to its own.
    """
    tips = []
    for tilt_deg in (1.0, -1.0):
        path = _column(tmp_path, 1.2, tilt_deg)
        table = scenes.read_toml(tmp_path / "column.toml")
        table["materials"]["m"]["youngs_modulus"] = 1e3  # a thick one: slender ones are not followed that far
        table["sections"]["s"] |= {"inertia_y": 1e-3, "inertia_z": 4e-3, "torsion_constant": 2e-3}
        scenes.write_toml(tmp_path / "column.toml", table)
        equations = _started(path, "nodal", "simulation.elements_per_member=4")
        tips.append(equations.state(0.0, *equations.initial_state()))
        assert equations.stability.stiffness_left > 0.1
        assert equations.stability.root.real == 0.0
    sides = [point_position(equations.mechanism, tip, 0)[0] for tip in tips]
    assert sides[0] > 0.3
    assert sides[0] == pytest.approx(-sides[1], rel=1e-6)


def test_beams_on_joints_with_springs(tmp_path: Path) -> None:
    """An arm on a joint with a spring: what is left of the stiffness, held, is that of the arm clamped."""
    spring = {"name": "clamp", "dh": {"convention": "standard"}, "stiffness": 5.0}
    left = []
    for joint in (None, spring):
        path = _column(tmp_path, 0.5, 20.0)
        scene = scenes.read_toml(path)
        joints = scene["joints"] if joint is None else [joint]
        left.append(_started(scenes.write_toml(path, {**scene, "joints": joints}), "nodal").stability.stiffness_left)
    assert left[1] == pytest.approx(left[0], rel=1e-9)


def test_unstable_start_runs_where_it_is_allowed(tmp_path: Path) -> None:
    """Straight at 1.2 times: it starts with what Greenhill leaves, -0.2 within 2 %; disturbances grow."""
    run = erls.simulate(load_scene(_column(tmp_path, 1.2, allow_unstable=True), ["simulation.duration=3.0"]))
    assert isinstance(run, ChainRun)
    told = run.summary()["stability"]
    assert told["stiffness_left"] == pytest.approx(-0.2, abs=4e-3)
    assert told["softest_link"] == "column"
    assert told["root"]["real"] > 0
    assert told["near_equilibrium"]
    assert any("disturbances grow" in warning for warning in run.warnings)


def _bar(angle_deg: float, **joint: Any) -> dict[str, Any]:
    """A thin rigid bar, its angle from the horizontal, on a joint about a horizontal axis."""
    across = BAR**2 / 12
    body = {
        "mass": 1.0,
        "centre_of_mass": [BAR / 2, 0.0, 0.0],
        "inertia": [0.0, across, across],
        "points": {"root": [0.0, 0.0, 0.0], "tip": [BAR, 0.0, 0.0]},
    }
    start = {"initial": {"position_deg": angle_deg}}
    return {
        "simulation": {"duration": 0.5, "step": 1e-3},
        "base": {"rotation_deg": [90.0, 0.0, 0.0]},
        "gravity": [0.0, 0.0, -G],
        "initial": {"deformation": "static"},
        "joints": [{"name": "pivot", "dh": {"convention": "standard"}, **start, **joint}],
        "links": [{"name": "bar", "rigid": body, "mesh_pose": {"frame": "joint"}}],
        "points": [{"name": "tip", "link": "bar", "node": "tip"}],
    }


@pytest.mark.parametrize("formulation", ["erls", "ffr", "nodal"])
def test_inverted_pendulum_is_told_with_its_root(tmp_path: Path, formulation: str) -> None:
    """√(3 g / 2 L), to 1e-8, differences of 1e-6; the run stands, and says so. Hanging, the root is imaginary."""
    exact = np.sqrt(1.5 * G / BAR)
    settings = [f"simulation.formulation={formulation}"]
    run = erls.simulate(load_scene(scenes.write_toml(tmp_path / "up.toml", _bar(90.0)), settings))
    assert isinstance(run, ChainRun)
    assert run.stability is not None
    assert run.stability.root == pytest.approx(exact, rel=1e-8)
    (warning,) = (w for w in run.warnings if "disturbances grow" in w)
    assert f"{1 / exact:.3g} s" in warning
    assert "rightmost root" in chain_report(run)
    hanging = erls.simulate(load_scene(scenes.write_toml(tmp_path / "down.toml", _bar(-90.0)), settings))
    assert isinstance(hanging, ChainRun)
    assert hanging.stability is not None
    assert hanging.stability.root == pytest.approx(1j * exact, rel=1e-8)
    assert not any("disturbances grow" in w for w in hanging.warnings)


def test_other_starts_are_not_looked_at(tmp_path: Path) -> None:
    """An undeformed start has no entry, and no warning."""
    scene = _bar(90.0) | {"initial": {"deformation": "zero"}}
    run = erls.simulate(load_scene(scenes.write_toml(tmp_path / "up.toml", scene)))
    assert isinstance(run, ChainRun)
    assert run.stability is None
    assert "stability" not in run.summary()
    assert not any("disturbances grow" in w for w in run.warnings)


@pytest.mark.parametrize(("stiff", "damped"), [(40.0, 0.3), (40.0, 9.0)])
def test_roots_of_a_controlled_joint(tmp_path: Path, stiff: float, damped: float) -> None:
    """Of J s² + d s + k + m g L/2, hanging on a PD controller, under- and overdamped, to 1e-8."""
    drive: dict[str, Any] = {"type": "pd", "proportional_gain": stiff, "derivative_gain": damped}
    drive["motion"] = {"shape": "polynomial", "from_deg": -90.0, "to_deg": -90.0, "duration": 1.0}
    equations = _equations(scenes.write_toml(tmp_path / "pd.toml", _bar(-90.0, drive=drive)))
    exact = np.roots([BAR**2 / 3, damped, stiff + G * BAR / 2])
    found = roots(equations.linearized(0.0, *equations.initial_state()))
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(exact), rtol=1e-8)


@pytest.mark.parametrize("formulation", ["erls", "ffr", "nodal"])
def test_beck_column_flutters(formulation: str) -> None:
    """Under a force that follows, at 20.05 EI / L², of which the scene has 0.9: roots pair up within 2 %, of 20 beam
    elements too.
    """
    found = []
    for share in (0.98, 1.02):
        changes = f"loads.0.force=[{-2105.0 / 0.9 * share}, 0.0, 0.0]", "simulation.elements_per_member=20"
        path = scenes.ROOT / "data/beck/column.toml"
        equations = _started(path, formulation, *changes[: 2 if formulation == "nodal" else 1])
        assert equations.stability.root is not None
        found.append(equations.stability.root)
    assert found[0].real < 1e-6 * abs(found[0])
    assert found[1].real > 0.05 * abs(found[1])
    assert found[1].imag > 0


def test_roots_on_the_ways_that_conditions_leave() -> None:
    """Two masses that a rod joins move as one: s = ± i √((k₁ + k₂) / (m₁ + m₂))."""
    mass, stiffness = np.diag([1.0, 3.0]), np.diag([5.0, 11.0])
    ways = ways_left(np.array([[1.0, -1.0]]), np.ones(2))
    found = roots(Linearization(ways.T @ mass @ ways, np.zeros((1, 1)), ways.T @ stiffness @ ways, ways))
    np.testing.assert_allclose(found, [2j, -2j], atol=1e-14)


def test_stiffness_left_is_linear_in_the_load() -> None:
    """1 - P / P_c: of K₀ - P G with the largest eigenvalue of G beside K₀ at 1 / P_c = 2 / 3."""
    left, shape = stiffness_left(np.diag([3.0, 4.0]) - 1.2 * np.diag([2.0, 1.0]), np.diag([3.0, 4.0]))
    assert left == pytest.approx(1 - 1.2 * 2 / 3)
    assert abs(shape[1]) < 1e-14


def test_growth_is_told_from_doubling_on() -> None:
    """Within the run; with the time of e-fold growth, and how fast it swings."""
    assert growth_warnings(0.69 + 0j, 1.0) == []
    (warning,) = growth_warnings(0.7 + 2j * np.pi, 1.0)
    assert "in 1.43 s" in warning
    assert "swinging at 1 Hz" in warning

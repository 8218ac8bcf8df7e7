"""Static starts that know stability: columns under their weight, the side to which they bend, roots, what is told."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.equations.linearization import Linearization, restricted, roots, stiffness_left, ways_left
from erls.equations.registry import formulate
from erls.equations.serial.formulation import SerialFormulation
from erls.errors import Cause, SimulationError
from erls.run.chain.run import ChainRun
from erls.run.watches.growing_disturbances import growth_warnings
from erls.scene.build import build_mechanism
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
            "materials": {"m": {"youngs_modulus": 1e6, "density": density}},
            "frame": {"nodes": {"root": [0.0, 0.0, 0.0], "tip": [1.0, 0.0, 0.0]}, "theory": "euler-bernoulli"},
        },
    )
    constants = {"area": 1.0, "inertia_y": 1e-6, "inertia_z": 4e-6, "torsion_constant": 2e-6}  # soft across one axis
    data["sections"]["s"] = {"shape": "constants", **constants}
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


def _equations(path: Path, formulation: str = "erls") -> SerialFormulation:
    scene = load_scene(path, [f"simulation.formulation={formulation}"])
    assert isinstance(scene, erls.Scene)
    found = formulate(build_mechanism(scene), scene.record.simulation)
    assert isinstance(found, SerialFormulation)
    return found


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_column_loses_its_stiffness_at_greenhills_weight(tmp_path: Path, formulation: str) -> None:
    """What is left is linear in the weight, zero within 1 % of it; 1 % less bears, 1 % more is refused."""
    left = [_equations(_column(tmp_path, times), formulation).stability.stiffness_left for times in (0.5, 0.9)]
    crossing = 0.5 + 0.4 * left[0] / (left[0] - left[1])
    assert crossing == pytest.approx(1.0, abs=1e-2)
    assert _equations(_column(tmp_path, 0.99), formulation).stability.stiffness_left > 0
    with pytest.raises(SimulationError, match="link 'column' buckles") as caught:
        _equations(_column(tmp_path, 1.01), formulation).initial_state()
    assert caught.value.cause == Cause.UNSTABLE_START


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
@pytest.mark.parametrize("tilt_deg", [0.0, 1.0])
def test_far_beyond_buckling_is_refused(tmp_path: Path, formulation: str, tilt_deg: float) -> None:
    """30 times: neither straight nor bent against its tilt; exit code 2, and how far beyond."""
    with pytest.raises(SimulationError, match="link 'column' buckles") as caught:
        _equations(_column(tmp_path, 30.0, tilt_deg), formulation).initial_state()
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
    tip = equations.mechanism.points[0]
    from erls.run.chain.places import node_positions

    places = [node_positions(equations, s, tip.link, tip.node) for s in (stiff, bent)]
    assert np.sign(places[0][0]) * (places[1][0] - places[0][0]) > 1e-3


def test_unstable_start_runs_where_it_is_allowed(tmp_path: Path) -> None:
    """Straight at 1.2 times: it starts, tells less than no stiffness, and that disturbances grow."""
    scene = load_scene(_column(tmp_path, 1.2, allow_unstable=True), ["simulation.duration=20", "simulation.step=0.1"])
    equations = _equations(_column(tmp_path, 1.2, allow_unstable=True))
    found = equations.stability
    assert found.stiffness_left == pytest.approx(-0.2, abs=1e-2)
    assert found.root is not None
    assert found.root.real > 0
    run = erls.simulate(_short(scene))
    assert isinstance(run, ChainRun)
    assert run.summary()["stability"]["stiffness_left"] == pytest.approx(found.stiffness_left)

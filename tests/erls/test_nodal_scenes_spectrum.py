"""Buckling loads and natural frequencies about deformed states, against closed forms."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from body_scenes_data import body_scene

from erls import simulate
from erls.cli.main import main
from erls.errors import Cause, SimulationError
from erls.run.bodies.rest import BodyRest

LENGTH, E, AREA, BEND = 2.0, 1e9, 1e-3, 1e-8
EULER = np.pi**2 * E * BEND / LENGTH**2


def _column(root: str, head: str, **simulation: Any) -> dict[str, Any]:
    """A column along x that bends in the x-z plane; its head slides along x, or is free. The load is Euler's."""
    kinds = {"clamped": {"type": "fixed"}, "hinged": {"type": "revolute", "axis": [0, 1, 0]}}
    connections: list[dict[str, Any]] = [{"name": "root", "node": "root", **kinds[root]}]
    if head != "free":
        connections += [
            {"name": "slide", "node": "carriage", "type": "prismatic", "axis": [1, 0, 0]},
            {"name": "head", "node": "top", "to": "carriage", **kinds[head]},
        ]
    carriage = [] if head == "free" else [{"name": "carriage", "mass": 0.0, "position": [LENGTH, 0.0, 0.0]}]
    return {
        "gravity": [0.0, 0.0, 0.0],
        "simulation": {"type": "buckling", "count": 1, **simulation},
        "materials": {"m": {"youngs_modulus": E, "poissons_ratio": 0.0, "density": 1000.0}},
        "sections": {
            "s": {"shape": "constants", "area": AREA, "inertia_y": BEND, "inertia_z": 20 * BEND,
                  "torsion_constant": BEND, "shear_factor_y": 1.0, "shear_factor_z": 1.0}
        },
        "nodes": {"root": [0.0, 0.0, 0.0], "top": [LENGTH, 0.0, 0.0]},
        "bodies": carriage,
        "beams": [{"name": "c", "from": "root", "to": "top", "elements": 16, "material": "m", "section": "s"}],
        "connections": connections,
        "loads": [{"node": "top", "force": [-EULER, 0.0, 0.0]}],
    }  # fmt: skip


def _found(folder: Path, scene: dict[str, Any]) -> BodyRest:
    result = simulate(body_scene(folder, scene))
    assert isinstance(result, BodyRest)
    return result


def _extrapolated(folder: Path, scene: dict[str, Any], key: str, mode: int = 0) -> float:
    """From 8 and 16 elements, whose errors are of second order."""
    values = []
    for elements in (8, 16):
        beams = [{**scene["beams"][0], "elements": elements}]
        values.append(float(_found(folder, {**scene, "beams": beams}).summary()["modes"][mode][key]))
    return (4 * values[1] - values[0]) / 3


@pytest.mark.parametrize(
    ("root", "head", "factor"),
    [("hinged", "hinged", 1.0), ("clamped", "free", 0.25), ("clamped", "clamped", 4.0), ("clamped", "hinged", 2.0457)],
)
def test_euler_columns(tmp_path: Path, root: str, head: str, factor: float) -> None:
    """π² EI / (βL)² for four supports, within 5e-4; the strains at that load are 1e-4 at most."""
    assert _extrapolated(tmp_path, _column(root, head), "load") == pytest.approx(factor, rel=5e-4)


def test_a_stubby_column_close_to_its_load(tmp_path: Path) -> None:
    """With stretch and shear P (1 + P/GA − P/EA) = π² EI/L² (E. Reissner, 1972), where the path is nearly there."""
    scene = _column("hinged", "hinged", load=0.85, load_steps=2)
    bend, area, shear = 4e-5, 1e-3, 0.1
    scene["sections"]["s"].update(inertia_y=bend, inertia_z=bend, shear_factor_z=2 * shear)
    euler = np.pi**2 * E * bend / LENGTH**2
    scene["loads"][0]["force"] = [-euler, 0.0, 0.0]
    slope = euler / (E * area) * (1 / shear - 1)  # of (1/GA − 1/EA) P, with G = E/2
    exact = (np.sqrt(1 + 4 * slope) - 1) / (2 * slope)
    assert exact < 0.7
    scene["simulation"]["load"] = 0.98 * exact
    assert _extrapolated(tmp_path, scene, "load") == pytest.approx(exact, rel=1e-3)


def test_lateral_buckling_of_a_strip(tmp_path: Path) -> None:
    """4.013 sqrt(EI GJ)/L² for a force at the tip of a deep cantilever (S. Timoshenko, J. Gere, 1961), within 0.2 %."""
    scene = _column("clamped", "free")
    scene["sections"]["s"].update(inertia_y=1e3 * BEND, inertia_z=BEND, torsion_constant=4 * BEND)
    critical = 4.013 * np.sqrt(E * BEND * E / 2 * 4 * BEND) / LENGTH**2
    scene["loads"][0]["force"] = [0.0, 0.0, -critical]
    assert _extrapolated(tmp_path, scene, "load") == pytest.approx(1.0, rel=2e-3)
    shape = _found(tmp_path, scene).summary()["modes"][0]["points"]["top"]
    assert abs(shape[1]) == pytest.approx(1.0)
    assert abs(shape[2]) < 1e-6


@pytest.mark.parametrize("load", [-1.0, 0.0, 0.5, 0.9])
def test_frequencies_under_axial_load(tmp_path: Path, load: float) -> None:
    """Hinged at both ends: ω² = (π/L)⁴ EI/(ρA) (1 − P/P_E), rotary inertia of 2.5e-5 aside, within 1e-3."""
    scene = _column("hinged", "hinged", type="frequencies", load=abs(load))
    scene["loads"][0]["force"] = [-EULER * np.sign(load or 1.0), 0.0, 0.0]
    expected = (np.pi / LENGTH) ** 2 * np.sqrt(E * BEND / (1000 * AREA) * (1 - load)) / (2 * np.pi)
    assert _extrapolated(tmp_path, scene, "frequency_hz") == pytest.approx(expected, rel=1e-3)


def test_beyond_the_critical_load_a_mode_grows(tmp_path: Path) -> None:
    """The straight column at 1.2 of its load: one negative frequency."""
    scene = _column("hinged", "hinged", type="frequencies", load=1.2, count=3)
    found = [m["frequency_hz"] for m in _found(tmp_path, scene).summary()["modes"]]
    assert sum(f < 0 for f in found) == 1
    assert min(found) == pytest.approx(-np.pi / LENGTH**2 * np.sqrt(E * BEND / (1000 * AREA) * 0.2) / 2, rel=0.02)


def test_a_buckled_column_vibrates(tmp_path: Path) -> None:
    """Just past the critical load, potentials of fourth order make ω² of the bent column twice the −ω² of the straight
    one; at 1.01 of it within 3 %. A push from the side, which ends, brings the column there."""
    critical = _found(tmp_path, _column("hinged", "hinged")).summary()["modes"][0]["load"]
    straight = _column("hinged", "hinged", type="frequencies", load=1.01 * critical)
    growth = _found(tmp_path, straight).summary()["modes"][0]["frequency_hz"]
    bent = _column("hinged", "hinged", type="frequencies", load=1.0, load_steps=4)
    press = [{"shape": "table", "times": [0.0, 0.5], "values": [0.0, 1.01 * critical]}]
    push = [{"shape": "table", "times": [0.0, 0.5, 1.0], "values": [1.0, 1.0, 0.0]}]
    bent["loads"][0]["factor"] = press
    bent["loads"].append({"node": "c/8", "force": [0.0, 0.0, 0.02 * EULER], "factor": push})
    found = _found(tmp_path, {**bent, "report": ["c/8"]})
    assert found.position("c/8", found.end)[2] > 0.1
    assert growth < 0
    assert found.summary()["modes"][0]["frequency_hz"] == pytest.approx(-np.sqrt(2) * growth, rel=0.03)


def test_frequencies_of_a_cantilever(tmp_path: Path) -> None:
    """1.875² / (2π L²) sqrt(EI/(ρA)) both ways."""
    scene = _column("clamped", "free", type="frequencies", load=0.0, count=2)
    scene["loads"] = []
    straight = [m["frequency_hz"] for m in _found(tmp_path, scene).summary()["modes"]]
    lowest = 1.875104**2 / (2 * np.pi * LENGTH**2) * np.sqrt(E * BEND / (1000 * AREA))
    assert straight[0] == pytest.approx(lowest, rel=3e-3)
    assert straight[1] == pytest.approx(np.sqrt(20) * lowest, rel=5e-3)


def test_sparse_and_dense_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same modes from Arnoldi iteration."""
    results = []
    for limit in (300, 10):
        monkeypatch.setattr("erls.equations.nodal.spectrum.DENSE_UP_TO", limit)
        buckling = _found(tmp_path, _column("clamped", "hinged", count=2)).summary()["modes"]
        free = _found(tmp_path, _column("clamped", "hinged", type="frequencies", load=0.5, count=3)).summary()["modes"]
        results.append([*(m["load"] for m in buckling), *(m["frequency_hz"] for m in free)])
    np.testing.assert_allclose(results[0], results[1], rtol=1e-6)


def test_flutter_and_mechanisms_are_refused(tmp_path: Path) -> None:
    """A follower force of 25 EI/L² on a cantilever (M. Beck, 1952: 20.05); no load; nothing that has mass."""
    beck = _column("clamped", "free", type="frequencies", load=25 * 4 / np.pi**2 / 4)
    beck["loads"][0]["follower"] = True
    idle = _column("clamped", "free")
    idle["loads"] = []
    light = _column("clamped", "free", type="frequencies")
    light["materials"]["m"]["density"] = 0.0
    for scene, words in ((beck, "flutter"), (idle, "no load changes"), (light, "nothing has mass")):
        with pytest.raises(SimulationError, match=words) as caught:
            _found(tmp_path, scene)
        assert caught.value.cause is Cause.NO_EQUILIBRIUM


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """JSON and text."""
    path = str(body_scene(tmp_path, _column("hinged", "hinged")))
    assert main(["simulate", path, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["analysis"] == "buckling"
    assert found["modes"][0]["load"] == pytest.approx(1.0, rel=5e-3)
    assert set(found["modes"][0]["points"]) == {"root", "top", "carriage"}
    assert main(["simulate", path, "--set", "simulation.type=frequencies", "--set", "simulation.load=0.5"]) == 0
    assert "frequency [Hz]" in capsys.readouterr().out

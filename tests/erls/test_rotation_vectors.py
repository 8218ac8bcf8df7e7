"""Joints whose coordinates are rotation vectors, through many turns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.errors import SceneError
from erls.integrate.charts import LONGEST, exchanged
from erls.maths.rotation_maps import exp, tangent

SPIN = 70.0  # rad/s: eleven turns in a second


def _body(folder: Path, kind: str = "spherical", **changes: Any) -> Path:
    """A symmetric top about z, m = 2 kg, on its centre of mass, without weight."""
    row = {"convention": "modified"}
    turns = {"turn_x": {"initial": {"rate": 3.0}}, "turn_z": {"initial": {"rate": SPIN}}}
    data = {
        "gravity": [0.0, 0.0, 0.0],
        "simulation": {"duration": 1.0, "integrator": "lobatto", "tolerance": 1e-6},
        "joints": [{"name": "ball", "type": kind, "dh": row, "coordinates": turns}],
        "links": [
            {
                "name": "top",
                "rigid": {
                    "mass": 2.0,
                    "inertia": [0.03, 0.03, 0.05],
                    "points": {"centre": [0, 0, 0], "rim": [0.2, 0, 0.1]},
                },
            }
        ],
        "points": [{"name": "rim", "link": "top", "node": "rim"}],
    }
    return scenes.write_toml(folder / "top.toml", scenes.merged(data, changes))


def test_an_exchange_keeps_the_rotation_and_how_fast_it_turns() -> None:
    """exp(ψ̃) and T(ψ) ψ̇ to rounding; short vectors stay as they are."""
    rng = np.random.default_rng(1)
    for length in (LONGEST * 1.001, 1.9 * np.pi):
        y, v = rng.standard_normal((2, 5))
        y[1:4] *= length / np.linalg.norm(y[1:4])
        other, rate = exchanged(y, v, [1])
        assert np.linalg.norm(other[1:4]) == pytest.approx(2 * np.pi - length, abs=1e-12)
        np.testing.assert_allclose(exp(other[1:4]), exp(y[1:4]), atol=1e-14)
        np.testing.assert_allclose(tangent(other[1:4]) @ rate[1:4], tangent(y[1:4]) @ v[1:4], atol=1e-13)
        np.testing.assert_array_equal(np.delete(other, [1, 2, 3]), np.delete(y, [1, 2, 3]))
    small = np.array([0.0, 1.0, -2.0, 0.5, 0.0])
    np.testing.assert_array_equal(exchanged(small, v, [1])[0], small)


@pytest.mark.parametrize(
    ("integrator", "more", "error"),
    [("lobatto", {}, 3e-6), ("generalized_alpha", {"step": 1e-4}, 3e-3), ("rk45", {"rtol": 1e-9, "atol": 1e-10}, 3e-6)],
)
def test_a_free_top_for_eleven_turns(tmp_path: Path, integrator: str, more: dict[str, Any], error: float) -> None:
    """A symmetric top against its closed form: it precesses about L by |L|/A and spins by (1 - C/A) ω₃.

    lobatto and rk45 hold their tolerances through 70 rad; generalized-alpha, of second order, (ω h)² ω t / 12 = 3e-4.
    """
    run = erls.simulate(erls.load_scene(_body(tmp_path, simulation={"integrator": integrator, **more})), verdict=False)
    assert run.failure is None
    t = np.linspace(0.0, 1.0, 41)
    omega, a, c = np.array([3.0, 0.0, SPIN]), 0.03, 0.05
    momentum = np.array([a, a, c]) * omega  # the top starts along the axes of the world
    expected = []
    for time in t:
        precession = exp(momentum / a * time)
        spin = exp(np.array([0.0, 0.0, (1 - c / a) * SPIN]) * time)
        expected.append(precession @ spin @ np.array([0.2, 0.0, 0.1]))
    np.testing.assert_allclose(run.position("rim", t), expected, atol=0.22 * error)
    coordinates = np.array([run.joint_coordinate(f"ball/turn_{axis}", t) for axis in "xyz"])
    assert np.linalg.norm(coordinates, axis=0).max() < 1.5 * np.pi
    assert run.summary()["energy"]["max_drift"] < error * 0.5 * (omega @ momentum)  # as far off as the motion


def test_a_floating_body_keeps_its_momentum(tmp_path: Path) -> None:
    """Its centre of mass goes straight on while it turns."""
    coordinates = {"x": {"initial": {"rate": 0.5}}, "turn_y": {"initial": {"rate": 2.0}}}
    path = _body(tmp_path, "floating", points=[{"name": "rim", "link": "top", "node": "centre"}])
    data = scenes.read_toml(path)
    data["joints"][0]["coordinates"].update(coordinates)
    run = erls.simulate(erls.load_scene(scenes.write_toml(path, data)), verdict=False)
    np.testing.assert_allclose(run.position("rim", 1.0), [0.5, 0.0, 0.0], atol=1e-9)


def test_nothing_acts_along_a_component(tmp_path: Path) -> None:
    """A spring there has no axis to act about."""
    path = _body(tmp_path)
    data = scenes.read_toml(path)
    data["joints"][0]["coordinates"]["turn_x"]["stiffness"] = 1.0
    with pytest.raises(SceneError, match="rotation vector") as caught:
        erls.load_scene(scenes.write_toml(path, data))
    assert caught.value.where.endswith("joints[0].coordinates.turn_x.stiffness")

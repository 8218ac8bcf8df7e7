"""Loops whose links come in line: a parallelogram passes its change points, on one motion, and says that it may branch.

Its coupler never turns: with the angle φ of crank and rocker J φ̈ = - g S cos φ, J = 2 · m l²/3 + M l², S = m l + M l.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import loop_scenes
import numpy as np
import pytest
import scenes
from loop_scenes import parallelogram
from scipy.integrate import solve_ivp

from erls.equations.loops.branching import Kind, singular_at
from erls.errors import Cause, SimulationError
from erls.run.chain.run import ChainRun

CRANK, COUPLER, _ = loop_scenes.PARALLELOGRAM
MASS, COUPLER_MASS, _ = loop_scenes.PARALLELOGRAM_MASSES
INERTIA = 2 * MASS * CRANK**2 / 3 + COUPLER_MASS * CRANK**2
STATIC = (MASS + COUPLER_MASS) * CRANK
DURATION = 0.8  # two change points


def closed_form() -> tuple[float, list[float]]:
    """Angle at the end, and the times at which all links are in line."""

    def slope(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -9.81 * STATIC * np.cos(state[0]) / INERTIA]

    def in_line(_: float, state: np.ndarray) -> float:
        return float(np.sin(state[0]))

    start, times = [np.pi / 3, 0.0], (0.0, DURATION)
    found = solve_ivp(slope, times, start, "DOP853", rtol=1e-12, atol=1e-12, events=in_line)
    return float(found.y[0, -1]), [float(t) for t in found.t_events[0]]


def loss(run: ChainRun) -> float:
    """Largest change of the energy, of what weight and motion exchange."""
    energy = run.energy(run.times)
    return float(np.ptp(energy.total) / np.ptp(energy.gravity))


# steps of second order: a fourth of the error with half of the step; adaptive ones: the tolerance [m], and lever CRANK
METHODS = {
    "1 ms": ({"step": 1e-3}, 2e-5, 1e-5),
    "0.5 ms": ({"step": 5e-4}, 5e-6, 2.5e-6),
    "0.25 ms": ({"step": 2.5e-4}, 1.25e-6, 1e-6),
    "lobatto": ({"integrator": "lobatto", "tolerance": 1e-5}, 1e-5 / CRANK, 1e-6),
    "rk45": ({"integrator": "rk45"}, 1e-5 / CRANK, 1e-6),
    "dop853": ({"integrator": "dop853"}, 1e-5 / CRANK, 1e-6),
}


@pytest.mark.parametrize("method", METHODS)
def test_one_motion_through_change_points(tmp_path: Path, method: str) -> None:
    """Any step and any method ends where the closed form does, energy is kept, and branching is told with its place."""
    settings, distance, energy = METHODS[method]
    run = loop_scenes.run(tmp_path, parallelogram(), duration=DURATION, **settings)
    angle, times = closed_form()
    assert len(times) == 2
    assert abs(float(run.joint_angle("j0", DURATION)) - angle) < distance
    assert loss(run) < energy
    (told,) = (text for text in run.summary()["warnings"] if "change point" in text)
    assert told.startswith("loop 'closing' passes a change point at t = ")
    assert float(told.split(" = ")[1].split(" s ")[0]) == pytest.approx(times[0], abs=2e-6)  # six digits are told
    assert "(j0 0 deg, j1 0 deg, j2 -180 deg), and at 1 more" in told


@pytest.mark.parametrize("integrator", ["generalized_alpha", "lobatto"])
def test_a_driven_crank_passes_its_change_point(tmp_path: Path, integrator: str) -> None:
    """The coupler keeps its direction, to the tolerance or step."""
    data = loop_scenes.driven(parallelogram(), loop_scenes.steady(60.0, -360.0))
    run = loop_scenes.run(tmp_path, data, integrator=integrator, step=1e-3, duration=0.3)
    t = np.linspace(0.0, 0.3, 31)
    np.testing.assert_allclose(run.joint_angle("j1", t), -run.joint_angle("j0", t), atol=1e-5 / COUPLER)
    assert any("passes a change point at t = 0.16666" in text for text in run.warnings)


def test_which_singular_position_branches(tmp_path: Path) -> None:
    """Second order of the conditions: the parallelogram in line, by itself and driven, and the dead point of a rocker
    that is driven beyond it.
    """
    free = loop_scenes.chain(tmp_path, parallelogram())
    assert singular_at(free, 0.0, np.array([0.0, 0.0, -np.pi])).kind == Kind.BRANCHES
    data = loop_scenes.driven(parallelogram(), loop_scenes.steady(60.0, -360.0))
    assert singular_at(loop_scenes.chain(tmp_path, data), 1 / 6, np.array([0.0, -np.pi])).kind == Kind.BRANCHES
    locking = loop_scenes.driven(loop_scenes.four_bar(), loop_scenes.steady(60.0, -360.0))
    lengths = (0.35, 0.45, 0.15)
    for k, (length, angle) in enumerate(zip(lengths, (None, 150.0, -60.0), strict=True)):
        locking["joints"][k] = {**locking["joints"][k], **loop_scenes.joint(f"j{k}", length, angle)}
        locking["links"][k]["rigid"] = loop_scenes.bar(length, 0.5)
    corner = (lengths[0] ** 2 + loop_scenes.GROUND**2 - (lengths[1] + lengths[2]) ** 2) / (2 * lengths[0])
    rocker = np.arccos(corner / loop_scenes.GROUND)
    away = np.angle(loop_scenes.GROUND - lengths[0] * np.exp(1j * rocker))
    at = np.array([away - rocker, 0.0])
    chain = loop_scenes.chain(tmp_path, locking)
    assert singular_at(chain, (60.0 - np.degrees(rocker)) / 360.0, at).kind == Kind.LOCKS


def flexible(folder: Path, modes: int) -> dict[str, Any]:
    """Links of aluminium; the seventh mode of each is the axial one."""
    data = parallelogram()
    for record in data["links"]:
        name, length = record["name"], record.pop("rigid")["points"]["tip"][0]
        link = {
            "materials": {"m": {"youngs_modulus": 7e10, "poissons_ratio": 0.33, "density": 2700.0}},
            "sections": {"s": {"shape": "rectangular", "width": 0.008, "height": 0.02}},
            "frame": {
                "nodes": {"root": [0.0, 0.0, 0.0], "tip": [length, 0.0, 0.0]},
                "members": [{"from": "root", "to": "tip", "elements": 4, "material": "m", "section": "s"}],
            },
            "interfaces": [{"name": "root", "node": "root"}, {"name": "tip", "node": "tip"}],
            "reduction": {"fixed_interface_modes": 2, "elastic_modes": modes},
        }
        scenes.write_toml(folder / f"{name}.toml", link)
        record["model"] = f"{name}.toml"
    return data


@pytest.mark.parametrize("settings", [{"step": 2e-3}, {"step": 1e-3}, {"integrator": "lobatto"}])
def test_flexible_links_without_their_axial_mode(tmp_path: Path, settings: dict[str, Any]) -> None:
    """Nothing gives way between the branches, and three steps give three motions: the run ends there, and says why."""
    with pytest.raises(SimulationError, match=r"no mode of links 'crank', 'coupler', 'rocker' gives way") as caught:
        loop_scenes.run(tmp_path, flexible(tmp_path, 6), duration=0.3, **settings)
    assert caught.value.cause == Cause.CHANGE_POINT
    assert caught.value.exit_code == 3
    assert "axial modes" in caught.value.remedy
    assert caught.value.run.end == pytest.approx(0.25, abs=5e-3)


def test_flexible_links_with_it(tmp_path: Path) -> None:
    """Two steps, one motion: within 0.03 deg of each other, beyond two change points that need no decision."""
    data = flexible(tmp_path, 7)
    runs = [loop_scenes.run(tmp_path, data, duration=DURATION, step=h) for h in (2e-3, 1e-3)]
    ends = [np.degrees(run.joint_angle(f"j{k}", DURATION)) for run in runs for k in range(2)]
    assert np.abs(np.subtract(ends[:2], ends[2:])).max() < 0.03
    assert not any("change point" in text for run in runs for text in run.warnings)

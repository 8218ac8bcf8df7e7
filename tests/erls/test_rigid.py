"""Rigid links: published angles, a closed form, and an inverse-dynamics recursion that shares no equation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from scipy.special import ellipkinc

import erls
from erls.mechanism.rigid_dynamics import inverse_dynamics

RIGID_L = [{"name": "l", "model": "link.toml", "flexible": False}]


@pytest.mark.parametrize(
    ("mass", "rotary_inertia", "angle_deg"),
    [("consistent", True, 128.4880), ("lumped", False, 125.9350), ("lumped", True, 125.8962)],
)
def test_rigid_l_at_half_a_second(tmp_path: Path, mass: str, rotary_inertia: bool, angle_deg: float) -> None:
    """Reference figures (4 elements, 0.01 in the plane x 0.03); 125.90 is the paper's six-mode row. ±0.002°."""
    frame = {"theory": "euler-bernoulli", "mass": mass, "rotary_inertia": rotary_inertia}
    scenes.l_link(tmp_path, 2, frame=frame)
    simulation = {"duration": 0.5, "integrator": "dop853", "rtol": 1e-10, "step": 0.05}
    run = erls.simulate(scenes.l_scene(tmp_path, links=RIGID_L, simulation=simulation), verdict=False)
    assert np.degrees(run.joint_angle("shoulder", 0.5)) == pytest.approx(angle_deg, abs=0.002)


def test_pendulum_against_elliptic_integral(tmp_path: Path) -> None:
    """A rigid pendulum released horizontally: time to an angle by the elliptic integral of the first kind.

    θ̇² = 2 (m g l / J) sin θ for the angle θ below the horizontal. Tolerance: 10 x the integrator's rtol.
    """
    body = {"mass": 1.5, "centre_of_mass": [0.4, 0.0, 0.0], "inertia": [0.01, 0.02, 0.03], "points": {"a": [0, 0, 0]}}
    scene = scenes.l_scene(
        tmp_path,
        links=[{"name": "l", "rigid": body}],
        points=[],
        simulation={"duration": 0.4, "integrator": "dop853", "rtol": 1e-11, "atol": 1e-13, "step": 0.05},
        base={"rotation_deg": [-90.0, 0.0, 0.0]},
    )
    run = erls.simulate(scene, verdict=False)
    # R = R_y(θ) turns the mesh frame; the axis y carries J_yy
    inertia = 0.02 + 1.5 * 0.4**2
    rate = np.sqrt(1.5 * 9.81 * 0.4 / inertia)
    end = float(run.joint_angle("shoulder", 0.4))
    # substitute sin((π/2 - θ)/2) = sin(π/4) sin φ, the classical pendulum started at 90° from the vertical
    phi = np.arcsin(np.sin((np.pi / 2 - end) / 2) / np.sin(np.pi / 4))
    time = (ellipkinc(np.pi / 2, 0.5) - ellipkinc(phi, 0.5)) / rate
    assert time == pytest.approx(0.4, abs=1e-9)


def _chain(folder: Path, flexible: bool, kind: str) -> Path:
    links: list[dict[str, Any]] = [
        {"name": n, "model": "arm.toml", "flexible": flexible, "mesh_pose": p}
        for n, p in (
            ("a", {"frame": "joint"}),
            ("b", {"position": [-0.4, 0.02, 0.03], "rotation_deg": [5.0, -10.0, 20.0]}),
            ("c", {"frame": "joint", "rotation_deg": [0.0, 15.0, 0.0]}),
        )
    ]
    payloads = [{"point": "end", "mass": 0.4, "inertia": [1e-3, 2e-3, 2.5e-3], "offset": [0.02, 0.01, 0.05]}]
    return scenes.three_links(folder, kind, links=links, payloads=payloads)


@pytest.mark.parametrize("kind", ["revolute", "mixed"])
@pytest.mark.parametrize("gauge", ["joint-angle", "minimum-norm"])
def test_several_rigid_links_against_recursion(tmp_path: Path, kind: str, gauge: str) -> None:
    """Residual of the ERLS equations = torques of the Newton-Euler recursion, at random states, 1e-9 relative.

    With payload; rotor inertia and motors on the way.
    """
    path = _chain(tmp_path, False, kind)
    text = path.read_text(encoding="utf-8").replace('"name" = "j2"', '"name" = "j2", "motor" = { rotor_inertia = 1e-4, '
                                    "gear_ratio = 50.0, mass = 0.3, inertia = [1e-4, 1e-4, 2e-4] }")  # fmt: skip
    path.write_text(text)
    chain = scenes.mechanism(path)
    equations = scenes.erls(chain, gauge)
    rng = np.random.default_rng(7)
    for _ in range(20):
        theta, rates, accelerations = rng.uniform(-2, 2, (3, 3))
        found = equations.residual(0.0, theta, rates, accelerations)
        expected = inverse_dynamics(chain, theta, rates, accelerations)
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_prescribed_rigid_robot_reports_the_torque_of_the_recursion(tmp_path: Path) -> None:
    """joint_effort of a prescribed motion of rigid links."""
    drive = {
        "type": "motion",
        "motion": {"shape": "polynomial", "from": 0.0, "to": 1.0, "duration": 0.2, "degree": 7},
    }
    path = _chain(tmp_path, False, "revolute")
    data = scenes.read_toml(path)
    for joint in data["joints"]:
        joint["drive"] = drive
    run = erls.simulate(scenes.write_toml(path, data), verdict=False)
    chain = run.formulation.mechanism
    for t in (0.05, 0.13):
        reference = np.array([j.drive.reference(t) for j in chain.joints]).T
        expected = inverse_dynamics(chain, *reference)
        found = [float(run.joint_effort(name, t)) for name in run.joint_names]
        np.testing.assert_allclose(found, expected, rtol=1e-9)

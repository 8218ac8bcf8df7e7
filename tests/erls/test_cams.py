"""Cams: the follower keeps to the curve, its effort is its inertia along it, and it may lift off."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from test_couplings import MOTOR, shaft

import erls
from erls.errors import SceneError

MASS, RISE, RATE = 1.0, 0.01, 20.0  # kg of every link, m, rad/s
RISES = {"angles_deg": [0, 60, 120, 180], "values": [0.0, 0.0, RISE, 0.0], "degree": 5}
SPUN = {"type": "motion", "motion": {"shape": "spin_up", "rate": RATE, "duration": 0.1}}


def valve(cam: dict[str, Any], drive: dict[str, Any] | None = None, **more: Any) -> Any:
    """A slide that follows a cam on a shaft; keys of the simulation, and of joints and coupling."""
    coupling, own, turning = (more.pop(name, {}) for name in ("coupling", "valve", "turning"))
    shafts = shaft("shaft", MOTOR, **({"drive": drive} if drive else {})), shaft("valve", 0.0, type="prismatic")
    return erls.make_scene(
        gravity=[0.0, 0.0, 0.0],
        simulation={"duration": 0.5, **more},
        joints=[{**shafts[0][0], **turning}, {**shafts[1][0], **own}],
        links=[link for _, link in shafts],
        couplings=[{"name": "cam", "joint": "valve", "cam": {"joint": "shaft", **cam}, **coupling}],
    )


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_a_follower_has_the_acceleration_of_its_curve(formulation: str) -> None:
    """3-4-5 polynomial over 60 degrees at a constant rate: lift s(x), effort m s''(x) (ω / 60°)², over many turns."""
    run = erls.simulate(valve(RISES, SPUN, formulation=formulation), verdict=False)
    times = np.linspace(0.11, 0.5, 200)
    turned = np.degrees(run.joint_angle("shaft", times)) % 360
    x = np.clip((turned - 60) / 60, 0.0, 1.0)
    down = turned > 120
    x = np.where(down, np.clip((turned - 120) / 60, 0.0, 1.0), x)
    sign = np.where(down, -1.0, 1.0)
    lift = RISE * (10 * x**3 - 15 * x**4 + 6 * x**5)
    lift = np.where(down, RISE - lift, lift)
    bend = sign * RISE * (60 * x - 180 * x**2 + 120 * x**3) * (RATE / math.radians(60)) ** 2
    np.testing.assert_allclose(run.joint_angle("valve", times), lift, atol=1e-6 * RISE)
    np.testing.assert_allclose(run.coupling_effort("cam", times), MASS * bend, atol=1e-6 * np.abs(bend).max())


def test_a_free_shaft_keeps_its_energy_over_a_cam() -> None:
    """½ (J + m c'²) ω² is what it had, and the shaft slows down on the way up; by an eccentric as a spline."""
    angles = np.linspace(0.0, 330.0, 12)
    cam = {"angles_deg": angles.tolist(), "values": (0.1 * np.sin(np.radians(angles))).tolist(), "law": "spline"}
    scene = valve(cam, tolerance=1e-6, turning={"initial": {"rate": 5.0}})
    run = erls.simulate(scene)
    times = np.linspace(0.0, 0.5, 50)
    energies = run.energy(times).total
    np.testing.assert_allclose(energies, energies[0], rtol=1e-5)
    shaft_rate, angle = run.joint_rate("shaft", times), run.joint_angle("shaft", times)
    # the spline is the sine to 1e-4 of its amplitude, its slope to 1e-3
    kinetic = (MOTOR + MASS * 0.01 * np.cos(angle) ** 2) * shaft_rate**2 / 2
    np.testing.assert_allclose(kinetic, energies[0], rtol=5e-3)
    assert np.ptp(angle) > 0.5


def test_a_follower_that_is_pressed_on_lifts_off() -> None:
    """A one-sided stop in place of a groove: down to its cam's fall a spring is too weak, and the valve flies."""
    drive = {"type": "motion", "motion": {"shape": "spin_up", "rate": 60.0, "duration": 0.1}}
    teeth = {"stops": {"lower": 0.0, "stiffness": 1e5, "restitution": 0.0}}
    run = erls.simulate(valve(RISES, drive, coupling=teeth, duration=0.2, valve={"stiffness": 200.0}), verdict=False)
    times = np.linspace(0.0, 0.2, 2001)
    gap = run.joint_angle("valve", times) - erls.simulate(
        valve(RISES, drive, duration=0.2), verdict=False
    ).joint_angle("valve", times)
    effort = run.coupling_effort("cam", times)
    assert gap.max() > 1e-3
    assert effort.min() >= -1e-9
    np.testing.assert_allclose(effort[gap > 1e-5], 0.0, atol=1e-9)


def test_an_oscillating_follower_and_a_cam_that_slides() -> None:
    """A wedge under a lever: over a length there is no period, and ends hold."""
    drive = {"type": "motion", "motion": {"shape": "polynomial", "from": -0.1, "to": 0.3, "duration": 0.4}}
    wedge, lever = shaft("wedge", 0.0, type="prismatic", drive=drive), shaft("lever", MOTOR)
    scene = erls.make_scene(
        gravity=[0.0, 0.0, 0.0],
        simulation={"duration": 0.5},
        joints=[wedge[0], lever[0]],
        links=[wedge[1], lever[1]],
        couplings=[
            {"name": "ramp", "joint": "lever", "cam": {"joint": "wedge", "angles": [0.0, 0.2], "values_deg": [0, 30]}}
        ],
    )
    run = erls.simulate(scene, verdict=False)
    at = np.clip(run.joint_angle("wedge", np.linspace(0, 0.5, 50)) / 0.2, 0.0, 1.0)
    lift = np.radians(30) * (10 * at**3 - 15 * at**4 + 6 * at**5)
    np.testing.assert_allclose(run.joint_angle("lever", np.linspace(0, 0.5, 50)), lift, atol=1e-7)


@pytest.mark.parametrize(
    ("cam", "field", "words"),
    [
        ({"angles_deg": [0, 60], "values": [0.0]}, "cam.values", "as many"),
        ({"angles_deg": [60, 0], "values": [0.0, 1.0]}, "cam.angles", "rise"),
        ({"angles_deg": [0, 400], "values": [0.0, 1.0]}, "cam.angles", "more than one period"),
        ({"angles_deg": [0, 360], "values": [0.0, 1.0]}, "cam.values", "come back"),
        ({"angles_deg": [0, 60], "values_deg": [0.0, 1.0]}, "cam.values_deg", "prismatic"),
        ({**RISES, "law": "sine"}, "cam.law", "dwell"),
        ({**RISES, "degree": 4}, "cam.degree", "5"),
        ({**RISES, "joint": "valve"}, "cam.joint", "follow itself"),
    ],
)
def test_faults_name_their_field(cam: dict[str, Any], field: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        erls.simulate(valve(cam))
    assert field in str(caught.value)
    assert words in str(caught.value)

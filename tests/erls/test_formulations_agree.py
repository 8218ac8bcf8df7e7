"""ERLS and FFR on the same robot: torques of prescribed motion, against each other and against rigid links."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import scenes

import erls
from erls.maths.so3 import Array
from erls.mechanism.rigid_dynamics import inverse_dynamics

ROBOT = scenes.ROOT / "data" / "robot"
T = np.linspace(0.0, 0.6, 121)


def robot(folder: Path, formulation: str, stiffer: float) -> erls.Run:
    """The two-link robot from static equilibrium, so that little vibrates, with a Young's modulus times ``stiffer``."""
    (folder / "links").mkdir(exist_ok=True)
    arm = (ROBOT / "links" / "arm.toml").read_text(encoding="utf-8")
    arm = re.sub(r"youngs_modulus = \S+", f"youngs_modulus = {7e10 * stiffer!r}", arm)
    arm = arm.replace("elements = 20", "elements = 4") + "\n[units]\nunusual = true\n"
    (folder / "links" / "arm.toml").write_text(arm, encoding="utf-8")
    (folder / "robot.toml").write_text((ROBOT / "two_link.toml").read_text(encoding="utf-8"), encoding="utf-8")
    changes = [f"simulation.formulation={formulation}", "simulation.duration=0.6", "initial.deformation=static"]
    changes += [f"links.{name}.elastic_modes=6" for name in ("upper_arm", "forearm")]
    return erls.simulate(erls.load_scene(folder / "robot.toml", changes), verdict=False)


def efforts(run: erls.Run) -> Array:
    """(2, k) torques of the two joints."""
    return np.array([run.joint_effort(name, T) for name in run.joint_names])


def test_torques_agree_and_approach_rigid_inverse_dynamics(tmp_path: Path) -> None:
    """ERLS and FFR within 1 % of each joint's peak; both approach rigid links with 1/E (ratio 4 ± 15 % for E × 4)."""
    distances = []
    for stiffer in (1.0, 4.0, 16.0):
        runs = [robot(tmp_path, formulation, stiffer) for formulation in ("erls", "ffr")]
        one, other = map(efforts, runs)
        peaks = np.abs(one).max(axis=1)
        assert (np.abs(one - other).max(axis=1) < 0.01 * peaks).all()
        mechanism = runs[0].formulation.mechanism
        references = [[j.drive.reference(t) for j in mechanism.joints] for t in T]
        rigid = np.array([inverse_dynamics(mechanism, *np.array(r).T) for r in references]).T
        distances.append([np.abs(found - rigid).max(axis=1) for found in (one, other)])
    ratios = np.array(distances[:-1]) / np.array(distances[1:])
    assert ratios == pytest.approx(4.0, rel=0.15)

"""Trees: links that bear several others, judged by rigid dynamics, by chains that they contain, and by each other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import chain_cases
import numpy as np
import pytest
import scenes

import erls
from erls.equations.ffr.formulation import Ffr
from erls.mechanism.chain import Mechanism
from erls.mechanism.drives import Drive
from erls.mechanism.joints import JointForces
from erls.mechanism.rigid_dynamics import inverse_dynamics
from erls.mechanism.without_effects import with_rigid

ARM = {**scenes.ARM, "mesh_pose": {"frame": "joint"}}
BODY = {
    "mass": 2.0,
    "inertia": [0.02, 0.03, 0.04],
    "points": {"foot": [0.0, 0.0, 0.0], "left": [0.1, 0.2, 0.3], "right": [-0.1, 0.2, -0.2]},
}


def two_arms(folder: Path, effects: str = "all", **changes: Any) -> Path:
    """A rigid torso on a hinge, with a flexible arm of two links on its left and one of one link on its right."""
    scenes.arm_link(folder)
    row = {"convention": "standard", "alpha_deg": 40.0}
    joints: list[dict[str, Any]] = [
        {"name": "waist", "dh": {"convention": "standard", "a": 0.1, "alpha_deg": 20.0}},
        {
            "name": "left_shoulder",
            "on": "torso",
            "at": "left",
            "branch": {"position": [0.1, 0.2, 0.3], "rotation_deg": [10.0, 20.0, 0.0]},
            "dh": row,
        },
        {"name": "left_elbow", "dh": {"convention": "modified", "a": 0.4, "alpha_deg": 30.0}},
        {
            "name": "right_shoulder",
            "type": "prismatic",
            "on": "torso",
            "at": "right",
            "branch": {"position": [-0.1, 0.2, -0.2]},
            "dh": row,
        },
    ]
    links = [
        {"name": "torso", "rigid": BODY},
        {"name": "left_upper", **ARM},
        {"name": "left_fore", **ARM},
        {"name": "right_arm", **ARM},
    ]
    data = {
        "simulation": {"duration": 0.05, "effects": effects.split(",")},
        "joints": joints,
        "links": links,
        "points": [
            {"name": "left", "link": "left_fore", "node": "tip"},
            {"name": "right", "link": "right_arm", "node": "tip"},
        ],
    }
    return scenes.write_toml(folder / "two_arms.toml", scenes.merged(data, changes))


def _state(mechanism: Mechanism, size: int, softness: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    joints = len(mechanism.joints)
    y, v, a = rng.uniform(-1.0, 1.0, (3, size))
    for x in (y, v, a):
        x[joints:] *= 1e-3 * softness
    return y, v, a


def _rigid(mechanism: Mechanism) -> Mechanism:
    return with_rigid(mechanism, {link.name for link in mechanism.links})


def test_parents(tmp_path: Path) -> None:
    """Who stands on whom, and where."""
    mechanism = scenes.mechanism(two_arms(tmp_path))
    assert mechanism.parents == (-1, 0, 1, 0)
    assert [None if j.seat is None else j.seat.name for j in mechanism.joints] == [None, "left", "tip", "right"]
    assert (mechanism.carried(1), mechanism.carried(0), mechanism.outermost) == ([1, 2], [0, 1, 2, 3], [2, 3])


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_rigid_tree(tmp_path: Path, formulation: str) -> None:
    """Forces out of balance of rigid links are those of the recursive Newton-Euler method: 1e-12 of the largest."""
    mechanism = _rigid(scenes.mechanism(two_arms(tmp_path)))
    equations = scenes.erls(mechanism) if formulation == "erls" else Ffr(mechanism)
    y, v, a = _state(mechanism, equations.size)
    expected = inverse_dynamics(mechanism, y, v, a)
    np.testing.assert_allclose(equations.residual(0.0, y, v, a), expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("case", chain_cases.NOT_SERIAL)
def test_rigid_links_on_all_joints(tmp_path: Path, case: str) -> None:
    """Against the recursive Newton-Euler method: 1e-12 of the largest force."""
    mechanism = _rigid(chain_cases.mechanism(tmp_path, case))
    free = [replace(joint, drive=Drive(), forces=JointForces(), rotor_inertia=0.0) for joint in mechanism.joints]
    mechanism = replace(mechanism, joints=tuple(free))
    y, v, a = _state(mechanism, len(free))
    expected = inverse_dynamics(mechanism, y, v, a)
    for equations in (scenes.erls(mechanism), Ffr(mechanism)):
        found = equations.residual(0.0, y, v, a)
        np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    many = [np.stack([x, 0.5 * x, 0 * x]) for x in (y, v, a)]  # of several states at once, each as by itself
    each = [inverse_dynamics(mechanism, *(x[k] for x in many)) for k in range(3)]
    np.testing.assert_allclose(inverse_dynamics(mechanism, *many), each, rtol=0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("path", "point", "limit"),
    [("tree/two_arms.toml", "left_hand", 2e-5), ("parallel/three_legs.toml", "middle", 2e-5)],
)
def test_formulations_agree_on_shipped_trees(path: str, point: str, limit: float) -> None:
    """ERLS, FFR and nodal over the first 20 ms, while links bend by a few tenths of a millimetre at most.

    Their distance is of second order in the deflection, as `test_second_order_agreement` shows for chains.
    """
    t = np.linspace(0.0, 0.02, 5)
    changes = ["simulation.duration=0.02", "simulation.integrator=generalized_alpha", "simulation.step=2.5e-4"]
    found = {}
    for formulation in ("erls", "ffr", "nodal"):
        scene = erls.load_scene(scenes.ROOT / "data" / path, [*changes, f"simulation.formulation={formulation}"])
        run = erls.simulate(scene, verdict=False)
        assert run.failure is None
        found[formulation] = run.position(point, t)
    for other in ("ffr", "nodal"):
        np.testing.assert_allclose(found[other], found["erls"], rtol=0, atol=limit)

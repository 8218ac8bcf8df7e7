"""Derivatives through contacts, stops, and switches between sticking and sliding: against closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contact_scenes import MASS, falling, pendulum, simulated
from scipy.integrate import solve_ivp
from test_sticking import FORCE, START, STIFFNESS, sliding
from test_sticking import MASS as BLOCK

import erls
from erls.errors import SceneError


def _both_ways(run: Any, output: Any, keys: list[str]) -> dict[str, np.ndarray]:
    """Derivatives forward; those of the adjoint method equal them to 1e-9: the same equations, transposed."""
    forward, adjoint = (erls.sensitivities(run, {"x": output}, keys, method) for method in ("forward", "adjoint"))
    for key, expected in forward.derivatives["x"].items():
        apart = np.abs(adjoint.derivatives["x"][key] - expected).max()
        assert apart <= 1e-9 * np.abs(expected).max(), key
    return forward.derivatives["x"]


def _differences(what: Any, values: list[float]) -> np.ndarray:
    """(p, k) of a closed form by each of its values."""
    result = []
    for i, value in enumerate(values):
        step = 1e-5 * value
        ahead, back = ([*values[:i], value + way * step, *values[i + 1 :]] for way in (1, -1))
        result.append((what(*ahead) - what(*back)) / (2 * step))
    return np.array(result)


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_a_body_rebounds(tmp_path: Path, restitution: float) -> None:
    """It leaves with e times its speed, and later by as much as it came later, whatever gives way; dv/de is its speed
    before. To the 1e-6 or so that a transition at 1 mm/s leaves of 2 m/s.
    """
    run = simulated(falling(tmp_path, restitution, 0.5, -2.0, 0.0))
    keys = ["joints.0.initial.position", "joints.0.initial.rate", "contacts.0.stiffness", "contacts.0.restitution"]
    keys = keys[:3] if restitution == 1.0 else keys
    outputs = {"z": lambda run: run.position("centre", 0.9)[2], "v": lambda run: run.joint_rate("fall", 0.9)}
    found = erls.sensitivities(run, outputs, keys).derivatives
    place, rate, stiffness, *elasticity = ([found[name][key] for name in ("z", "v")] for key in keys)
    np.testing.assert_allclose(place, [-restitution, 0.0], rtol=0, atol=2e-6)
    assert rate[1] == pytest.approx(-restitution, abs=2e-6)
    assert abs(stiffness[1]) < 1e-6 / 1e7  # metres per second per unit of it
    assert restitution == 1.0 or elasticity[0][1] == pytest.approx(2.0, abs=2e-6)


def test_a_ball_with_weight(tmp_path: Path) -> None:
    """Against the variational equations of the ball, written down here and integrated by SciPy; to the 1e-6 that the
    run itself is right to. By the adjoint method, which takes them back through the impact.
    """
    run = simulated(falling(tmp_path, 0.7, 0.2, 0.0, 9.81), "simulation.duration=0.3", "simulation.tolerance=1e-5")
    law = run.formulation.mechanism.contacts[0].law
    loss = (1 - 0.7**2) / (1 + 0.7**2)

    def slope(t: float, state: np.ndarray) -> list[float]:
        z, v, by_height, rate_by_height, by_weight, rate_by_weight = state
        stiffness = damping = force = 0.0
        if z < 0:
            x = max(-1.0, min(1.0, -v / law.transition_rate))
            level = 1 + loss * x * (15 - 10 * x**2 + 3 * x**4) / 8
            force = law.stiffness * (-z) ** 1.5 * level / MASS
            stiffness = 1.5 * force / -z
            damping = law.stiffness * (-z) ** 1.5 * loss * 15 * (1 - x**2) ** 2 / 8 / law.transition_rate / MASS
        gains = [-stiffness * x - damping * r for x, r in ((by_height, rate_by_height), (by_weight, rate_by_weight))]
        return [v, force - 9.81, rate_by_height, gains[0], rate_by_weight, gains[1] + 1]

    start = [0.2, 0.0, 1.0, 0.0, 0.0, 0.0]
    best = solve_ivp(slope, (0, 0.3), start, "DOP853", rtol=1e-12, atol=1e-14, first_step=1e-6, max_step=1e-3).y[:, -1]
    outputs = {"z": lambda run: run.position("centre", 0.3)[2], "v": lambda run: run.joint_rate("fall", 0.3)}
    keys = ["joints.0.initial.position", "gravity.2"]
    found = erls.sensitivities(run, outputs, keys, "adjoint").derivatives
    for k, key in enumerate(keys):
        own = [found[name][key] for name in ("z", "v")]
        np.testing.assert_allclose(own, best[2 + 2 * k : 4 + 2 * k], rtol=1e-6)


def test_a_stop(tmp_path: Path) -> None:
    """An arm turns back from its stop with e times its rate, wherever it comes from."""
    stops = {"upper_deg": 20.0, "stiffness": 1e5, "restitution": 0.6}
    run = simulated(pendulum(tmp_path, joint={"stops": stops, "initial": {"position_deg": 0.0, "rate": 1.0}}))
    own = {"rate": lambda run: run.joint_rate("hinge", 0.6), "angle": lambda run: run.joint_angle("hinge", 0.6)}
    found = erls.sensitivities(run, own, {"joints.0.initial.rate": 1.0, "joints.0.initial.position_deg": 10.0})
    assert found.derivatives["rate"]["joints.0.initial.rate"] == pytest.approx(-0.6, abs=1e-5)
    turned = found.derivatives["angle"]["joints.0.initial.position_deg"]
    assert turned == pytest.approx(np.radians(-0.6), abs=1e-6)


@pytest.mark.parametrize(("integrator", "limit"), [("lobatto", 1e-7), ("generalized_alpha", 1e-5)])
def test_block_on_a_spring(integrator: str, limit: float, tmp_path: Path) -> None:
    """Released from a displaced place, it turns back twice, and comes to rest: half cycles in closed form."""
    settings = {"tolerance": 1e-6} if integrator == "lobatto" else {"step": 2e-4}
    joint = {"stiffness": STIFFNESS, "initial": {"position": START}}
    run = sliding(tmp_path, {"force": FORCE}, joint, integrator=integrator, **settings)
    times = [0.1, 0.5, 0.8, 1.05]

    def place(start: float, force: float, stiffness: float, mass: float) -> np.ndarray:
        omega, shift = math.sqrt(stiffness / mass), force / stiffness
        result = []
        for t in times:
            x, half = start, math.pi / omega
            while abs(x) > shift and t >= half:
                x, t = 2 * math.copysign(shift, x) - x, t - half
            middle = math.copysign(shift, x)
            result.append(x if abs(x) <= shift else middle + (x - middle) * math.cos(omega * t))
        return np.array(result)

    keys = ["joints.0.initial.position", "joints.0.friction.force", "joints.0.stiffness", "links.0.rigid.mass"]
    found = _both_ways(run, lambda run: run.position("block", times)[:, 2], keys)
    values = [START, FORCE, STIFFNESS, BLOCK]
    for key, row, value in zip(keys, _differences(place, values), values, strict=True):
        np.testing.assert_allclose(value * found[key], value * row, rtol=0, atol=limit)


def _pulled(folder: Path, to: float | None, **settings: Any) -> Any:
    """A block that sticks, pulled by a spring whose end moves evenly, or to a place."""
    motion: dict[str, Any] = {"shape": "spin_up", "rate": 0.05, "duration": 0.02}
    if to is not None:
        motion = {"shape": "polynomial", "from": 0.0, "to": to, "duration": 0.5}
    drive = {"type": "pd", "proportional_gain": STIFFNESS, "derivative_gain": 0.0, "motion": motion}
    friction = {"force": FORCE, "static_force": 5.0}
    return sliding(folder, friction, {"drive": drive}, integrator="lobatto", tolerance=1e-6, **settings)


def test_stick_slip(tmp_path: Path) -> None:
    """It breaks away where the spring pulls by the static force, slides, and rests until the spring is as long again;
    derivatives of its place while it slides, and while it rests, after up to three slides.
    """
    run, times = _pulled(tmp_path, None, duration=1.8), [0.6, 1.0, 1.7]

    def place(static: float, force: float, stiffness: float, pull: float, mass: float) -> np.ndarray:
        omega = math.sqrt(stiffness / mass)
        slides = (2 * math.pi - 2 * math.atan((static - force) * omega / (stiffness * pull))) / omega
        rests = 2 * (static - force) / (stiffness * pull)
        result = []
        for t in times:
            t, x = t - static / (stiffness * pull) - 0.01, 0.0
            while t > slides + rests:
                t, x = t - slides - rests, x + pull * (slides + rests)
            t = min(t, slides)
            ahead = (static - force) / stiffness * (1 - math.cos(omega * t)) - pull / omega * math.sin(omega * t)
            result.append(x + pull * t + ahead)
        return np.array(result)

    values = [5.0, FORCE, STIFFNESS, 0.05, BLOCK]
    keys = ["static_force", "force", "proportional_gain", "motion.rate"]
    keys = [f"joints.0.{'friction' if 'force' in key else 'drive'}.{key}" for key in keys] + ["links.0.rigid.mass"]
    found = _both_ways(run, lambda run: run.joint_coordinate("slide", times), keys)
    np.testing.assert_allclose(run.joint_coordinate("slide", times), place(*values), rtol=0, atol=1e-8)
    for key, row, value in zip(keys, _differences(place, values), values, strict=True):
        np.testing.assert_allclose(value * found[key], value * row, rtol=0, atol=2e-7)


def test_refusals(tmp_path: Path) -> None:
    """A spring that pulls only just enough; contacts of nodes."""
    run = _pulled(tmp_path, 5.0 / STIFFNESS * (1 + 1e-7), duration=0.6)
    own = {"x": lambda run: run.joint_coordinate("slide", 0.6)}
    with pytest.raises(SceneError, match=r"only just breaks away at t = 0\.49"):
        erls.sensitivities(run, own, ["joints.0.friction.force"])
    nodal = erls.load_scene(falling(tmp_path, 0.5, 0.5, -2.0, 0.0), ["simulation.formulation=nodal"])
    with pytest.raises(SceneError, match="nodal runs with contacts"):
        erls.sensitivities(nodal, own, ["gravity.2"])



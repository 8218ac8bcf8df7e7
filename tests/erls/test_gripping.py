"""Points that stick to planes: closed forms, formulations beside each other, forces that hold."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from contact_scenes import MASS, G, down_the_slope, on_a_slope, simulated
from test_sticking import switches
from test_sticking_loops import LENGTHS, MASSES, on_spring, parallelogram, run_scene

from erls.accuracy.energy_balance import energy_balance
from erls.accuracy.looked_at import LookedAt
from erls.equations.switches.grips import Grips, Touch, held_point
from erls.maths.contact_places import MODE, SLIDES, SMOOTH, STICKS
from erls.maths.so3 import Array
from erls.mechanism.contacts import ContactLaw, PointContact
from erls.run.chain.run import ChainRun

MU = 0.3
FRICTION = {"law": "stick", "coefficient": MU}
FORMULATIONS: dict[str, list[str]] = {
    "erls": ["simulation.formulation=erls"],
    "ffr": ["simulation.formulation=ffr"],
    "generalized_alpha": ["simulation.integrator=generalized_alpha", "simulation.step=2e-3"],
    "nodal": ["simulation.formulation=nodal", "simulation.step=2e-3"],
}


def along(degrees: float) -> Array:
    """(3,) unit vector down the slope."""
    slope = math.radians(degrees)
    return np.array([math.cos(slope), 0.0, -math.sin(slope)])


def sliding(folder: Path, degrees: float, speed: float, *changes: str, **more: Any) -> ChainRun:
    """A run of a block on a slope."""
    return simulated(scenes.write_toml(folder / "slope.toml", on_a_slope(degrees, speed, FRICTION, **more)), *changes)


def test_runs_of_one_system_forget_each_other(tmp_path: Path) -> None:
    """The run with larger steps that tells the error begins as the run did, and comes to rest there."""
    data = on_a_slope(10.0, -1.0, FRICTION, simulation={"duration": 0.3, "step": 2e-3, "formulation": "nodal"})
    run = run_scene(tmp_path, data)
    assert run.accuracy is not None
    assert run.accuracy.integration is not None
    assert run.accuracy.integration < 1e-6


@pytest.mark.parametrize("name", FORMULATIONS)
def test_a_block_stays_where_it_came_to_rest(name: str, tmp_path: Path) -> None:
    """Uphill it comes to rest after v / (g (sin α + µ cos α)), and stays; where tan α is more than µ it goes back.

    Places to 1e-6 m, times of rest to 1e-6 s; friction is µ N, then what holds the weight (1e-5 of it).
    """
    times = np.linspace(0.0, 0.3, 101)
    for degrees, stays in ((10.0, True), (25.0, False)):
        slope = math.radians(degrees)
        run = sliding(tmp_path, degrees, -1.0, "simulation.duration=0.3", *FORMULATIONS[name])
        places = run.position("centre", times)
        assert np.abs((places - places[0]) @ along(degrees) - down_the_slope(degrees, -1.0, MU, times)).max() < 1e-6
        rests = 1.0 / (G * (math.sin(slope) + MU * math.cos(slope)))
        assert switches(run) == pytest.approx([rests], abs=1e-6)
        if stays:
            pushed = run.contact("slope", np.array([0.1, 0.28])).force @ along(degrees)
            rubs, holds = MU * MASS * G * math.cos(slope), -MASS * G * math.sin(slope)
            assert pushed == pytest.approx([rubs, holds], rel=1e-5)


def test_a_block_on_a_spring(tmp_path: Path) -> None:
    """Half cycles about ± µ N / k until it rests: places, times of turning, and the stated error; energy closes."""
    stiffness, start = 200.0, 0.2
    data = on_a_slope(0.0, 0.0, FRICTION, simulation={"duration": 1.2, "tolerance": 1e-6})
    data["joints"][0]["coordinates"]["x"] = {"stiffness": stiffness, "initial": {"position": start}}
    run = run_scene(tmp_path, data)
    omega, shift = math.sqrt(stiffness / MASS), MU * MASS * G / stiffness
    times = np.linspace(0.0, 1.2, 201)
    exact = np.array([on_spring(t, start, shift, omega) for t in times.tolist()])
    off = float(np.abs(run.position("centre", times)[:, 0] - exact).max())
    assert run.accuracy is not None
    assert run.accuracy.integration is not None
    assert off < min(1e-9, run.accuracy.integration)
    assert switches(run) == pytest.approx([math.pi / omega * k for k in (1, 2, 3)], abs=1e-9)
    balance = energy_balance(LookedAt(run))
    assert balance is not None
    assert abs(balance.off) < 1e-9 * balance.exchanged


def test_more_holds_at_rest_than_while_it_slides(tmp_path: Path) -> None:
    """Pulled by a spring whose end moves on at c, a block breaks away after µ_s N / (k c), and rests again after
    2 (π - arctan((µ_s - µ) N ω / (k c))) / ω.
    """
    stiffness, speed, static = 200.0, 0.2, 0.5
    motion = {"shape": "spin_up", "rate": speed, "duration": 0.02}  # as if it began at 0.01 s
    friction = {**FRICTION, "static_coefficient": static}
    data = on_a_slope(0.0, 0.0, friction, simulation={"duration": 1.0, "tolerance": 1e-6})
    drive = {"type": "pd", "proportional_gain": stiffness, "derivative_gain": 0.0, "motion": motion}
    data["joints"][0]["coordinates"]["x"] = {"drive": drive}
    run = run_scene(tmp_path, data, False)
    omega, weight = math.sqrt(stiffness / MASS), MASS * G
    begins = static * weight / (stiffness * speed) + 0.01
    ends = begins + 2 * (math.pi - math.atan((static - MU) * weight * omega / (stiffness * speed))) / omega
    assert [t for t in switches(run) if t > 0.03][:2] == pytest.approx([begins, ends], abs=1e-6)


def test_a_linkage_jams(tmp_path: Path) -> None:
    """A parallelogram falls onto a plane and rests there, held by friction: ERLS and FFR to 1e-9 m, and forces in
    balance at rest about its one coordinate (1e-6).
    """
    places, data = {}, parallelogram({}, {}, {}, 1.0)
    plane = {"normal": [0.0, 1.0, 0.0], "position": [0.0, LENGTHS[0] * math.sin(1.0) - 0.02, 0.0]}
    law = {"stiffness": 1e5, "restitution": 0.0, "exponent": 1.0, "transition_rate": 0.05}
    contact = {"name": "floor", "point": "pin", "plane": plane, **law, "friction": {"law": "stick", "coefficient": 0.8}}
    data |= {"gravity": [0.0, -G, 0.0], "contacts": [contact]}
    for formulation in ("erls", "ffr"):
        data["simulation"] = {"duration": 0.3, "formulation": formulation}
        run = run_scene(tmp_path, data, False)
        places[formulation] = run.position("pin", np.linspace(0.0, 0.3, 31))
        assert abs(float(run.joint_rate("j0", 0.3))) < 1e-7
        force, pin = run.contact("floor", 0.29).force, places[formulation][-1]
        assert abs(force[0]) < 0.8 * force[1]
        weight = G * (MASSES[0] / 2 + MASSES[1] + MASSES[2] / 2)
        assert pin[0] * (force[1] - weight) - pin[1] * force[0] == pytest.approx(0.0, abs=1e-5 * force[1])
    assert np.abs(places["erls"] - places["ffr"]).max() < 1e-9


def test_points_share_a_load() -> None:
    """Two points of one body on one plane, pushed along it: each takes half; three units are more than both hold."""
    law = ContactLaw(1.0, 1.0, 0.0, 1.0)
    contacts = [PointContact(n, 0, 0, None, np.zeros(3), np.eye(3)[2], law, 0.5, static_friction=0.5) for n in "ab"]
    laws, push = [contact.sliding(1.0) for contact in contacts], np.zeros(2)

    def look(t: Array, y: Array, v: Array) -> Touch:
        both = [-np.ones((len(t), 1)), v, y]
        return Touch.of(np.repeat(np.concatenate(both, axis=1)[:, None], 2, axis=1))

    def accelerate(t: float, y: Array, v: Array) -> Array:
        total = push.copy()
        for own in laws:
            moved = (y - own[5:7] + own[8] * v) / own[7]
            total -= 0.5 * (moved if own[MODE] == STICKS else own[3:5] if own[MODE] == SLIDES else 0.0)
        return total

    grips, still = Grips([held_point(contact) for contact in contacts], laws, look), np.zeros(2)
    for push[0], mode in ((0.8, STICKS), (3.0, SLIDES)):
        with grips.settled(0.0, still, still, accelerate):
            assert [own[MODE] for own in laws] == [mode, mode]
            assert accelerate(0.0, still, still) == pytest.approx([max(push[0] - 1.0, 0.0), 0.0], abs=1e-8)
            if mode == STICKS:
                assert laws[0][5:7] == pytest.approx(laws[1][5:7], rel=1e-8)
                assert grips.left(np.zeros(1), still[None], still[None], None)[0] == pytest.approx([0.2, 0.2])
        assert [own[MODE] for own in laws] == [SMOOTH, SMOOTH]

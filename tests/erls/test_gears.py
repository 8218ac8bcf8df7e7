"""Gears: a joint of its own between rotor and link, elastic or with play."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import erls

ROTOR, ARM = 0.02, 0.05  # kg m², about the common axis
TEETH, PLAY, RATE = 400.0, 2e-3, 1.5  # N m/rad, rad to either side, rad/s


def drive_train(gear: dict[str, Any], duration: float) -> Any:
    """A run of a rotor and an arm about one axis, with a gear between them that begins in its middle, at a rate."""
    dh = {"convention": "standard"}
    bodies = {
        name: {"mass": 1.0, "inertia": [0.0, 0.0, inertia], "points": {"in": [0.0, 0.0, 0.0], "out": [0.0, 0.0, 0.0]}}
        for name, inertia in (("rotor", ROTOR), ("arm", ARM))
    }
    scene = erls.make_scene(
        gravity=[0.0, 0.0, 0.0],
        simulation={"duration": duration, "tolerance": 1e-6},
        joints=[{"name": "motor", "dh": dh}, {"name": "gear", "dh": dh, "initial": {"rate": RATE}, **gear}],
        links=[{"name": name, "rigid": body} for name, body in bodies.items()],
    )
    return erls.simulate(scene, verdict=False)


@pytest.mark.parametrize("play", [0.0, PLAY])
def test_teeth_swing_through_their_play(play: float) -> None:
    """Two inertias that teeth hold together: free through the play, half a period of √(k / J) on either side, with
    J = J₁ J₂ / (J₁ + J₂); after a whole one all is as it was, and the sum of momentum has not changed on the way. To
    the tolerance of the angle over the rate.
    """
    reduced = ROTOR * ARM / (ROTOR + ARM)
    half = 2 * play / RATE + math.pi * math.sqrt(reduced / TEETH)
    stops = {"lower": -PLAY, "upper": PLAY, "stiffness": TEETH, "restitution": 1.0, "exponent": 1.0}
    run = drive_train({"stops": stops} if play else {"stiffness": TEETH}, 2 * half)
    times = [half / 2, half, 2 * half]
    angle, rate = run.joint_angle("gear", times), run.joint_rate("gear", times)
    deepest = play + RATE * math.sqrt(reduced / TEETH)
    np.testing.assert_allclose(angle, [deepest, 0.0, 0.0], rtol=0, atol=1e-5)
    np.testing.assert_allclose(rate[1:], [-RATE, RATE], rtol=1e-3)
    momentum = (ROTOR + ARM) * run.joint_rate("motor", times) + ARM * rate
    np.testing.assert_allclose(momentum, ARM * RATE, rtol=1e-9)

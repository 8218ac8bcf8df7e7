"""Inverse dynamics of mechanisms with closed loops."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import erls
from erls.errors import Cause, SimulationError
from erls.tracking.confirm import confirmed

DATA = Path(__file__).parents[2] / "data"
LEGS = DATA / "inverse" / "three_legs.toml"


def _legs(middle: str, first: str) -> erls.Scene:
    line = "servo.{}.path={{shape='line', from=[0.0, {}, 0.0], to={}, start=0.5, duration=0.6}}"
    return erls.load_scene(LEGS, [line.format(0, 0.0, middle), line.format(1, 0.1, first), "simulation.step=0.01"])


@pytest.mark.parametrize(
    ("middle", "first", "cause", "said"),
    [
        ("[0.35, 0.0, 0.0]", "[0.35, 0.1, 0.0]", Cause.OUT_OF_REACH, "t = 0.89 s"),
        # turned by 64 degrees, the platform has the legs in lines that meet
        ("[0.001, 0.0, 0.0]", "[0.09, 0.1, 0.0]", Cause.SINGULAR_SERVO, "t = 0.79 s"),
    ],
)
def test_names_what_cannot_be_and_when(middle: str, first: str, cause: Cause, said: str) -> None:
    with pytest.raises(SimulationError, match=said) as caught:
        erls.invert(_legs(middle, first))
    assert caught.value.cause is cause


def test_first_zero_is_a_leg_between_its_pins() -> None:
    """Motors and platform held, what is left is the bending of legs between pins, π/2 √(E I / m) / L²; what the
    section's own inertia and shear take off is less than 1 % (101.1 and 100.5 Hz).
    """
    outer, inner = (0.075, 0.0075), (0.0735, 0.006)
    bending = (outer[0] * outer[1] ** 3 - inner[0] * inner[1] ** 3) / 12
    area = outer[0] * outer[1] - inner[0] * inner[1]
    pinned = np.pi / 2 * np.sqrt(7e10 * bending / (2700.0 * area)) / 0.51**2
    inputs = [f"joint.motor_{k}.effort" for k in (1, 2, 3)]
    outputs = ["point.middle.x", "point.middle.y", "point.first.x"]
    zeros = erls.linearize(erls.load_scene(LEGS), at=0.0, inputs=inputs, outputs=outputs).zeros()
    assert 0.99 < np.abs(zeros).min() / (2 * np.pi) / pinned < 1.0


def test_drives_a_four_bar_under_its_weight() -> None:
    """A loop of one freedom: the crank turns as demanded in a forward run, to order 2 of the step."""
    motion = "{shape='polynomial', from_deg=60.0, to_deg=120.0, start=0.2, duration=0.5}"
    missed = []
    for step in (0.004, 0.002):
        scene = erls.load_scene(
            DATA / "four_bar" / "flexible.toml",
            [
                f"servo=[{{joints={{crank_pivot=1.0}}, motion={motion}}}]",
                "inverse.drives=['crank_pivot']",
                "simulation.duration=0.9",
                f"simulation.step={step}",
            ],
        )
        found = erls.invert(scene)
        missed.append(confirmed(found, found.efforts, found.start).largest[0])
    assert missed[1] < missed[0] / 3

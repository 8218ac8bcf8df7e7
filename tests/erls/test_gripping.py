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

from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun

MU = 0.3
STICKS = {"law": "stick", "coefficient": MU}
FORMULATIONS: dict[str, list[str]] = {
    "erls": ["simulation.formulation=erls"],
    "ffr": ["simulation.formulation=ffr"],
    "generalized_alpha": ["simulation.integrator=generalized_alpha", "simulation.step=1e-3"],
    "nodal": ["simulation.formulation=nodal", "simulation.step=1e-3"],
}


def along(degrees: float) -> Array:
    """(3,) unit vector down the slope."""
    slope = math.radians(degrees)
    return np.array([math.cos(slope), 0.0, -math.sin(slope)])


def sliding(folder: Path, degrees: float, speed: float, *changes: str, **more: Any) -> ChainRun:
    """A run of a block on a slope."""
    return simulated(scenes.write_toml(folder / "slope.toml", on_a_slope(degrees, speed, STICKS, **more)), *changes)


@pytest.mark.parametrize("name", FORMULATIONS)
def test_a_block_stays_where_it_came_to_rest(name: str, tmp_path: Path) -> None:
    """Uphill it comes to rest after v / (g (sin α + µ cos α)), and stays; where tan α is more than µ it goes back.

    Places to 1e-6 m, times of rest to 1e-6 s; friction is µ N, then what holds the weight (1e-5 of it).
    """
    times = np.linspace(0.0, 0.5, 101)
    for degrees, stays in ((10.0, True), (25.0, False)):
        slope = math.radians(degrees)
        run = sliding(tmp_path, degrees, -1.0, *FORMULATIONS[name])
        places = run.position("centre", times)
        assert np.abs((places - places[0]) @ along(degrees) - down_the_slope(degrees, -1.0, MU, times)).max() < 1e-6
        rests = 1.0 / (G * (math.sin(slope) + MU * math.cos(slope)))
        assert switches(run) == pytest.approx([rests], abs=1e-6)
        if stays:
            pushed = run.contact("slope", np.array([0.1, 0.45])).force @ along(degrees)
            rubs, holds = MU * MASS * G * math.cos(slope), -MASS * G * math.sin(slope)
            assert pushed == pytest.approx([rubs, holds], rel=1e-5)

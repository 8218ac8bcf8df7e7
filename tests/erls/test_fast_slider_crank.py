"""The fast slider-crank: bodies per rod against known figures, what a run says of its error."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import scenes

import erls
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun

SCENE = scenes.ROOT / "data/slider_crank/fast.toml"
REFERENCE = np.loadtxt(scenes.ROOT / "tests/data/fast_slider_crank.csv", delimiter=",")
PERIOD = 0.01 + 4 * np.pi / 150
TIMES = REFERENCE[:, 0] * PERIOD / 8
ONE_BODY = ("simulation.effects=linear", "simulation.step=4e-4")
PIECES = {n: (f"links.rod.substructures={n}", "simulation.effects=linear") for n in (4, 5)}


@cache
def run(*overrides: str) -> ChainRun:
    return erls.simulate(erls.load_scene(SCENE, overrides), verdict=False)


def errors(pin: Array, middle: Array, slider: Array) -> tuple[Array, Array]:
    """Of the slider's place and of the deflection off the chord, at the times of the reference (k,)."""
    chord = slider - pin
    chord /= np.linalg.norm(chord, axis=1)[:, None]
    away = middle - pin
    deflection = chord[:, 0] * away[:, 2] - chord[:, 2] * away[:, 0]
    return slider[:, 0] - REFERENCE[:, 1], deflection - REFERENCE[:, 2]


def test_crank_follows_the_stated_motion() -> None:
    """phi = 150 t0 (7 x^5 - 14 x^6 + 10 x^7 - 2.5 x^8), then 150 (t - 0.01)."""
    t = np.array([0.0, 0.004, 0.013, 0.02, 0.05])
    x = np.minimum(t / 0.02, 1)
    ramp = 3.0 * (7 * x**5 - 14 * x**6 + 10 * x**7 - 2.5 * x**8)
    wanted = np.where(t < 0.02, ramp, 150 * (t - 0.01))
    np.testing.assert_allclose(run().joint_angle("crank_pivot", t), wanted, atol=1e-12)


@pytest.mark.parametrize(
    ("overrides", "low", "high"),
    [
        (ONE_BODY, 9e-3, 13e-3),  # known: 11 mm
        ((*PIECES[4], "simulation.step=4e-4"), 4e-5, 2.5e-4),  # known: 0.25 mm over the whole motion
        (PIECES[5], 0.0, 1.5e-4),  # known: 0.16 mm over the whole motion
        ((), 0.0, 1e-4),  # stiffened, as shipped; wanted: 0.2 mm
    ],
    ids=["one body", "four", "five", "as shipped"],
)
def test_distance_from_exact_beams(overrides: tuple[str, ...], low: float, high: float) -> None:
    """Bodies per rod, or geometric stiffening, against the nonlinear beam at the four times of the reference."""
    found = errors(*(run(*overrides).position(point, TIMES) for point in ("pin", "middle", "slider")))
    assert low <= np.abs(found).max() <= high


def test_one_linear_body_is_known_to_be_wrong() -> None:
    """The run says by how much (11 mm, within a factor of 5) and what to do; pieces do not warn."""
    said = [w for w in run(*ONE_BODY).warnings if "linear in its own frame" in w]
    assert len(said) == 1
    assert all(word in said[0] for word in ("'rod'", "geometric_stiffening", "substructures", "nodal"))
    estimate = float(said[0].split("about ")[1].split(" m")[0])
    assert 11e-3 / 5 < estimate < 11e-3 * 5
    assert not run(*PIECES[5]).warnings
    assert not run().warnings

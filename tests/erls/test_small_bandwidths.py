"""A bandwidth below all modes: whatever it is, the same modes follow statically, and the same motion is found."""

from __future__ import annotations

import numpy as np
import pytest
import scenes

import erls
from erls.run.chain.run import ChainRun

FLAT = scenes.ROOT / "data/l_shape/steel_flat.toml"


def swung(bandwidth: float, *changes: str) -> ChainRun:
    settings = ["simulation.duration=0.2", f"simulation.bandwidth={bandwidth!r}", *changes]
    return erls.simulate(erls.load_scene(FLAT, settings), verdict=False)


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_the_motion_does_not_depend_on_it(formulation: str) -> None:
    """Nor does the drift of its energy, or what is told of it; only modes that vibrate change it."""
    changes = [f"simulation.formulation={formulation}", "links.l.elastic_modes=6"]
    first, *others = (swung(bandwidth, *changes) for bandwidth in (5.0, 1e-3, 1e-9, 1e-300))
    times = np.linspace(0, 0.2, 5)
    for run in others:
        np.testing.assert_array_equal(run.position("tip", times), first.position("tip", times))
        assert run.summary()["energy"] == first.summary()["energy"]
        told = [[text.split(" Hz, ")[1:] for text in x.warnings] for x in (run, first)]
        assert told[0] == told[1]
    assert first.summary()["energy"]["max_drift"] < 1e-4
    assert np.abs(swung(100.0, *changes).position("tip", times) - first.position("tip", times)).max() > 1e-7


def test_differences_stay_within_a_short_run() -> None:
    """In 1e-4 s, much less than the slowest static period, the deflected link falls by 5e-8 m."""
    settings = ["simulation.duration=1e-4", "simulation.bandwidth=1e-6"]
    run = erls.simulate(erls.load_scene(FLAT, settings), verdict=False)
    first, last = run.joint_angle("shoulder", [0.0, 1e-4])
    whole = erls.simulate(erls.load_scene(FLAT, [settings[0], "links.l.flexible=false"]), verdict=False).joint_angle(
        "shoulder", 1e-4
    )
    assert last - first == pytest.approx(float(whole), rel=0.02)

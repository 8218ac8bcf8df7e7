"""Many variants of one scene: the same runs as one by one, faults and interrupts kept apart."""

from __future__ import annotations

import os
import pickle
import signal
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.errors import Cause, SceneError
from erls.run.bodies.run import BodyRun
from erls.run.chain.run import ChainRun
from erls.simulation.asked import Asked
from erls.simulation.packed_run import PackedBodies, packed, unpacked_bodies
from erls.simulation.simulate import run_as_asked
from fe_import.errors import ReportedError

TALL = scenes.ROOT / "data/l_shape/steel_tall.toml"
ROBOT = scenes.ROOT / "data/robot/two_link.toml"


def test_variants_are_the_runs_one_by_one() -> None:
    """Parameters, initial states, modes and formulations; to the bit, whatever they share."""
    short = "simulation.duration=0.02"
    variants = [
        [short],
        [short, "joints.0.initial.position_deg=30"],
        [short, "links.l.elastic_modes=6"],
        [short, "simulation.formulation=ffr", "gravity=[0.0, 0.0, -1.6]"],
        [short, "simulation.integrator=lobatto"],
    ]
    runs = erls.simulate_many(TALL, variants)
    for run, overrides in zip(runs, variants, strict=True):
        assert isinstance(run, ChainRun)
        alone = erls.simulate(erls.load_scene(TALL, overrides))
        np.testing.assert_array_equal(run.solution.y, alone.solution.y)
        assert run.warnings == alone.warnings
    assert runs[1].formulation.mechanism.links[0].model is runs[0].formulation.mechanism.links[0].model  # type: ignore[union-attr]


def test_a_variant_without_an_effect_leaves_the_links_of_others_alone() -> None:
    """Without flexibility a link has no modes; the next variant, whose links are told the same, has them again."""
    short = "simulation.duration=0.002"
    runs = erls.simulate_many(TALL, [[short, 'simulation.effects=["gravity"]'], [short], [short]], workers=1)
    modes = [run.formulation.mechanism.links[0].elastic_modes for run in runs]  # type: ignore[union-attr]
    assert modes == [0, 18, 18]
    np.testing.assert_array_equal(runs[2].solution.y, runs[1].solution.y)  # type: ignore[union-attr]


def test_links_that_are_the_same_are_shared_and_others_are_not() -> None:
    """Gravity leaves a link what it is, a payload does not; numbers are those without sharing, to the bit."""
    common = ["simulation.duration=0.02", 'payloads=[{point="tip", mass=0.1}]']
    changes = [[], ["gravity=[0.0, 0.0, -5.0]"], ["payloads.0.mass=0.2"]]
    runs = erls.simulate_many(TALL, [common + change for change in changes], workers=1)
    first, *others = (run.formulation.mechanism.links[0] for run in runs)  # type: ignore[union-attr]
    assert [other is first for other in others] == [True, False]
    for run, change in zip(runs, changes, strict=True):
        alone = erls.simulate(erls.load_scene(TALL, common + change), verdict=False)
        np.testing.assert_array_equal(run.solution.y, alone.solution.y)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("scene", "variants"),
    [
        ("heavy_top/fast.toml", [["simulation.duration=0.004"], ["simulation.duration=0.004", "gravity=[0, 0, 0]"]]),
        ("statics/roll_up.toml", [["beams.strip.elements=3"], ["beams.strip.elements=0"], ["beams.strip.elements=4"]]),
    ],
)
def test_scenes_of_bodies_have_variants_too(scene: str, variants: list[list[str]]) -> None:
    """Motions and equilibria; also as they come from another process, without equations and with all answers."""
    path = scenes.ROOT / "data" / scene
    for run, overrides in zip(erls.simulate_many(path, variants), variants, strict=True):
        if "beams.strip.elements=0" in overrides:
            assert isinstance(run, ReportedError)
            assert run.cause == Cause.BAD_FIELD
            continue
        assert isinstance(run, BodyRun)
        alone = {**erls.simulate(erls.load_scene(path, overrides)).summary(), "wall_s": run.wall_s}
        assert run.summary() == alone
        sent = pickle.loads(pickle.dumps(packed(run)))
        assert isinstance(sent, PackedBodies)
        assert unpacked_bodies(sent).summary() == alone


def test_a_faulty_variant_spoils_no_other() -> None:
    seen: list[tuple[float, float]] = []
    variants = [["simulation.duration=x"], ["simulation.duration=0.01"], ["links.l.elastic_modes=999"]]
    results = erls.simulate_many(TALL, variants, progress=lambda done, total: seen.append((done, total)))
    assert [getattr(r, "cause", None) for r in results] == [Cause.BAD_FIELD, None, Cause.BAD_FIELD]
    assert seen[-1] == (3, 3)
    assert erls.simulate_many(TALL, []) == []
    with pytest.raises(SceneError, match="workers"):
        erls.simulate_many(TALL, variants, workers=0)


def test_an_interrupt_keeps_what_was_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C during a long run: the short one is there, the long one says where it stopped, the next has none."""

    def interrupted(scene: Any, asked: Asked) -> Any:
        def look(t: float, duration: float) -> None:
            assert asked.progress is not None
            asked.progress(t, duration)
            if t > 0.01:
                os.kill(os.getpid(), signal.SIGINT)

        return run_as_asked(scene, replace(asked, progress=look))

    monkeypatch.setattr("erls.simulation.variants.run_as_asked", interrupted)
    long = ["simulation.duration=10", "simulation.step=1e-3"]
    results = erls.simulate_many(ROBOT, [["simulation.duration=0.01"], long, long], workers=1)
    assert isinstance(results[0], ChainRun)
    assert [stopped.cause for stopped in results[1:]] == [Cause.INTERRUPTED] * 2  # type: ignore[union-attr]
    assert 0 < results[1].run.end < 10  # type: ignore[union-attr]
    assert results[2].run is None  # type: ignore[union-attr]

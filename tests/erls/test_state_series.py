"""States at many times at once are those of every single time, whichever way a formulation finds them."""

from __future__ import annotations

from pathlib import Path

import chain_cases
import numpy as np
import pytest
import scenes

import erls
from erls.equations.erls.formulation import Erls
from erls.equations.formulation import Formulation, State
from erls.equations.registry import formulate
from erls.equations.serial.state_series import accelerations, state_series
from erls.errors import Cause, SimulationError
from erls.scene.build import build_mechanism
from erls.scene.read import load_scene

TIMES = np.array([0.0, 0.03, 0.11, 0.4])


def _close(found: list[State], expected: list[State]) -> None:
    """To rounding, relative to 1 rad and 1 m."""
    for a, b in zip(found, expected, strict=True):
        assert a.time == b.time
        assert (a.nodes is None) == (b.nodes is None)
        for name in ("poses", "modal", "nodes"):
            for one, other in zip(getattr(a, name) or [], getattr(b, name) or [], strict=True):
                np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-13)
        for name in ("coordinates", "angles", "rates"):
            np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=1e-12, atol=1e-13)


def _compare(formulation: Formulation) -> None:
    random = np.random.default_rng(5)
    y, v = random.normal(size=(2, len(TIMES), formulation.size)) * 0.1
    one_by_one = [formulation.state(*at) for at in zip(TIMES.tolist(), y, v, strict=True)]
    _close(state_series(formulation, TIMES, y, v).states(), one_by_one)


@pytest.mark.parametrize("name", [n for n in chain_cases.CASES if not n.startswith(("without", "only"))])
def test_chains(tmp_path: Path, name: str) -> None:
    """Revolute and prismatic joints, prescribed motions, up to five links."""
    chain = chain_cases.equations(tmp_path, name)
    assert chain.series(TIMES, *np.zeros((2, len(TIMES), chain.size))) is not None
    _compare(chain)


@pytest.mark.parametrize(
    ("scene", "overrides"),
    [
        ("l_shape/steel_tall.toml", ["simulation.gauge=minimum-norm"]),
        ("l_shape/steel_tall.toml", ["simulation.formulation=ffr", "links.l.substructures=2"]),
        ("robot/two_link.toml", ["effects=all"]),
        ("four_bar/flexible.toml", []),
    ],
)
def test_what_goes_one_by_one(scene: str, overrides: list[str]) -> None:
    """The minimum-norm gauge, nodes of split links, second-order compatibility and loops."""
    run = erls.simulate(
        erls.load_scene(scenes.ROOT / "data" / scene, [*overrides, "simulation.duration=0.004"]), verdict=False
    )
    times = np.array([0.0, 0.001, 0.004])
    _, flat, y, v = run._interpolated(times)
    _close(run.states(times), [run.formulation.state(*at) for at in zip(flat.tolist(), y, v, strict=True)])
    assert run.states([]) == []


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_accelerations_at_many_times_are_those_at_each(formulation: str, tmp_path: Path) -> None:
    """To rounding; where a mass matrix is not positive, the message of that time."""
    path = scenes.three_links(tmp_path, "mixed")
    scene = load_scene(path, [f"simulation.formulation={formulation}"])
    system = formulate(build_mechanism(scene).mechanism, scene.record.simulation)
    rng = np.random.default_rng(3)
    t, y, v = np.linspace(0.0, 0.1, 7), *rng.uniform(-0.01, 0.01, (2, 7, system.size))
    found = accelerations(system, t, y, v)
    expected = np.array([system.acceleration(*at) for at in zip(t.tolist(), y, v, strict=True)])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_what_nothing_resists_is_named_among_many(tmp_path: Path) -> None:
    """A massless link that turns freely: the message of the first such time."""
    data = {
        "simulation": {"duration": 1.0},
        "joints": [{"name": "j", "dh": {"convention": "standard"}}],
        "links": [{"name": "light", "rigid": {"mass": 0.0, "points": {"start": [0, 0, 0], "end": [1, 0, 0]}}}],
    }
    system = Erls(scenes.mechanism(scenes.write_toml(tmp_path / "light.toml", data)))
    with pytest.raises(SimulationError) as caught:
        accelerations(system, np.array([0.5, 0.6]), *np.zeros((2, 2, 1)))
    assert caught.value.cause is Cause.SINGULAR_MASS
    assert "0.5" in caught.value.where

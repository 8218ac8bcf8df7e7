"""States at many times at once are those of every single time, whichever way a formulation finds them."""

from __future__ import annotations

from pathlib import Path

import chain_cases
import numpy as np
import pytest
import scenes

import erls
from erls.equations.formulation import Formulation, State
from erls.equations.serial.state_series import state_series

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
    run = erls.simulate(erls.load_scene(scenes.ROOT / "data" / scene, [*overrides, "simulation.duration=0.004"]))
    times = np.array([0.0, 0.001, 0.004])
    _, flat, y, v = run._interpolated(times)
    _close(run.states(times), [run.formulation.state(*at) for at in zip(flat.tolist(), y, v, strict=True)])
    assert run.states([]) == []

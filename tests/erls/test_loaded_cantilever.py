"""A cantilever under loads: closed forms at rest, Beck's load for flutter, what linear links say of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from benchmarks.follower_flutter import BECK, BENDING, CASES, SCENE, flutters, growth, linearized
from erls.equations.nodal.equations import Nodal
from erls.equations.registry import formulate
from erls.run.chain.places import point_position
from erls.scene.build import build_mechanism
from erls.scene.read import load_scene

AXIAL = 7e10 * 0.02 * 0.01  # N, E A
STILL = "loads.1.force=[0.0, 0.0, 1e-9]"  # no push from the side


def _equations(*changes: str) -> Any:
    scene = load_scene(SCENE, changes)
    return formulate(build_mechanism(scene).mechanism, scene.record.simulation)


@pytest.mark.parametrize("more", [*CASES.values(), ("simulation.gauge=minimum-norm",), ("simulation.bandwidth=3",)])
def test_cantilever_against_closed_forms(more: tuple[str, ...]) -> None:
    """F L³/(3 E I) and M L²/(2 E I) at the tip; what the clamp gives is in balance.

    Second order in a slope of 1e-3 is 1e-6 of them; the equilibrium of nodes is found to as much of the load. Elements
    of constant strain bend the less under a force by 1/(4 n²): the moment between the ends of each is its mean. Their
    places are known to rounding, which n elements feel n times, some ten of them at the clamp.
    """
    load, elements = BENDING / 1000, 24
    for what, deflection, moment in (("force", load / (3 * BENDING), load), ("moment", -load / (2 * BENDING), -load)):
        along = [0.0, 0.0, load] if what == "force" else [0.0, load, 0.0]
        dead = ["loads.0.follower=false", "loads.0.force=[0.0, 0.0, 0.0]", f"loads.0.{what}={along}", STILL]
        equations = _equations(*dead, *more)
        y, v = equations.initial_state()
        tip = point_position(equations.mechanism, equations.state(0.0, y, v), 0)
        softer = 1 - (what == "force" and isinstance(equations, Nodal)) / (4 * elements**2)
        assert tip[2] == pytest.approx(deflection * softer, rel=2e-6)
        held = equations.reactions(0.0, y, v)[0]
        rounding = 10 * elements * np.finfo(float).eps * AXIAL * isinstance(equations, Nodal)
        assert held.force == pytest.approx([0.0, 0.0, -load * (what == "force")], abs=2e-6 * load + rounding)
        assert held.moment == pytest.approx([0.0, moment, 0.0], abs=2e-6 * load)


@pytest.mark.parametrize("more", CASES.values())
@pytest.mark.parametrize("axes", ["world", "link"])
def test_force_per_length_against_closed_form(tmp_path: Path, more: tuple[str, ...], axes: str) -> None:
    """q L⁴/(8 E I) at the tip of a cantilever, whose clamp bears q L and q L²/2.

    Consistent loads bend cubic elements as the force does; elements of constant strain, n = 24 of them, the less by
    1/(3 n²), second order in a slope of 1e-3 aside.
    """
    load = BENDING / 1000
    table = scenes.read_toml(SCENE)
    table["loads"] = [{"link": "column", "force_per_length": [0.0, 0.0, load], "axes": axes}]
    table["links"][0]["model"] = str(SCENE.parent / "links/column.toml")
    scene = load_scene(scenes.write_toml(tmp_path / "scene.toml", table), more)
    equations = formulate(build_mechanism(scene).mechanism, scene.record.simulation)
    y, v = equations.initial_state()
    tip = point_position(equations.mechanism, equations.state(0.0, y, v), 0)
    softer = 1 - isinstance(equations, Nodal) / (3 * 24**2)
    assert tip[2] == pytest.approx(load / (8 * BENDING) * softer, rel=2e-6)
    held = equations.reactions(0.0, y, v)[0]
    assert held.force == pytest.approx([0.0, 0.0, -load], abs=2e-6 * load)
    assert held.moment == pytest.approx([0.0, load / 2, 0.0], abs=2e-6 * load)


@pytest.mark.parametrize("name", CASES)
def test_follower_force_flutters_a_cantilever_at_becks_load(name: str) -> None:
    """Roots are imaginary 1 % below 20.05 E I / L² and no longer so 1 % above: the load of the nodal mesh is 0.5 %
    high, that of eight modes 0.01 % (``benchmarks/follower_flutter.py``, which confirms it in time for all three).
    """
    assert not flutters(linearized(0.99 * BECK, *CASES[name]))
    assert flutters(linearized(1.01 * BECK, *CASES[name]))


def test_flutter_in_time() -> None:
    """A push of 10 µN dies no more than it grows below Beck's load, and grows a thousandfold above it in a quarter of a
    second, as its roots 45.5 ± 159.6i say: exp(45.5 · 0.15) = 900 between fifths of the run.
    """
    below, above = (growth(share * BECK) for share in (0.9, 1.1))
    assert 0.5 < below < 2
    assert above == pytest.approx(np.exp(45.5 * 0.15), rel=0.5)


def test_links_without_stiffening_say_what_a_load_along_them_does() -> None:
    """A follower at 0.9 of Beck's load on linear links: 1.2 mm at the tip, which the statement covers, by less than ten
    times. The energy of the compression, ten thousand times that of bending, says nothing of what it softens.
    """
    short, linear = "simulation.duration=0.25", "simulation.effects=linear"
    whole, lesser = (erls.simulate(load_scene(SCENE, changes)) for changes in ([short], [short, linear]))
    times = np.linspace(0.0, 0.25, 251)
    off = np.linalg.norm(whole.position("tip", times) - lesser.position("tip", times), axis=1).max()
    assert off > 1e-3
    assert off < lesser.accuracy.total < 10 * off
    assert lesser.trust.verdict == "limited"

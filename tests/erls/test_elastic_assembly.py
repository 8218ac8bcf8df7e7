"""Loops that undeformed links leave open, closed by bending them: beams against the theory of Euler and Bernoulli."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import loop_scenes
import numpy as np
import pytest
import scenes

from erls.errors import Cause, SceneError, SimulationError

LENGTH, WIDTH, HEIGHT, MODULUS = 0.5, 0.01, 0.02, 7e10
GAP = 1e-3
ELASTIC = {"assemble": "elastic"}


def beam(folder: Path, **more: Any) -> dict[str, Any]:
    """A cantilever along x in a fixed joint; its end is held on a line along x that lies ``GAP`` above it."""
    link = {
        "materials": {"m": {"youngs_modulus": MODULUS, "poissons_ratio": 0.33, "density": 2700.0}},
        "sections": {"s": {"shape": "rectangular", "width": WIDTH, "height": HEIGHT}},
        "frame": {
            "theory": "euler-bernoulli",
            "nodes": {"root": [0.0, 0.0, 0.0], "tip": [LENGTH, 0.0, 0.0]},
            "members": [{"from": "root", "to": "tip", "elements": 4, "material": "m", "section": "s"}],
        },
        "interfaces": [{"name": "root", "node": "root"}, {"name": "tip", "node": "tip"}],
        "reduction": {"fixed_interface_modes": 2},
    }
    scenes.write_toml(folder / "beam.toml", link)
    joint = {"name": "root", "type": "fixed", "dh": {"convention": "standard", "a": LENGTH}}
    line = {"name": "slot", "type": "line", "link": "beam", "node": "tip", "axis": [1.0, 0.0, 0.0]}
    return {
        "simulation": {"duration": 0.01, "step": 1e-4},
        "gravity": [0.0, 0.0, 0.0],
        "joints": [joint],
        "links": [{"name": "beam", "model": "beam.toml", "mesh_pose": {"frame": "joint"}}],
        "points": [{"name": "tip", "link": "beam", "node": "tip"}],
        "loops": [{**line, "position": [LENGTH, 0.0, GAP]}],
        **more,
    }


@pytest.mark.parametrize("name", ["erls", "ffr"])
def test_force_of_a_beam_that_is_bent_into_place(tmp_path: Path, name: str) -> None:
    """3 E I δ / L³, and half of its product with δ; what is left is of second order, (δ/L)². The beam stays there, and
    the summary says how far it was off.
    """
    run = loop_scenes.run(tmp_path, beam(tmp_path, initial=ELASTIC), name)
    force = 3 * MODULUS * WIDTH * HEIGHT**3 / 12 * GAP / LENGTH**3
    assert float(run.loop_reaction("slot", 0.0)[0][2]) == pytest.approx(force, rel=(GAP / LENGTH) ** 2)
    assert float(run.energy(0.0).elastic) == pytest.approx(force * GAP / 2, rel=(GAP / LENGTH) ** 2)
    t = np.linspace(0.0, 0.01, 5)
    np.testing.assert_allclose(run.position("tip", t)[:, 2], GAP, atol=1e-12)
    (told,) = (text for text in run.summary()["warnings"] if "prestressed" in text)
    assert "undeformed links leave 0.001 m open" in told
    assert f"up to {force:.4g} N in a closing joint" in told


@pytest.mark.parametrize("name", ["erls", "ffr"])
def test_a_linkage_out_of_its_plane(tmp_path: Path, name: str) -> None:
    """The pivot of a flexible four-bar lies 1 mm beside its plane: it starts closed, in equilibrium, and moves on."""
    beam(tmp_path)
    four_bar = loop_scenes.four_bar(initial=ELASTIC)
    for record, length in zip(four_bar["links"], loop_scenes.LENGTHS, strict=True):
        if record["name"] != "crank":
            record.pop("rigid")
            record["model"] = f"{record['name']}.toml"
            link = (tmp_path / "beam.toml").read_text(encoding="utf-8").replace(f"[{LENGTH}, ", f"[{length}, ")
            (tmp_path / record["model"]).write_text(link, encoding="utf-8")
    four_bar["points"] = [p for p in four_bar["points"] if p["node"] != "middle"]
    four_bar["loops"][0]["position"][1] = GAP
    chain = loop_scenes.chain(tmp_path, four_bar, name)
    y, v = chain.initial_state()
    assert np.abs(chain.openings(chain.closure(0.0, y, v))).max() < 1e-8 * chain.reach
    assert any("undeformed links leave" in text for text in chain.warnings)
    run = loop_scenes.run(tmp_path, four_bar, name, duration=0.02)
    np.testing.assert_allclose(run.position("rocker tip", [0.0, 0.02])[:, 1], GAP, atol=1e-8)


def test_what_elastic_assembly_refuses(tmp_path: Path) -> None:
    """Rigid links, directions in which no mode gives way, and scenes in which it says nothing."""
    with pytest.raises(SimulationError, match="stays open") as caught:
        loop_scenes.chain(tmp_path, beam(tmp_path)).initial_state()
    assert caught.value.cause == Cause.LOOP_OPEN
    rigid = loop_scenes.four_bar(initial=ELASTIC)
    rigid["loops"][0]["position"][1] = GAP
    with pytest.raises(SimulationError, match="stays open") as caught:
        loop_scenes.chain(tmp_path, rigid).initial_state()
    assert "needs flexible links" in str(caught.value.remedy)
    stiff = beam(tmp_path, initial=ELASTIC)
    stiff["loops"] = [{"name": "slot", "type": "spherical", "link": "beam", "node": "tip"}]
    stiff["loops"][0]["position"] = [LENGTH + GAP, 0.0, 0.0]
    stiff["links"][0]["elastic_modes"] = 2
    with pytest.raises(SimulationError, match="no link gives way: loop 'slot', translation along x") as caught:
        loop_scenes.chain(tmp_path, stiff).initial_state()
    assert caught.value.cause == Cause.LOOP_OPEN
    far = beam(tmp_path, initial=ELASTIC)
    far["loops"][0]["position"][2] = 0.6 * LENGTH
    with pytest.raises(SimulationError, match=r"which undeformed links leave 0\.3 m open") as caught:
        loop_scenes.run(tmp_path, far)
    assert caught.value.cause == Cause.NO_EQUILIBRIUM
    for name, changes in {"erls": {"loops": []}, "nodal": {}}.items():
        with pytest.raises(SceneError, match="assemble") as faulty:
            loop_scenes.run(tmp_path, {**beam(tmp_path, initial=ELASTIC), **changes}, name)
        assert faulty.value.cause == Cause.BAD_FIELD

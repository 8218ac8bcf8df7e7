"""What a run says of its own error against the distance that is known, and when it says nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scenes

import erls
from erls.run.watches.assumed_bow import assumed_second_order
from erls.run.watches.deflection_estimate import LinkMotion, deflection_error
from erls.run.watches.deflection_range import deflection_errors, deflection_warnings

DATA = scenes.ROOT / "data"


@pytest.mark.parametrize(
    ("scene", "known"),
    [
        ("l_shape/steel_flat.toml", 3.2e-5),
        ("l_shape/steel_tall.toml", 1.5e-4),
        ("l_shape/aluminium.toml", 3.9e-4),
        ("l_shape/steel_soft.toml", 6.6e-4),
        ("robot/two_link.toml", 3.0e-4),
    ],
)
def test_estimate_against_known_errors(monkeypatch: pytest.MonkeyPatch, scene: str, known: float) -> None:
    """Distance of a converged modal model from exact beams (README): the estimate is right within a factor of 2.5, and
    none is worth a warning. Where the link knows no second order, it is the same within a factor of 1.6.
    """
    run = erls.simulate(erls.load_scene(DATA / scene, [scenes.LINEAR]))
    estimate = sum(found.error for found in deflection_errors(run).values())
    assert known / 2.5 < estimate < 2.5 * known
    assert not deflection_warnings(run)
    monkeypatch.setattr("erls.mechanism.links.link_second_order", lambda link: None)
    for link in run.formulation.mechanism.links:
        vars(link).pop("second_order")
    found = deflection_errors(run).values()
    assert all(one.assumed for one in found)
    assert estimate / 1.6 < sum(one.error for one in found) < 1.6 * estimate


def test_a_loaded_column_is_near_its_buckling_load(tmp_path: Path) -> None:
    """A pinned column in its first sine under half of Euler's load π²EI/L²: r = -1/2 within the modes' accuracy of 1 %,
    shear included; ½∫w'²dx = π² a² / 4L against its mean.
    """
    length, side = 1.0, 0.01
    section = {"shape": "rectangular", "width": side, "height": side}
    nodes = {"root": [0.0, 0.0, 0.0], "tip": [length, 0.0, 0.0]}
    member = {"from": "root", "to": "tip", "elements": 16, "material": "m", "section": "s"}
    frame = {"nodes": nodes, "members": [member]}
    reduction = {"fixed_interface_modes": 8}
    path = scenes.l_link(tmp_path)
    data = {**scenes.read_toml(path), "sections": {"s": section}, "reduction": reduction, "frame": frame}
    scenes.write_toml(path, data)
    run_scene = scenes.l_scene(tmp_path, points=[{"name": "tip", "link": "l", "node": "tip"}])
    link = scenes.mechanism(run_scene).links[0]
    model = link.model
    amplitude = 1e-3
    bent = amplitude * np.sin(np.pi * model.nodes[:, 0] / length)
    slope = amplitude * np.pi / length * np.cos(np.pi * model.nodes[:, 0] / length)
    rows = np.concatenate([model.translation_shapes[:, 2], model.rotation_shapes[:, 1]])
    q = np.linalg.lstsq(rows, np.concatenate([bent, -slope]), rcond=1e-10)[0]
    euler = np.pi**2 * 2e11 * side**4 / 12 / length**2
    force = np.zeros(12)
    force[6] = -euler / 2
    still = np.zeros((2, 3))
    bending, loads = np.tile(q, (2, 1)), np.tile(force, (2, 1))
    motion = LinkMotion(np.array([0.0, 1.0]), bending, 0 * bending, still, still, still, loads)
    found = deflection_error(link, motion, closed=True, reach=length)
    assert found is not None
    assert found.load == pytest.approx(0.5, rel=0.01)
    assert found.drift == 0.0  # nothing vibrates
    twice = deflection_error(link, replace(motion, loads=2 * loads), closed=True, reach=length)
    assert twice is not None
    assert twice.load == pytest.approx(2 * found.load)


def test_silent_where_nothing_is_left_out(tmp_path: Path) -> None:
    """With geometric stiffening."""
    scenes.l_link(tmp_path)
    stiffened = {"duration": 0.01, "step": 1e-3, "effects": "all,geometric_stiffening"}
    run = erls.simulate(scenes.l_scene(tmp_path, simulation=stiffened))
    assert deflection_errors(run) == {}


def test_links_without_second_order_bend_as_a_cubic(tmp_path: Path) -> None:
    """An end load on a cantilever: its tip comes nearer by 0.6 w²/L, by its own field and by the assumed one."""
    length = 1.0
    nodes = {"root": [0.0, 0.0, 0.0], "tip": [length, 0.0, 0.0]}
    member = {"from": "root", "to": "tip", "elements": 4, "material": "m", "section": "s"}
    frame = {"nodes": nodes, "members": [member], "theory": "euler-bernoulli"}
    path = scenes.l_link(tmp_path)
    scenes.write_toml(path, {**scenes.read_toml(path), "frame": frame})
    link = scenes.mechanism(scenes.l_scene(tmp_path, points=[{"name": "tip", "link": "l", "node": "tip"}])).links[0]
    model = link.model
    x = model.nodes[:, 0] / length
    rows = np.concatenate([*model.translation_shapes.transpose(1, 0, 2), *model.rotation_shapes.transpose(1, 0, 2)])
    bent, none = 0.01 * (3 * x**2 - x**3) / 2, np.zeros(len(x))
    slope = 0.01 * (6 * x - 3 * x**2) / 2 / length
    q = np.linalg.lstsq(rows, np.concatenate([none, bent, none, none, none, slope]), rcond=1e-10)[0]
    tip = model.interface("tip")
    assumed = assumed_second_order(link)
    assert tip is not None
    assert link.second_order is not None
    assert assumed is not None
    for found in (link.second_order, assumed):
        moved = found.displacements(np.array([tip.node]), q)
        np.testing.assert_allclose(moved[0], [-0.6 * 0.01**2 / length, 0.0, 0.0], rtol=1e-6, atol=1e-12)


def test_a_link_that_knows_no_second_order_is_told_of(tmp_path: Path) -> None:
    """A soft ring: the estimate is there, the warning says that it is assumed and why; stiffening changes nothing."""
    pairs = (("root", "elbow"), ("elbow", "tip"), ("root", "tip"))
    members = [{"from": a, "to": b, "elements": 2, "material": "m", "section": "s"} for a, b in pairs]
    path = scenes.l_link(tmp_path)
    data = scenes.merged(scenes.read_toml(path), {"frame": {"members": members}})
    data["materials"]["m"]["youngs_modulus"] = 5e7
    scenes.write_toml(path, data)
    told = []
    for effects in ("all", "all,geometric_stiffening"):
        scene = scenes.l_scene(tmp_path, simulation={"duration": 0.1, "step": 1e-3, "effects": effects})
        run = erls.simulate(scene)
        assert deflection_errors(run)["l"].assumed
        told.append(deflection_warnings(run))
    assert len(told[0]) == 1
    assert "second-order displacements are not available: members form a ring" in told[0][0]
    assert told[1] == told[0]

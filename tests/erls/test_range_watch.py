"""What a run says of its own error against the distance that is known, and when it says nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scenes

import erls
from erls.formulations.deflection_watch import LinkMotion, deflection_error
from erls.range_watch import deflection_errors, deflection_warnings

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
def test_estimate_against_known_errors(scene: str, known: float) -> None:
    """Distance of a converged modal model from exact beams (README): the estimate is right within a factor of 2.5, and
    none is worth a warning.
    """
    run = erls.simulate(DATA / scene)
    estimate = sum(found.error for found in deflection_errors(run).values())
    assert known / 2.5 < estimate < 2.5 * known
    assert not deflection_warnings(run)


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

"""Modes of equal frequency stay together in every count, and a count that this changes is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit

from fe_import import load_link, reduce_link
from fe_import.modal.equal_frequencies import KEPT_WHOLE, whole_count

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("frequencies", "wanted", "kept"),
    [
        ([1.0, 1.0, 2.0, 3.0], 1, 2),
        ([1.0, 1.0, 2.0, 3.0], 2, 2),
        ([1.0, 1.0, 2.0, 3.0], 3, 3),
        ([1.0, 1.0, 2.0, 3.0], 0, 0),
        ([1.0, 1.00005, 1.00009, 3.0], 1, 3),
        ([1.0, 2.0, 2.0], 2, 3),
        ([1.0, 2.0, 2.0], 3, 3),
        # as dense as that all along: the widest gap among the next
        ([1 + 1e-5 * k + 5e-5 * (k > 4) for k in range(30)], 3, 5),
    ],
)
def test_counts_that_part_no_group(frequencies: list[float], wanted: int, kept: int) -> None:
    """As many as asked for, or up to the end of the group."""
    assert whole_count(np.array(frequencies), wanted) == kept


def _square(folder: Path, height: float, **reduction: Any) -> Path:
    """A straight link with a section of 10 mm by ``height``, its bending modes in pairs where they are equal."""
    text = (ROOT / "data/robot/links/arm.toml").read_text(encoding="utf-8")
    data = tomlkit.parse(text).unwrap()
    data["sections"]["bar"]["height"] = height
    data["frame"]["members"][0]["elements"] = 6
    data["reduction"] = {"method": "craig-bampton", **reduction}
    path = folder / "square.toml"
    path.write_text(tomlkit.dumps(data), encoding="utf-8")
    return path


CUTS = [
    {"fixed_interface_modes": 3},
    {"fixed_interface_modes": 6, "elastic_modes": 3},
    {"fixed_interface_modes": 6, "elastic_modes": 1},
    {"fixed_interface_modes": 6, "elastic_modes": 1, "truncation": "clamped"},
    {"fixed_interface_modes": 6, "elastic_modes": 13, "static_correction": True},
    {"method": "mode-displacement", "free_modes": 5},
    {"method": "craig-chang", "free_modes": 3, "elastic_modes": 7},
]


@pytest.mark.parametrize("reduction", CUTS)
def test_a_millionth_of_the_section_moves_no_plane(tmp_path: Path, reduction: dict[str, Any]) -> None:
    """The static answer of the tip to forces across the link, in any direction: as even as without a cut, and as little
    moved by a change of the section, within ten times what moves it with all modes.
    """

    def flexibility(height: float, **cut: Any) -> np.ndarray:
        """(2, 2) across the link, inertia-relieved."""
        model = reduce_link(load_link(_square(tmp_path, height, **cut)))
        tip = model.interface("tip")
        assert tip is not None
        shape = model.node_shape(tip.node)[0][1:, 6:]
        return np.asarray(shape / np.diag(model.stiffness)[6:] @ shape.T)

    whole = {k: v for k, v in reduction.items() if k == "method"}
    if whole.get("method", "craig-bampton") != "craig-bampton":
        whole["free_modes"] = 20
    moved = np.abs(flexibility(0.010 * (1 + 1e-6), **whole) - flexibility(0.01, **whole)).max()
    cut = [flexibility(height, **reduction) for height in (0.01, 0.01 * (1 + 1e-6))]
    assert np.abs(cut[1] - cut[0]).max() <= 10 * moved
    assert np.ptp(np.linalg.eigvalsh(cut[0])) <= 1e-5 * np.trace(cut[0])


@pytest.mark.parametrize("reduction", CUTS)
def test_a_changed_count_is_told(tmp_path: Path, reduction: dict[str, Any]) -> None:
    """In the modal model's provenance and while it is reduced, with field, wish and what is kept."""
    told: list[str] = []
    model = reduce_link(load_link(_square(tmp_path, 0.01, **reduction)), tell=told.append)
    assert "would part modes of equal frequency" in model.provenance[KEPT_WHOLE]
    assert model.provenance[KEPT_WHOLE].split("; ")[-1] in told
    alone = reduce_link(load_link(_square(tmp_path, 0.017, method="craig-bampton", fixed_interface_modes=3)))
    assert KEPT_WHOLE not in alone.provenance

"""Motion of the frames that loops hold: the compiled functions against the dense equations of the paper."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import loop_cases
import numpy as np
import pytest
import stiffened_cases

from erls.equations.erls.formulation import Erls
from erls.equations.erls.paper.dense_chain import DenseChain
from erls.equations.ffr.formulation import Ffr

CASES = ("driven turn", "driven slide", "line to another link", "two loops")
BENT = ("revolute", "driven slide", "planar to another link")


@pytest.mark.parametrize("name", BENT)
def test_frames_of_anchored_links_are_those_of_floating_frames(name: str, tmp_path: Path) -> None:
    """Second-order displacements included; nodes are turned by Cayley's rotation here and by exp there, which part in
    third order: an eighth for half of the deflection, or less.
    """
    mechanism = replace(loop_cases.mechanism(tmp_path, name), effects=stiffened_cases.STIFFENED)
    equations, floating = Erls(mechanism), Ffr(mechanism)
    rng = np.random.default_rng(5)
    y, v = rng.uniform(-1, 1, (2, equations.size))
    apart = []
    for size in (2e-2, 1e-2):
        at, rates = y.copy(), v.copy()
        at[len(equations.free_joints) :] *= size
        rates[len(equations.free_joints) :] *= size
        pairs = zip(equations.frames(0.03, at, rates), floating.frames(0.03, at, rates), strict=True)
        apart.append(max(np.abs(one.pose - other.pose).max() for one, other in pairs))
    assert np.log2(apart[0] / apart[1]) > 2.9


@pytest.mark.parametrize("name", CASES)
def test_frames_are_those_of_the_paper(name: str, tmp_path: Path) -> None:
    """Pose, twist, its derivative and rows; links bent and turning.

    To ten times the rounding of the dense form, which solves with C_r C_rᵀ: its condition is the square of 7e2.
    """
    mechanism = loop_cases.mechanism(tmp_path, name)
    equations, paper = Erls(mechanism), DenseChain(mechanism, "joint-angle")
    rng = np.random.default_rng(5)
    for t in (0.03, 0.35):
        y, v = rng.uniform(-1, 1, (2, equations.size))
        for values in (y, v):
            values[len(equations.free_joints) :] *= 1e-2
        pairs = zip(equations.frames(t, y, v), paper.frames(t, y, v), strict=True)
        limit = 10 * np.finfo(float).eps * np.linalg.cond(paper.elimination.c_r) ** 2
        assert limit < 2e-9
        for found, expected in pairs:
            for part in ("pose", "twist", "bias", "rows"):
                some, other = getattr(found, part), getattr(expected, part)
                np.testing.assert_allclose(some, other, rtol=0, atol=limit * max(1.0, np.abs(other).max()))

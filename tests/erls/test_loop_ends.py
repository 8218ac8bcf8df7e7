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
from erls.mechanism.chain import Mechanism

CASES = [(name, False) for name in ("driven turn", "driven slide", "line to another link", "two loops")]
BENT = [(name, True) for name in ("revolute", "driven slide", "planar to another link")]


def _mechanism(folder: Path, name: str, bends: bool) -> Mechanism:
    found = loop_cases.mechanism(folder, name)
    return replace(found, effects=stiffened_cases.STIFFENED) if bends else found


@pytest.mark.parametrize(("name", "bends"), CASES + BENT)
def test_frames_are_those_of_the_paper(name: str, bends: bool, tmp_path: Path) -> None:
    """Pose, twist, its derivative and rows; links bent and turning.

    To ten times the rounding of the dense form, which solves with C_r C_rᵀ: its condition is the square of 7e2.
    """
    mechanism = _mechanism(tmp_path, name, bends)
    equations, paper = Erls(mechanism), DenseChain(mechanism, "joint-angle")
    assert equations.stiffened == bends
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

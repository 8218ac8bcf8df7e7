"""Motion of the frames that loops hold: the compiled functions against the dense equations of the paper."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import loop_cases
import numpy as np
import pytest
import stiffened_cases

from erls.equations.erls.formulation import Erls
from erls.mechanism.chain import Mechanism
from erls.mechanism.loops import loop_ends

CASES = [(name, False) for name in ("driven turn", "driven slide", "line to another link", "two loops")]
BENT = [(name, True) for name in ("revolute", "driven slide", "planar to another link")]


def _mechanism(folder: Path, name: str, bends: bool) -> Mechanism:
    found = loop_cases.mechanism(folder, name)
    return replace(found, effects=stiffened_cases.STIFFENED) if bends else found


@pytest.mark.parametrize(("name", "bends"), CASES + BENT)
def test_frames_are_those_of_the_paper(name: str, bends: bool, tmp_path: Path) -> None:
    """Pose, twist, its derivative and rows, to rounding; links bent and turning."""
    equations = Erls(_mechanism(tmp_path, name, bends))
    assert equations.stiffened == bends
    system = equations.compiled
    assert system.frames is not None
    ends = [end for _, end in loop_ends(equations.mechanism.loops)]
    prescribed = [k for k, joint in enumerate(equations.mechanism.joints) if joint.drive.prescribed]
    n = equations.size + len(prescribed)
    rng = np.random.default_rng(5)
    for t in (0.03, 0.35):
        y, v = rng.uniform(-1, 1, (2, equations.size))
        for values in (y, v):
            values[len(equations.free_joints) :] *= 1e-2
        out = np.empty((len(ends), 24 + 6 * n))
        system.frames(system.reals, system.integers, system.scratch, t, y, v, out)
        for found, frame in zip(out, equations.frames(t, y, v, ends), strict=True):
            expected = [
                frame.pose[:3, :3].ravel(),
                frame.pose[:3, 3],
                frame.twist,
                frame.bias,
                frame.rows[:, [*equations.free, *prescribed]].ravel(),
            ]
            parts = np.split(found, [9, 12, 18, 24])
            for some, other in zip(parts, expected, strict=True):
                np.testing.assert_allclose(some, other, rtol=0, atol=1e-11 * max(1.0, np.abs(other).max()))

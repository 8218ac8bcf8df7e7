"""How far elements of shells are wound up."""

from __future__ import annotations

import numpy as np

from erls.equations.nodal.shell import Shells
from erls.maths.so3 import Array


def widest_turn(shells: Shells, poses: Array) -> tuple[float, int]:
    """How far the frames at two neighbouring corners of an element are turned against each other [rad], at most, and
    which element that is; half a turn is the most that its interpolation follows.
    """
    own = shells.frames.reshape(-1, 4, 12)[..., 3:].reshape(-1, 4, 3, 3)
    turns = poses[shells.corners][..., :3, :3] @ own
    between = np.swapaxes(turns, -1, -2) @ np.roll(turns, -1, axis=1)
    cosines = (np.trace(between, axis1=-2, axis2=-1) - 1) / 2
    angles = np.arccos(np.clip(cosines, -1, 1)).max(axis=1, initial=0.0)
    return (float(angles.max()), int(angles.argmax())) if len(angles) else (0.0, -1)

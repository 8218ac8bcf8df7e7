"""Joints as conditions on the pose of an outer frame relative to an inner one, D = (Q, p).

Every condition is linear in the entries of p and Q: c · p + ⟨C, Q⟩ = 0, written in the axes of the inner frame. A new
joint is one line of `CONDITIONS`.
"""

from __future__ import annotations

import numpy as np

from erls.maths.so3 import Array

Condition = tuple[str, Array, Array]  # name, c (3,), C (3, 3)


def _along(i: int) -> Condition:
    return f"no shift along {'xyz'[i]}", np.eye(3)[i], np.zeros((3, 3))


def _about(i: int) -> Condition:
    j, k = (i + 1) % 3, (i + 2) % 3
    entries = np.zeros((3, 3))
    entries[k, j], entries[j, k] = 0.5, -0.5
    return f"no turn about {'xyz'[i]}", np.zeros(3), entries


def _normal(name: str, i: int, j: int) -> Condition:
    """Axis i of the inner frame at a right angle to axis j of the outer one."""
    entries = np.zeros((3, 3))
    entries[i, j] = 1.0
    return name, np.zeros(3), entries


_PINNED = [_along(i) for i in range(3)]
_STRAIGHT = [_about(i) for i in range(3)]
_PARALLEL = [_normal("no tilt of x", 0, 2), _normal("no tilt of y", 1, 2)]

CONDITIONS: dict[str, list[Condition]] = {
    "fixed": _PINNED + _STRAIGHT,
    "revolute": _PINNED + _PARALLEL,
    "prismatic": _PINNED[:2] + _STRAIGHT,
    "cylindrical": _PINNED[:2] + _PARALLEL,
    "universal": [*_PINNED, _normal("axes at right angles", 0, 1)],
    "spherical": _PINNED,
}
"""What each joint forbids. The free axis of revolute, prismatic and cylindrical joints is z; the two axes of a
universal joint are the inner frame's x and the outer frame's y."""

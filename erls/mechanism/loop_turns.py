"""How far a closing joint has turned, counted in the joints of the tree between its links."""

from __future__ import annotations

import numpy as np

from erls.maths.se3 import inverse
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.loops import Loop

_PARALLEL = 1e-6


def turning_signs(mechanism: Mechanism, loop: Loop) -> tuple[Array, bool]:
    """How the outer frame of a loop turns against the inner one about its axis as rigid links move.

    Parameters
    ----------
    mechanism : Mechanism
    loop : Loop
        Its frames as they are at the initial joint coordinates.

    Returns
    -------
    signs : (joints,) array
        1 or -1 where the joint's axis is parallel to that of the loop and lies between its links, 0 elsewhere.
    all_of_it : bool
        Whether no other joint between them turns: the angle is then the sum of theirs.
    """
    frames = poses(mechanism, np.array([joint.position for joint in mechanism.joints]))
    outer, inner = (-1 if end.link is None else end.link for end in (loop.outer, loop.inner))
    axis = loop.inner.frame[:3, 2] if loop.inner.link is None else frames[inner][:3, :3] @ loop.inner.frame[:3, 2]
    signs, complete = np.zeros(len(mechanism.joints)), True
    for k in sorted(set(_below(mechanism, outer)) ^ set(_below(mechanism, inner))):
        joint = mechanism.joints[k]
        if not joint.freedom.turns:
            continue
        if joint.freedom.vector:
            complete = False
            continue
        along = float((frames[k] @ inverse(joint.after))[:3, joint.freedom.axis] @ axis)
        if abs(abs(along) - 1) < _PARALLEL:
            signs[k] = np.sign(along) * (1.0 if k in _below(mechanism, outer) else -1.0)
        else:
            complete = False
    return signs, complete


def _below(mechanism: Mechanism, number: int) -> list[int]:
    """A link and those that bear it, -1 being the ground."""
    found = []
    while number >= 0:
        found.append(number)
        number = mechanism.joints[number].parent
    return found

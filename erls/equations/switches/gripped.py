"""What friction holds by modes of its own (`erls.equations.switches.grips`) in systems in flat memory, trees and trees
that loops close: points of contacts first, then joints, where some that close loops may stick.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from erls.equations.compiled_system import RESIDUAL, CompiledSystem
from erls.equations.serial.contacts import friction_laws, seen_places
from erls.equations.series import residuals_leaving
from erls.equations.switches.grips import NO_GRIPS, Grips, Hold, Touch, held_point
from erls.maths.calls import handed
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism


def gripping(mechanism: Mechanism) -> list[int]:
    """Numbers of the contacts whose points may stick."""
    return [k for k, contact in enumerate(mechanism.contacts) if contact.sticks]


def held_joints(mechanism: Mechanism) -> list[Hold]:
    """Joints that may stick by these modes: free ones of the tree, then those that close loops; none without such."""
    if not mechanism.gripped:
        return []
    tree = [(j.name, j.forces) for j in mechanism.joints if j.forces.sticks and not j.drive.prescribed]
    closing = [(x.name, x.freedom.forces) for x in mechanism.loops if x.freedom is not None and x.sticks]
    told = "friction of joint {!r} switches between sticking and sliding"
    shares = [(name, forces.static / forces.friction) for name, forces in [*tree, *closing]]
    return [Hold(name, share, told.format(name), closely=True) for name, share in shares]


def _laws(mechanism: Mechanism, system: CompiledSystem) -> list[Array]:
    every = friction_laws(system) if mechanism.grips else []
    return [*(every[k] for k in gripping(mechanism)), *system.gripped_laws(system.reals)]


def grips_in(
    mechanism: Mechanism, system: CompiledSystem, residual: Callable[..., Any], joints: Sequence[Hold] = ()
) -> Grips:
    """Their modes, among the constants of a system; those of its joints that may stick are given.

    ``residual`` leaves what is seen of them in the working memory.
    """
    numbers = gripping(mechanism)
    holds = [*(held_point(mechanism.contacts[k]) for k in numbers), *joints]
    if not holds:
        return NO_GRIPS
    points = seen_places(system)[numbers].ravel() if numbers else np.zeros(0, dtype=np.int64)
    places, address = np.concatenate([points, system.gripped_places.ravel()]), handed(residual, RESIDUAL)

    def look(t: Array, y: Array, v: Array) -> Touch:
        found = residuals_leaving(address, system.reals, system.integers, system.scratch, t, y, v, places)
        touching = found[:, : len(points)].reshape(len(t), -1, 5)
        turning = np.zeros((len(t), len(joints), 5))
        turning[..., 0] = -1.0
        turning[..., [1, 3]] = found[:, len(points) :].reshape(len(t), -1, 2)
        return Touch.of(np.concatenate([touching, turning], axis=1))

    return Grips(holds, _laws(mechanism, system), look)


@contextmanager
def lent(grips: Grips, mechanism: Mechanism, system: CompiledSystem) -> Iterator[None]:
    """Another system of the same mechanism, or its tree alone, has their modes meanwhile."""
    laws = _laws(mechanism, system) if grips.names else []
    before = [law.copy() for law in laws]
    try:
        for law, own in zip(laws, grips.laws, strict=False):  # a tree knows nothing of joints, which come last
            law[:] = own
        yield
    finally:
        for law, own in zip(laws, before, strict=True):
            law[:] = own

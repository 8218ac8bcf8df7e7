"""Momenta of motions whose mass is lumped in the nodes, as that of shells is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from erls.run.bodies.motion import BodyMotion


def momenta(run: BodyMotion, times: list[float]) -> NDArray[np.float64]:
    """(k, 6) linear and angular momentum about the origin, in the world, of lumped masses."""
    system, found = run.assembly.system, []
    bodies, at = system.kinds.bodies.matrices, system.kinds.bodies.nodes[:, 0]
    for q, v in zip(run.configurations(np.array(times)), run.velocities(np.array(times)), strict=True):
        poses, twists = q.poses[at], v.reshape(-1, 6)[at].copy()
        if not system.local:
            twists[:, :3] = np.einsum("kji,kj->ki", poses[:, :3, :3], twists[:, :3])
        own = np.einsum("kij,kj->ki", bodies, twists).reshape(-1, 2, 3)
        linear, angular = np.moveaxis(np.einsum("kij,ksj->ksi", poses[:, :3, :3], own), 1, 0)
        found.append(np.concatenate([linear.sum(axis=0), (angular + np.cross(poses[:, :3, 3], linear)).sum(axis=0)]))
    return np.array(found)

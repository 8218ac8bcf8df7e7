"""What an error is measured on: named points, and the forces of drives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from erls.formulations.base import Formulation, State
from erls.integrators.base import Solution
from erls.lie.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.run import Run, node_positions
from erls.scene import Scene

Watched = tuple[tuple[int, int], ...]


def watched_nodes(mechanism: Mechanism) -> Watched:
    """(link, node) of the named points; without any, of every link's outboard interface, or else its farthest node."""
    if mechanism.points:
        return tuple((p.link, p.node) for p in mechanism.points)
    result = []
    for k, link in enumerate(mechanism.links):
        far = np.linalg.norm(link.model.nodes - link.inboard.position, axis=1).argmax()
        result.append((k, int(far) if link.outboard is None else link.outboard.node))
    return tuple(result)


def driven_joints(mechanism: Mechanism) -> list[int]:
    """Joints whose drive force depends on the motion."""
    return [k for k, joint in enumerate(mechanism.joints) if joint.drive.motion is not None]


class Outputs:
    """Positions and drive forces of states of one formulation."""

    def __init__(self, scene: Scene, formulation: Formulation, watched: Watched) -> None:
        empty = np.zeros((1, formulation.size))
        self._run = Run(scene, formulation, Solution(np.zeros(1), empty, empty, empty))
        self.formulation, self.watched = formulation, watched
        self.driven = driven_joints(formulation.mechanism)

    def positions(self, state: State) -> Array:
        """(points, 3) in the world [m]."""
        return np.array([node_positions(self._run, state, k, np.array([node]))[0] for k, node in self.watched])

    def efforts(self, t: float, y: Array, v: Array) -> Array:
        """(driven joints,) [N m or N]."""
        found = self.formulation.reactions(t, y, v)
        return np.array([found[k].effort for k in self.driven])


def largest_distance(first: Sequence[Array], second: Sequence[Array]) -> float:
    """Largest distance of any point at any time [m]."""
    return float(np.linalg.norm(np.array(first) - np.array(second), axis=-1).max(initial=0.0))


def effort_error(first: Sequence[Array], second: Sequence[Array]) -> float | None:
    """Largest difference of a drive's force relative to the peak of all of its kind of size; None without drives."""
    ours, others = np.array(first), np.array(second)
    if not ours.size:
        return None
    peak = np.abs(ours).max()
    return float(np.abs(ours - others).max() / peak) if peak else 0.0

"""What an error is measured on: named points, and the forces of drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from erls.equations.formulation import Formulation, State
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.quick import quick
from erls.equations.registry import formulate
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.drives import Drive
from erls.mechanism.substructures import is_split
from erls.run.chain.places import node_positions
from erls.run.chain.places import watched_nodes as watched_nodes
from erls.scene.chain import Scene
from erls.scene.settings import Simulation

Watched = tuple[tuple[int, int], ...]


def driven_joints(mechanism: Mechanism) -> list[int]:
    """Joints whose drive force depends on the motion."""
    return [k for k, joint in enumerate(mechanism.joints) if joint.drive.motion is not None]


class Outputs:
    """Positions and drive forces of states of one formulation."""

    def __init__(self, scene: Scene, formulation: Formulation, watched: Watched) -> None:
        self.formulation, self.watched = formulation, watched
        self.driven = driven_joints(formulation.mechanism)
        self._static = formulation if isinstance(formulation, QuasiStatic) else None
        whole = formulation if self._static is None else self._static.inner
        settings = scene.record.simulation
        freed = reacting(whole.mechanism, settings) if self.driven else None
        self._reacting = None if freed is None else quick(formulate(freed, settings))

    def positions(self, state: State) -> Array:
        """(points, 3) in the world [m]."""
        mechanism = self.formulation.mechanism
        return np.array([node_positions(mechanism, state, k, np.array([node]))[0] for k, node in self.watched])

    def efforts(self, t: float, y: Array, v: Array) -> Array:
        """(driven joints,) [N m or N]."""
        if self._reacting is None:
            found = self.formulation.reactions(t, y, v)
            return np.array([found[k].effort for k in self.driven])
        if self._static is not None:
            y, v, a = self._static.all_modes(t, y, v, self._static.acceleration(t, y, v))
        else:
            a = quick(self.formulation).acceleration(t, y, v) if len(y) else y
        joints = self.formulation.mechanism.joints
        free = [k for k, joint in enumerate(joints) if not joint.drive.prescribed]
        state = np.zeros((3, self._reacting.size))
        for row, values in zip(state, (y, v, a), strict=True):
            row[free], row[len(joints) :] = values[: len(free)], values[len(free) :]
        for k in self.driven:
            state[:, k] = joints[k].drive.reference(t)
        return np.asarray(self._reacting.residual(t, *state))[self.driven]


def reacting(mechanism: Mechanism, settings: Simulation) -> Mechanism | None:
    """The same chain with nothing that prescribes its motion: forces out of balance on its joints are those of their
    drives. None where other coordinates are joint angles only as long as they are prescribed, where loops or pieces
    share out the forces, or for a drive that knows its own force.
    """
    if settings.gauge != "joint-angle" or mechanism.loops or is_split(mechanism):
        return None
    if not all(mechanism.joints[k].drive.prescribed for k in driven_joints(mechanism)):
        return None
    joints = tuple(replace(j, drive=Drive()) if j.drive.prescribed else j for j in mechanism.joints)
    return replace(mechanism, joints=joints)


def busiest(size: Array, count: int) -> list[int]:
    """At most ``count`` places, the largest in each of as many stretches of ``size`` (k,), the last one among them."""
    stretches = np.array_split(np.arange(len(size)), min(count, len(size)))
    return sorted({*(int(part[np.argmax(size[part])]) for part in stretches), len(size) - 1})


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

"""Where joints of a chain sit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from erls.equations.nodal.joints import GROUND
from erls.equations.nodal.nodes import Nodes
from erls.maths import motion_maps as motions
from erls.maths.rotation_maps import log
from erls.maths.so3 import Array
from erls.mechanism.joint_types import Freedom, Z


@dataclass(frozen=True)
class Seat:
    """Where a joint sits: nodes (`GROUND` for the ground) and the pose of its frames there, about or along whose z axis
    it moves, unless by a rotation vector.
    """

    inner: int
    outer: int
    inner_frame: Array
    outer_frame: Array

    def screw(self, freedom: Freedom) -> Array:
        """(6,) twist of unit joint velocity in the axes of the outer node."""
        return np.asarray(motions.adjoint(self.outer_frame) @ replace(freedom, axis=Z).screw)

    def frames(self, q: Nodes) -> tuple[Array, Array]:
        """(4, 4) frames in the world: the inner and the outer one."""
        carrier = np.eye(4) if self.inner == GROUND else q.poses[self.inner]
        return carrier @ self.inner_frame, q.poses[self.outer] @ self.outer_frame

    def vector(self, q: Nodes) -> Array:
        """(3,) rotation vector from the inner to the outer frame."""
        inner, outer = self.frames(q)
        return np.asarray(log(inner[:3, :3].T @ outer[:3, :3]))

    def spin(self, q: Nodes, velocity: Array) -> Array:
        """(3,) angular velocity of the outer frame against the inner one, in the axes of the former."""
        spins = velocity.reshape(-1, 6)[:, 3:]
        across = q.poses[self.outer, :3, :3] @ spins[self.outer]
        if self.inner != GROUND:
            across = across - q.poses[self.inner, :3, :3] @ spins[self.inner]
        return np.asarray(self.frames(q)[1][:3, :3].T @ across)

"""Rigid bodies: inertia and gravity at one node each.

In the node's axes, with the constant inertia M (6, 6) and the momentum M ν (O. Brüls, M. Arnold, A. Cardona, ASME
DETC2011-48132, eq. 20): M ν̇ − ad(ν)ᵀ M ν = M [Rᵀ g; 0].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from erls.equations.nodal.scatter import IntArray
from erls.errors import Cause, SceneError
from erls.maths.motion_maps import bracket, cobracket
from erls.maths.rotation_maps import skews
from erls.maths.so3 import Array, skew


@dataclass(frozen=True)
class RigidBody:
    """A rigid body at a node; a point mass without ``inertia``.

    Attributes
    ----------
    node : int
    mass : float
        [kg]
    inertia : (3, 3) array
        About the centre of mass, in the node's axes [kg m²].
    centre : (3,) array
        Centre of mass in the node's frame [m].

    Raises
    ------
    SceneError
        With cause BAD_FIELD.
    """

    node: int
    mass: float
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    centre: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        moments = np.linalg.eigvalsh(self.inertia) if np.isfinite(self.inertia).all() else np.full(3, np.nan)
        size = float(np.abs(moments).max())
        skewed = np.abs(self.inertia - np.transpose(self.inertia)).max()
        possible = moments.sum() - 2 * moments.max() >= -1e-9 * size and moments.min() >= -1e-9 * size
        for name, ok, value, remedy in (
            ("mass", 0 <= self.mass < np.inf, self.mass, "give kilograms, not negative"),
            ("inertia", possible and skewed <= 1e-9 * size, moments.tolist(), "give a symmetric matrix whose principal "
             "moments are not negative, the largest at most the sum of the others"),
            ("centre", np.isfinite(self.centre).all(), list(self.centre), "give three lengths in metres"),
        ):  # fmt: skip
            if not ok:
                message = "no rigid body has this"
                raise SceneError(
                    Cause.BAD_FIELD, message, where=f"body at node {self.node}: {name}", value=value, remedy=remedy
                )

    @property
    def matrix(self) -> Array:
        """(6, 6) M of twists of the node."""
        c = skew(np.asarray(self.centre, dtype=float))
        result = np.zeros((6, 6))
        result[:3, :3] = self.mass * np.eye(3)
        result[:3, 3:] = -self.mass * c
        result[3:, :3] = self.mass * c
        result[3:, 3:] = self.inertia - self.mass * c @ c
        return result


class RigidBodies:
    """All rigid bodies of a system, as `erls.equations.nodal.elements.Elements`."""

    breakpoints: tuple[float, ...] = ()

    def __init__(self, bodies: Sequence[RigidBody], gravity: Array) -> None:
        self.nodes: IntArray = np.array([[b.node] for b in bodies], dtype=np.int64).reshape(-1, 1)
        self.matrices = np.array([b.matrix for b in bodies]).reshape(-1, 6, 6)
        self.gravity = np.asarray(gravity, dtype=float)

    def remember(self, poses: Array, before: None) -> None:
        """Nothing."""

    def mass(self, poses: Array, memory: None) -> Array:
        """(b, 6, 6) constant."""
        return self.matrices

    def forces(self, t: float, poses: Array, memory: None, v: Array, a: Array) -> Array:
        """(b, 6) inertia less weight."""
        push = a.copy()
        push[:, :3] -= self._gravity(poses)
        momentum = self.matrices @ v[:, :, None]
        turning = np.swapaxes(bracket(v), 1, 2) @ momentum
        result: Array = (self.matrices @ push[:, :, None] - turning)[:, :, 0]
        return result

    def derivatives(
        self, t: float, poses: Array, memory: None, v: Array, a: Array, material: bool = False
    ) -> tuple[Array, Array]:
        """(b, 6, 6) twice: weight turns with the body; gyroscopic forces."""
        stiffness = np.zeros_like(self.matrices)
        stiffness[:, :, 3:] = -self.matrices[:, :, :3] @ skews(self._gravity(poses))
        momentum = (self.matrices @ v[:, :, None])[:, :, 0]
        return stiffness, -np.swapaxes(bracket(v), 1, 2) @ self.matrices - cobracket(momentum)

    def energy(self, t: float, poses: Array, memory: None, v: Array) -> tuple[float, float]:
        """Kinetic energy and that of gravity."""
        kinetic = 0.5 * float(np.einsum("bi,bij,bj", v, self.matrices, v))
        h = poses[:, 0]
        first = np.stack([self.matrices[:, 5, 1], self.matrices[:, 3, 2], self.matrices[:, 4, 0]], axis=1)  # m c
        moments = self.matrices[:, 0, 0, None] * h[:, :3, 3] + (h[:, :3, :3] @ first[:, :, None])[:, :, 0]
        return kinetic, -float(moments.sum(axis=0) @ self.gravity)

    def _gravity(self, poses: Array) -> Array:
        turned: Array = (np.swapaxes(poses[:, 0, :3, :3], 1, 2) @ self.gravity[:, None])[:, :, 0]
        return turned

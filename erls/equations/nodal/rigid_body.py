"""Rigid bodies: inertia and gravity at one node each; forces are in `erls.equations.nodal.body_forces`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from erls.equations.nodal.scatter import IntArray
from erls.errors import Cause, SceneError
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
    """All rigid bodies of a system as arrays, for `erls.equations.nodal.body_forces`."""

    breakpoints: tuple[float, ...] = ()

    def __init__(self, bodies: Sequence[RigidBody], gravity: Array) -> None:
        self.nodes: IntArray = np.array([[b.node] for b in bodies], dtype=np.int64).reshape(-1, 1)
        self.matrices = np.array([b.matrix for b in bodies]).reshape(-1, 6, 6)
        self.gravity = np.asarray(gravity, dtype=float)


def joined(bodies: Sequence[RigidBody]) -> list[RigidBody]:
    """One body at each node, of all that sit there."""
    whole: dict[int, Array] = {}
    for body in bodies:
        whole[body.node] = whole.get(body.node, np.zeros((6, 6))) + body.matrix
    found = []
    for node, matrix in sorted(whole.items()):
        mass = float(matrix[0, 0])
        turning = matrix[3:, 3:]
        if not mass:
            found.append(RigidBody(node, 0.0, (turning + turning.T) / 2))
            continue
        arm = matrix[3:, :3] / mass  # skew of the place of the centre of mass
        centre = np.array([arm[2, 1], arm[0, 2], arm[1, 0]])
        own = turning + mass * arm @ arm
        found.append(RigidBody(node, mass, (own + own.T) / 2, centre))
    return found

"""The one table of joints: what each leaves free, and what it forbids.

A joint holds an outer frame on an inner one, D = (Q, p) being the pose of the outer frame in the inner one. It leaves
free a product of one-parameter motions, exp(s₁ θ₁) exp(s₂ θ₂) …, whose order is that of its `freedoms`; and it forbids
what its conditions say, each linear in the entries of p and Q: c · p + ⟨C, Q⟩ = 0, in the axes of the inner frame.
Chains move along the freedoms; loops, absolute coordinates and nodes of elements hold the conditions. A new joint is
one line of `JOINT_TYPES`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from erls.maths.so3 import Array, skew

X, Y, Z = range(3)
TRANSLATION, ROTATION = "translation along", "rotation about"


@dataclass(frozen=True)
class Freedom:
    """A screw motion: about or along an axis through the origin of a joint frame.

    Attributes
    ----------
    axis : int
        0, 1, 2 for x, y, z.
    turns : bool
        Whether its coordinate is an angle [rad]; otherwise a length [m].
    name : str
        What tells it from the others of its joint.
    pitch : float
        Of a motion that turns: how far it goes along its axis [m/rad].
    vector : bool
        Whether its coordinate is that component of a rotation vector ψ, which turns by exp(ψ̃): such motions come in
        threes, x, y and z, and none is a screw by itself.
    """

    axis: int
    turns: bool
    name: str = ""
    pitch: float = 0.0
    vector: bool = False

    @property
    def row(self) -> int:
        """Row of the relative displacement (u, φ) in the joint frame that measures it."""
        return self.axis + 3 * self.turns

    @property
    def direction(self) -> Array:
        """(3,) unit vector of the axis."""
        return np.asarray(np.eye(3)[self.axis])

    @property
    def advance(self) -> Array:
        """(3,) how far the origin moves per unit of the coordinate."""
        return self.direction * (self.pitch if self.turns else 1.0)

    @property
    def screw(self) -> Array:
        """(6,) twist [v; ω] of unit rate, in the joint frame."""
        return np.concatenate([self.advance, self.direction * self.turns])

    @property
    def units(self) -> tuple[str, str]:
        """Of the coordinate, and of a force along it."""
        return ("rad", "N m") if self.turns else ("m", "N")

    def parts(self) -> Array:
        """(4, 4, 4) its pose is a constant part, plus others times cosine and sine of the coordinate, and times it.

        Of a component of a rotation vector it is the constant part alone.
        """
        result = np.zeros((4, 4, 4))
        result[0], result[3, :3, 3] = np.eye(4), self.advance
        if self.turns and not self.vector:
            along = np.outer(self.direction, self.direction)
            result[0, :3, :3], result[1, :3, :3], result[2, :3, :3] = along, np.eye(3) - along, skew(self.direction)
        return result

    def poses(self, coordinates: Array) -> Array:
        """(k, 4, 4) poses at (k,) coordinates."""
        factors = np.stack([np.ones_like(coordinates), np.cos(coordinates), np.sin(coordinates), coordinates])
        return np.asarray(np.einsum("pk,pij->kij", factors, self.parts()))

    def pose(self, coordinate: float) -> Array:
        """(4, 4) pose at a coordinate."""
        return np.asarray(self.poses(np.array([float(coordinate)]))[0])


class Condition(NamedTuple):
    """What stays zero: c · p + ⟨C, Q⟩, with ``line`` c (3,) and ``entries`` C (3, 3)."""

    name: str
    line: Array
    entries: Array


def _fixed_point(axis: int) -> Condition:
    return Condition(f"{TRANSLATION} {'xyz'[axis]}", np.eye(3)[axis], np.zeros((3, 3)))


def _fixed_turn(axis: int) -> Condition:
    """A small turn about an axis."""
    j, k = (axis + 1) % 3, (axis + 2) % 3
    entries = np.zeros((3, 3))
    entries[k, j], entries[j, k] = 0.5, -0.5
    return Condition(f"{ROTATION} {'xyz'[axis]}", np.zeros(3), entries)


def _normal(name: str, i: int, j: int, sign: float = 1.0) -> Condition:
    """Axis i of the inner frame at a right angle to axis j of the outer one."""
    entries = np.zeros((3, 3))
    entries[i, j] = sign
    return Condition(name, np.zeros(3), entries)


_PINNED = tuple(_fixed_point(axis) for axis in (X, Y, Z))
_STRAIGHT = tuple(_fixed_turn(axis) for axis in (X, Y, Z))
# of the z axes, at any angle about them
_PARALLEL = (_normal(f"{ROTATION} x", Y, Z, -1.0), _normal(f"{ROTATION} y", X, Z))


class JointType(NamedTuple):
    """A kind of joint.

    Attributes
    ----------
    freedoms : tuple of Freedom
        From the inner frame outward; None for what only closes loops and joins nodes.
    conditions : tuple of Condition
    axes : int
        How many directions say how it lies.
    fields : tuple of str
        Fields of a joint in a scene that say more: attributes of its freedoms.
    """

    freedoms: tuple[Freedom, ...] | None
    conditions: tuple[Condition, ...]
    axes: int = 1
    fields: tuple[str, ...] = ()

    @property
    def one(self) -> Freedom | None:
        """The motion of a joint of one coordinate."""
        return self.freedoms[0] if self.freedoms is not None and len(self.freedoms) == 1 else None

    @property
    def slides(self) -> bool:
        """Whether the outer origin moves in the inner frame."""
        return sum(bool(condition.line.any()) for condition in self.conditions) < 3

    @property
    def mutual(self) -> bool:
        """Whether the conditions say the same when both frames change places: what slides does so along axes that stay
        parallel. Those of a universal joint then change theirs, too.
        """
        return not self.slides or bool(self.aligned)

    @property
    def aligned(self) -> tuple[int, ...]:
        """Axes of the frames that point the same way: where they point opposite ways, the conditions hold as well."""
        turning = sum(bool(condition.entries.any()) for condition in self.conditions)
        return {2: (Z,), 3: (X, Z)}.get(turning, ())


_TURN, _SLIDE = Freedom(Z, True), Freedom(Z, False)
_SHIFT = tuple(Freedom(axis, False, 'xyz'[axis]) for axis in (X, Y, Z))
_VECTOR = tuple(Freedom(axis, True, f"turn_{'xyz'[axis]}", vector=True) for axis in (X, Y, Z))

JOINT_TYPES: dict[str, JointType] = {
    "revolute": JointType((_TURN,), _PINNED + _PARALLEL),
    "prismatic": JointType((_SLIDE,), _PINNED[:2] + _STRAIGHT),
    "screw": JointType((_TURN,), (), fields=("pitch",)),
    "cylindrical": JointType((replace(_SLIDE, name="slide"), replace(_TURN, name="turn")), _PINNED[:2] + _PARALLEL),
    "universal": JointType(
        (Freedom(X, True, "x"), Freedom(Y, True, "y")), (*_PINNED, _normal("axes at right angles", X, Y)), axes=2
    ),
    "planar": JointType(
        (Freedom(X, False, "x"), Freedom(Y, False, "y"), replace(_TURN, name="turn")), (_PINNED[Z], *_PARALLEL)
    ),
    "spherical": JointType(_VECTOR, _PINNED, axes=0),
    "floating": JointType((*_SHIFT, *_VECTOR), (), axes=0),
    "line": JointType(None, _PINNED[:2]),  # a point on a straight line
    "fixed": JointType((), _PINNED + _STRAIGHT, axes=0),
}
"""The axis of all but the universal joint is z; its own are the inner frame's x and the outer frame's y."""

CHAIN_TYPES = tuple(name for name, kind in JOINT_TYPES.items() if kind.freedoms is not None)
HOLDING_TYPES = tuple(name for name, kind in JOINT_TYPES.items() if kind.conditions)
"""Those of chains, and those of loops and of nodes."""


REVOLUTE, PRISMATIC = _TURN, _SLIDE


def single(freedom: Freedom) -> JointType:
    """The kind of joint that leaves this motion alone free."""
    return next(kind for kind in JOINT_TYPES.values() if kind.freedoms == (freedom,))

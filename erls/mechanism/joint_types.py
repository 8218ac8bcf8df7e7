"""The one table of joints: what each leaves free, and what it forbids.

A joint holds an outer frame on an inner one, D = (Q, p) being the pose of the outer frame in the inner one. It leaves
free a product of one-parameter motions, exp(s₁ θ₁) exp(s₂ θ₂) …, whose order is that of its `freedoms`; and it forbids
what its conditions say, in the axes of the inner frame: c · p + ⟨C, Q⟩ - h ψ(Q) = 0, linear in the entries of p and Q
but for the turn ψ about z of a thread (`erls.maths.screws`). Chains move along the freedoms; loops, absolute
coordinates and nodes of elements hold the conditions. A new joint is one line of `JOINT_TYPES`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

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

    @cached_property
    def direction(self) -> Array:
        """(3,) unit vector of the axis."""
        return np.asarray(np.eye(3)[self.axis])

    @property
    def advance(self) -> Array:
        """(3,) how far the origin moves per unit of the coordinate."""
        return self.direction * (self.pitch if self.turns else 1.0)

    @cached_property
    def screw(self) -> Array:
        """(6,) twist [v; ω] of unit rate, in the joint frame."""
        return np.concatenate([self.advance, self.direction * self.turns])

    @property
    def units(self) -> tuple[str, str]:
        """Of the coordinate, and of a force along it."""
        return ("rad", "N m") if self.turns else ("m", "N")

    @cached_property
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
        """(..., 4, 4) poses at (...) coordinates."""
        factors = np.stack([np.ones_like(coordinates), np.cos(coordinates), np.sin(coordinates), coordinates])
        return np.asarray(np.einsum("p...,pij->...ij", factors, self.parts))

    def pose(self, coordinate: float) -> Array:
        """(4, 4) pose at a coordinate."""
        return np.asarray(self.poses(np.array([float(coordinate)]))[0])


@dataclass(frozen=True)
class ElectricFreedom(Freedom):
    """The charge of a motor (`erls.mechanism.circuits`), which moves nothing."""

    @property
    def units(self) -> tuple[str, str]:
        """Of charge and voltage."""
        return "C", "V"


@dataclass(frozen=True)
class Condition:
    """What stays zero: c · p + ⟨C, Q⟩ - h ψ(Q), with ψ the turn about z (`erls.maths.screws`).

    Attributes
    ----------
    name : str
        What tells it from the others of its joint.
    line, entries : (3,), (3, 3) arrays
        c and C.
    pitch : float
        h [m/rad]; 0 leaves what is linear. The value is that to the nearest turn of the thread, so that no turns need
        to be counted: poses at whole leads 2π h from each other, at the same ψ, all belong to one thread.
    """

    name: str
    line: Array
    entries: Array
    pitch: float = 0.0


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


# where a turn about z takes the outer origin
_THREAD = Condition("advance along z", np.eye(3)[Z], np.zeros((3, 3)), pitch=1.0)


class JointType(NamedTuple):
    """A kind of joint.

    Attributes
    ----------
    name : str
    freedoms : tuple of Freedom
        From the inner frame outward; None for what only closes loops and joins nodes.
    conditions : tuple of Condition
    axes : int
        How many directions say how it lies.
    fields : tuple of str
        Of `OWN_FIELDS` those that say more about it: attributes of freedoms and conditions, which take the value that
        a joint gives (`given`) unless they are 0 in the table.
    """

    name: str
    freedoms: tuple[Freedom, ...] | None
    conditions: tuple[Condition, ...]
    axes: int = 1
    fields: tuple[str, ...] = ()

    @property
    def one(self) -> Freedom | None:
        """The motion of a joint of one coordinate."""
        return self.freedoms[0] if self.freedoms is not None and len(self.freedoms) == 1 else None

    @property
    def driven(self) -> Freedom | None:
        """The motion that may be prescribed where such a joint closes a loop or joins nodes: that of one coordinate, or
        the turn of a planar one.
        """
        if self.name == "planar" and self.freedoms is not None:
            return self.freedoms[2]
        return self.one

    @property
    def driven_conditions(self) -> tuple[Condition, ...]:
        """What is forbidden beside `conditions` included, once that motion is prescribed."""
        kept = tuple(condition for condition in self.conditions if condition.line.any())
        return kept + _STRAIGHT if self.name == "planar" else _PINNED + _STRAIGHT

    @property
    def slides(self) -> bool:
        """Whether the outer origin moves in the inner frame."""
        holding = sum(condition.line.any() and not condition.pitch for condition in self.conditions)
        return bool(holding < 3)

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

    def given(self, joint: Any) -> JointType:
        """This kind with the values of its own fields, which are attributes of ``joint``."""

        def told(part: Any) -> Any:
            return replace(part, **{name: getattr(joint, name) for name in self.fields if getattr(part, name)})

        if not self.fields:
            return self
        freedoms = None if self.freedoms is None else tuple(map(told, self.freedoms))
        return self._replace(freedoms=freedoms, conditions=tuple(map(told, self.conditions)))


_TURN, _SLIDE = Freedom(Z, True), Freedom(Z, False)
_SHIFT = tuple(Freedom(axis, False, 'xyz'[axis]) for axis in (X, Y, Z))
_VECTOR = tuple(Freedom(axis, True, f"turn_{'xyz'[axis]}", vector=True) for axis in (X, Y, Z))

_TYPES = (
    JointType("revolute", (_TURN,), _PINNED + _PARALLEL),
    JointType("prismatic", (_SLIDE,), _PINNED[:2] + _STRAIGHT),
    JointType("screw", (replace(_TURN, pitch=1.0),), (*_PINNED[:2], _THREAD, *_PARALLEL), fields=("pitch",)),
    JointType("cylindrical", (replace(_SLIDE, name="slide"), replace(_TURN, name="turn")), _PINNED[:2] + _PARALLEL),
    JointType(
        "universal",
        (Freedom(X, True, "x"), Freedom(Y, True, "y")),
        (*_PINNED, _normal("axes at right angles", X, Y)),
        axes=2,
    ),
    JointType(
        "planar",
        (Freedom(X, False, "x"), Freedom(Y, False, "y"), replace(_TURN, name="turn")),
        (_PINNED[Z], *_PARALLEL),
    ),
    JointType("spherical", _VECTOR, _PINNED, axes=0),
    JointType("floating", (*_SHIFT, *_VECTOR), (), axes=0),
    JointType("line", None, _PINNED[:2]),  # a point on a straight line
    JointType("fixed", (), _PINNED + _STRAIGHT, axes=0),
)
JOINT_TYPES = {kind.name: kind for kind in _TYPES}
"""The axis of all but the universal joint is z; its own are the inner frame's x and the outer frame's y."""

CHAIN_TYPES = tuple(name for name, kind in JOINT_TYPES.items() if kind.freedoms is not None)
HOLDING_TYPES = tuple(name for name, kind in JOINT_TYPES.items() if kind.conditions)
SINGLE_TYPES = tuple(name for name, kind in JOINT_TYPES.items() if kind.one is not None)
DRIVEN_TYPES = tuple(name for name, kind in JOINT_TYPES.items() if kind.driven is not None)
"""Those of chains, those of loops and of nodes, those of one coordinate, and those with one that may be prescribed."""

OWN_FIELDS = {"pitch": "how far it advances along its axis per radian [m/rad], other than 0"}
"""Fields of joints in scenes that only some kinds have, and what they say."""

REVOLUTE, PRISMATIC = _TURN, _SLIDE


def single(freedom: Freedom) -> JointType:
    """The kind of joint that leaves such a motion alone free, about or along z."""
    wanted = Freedom(Z, freedom.turns, pitch=freedom.pitch)
    kinds = (kind.given(freedom) for kind in JOINT_TYPES.values())
    return next(kind for kind in kinds if kind.freedoms == (wanted,))

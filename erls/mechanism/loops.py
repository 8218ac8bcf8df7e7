"""Loops: joints between two links of a chain, or a link and the ground, that close it.

A new kind is one line of `LOOP_TYPES`: what of the relative motion of its two frames stays zero, z being its axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from erls.maths.so3 import Array
from erls.mechanism.drives import Drive
from erls.mechanism.joints import JointForces, JointType

FREE, PARALLEL, HELD = "free", "parallel", "held"


@dataclass(frozen=True)
class LoopType:
    """A kind of closing joint.

    Attributes
    ----------
    sliding : tuple of int
        Axes of the inner frame along which the outer origin does not move.
    turning : str
        ``free``: it turns at will; ``parallel``: its z axis stays parallel to the inner one; ``held``: not at all.
    """

    sliding: tuple[int, ...]
    turning: str

    @property
    def has_axis(self) -> bool:
        """Whether the direction of z matters."""
        return self.turning == PARALLEL or len(self.sliding) < 3

    @property
    def slides(self) -> bool:
        """Whether the outer origin moves in the inner frame."""
        return len(self.sliding) < 3


LOOP_TYPES: dict[str, LoopType] = {
    "revolute": LoopType((0, 1, 2), PARALLEL),
    "prismatic": LoopType((0, 1), HELD),
    "cylindrical": LoopType((0, 1), PARALLEL),
    "spherical": LoopType((0, 1, 2), FREE),
    "fixed": LoopType((0, 1, 2), HELD),
    "line": LoopType((0, 1), FREE),  # a point on a straight line
    "planar": LoopType((2,), PARALLEL),
}


@dataclass(frozen=True)
class LoopEnd:
    """A joint frame on a link or on the ground.

    Attributes
    ----------
    link : int or None
        None is the ground.
    node : int
        Node of the link that carries the frame.
    frame : (4, 4) array
        Pose of the frame from that node, in mesh axes; on the ground, in the world.
    """

    link: int | None
    node: int
    frame: Array


@dataclass(frozen=True)
class LoopFreedom:
    """What a revolute or prismatic closing joint leaves free, and what acts along it.

    Attributes
    ----------
    type : JointType
    zero : float
        Coordinate where the frames coincide [rad or m].
    forces : JointForces
    rotor_inertia : float
        Reflected to the coordinate [kg m² or kg].
    drive : Drive
    """

    type: JointType
    zero: float
    forces: JointForces
    rotor_inertia: float
    drive: Drive

    @property
    def active(self) -> bool:
        """Whether a force that is no reaction, or a rotor, acts along it."""
        return self.forces.active or bool(self.rotor_inertia) or self.drive.kind not in ("free", "motion")

    @property
    def counts_turns(self) -> bool:
        """Whether forces depend on how often it has turned."""
        return self.type.revolute and bool(self.forces.stiffness or self.drive.kind == "pd")


@dataclass(frozen=True)
class Loop:
    """A closing joint: ``outer`` moves against ``inner``, in whose axes its directions are named.

    ``freedom`` is that of a revolute or prismatic one.
    """

    name: str
    type: LoopType
    inner: LoopEnd
    outer: LoopEnd
    freedom: LoopFreedom | None = None

    @property
    def prescribed(self) -> bool:
        """Whether its coordinate follows a motion."""
        return self.freedom is not None and self.freedom.drive.prescribed


def loop_ends(loops: Sequence[Loop]) -> list[tuple[int, LoopEnd]]:
    """Ends on links with the number of the link; of each loop the outer one before the inner one."""
    return [(end.link, end) for loop in loops for end in (loop.outer, loop.inner) if end.link is not None]

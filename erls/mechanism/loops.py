"""Loops: joints between two links of a tree, or a link and the ground, that close it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.bushings import Bushing
from erls.mechanism.circuits import Circuit
from erls.mechanism.couplings import Coupling
from erls.mechanism.drives import Drive
from erls.mechanism.joint_types import Freedom, JointType
from erls.mechanism.joints import JointForces


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
    """The one motion that a closing joint leaves free, and what acts along it.

    Attributes
    ----------
    freedom : Freedom
    zero : float
        Coordinate where the frames coincide [rad or m].
    forces : JointForces
    rotor_inertia : float
        Reflected to the coordinate [kg m² or kg].
    drive : Drive
    """

    freedom: Freedom
    zero: float
    forces: JointForces
    rotor_inertia: float
    drive: Drive

    @property
    def active(self) -> bool:
        """Whether a force that is no reaction, or a rotor, acts along it."""
        return self.forces.active or bool(self.rotor_inertia) or self.drive.kind not in ("free", "motion")

    @property
    def sticks(self) -> bool:
        """Whether friction holds it where it rests."""
        return self.forces.sticks and not self.drive.prescribed

    def grip(self, size: float) -> Array:
        """(9,) friction that may stick, see `JointForces.grip`; empty where it does not."""
        return self.forces.grip(self.freedom, size) if self.sticks else np.zeros(0)

    @property
    def counts_turns(self) -> bool:
        """Whether forces along it depend on how often it has turned, and how far it has advanced does not tell."""
        forced = self.forces.stiffness or self.forces.stops or self.drive.kind == "pd"
        return self.may_lose_turns and bool(forced)

    @property
    def may_lose_turns(self) -> bool:
        """Whether its frames do not tell how often it has turned."""
        return self.freedom.turns and not self.freedom.pitch


@dataclass(frozen=True)
class Loop:
    """A closing joint: ``outer`` moves against ``inner``, in whose axes its directions are named.

    ``freedom`` is that of one that leaves one motion free. A ``coupling``, or a ``circuit``, holds no
    frames: both ends are the ground.
    """

    name: str
    type: JointType
    inner: LoopEnd
    outer: LoopEnd
    freedom: LoopFreedom | None = None
    coupling: Coupling | None = None
    circuit: Circuit | None = None
    bushing: Bushing | None = None

    @property
    def holds_frames(self) -> bool:
        """Whether it is a joint."""
        return self.coupling is None and self.circuit is None

    @property
    def kind(self) -> str:
        """What messages call it."""
        named = (("coupling", self.coupling), ("circuit", self.circuit), ("bushing", self.bushing))
        return next((name for name, given in named if given is not None), "loop")

    @property
    def sticks(self) -> bool:
        """Whether friction holds it where it rests."""
        return self.freedom is not None and self.freedom.sticks

    @property
    def prescribed(self) -> bool:
        """Whether its coordinate follows a motion."""
        return self.freedom is not None and self.freedom.drive.prescribed


def loop_ends(loops: Sequence[Loop]) -> list[tuple[int, LoopEnd]]:
    """Ends on links with the number of the link; of each loop the outer one before the inner one."""
    return [(end.link, end) for loop in loops for end in (loop.outer, loop.inner) if end.link is not None]

"""The contract of a formulation: what equations of motion must offer so that runs, studies and reports can use them.

Rules for adding a formulation:

1. One file (more beside it if it needs them) and one line in ``erls/equations/registry.py``.
2. It imports no other formulation; it shares the mechanism, the modal models, the drives and nothing else.
3. A `TreeFormulation` is a `erls.integrate.base.SecondOrderSystem` in independent coordinates, prescribed motions
   eliminated, over which `erls.equations.loops.closed_chain` can close loops.
4. Any other `Formulation` brings its own integrator, whose `Solution` holds what its ``state`` takes: y with its
   derivatives, smooth enough for Hermite interpolation.
5. Everything that a run reports goes through `State`: whoever samples a run never asks which formulation made it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, runtime_checkable

from erls.equations.system import SecondOrderSystem
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.equations.switches.law import DryFriction


@dataclass(frozen=True)
class Energy:
    """Energies of a state [J]: kinetic (rotors included), elastic (links), gravity, springs (joints)."""

    kinetic: float
    elastic: float
    gravity: float
    springs: float

    @property
    def total(self) -> float:
        """Their sum; constant without drives, damping and friction."""
        return self.kinetic + self.elastic + self.gravity + self.springs


@dataclass(frozen=True)
class Reaction:
    """What link k-1 (or the ground) does to link k in a joint.

    ``force`` (3,) [N] and ``moment`` (3,) [N m] about the displaced inboard interface node, world axes; ``effort``
    [N m or N] is the generalized force of drive, spring, damper and friction on the joint coordinate, rotor
    inertia not subtracted; for prescribed motion what the motor must give.
    """

    force: Array
    moment: Array
    effort: float


@dataclass(frozen=True)
class State:
    """The mechanism at one time.

    Attributes
    ----------
    time : float
    poses : list of (4, 4) arrays
        Link frames in the world.
    modal : list of (m,) arrays
        Modal coordinates of each link (6 rigid-body, then elastic).
    coordinates, angles, rates : (n,) arrays
        Joint coordinates θ, physical joint angles and their rates [rad or m].
    nodes : list of (n, 3) arrays, or None
        World positions of the nodes of each link's modal model, where ``poses`` and ``modal`` only approximate them.
    turns : list of (n, 3, 3) arrays, or None
        With them, how these nodes have turned in the world.
    """

    time: float
    poses: list[Array]
    modal: list[Array]
    coordinates: Array
    angles: Array
    rates: Array
    nodes: list[Array] | None = None
    turns: list[Array] | None = None


@dataclass(frozen=True)
class LoopForce:
    """What a closing joint does to its outer link: force [N] and moment [N m] about the outer frame, and the place of
    that frame's origin [m]; world axes.
    """

    force: Array
    moment: Array
    place: Array


@dataclass(frozen=True)
class FrameMotion:
    """A frame that links carry.

    Attributes
    ----------
    pose : (4, 4) array
        In the world.
    rows : (6, joints + elastic) array
        Of its twist over the rates of (θ, elastic).
    twist, bias : (6,) arrays
        In its own axes, and its derivative at zero accelerations of what is free.
    """

    pose: Array
    rows: Array
    twist: Array
    bias: Array


@dataclass(frozen=True)
class ContactSeries:
    """Contacts of a mechanism at k times.

    Attributes
    ----------
    gap, rate : (k, c) arrays
        Of the node above its plane [m], and its rate.
    normal_force : (k, c) array
        [N]
    force, place : (k, c, 3) arrays
        What acts on the node, friction included, and where, in the world; its opposite acts there on the other side.
    energy : (k, c) array
        Elastic [J].
    """

    gap: Array
    rate: Array
    normal_force: Array
    force: Array
    place: Array
    energy: Array

    @classmethod
    def of(cls, known: Array) -> ContactSeries:
        """From numbers (k, c, 10) in the order of the attributes."""
        gap, rate, normal_force, energy = (known[:, :, at] for at in (0, 1, 2, 9))
        return cls(gap, rate, normal_force, known[:, :, 3:6], known[:, :, 6:9], energy)

    def one(self, number: int, shape: tuple[int, ...]) -> ContactSeries:
        """One of the contacts, times in this shape."""
        parts = (getattr(self, field.name)[:, number] for field in fields(self))
        return ContactSeries(*(part.reshape((*shape, *part.shape[1:])) for part in parts))

    def columns(self, names: Sequence[str]) -> dict[str, Array]:
        """Of a table, by the names of the contacts."""
        found: dict[str, Array] = {}
        for k, name in enumerate(names):
            found[f"{name}.gap [m]"], found[f"{name}.normal_force [N]"] = self.gap[:, k], self.normal_force[:, k]
            found |= {f"{name}.force.{axis} [N]": self.force[:, k, i] for i, axis in enumerate("xyz")}
        return found


class Formulation(Protocol):
    """Equations of motion of a mechanism with what is asked of its states."""

    mechanism: Mechanism

    @property
    def size(self) -> int:
        """Number of entries of y, and of v."""

    def initial_state(self) -> tuple[Array, Array]:
        """(y, v) at time 0."""

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) ÿ from the equations of motion."""

    def state(self, t: float, y: Array, v: Array) -> State:
        """Poses, modal coordinates and joint angles."""

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """Energies."""

    def load_power(self, t: Array, y: Array, v: Array) -> Array:
        """(k,) power of loads on nodes, less what contacts lose [W], at times (k,), coordinates and rates (k, n)."""

    def contact_series(self, t: Array, y: Array, v: Array) -> ContactSeries:
        """Contacts at times (k,), with coordinates and rates (k, n)."""

    def reactions(self, t: float, y: Array, v: Array) -> list[Reaction]:
        """Joint reactions, with the acceleration from the equations of motion."""

    def describe(self) -> dict[str, Any]:
        """Names and sizes for reports."""


class LoopFormulation(Formulation, Protocol):
    """A formulation of a mechanism with loops; they go by their numbers."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know about the loops."""

    def loop_forces(self, t: float, y: Array, v: Array) -> list[LoopForce]:
        """What every closing joint does to its link."""

    def loop_motion(self, t: float, y: Array, v: Array, loop: int) -> tuple[float, float]:
        """Coordinate of a closing joint that has one, and its rate."""

    def loop_effort(self, t: float, y: Array, v: Array, loop: int) -> float:
        """Force of drive, spring, damper and friction along it; for a prescribed motion what its motor must give."""


@runtime_checkable
class Modular(Protocol):
    """Equations whose functions are compiled in modules of their own, those of what runs report included."""

    @property
    def kernels(self) -> tuple[str, ...]:
        """These modules, from the one that takes longest."""


@runtime_checkable
class SurfaceStressed(Protocol):
    """A formulation whose own elements tell the stress of links, where modal ones have it recovered."""

    def surface_stress(self, link: int, y: Array, v: Array) -> Array | None:
        """(k, n, 3, 6) stress xx, yy, zz, xy, yz, zx at bottom, middle and top of the nodes of a link's model, in
        mesh axes [Pa], of states (k, ...); None of a link that is not made of shells, or whose shells do not tell.
        """


class TreeFormulation(Formulation, SecondOrderSystem, Protocol):
    """A formulation whose coordinates can be tied by loops: (θ, elastic), of which ``free`` are independent.

    Attributes
    ----------
    joints : int
    free : int array
        Places of the independent coordinates within (θ, elastic).
    free_joints : int array
        Joints without prescribed motion; their coordinates come first in y.
    along_coordinates : bool
        Whether drives and friction act along these coordinates, so that it can be said when what they do ends.
    """

    along_coordinates: ClassVar[bool] = False
    joints: int
    free: IntArray
    free_joints: IntArray

    @property
    def dry(self) -> DryFriction | None:
        """Friction that sticks, which the compiled equations leave out; None without any."""
        return None

    def frames(self, t: float, y: Array, v: Array) -> list[FrameMotion]:
        """Frames on displaced nodes that the loops of the mechanism hold, as `erls.mechanism.loops.loop_ends`."""

    def reactions_at(self, t: float, y: Array, v: Array, a: Array) -> list[Reaction]:
        """Joint reactions that give accelerations ``a``; the effort of a prescribed motion included."""

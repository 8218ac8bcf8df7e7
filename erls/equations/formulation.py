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

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from erls.equations.system import SecondOrderSystem
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from fe_import.model import IntArray


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
        """(k,) power of loads on nodes at times (k,), with coordinates and rates (k, n) [W]."""

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


class TreeFormulation(Formulation, SecondOrderSystem, Protocol):
    """A formulation whose coordinates can be tied by loops: (θ, elastic), of which ``free`` are independent.

    Attributes
    ----------
    joints : int
    free : int array
        Places of the independent coordinates within (θ, elastic).
    free_joints : int array
        Joints without prescribed motion; their coordinates come first in y.
    """

    joints: int
    free: IntArray
    free_joints: IntArray

    def frames(self, t: float, y: Array, v: Array) -> list[FrameMotion]:
        """Frames on displaced nodes that the loops of the mechanism hold, as `erls.mechanism.loops.loop_ends`."""

    def reactions_at(self, t: float, y: Array, v: Array, a: Array) -> list[Reaction]:
        """Joint reactions that give accelerations ``a``; the effort of a prescribed motion included."""

"""A chain of links as one system of nodes, elements and joints, at its initial joint coordinates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from erls.equations.nodal.actuators import Actuator, Actuators
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.beam import Beams
from erls.equations.nodal.elements import Elements
from erls.equations.nodal.joints import GROUND, Joint, Motion
from erls.equations.nodal.nodes import Nodes
from erls.equations.nodal.parts import LinkParts, node_at
from erls.equations.nodal.rigid_body import RigidBodies
from erls.maths import motion_maps as motions
from erls.maths.se3 import inverse, pose
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.chain import poses as link_poses
from erls.mechanism.rigid_dynamics import inverse_dynamics


@dataclass(frozen=True)
class Seat:
    """Where a joint sits: nodes (`GROUND` for the ground) and the pose of its frames there."""

    inner: int
    outer: int
    inner_frame: Array
    outer_frame: Array


class ChainSystem(NodalSystem):
    """A `NodalSystem` that keeps the joint coordinates beside the frames.

    Parameters
    ----------
    poses : (k, 4, 4) array
    elements : sequence of Elements
        Those that are no actuators.
    actuators : sequence of Actuators
        Together in the order of the joints.
    joints : sequence of Joint
    """

    def __init__(
        self, poses: Array, elements: Sequence[Elements], actuators: Sequence[Actuators], joints: Sequence[Joint]
    ) -> None:
        self.actuators = tuple(actuators)
        super().__init__(poses, [*elements, *actuators], joints)

    def joint_motion(self, q: Nodes, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """(joints,) coordinates, rates and accelerations."""
        found = self.in_joints(0.0, q, v, a)
        return found[:, 0], found[:, 1], found[:, 2]

    def from_stored(self, y: Array, v: Array) -> tuple[Nodes, Array]:
        """Configuration and velocity from what `stored` gives, interpolated or not; rotations made orthogonal."""
        place, rate = (x[: 12 * self.count].reshape(-1, 12) for x in (y, v))
        left, _, right = np.linalg.svd(place[:, 3:].reshape(-1, 3, 3))
        turn = left @ right
        back = np.swapaxes(turn, 1, 2)
        spin = back @ rate[:, 3:].reshape(-1, 3, 3)
        twist = np.empty((self.count, 6))
        twist[:, :3] = (back @ rate[:, :3, None])[:, :, 0]
        twist[:, 3:] = (spin - np.swapaxes(spin, 1, 2))[:, [2, 0, 1], [1, 2, 0]] / 2
        near = replace(self.start, turned=y[12 * self.count :].copy())
        return self.at(motions.poses(turn, place[:, :3]), near), twist.ravel()


@dataclass(frozen=True)
class Chain:
    """The system with what belongs to links and joints.

    Attributes
    ----------
    system : ChainSystem
    beams : Beams or None
    nodes : tuple of slice
        Of each link.
    elements : tuple of int
        First beam element of each link.
    seats : tuple of Seat
    """

    system: ChainSystem
    beams: Beams | None
    nodes: tuple[slice, ...]
    elements: tuple[int, ...]
    seats: tuple[Seat, ...]

    def held(self, coordinates: Array) -> NodalSystem:
        """The same nodes and links, with all joints held and nothing acting in them."""
        joints = [
            replace(joint, motion=_constant(float(c)), breakpoints=())
            for joint, c in zip(self.system.rows.joints, coordinates, strict=True)
        ]
        passive = self.system.elements[: -len(self.system.actuators)]
        return NodalSystem(self.system.start.poses, passive, joints)


def build_chain(mechanism: Mechanism, links: Sequence[LinkParts]) -> Chain:
    """Number nodes and elements link by link, and place them at the initial joint coordinates."""
    frames = link_poses(mechanism, np.array([j.position for j in mechanism.joints]))
    ends = np.cumsum([0, *(len(part.nodes) for part in links)]).tolist()
    nodes = tuple(slice(a, b) for a, b in pairwise(ends))
    poses = np.concatenate(
        [[frame @ pose(position=x) for x in part.nodes] for frame, part in zip(frames, links, strict=True)]
    )
    beams = [
        replace(b, nodes=(first + b.nodes[0], first + b.nodes[1]), frames=frame @ b.frames)
        for frame, part, first in zip(frames, links, ends[:-1], strict=True)
        for b in part.beams
    ]
    bodies = [
        replace(b, node=first + b.node) for part, first in zip(links, ends[:-1], strict=True) for b in part.bodies
    ]
    passive: list[Elements] = []
    elastic = Beams(beams, poses, mechanism.gravity) if beams else None
    if elastic is not None:
        passive.append(elastic)
    if bodies:
        passive.append(RigidBodies(bodies, mechanism.gravity))
    seats = _seats(mechanism, links, ends)
    system = ChainSystem(poses, passive, [_actuators(mechanism, seats)], _joints(mechanism, seats))
    firsts = np.cumsum([0, *(len(part.beams) for part in links)])[:-1].tolist()
    return Chain(system, elastic, nodes, tuple(firsts), seats)


def _seats(mechanism: Mechanism, links: Sequence[LinkParts], firsts: Sequence[int]) -> tuple[Seat, ...]:
    result = []
    for k, (joint, link) in enumerate(zip(mechanism.joints, mechanism.links, strict=True)):
        outer = node_at(links[k], link.inboard.node, f"link {link.name!r}")
        place = links[k].nodes[outer]
        inner, before = GROUND, joint.before
        if joint.seat is not None:
            below = links[joint.parent]
            node = node_at(below, joint.seat.node, f"link {mechanism.links[joint.parent].name!r}")
            inner, before = firsts[joint.parent] + node, pose(position=-below.nodes[node]) @ joint.before
        after = pose(position=-place) @ inverse(joint.after)
        result.append(Seat(inner, firsts[k] + outer, before, after))
    return tuple(result)


def _joints(mechanism: Mechanism, seats: Sequence[Seat]) -> list[Joint]:
    result = []
    for joint, seat in zip(mechanism.joints, seats, strict=True):
        motion: Motion | None = None
        if joint.drive.prescribed:
            motion = joint.drive.reference  # type: ignore[assignment]
        kind = "revolute" if joint.freedom.turns else "prismatic"
        ends = seat.inner, seat.outer, seat.inner_frame, seat.outer_frame
        result.append(Joint(joint.name, kind, *ends, motion, joint.drive.breakpoints if motion else ()))
    return result


def _actuators(mechanism: Mechanism, seats: Sequence[Seat]) -> Actuators:
    """Of all joints."""
    lead = _FeedForward(mechanism)
    found = []
    for k, (joint, seat) in enumerate(zip(mechanism.joints, seats, strict=True)):
        nodes = (seat.outer,) if seat.inner == GROUND else (seat.inner, seat.outer)
        found.append(Actuator(joint, nodes, seat.inner_frame, seat.outer_frame, lead.of(k)))
    return Actuators(found)


class _FeedForward:
    """What the rigid chain needs for the wanted motions; joints without one are held where they begin."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._known: tuple[float, Array] = (np.nan, np.zeros(0))

    def of(self, k: int) -> Callable[[float], float]:
        """Torque of joint ``k`` over time."""
        if not self._mechanism.joints[k].drive.feed_forward:
            return lambda t: 0.0
        return lambda t: float(self._at(t)[k])

    def _at(self, t: float) -> Array:
        if self._known[0] != t:
            wanted = np.array([j.drive.reference(t) or (j.position, 0.0, 0.0) for j in self._mechanism.joints])
            self._known = (t, inverse_dynamics(self._mechanism, *wanted.T))
        return self._known[1]


def _constant(coordinate: float) -> Motion:
    return lambda t: (coordinate, 0.0, 0.0)

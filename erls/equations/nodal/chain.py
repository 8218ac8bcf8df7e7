"""A tree of links, and the joints that close its loops, as one system of nodes, elements and joints, at its initial
joint coordinates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from erls.equations.loops.closed_start import ClosedStart
from erls.equations.nodal.actuators import Actuator, Actuators
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.beam import Beams, halves
from erls.equations.nodal.contacts import Contacts, NodalContact
from erls.equations.nodal.elements import Elements
from erls.equations.nodal.joints import GROUND, Joint, Motion
from erls.equations.nodal.loads import NodalLoad, NodalLoads
from erls.equations.nodal.nodes import Nodes, poses_of, twists_of
from erls.equations.nodal.parts import LinkParts, node_at
from erls.equations.nodal.redundant import without_redundant
from erls.equations.nodal.rigid_body import RigidBodies
from erls.equations.nodal.seat import Seat
from erls.equations.nodal.shell import Shells
from erls.maths.rotation_maps import exp
from erls.maths.se3 import inverse, pose
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.chain import poses as link_poses
from erls.mechanism.contacts import PointContact
from erls.mechanism.joint_types import Freedom, single
from erls.mechanism.joints import Joint as MechanismJoint
from erls.mechanism.loads import CENTRE, PointLoad
from erls.mechanism.loops import Loop, LoopEnd, LoopFreedom
from erls.mechanism.rigid_dynamics import feed_forward


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
        """(a,) coordinates, rates and accelerations; closing joints with one coordinate come after all others."""
        found = self.in_joints(0.0, q, v, a)
        return found[:, 0], found[:, 1], found[:, 2]

    def from_stored(self, y: Array, v: Array) -> tuple[Nodes, Array]:
        """Configuration and velocity from what `stored` gives, interpolated or not; rotations made orthogonal."""
        poses, near = self.poses_stored(y[None])[0], replace(self.start, turned=y[12 * self.count :].copy())
        rate = v[: 12 * self.count].reshape(-1, 12)
        return self.at(poses, near), twists_of(poses[:, :3, :3], rate).ravel()

    def poses_stored(self, y: Array) -> Array:
        """(k, N, 4, 4) of the nodes, from what `stored` gives at k times."""
        poses = poses_of(y[:, : 12 * self.count].reshape(len(y), self.count, 12))
        left, _, right = np.linalg.svd(poses[..., :3, :3])
        poses[..., :3, :3] = left @ right
        return poses


@dataclass(frozen=True)
class Chain:
    """The system with what belongs to links and joints.

    Attributes
    ----------
    system : ChainSystem
    full : ChainSystem
        With all conditions: also with those that follow from others.
    left_out : tuple of str
        Names of these.
    beams : Beams or None
    shells : Shells or None
    nodes : tuple of slice
        Of each link.
    elements : tuple of int
        First beam element of each link.
    seats, closing : tuple of Seat
        Of the joints, and of those that close loops, which follow them in the systems.
    """

    system: ChainSystem
    full: ChainSystem
    left_out: tuple[str, ...]
    beams: Beams | None
    shells: Shells | None
    nodes: tuple[slice, ...]
    elements: tuple[int, ...]
    seats: tuple[Seat, ...]
    closing: tuple[Seat, ...]

    @property
    def elastic(self) -> list[Elements]:
        """Beams and shells without weight, which resist nothing but to be bent."""
        found: list[Elements] = [] if self.beams is None else [self.beams.without_weight()]
        return found if self.shells is None else [*found, self.shells]

    def resting(self, held: Mapping[int, float]) -> NodalSystem:
        """The same with some joints, by their numbers, held at a coordinate."""
        joints = list(self.full.rows.joints)
        for k, coordinate in held.items():
            if joints[k].type == "spherical":  # with the next two, which are fixed
                psi = np.array([held[k + i] for i in range(3)])
                joints[k] = replace(joints[k], type="fixed", inner_frame=joints[k].inner_frame @ pose(exp(psi)))
            elif joints[k].type != "fixed":
                joints[k] = replace(joints[k], motion=_constant(coordinate), breakpoints=())
        full = NodalSystem(self.full.start.poses, self.full.elements, joints)
        if not self.closing:
            return full
        joints, left_out = without_redundant(full)
        return NodalSystem(full.start.poses, full.elements, joints) if left_out else full


def build_chain(mechanism: Mechanism, links: Sequence[LinkParts], start: ClosedStart | None = None) -> Chain:
    """Number nodes and elements link by link, and place them at the initial joint coordinates.

    Parameters
    ----------
    mechanism : Mechanism
    links : sequence of LinkParts
    start : ClosedStart, optional
        Of a mechanism with loops.
    """
    positions = np.array([j.position for j in mechanism.joints]) if start is None else start.positions
    frames = link_poses(mechanism, positions)
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
    plates = [
        replace(x, nodes=tuple(first + n for n in x.nodes), frames=frame @ x.frames)
        for frame, part, first in zip(frames, links, ends[:-1], strict=True)
        for x in part.shells
    ]
    bodies = [
        replace(b, node=first + b.node) for part, first in zip(links, ends[:-1], strict=True) for b in part.bodies
    ]
    passive: list[Elements] = []
    elastic = Beams(beams, poses, mechanism.gravity) if beams else None
    if elastic is not None:
        passive.append(elastic)
    surfaces = Shells(plates, poses) if plates else None
    if surfaces is not None:
        passive.append(surfaces)
    if bodies:
        passive.append(RigidBodies(bodies, mechanism.gravity))
    if mechanism.loads:
        passive.append(NodalLoads([x for load in mechanism.loads for x in _loads(mechanism, links, ends, load)]))
    if mechanism.contacts:
        touching = [_contact(mechanism, links, ends, contact) for contact in mechanism.contacts]
        passive.append(Contacts(touching, mechanism.reach))
    seats = _seats(mechanism, links, ends)
    closing = tuple(_closing(mechanism, links, ends, loop) for loop in mechanism.loops)
    acting = _actuators(mechanism, seats, positions)
    if start is not None:
        acting += _closing_actuators(mechanism, closing, start)
    joints, actuators = _joints(mechanism, seats) + _closing_joints(mechanism, closing), [Actuators(acting)]
    full = system = ChainSystem(poses, passive, actuators, joints)
    left_out: tuple[str, ...] = ()
    if closing:
        joints, left_out = without_redundant(full)
        system = ChainSystem(poses, passive, actuators, joints) if left_out else full
    firsts = np.cumsum([0, *(len(part.beams) for part in links)])[:-1].tolist()
    return Chain(system, full, left_out, elastic, surfaces, nodes, tuple(firsts), seats, closing)


def _loads(mechanism: Mechanism, links: Sequence[LinkParts], firsts: Sequence[int], load: PointLoad) -> list[NodalLoad]:
    """A load on the node that carries its node; that on a link's mass on all of its nodes, half of each beam's at its
    ends.
    """
    at = partial(_place, mechanism, links, firsts)
    places = [(*at(load.link, load.node), 1.0)] if load.node != CENTRE else _masses(links[load.link], firsts[load.link])
    axes = GROUND if load.axes is None else at(*load.axes)[0]
    factor: Callable[[float], float] = (lambda t: 1.0) if load.factor is None else load.factor.value
    times = factor, load.breakpoints
    result = []
    for node, position, mass in places:
        own, (force, moment) = axes == node, (mass * load.wrench).reshape(2, 3)
        result.append(NodalLoad(node, force, moment, own, position, GROUND if own else axes, *times))
    return result


def _place(
    mechanism: Mechanism, links: Sequence[LinkParts], firsts: Sequence[int], link: int, node: int
) -> tuple[int, Array]:
    """Number of what carries a node of a link's model, and the place of that in its axes."""
    number = node_at(links[link], node, f"link {mechanism.links[link].name!r}")
    return firsts[link] + number, mechanism.links[link].model.nodes[node] - links[link].nodes[number]


def _contact(
    mechanism: Mechanism, links: Sequence[LinkParts], firsts: Sequence[int], contact: PointContact
) -> NodalContact:
    """A contact on the nodes that carry its point and its plane."""
    at = partial(_place, mechanism, links, firsts)
    node, arm = at(contact.link, contact.node)
    if contact.base is None:
        return NodalContact((node,), arm, contact)
    base, offset = at(*contact.base)
    return NodalContact((base, node), arm, replace(contact, position=contact.position + offset))


def _masses(parts: LinkParts, first: int) -> list[tuple[int, Array, float]]:
    """Node, place in its axes [m] and mass [kg] of all that a link consists of, half of each beam at its ends."""
    poses = np.array([pose(position=x) for x in parts.nodes])
    found = [(first + node, local[:3, 3], float(half[0, 0])) for node, local, half in halves(parts.beams, poses)]
    found += [(first + body.node, body.centre, body.mass) for body in parts.bodies]
    return [(node, place, mass) for node, place, mass in found if mass]


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
        turn = _to_z(joint.freedom)
        result.append(Seat(inner, firsts[k] + outer, before @ turn, after @ turn))
    return tuple(result)


def _to_z(freedom: Freedom) -> Array:
    """(4, 4) pose of axes whose z is that of a motion, in those of its joint."""
    return np.eye(4) if freedom.vector else pose(np.roll(np.eye(3), -(freedom.axis + 1), axis=0).T)


def _closing(mechanism: Mechanism, links: Sequence[LinkParts], firsts: Sequence[int], loop: Loop) -> Seat:
    """Of a joint that closes a loop; its inner frame stands where the coordinate is zero."""

    def end(given: LoopEnd) -> tuple[int, Array]:
        if given.link is None:
            return GROUND, given.frame
        part, link = links[given.link], mechanism.links[given.link]
        node = node_at(part, given.node, f"link {link.name!r}")
        return firsts[given.link] + node, pose(position=link.model.nodes[given.node] - part.nodes[node]) @ given.frame

    (inner, base), (outer, frame) = end(loop.inner), end(loop.outer)
    if loop.freedom is not None:
        base = base @ loop.freedom.freedom.pose(-loop.freedom.zero)
    return Seat(inner, outer, base, frame)


def _joints(mechanism: Mechanism, seats: Sequence[Seat]) -> list[Joint]:
    kinds = [single(j.freedom).name for j in mechanism.joints]
    for k in mechanism.rotation_vectors:  # the first one turns for all three
        kinds[k : k + 3] = "spherical", "fixed", "fixed"
    whole = zip(mechanism.joints, kinds, seats, strict=True)
    return [_joint(joint.name, kind, seat, joint) for joint, kind, seat in whole]


def _closing_joints(mechanism: Mechanism, seats: Sequence[Seat]) -> list[Joint]:
    return [
        _joint(loop.name, loop.type.name, seat, loop.freedom) for loop, seat in zip(mechanism.loops, seats, strict=True)
    ]


def _joint(name: str, kind: str, seat: Seat, moving: MechanismJoint | LoopFreedom | None) -> Joint:
    ends = seat.inner, seat.outer, seat.inner_frame, seat.outer_frame
    if moving is None:
        return Joint(name, kind, *ends)
    joint, drive = Joint(name, kind, *ends, pitch=moving.freedom.pitch), moving.drive
    if not drive.prescribed:
        return joint
    motion: Motion = drive.reference  # type: ignore[assignment]
    return replace(joint, motion=motion, breakpoints=drive.breakpoints)


def _actuators(mechanism: Mechanism, seats: Sequence[Seat], positions: Array) -> list[Actuator]:
    """Of all joints."""
    lead = _FeedForward(mechanism)
    return [
        _actuator(replace(joint, position=float(positions[k])), seat, lead.of(k))
        for k, (joint, seat) in enumerate(zip(mechanism.joints, seats, strict=True))
    ]


def _closing_actuators(mechanism: Mechanism, seats: Sequence[Seat], start: ClosedStart) -> list[Actuator]:
    """Of closing joints with one coordinate, in their order."""
    found, still = [], np.eye(4)
    for loop, seat, position in zip(mechanism.loops, seats, start.coordinates.tolist(), strict=True):
        if (free := loop.freedom) is not None:
            own = free.freedom, still, still, free.forces, free.rotor_inertia, free.drive
            found.append(_actuator(MechanismJoint(loop.name, *own, position, 0.0), seat, np.zeros_like))
    return found


def _actuator(joint: MechanismJoint, seat: Seat, lead: Callable[[Array], Array]) -> Actuator:
    nodes = (seat.outer,) if seat.inner == GROUND else (seat.inner, seat.outer)
    return Actuator(joint, nodes, seat.inner_frame, seat.outer_frame, lead)


class _FeedForward:
    """What wanted motions ask of the rigid chain, found once for all joints."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._known: tuple[bytes, Array] = (b"", np.zeros((0, 0)))

    def of(self, k: int) -> Callable[[Array], Array]:
        """Torques (k,) of joint ``k`` at times (k,)."""
        if not self._mechanism.joints[k].drive.feed_forward:
            return np.zeros_like
        return lambda times: self._at(times)[:, k]

    def _at(self, times: Array) -> Array:
        if self._known[0] != times.tobytes():
            self._known = times.tobytes(), feed_forward(self._mechanism, times)
        return self._known[1]


def _constant(coordinate: float) -> Motion:
    return lambda t: (coordinate, 0.0, 0.0)

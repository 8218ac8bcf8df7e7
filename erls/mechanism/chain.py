"""Trees of links: the mechanism as data, and the rigid kinematics of its Equivalent Rigid Link System.

Frames: link k's mesh frame is its body frame; twists and wrenches are [linear; angular] about its origin, in its
axes. θ is the vector of joint coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.maths import motion_maps as motions
from erls.maths.rotation_maps import exp, tangent, tangent_derivative
from erls.maths.se3 import twist_cross, twist_transform
from erls.maths.so3 import Array
from erls.mechanism.contacts import PointContact
from erls.mechanism.effects import ALL
from erls.mechanism.joints import Joint
from erls.mechanism.links import Link
from erls.mechanism.loads import PointLoad
from erls.mechanism.loops import Loop


@dataclass(frozen=True)
class Point:
    """A named point: a node of a link."""

    name: str
    link: int
    node: int


@dataclass(frozen=True)
class Mechanism:
    """A tree of links: joint k carries link k, and stands on a link with a smaller number, or on the ground.

    Attributes
    ----------
    name : str
    joints : tuple of Joint
    links : tuple of Link
    points : tuple of Point
    gravity : (3,) array
        World axes [m/s²].
    static_start : bool
        Whether the motion starts from static equilibrium with the joints held, instead of undeformed.
    allow_unstable : bool
        Whether that equilibrium may be unstable.
    elastic_assembly : bool
        Whether flexible links may be bent for loops to close.
    loops : tuple of Loop
        Joints that close it.
    loads : tuple of PointLoad
        Forces and moments on nodes.
    contacts : tuple of PointContact
        Nodes that planes keep on their side.
    effects : frozenset of str
        Names from `erls.mechanism.effects` that the equations of motion take into account.
    bandwidth : float or None
        Frequency above which modes follow statically [Hz]; None: all of them vibrate.
    remarks : tuple of str
        What the user should know about how it came about.
    """

    name: str
    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    points: tuple[Point, ...]
    gravity: Array
    static_start: bool = False
    allow_unstable: bool = False
    elastic_assembly: bool = False
    loops: tuple[Loop, ...] = ()
    loads: tuple[PointLoad, ...] = ()
    contacts: tuple[PointContact, ...] = ()
    effects: frozenset[str] = ALL
    bandwidth: float | None = None
    remarks: tuple[str, ...] = ()

    @property
    def parents(self) -> tuple[int, ...]:
        """Of every link the one that its joint stands on, -1 for the ground."""
        return tuple(joint.parent for joint in self.joints)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Times at which drives of the tree or loads jump, in rising order [s]."""
        own = [joint.drive.breakpoints for joint in self.joints] + [load.breakpoints for load in self.loads]
        return tuple(sorted({t for times in own for t in times}))

    @property
    def acted_on(self) -> bool:
        """Whether anything but joints and gravity acts on nodes."""
        return bool(self.loads or self.contacts)

    @property
    def touches(self) -> bool:
        """Whether contacts, or stops of joints, act from one moment on."""
        forces = [joint.forces for joint in self.joints]
        forces += [loop.freedom.forces for loop in self.loops if loop.freedom is not None]
        return bool(self.contacts) or any(each.stops for each in forces)

    def carried(self, number: int) -> list[int]:
        """A link and all that it bears, by their numbers."""
        found = [number]
        for k in range(number + 1, len(self.links)):
            if self.joints[k].parent in found:
                found.append(k)
        return found

    def standing_on(self, number: int) -> list[int]:
        """Joints that stand on a link, by their numbers."""
        return [k for k, joint in enumerate(self.joints) if joint.parent == number]

    @property
    def bodies(self) -> list[int]:
        """Links that are more than a place between two motions of one joint."""
        return [k for k, link in enumerate(self.links) if not link.intermediate]

    @property
    def rotation_vectors(self) -> tuple[int, ...]:
        """Joints whose coordinate is the first component of a rotation vector; the next two are the others."""
        return tuple(k for k, joint in enumerate(self.joints) if joint.freedom.vector and joint.freedom.axis == 0)

    @property
    def rotation_vector_places(self) -> tuple[int, ...]:
        """Places of their first components among the free joint coordinates."""
        prescribed = np.cumsum([joint.drive.prescribed for joint in self.joints])
        return tuple(k - int(prescribed[k]) for k in self.rotation_vectors)

    @property
    def sticks(self) -> bool:
        """Whether friction holds any joint where it rests, of the tree or one that closes it."""
        return any(joint.forces.sticks for joint in self.joints) or self.gripped

    @property
    def gripped(self) -> bool:
        """Whether friction holds a joint that closes a loop: then it holds all by `erls.equations.switches.grips`."""
        return any(loop.sticks for loop in self.loops)

    @property
    def limited(self) -> bool:
        """Whether any motor has a limit, in the tree or where it closes."""
        drives = [joint.drive for joint in self.joints]
        drives += [loop.freedom.drive for loop in self.loops if loop.freedom is not None]
        return any(drive.torque_limit < np.inf for drive in drives)

    @property
    def switches(self) -> bool:
        """Whether what acts in joints and contacts has modes (`erls.equations.switches`)."""
        return self.sticks or self.limited or self.grips

    @property
    def grips(self) -> bool:
        """Whether friction holds any point of a contact where it rests."""
        return any(contact.sticks for contact in self.contacts)

    @property
    def reach(self) -> float:
        """Size of the largest link [m]."""
        return max(1e-3, *(link.size for link in self.links))

    @property
    def outermost(self) -> list[int]:
        """Links that bear no other."""
        return [k for k in range(len(self.links)) if k not in self.parents]


@dataclass(frozen=True)
class Kinematics:
    """Rigid kinematics at one state.

    Attributes
    ----------
    poses : list of (4, 4) arrays
        Link frames in the world.
    transforms : list of (6, 6) arrays
        Twist of the link below, or of the ground, to that of the link.
    twists, biases : list of (6,) arrays
        Twist of each link, and its derivative at zero joint acceleration.
    screws : list of (6,) arrays
        Motion subspace of each joint, in the frame of the link that it carries.
    """

    poses: list[Array]
    transforms: list[Array]
    twists: list[Array]
    biases: list[Array]
    screws: list[Array]


def joint_poses(mechanism: Mechanism, theta: Array) -> list[Array]:
    """(..., 4, 4) each: what the joints move; the first of the three motions of a rotation vector turns for all.

    Parameters
    ----------
    mechanism : Mechanism
    theta : (..., n) array
    """
    theta = np.asarray(theta)
    result = [joint.freedom.poses(theta[..., k]) for k, joint in enumerate(mechanism.joints)]
    for k in mechanism.rotation_vectors:
        turns = exp(theta[..., k : k + 3])
        result[k] = motions.poses(turns, np.zeros(turns.shape[:-1]))
    return result


def poses(mechanism: Mechanism, theta: Array) -> list[Array]:
    """World poses of the link frames, (..., 4, 4) each, at coordinates (..., n)."""
    result: list[Array] = []
    for joint, moved in zip(mechanism.joints, joint_poses(mechanism, theta), strict=True):
        step = joint.before @ moved @ joint.after
        result.append(step if joint.parent < 0 else result[joint.parent] @ step)
    return result


def _screws(mechanism: Mechanism, theta: Array, rates: Array) -> tuple[list[Array], list[Array]]:
    """(6,) motion subspaces in the mesh frames of the links that joints carry, and what they add to accelerations."""
    screws = [joint.screw for joint in mechanism.joints]
    biases = [np.zeros(6) for _ in screws]
    for k in mechanism.rotation_vectors:
        psi, rate = np.asarray(theta[k : k + 3]), np.asarray(rates[k : k + 3])
        columns, carry = tangent(psi), twist_transform(mechanism.joints[k + 2].after)
        found = [np.concatenate([np.zeros(3), columns[:, i]]) for i in range(3)]
        moved = [screw * speed for screw, speed in zip(found, rate, strict=True)]
        change = np.concatenate([np.zeros(3), tangent_derivative(psi, rate) @ rate])
        biases[k + 1] = twist_cross(moved[1]) @ moved[0]
        biases[k + 2] = carry @ (twist_cross(moved[2]) @ (moved[0] + moved[1]) + change)
        screws[k : k + 3] = [found[0], found[1], carry @ found[2]]
    return screws, biases


def kinematics(mechanism: Mechanism, theta: Array, rates: Array) -> Kinematics:
    """Poses, twists and bias accelerations of all links.

    Parameters
    ----------
    mechanism : Mechanism
    theta, rates : (n,) arrays
    """
    screws, added = _screws(mechanism, theta, rates)
    result = Kinematics([], [], [], [], screws)
    moves = joint_poses(mechanism, theta)
    for joint, screw, more, moved, rate in zip(mechanism.joints, screws, added, moves, rates, strict=True):
        world, twist, bias = np.eye(4), np.zeros(6), np.zeros(6)
        if joint.parent >= 0:
            world, twist, bias = (x[joint.parent] for x in (result.poses, result.twists, result.biases))
        step = joint.before @ moved @ joint.after
        transform = twist_transform(step)
        twist = transform @ twist + screw * rate
        result.poses.append(world @ step)
        result.transforms.append(transform)
        result.twists.append(twist)
        result.biases.append(transform @ bias - twist_cross(screw * rate) @ twist + more)
    return result

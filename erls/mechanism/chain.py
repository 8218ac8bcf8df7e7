"""Trees of links: the mechanism as data, and the rigid kinematics of its Equivalent Rigid Link System.

Frames: link k's mesh frame is its body frame; twists and wrenches are [linear; angular] about its origin, in its
axes. θ is the vector of joint coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.maths.se3 import twist_cross, twist_transform
from erls.maths.so3 import Array
from erls.mechanism.effects import DEFAULT
from erls.mechanism.joints import Joint
from erls.mechanism.links import Link
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
    loops : tuple of Loop
        Joints that close it.
    effects : frozenset of str
        Names from `erls.mechanism.effects` that the equations of motion take into account.
    bandwidth : float or None
        Frequency above which modes follow statically [Hz]; None: all of them vibrate.
    """

    name: str
    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    points: tuple[Point, ...]
    gravity: Array
    static_start: bool = False
    loops: tuple[Loop, ...] = ()
    effects: frozenset[str] = DEFAULT
    bandwidth: float | None = None

    @property
    def parents(self) -> tuple[int, ...]:
        """Of every link the one that its joint stands on, -1 for the ground."""
        return tuple(joint.parent for joint in self.joints)

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
    """

    poses: list[Array]
    transforms: list[Array]
    twists: list[Array]
    biases: list[Array]


def poses(mechanism: Mechanism, theta: Array) -> list[Array]:
    """World poses of the link frames, (4, 4) each."""
    result: list[Array] = []
    for joint, coordinate in zip(mechanism.joints, theta, strict=True):
        step = joint.before @ joint.freedom.pose(coordinate) @ joint.after
        result.append(step if joint.parent < 0 else result[joint.parent] @ step)
    return result


def kinematics(mechanism: Mechanism, screws: list[Array], theta: Array, rates: Array) -> Kinematics:
    """Poses, twists and bias accelerations of all links.

    Parameters
    ----------
    mechanism : Mechanism
    screws : list of (6,) arrays
        ``joint.screw`` of every joint (constant).
    theta, rates : (n,) arrays
    """
    result = Kinematics([], [], [], [])
    for joint, screw, coordinate, rate in zip(mechanism.joints, screws, theta, rates, strict=True):
        world, twist, bias = np.eye(4), np.zeros(6), np.zeros(6)
        if joint.parent >= 0:
            world, twist, bias = (x[joint.parent] for x in (result.poses, result.twists, result.biases))
        step = joint.before @ joint.freedom.pose(coordinate) @ joint.after
        transform = twist_transform(step)
        twist = transform @ twist + screw * rate
        result.poses.append(world @ step)
        result.transforms.append(transform)
        result.twists.append(twist)
        result.biases.append(transform @ bias - twist_cross(screw * rate) @ twist)
    return result


def jacobians(mechanism: Mechanism, transforms: list[Array], screws: list[Array]) -> list[Array]:
    """(6, n) Jacobian of every link's twist with respect to the joint rates."""
    count = len(screws)
    result: list[Array] = []
    for k, joint in enumerate(mechanism.joints):
        current = np.zeros((6, count)) if joint.parent < 0 else transforms[k] @ result[joint.parent]
        current[:, k] = screws[k]
        result.append(current)
    return result

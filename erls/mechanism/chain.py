"""Serial chains: the mechanism as data, and the rigid kinematics of its Equivalent Rigid Link System.

Frames: link k's mesh frame is its body frame; twists and wrenches are [linear; angular] about its origin, in its
axes. θ is the vector of joint coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.maths.se3 import joint_pose, twist_cross, twist_transform
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
    """A serial chain: joint k connects link k-1 (or the ground) to link k.

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
        Joints that close the chain.
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


@dataclass(frozen=True)
class Kinematics:
    """Rigid kinematics at one state.

    Attributes
    ----------
    poses : list of (4, 4) arrays
        Link frames in the world.
    transforms : list of (6, 6) arrays
        Twist of link k-1 to link k (for the first link: of the ground).
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
    current = np.eye(4)
    for joint, coordinate in zip(mechanism.joints, theta, strict=True):
        current = current @ joint.before @ joint_pose(joint.type.revolute, coordinate) @ joint.after
        result.append(current)
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
    world, twist, bias = np.eye(4), np.zeros(6), np.zeros(6)
    for joint, screw, coordinate, rate in zip(mechanism.joints, screws, theta, rates, strict=True):
        step = joint.before @ joint_pose(joint.type.revolute, coordinate) @ joint.after
        world = world @ step
        transform = twist_transform(step)
        twist = transform @ twist + screw * rate
        bias = transform @ bias - twist_cross(screw * rate) @ twist
        result.poses.append(world)
        result.transforms.append(transform)
        result.twists.append(twist)
        result.biases.append(bias)
    return result


def jacobians(transforms: list[Array], screws: list[Array]) -> list[Array]:
    """(6, n) Jacobian of every link's twist with respect to the joint rates."""
    count = len(screws)
    result: list[Array] = []
    current = np.zeros((6, count))
    for k in range(count):
        current = transforms[k] @ current
        current[:, k] = screws[k]
        result.append(current)
    return result

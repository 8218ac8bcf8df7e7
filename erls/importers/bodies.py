"""Bodies of a URDF robot: links that fixed joints connect, as one."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from erls.importers.urdf import UrdfJoint, UrdfRobot
from erls.maths.so3 import Array


@dataclass(frozen=True)
class Body:
    """Links that move as one.

    Attributes
    ----------
    joint : UrdfJoint or None
        That carries it; None for the root.
    frames : dict of (4, 4) arrays
        Pose of each of its links in the frame of the first, by name.
    mass : float
        [kg]
    centre_of_mass : (3,) array
        [m]
    inertia : (3, 3) array
        About its centre of mass [kg m²].
    """

    joint: UrdfJoint | None
    frames: dict[str, Array]
    mass: float
    centre_of_mass: Array
    inertia: Array

    @property
    def name(self) -> str:
        """Of its first link."""
        return next(iter(self.frames))


def bodies_of(robot: UrdfRobot) -> tuple[list[Body], list[str]]:
    """Bodies, parents before children, and what was told on the way."""
    below = {name: link.mass for name, link in robot.links.items()}
    for joint in reversed(robot.joints):
        below[joint.parent] += below[joint.child]
    home: dict[str, tuple[int, Array]] = {robot.root: (0, np.eye(4))}  # body, and pose in it
    carriers: list[UrdfJoint | None] = [None]
    frames: list[dict[str, Array]] = [{robot.root: np.eye(4)}]
    told = []
    for joint in robot.joints:
        number, pose = home[joint.parent]
        weightless = joint.type != "fixed" and below[joint.child] == 0
        if weightless:
            told.append(f"joint {joint.name!r} carries no mass: it is held")
        if joint.type == "fixed" or weightless:
            home[joint.child] = number, pose @ joint.origin
            frames[number][joint.child] = pose @ joint.origin
            continue
        home[joint.child] = len(carriers), np.eye(4)
        carriers.append(replace(joint, parent=next(iter(frames[number])), origin=pose @ joint.origin))
        frames.append({joint.child: np.eye(4)})
    return [_body(robot, joint, own) for joint, own in zip(carriers, frames, strict=True)], told


def _body(robot: UrdfRobot, joint: UrdfJoint | None, frames: dict[str, Array]) -> Body:
    parts = [(robot.links[name], pose) for name, pose in frames.items()]
    mass = sum(link.mass for link, _ in parts)
    centres = [pose[:3, :3] @ link.centre_of_mass + pose[:3, 3] for link, pose in parts]
    weighted = (link.mass * centre for (link, _), centre in zip(parts, centres, strict=True))
    centre = sum(weighted, np.zeros(3)) / (mass or 1.0)
    inertia = np.zeros((3, 3))
    for (link, pose), at in zip(parts, centres, strict=True):
        arm = at - centre
        turn = pose[:3, :3]
        inertia += turn @ link.inertia @ turn.T + link.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Body(joint, frames, mass, centre, inertia)

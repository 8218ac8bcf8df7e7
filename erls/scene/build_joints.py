"""Joints of a scene on their Denavit-Hartenberg rows, and what acts in them: spring, damper, friction, rotor."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from erls.maths.se3 import inverse, pose
from erls.maths.so3 import Array, fixed_axes
from erls.mechanism.dh import DHRow, split
from erls.mechanism.drives import build_drive
from erls.mechanism.joint_types import JOINT_TYPES
from erls.mechanism.joints import Joint, JointForces
from erls.mechanism.place import Place
from erls.scene.chain import Base, Scene, SceneRecord
from erls.scene.joints import Branch, Loop
from erls.scene.joints import Joint as JointRecord
from erls.scene.links import MeshPose

GROUND = "ground"


def stands_on(scene: SceneRecord, k: int) -> int:
    """Number of the link on which joint k stands, -1 for the ground."""
    on = scene.joints[k].on
    if on == GROUND:
        return -1
    return [link.name for link in scene.links].index(on) if on else k - 1


def build_joints(scene: Scene) -> list[Joint]:
    """The joints, on their Denavit-Hartenberg rows and mesh poses; where they stand on a link is not said yet.

    Raises
    ------
    SceneError
        BAD_FIELD: naming file, field, value and remedy.
    """
    record = scene.record
    base = _pose(record.base)
    result: list[Joint] = []
    rows: list[Array] = []  # of each link: where the row of the next joint starts, in its mesh frame
    for k, (joint, link) in enumerate(zip(record.joints, record.links, strict=True)):
        place, parent = f"{scene.path}: joints[{k}]", stands_on(record, k)
        first, second = split(_dh_row(joint, place))
        mesh, in_dh = _pose(link.mesh_pose), link.mesh_pose.frame == "dh"
        start = base if parent < 0 else np.eye(4)
        if joint.branch is not None:
            start = start @ _pose(joint.branch)
        elif parent >= 0:
            start = rows[parent]
        after = second @ mesh if in_dh else mesh
        found = _joint(joint, start @ first, after, Place(scene.folder, place))
        result.append(replace(found, parent=parent))
        rows.append(inverse(mesh) if in_dh else inverse(mesh) @ second)
    return result


def _pose(record: Base | Branch | MeshPose) -> Array:
    return pose(fixed_axes(*np.radians(record.rotation_deg)), np.array(record.position))


def _dh_row(joint: JointRecord, place: str) -> DHRow:
    at = Place(Path(), f"{place}.dh")
    dh = joint.dh
    return DHRow(
        dh.convention,
        at.number("a", dh.a),
        angle(at, "alpha", dh.alpha, dh.alpha_deg),
        at.number("d", dh.d),
        angle(at, "theta", dh.theta, dh.theta_deg),
    )


def _joint(joint: JointRecord, before: Array, after: Array, place: Place) -> Joint:
    freedom = JOINT_TYPES[joint.type].one
    assert freedom is not None
    place = replace(place, revolute=freedom.turns)
    drive = build_drive(joint.drive, place.folder, place.field("drive"), freedom.turns)
    start = place.at("initial")
    position = angle(start, "position", joint.initial.position, joint.initial.position_deg)
    rate = angle(start, "rate", joint.initial.rate, joint.initial.rate_deg)
    if drive.prescribed:
        if any(getattr(joint.initial, f) is not None for f in joint.initial.__struct_fields__):
            raise place.error(
                "initial",
                "a prescribed motion fixes its own start",
                remedy="remove 'initial', or change the motion",
            )
        position, rate, _ = drive.reference(0.0)  # type: ignore[misc]
    forces, rotor = joint_forces(joint, place), reflected_inertia(joint, place)
    return Joint(joint.name, freedom, before, after, forces, rotor, drive, position, rate)


def angle(place: Place, name: str, plain: float | None, degrees: float | None) -> float:
    """A quantity in SI or in degrees; 0 unless given.

    Raises
    ------
    SceneError
        BAD_FIELD: both, degrees where nothing turns, not a finite number.
    """
    if plain is not None and degrees is not None:
        raise place.error(name, f"both {name} and {name}_deg", remedy="keep one")
    if degrees is not None:
        if not place.revolute:
            raise place.error(f"{name}_deg", "degrees at a prismatic joint", degrees, remedy=f"give {name} in metres")
        return math.radians(place.number(f"{name}_deg", degrees))
    return place.number(name, plain or 0.0)


def joint_forces(record: JointRecord | Loop, place: Place) -> JointForces:
    """Spring, damper and friction of a joint.

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    friction, within = record.friction, place.at("friction")
    return JointForces(
        stiffness=place.not_negative("stiffness", record.stiffness),
        rest=angle(place, "rest", record.rest, record.rest_deg),
        damping=place.not_negative("damping", record.damping),
        friction=within.not_negative("force", friction.force) if friction else 0.0,
        transition_rate=within.positive("transition_rate", friction.transition_rate) if friction else 1.0,
    )


def reflected_inertia(record: JointRecord | Loop, place: Place) -> float:
    """Inertia of the rotor on the joint's coordinate [kg m² or kg].

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    motor = place.at("motor")
    inertia = motor.not_negative("rotor_inertia", record.motor.rotor_inertia)
    return inertia * motor.number("gear_ratio", record.motor.gear_ratio) ** 2

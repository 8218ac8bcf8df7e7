"""Joints of a scene on their Denavit-Hartenberg rows, and what acts in them: spring, damper, friction, rotor."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace as replaced

from erls.maths.se3 import inverse, pose
from erls.maths.so3 import Array, fixed_axes
from erls.mechanism.compound_joints import fixed_joint
from erls.mechanism.dh import DHRow, split
from erls.mechanism.drives import PDDrive, build_drive
from erls.mechanism.joint_types import JOINT_TYPES, Freedom
from erls.mechanism.joints import Joint, JointForces
from erls.mechanism.place import Place
from erls.scene.build_contacts import build_stops
from erls.scene.build_friction import build_friction
from erls.scene.chain import Scene, SceneRecord
from erls.scene.joints import Acting, Coordinate, Friction, Loop
from erls.scene.joints import Joint as JointRecord
from erls.scene.records import Pose

GROUND = "ground"


def stands_on(scene: SceneRecord, k: int) -> int:
    """Number of the link on which joint k stands, -1 for the ground."""
    on = scene.joints[k].on
    if on == GROUND:
        return -1
    return [link.name for link in scene.links].index(on) if on else k - 1


def joint_coordinates(joint: JointRecord) -> dict[str, Freedom]:
    """The coordinates of a joint by the names that reports give them."""
    freedoms = JOINT_TYPES[joint.type].given(joint).freedoms or ()
    return {f"{joint.name}/{freedom.name}" if freedom.name else joint.name: freedom for freedom in freedoms}


def with_coordinates(joint: JointRecord, change: Callable[[str, Acting], Acting]) -> JointRecord:
    """A joint with what acts along each of its coordinates changed, by the names of `joint_coordinates`."""
    parts = dict(joint.coordinates)
    for name, freedom in joint_coordinates(joint).items():
        own: Acting = parts.get(freedom.name, Coordinate()) if freedom.name else joint
        changed = change(name, own)
        if isinstance(changed, JointRecord):
            joint = changed
        elif isinstance(changed, Coordinate) and changed is not own:
            parts[freedom.name] = changed
    return replaced(joint, coordinates=parts)


def led_by_inversion(record: SceneRecord) -> tuple[str, ...]:
    """Coordinates of joints whose feed-forward an inversion finds."""
    names: list[str] = []

    def look(name: str, acting: Acting) -> Acting:
        if isinstance(acting.drive, PDDrive) and acting.drive.elastic:
            names.append(name)
        return acting

    for joint in record.joints:
        with_coordinates(joint, look)
    return tuple(names)


def build_joints(scene: Scene) -> list[list[Joint]]:
    """The motions of each joint, on its Denavit-Hartenberg row and mesh pose; at which interface is not said yet.

    Raises
    ------
    SceneError
        BAD_FIELD: naming file, field, value and remedy.
    """
    record = scene.record
    base = _pose(record.base)
    result: list[list[Joint]] = []
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
        found = _motions(joint, start @ first, after, Place(scene.folder, place))
        result.append([replace(found[0], parent=parent), *found[1:]])
        rows.append(inverse(mesh) if in_dh else inverse(mesh) @ second)
    return result


def _pose(record: Pose) -> Array:
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


def _motions(joint: JointRecord, before: Array, after: Array, place: Place) -> list[Joint]:
    """The motions of a joint, one after another."""
    freedoms = joint_coordinates(joint)
    if not freedoms:
        return [fixed_joint(joint.name, before, after)]
    result = []
    for number, (name, freedom) in enumerate(freedoms.items()):
        acting: JointRecord | Coordinate = joint
        at = place
        if freedom.name:
            acting = joint.coordinates.get(freedom.name, Coordinate())
            at = place.at("coordinates").at(freedom.name)
        ends = before if number == 0 else np.eye(4), after if number == len(freedoms) - 1 else np.eye(4)
        result.append(_motion(name, freedom, *ends, acting, at))
    return result


def _motion(
    name: str, freedom: Freedom, before: Array, after: Array, record: JointRecord | Coordinate, place: Place
) -> Joint:
    place = replace(place, revolute=freedom.turns)
    drive = build_drive(record.drive, place.folder, place.field("drive"), freedom.turns)
    position, rate = initial_motion(record, place)
    if drive.prescribed:
        if any(getattr(record.initial, f) is not None for f in record.initial.__struct_fields__):
            raise place.error(
                "initial",
                "a prescribed motion fixes its own start",
                remedy="remove 'initial', or change the motion",
            )
        position, rate, _ = drive.reference(0.0)  # type: ignore[misc]
    forces, rotor = joint_forces(record, place), reflected_inertia(record, place)
    return Joint(name, freedom, before, after, forces, rotor, drive, position, rate)


def initial_motion(record: JointRecord | Coordinate, place: Place) -> tuple[float, float]:
    """Coordinate and rate at the start of a joint that is free to have any.

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    initial, start = record.initial, place.at("initial")
    position = angle(start, "position", initial.position, initial.position_deg)
    return position, angle(start, "rate", initial.rate, initial.rate_deg)


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


def joint_forces(record: JointRecord | Coordinate | Loop, place: Place) -> JointForces:
    """Spring, damper, friction and stops of a joint.

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    return JointForces(
        stiffness=place.not_negative("stiffness", record.stiffness),
        rest=angle(place, "rest", record.rest, record.rest_deg),
        damping=place.not_negative("damping", record.damping),
        stops=build_stops(record.stops, place.at("stops")) if record.stops else None,
        **({} if record.friction is None else _friction(record.friction, place.at("friction"))),
    )


def _friction(record: Friction, within: Place) -> dict[str, Any]:
    """Fields of `JointForces`."""
    found = build_friction(record, within, "force", "static_force")
    return {"friction": found.sliding, "law": found.law, "transition_rate": found.rate, "static": found.static}


def reflected_inertia(record: JointRecord | Coordinate | Loop, place: Place) -> float:
    """Inertia of the rotor on the joint's coordinate [kg m² or kg].

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    motor = place.at("motor")
    inertia = motor.not_negative("rotor_inertia", record.motor.rotor_inertia)
    return inertia * motor.number("gear_ratio", record.motor.gear_ratio) ** 2

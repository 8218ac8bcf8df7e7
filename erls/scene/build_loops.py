"""Closing joints of a scene: their frames on links and ground, where the initial coordinates put them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.se3 import inverse, pose
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.drives import MotionDrive, build_drive
from erls.mechanism.joint_types import JOINT_TYPES, Freedom
from erls.mechanism.loop_turns import turning_signs
from erls.mechanism.loops import Loop, LoopEnd, LoopFreedom
from erls.mechanism.place import Place
from erls.scene.build_joints import angle, joint_forces, reflected_inertia
from erls.scene.bushings import Bushing
from erls.scene.chain import Scene
from erls.scene.joints import Loop as LoopRecord
from fe_import.files.toml import choose

UNCOUNTED = "turns of this joint cannot be counted: joints of the chain between its links turn about other axes"
_RIGHT = 1e-9  # cosine


def build_loops(scene: Scene, mechanism: Mechanism) -> tuple[Loop, ...]:
    """Closing joints of a scene.

    Parameters
    ----------
    scene : Scene
    mechanism : Mechanism
        The chain, without its loops.

    Raises
    ------
    SceneError
        BAD_REFERENCE, BAD_FIELD: naming file, field, value and remedy.
    """
    if not scene.record.loops:
        return ()
    frames = poses(mechanism, np.array([joint.position for joint in mechanism.joints]))
    return tuple(
        _loop(record, mechanism, frames, Place(scene.folder, f"{scene.path}: loops[{k}]"))
        for k, record in enumerate(scene.record.loops)
    )


def _loop(record: LoopRecord, mechanism: Mechanism, frames: list[Array], at: Place) -> Loop:
    place = at.where
    number = [link.name for link in mechanism.links].index(record.link)
    if record.axis is None:  # parallel to the joint that carries the link
        axis = (frames[number] @ inverse(mechanism.joints[number].after))[:3, 2]
    else:
        axis = np.array(record.axis) / np.linalg.norm(record.axis)
    turn = _along(axis) if record.second_axis is None else two_axes(axis, record.second_axis, f"{place}.second_axis")
    inner, outer = ends_of(record, turn, mechanism, frames, place)
    start = frames[number] @ outer.frame
    start[:3, 3] = place_of(mechanism, frames, outer)
    base = inner.frame
    if inner.link is not None:
        base = frames[inner.link] @ pose(position=mechanism.links[inner.link].model.nodes[inner.node]) @ inner.frame
    kind = JOINT_TYPES[record.type].given(record)
    loop = Loop(record.name, kind, inner, outer)
    freedom = kind.driven if isinstance(record.drive, MotionDrive) else kind.one
    if freedom is None:
        return loop
    slide = float((inverse(base) @ start)[2, 3])
    if freedom.pitch:  # frames of a thread coincide where its coordinate is zero
        loop = replace(loop, inner=replace(inner, frame=inner.frame @ pose(position=np.array([0.0, 0.0, slide]))))
    return replace(loop, freedom=_freedom(record, freedom, mechanism, loop, slide, at))


def _freedom(
    record: LoopRecord, freedom: Freedom, mechanism: Mechanism, loop: Loop, slide: float, place: Place
) -> LoopFreedom:
    """``slide``: how far along its axis the outer frame is at the initial joint coordinates."""
    place = replace(place, revolute=freedom.turns)
    zero = 0.0
    if record.coordinate is not None or record.coordinate_deg is not None:
        zero = angle(place, "coordinate", record.coordinate, record.coordinate_deg)
        zero -= 0.0 if freedom.turns else slide
    drive = build_drive(record.drive, place.folder, place.field("drive"), freedom.turns)
    found = LoopFreedom(freedom, zero, joint_forces(record, place), reflected_inertia(record, place), drive)
    if found.counts_turns and not countable(mechanism, loop):
        raise place.error(
            "drive" if drive.kind == "pd" else "stiffness",
            UNCOUNTED,
            remedy="put the spring or controller on a joint of the chain, or drive this one by a torque or a motion",
        )
    return found


def countable(mechanism: Mechanism, loop: Loop) -> bool:
    """Whether joints of the chain tell how often a closing joint has turned."""
    return turning_signs(mechanism, loop)[1]


def ends_of(
    record: LoopRecord | Bushing, turn: Array, mechanism: Mechanism, frames: list[Array], where: str
) -> tuple[LoopEnd, LoopEnd]:
    """Inner and outer end of what connects a link with another one, or with the ground where its node is unless the
    record has a position.

    Parameters
    ----------
    record : Loop or Bushing
        Of the scene.
    turn : (3, 3) array
        Axes of both ends in the world, at the initial joint coordinates.
    mechanism : Mechanism
    frames : list of (4, 4) array
        Poses of its links there.
    where : str

    Raises
    ------
    SceneError
        BAD_REFERENCE, BAD_FIELD.
    """
    names = [link.name for link in mechanism.links]  # those between motions of a joint are not chosen from

    def end(link: str, node: str, field: str) -> LoopEnd:
        number = names.index(link)
        place = turning_node(mechanism, number, node, f"{where}.{field}")
        return LoopEnd(number, place, pose(frames[number][:3, :3].T @ turn))

    outer = end(record.link, record.node, "node")
    if record.to_link:
        return end(record.to_link, record.to_node, "to_node"), outer
    position = place_of(mechanism, frames, outer) if record.position is None else np.array(record.position)
    return LoopEnd(None, 0, pose(turn, position)), outer


def place_of(mechanism: Mechanism, frames: list[Array], end: LoopEnd) -> Array:
    """(3,) where the node of an end is in the world [m]."""
    assert end.link is not None
    frame = frames[end.link]
    return np.asarray(frame[:3, :3] @ mechanism.links[end.link].model.nodes[end.node] + frame[:3, 3])


def turning_node(mechanism: Mechanism, number: int, name: str, where: str) -> int:
    """A node of a link that turns, by its name.

    Raises
    ------
    SceneError
        BAD_REFERENCE, BAD_FIELD.
    """
    model = mechanism.links[number].model
    known = {**{i.name: i.node for i in model.interface_nodes}, **model.node_names}
    choose(name, known, where, SceneError)
    if known[name] not in model.rotation_nodes:
        raise SceneError(
            Cause.BAD_FIELD,
            "this node has no rotation, so it cannot carry a joint",
            where=where,
            value=name,
            remedy="close the loop at an interface of the link",
        )
    return known[name]


def two_axes(first: Array, second: Sequence[float], where: str) -> Array:
    """(3, 3) frame of a universal joint: x along a unit vector, y along the second axis.

    Raises
    ------
    SceneError
        BAD_FIELD: they are not at right angles.
    """
    across = np.array(second) / np.linalg.norm(np.array(second))
    if abs(first @ across) > _RIGHT:
        raise SceneError(
            Cause.BAD_FIELD,
            "the axes of a universal joint must be at right angles",
            where=where,
            value=second,
            remedy="turn one of them",
        )
    return np.stack([first, across, np.cross(first, across)], axis=1)


def _along(axis: Array) -> Array:
    """(3, 3) frame with z along a unit vector and x as near as may be to an axis of the world."""
    near = np.eye(3)[int(np.abs(axis).argmin())]
    x = near - axis * (axis @ near)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])

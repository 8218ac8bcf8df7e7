"""Closing joints of a scene: their frames on links and ground, where the initial coordinates put them."""

from __future__ import annotations

import numpy as np

from erls.errors import Cause, SceneError
from erls.lie.se3 import inverse, pose
from erls.lie.so3 import Array
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.loops import LOOP_TYPES, Loop, LoopEnd
from erls.scene import Loop as LoopRecord
from erls.scene import Scene
from fe_import.toml_file import choose


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
    frames = poses(mechanism, np.array([joint.position for joint in mechanism.joints]))
    return tuple(
        _loop(record, mechanism, frames, f"{scene.path}: loops[{k}]") for k, record in enumerate(scene.record.loops)
    )


def _loop(record: LoopRecord, mechanism: Mechanism, frames: list[Array], place: str) -> Loop:
    names = [link.name for link in mechanism.links]
    number = names.index(record.link)
    node = _node(mechanism, number, record.node, f"{place}.node")
    if record.axis is None:  # parallel to the joint that carries the link
        axis = (frames[number] @ inverse(mechanism.joints[number].after))[:3, 2]
    else:
        axis = np.array(record.axis) / np.linalg.norm(record.axis)
    turn = _along(axis)
    outer = LoopEnd(number, node, pose(frames[number][:3, :3].T @ turn))
    if record.to_link:
        other = names.index(record.to_link)
        to_node = _node(mechanism, other, record.to_node, f"{place}.to_node")
        inner = LoopEnd(other, to_node, pose(frames[other][:3, :3].T @ turn))
    else:
        position = frames[number][:3, :3] @ mechanism.links[number].model.nodes[node] + frames[number][:3, 3]
        inner = LoopEnd(None, 0, pose(turn, position if record.position is None else np.array(record.position)))
    return Loop(record.name, LOOP_TYPES[record.type], inner, outer)


def _node(mechanism: Mechanism, number: int, name: str, where: str) -> int:
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


def _along(axis: Array) -> Array:
    """(3, 3) frame with z along a unit vector and x as near as may be to an axis of the world."""
    near = np.eye(3)[int(np.abs(axis).argmin())]
    x = near - axis * (axis @ near)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])

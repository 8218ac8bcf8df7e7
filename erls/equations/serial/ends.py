"""Frames that loops hold on displaced nodes of links; what `erls.equations.compiled_system` says of ``frames``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.equations.serial.displaced_node import move_node
from erls.equations.serial.records import JOINT, Serial, read_joint
from erls.maths.jit import part
from erls.maths.records import Matrix, Stack, Vector, reader, table_size
from erls.maths.so3 import Array
from erls.maths.spatial import add_motion_cross, compose_poses, transform_motion
from fe_import.model import IntArray


class End(NamedTuple):
    """A frame that a loop holds on a link.

    Attributes
    ----------
    link : int
    position : (3,) array
        Of its node, in the link's frame.
    shapes : (6, n) array
        Displacement and rotation vector of the node per coordinate of the link.
    bows : (6, n, n) array
        Ψ of ½ qᵀ Ψ q, which they gain by second order; no rows where they gain nothing.
    offset : (12,) array
        Pose of the frame from the node.
    """

    link: int
    position: Vector
    shapes: Matrix
    bows: Stack
    offset: Vector


class EndState(NamedTuple):
    """Working memory of such a frame: its node in the link's frame, by pose (12,), twist and its derivative (6,), rows
    (6, n) of the twist over the rates of the link's coordinates; displacement (6,) of the node, forces (6,) on it; a
    spare pose.
    """

    pose: Vector
    twist: Vector
    twist_rate: Vector
    rows: Matrix
    displacement: Vector
    force: Vector
    spare: Vector


def end_state(size: int) -> EndState:
    """Memory for a frame on a link with n = ``size``."""
    six = [np.zeros(6) for _ in range(4)]
    return EndState(np.zeros(12), six[0], six[1], np.zeros((6, size)), six[2], six[3], np.zeros(12))


read_end, read_end_state = reader(End), reader(EndState)
END, END_STATE = table_size(End), table_size(EndState)


@part
def move_end(
    end: End, moved: EndState, q: Array, rate: Array, acceleration: Array, twist: Array, twist_rate: Array, found: Array
) -> None:
    """Motion of an end: its pose in the link's frame, its twist and the derivative of that into ``found``.

    Parameters
    ----------
    end, moved : End, EndState
    q, rate, acceleration : (n,) arrays
        Coordinates of the link and their derivatives.
    twist, twist_rate : (6,) arrays
        Of the link's frame.
    found : (24,) array
    """
    move_node(
        end.position, end.shapes, end.bows, q, rate, acceleration, moved.pose, moved.twist, moved.twist_rate,
        moved.rows, moved.displacement,
    )  # fmt: skip
    carry_end(moved.pose, moved.twist, moved.twist_rate, end.offset, twist, twist_rate, found)


@part
def carry_end(
    pose: Array, own: Array, own_rate: Array, offset: Array, twist: Array, twist_rate: Array, found: Array
) -> None:
    """The same of a node that moves by ``pose`` (12,), ``own`` and ``own_rate`` (6,) in the link's frame."""
    out, rate = found[12:18], found[18:24]
    transform_motion(pose, twist, out)
    transform_motion(pose, twist_rate, rate)
    add_motion_cross(out, own, 1.0, rate)
    for i in range(6):
        out[i] += own[i]
        rate[i] += own_rate[i]
    transform_motion(offset, out, out)
    transform_motion(offset, rate, rate)
    compose_poses(pose, offset, found[:12])


@part
def column_of(serial: Serial, reals: Array, integers: IntArray, k: int, n: int) -> int:
    """Of joint k in rows over velocities and, from column n on, the rates of prescribed joints."""
    place = read_joint(reals, integers, serial.joints + k * JOINT).place
    if place >= 0:
        return place
    column = n
    for j in range(k):
        if read_joint(reals, integers, serial.joints + j * JOINT).place < 0:
            column += 1
    return column

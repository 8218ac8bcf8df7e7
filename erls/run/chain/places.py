"""Where the nodes of a chain's links are."""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.equations.formulation import State
from erls.equations.serial.state_series import StateSeries
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, poses


def node_positions(
    mechanism: Mechanism,
    state: State | StateSeries,
    link: int,
    nodes: Any = slice(None),
    magnification: float = 1.0,
) -> Array:
    """(..., n, 3) world positions of nodes of a link, at the time of a state or at all those of a series.

    Parameters
    ----------
    mechanism : Mechanism
    state : State or StateSeries
    link : int
    nodes : index array or slice
    magnification : float
        Of the displacement against the rigid chain at the same joint coordinates; 1 is true.
    """
    if magnification != 1.0:
        rigid = rigid_positions(mechanism, state, link, nodes)
        return np.asarray(rigid + magnification * (node_positions(mechanism, state, link, nodes) - rigid))
    if state.nodes is not None:
        return np.asarray(state.nodes[link][..., nodes, :])
    model = mechanism.links[link].model
    moved = np.tensordot(state.modal[link], model.translation_shapes[nodes], ([-1], [2]))
    second_order = mechanism.links[link].second_order if "foreshortening" in mechanism.effects else None
    if second_order is not None:
        moved = moved + second_order.displacements(np.arange(len(model.nodes))[nodes], state.modal[link])
    return _placed(state.poses[link], model.nodes[nodes] + moved)


def rigid_positions(mechanism: Mechanism, state: State | StateSeries, link: int, nodes: Any = slice(None)) -> Array:
    """(..., n, 3) world positions of nodes of a link in the Equivalent Rigid Link System: `rigid_frames`."""
    return _placed(rigid_frames(mechanism, state)[link], mechanism.links[link].model.nodes[nodes])


def surface_positions(
    mechanism: Mechanism, state: State | StateSeries, link: int, points: Array, magnification: float = 1.0
) -> Array:
    """(..., n, 3) world positions of points (n, 3) that ride on a rigid link, given in its mesh frame; see
    `node_positions`.
    """
    if magnification == 1.0:
        return _placed(state.poses[link], points)
    rigid = _placed(rigid_frames(mechanism, state)[link], points)
    return np.asarray(rigid + magnification * (_placed(state.poses[link], points) - rigid))


def rigid_frames(mechanism: Mechanism, state: State | StateSeries) -> list[Array]:
    """(..., 4, 4) frames of all links in the rigid chain at the same joint coordinates; where only the places of nodes
    are known, those that come nearest to them.
    """
    if state.nodes is not None:
        return list(state.poses)
    return poses(mechanism, state.coordinates)


def _placed(frame: Array, local: Array) -> Array:
    return np.asarray(local @ np.swapaxes(frame[..., :3, :3], -1, -2) + frame[..., None, :3, 3])


def point_position(mechanism: Mechanism, state: State | StateSeries, number: int) -> Array:
    """(..., 3) world position of named point ``number``."""
    point = mechanism.points[number]
    return np.asarray(node_positions(mechanism, state, point.link, np.array([point.node]))[..., 0, :])


def watched_nodes(mechanism: Mechanism) -> tuple[tuple[int, int], ...]:
    """(link, node) of the named points; without any, of every link where joints stand on it, or its farthest node."""
    if mechanism.points:
        return tuple((p.link, p.node) for p in mechanism.points)
    result = []
    for k, link in enumerate(mechanism.links):
        far = np.linalg.norm(link.model.nodes - link.inboard.position, axis=1).argmax()
        seats = [mechanism.joints[outer].seat for outer in mechanism.standing_on(k)]
        result += [(k, seat.node) for seat in seats if seat is not None] or [(k, int(far))]
    return tuple(result)

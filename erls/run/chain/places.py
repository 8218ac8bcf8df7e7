"""Where the nodes of a chain's links are."""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.equations.formulation import State
from erls.equations.serial.state_series import StateSeries
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism


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
        Of the elastic and rigid-body displacement against the Equivalent Rigid Link System; 1 is true.
    """
    model, frame = mechanism.links[link].model, state.poses[link]
    turn, place = np.swapaxes(frame[..., :3, :3], -1, -2), frame[..., None, :3, 3]
    if state.nodes is not None:
        undeformed = model.nodes[nodes] @ turn + place
        return np.asarray(undeformed + magnification * (state.nodes[link][..., nodes, :] - undeformed))
    moved = np.tensordot(state.modal[link], model.translation_shapes[nodes], ([-1], [2]))
    second_order = mechanism.links[link].second_order if "foreshortening" in mechanism.effects else None
    if second_order is not None:
        moved = moved + second_order.displacements(np.arange(len(model.nodes))[nodes], state.modal[link])
    local = model.nodes[nodes] + magnification * moved
    return np.asarray(local @ turn + place)


def point_position(mechanism: Mechanism, state: State | StateSeries, number: int) -> Array:
    """(..., 3) world position of named point ``number``."""
    point = mechanism.points[number]
    return np.asarray(node_positions(mechanism, state, point.link, np.array([point.node]))[..., 0, :])

"""Loads and contacts of a scene along a motion, in the world."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from erls.equations.formulation import ContactSeries
from erls.equations.serial.state_series import StateSeries
from erls.maths.rotation_maps import exp
from erls.maths.so3 import Array, cross_all
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import node_shape6
from erls.mechanism.loads import CENTRE, PointLoad


def wrenches(mechanism: Mechanism, load: PointLoad, series: StateSeries) -> Array:
    """(k, 2, 3) force [N] and moment [N m] of a load on its node at the times of a series, or force per mass [N/kg];
    world axes.
    """
    given = np.array([load.at(t) for t in series.times.tolist()]).reshape(-1, 2, 3)
    if load.axes is None:
        return given
    link, node = load.axes
    _, rotation = node_shape6(mechanism.links[link].model, node)
    turns = series.poses[link][:, :3, :3] @ exp(series.modal[link] @ rotation.T)
    return np.asarray(np.einsum("kij,kmj->kmi", turns, given))


def pull(mechanism: Mechanism, number: int, series: StateSeries) -> Array:
    """(k, 3) gravity and forces per mass on a link [m/s²], world axes."""
    result = np.tile(mechanism.gravity, (len(series.times), 1))
    for load in mechanism.loads:
        if load.link == number and load.node == CENTRE:
            result += wrenches(mechanism, load, series)[:, 0]
    return result


def pushes(
    mechanism: Mechanism, found: ContactSeries, series: StateSeries
) -> Iterator[tuple[int, int, Array, Array, Array]]:
    """Link and node on either side of each contact, and at the times of a series what acts there: force [N] and moment
    [N m] on the node, and its place, (k, 3) each in the world.
    """
    for number, contact in enumerate(mechanism.contacts):
        force, place = found.force[:, number], found.place[:, number]
        yield contact.link, contact.node, force, np.zeros_like(force), place
        if contact.base is not None:
            link, node = contact.base
            model = mechanism.links[link].model
            local = model.nodes[node] + series.modal[link] @ model.translation_shapes[node].T
            frames = series.poses[link]
            at = np.einsum("kij,kj->ki", frames[:, :3, :3], local) + frames[:, :3, 3]
            yield link, node, -force, cross_all(place - at, -force), at

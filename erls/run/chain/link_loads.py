"""Loads on one link during a motion, in the axes of its mesh frame: joints, loads of the scene, what it carries, how
fast it turns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.maths.so3 import Array, cross_all
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Payload
from erls.mechanism.loops import LoopEnd
from erls.mechanism.sensors.base import Node
from erls.run.chain.instants import Instants
from erls.run.chain.loads import wrenches


@dataclass(frozen=True)
class LinkLoads:
    """Modal coordinates and loads of a link at k times.

    Attributes
    ----------
    modal : (k, m) array
    interfaces : (k, 6 i) array
        Force [N] and moment [N m] on each interface node, mesh axes.
    omega : (k, 3) array
        Angular velocity of the link's frame, mesh axes [rad/s].
    """

    modal: Array
    interfaces: Array
    omega: Array


def link_loads(seen: Instants, number: int) -> LinkLoads:
    """Loads on link ``number``: joint reactions, loads of the scene, weight and inertia of payloads and motors on its
    interfaces. A payload or a load elsewhere on the link is left to the modes.

    Parameters
    ----------
    seen : Instants
    number : int
    """
    link = seen.formulation.mechanism.links[number]
    nodes = [i.node for i in link.model.interface_nodes]
    loads = np.zeros((len(seen.t), len(nodes), 2, 3))  # force and moment, world axes
    _add_joints(seen, number, nodes, loads)
    for load in seen.formulation.mechanism.loads:
        if load.link == number and load.node in nodes:
            loads[:, nodes.index(load.node)] += wrenches(seen.formulation.mechanism, load, seen.motion.states)
    for payload in link.payloads:
        if payload.node in nodes:
            loads[:, nodes.index(payload.node)] += _weight_and_inertia(seen, number, payload)
    states = seen.motion.states
    found = loads @ states.poses[number][:, None, :3, :3]
    return LinkLoads(states.modal[number], found.reshape(len(seen.t), -1), seen.motion.twists[number][:, 3:])


def _add_joints(seen: Instants, number: int, nodes: list[int], loads: Array) -> None:
    """What joints and closing ones do to the interfaces of a link."""
    mechanism, reactions = seen.formulation.mechanism, seen.reactions
    link = mechanism.links[number]
    own = nodes.index(link.inboard.node)
    loads[:, own, 0] += reactions.force[:, number]
    loads[:, own, 1] += reactions.moment[:, number]
    for outer in mechanism.standing_on(number):
        seat, force = mechanism.joints[outer].seat, reactions.force[:, outer]
        assert seat is not None
        arm = _place(seen, Node(outer, mechanism.links[outer].inboard.node)) - _place(seen, Node(number, seat.node))
        loads[:, nodes.index(seat.node), 0] -= force
        loads[:, nodes.index(seat.node), 1] -= reactions.moment[:, outer] + cross_all(arm, force)
    for k, loop in enumerate(mechanism.loops):
        for end, sign in ((loop.outer, 1.0), (loop.inner, -1.0)):
            if end.link != number or end.node not in nodes:
                continue
            force, moment = (
                np.array([getattr(every[k], what) for every in seen.loop_forces]) for what in ("force", "moment")
            )
            arm = _end(seen, mechanism, loop.outer) - _place(seen, Node(number, end.node))
            loads[:, nodes.index(end.node), 0] += sign * force
            loads[:, nodes.index(end.node), 1] += sign * (moment + cross_all(arm, force))


def _end(seen: Instants, mechanism: Mechanism, end: LoopEnd) -> Array:
    """(k, 3) world position of the frame of a closing joint, which sits on its node."""
    if end.link is None:
        return np.tile(end.frame[:3, 3], (len(seen.t), 1))
    return _place(seen, Node(end.link, end.node))


def _place(seen: Instants, node: Node) -> Array:
    """(k, 3) world position of a node."""
    return seen.node(node).place


def _weight_and_inertia(seen: Instants, number: int, body: Payload) -> Array:
    """(k, 2, 3) what a carried body does to its interface node: its weight minus its rate of momentum, world axes."""
    moved = seen.node(Node(number, body.node))
    offset = moved.turn @ body.offset
    centre = moved.acceleration + cross_all(moved.spin_rate, offset)
    centre = centre + cross_all(moved.spin, cross_all(moved.spin, offset))
    force = body.mass * (seen.pull(number) - centre)
    inertia = moved.turn @ body.inertia @ moved.turn.transpose(0, 2, 1)
    momentum = np.einsum("kij,kj->ki", inertia, moved.spin)
    turning = np.einsum("kij,kj->ki", inertia, moved.spin_rate) + cross_all(moved.spin, momentum)
    return np.stack([force, cross_all(offset, force) - turning], axis=1)

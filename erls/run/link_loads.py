"""Loads on one link during a run, in the axes of its mesh frame: joints, loads of the scene, what it carries, how fast
it turns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.equations.formulation import State
from erls.equations.serial.state_series import StateSeries
from erls.integrate.base import hermite
from erls.maths.so3 import Array, cross, skew
from erls.mechanism.links import node_shape6
from erls.mechanism.loops import LoopEnd
from erls.run.chain.loads import pull, pushes, wrenches
from erls.run.chain.run import ChainRun

_STEP = 1e-5  # s, of central differences: 1e-6 m/s² of rounding, and below 1 kHz 3e-4 of the acceleration


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


@dataclass(frozen=True)
class _Carried:
    """A rigid body (payload or motor) on an interface."""

    interface: int
    mass: float
    offset: Array
    inertia: Array


def link_loads(run: ChainRun, number: int, times: Array) -> LinkLoads:
    """Loads on link ``number`` at times (k,): joint reactions, loads of the scene, weight and inertia of payloads and
    motors on its interfaces. A payload or a load elsewhere on the link is left to the modes.

    Parameters
    ----------
    run : ChainRun
    number : int
    times : (k,) array
        Within the run [s].
    """
    series = run.series(times)
    states = series.states()
    step = min(_STEP, (run.end - float(run.solution.t[0])) / 4)
    middle = np.clip(times, run.solution.t[0] + step, run.end - step)
    before, at, after = (run.states(middle + shift) for shift in (-step, 0.0, step))
    loads = _joint_loads(run, number, times, states) + _given_loads(run, number, series)
    omega, pulls = np.empty((len(times), 3)), pull(run.formulation.mechanism, number, series)
    for k, three in enumerate(zip(before, at, after, strict=True)):
        omega[k] = _omega(three, number, step)
        for body in _carried(run, number):
            loads[k, body.interface] += _weight_and_inertia(run, number, body, three, omega[k], pulls[k], step)
    modal = np.array([s.modal[number] for s in states]).reshape(len(times), -1)
    return LinkLoads(modal, loads.reshape(len(times), -1), omega)


def _joint_loads(run: ChainRun, number: int, times: Array, states: list[State]) -> Array:
    """(k, i, 6) what the joints do to the interfaces of a link."""
    mechanism = run.formulation.mechanism
    link = mechanism.links[number]
    names = [i.name for i in link.model.interface_nodes]
    result = np.zeros((len(times), len(names), 6))
    force, moment = run.reaction(mechanism.joints[number].name, times)
    for k, state in enumerate(states):
        turn = state.poses[number][:3, :3].T
        result[k, names.index(link.inboard.name)] += np.concatenate([turn @ force[k], turn @ moment[k]])
    for outer in mechanism.standing_on(number):
        seat = mechanism.joints[outer].seat
        assert seat is not None
        force, moment = run.reaction(mechanism.joints[outer].name, times)
        for k, state in enumerate(states):
            turn = state.poses[number][:3, :3].T
            arm = _place(run, state, outer, mechanism.links[outer].inboard.node)
            arm = arm - _place(run, state, number, seat.node)
            about = moment[k] + cross(arm, force[k])
            result[k, names.index(seat.name)] -= np.concatenate([turn @ force[k], turn @ about])
    for loop in mechanism.loops:
        for end, sign in ((loop.outer, 1.0), (loop.inner, -1.0)):
            nodes = [i.node for i in link.model.interface_nodes]
            if end.link != number or end.node not in nodes:
                continue
            force, moment = run.loop_reaction(loop.name, times)
            for k, state in enumerate(states):
                turn = state.poses[number][:3, :3].T
                arm = _end(run, state, loop.outer) - _place(run, state, number, end.node)
                about = moment[k] + cross(arm, force[k])
                result[k, nodes.index(end.node)] += sign * np.concatenate([turn @ force[k], turn @ about])
    return result


def _given_loads(run: ChainRun, number: int, series: StateSeries) -> Array:
    """(k, i, 6) what loads and contacts of the scene do to the interfaces of a link."""
    mechanism = run.formulation.mechanism
    nodes = [i.node for i in mechanism.links[number].model.interface_nodes]
    result = np.zeros((len(series.times), len(nodes), 6))
    for load in mechanism.loads:
        if load.link == number and load.node in nodes:
            found = wrenches(mechanism, load, series) @ series.poses[number][:, :3, :3]
            result[:, nodes.index(load.node)] += found.reshape(-1, 6)
    if not mechanism.contacts:
        return result
    solution, t = run.solution, series.times
    at = hermite(solution.t, solution.y, solution.v, solution.a, t)
    for link, node, force, moment, _ in pushes(mechanism, run.formulation.contact_series(t, *at), series):
        if link == number and node in nodes:
            found = np.stack([force, moment], axis=1) @ series.poses[number][:, :3, :3]
            result[:, nodes.index(node)] += found.reshape(-1, 6)
    return result


def _end(run: ChainRun, state: State, end: LoopEnd) -> Array:
    """(3,) world position of the frame of a closing joint, which sits on its node."""
    return end.frame[:3, 3] if end.link is None else _place(run, state, end.link, end.node)


def _place(run: ChainRun, state: State, number: int, node: int) -> Array:
    """(3,) world position of a node."""
    model, frame = run.formulation.mechanism.links[number].model, state.poses[number]
    local = model.nodes[node] + model.translation_shapes[node] @ state.modal[number]
    return np.asarray(frame[:3, :3] @ local + frame[:3, 3])


def _carried(run: ChainRun, number: int) -> list[_Carried]:
    """Payloads on interface nodes of a link, and the motors of the joints on it."""
    link = run.formulation.mechanism.links[number]
    nodes = [i.node for i in link.model.interface_nodes]
    return [_Carried(nodes.index(p.node), p.mass, p.offset, p.inertia) for p in link.payloads if p.node in nodes]


def _omega(three: tuple[State, State, State], number: int, step: float) -> Array:
    """(3,) angular velocity of a link's frame, in its axes, from its turn over two steps."""
    before, _, after = (s.poses[number][:3, :3] for s in three)
    turn = before.T @ after
    return np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (4 * step)


def _weight_and_inertia(
    run: ChainRun, number: int, body: _Carried, three: tuple[State, State, State], omega: Array, gravity: Array,
    step: float,
) -> Array:  # fmt: skip
    """(6,) what a carried body does to its interface node: its weight minus its rate of momentum, mesh axes."""
    model = run.formulation.mechanism.links[number].model
    node = model.interface_nodes[body.interface].node
    translation, rotation = node_shape6(model, node)
    shape = translation - skew(body.offset) @ rotation
    centres, turned, frames = [], [], []
    for state in three:
        frame, q = state.poses[number], state.modal[number]
        frames.append(frame[:3, :3])
        centres.append(frame[:3, :3] @ (model.nodes[node] + body.offset + shape @ q) + frame[:3, 3])
        turned.append(rotation @ q)
    pulled = gravity - (centres[0] - 2 * centres[1] + centres[2]) / step**2
    force = body.mass * (frames[1].T @ pulled)
    spin = omega + (turned[2] - turned[0]) / (2 * step)
    faster = frames[1].T @ frames[2], frames[1].T @ frames[0]  # [α] + [ω]² = (R₊ - 2 R + R₋) / h² in the frame's axes
    twice = (faster[0] + faster[1] - 2 * np.eye(3)) / step**2
    alpha = np.array([twice[2, 1] - twice[1, 2], twice[0, 2] - twice[2, 0], twice[1, 0] - twice[0, 1]]) / 2
    alpha = alpha + (turned[0] - 2 * turned[1] + turned[2]) / step**2
    moment = cross(body.offset, force) - body.inertia @ alpha - cross(spin, body.inertia @ spin)
    return np.concatenate([force, moment])

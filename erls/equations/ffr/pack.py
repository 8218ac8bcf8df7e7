"""The records of a mechanism of floating frames, put into memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from erls.equations.compiled_system import CompiledSystem, Factoring, acceleration_in, function_in
from erls.equations.ffr import records
from erls.equations.ffr.records import BentBody, Body, End, EndRoom, Frames, Room, bent_state, body_state
from erls.equations.ffr.standard_data import StandardData
from erls.equations.serial import pack
from erls.equations.serial.condensed import condensed
from erls.equations.serial.contacts import put_contacts
from erls.equations.serial.decoupled_modes import MIXING, decoupled_modes
from erls.equations.serial.loads import put_loads
from erls.equations.serial.modal_inertia import modal_inertia
from erls.equations.serial.modal_inertia_kernels import Warp, warp_record, warp_state
from erls.equations.serial.nodes import RESTING, Node, node_record, node_state
from erls.equations.serial.records import Serial
from erls.equations.serial.segments import segment
from erls.maths.calls import address_for
from erls.maths.records import Memory
from erls.maths.se3 import pose, twist_transform
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.loops import LoopEnd
from fe_import.model import InterfaceNode

DENSE = 60  # coordinates up to which dense factors cost less than elimination link by link


@dataclass(frozen=True)
class Given:
    """What is packed.

    Attributes
    ----------
    mechanism : Mechanism
    bases : list of (6 + e, e) arrays
        Of every link, see `erls.equations.ffr.body_frame.elastic_basis`.
    data : list of StandardData
        Of every link.
    floats : bool
        Whether inboard nodes move in the floating frames.
    stiffened : bool
        Whether links have second-order displacements.
    ends : list of (link, LoopEnd)
        Frames that loops hold, or whatever else ties links.
    every_axis : bool
        Count all moments on frames that turn about one axis only, which no joint feels.
    absolute : bool
        For links that float freely, see `erls.equations.ffr.floating`.
    """

    mechanism: Mechanism
    bases: list[Array]
    data: list[StandardData]
    floats: bool
    stiffened: bool
    ends: list[tuple[int, LoopEnd]]
    every_axis: bool = False
    absolute: bool = False

    @property
    def parents(self) -> list[int]:
        """Of every link."""
        return list(self.mechanism.parents)

    def bent(self, k: int) -> bool:
        """Whether a link has second-order displacements."""
        link = self.mechanism.links[k]
        return self.stiffened and link.elastic_modes > 0 and link.second_order is not None


def _node(given: Given, k: int, node: int) -> Node:
    return node_record(k, given.mechanism.links[k], given.bases[k], node, given.bent(k))


def _end(node: Node, number: int, end: LoopEnd) -> End:
    """A frame that a loop holds; a node that rests in its floating frame has its place within the offset."""
    offset = end.frame if node.moves else pose(position=node.position) @ end.frame
    return End(node.link, number, pack.pose_numbers(offset))


def _interface(given: Given, k: int, interface: InterfaceNode | None) -> Node:
    return RESTING if k < 0 or interface is None else _node(given, k, interface.node)


class _Nodes(NamedTuple):
    """Nodes of a link, and the poses before and behind its joint, from node to node."""

    base: Node
    inner: Node
    before: Array
    after: Array


def _nodes(given: Given, k: int) -> _Nodes:
    mechanism, parent = given.mechanism, given.parents[k]
    joint, link = mechanism.joints[k], mechanism.links[k]
    base = _interface(given, parent, joint.seat)
    inner = _interface(given, k, link.inboard if given.floats else None)
    before, after = joint.before, joint.after
    if base.moves:
        before = pose(position=-base.position) @ before
    if inner.moves:
        after = after @ pose(position=inner.position)
    return _Nodes(base, inner, before, after)


def _axes(given: Given, k: int) -> Array:
    """(axes, 3) about which the frame of a link turns: on the ground that of its joint alone; behind a link, on mean
    axes, or with a corrected twist all three.
    """
    joint = given.mechanism.joints[k]
    floats = given.floats and given.data[k].size
    if joint.freedom.vector or given.every_axis or given.parents[k] >= 0 or given.bent(k) or floats:
        return np.eye(3)
    return joint.screw[None, 3:] if joint.freedom.turns else np.zeros((0, 3))


def _body(given: Given, k: int) -> Body:
    data, axes = given.data[k], _axes(given, k)
    turned = np.einsum("ca,aij->cij", axes, data.turned)
    square = np.einsum("ca,db,abij->cdij", axes, axes, data.square)
    pairs = [(i, i) for i in range(len(axes))] + ([(0, 1), (0, 2), (1, 2)] if len(axes) == 3 else [])
    symmetric = [(square[i, j] + square[j, i]) / 2 for i, j in pairs]
    warped = "modal_inertia" in given.mechanism.effects
    return Body(
        parent=given.parents[k],
        bent=int(given.bent(k)),
        warped=int(given.bent(k) and warped),
        mass=data.mass,
        moment=data.first_moment,
        rigid=data.rigid,
        coupling=data.coupling,
        axes=axes,
        half=np.einsum("ca,aij->cij", axes, data.half),
        turned=turned.transpose(0, 2, 1),
        gyroscopic=turned.transpose(0, 2, 1) - turned,
        square=np.array(symmetric).reshape(len(pairs), data.size, data.size),
    )


def _bent_body(given: Given, k: int) -> BentBody:
    empty = np.zeros((0, 0))
    if not given.bent(k):
        return BentBody(empty, empty, empty, empty)
    link, basis, e = given.mechanism.links[k], given.bases[k], given.data[k].size
    assert link.second_order is not None
    bend = basis.T @ link.second_order.momentum @ basis
    spin = (basis.T @ link.second_order.spin @ basis).reshape(9, e, e)
    skew = bend[3:] - bend[3:].transpose(0, 2, 1)
    return BentBody(
        bend=bend.transpose(1, 0, 2).reshape(e, 6 * e),
        spin=spin.transpose(2, 0, 1).reshape(e, 9 * e),
        skew=skew.transpose(1, 0, 2).reshape(e, 3 * e),
        per_mass=np.asarray(np.linalg.inv(given.data[k].rigid), dtype=float),
    )


def _warp(given: Given, k: int) -> Warp:
    link, effects = given.mechanism.links[k], given.mechanism.effects
    return warp_record(modal_inertia(link, effects, given.bases[k]) if given.bent(k) else None)


class _Sizes(NamedTuple):
    """Of a link's segment: elastic coordinates, extra rows, ports on its parent."""

    modes: int
    extra: int
    ports: int


def _sizes(given: Given, bodies: Sequence[Body], nodes: Sequence[_Nodes]) -> list[_Sizes]:
    result = []
    for k, (body, found) in enumerate(zip(bodies, nodes, strict=True)):
        e = given.data[k].size
        extra = 6 * bool(found.inner.moves or body.bent) + e * body.warped
        result.append(_Sizes(e, extra, 6 if found.base.moves else 0))
    return result


def pack_frames(given: Given, dense: int = DENSE) -> CompiledSystem:
    """The compiled form of a mechanism.

    Parameters
    ----------
    given : Given
    dense : int
        Coordinates up to which iteration matrices get dense factors. Beyond, they are solved link by link, with the
        damping that couples elastic coordinates of a link left out of them where that hardly slows iterations down.
    """
    mechanism, parents, links = given.mechanism, given.parents, range(len(given.mechanism.links))
    integers = [0]
    constants, working, factors = Memory(integers), Memory(integers), Memory(integers)
    prescribed = np.array([joint.drive.prescribed for joint in mechanism.joints], dtype=bool)
    free = int(np.count_nonzero(~prescribed))
    size = free + sum(data.size for data in given.data)
    decoupled = [
        decoupled_modes(data.elastic, link.stiffness, link.damping)
        for data, link in zip(given.data, mechanism.links, strict=True)
    ]
    linked = size > dense and not mechanism.contacts and max(found.mixing for found in decoupled) < MIXING
    nodes, bodies = [_nodes(given, k) for k in links], [_body(given, k) for k in links]
    bent = any(body.bent for body in bodies)
    places = np.where(prescribed, -1, np.cumsum(~prescribed) - 1)
    joints = [
        pack.joint_record(
            constants,
            joint,
            int(places[k]),
            pack.step_parts(nodes[k].before, joint.freedom, nodes[k].after),
            twist_transform(nodes[k].after) @ joint.freedom.screw,
        )
        for k, joint in enumerate(mechanism.joints)
    ]
    firsts = free + np.cumsum([0, *(data.size for data in given.data)])
    modes = [pack.modes_record(int(firsts[k]), given.data[k].elastic, mechanism.links[k], decoupled[k]) for k in links]
    rigid_links, rigid_states = pack.rigid_links(mechanism, constants, working)
    pairs = [node for found in nodes for node in (found.base, found.inner)]
    ends, own_nodes = given.ends, len(pairs)
    pairs += [_node(given, k, end.node) for k, end in ends]
    sizes = _sizes(given, bodies, nodes)
    none = _Sizes(0, 0, 0)
    segments = []
    for k in links:
        before = sizes[parents[k]] if parents[k] >= 0 else none
        six = 6 if parents[k] >= 0 else 0
        segments.append(segment(parents[k], 6, sizes[k].modes, six, before.modes, sizes[k].ports, sizes[k].extra))
    condensed_at = factors.put_all(condensed(segments) if linked else [])
    room = Room(np.zeros((size, size)), np.zeros(0))
    if linked:
        room = Room(np.zeros((0, 0)), np.zeros(len(factors.numbers)))
    frames = Frames(
        bodies=constants.put_all(bodies),
        body_states=working.put_all([body_state(sizes[k].modes, len(bodies[k].axes)) for k in links]),
        nodes=constants.put_all(pairs),
        node_states=working.put_all([node_state(n.shapes.shape[1], len(n.second_order) > 0) for n in pairs]),
        node_count=own_nodes,
        end_count=len(ends),
        ends=constants.put_all([_end(pairs[own_nodes + i], own_nodes + i, end) for i, (_, end) in enumerate(ends)]),
        end_room=working.put(EndRoom(np.zeros(12), np.zeros(6), np.zeros(6))),
        bent_bodies=constants.put_all([_bent_body(given, k) for k in links]),
        bent_states=working.put_all([bent_state(sizes[k].modes if b.bent else 0) for k, b in enumerate(bodies)]),
        warps=constants.put_all([_warp(given, k) for k in links]),
        warp_states=working.put_all([warp_state(sizes[k].modes * b.warped) for k, b in enumerate(bodies)]),
        bend_link=address_for(records.call_bend_link, bent),
        correct_twist=address_for(records.call_correct_twist, bent),
        bent_forces=address_for(records.call_bent_forces, bent),
        correct_arrival=address_for(records.call_correct_arrival, bent),
        segments=working.put_all(segments),
        decoupled=working.put_all(segments if linked else []),
        condensed=condensed_at,
        room=working.put(room),
        free=free,
        **pack.effect_flags(mechanism.effects),
        weight=int(bool(np.any(mechanism.gravity))),
    )
    own = constants.put(frames)
    residual = function_in(f"erls.equations.ffr.{'floating' if given.absolute else 'residual'}", "residual")()
    velocities = size - free + 6 * len(links) if given.absolute else size
    integers[0] = constants.put(
        Serial(
            links=len(mechanism.links),
            joints=constants.put_all(joints),
            joint_states=pack.joint_states(working, len(joints)),
            modes=constants.put_all(modes),
            **pack.addresses(mechanism, records.call_floating_loads if given.absolute else records.call_loads),
            rigid_links=rigid_links,
            rigid_states=rigid_states,
            **put_loads(mechanism, given.bases, [given.bent(k) for k in links], constants, working),
            **put_contacts(mechanism, residual, velocities, constants, working),
            own=own,
            gravity=mechanism.gravity,
        )
    )
    accelerate, factoring = "erls.equations.ffr.acceleration", None
    if linked:
        from erls.equations.ffr import link_by_link  # here: it is compiled on its own

        accelerate = "erls.equations.ffr.link_by_link"
        factoring = Factoring(
            len(factors.numbers),
            link_by_link.factor,
            link_by_link.solve,
            link_by_link.factor_complex,
            link_by_link.solve_complex,
        )
    return CompiledSystem(
        size=size,
        reals=constants.numbers,
        integers=np.array(integers, dtype=np.int64),
        scratch=working.numbers,
        residual=residual,
        mass_matrix=function_in("erls.equations.ffr.mass", "mass_matrix")(),
        stiffness_and_damping=function_in("erls.equations.serial.stiffness", "stiffness_and_damping")(),
        load_acceleration=acceleration_in(accelerate),
        factoring=factoring,
        load_frames=function_in("erls.equations.ffr.ends", "frames"),
    )

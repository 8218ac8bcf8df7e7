"""A chain in the paper's dense form: its constants and memory as records, its compiled functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from erls.equations.compiled_system import CompiledSystem, acceleration_in
from erls.equations.erls.paper.records import (
    Balance,
    BentBody,
    Body,
    BodyState,
    JointRows,
    Paper,
    bent_state,
    body_state,
    elimination,
    row_state,
)
from erls.equations.erls.paper.second_order_compatibility import frame_second_order
from erls.equations.serial.modal_inertia import modal_inertia
from erls.equations.serial.pack import joint_record, joint_states, rigid_links, step_parts
from erls.equations.serial.records import Joint, Modes, Serial
from erls.maths.records import Memory
from erls.maths.se3 import inverse, twist_cross
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link
from erls.mechanism.thermal import elastic_rest
from fe_import.model import InterfaceNode

GAUGES = ("joint-angle", "minimum-norm")
_NO_INERTIA = 1e-12  # of the largest: a massless link has no direction to divide by
_NONE = np.zeros((0, 0, 0))


def is_stiffened(mechanism: Mechanism) -> bool:
    """Whether links have displacements of second order."""
    return "geometric_stiffening" in mechanism.effects and any(
        link.second_order is not None and link.elastic_modes for link in mechanism.links
    )


def _frame_second_order(link: Link, interface: InterfaceNode, frame: Array) -> Array:
    """See `frame_second_order`; of no entries where there is none."""
    found = frame_second_order(link, interface, frame)
    return _NONE if found is None else found


def joint_rows(mechanism: Mechanism, gauge: str, curved: bool) -> list[JointRows]:
    """Constant blocks of the compatibility condition of every joint.

    Parameters
    ----------
    mechanism : Mechanism
    gauge : str
        ``"joint-angle"``: all six rows of a joint; ``"minimum-norm"``: five, six where its motion is prescribed.
    curved : bool
        Whether displacements of second order count.
    """
    result: list[JointRows] = []
    first = 0
    for k, (joint, link) in enumerate(zip(mechanism.joints, mechanism.links, strict=True)):
        own = link.interface_shape(link.inboard, inverse(joint.after))
        own_second = _frame_second_order(link, link.inboard, inverse(joint.after)) if curved else _NONE
        previous, previous_second = np.zeros((6, 0)), _NONE
        if k > 0:
            before = mechanism.links[k - 1]
            assert joint.seat is not None
            previous = before.interface_shape(joint.seat, joint.before)
            previous_second = _frame_second_order(before, joint.seat, joint.before) if curved else _NONE
        all_rows = gauge == "joint-angle" or joint.drive.prescribed
        free_row = -1 if all_rows else joint.freedom.row
        count = 6 if all_rows else 5
        bracket, slides = twist_cross(joint.freedom.screw), int(not joint.freedom.turns)
        rows = JointRows(k - 1, first, free_row, slides, count, bracket, own, previous, own_second, previous_second)
        result.append(rows)
        first += count
    return result


def _joints(mechanism: Mechanism, constants: Memory) -> list[Joint]:
    result, place = [], 0
    for joint in mechanism.joints:
        step = step_parts(joint.before, joint.freedom, joint.after)
        prescribed = joint.drive.prescribed
        result.append(joint_record(constants, joint, -1 if prescribed else place, step, joint.screw))
        place += not prescribed
    return result


def _modes(mechanism: Mechanism, first: int) -> list[Modes]:
    """Elastic coordinates, which are not decoupled: matrices are dense."""
    result, none = [], np.zeros(0)
    for link in mechanism.links:
        mass = link.invariants.m[6:, 6:]
        own = link.stiffness, link.damping, elastic_rest(link)
        result.append(Modes(first, mass, *own, np.zeros((0, 0)), none, none))
        first += link.elastic_modes
    return result


def _bodies(mechanism: Mechanism) -> list[Body]:
    result, elastic = [], 0
    for k, link in enumerate(mechanism.links):
        invariants, n = link.invariants, len(link.invariants.m)
        rigid_mass = invariants.rigid_mass_matrix
        moment = rigid_mass[3:, :3]
        coupling = invariants.m @ invariants.rigid
        result.append(
            Body(
                parent=k - 1,
                elastic=elastic,
                mass=float(np.trace(rigid_mass[:3, :3]) / 3),
                first_moment=np.array([moment[2, 1], moment[0, 2], moment[1, 0]]),
                first_shape=coupling[:, :3].T,
                m=invariants.m,
                rigid=invariants.rigid,
                rigid_coupling=coupling,
                rigid_mass=invariants.rigid.T @ coupling,
                x=invariants.X,
                z=np.asarray(invariants.Z).reshape(9, n, n),
            )
        )
        elastic += link.elastic_modes
    return result


def _bent_body(mechanism: Mechanism, link: Link, curved: bool) -> BentBody:
    empty = np.zeros((0, 0))
    if not curved or link.second_order is None:
        return BentBody(empty, _NONE, _NONE, _NONE, _NONE, empty)
    data, n = link.second_order, len(link.invariants.m)
    turning = data.momentum[3:]
    modal = modal_inertia(link, mechanism.effects)
    return BentBody(
        per_mass=np.asarray(np.linalg.pinv(link.invariants.rigid_mass_matrix, rcond=_NO_INERTIA, hermitian=True)),
        coupling=data.momentum.transpose(0, 2, 1),
        odd=(turning - turning.transpose(0, 2, 1)) / 2,
        spin=data.spin.reshape(9, n, n),
        warp=_NONE if modal is None else modal.tensor.transpose(0, 2, 1),
        per_modal=empty if modal is None else np.asarray(modal.per_mass),
    )


def pack_chain(mechanism: Mechanism, gauge: str) -> CompiledSystem:
    """The functions of a chain in either gauge, with dense factors."""
    from erls.equations.erls.paper import functions  # here: it is compiled

    curved = is_stiffened(mechanism)
    links, elastic = len(mechanism.links), sum(link.elastic_modes for link in mechanism.links)
    free = sum(not joint.drive.prescribed for joint in mechanism.joints)
    integers = [0]
    constants, working = Memory(integers), Memory(integers)
    joints = _put(constants, _joints(mechanism, constants))
    states = joint_states(working, links)
    modes = _put(constants, _modes(mechanism, free))
    rigid, rigid_states = rigid_links(mechanism, constants, working)
    rows, bodies = joint_rows(mechanism, gauge, curved), _bodies(mechanism)
    bent = [_bent_body(mechanism, link, curved) for link in mechanism.links]
    size, count = links + elastic, sum(row.kept for row in rows)
    effects = mechanism.effects
    paper = Paper(
        rows=count,
        elastic=elastic,
        free=free,
        joint_rows=_put(constants, rows),
        row_states=_put(working, [row_state(r.own.shape[1], r.previous.shape[1], size) for r in rows]),
        bodies=_put(constants, bodies),
        body_states=_put(working, [_state(body, links, size) for body in bodies]),
        bent_bodies=_put(constants, bent),
        bent_states=_put(
            working, [bent_state(b.coupling.shape[1], len(b.coupling) > 0, len(b.warp) > 0) for b in bent]
        ),
        elimination=working.put(elimination(links, count, elastic)),
        balance=working.put(
            Balance(np.zeros(size), np.zeros((size, size)), np.zeros((free + elastic, free + elastic)))
        ),
        curved=int(curved),
        first_order=int("inertia_first_order" in effects),
        second_order=int("inertia_second_order" in effects),
        coriolis=int("coriolis" in effects),
        centrifugal=int("centrifugal_load" in effects),
        softening=int("spin_softening" in effects),
    )
    own = constants.put(paper)
    feeds = int(any(joint.drive.feed_forward for joint in mechanism.joints))
    integers[0] = constants.put(
        Serial(links, joints, states, modes, feeds, rigid, rigid_states, own, mechanism.gravity)
    )
    return CompiledSystem(
        size=free + elastic,
        reals=constants.numbers,
        integers=np.array(integers, dtype=np.int64),
        scratch=working.numbers,
        residual=functions.residual,
        mass_matrix=functions.mass_matrix,
        stiffness_and_damping=functions.stiffness_and_damping,
        load_acceleration=acceleration_in("erls.equations.erls.paper.acceleration"),
    )


def _state(body: Body, links: int, size: int) -> BodyState:
    """Memory of a link; its elastic coordinates move as they are."""
    state = body_state(len(body.m), size)
    for i in range(len(body.m) - 6):
        state.moves[12 + i, links + body.elastic + i] = 1.0
    return state


def _put(memory: Memory, records: Sequence[NamedTuple]) -> int:
    """Place of the first of records of one kind."""
    first, *_ = [memory.put(record) for record in records]
    return first

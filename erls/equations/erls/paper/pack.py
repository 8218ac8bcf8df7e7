"""A chain in the paper's dense form: its constants and memory as records, its compiled functions."""

from __future__ import annotations

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import CompiledSystem, acceleration_in, function_in
from erls.equations.erls.paper.bent_records import (
    BentBody,
    bent_state,
    call_bent_forces,
    call_bent_mass,
    call_correct_twist,
)
from erls.equations.erls.paper.compatibility_records import Elimination, JointRows, RowState
from erls.equations.erls.paper.records import (
    Balance,
    Body,
    BodyState,
    Paper,
    call_eliminate,
    call_extra_rows,
    call_loads,
)
from erls.equations.serial.contacts import put_contacts
from erls.equations.serial.ends import end_state
from erls.equations.serial.loads import put_loads
from erls.equations.serial.modal_inertia import compliance, modal_inertia, stiffened
from erls.equations.serial.pack import (
    addresses,
    effect_flags,
    end_record,
    joint_record,
    joint_states,
    rigid_links,
    step_parts,
)
from erls.equations.serial.records import Joint, Modes, Serial
from erls.errors import Cause, SceneError
from erls.maths.beside import compiling_beside
from erls.maths.calls import address_for, address_of
from erls.maths.records import Memory, room
from erls.maths.se3 import inverse, twist_cross
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.joints import Joint as MechanismJoint
from erls.mechanism.links import Link
from erls.mechanism.loops import loop_ends
from erls.mechanism.thermal import elastic_rest
from fe_import.modal.inertia import InertiaInvariants
from fe_import.model import InterfaceNode

GAUGES = ("joint-angle", "minimum-norm")
_NONE = np.zeros((0, 0, 0))


def _frame_second_order(link: Link, interface: InterfaceNode, frame: Array) -> Array:
    """`LinkSecondOrder.interface`; of no entries where there is none."""
    found = _NONE if link.second_order is None else link.second_order.interface(interface, frame)
    return found if found.any() else _NONE


def joint_rows(mechanism: Mechanism, gauge: str, curved: bool) -> list[JointRows]:
    """Constant blocks of the compatibility condition of every joint.

    Parameters
    ----------
    mechanism : Mechanism
    gauge : str
        ``"joint-angle"``: all six rows of a joint; ``"minimum-norm"``: five, six where its motion is prescribed.
    curved : bool
        Whether displacements of second order count.

    Raises
    ------
    SceneError
        BAD_FIELD: a rotation vector, or a screw in the minimum-norm gauge.
    """
    result: list[JointRows] = []
    first = 0
    for joint, link in zip(mechanism.joints, mechanism.links, strict=True):
        freedom, all_rows = joint.freedom, gauge == "joint-angle" or joint.drive.prescribed
        if freedom.vector or (freedom.pitch and not all_rows):
            raise _no_row(joint, gauge)
        own = link.interface_shape(link.inboard, inverse(joint.after))
        own_second = _frame_second_order(link, link.inboard, inverse(joint.after)) if curved else _NONE
        previous, previous_second = np.zeros((6, 0)), _NONE
        if joint.seat is not None:
            before = mechanism.links[joint.parent]
            previous = before.interface_shape(joint.seat, joint.before)
            previous_second = _frame_second_order(before, joint.seat, joint.before) if curved else _NONE
        rows = JointRows(
            parent=joint.parent,
            first=first,
            free_row=-1 if all_rows else freedom.row,
            slides=int(freedom.advance.any()),
            kept=6 if all_rows else 5,
            turn=twist_cross(np.concatenate([np.zeros(3), freedom.screw[3:]])),
            slide=twist_cross(np.concatenate([freedom.advance, np.zeros(3)])),
            advance=freedom.advance,
            own=own,
            previous=previous,
            own_second=own_second,
            previous_second=previous_second,
        )
        result.append(rows)
        first += rows.kept
    return result


def _no_row(joint: MechanismJoint, gauge: str) -> SceneError:
    """No row of compatibility is along the freedom of a joint, or its coordinate is not all that moves it."""
    if joint.freedom.vector:
        message, remedy = "turns by a rotation vector, of which the dense form knows nothing", "joints of one turn each"
    else:
        message, remedy = "turns and slides at once, along no single row of compatibility", "gauge = 'joint-angle'"
    message = f"joint {joint.name!r} {message}"
    return SceneError(Cause.BAD_FIELD, message, where="simulation.gauge", value=gauge, remedy=remedy)


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


def body_record(invariants: InertiaInvariants, parent: int = -1, elastic: int = 0) -> Body:
    """Constants of a link behind ``parent`` whose elastic coordinates begin at ``elastic`` within q_d."""
    n, rigid_mass, coupling = len(invariants.m), invariants.rigid_mass_matrix, invariants.m @ invariants.rigid
    moment = rigid_mass[3:, :3]
    return Body(
        parent=parent,
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


def _bodies(mechanism: Mechanism) -> list[Body]:
    first = np.cumsum([0, *(link.elastic_modes for link in mechanism.links)]).tolist()
    return [
        body_record(link.invariants, joint.parent, first[k])
        for k, (link, joint) in enumerate(zip(mechanism.links, mechanism.joints, strict=True))
    ]


def _modal_bases(mechanism: Mechanism) -> list[Array]:
    """(m, m) of each link, whose modal coordinates are its coordinates."""
    return [np.eye(link.model.modes) for link in mechanism.links]


def _bent_body(mechanism: Mechanism, link: Link, curved: bool) -> BentBody:
    empty = np.zeros((0, 0))
    if not curved or link.second_order is None:
        return BentBody(empty, _NONE, _NONE, _NONE, _NONE, empty)
    data, n = link.second_order, len(link.invariants.m)
    turning = data.momentum[3:]
    modal = modal_inertia(link, mechanism.effects)
    return BentBody(
        per_mass=compliance(link.invariants.rigid_mass_matrix),
        coupling=data.momentum.transpose(0, 2, 1),
        odd=(turning - turning.transpose(0, 2, 1)) / 2,
        spin=data.spin.reshape(9, n, n),
        warp=_NONE if modal is None else modal.tensor.transpose(0, 2, 1),
        per_modal=empty if modal is None else np.asarray(modal.per_mass),
    )


def pack_chain(mechanism: Mechanism, gauge: str) -> CompiledSystem:
    """The functions of a chain in either gauge, with dense factors."""
    with compiling_beside("erls.equations.erls.paper.elimination", "erls.equations.erls.paper.motion"):
        from erls.equations.erls.paper import functions  # here: it is compiled
    from erls.equations.erls.paper.motion import move

    curved = stiffened(mechanism)
    links, elastic = len(mechanism.links), sum(link.elastic_modes for link in mechanism.links)
    free = sum(not joint.drive.prescribed for joint in mechanism.joints)
    integers = [0]
    constants, working = Memory(integers), Memory(integers)
    joints = constants.put_all(_joints(mechanism, constants))
    states = joint_states(working, links)
    modes = constants.put_all(_modes(mechanism, free))
    rigid, rigid_states = rigid_links(mechanism, constants, working)
    rows, bodies = joint_rows(mechanism, gauge, curved), _bodies(mechanism)
    bent = [_bent_body(mechanism, link, curved) for link in mechanism.links]
    is_bent = any(len(body.coupling) > 0 for body in bent)
    size, count = links + elastic, sum(row.kept for row in rows)
    counts = np.repeat([float(not link.intermediate) for link in mechanism.links], 6)
    weighted = 0 if counts.all() or count == 6 * links else 6 * links  # a square C_r leaves nothing to choose
    ends = loop_ends(mechanism.loops)
    paper = Paper(
        rows=count,
        elastic=elastic,
        free=free,
        joint_rows=constants.put_all(rows),
        row_states=working.put_all([room(RowState, n=r.own.shape[1], n_p=r.previous.shape[1], z=size) for r in rows]),
        bodies=constants.put_all(bodies),
        body_states=working.put_all([_state(body, links, size) for body in bodies]),
        bent_bodies=constants.put_all(bent),
        bent_states=working.put_all(
            [bent_state(b.coupling.shape[1], len(b.coupling) > 0, len(b.warp) > 0) for b in bent]
        ),
        correct_twist=address_for(call_correct_twist, is_bent),
        bent_forces=address_for(call_bent_forces, is_bent),
        bent_mass=address_for(call_bent_mass, is_bent),
        elimination=working.put(
            room(Elimination, L=links, r=6 * links, v=count, d=elastic, z=size, h=weighted)._replace(counts=counts)
        ),
        balance=working.put(room(Balance, z=size, f=free + elastic)),
        move=address_of(move, contract.ACCELERATION),
        residual=address_of(functions.residual, contract.RESIDUAL),
        mass_matrix=address_of(functions.mass_matrix, contract.MASS_MATRIX),
        eliminate=address_for(call_eliminate),
        extra_rows=address_for(call_extra_rows, curved),
        end_count=len(ends),
        ends=constants.put_all([end_record(mechanism.links[k], None, curved, end) for k, end in ends]),
        end_states=working.put_all([end_state(6 + mechanism.links[k].elastic_modes) for k, _ in ends]),
        curved=int(curved),
        **effect_flags(mechanism.effects),
    )
    own = constants.put(paper)
    integers[0] = constants.put(
        Serial(
            links=links,
            joints=joints,
            joint_states=states,
            modes=modes,
            **addresses(mechanism, call_loads),
            rigid_links=rigid,
            rigid_states=rigid_states,
            **put_loads(mechanism, _modal_bases(mechanism), [len(b.coupling) > 0 for b in bent], constants, working),
            **put_contacts(mechanism, functions.residual, free + elastic, constants, working),
            own=own,
            gravity=mechanism.gravity,
        )
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
        load_frames=function_in("erls.equations.erls.paper.ends", "frames"),
    )


def _state(body: Body, links: int, size: int) -> BodyState:
    """Memory of a link; its elastic coordinates move as they are."""
    state = room(BodyState, n=len(body.m), z=size)
    for i in range(len(body.m) - 6):
        state.moves[12 + i, links + body.elastic + i] = 1.0
    return state

"""Motion of all links: the rigid links of the ERLS by their joints, q by compatibility, and both per (θ, q_d).

(ν, q̇) of link k = V N (θ̇, q̇_d) with V N = [J_k, 0; G_k, D_k; 0, V_k], and (ν̇, q̈) = V N (θ̈, q̈_d) + (J̇_k θ̇, n_k, 0)
(paper, eq. 69-70).
"""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.paper.compatibility_records import (
    JOINT_ROWS,
    ROW_STATE,
    Elimination,
    JointRows,
    RowState,
    read_elimination,
    read_joint_rows,
    read_row_state,
)
from erls.equations.erls.paper.records import (
    BODY,
    BODY_STATE,
    BodyState,
    Paper,
    call_eliminate,
    read_body,
    read_body_state,
    read_paper,
)
from erls.equations.serial.joints import move_joint
from erls.equations.serial.records import JOINT, JOINT_STATE, Serial, read_joint, read_joint_state, read_serial
from erls.maths.jit import kernel, part
from erls.maths.products import add_columns, add_product, add_rows, clear, clear_matrix, copy, dot
from erls.maths.so3 import Array
from erls.maths.spatial import add_motion_cross, rotate_back, transform_motion
from fe_import.model import IntArray


@part
def _fill_transform(pose: Array, spare: Array, out: Array) -> None:
    """(6, 6) twist of the frame before to the frame at this pose."""
    for j in range(6):
        clear(spare)
        spare[j] = 1.0
        transform_motion(pose, spare, spare)
        for i in range(6):
            out[i, j] = spare[i]


@part
def _compose(before: Array, pose: Array, out: Array) -> None:
    """The pose behind two poses (12,)."""
    for i in range(3):
        out[9 + i] = before[9 + i]
        for m in range(3):
            out[9 + i] += before[3 * i + m] * pose[9 + m]
        for j in range(3):
            total = before[3 * i] * pose[j]
            total += before[3 * i + 1] * pose[3 + j]
            total += before[3 * i + 2] * pose[6 + j]
            out[3 * i + j] = total


@part
def _move_link(
    serial: Serial, paper: Paper, reals: Array, integers: IntArray, scratch: Array, c: Elimination, k: int
) -> None:
    """World pose, Jacobian, J̇ θ̇, (ν, q̇) and (ν̇, q̈) of a link."""
    joint = read_joint(reals, integers, serial.joints + k * JOINT)
    pose = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).pose
    body = read_body(reals, integers, paper.bodies + k * BODY)
    state = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
    jacobian, bias = state.moves[:6], state.bias[:6]
    _fill_transform(pose, state.twist, state.transform)
    clear_matrix(jacobian)
    clear(bias)
    if body.parent >= 0:
        before = read_body_state(scratch, integers, paper.body_states + body.parent * BODY_STATE)
        _compose(before.world, pose, state.world)
        add_product(state.transform, before.moves[:6], jacobian)
        add_rows(state.transform, before.bias[:6], 1.0, bias)
    else:
        copy(pose, state.world)
    for i in range(6):
        jacobian[i, k] += joint.screw[i]
    clear(state.velocity)
    clear(state.acceleration)
    add_rows(state.moves, c.rate, 1.0, state.velocity)
    add_motion_cross(joint.screw, state.velocity[:6], -c.rate[k], bias)
    add_rows(state.moves, c.acceleration, 1.0, state.acceleration)
    for i in range(len(state.bias)):
        state.acceleration[i] += state.bias[i]
    for i in range(6):
        state.twist[i], state.twist_rate[i] = state.velocity[i], state.acceleration[i]
    rotate_back(state.world, serial.gravity, state.gravity)


@part
def _turn_joint(rows: JointRows, state: RowState, own: BodyState, before: BodyState, c: Elimination, k: int) -> None:
    """Physical angle of a joint whose row along its freedom is free: θ_k and what the links' displacement adds."""
    along = rows.own[rows.free_row]
    state.turn[0] += dot(along, own.q)
    state.turn[1] += dot(along, own.velocity[6:])
    state.turn[2] += dot(along, own.bias[6:])
    add_columns(own.moves[6:], along, 1.0, state.gradient)
    if rows.parent < 0:
        return
    rate = c.rate[k]
    clear(state.along)
    clear(state.along_slope)
    clear(state.along_bend)
    add_columns(rows.previous, state.transform[0, rows.free_row], -1.0, state.along)
    add_columns(rows.previous, state.transform[1, rows.free_row], -1.0, state.along_slope)
    add_columns(rows.previous, state.transform[2, rows.free_row], -1.0, state.along_bend)
    slope = dot(state.along_slope, before.q)
    state.turn[0] += dot(state.along, before.q)
    state.turn[1] += dot(state.along, before.velocity[6:]) + slope * rate
    state.turn[2] += dot(state.along, before.bias[6:]) + dot(state.along_bend, before.q) * rate * rate
    state.turn[2] += 2 * dot(state.along_slope, before.velocity[6:]) * rate
    add_columns(before.moves[6:], state.along, 1.0, state.gradient)
    state.gradient[k] += slope


@kernel(contract.ACCELERATION, counted=False)
def move(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array) -> int:
    """Motion of joints and links; accelerations are zero where ``a`` is empty. The status is that of `eliminate`."""
    serial = read_serial(reals, integers, integers[0])
    paper = read_paper(reals, integers, serial.own)
    c, links = read_elimination(scratch, integers, paper.elimination), serial.links
    for k in range(links):
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        state = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        move_joint(serial, k, joint, state, reals, integers, scratch, t, y, v, a)
        c.place[k], c.rate[k], c.acceleration[k] = state.coordinate[0], state.coordinate[1], state.coordinate[2]
    for i in range(paper.elastic):
        at = paper.free + i
        c.place[links + i], c.rate[links + i], c.acceleration[links + i] = y[at], v[at], 0.0
        if len(a) > 0:
            c.acceleration[links + i] = a[at]
    status: int = call_eliminate(paper.eliminate, reals, integers, scratch)
    for k in range(links):
        _move_link(serial, paper, reals, integers, scratch, c, k)
    for k in range(links):
        rows = read_joint_rows(reals, integers, paper.joint_rows + k * JOINT_ROWS)
        row_state = read_row_state(scratch, integers, paper.row_states + k * ROW_STATE)
        clear(row_state.gradient)
        row_state.gradient[k] = 1.0
        row_state.turn[0], row_state.turn[1], row_state.turn[2] = c.place[k], c.rate[k], 0.0
        if rows.free_row >= 0:
            own = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
            before = read_body_state(scratch, integers, paper.body_states + max(rows.parent, 0) * BODY_STATE)
            _turn_joint(rows, row_state, own, before, c, k)
    return status

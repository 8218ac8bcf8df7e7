"""Equations of motion in the paper's dense form: sums over links of (V N)ᵀ times what acts on the link (eq. 72-75)."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.paper.bent_records import (
    BENT_BODY,
    call_bent_forces,
    call_bent_mass,
    call_correct_twist,
    read_bent_body,
)
from erls.equations.erls.paper.compatibility_records import ROW_STATE, read_elimination, read_row_state
from erls.equations.erls.paper.forces import add_inertia_forces, fill_mass, fill_moments, subtract_weight
from erls.equations.erls.paper.records import (
    BODY,
    BODY_STATE,
    Paper,
    call_loads,
    read_balance,
    read_body,
    read_body_state,
    read_paper,
)
from erls.equations.serial.elastic import elastic_force
from erls.equations.serial.joints import effort, gains
from erls.equations.serial.records import (
    JOINT,
    JOINT_STATE,
    MODES,
    Serial,
    call_contact_gains,
    call_feed_forward,
    read_joint,
    read_joint_state,
    read_modes,
    read_serial,
)
from erls.maths.calls import caller
from erls.maths.jit import kernel, part
from erls.maths.products import add_columns, add_product, add_transposed_product, clear, clear_matrix, dot
from erls.maths.so3 import Array
from erls.maths.spatial import add_force_cross, transform_force_back
from fe_import.model import IntArray

call_move = caller(contract.ACCELERATION, "erls.equations.erls.paper.motion:move")  # which is compiled once for all


@part
def _load_link(paper: Paper, reals: Array, integers: IntArray, scratch: Array, k: int) -> None:
    """Inertia less weight of a link on (ν, q̇) into its ``force``."""
    body = read_body(reals, integers, paper.bodies + k * BODY)
    state = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
    is_bent = read_bent_body(reals, integers, paper.bent_bodies + k * BENT_BODY).coupling.shape[0] > 0
    clear(state.force)
    state.potential[0] = 0.0
    fill_moments(paper, body, state)
    if is_bent:
        call_correct_twist(paper.correct_twist, k, reals, integers, scratch)
    add_inertia_forces(paper, body, state)
    if is_bent:
        call_bent_forces(paper.bent_forces, k, reals, integers, scratch)
    add_force_cross(state.velocity[:6], state.p, state.force[:6])
    subtract_weight(body, state)


@part
def _weigh_link(paper: Paper, reals: Array, integers: IntArray, scratch: Array, k: int) -> None:
    """Mass matrix of a link's (ν, q̇) into its ``mass``."""
    body = read_body(reals, integers, paper.bodies + k * BODY)
    state = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
    fill_moments(paper, body, state)
    fill_mass(paper, body, state)
    if read_bent_body(reals, integers, paper.bent_bodies + k * BENT_BODY).coupling.shape[0] > 0:
        call_bent_mass(paper.bent_mass, k, reals, integers, scratch)


@part
def _put_free(serial: Serial, paper: Paper, reals: Array, integers: IntArray, every: Array, out: Array) -> None:
    """Those of the independent coordinates among values (z,) over (θ, q_d)."""
    for k in range(serial.links):
        place = read_joint(reals, integers, serial.joints + k * JOINT).place
        if place >= 0:
            out[place] = every[k]
    for i in range(paper.elastic):
        out[paper.free + i] = every[serial.links + i]


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M a - f, see `erls.equations.compiled_system`; accelerations are zero where ``a`` is empty.

    What runs report stays in the records: poses, q, wrenches, turns of joints with the forces along them.
    """
    serial = read_serial(reals, integers, integers[0])
    paper = read_paper(reals, integers, serial.own)
    c = read_elimination(scratch, integers, paper.elimination)
    force = read_balance(scratch, integers, paper.balance).force
    if serial.feeds >= 0:
        call_feed_forward(serial.feeds, integers[0], reals, integers, scratch, t)
    call_move(paper.move, reals, integers, scratch, t, y, v, a)
    clear(force)
    for k in range(serial.links):
        _load_link(paper, reals, integers, scratch, k)
    if serial.loads >= 0:
        call_loads(serial.loads, integers[0], reals, integers, scratch, t, y, v, out)
    for k in range(serial.links):
        state = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
        add_columns(state.moves, state.force, 1.0, force)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        first = serial.links + modes.first - paper.free
        for i in range(len(modes.stiffness)):
            held = elastic_force(modes.stiffness[i], c.place[first + i], modes.rest[i])
            force[first + i] += held + modes.damping[i] * c.rate[first + i]
        for i in range(6):
            state.borne[i] = state.force[i]
    for k in range(serial.links - 1, -1, -1):
        parent = read_body(reals, integers, paper.bodies + k * BODY).parent
        if parent >= 0:
            state = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
            before = read_body_state(scratch, integers, paper.body_states + parent * BODY_STATE)
            pose = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).pose
            transform_force_back(pose, state.borne, state.p)
            for i in range(6):
                before.borne[i] += state.p[i]
    for k in range(serial.links):
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        row = read_row_state(scratch, integers, paper.row_states + k * ROW_STATE)
        row.turn[3] = 0.0
        if joint.acts:
            feed = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE).feed[0]
            row.turn[3] = effort(joint, reals, integers, t, row.turn[0], row.turn[1], feed)
        pull = joint.rotor * (row.turn[2] + dot(row.gradient, c.acceleration)) - row.turn[3]
        for i in range(len(force)):
            force[i] += pull * row.gradient[i]
    _put_free(serial, paper, reals, integers, force, out)


@part
def _add_square(factor: float, x: Array, out: Array) -> None:
    """Add the factor times x xᵀ."""
    for i in range(len(x)):
        for j in range(len(x)):
            out[i, j] += factor * x[i] * x[j]


@part
def _put_free_square(serial: Serial, paper: Paper, reals: Array, integers: IntArray, every: Array, out: Array) -> None:
    """Rows and columns of the independent coordinates of a matrix over (θ, q_d)."""
    for k in range(serial.links):
        place = read_joint(reals, integers, serial.joints + k * JOINT).place
        if place >= 0:
            _put_free(serial, paper, reals, integers, every[k], out[place])
    for i in range(paper.elastic):
        _put_free(serial, paper, reals, integers, every[serial.links + i], out[paper.free + i])


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M, see `erls.equations.compiled_system`; that over (θ, q_d) stays in the records."""
    serial = read_serial(reals, integers, integers[0])
    paper = read_paper(reals, integers, serial.own)
    c = read_elimination(scratch, integers, paper.elimination)
    every = read_balance(scratch, integers, paper.balance).mass
    call_move(paper.move, reals, integers, scratch, t, y, c.rest, c.rest[:0])
    clear_matrix(every)
    for k in range(serial.links):
        _weigh_link(paper, reals, integers, scratch, k)
        state = read_body_state(scratch, integers, paper.body_states + k * BODY_STATE)
        clear_matrix(state.product)
        add_product(state.mass, state.moves, state.product)
        add_transposed_product(state.moves, state.product, every)
        rotor = read_joint(reals, integers, serial.joints + k * JOINT).rotor
        gradient = read_row_state(scratch, integers, paper.row_states + k * ROW_STATE).gradient
        _add_square(rotor, gradient, every)
    _put_free_square(serial, paper, reals, integers, every, out)


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """Of modes, joint springs, dampers, friction and controllers; see `erls.equations.compiled_system`."""
    serial = read_serial(reals, integers, integers[0])
    paper = read_paper(reals, integers, serial.own)
    balance = read_balance(scratch, integers, paper.balance)
    if serial.feeds >= 0:
        call_feed_forward(serial.feeds, integers[0], reals, integers, scratch, t)
    call_move(paper.move, reals, integers, scratch, t, y, v, v[:0])
    for which in range(2):
        every = balance.mass
        clear_matrix(every)
        for number in range(serial.links):
            modes = read_modes(reals, integers, serial.modes + number * MODES)
            for i in range(len(modes.stiffness)):
                at = serial.links + modes.first - paper.free + i
                every[at, at] += modes.damping[i] if which else modes.stiffness[i]
            joint = read_joint(reals, integers, serial.joints + number * JOINT)
            if joint.acts:
                row = read_row_state(scratch, integers, paper.row_states + number * ROW_STATE)
                feed = read_joint_state(scratch, integers, serial.joint_states + number * JOINT_STATE).feed[0]
                found = gains(joint, reals, integers, t, row.turn[0], row.turn[1], feed)
                _add_square(found[which], row.gradient, every)
        _put_free_square(serial, paper, reals, integers, every, c if which else k)
    if serial.contact_gains >= 0:
        call_contact_gains(serial.contact_gains, reals, integers, scratch, t, y, v, k, c)

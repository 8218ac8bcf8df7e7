"""What ERLS says of its links at a configuration (`erls.equations.serial.segments`).

The motion of a link is μ = (w, ω), w = ν + u̇ six numbers, ω about the axes of the link. A link on the ground moves
along its joint alone, of which u is zero: μ = (θ̇).
"""

from __future__ import annotations

from erls.equations.erls.frames import place_frames
from erls.equations.erls.link_forces import deform, pair_of
from erls.equations.erls.records import (
    LINK,
    LINK_STATE,
    Chain,
    Link,
    LinkState,
    read_chain,
    read_link,
    read_link_state,
)
from erls.equations.serial.records import (
    JOINT_STATE,
    MODES,
    Serial,
    read_joint_state,
    read_modes,
    read_serial,
)
from erls.equations.serial.segments import SEGMENT, Segment, fill_mass_matrix, read_segment
from erls.maths.jit import part
from erls.maths.products import add_columns, clear
from erls.maths.so3 import Array
from erls.maths.spatial import add_motion_cross, dot3, dot6, transform_motion
from fe_import.model import IntArray


@part
def _own_inertia(chain: Chain, mass: Array, axes: Array, turned: Array, moments: Array, inertia: Array) -> None:
    """Inertia over (w, ω) with the elastic coordinates held; ω about the axes, its rows and columns last."""
    first = inertia.shape[0] - len(axes)
    inertia[:, :] = 0.0
    for i in range(6):
        for j in range(6):
            inertia[i, j] = mass[i, j]
    for a in range(len(axes)):
        if chain.first_order:
            # X q about the axis meets w; and w as ω turns the frame
            for i in range(6):
                inertia[i, first + a] = inertia[first + a, i] = turned[a, i]
        if chain.second_order:
            for b in range(len(axes)):
                inertia[first + a, first + b] = moments[pair_of(len(axes), a, b)]


@part
def _linear_inertia(chain: Chain, link: Link, state: LinkState, own: Segment, decoupled: Array, turns: bool) -> None:
    _own_inertia(chain, link.mass, link.axes, state.turned, state.moments, own.inertia)
    _couple(chain, link, state, decoupled, turns, len(own.pull) - len(link.axes), own.coupling)


@part
def turn_row(row: Array, decoupled: Array, out: Array) -> None:
    """A row over elastic coordinates, over decoupled ones."""
    clear(out)
    add_columns(decoupled, row, 1.0, out)


@part
def grounded_inertia(
    chain: Chain, link: Link, state: LinkState, own: Segment, screw: Array, decoupled: Array, turns: bool
) -> None:
    """Inertia and coupling over the rate θ̇ of a joint on the ground, with w = S θ̇."""
    axes, coupling, momentum, shared = len(link.axes), own.coupling[0], state.point, state.speeds[6:]
    clear(coupling)
    clear(momentum)
    clear(shared)  # of what is not decoupled yet
    for i in range(6):
        weight = screw[i]
        if weight != 0.0:
            for j in range(6):
                momentum[j] += weight * link.mass[i, j]
            row = link.rigid_decoupled[i] if turns else link.mass[i, 6:]
            for j in range(len(coupling)):
                coupling[j] += weight * row[j]
    inertia = dot6(momentum, screw)
    for a in range(axes):
        spin = dot3(link.axes[a], screw[3:])
        if chain.first_order:
            turned = state.turned[a]
            inertia += 2.0 * spin * dot6(turned, screw)
            for j in range(len(shared)):
                shared[j] += spin * turned[6 + j]
        if chain.second_order:
            for b in range(axes):
                inertia += spin * dot3(link.axes[b], screw[3:]) * state.moments[pair_of(axes, a, b)]
    own.inertia[0, 0] = inertia
    if chain.first_order:
        if turns:
            add_columns(decoupled, shared, 1.0, coupling)
        else:
            for j in range(len(coupling)):
                coupling[j] += shared[j]


@part
def _couple(
    chain: Chain, link: Link, state: LinkState, decoupled: Array, turns: bool, first: int, coupling: Array
) -> None:
    """B over (w, ω), rows of ω from number ``first`` on."""
    e = coupling.shape[1]
    for i in range(6):
        for j in range(e):
            coupling[i, j] = link.rigid_decoupled[i, j] if turns else link.mass[i, 6 + j]
    for a in range(len(link.axes)):
        if chain.first_order:
            if turns:
                turn_row(state.turned[a, 6:], decoupled, coupling[first + a])
            else:
                for j in range(e):
                    coupling[first + a, j] = state.turned[a, 6 + j]


@part
def _turned_back(pose: Array, x: Array, out: Array) -> None:
    """Rᵀ x of a vector (3,) that may be a column of a matrix."""
    for i in range(3):
        out[i] = pose[i] * x[0] + pose[3 + i] * x[1] + pose[6 + i] * x[2]


@part
def _lead(
    pose: Array, axes: Array, axes_before: Array, screw_before: Array, out: Array, state: LinkState, own: Segment
) -> None:  # fmt: skip
    """L and N."""
    p, before, x = len(own.pull), own.lead.shape[1], state.point
    own.lead[:, :] = 0.0
    own.reach[:, :] = 0.0
    if before == 1:
        transform_motion(pose, screw_before, x)
        for i in range(6):
            own.lead[i, 0] = x[i]
        for a in range(len(axes)):
            own.lead[p - len(axes) + a, 0] = dot3(axes[a], x[3:])
    for j in range(6 if before > 1 else 0):
        for i in range(6):
            x[i] = 1.0 if i == j else 0.0
        transform_motion(pose, x, x)
        for i in range(6):
            own.lead[i, j] = x[i]
    for b in range(len(axes_before) if before > 1 else 0):
        _turned_back(pose, axes_before[b], x)
        for a in range(len(axes)):
            own.lead[p - len(axes) + a, before - len(axes_before) + b] = dot3(axes[a], x)
    for j in range(len(out)):
        transform_motion(pose, out[j], x)
        for i in range(6):
            own.reach[i, j] = x[i]


@part
def _subspace(screw: Array, axes: Array, state: LinkState, own: Segment) -> None:
    """S: (S - ad(S) u, S_ω)."""
    p, s = len(own.pull), own.subspace
    clear(s)
    add_motion_cross(state.u, screw, 1.0, s)
    for i in range(6):
        s[i] += screw[i]
    for a in range(len(axes)):
        s[p - len(axes) + a] = dot3(axes[a], screw[3:])


@part
def set_segments(
    serial: Serial, chain: Chain, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, turns: bool,
    placed: bool,
) -> None:  # fmt: skip
    """Segments of all links, over their elastic coordinates, or over decoupled ones where ``turns``.

    ``placed``: the forces out of balance were asked for at this place just before, which deformed the links.
    """
    if not placed:
        place_frames(serial, chain, reals, integers, scratch, t, y, y, y[0:0])
    for k in range(serial.links):
        link = read_link(reals, integers, chain.links + k * LINK)
        state = read_link_state(scratch, integers, chain.states + k * LINK_STATE)
        own = read_segment(scratch, integers, chain.segments + k * SEGMENT)
        motion = read_joint_state(scratch, integers, serial.joint_states + k * JOINT_STATE)
        decoupled = read_modes(reals, integers, serial.modes + k * MODES).decoupled
        if not placed:
            deform(chain, link, state)
        if link.parent < 0:
            grounded_inertia(chain, link, state, own, motion.screw, decoupled, turns)
            own.subspace[0] = 1.0
        else:
            _linear_inertia(chain, link, state, own, decoupled, turns)
            _subspace(motion.screw, link.axes, state, own)
            axes_before = read_link(reals, integers, chain.links + link.parent * LINK).axes
            out = link.out_decoupled if turns else link.out
            before = read_joint_state(scratch, integers, serial.joint_states + link.parent * JOINT_STATE)
            _lead(motion.pose, link.axes, axes_before, before.screw, out, state, own)


@part
def fill(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M."""
    serial = read_serial(reals, integers, integers[0])
    chain = read_chain(reals, integers, serial.own)
    set_segments(serial, chain, reals, integers, scratch, t, y, False, False)
    fill_mass_matrix(serial, chain.segments, reals, integers, scratch, out)

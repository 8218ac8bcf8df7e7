"""Forces out of balance on the independent coordinates: outward for the motion, inward for the forces."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.motion import move_frames
from erls.equations.erls.stiffened import layout as more
from erls.equations.erls.stiffened.bend import bend_frames, set_arm
from erls.equations.erls.stiffened.forces import last, link_forces
from erls.equations.erls.stiffened.tensors import add_cross, add_stack, clear
from erls.equations.serial.drives import effort, feed_forward
from erls.equations.serial.linear import add_bracket, add_transposed, carry_back, dot6
from erls.maths.jit import kernel, part


@part
def _turn_arm_back(reals: Array, reach: int, link: Array, bent: Array) -> None:
    """What PUSH does to the turn of a link, by the arm from its inboard interface to its joint."""
    d, b, back = more.SPARE, more.SPARE + 3, more.SPARE + 6
    set_arm(reals, reach, link, bent)
    clear(bent, back, more.AXES)
    add_cross(bent, more.PUSH, link, at.U + 3, 1.0, bent, back)
    add_cross(bent, b, bent, more.PUSH, 0.5, link, at.FORCE + 3)
    add_cross(bent, d, bent, back, 0.5, link, at.FORCE + 3)


@part
def _on_joint(reals: Array, integers: IntArray, record: int, mine: int, link: Array, bent: Array) -> float:
    """Force along a joint: it turns the displacements along."""
    screw = integers[record + at.SCREW]
    total = dot6(reals, screw, link, at.WRENCH)
    if record > at.HEADER:
        clear(link, at.POINT, more.MOVES)
        clear(bent, more.SPARE, more.BOTH)
        add_bracket(link, at.U, reals, screw, 1.0, link, at.POINT)
        add_bracket(bent, more.CARRIED, reals, screw, 1.0, bent, more.SPARE)
        if integers[mine + more.ARMED] and integers[record + at.SLIDES]:
            add_cross(link, at.U + 3, reals, integers[mine + more.REACH], 1.0, bent, more.SPARE + 6)
            add_cross(link, at.U + 3, bent, more.SPARE + 6, 0.5, bent, more.SPARE)
        total += dot6(link, at.POINT, link, at.FORCE) + dot6(bent, more.SPARE, bent, more.PUSH)
    return total


@part
def _hand_back(reals: Array, integers: IntArray, scratch: Array, record: int, mine: int) -> None:
    """Forces of a link and of all after it, on the link before."""
    memory, own = integers[record + at.MEMORY], integers[mine + more.MEMORY]
    link, bent = scratch[memory : memory + at.VECTORS], scratch[own : own + more.NUMBERS]
    before, bent_before = integers[record - at.RECORD + at.MEMORY], integers[mine - more.RECORD + more.MEMORY]
    count, point = integers[record - at.RECORD + at.MODES], link[at.POINT : at.POINT + 6]
    start = last(integers, record - at.RECORD, at.MODAL, count)
    carry_back(link, link, at.WRENCH, link, at.POINT)
    for i in range(6):
        scratch[before + at.WRENCH + i] += point[i]
    carry_back(link, link, at.FORCE, link, at.POINT)
    for i in range(6):
        scratch[before + at.FORCE + i] += point[i]
    add_transposed(reals, integers[record - at.RECORD + at.OUT], 6, point, count, scratch[start : start + count])
    carry_back(link, bent, more.PUSH, link, at.POINT)
    for i in range(6):
        scratch[bent_before + more.PUSH + i] += point[i]
    if integers[mine - more.RECORD + more.BOWS]:
        m = integers[mine - more.RECORD + more.KEPT]
        turns = m - count
        start -= turns
        clear(scratch, start, turns)
        add_stack(scratch, integers[mine - more.RECORD + more.BOW_Q], m, link, at.POINT, more.MOVES, scratch, start)
        for i in range(turns):
            scratch[before + at.FORCE + 3 + i] += scratch[start + i]


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M a - f, see `erls.equations.compiled_system`; an empty ``a`` stands for zeros."""
    links = integers[at.LINKS]
    if integers[at.FEED_FORWARD]:
        feed_forward(reals, integers, scratch, t)
    move_frames(reals, integers, scratch, t, y, v, a)
    bend_frames(reals, integers, scratch, True)
    first_record = more.header(integers, links) + more.HEADER
    for k in range(links):
        link_forces(reals, integers, scratch, at.HEADER + k * at.RECORD, first_record + k * more.RECORD, len(a) > 0)
    for k in range(links - 1, -1, -1):
        record, mine = at.HEADER + k * at.RECORD, first_record + k * more.RECORD
        e, first = integers[record + at.MODES], integers[record + at.FIRST_MODE]
        memory, own = integers[record + at.MEMORY], integers[mine + more.MEMORY]
        link, bent = scratch[memory : memory + at.VECTORS], scratch[own : own + more.NUMBERS]
        forces, stiffness = last(integers, record, at.MODAL, e), integers[record + at.STIFFNESS]
        damping = integers[record + at.DAMPING]
        for i in range(e):
            elastic = reals[stiffness + i] * y[first + i] + reals[damping + i] * v[first + i]
            out[first + i] = scratch[forces + i] + elastic
        if integers[mine + more.ARMED]:
            _turn_arm_back(reals, integers[mine + more.REACH], link, bent)
        joint = integers[record + at.JOINT]
        if joint >= 0:
            out[joint] = _on_joint(reals, integers, record, mine, link, bent)
            if integers[record + at.EFFORT]:
                out[joint] += reals[integers[record + at.FORCES] + at.ROTOR] * link[at.ANGLE + 2]
                out[joint] -= effort(reals, integers, record, t, link)
        if k > 0:
            _hand_back(reals, integers, scratch, record, mine)

"""Forces out of balance on the independent coordinates: outward for the motion, inward for the forces."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.forces import link_forces, vector
from erls.equations.erls.motion import move_frames
from erls.equations.serial.drives import effort, feed_forward
from erls.equations.serial.linear import add_bracket, add_transposed, carry_back, dot6
from erls.maths.jit import kernel


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """M a - f, see `erls.equations.compiled_system`; an empty ``a`` stands for zeros, with which nothing is
    multiplied then.
    """
    if integers[at.FEED_FORWARD]:
        feed_forward(reals, integers, scratch, t)
    move_frames(reals, integers, scratch, t, y, v, a)
    for k in range(integers[at.LINKS]):
        link_forces(reals, integers, scratch, at.HEADER + k * at.RECORD, len(a) > 0)
    for k in range(integers[at.LINKS] - 1, -1, -1):
        record = at.HEADER + k * at.RECORD
        e, first = integers[record + at.MODES], integers[record + at.FIRST_MODE]
        memory = integers[record + at.MEMORY]
        link = scratch[memory : memory + at.VECTORS]
        start = vector(memory, 6 + e, at.MODAL) + 6
        forces = scratch[start : start + e]
        stiffness, damping = integers[record + at.STIFFNESS], integers[record + at.DAMPING]
        for i in range(e):
            out[first + i] = forces[i] + reals[stiffness + i] * y[first + i] + reals[damping + i] * v[first + i]
        joint = integers[record + at.JOINT]
        screw = reals[integers[record + at.SCREW] : integers[record + at.SCREW] + 6]
        if joint >= 0:
            total = dot6(screw, 0, link, at.WRENCH)
            if k > 0:  # the joint turns the displacement along: u̇ holds -ad(S θ̇) u
                for i in range(6):
                    link[at.POINT + i] = 0.0
                add_bracket(link, at.U, screw, 0, 1.0, link, at.POINT)
                total += dot6(link, at.POINT, link, at.FORCE)
            if integers[record + at.EFFORT]:
                total += reals[integers[record + at.FORCES] + at.ROTOR] * link[at.ANGLE + 2]
                total -= effort(reals, integers, record, t, link)
            out[joint] = total
        if k > 0:
            previous = record - at.RECORD
            start, count = integers[previous + at.MEMORY], integers[previous + at.MODES]
            before = scratch[start : start + at.VECTORS]
            carry_back(link, link, at.WRENCH, link, at.POINT)
            for i in range(6):
                before[at.WRENCH + i] += link[at.POINT + i]
            carry_back(link, link, at.FORCE, link, at.POINT)
            for i in range(6):
                before[at.FORCE + i] += link[at.POINT + i]
            modal_start = vector(start, 6 + count, at.MODAL) + 6
            modal = scratch[modal_start : modal_start + count]
            point = link[at.POINT : at.POINT + 6]
            add_transposed(reals, integers[previous + at.OUT], 6, point, count, modal)

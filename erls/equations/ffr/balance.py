"""Forces out of balance on the independent coordinates: outward for the motion, inward for the wrenches."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls.layout import ROTOR
from erls.equations.ffr import layout as at
from erls.equations.ffr.feed_forward import feed_forward
from erls.equations.ffr.inertia import link_forces
from erls.equations.ffr.joints import effort
from erls.equations.ffr.motion import move_frames
from erls.equations.ffr.nodes import from_node_axes
from erls.equations.ffr.rows import vector
from erls.equations.serial.linear import add_columns, carry_back, dot6
from erls.maths.jit import kernel, part


@part
def pull_node(rows: Array, node: Array, wrench: Array, factor: float, spare: Array, forces: Array) -> None:
    """Add to the forces on η the factor times what a wrench on a node, in its axes, does there."""
    from_node_axes(node, wrench, spare)
    e = len(forces)
    add_columns(rows, 0, e, spare, 6, factor, forces)


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
    links = integers[at.LINKS]
    for k in range(links - 1, -1, -1):
        record = at.HEADER + k * at.RECORD
        memory, first = integers[record + at.MEMORY], integers[record + at.FIRST_MODE]
        last = first + integers[record + at.MODES]
        link, forces = scratch[memory : memory + at.VECTORS], out[first:last]
        moved = a[first:last] if len(a) else a
        link_forces(reals, integers, scratch, record, y[first:last], v[first:last], moved, forces)
        wrench, passed = link[at.WRENCH : at.WRENCH + 6], link[at.PASSED : at.PASSED + 6]
        point, other = link[at.POINT : at.POINT + 6], link[at.OTHER : at.OTHER + 6]
        if k + 1 < links:
            if integers[record + at.OUTBOARD] >= 0:
                node = link[at.OUTER : at.OUTER + at.NODE]
                start = vector(memory, last - first, at.OUTER_ROWS)
                rows = scratch[start : start + 6 * (last - first)]
                pull_node(rows, node, passed, 1.0, point, forces)
                carry_back(node, passed, 0, passed, 0)
            for i in range(6):
                wrench[i] += passed[i]
        if integers[record + at.INBOARD] >= 0:
            node = link[at.INNER : at.INNER + at.NODE]
            carry_back(node[at.BACK : at.BACK + 12], wrench, 0, wrench, 0)
            start = vector(memory, last - first, at.INNER_ROWS)
            rows = scratch[start : start + 6 * (last - first)]
            pull_node(rows, node, wrench, -1.0, other, forces)
        joint = integers[record + at.JOINT]
        if joint >= 0:
            total = dot6(reals, integers[record + at.SCREW], wrench, 0)
            total += reals[integers[record + at.FORCES] + ROTOR] * link[at.ANGLE + 2]
            if integers[record + at.EFFORT]:
                total -= effort(reals, integers, record, t, link)
            out[joint] = total
        if k > 0:
            start = integers[record - at.RECORD + at.MEMORY]
            carry_back(link, wrench, 0, scratch, start + at.PASSED)

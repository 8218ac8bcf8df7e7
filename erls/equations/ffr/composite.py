"""The mass matrix by composite inertias, from the tip inward; its cost grows with the square of its size."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls.layout import ROTOR
from erls.equations.ffr import layout as at
from erls.equations.ffr.bent import bent_inertia
from erls.equations.ffr.inertia import square_inertia, turn_inertia
from erls.equations.ffr.motion import place_frames
from erls.equations.ffr.nodes import to_node_axes
from erls.equations.ffr.rows import add_rows, vector
from erls.equations.serial.linear import add_columns, carry, carry_back, dot, dot6
from erls.maths.jit import kernel, part


@part
def _node_rates(scratch: Array, start: int, e: int, mode: int, node: Array, x: Array) -> None:
    """Twist of a node per unit rate of a coordinate, in its axes."""
    for i in range(6):
        x[i] = scratch[start + i * e + mode]
    to_node_axes(node, x)


@part
def move_coordinates(integers: IntArray, scratch: Array, record: int) -> None:
    """MOVES and CARRIED of a link: how its outboard node and its frame move per η̇, each in its axes."""
    e, memory = integers[record + at.MODES], integers[record + at.MEMORY]
    link = scratch[memory : memory + at.VECTORS]
    x, y = link[at.POINT : at.POINT + 6], link[at.OTHER : at.OTHER + 6]
    inner, outer = link[at.INNER : at.INNER + at.NODE], link[at.OUTER : at.OUTER + at.NODE]
    moves, carried = vector(memory, e, at.MOVES), vector(memory, e, at.CARRIED)
    for mode in range(e):
        if integers[record + at.OUTBOARD] >= 0:
            _node_rates(scratch, vector(memory, e, at.OUTER_ROWS), e, mode, outer, x)
        if integers[record + at.INBOARD] >= 0:
            _node_rates(scratch, vector(memory, e, at.INNER_ROWS), e, mode, inner, y)
            carry(inner[at.BACK : at.BACK + 12], y, 0, y, 0)
            for i in range(6):
                y[i] = -y[i]
                scratch[carried + i * e + mode] = y[i]
            if integers[record + at.OUTBOARD] >= 0:
                carry(outer, y, 0, y, 0)
                for i in range(6):
                    x[i] += y[i]
        if integers[record + at.OUTBOARD] >= 0:
            for i in range(6):
                scratch[moves + i * e + mode] = x[i]


@part
def own_inertia(reals: Array, integers: IntArray, scratch: Array, record: int, q: Array) -> None:
    """OWN of a link, M(η), and COUPLED, C(η)."""
    e, memory, axes = len(q), integers[record + at.MEMORY], integers[record + at.AXES]
    link, axis = scratch[memory : memory + at.VECTORS], integers[record + at.AXIS]
    own, half = link[at.OWN : at.OWN + 36], link[at.POINT : at.POINT + 6]
    coupled, constant = vector(memory, e, at.COUPLED), integers[record + at.COUPLING]
    for i in range(36):
        own[i] = reals[integers[record + at.RIGID] + i]
    for i in range(6 * e):
        scratch[coupled + i] = reals[constant + i]
    if integers[at.FIRST_ORDER] and e:
        turn_inertia(reals, integers, scratch, record, q)
        for a in range(axes):
            for i in range(6):
                half[i] = 0.0
            add_rows(reals, integers[record + at.HALF] + 6 * a * e, q, 1.0, half)
            turned = vector(memory, e, at.TURNED_Q + a)
            for r in range(3):
                turn = reals[axis + 3 * a + r]
                for i in range(6):
                    own[6 * (3 + r) + i] += turn * half[i]
                    own[6 * i + 3 + r] += turn * half[i]
                for j in range(e):
                    scratch[coupled + (3 + r) * e + j] += turn * scratch[turned + j]
    if integers[at.SECOND_ORDER] and e:
        for a in range(axes):
            for b in range(a, axes):
                start = square_inertia(reals, integers, scratch, record, a if a == b else a + b + 2, q)
                moment = dot(scratch[start : start + e], q, 0, e) * (0.5 if a == b else 1.0)
                for i in range(3):
                    for j in range(3):
                        turn = moment * reals[axis + 3 * a + i] * reals[axis + 3 * b + j]
                        own[6 * (3 + i) + 3 + j] += turn
                        own[6 * (3 + j) + 3 + i] += turn


@part
def shift_inertia(pose: Array, inertia: Array, x: Array) -> None:
    """Tᵀ I T: replace an inertia (6, 6) by that on the frame before."""
    for i in range(6):
        carry_back(pose, inertia, 6 * i, inertia, 6 * i)
    for j in range(6):
        for i in range(6):
            x[i] = inertia[6 * i + j]
        carry_back(pose, x, 0, x, 0)
        for i in range(6):
            inertia[6 * i + j] = x[i]


@part
def _fill(reals: Array, integers: IntArray, scratch: Array, k: int, place: int, pull: Array, out: Array) -> None:
    """Row and column of a coordinate of link k whose unit acceleration pulls at its frame with ``pull``.

    Its joint and all that stands before the link feel it.
    """
    for before in range(k, -1, -1):
        record = at.HEADER + before * at.RECORD
        memory, joint = integers[record + at.MEMORY], integers[record + at.JOINT]
        link = scratch[memory : memory + at.VECTORS]
        if before < k and integers[record + at.MODES]:
            e, first = integers[record + at.MODES], integers[record + at.FIRST_MODE]
            row = out[place, first : first + e]
            row[:] = 0.0
            add_columns(scratch, vector(memory, e, at.MOVES), e, pull, 6, 1.0, row)
            carry_back(link[at.OUTER : at.OUTER + at.NODE], pull, 0, pull, 0)
            for j in range(e):
                out[first + j, place] = row[j]
        if integers[record + at.INBOARD] >= 0:
            carry_back(link[at.INNER + at.BACK : at.INNER + at.BACK + 12], pull, 0, pull, 0)
        if joint >= 0:
            out[joint, place] = out[place, joint] = dot6(reals, integers[record + at.SCREW], pull, 0)
        carry_back(link, pull, 0, pull, 0)


@part
def _add_bent(scratch: Array, memory: int, e: int, mode: int, row: Array) -> None:
    """What the corrected twist adds to the inertia of a coordinate against those up to it."""
    change, changed = vector(memory, e, at.CHANGE), vector(memory, e, at.CHANGED)
    unchanged = vector(memory, e, at.UNCHANGED)
    for m in range(6):
        own, share = scratch[change + m * e + mode], scratch[unchanged + m * e + mode]
        for j in range(len(row)):
            row[j] += own * scratch[changed + m * e + j] + share * scratch[change + m * e + j]


@part
def _fill_modes(reals: Array, integers: IntArray, scratch: Array, k: int, out: Array) -> None:
    """Rows and columns of the elastic coordinates of a link, against each other and what stands before."""
    record = at.HEADER + k * at.RECORD
    e, first, memory = integers[record + at.MODES], integers[record + at.FIRST_MODE], integers[record + at.MEMORY]
    link = scratch[memory : memory + at.VECTORS]
    pull, borne = link[at.WRENCH : at.WRENCH + 6], link[at.PASSED : at.PASSED + 6]
    coupled, moves = vector(memory, e, at.COUPLED), vector(memory, e, at.MOVES)
    carried, elastic = vector(memory, e, at.CARRIED), integers[record + at.ELASTIC]
    bears, floats = k + 1 < integers[at.LINKS], integers[record + at.INBOARD] >= 0
    for i in range(e):
        row = out[first + i, first : first + i + 1]
        for j in range(i + 1):
            row[j] = reals[elastic + i * e + j]
        if integers[record + at.BEND] >= 0:
            _add_bent(scratch, memory, e, i, row)
        for m in range(6):
            pull[m] = scratch[coupled + m * e + i]
        if floats:
            for m in range(6):
                for r in range(6):
                    pull[m] += link[at.OWN + 6 * m + r] * scratch[carried + r * e + i]
            for m in range(6):
                own, share = scratch[carried + m * e + i], pull[m]
                for j in range(i + 1):
                    row[j] += share * scratch[carried + m * e + j] + own * scratch[coupled + m * e + j]
        if bears:
            for m in range(6):
                borne[m] = 0.0
                for r in range(6):
                    borne[m] += link[at.BORNE + 6 * m + r] * scratch[moves + r * e + i]
            for m in range(6):
                for j in range(i + 1):
                    row[j] += borne[m] * scratch[moves + m * e + j]
            carry_back(link[at.OUTER : at.OUTER + at.NODE], borne, 0, borne, 0)
            for m in range(6):
                pull[m] += borne[m]
        for j in range(i):
            out[first + j, first + i] = row[j]
        _fill(reals, integers, scratch, k, first + i, pull, out)


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M; see `erls.equations.compiled_system`."""
    place_frames(reals, integers, scratch, t, y, y, y[0:0])
    links = integers[at.LINKS]
    for k in range(links):
        move_coordinates(integers, scratch, at.HEADER + k * at.RECORD)
    for k in range(links - 1, -1, -1):
        record = at.HEADER + k * at.RECORD
        memory, first = integers[record + at.MEMORY], integers[record + at.FIRST_MODE]
        link = scratch[memory : memory + at.VECTORS]
        inertia, spare = link[at.INERTIA : at.INERTIA + 36], link[at.POINT : at.POINT + 6]
        pull = link[at.WRENCH : at.WRENCH + 6]
        own_inertia(reals, integers, scratch, record, y[first : first + integers[record + at.MODES]])
        if integers[record + at.BEND] >= 0:
            bent_inertia(reals, integers, scratch, record)
        _fill_modes(reals, integers, scratch, k, out)
        for i in range(36):
            inertia[i] = link[at.BORNE + i] if k + 1 < links else 0.0
        if k + 1 < links and integers[record + at.OUTBOARD] >= 0:
            shift_inertia(link[at.OUTER : at.OUTER + at.NODE], inertia, spare)
        for i in range(36):
            inertia[i] += link[at.OWN + i]
        if integers[record + at.INBOARD] >= 0:
            shift_inertia(link[at.INNER + at.BACK : at.INNER + at.BACK + 12], inertia, spare)
        joint, screw = integers[record + at.JOINT], integers[record + at.SCREW]
        if joint >= 0:
            for i in range(6):
                pull[i] = dot6(inertia, 6 * i, reals, screw)
            if integers[record + at.INBOARD] >= 0:  # from the joint back to the frame, where filling begins
                carry_back(link[at.INNER : at.INNER + at.NODE], pull, 0, pull, 0)
            _fill(reals, integers, scratch, k, joint, pull, out)
            out[joint, joint] += reals[integers[record + at.FORCES] + ROTOR]
        if k > 0:
            shift_inertia(link, inertia, spare)
            start = integers[record - at.RECORD + at.MEMORY]
            for i in range(36):
                scratch[start + at.BORNE + i] = inertia[i]

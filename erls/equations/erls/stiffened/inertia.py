"""The mass matrix: rows of the motion of each link over all coordinates, taken link by link, and their squares.

``rows`` is where they start in scratch, ``made`` the number of coordinates that move a link.
"""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.forces import pair_of
from erls.equations.erls.motion import place_frames
from erls.equations.erls.stiffened import layout as more
from erls.equations.erls.stiffened.bend import bend_frames, set_arm
from erls.equations.erls.stiffened.forces import curve_inertia, deform_inertia
from erls.equations.erls.stiffened.tensors import add_cross, add_rows, add_stack, clear
from erls.equations.serial.linear import add_bracket
from erls.maths.jit import kernel, part


@part
def _carry_rows(link: Array, scratch: Array, rows: int, size: int, made: int) -> None:
    """T times six rows."""
    p0, p1, p2 = link[9], link[10], link[11]
    for j in range(rows, rows + made):
        w0, w1, w2 = scratch[j + 3 * size], scratch[j + 4 * size], scratch[j + 5 * size]
        v0 = scratch[j] + w1 * p2 - w2 * p1
        v1 = scratch[j + size] + w2 * p0 - w0 * p2
        v2 = scratch[j + 2 * size] + w0 * p1 - w1 * p0
        for i in range(3):
            scratch[j + i * size] = link[i] * v0 + link[3 + i] * v1 + link[6 + i] * v2
            scratch[j + (3 + i) * size] = link[i] * w0 + link[3 + i] * w1 + link[6 + i] * w2


@part
def _leave(reals: Array, integers: IntArray, scratch: Array, record: int, mine: int, rows: int, size: int) -> None:
    """LINEAR and CURVE of a link become those of its outboard interface."""
    e, m, outward = integers[record + at.MODES], integers[mine + more.KEPT], integers[record + at.OUT]
    made = integers[mine + more.RECORD + more.START]
    elastic, bow = rows + made - e, integers[mine + more.BOW_Q]
    for r in range(6):
        curve = (more.CURVE + r) * size
        if integers[mine + more.BOWS]:
            turns = rows + (more.LINEAR + 3) * size
            add_rows(scratch, turns, size, m - e, scratch, bow + r * m, more.ONE, scratch, rows + curve, made)
            for i in range(e):
                scratch[elastic + curve + i] += scratch[bow + (r + 1) * m - e + i]
    for r in range(6):
        for i in range(e):
            scratch[elastic + (more.LINEAR + r) * size + i] += reals[outward + 6 * i + r]


@part
def _turn_joint(
    reals: Array, integers: IntArray, scratch: Array, record: int, mine: int, rows: int, size: int, made: int
) -> None:
    """The motion of a link by its joint, whose column follows ``made``, and by the arm to it."""
    memory, own, screw = integers[record + at.MEMORY], integers[mine + more.MEMORY], integers[record + at.SCREW]
    link, bent = scratch[memory : memory + at.VECTORS], scratch[own : own + more.NUMBERS]
    reach, armed, columns = integers[mine + more.REACH], integers[mine + more.ARMED], made
    if integers[record + at.JOINT] >= 0:
        columns += 1
        linear, curve = more.WEIGHTS, more.WEIGHTS + 6
        clear(bent, linear, 2 * more.MOVES)
        if record > at.HEADER:
            add_bracket(link, at.U, reals, screw, 1.0, bent, linear)
            add_bracket(bent, more.CARRIED, reals, screw, 1.0, bent, curve)
        if armed and integers[record + at.SLIDES]:
            clear(bent, more.SPARE, more.AXES)
            add_cross(link, at.U + 3, reals, reach, 1.0, bent, more.SPARE)
            add_cross(link, at.U + 3, bent, more.SPARE, 0.5, bent, curve)
        for r in range(6):
            scratch[rows + (more.TWISTS + r) * size + made] = reals[screw + r]
            scratch[rows + (more.LINEAR + r) * size + made] = bent[linear + r]
            scratch[rows + (more.CURVE + r) * size + made] = bent[curve + r]
    if armed:
        set_arm(reals, reach, link, bent)
        d0, d1, d2 = bent[more.SPARE], bent[more.SPARE + 1], bent[more.SPARE + 2]
        b0, b1, b2 = bent[more.SPARE + 3], bent[more.SPARE + 4], bent[more.SPARE + 5]
        f0, f1, f2 = link[at.U + 3], link[at.U + 4], link[at.U + 5]
        turn, place = rows + (more.LINEAR + 3) * size, rows + more.CURVE * size
        for j in range(columns):  # ½ (δφ × b + φ × (δφ × d))
            p, q, r = scratch[turn + j], scratch[turn + size + j], scratch[turn + 2 * size + j]
            c0, c1, c2 = q * d2 - r * d1, r * d0 - p * d2, p * d1 - q * d0
            scratch[place + j] += 0.5 * (q * b2 - r * b1 + f1 * c2 - f2 * c1)
            scratch[place + size + j] += 0.5 * (r * b0 - p * b2 + f2 * c0 - f0 * c2)
            scratch[place + 2 * size + j] += 0.5 * (p * b1 - q * b0 + f0 * c1 - f1 * c0)


@part
def _pull_curved(reals: Array, integers: IntArray, scratch: Array, record: int, mine: int) -> None:
    """TURNING and PULLS: M₀⁻¹ H on ω and M₀⁻¹ C."""
    m, axes, axis = integers[mine + more.KEPT], integers[record + at.AXES], integers[record + at.AXIS]
    own, pulls, rows = integers[mine + more.MEMORY], integers[mine + more.PULLS], integers[mine + more.ROWS_Q]
    bent = scratch[own : own + more.NUMBERS]
    s0, s1, s2 = bent[more.MOMENT], bent[more.MOMENT + 1], bent[more.MOMENT + 2]
    clear(scratch, pulls, 6 * m)
    for r in range(6):
        compliance, turning = integers[mine + more.COMPLIANCE] + 6 * r, more.TURNING + 3 * r
        c0, c1, c2 = reals[compliance], reals[compliance + 1], reals[compliance + 2]
        # of -S × ω
        bent[turning], bent[turning + 1], bent[turning + 2] = c2 * s1 - c1 * s2, c0 * s2 - c2 * s0, c1 * s0 - c0 * s1
        for a in range(axes):
            total = 0.0
            for c in range(3):
                total += reals[compliance + 3 + c] * bent[more.SPIN + 3 * a + c]
            for i in range(3):
                bent[turning + i] += total * reals[axis + 3 * a + i]
        add_stack(scratch, rows, m, reals, compliance, more.MOVES, scratch, pulls + r * m)


@part
def _move(integers: IntArray, scratch: Array, record: int, mine: int, rows: int, size: int, made: int) -> None:
    """MOTION: (w, ω) that inertia knows of a link, whose own elastic columns are the last before ``made``."""
    e, m = integers[record + at.MODES], integers[mine + more.KEPT]
    turning, pulls = integers[mine + more.MEMORY] + more.TURNING, integers[mine + more.PULLS]
    spins = rows + (more.TWISTS + 3) * size
    for r in range(6):
        linear, curve = rows + (more.LINEAR + r) * size, rows + (more.CURVE + r) * size
        to = rows + (more.MOTION + r) * size
        for j in range(made):
            scratch[to + j] = scratch[rows + (more.TWISTS + r) * size + j]
        if integers[mine + more.CURVED]:
            add_rows(scratch, spins, size, more.AXES, scratch, turning + 3 * r, more.ONE, scratch, to, made)
            for first in (more.LINEAR + 3, more.CURVE + 3):
                add_rows(scratch, rows + first * size, size, m - e, scratch, pulls + r * m, more.ONE, scratch, to, made)
            for i in range(e):
                scratch[to + made - e + i] += scratch[pulls + (r + 1) * m - e + i]
        for j in range(made):
            if r >= 3:
                scratch[to + 3 * size + j] = scratch[to + j]
            scratch[to + j] += scratch[linear + j] + scratch[curve + j]


@part
def _set_inertia(reals: Array, integers: IntArray, scratch: Array, record: int, mine: int) -> None:
    """INERTIA over (w, ω), with the elastic coordinates held."""
    n, own, turned = 6 + integers[record + at.MODES], integers[mine + more.MEMORY], integers[mine + more.X_Q]
    inertia = own + more.INERTIA
    clear(scratch, inertia, more.BOTH * more.BOTH)
    for j in range(6):
        for i in range(6):
            scratch[inertia + 9 * i + j] = reals[integers[mine + more.MASS] + j * n + i]
    for a in range(3):
        if integers[at.FIRST_ORDER]:
            for i in range(6):
                both = scratch[turned + a * n + i]
                scratch[inertia + 9 * i + 6 + a] = scratch[inertia + 9 * (6 + a) + i] = both
        if integers[at.SECOND_ORDER]:
            for b in range(3):
                scratch[inertia + 9 * (6 + a) + 6 + b] = scratch[own + more.TURN_MOMENTS + pair_of(3, a, b)]


@part
def _add(matrix: Array, i: int, j: int, value: float) -> None:
    """To a lower triangle."""
    if i >= j:
        matrix[i * (i + 1) // 2 + j] += value
    else:
        matrix[j * (j + 1) // 2 + i] += value


@part
def _square(
    reals: Array, integers: IntArray, scratch: Array, record: int, mine: int, rows: int, size: int, made: int
) -> None:
    """Add what a link gives to the mass matrix."""
    e, head = integers[record + at.MODES], more.header(integers, integers[at.LINKS])
    inertia, mass, n = integers[mine + more.MEMORY] + more.INERTIA, integers[mine + more.MASS], 6 + e
    places, matrix = integers[head + more.ORDER], scratch[integers[head + more.MATRIX] :]
    motion, pull, total = rows + more.MOTION * size, rows + more.PULL * size, rows + more.SUM * size
    for i in range(9):
        clear(scratch, pull + i * size, made)
        add_rows(scratch, motion, size, more.BOTH, scratch, inertia + 9 * i, more.ONE, scratch, pull + i * size, made)
    for i in range(made):
        clear(scratch, total, i + 1)
        add_rows(scratch, pull, size, more.BOTH, scratch, motion + i, size, scratch, total, i + 1)
        for j in range(i + 1):
            _add(matrix, integers[places + i], integers[places + j], scratch[total + j])
    for i in range(6, n):
        own = made - n + i
        clear(scratch, total, made)
        add_rows(scratch, motion, size, more.MOVES, reals, mass + i * n, more.ONE, scratch, total, made)
        if integers[at.FIRST_ORDER]:
            turned = integers[mine + more.X_Q] + i
            add_rows(scratch, motion + 6 * size, size, more.AXES, scratch, turned, n, scratch, total, made)
        scratch[total + own] *= 2  # row and column meet here
        for j in range(6, i + 1):
            scratch[total + made - n + j] += reals[mass + i * n + j]
        for j in range(made):
            _add(matrix, integers[places + own], integers[places + j], scratch[total + j])


@part
def set_mass(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array) -> None:
    """MATRIX: the lower triangle of the mass matrix, row after row."""
    links, size = integers[at.LINKS], len(y)
    head = more.header(integers, links)
    matrix, rows = integers[head + more.MATRIX], integers[head + more.COLUMNS]
    place_frames(reals, integers, scratch, t, y, y, scratch[0:0])
    bend_frames(reals, integers, scratch, False)
    clear(scratch, matrix, size * (size + 1) // 2)
    clear(scratch, rows, more.MOTION * size)
    for k in range(links):
        record, mine = at.HEADER + k * at.RECORD, head + more.HEADER + k * more.RECORD
        before, joint = integers[mine + more.START], integers[record + at.JOINT]
        made = before + integers[record + at.MODES] + (1 if joint >= 0 else 0)
        if k > 0:
            memory = integers[record + at.MEMORY]
            _leave(reals, integers, scratch, record - at.RECORD, mine - more.RECORD, rows, size)
            for group in range(3):
                link = scratch[memory : memory + at.VECTORS]
                _carry_rows(link, scratch, rows + 6 * group * size, size, before)
        _turn_joint(reals, integers, scratch, record, mine, rows, size, before)
        deform_inertia(reals, integers, scratch, record, mine)
        if integers[mine + more.CURVED]:
            curve_inertia(reals, integers, scratch, record, mine)
            _pull_curved(reals, integers, scratch, record, mine)
        _move(integers, scratch, record, mine, rows, size, made)
        _set_inertia(reals, integers, scratch, record, mine)
        _square(reals, integers, scratch, record, mine, rows, size, made)
        if joint >= 0:
            rotor = reals[integers[record + at.FORCES] + at.ROTOR]
            scratch[matrix + joint * (joint + 1) // 2 + joint] += rotor


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M; see `erls.equations.compiled_system`."""
    set_mass(reals, integers, scratch, t, y)
    next_one = integers[more.header(integers, integers[at.LINKS]) + more.MATRIX]
    for i in range(len(y)):
        for j in range(i + 1):
            out[i, j] = out[j, i] = scratch[next_one]
            next_one += 1

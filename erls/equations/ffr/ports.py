"""What the coordinates of a link do to the rest, through few ports.

With the acceleration g of a link's frame when its coordinates rest, all that they do passes through ports z = P ẍ: the
momentum C(η) that they give the frame, their motion of the frame and of the outboard node, and the two shares of a
corrected twist. The energy of all but ½ ẍᵀ D ẍ is a quadratic form Q of z and g, so that with G = P D⁻¹ Pᵀ

    (1 + G Q_zz) z = P D⁻¹ b - G (Q_zg g + h),   ẍ = D⁻¹ (b - Pᵀ (Q_zz z + Q_zg g + h))

for forces h of the links after it. Everything is in the coordinates of `layout.BASIS`, in which D is diagonal.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.ffr import layout as at
from erls.equations.ffr.rows import vector
from erls.equations.serial.linear import add_columns, carry, carry_back, dot
from erls.maths.jit import part


@part
def count(integers: IntArray, record: int, bears: bool) -> int:
    """Ports of a link: C(η), then CARRIED, MOVES, CHANGE and twice its partner, where there are such."""
    if integers[record + at.MODES] == 0:
        return 0
    ports = 12 if bears else 6
    if integers[record + at.INBOARD] >= 0:
        ports += 6
    if integers[record + at.BEND] >= 0:
        ports += 12
    return ports


@part
def _invert(a: Array, n: int) -> None:
    """Replace the right half of a (n, 2 n) by the inverse of the left one."""
    width = 2 * n
    for i in range(n):
        for j in range(n):
            a[i * width + n + j] = 1.0 if i == j else 0.0
    for k in range(n):
        row, largest = k, abs(a[k * width + k])
        for i in range(k + 1, n):
            if abs(a[i * width + k]) > largest:
                row, largest = i, abs(a[i * width + k])
        if row != k:
            for j in range(k, width):
                a[k * width + j], a[row * width + j] = a[row * width + j], a[k * width + j]
        inverse = 1.0 / a[k * width + k]
        for j in range(k + 1, width):
            a[k * width + j] *= inverse
        for i in range(n):
            if i != k:
                weight = a[i * width + k]
                for j in range(k + 1, width):
                    a[i * width + j] -= weight * a[k * width + j]


@part
def _set_row(reals: Array, basis: int, e: int, scratch: Array, start: int, out: Array) -> None:
    """A row (e,) of scratch in the coordinates of the basis: Vᵀ times it."""
    out[:] = 0.0
    add_columns(reals, basis, e, scratch[start : start + e], e, 1.0, out)


@part
def set_rows(reals: Array, integers: IntArray, scratch: Array, record: int, bears: bool, own: Array) -> None:
    """P of a link."""
    e, memory, basis = integers[record + at.MODES], integers[record + at.MEMORY], integers[record + at.BASIS]
    row = at.DIAGONAL + 2 * e
    for i in range(6):
        _set_row(reals, basis, e, scratch, vector(memory, e, at.COUPLED + i), own[row : row + e])
        row += e
    if integers[record + at.INBOARD] >= 0:
        for i in range(6):
            _set_row(reals, basis, e, scratch, vector(memory, e, at.CARRIED + i), own[row : row + e])
            row += e
    if bears:
        for i in range(6):
            _set_row(reals, basis, e, scratch, vector(memory, e, at.MOVES + i), own[row : row + e])
            row += e
    if integers[record + at.BEND] >= 0:
        changed, unchanged = vector(memory, e, at.CHANGED), vector(memory, e, at.UNCHANGED)
        for i in range(6 * e):
            scratch[changed + i] += scratch[unchanged + i]
        for i in range(12):
            _set_row(reals, basis, e, scratch, vector(memory, e, at.CHANGE + i), own[row : row + e])
            row += e


@part
def _bind(integers: IntArray, record: int, bears: bool, ports: int, own: Array) -> None:
    """BOUND: Q_zz."""
    bound = own[at.BOUND : at.BOUND + ports * ports]
    bound[:] = 0.0
    place = 6
    if integers[record + at.INBOARD] >= 0:
        for i in range(6):
            bound[i * ports + place + i] = 1.0
            bound[(place + i) * ports + i] = 1.0
            for j in range(6):
                bound[(place + i) * ports + place + j] = own[at.RESTING + 6 * i + j]
        place += 6
    if bears:
        for i in range(6):
            for j in range(6):
                bound[(place + i) * ports + place + j] = own[at.HANGING + 6 * i + j]
        place += 6
    if integers[record + at.BEND] >= 0:
        for i in range(6):
            bound[(place + i) * ports + place + 6 + i] = 0.5
            bound[(place + 6 + i) * ports + place + i] = 0.5


@part
def press(integers: IntArray, record: int, bears: bool, frame: Array, node: Array, own: Array, out: Array) -> None:
    """Q_zg g, from g and the motion that it gives to the outboard node."""
    out[:] = 0.0
    place = 6
    for i in range(6):
        out[i] = frame[i]
    if integers[record + at.INBOARD] >= 0:
        for i in range(6):
            for j in range(6):
                out[place + i] += own[at.RESTING + 6 * i + j] * frame[j]
        place += 6
    if bears:
        for i in range(6):
            for j in range(6):
                out[place + i] += own[at.HANGING + 6 * i + j] * node[j]


@part
def press_back(integers: IntArray, record: int, bears: bool, z: Array, own: Array, out: Array, on_node: Array) -> None:
    """Q_gz z: the part on the frame, and that on the outboard node."""
    place = 6
    for i in range(6):
        out[i] = z[i]
        on_node[i] = 0.0
    if integers[record + at.INBOARD] >= 0:
        for i in range(6):
            for j in range(6):
                out[i] += own[at.RESTING + 6 * i + j] * z[place + j]
        place += 6
    if bears:
        for i in range(6):
            for j in range(6):
                on_node[i] += own[at.HANGING + 6 * i + j] * z[place + j]


@part
def give_way(integers: IntArray, record: int, bears: bool, ports: int, own: Array) -> None:
    """FLEXIBILITY G, SOLVER (1 + G Q_zz)⁻¹ and OUTPUT, what z is per unit of g; and its share in WHOLE."""
    e = integers[record + at.MODES]
    rows, diagonal = at.DIAGONAL + 2 * e, own[at.DIAGONAL : at.DIAGONAL + e]
    spare = own[at.DIAGONAL + e : at.DIAGONAL + 2 * e]
    flexible, bound = own[at.FLEXIBILITY : at.BOUND], own[at.BOUND : at.SOLVER]
    solver, output = own[at.SOLVER : at.DIAGONAL], own[at.OUTPUT : at.FLEXIBILITY]
    frame, node, given = own[at.ARRIVED : at.ARRIVED + 6], own[at.GONE : at.GONE + 6], own[at.GIVEN_PORTS : at.OUTPUT]
    pressed, on_frame = own[at.PRESSED : at.PRESSED + ports], own[at.REST : at.REST + 6]
    _bind(integers, record, bears, ports, own)
    for i in range(ports):
        for m in range(e):
            spare[m] = own[rows + i * e + m] * diagonal[m]
        for j in range(i + 1):
            flexible[i * ports + j] = dot(spare, own[rows + j * e : rows + (j + 1) * e], 0, e)
            flexible[j * ports + i] = flexible[i * ports + j]
    for i in range(ports):
        for j in range(ports):
            solver[i * 2 * ports + j] = 1.0 if i == j else 0.0
        for m in range(ports):
            weight = flexible[i * ports + m]
            for j in range(ports):
                solver[i * 2 * ports + j] += weight * bound[m * ports + j]
    _invert(solver, ports)
    for column in range(6):
        for i in range(6):
            frame[i] = 1.0 if i == column else 0.0
        carry(own[at.POSE_OUTER : at.POSE_OUTER + 12], frame, 0, node, 0)
        press(integers, record, bears, frame, node, own, pressed)
        for i in range(ports):
            given[i] = 0.0
            for j in range(ports):
                given[i] -= flexible[i * ports + j] * pressed[j]
        for i in range(ports):
            output[6 * i + column] = 0.0
            for j in range(ports):
                output[6 * i + column] += solver[i * 2 * ports + ports + j] * given[j]
        for i in range(ports):
            given[i] = output[6 * i + column]
        press_back(integers, record, bears, given, own, on_frame, node)
        carry_back(own[at.POSE_OUTER : at.POSE_OUTER + 12], node, 0, node, 0)
        for i in range(6):
            own[at.WHOLE + 6 * i + column] += on_frame[i] + node[i]

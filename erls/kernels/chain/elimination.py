"""M x = f solved link by link, from the tip inward and back, at a cost that grows with the number of links.

What hangs on a link acts on it as an inertia I (9, 9) over the motion of its outboard interface and a force p. The
elastic coordinates of the link follow from its own motion m = (w, ω) as C ẍ_d = O m + o, so the interface moves with
Φ m + φ, Φ = 1 + O; eliminating them leaves Q I Φ on m. Then the joint goes.
"""

from __future__ import annotations

from erls.kernels import contract
from erls.kernels.chain import layout as at
from erls.kernels.chain.balance import residual
from erls.kernels.chain.forces import vector
from erls.kernels.chain.inertia import carry9, carry9_back, carry_inertia_back, joint_path, link_inertia
from erls.kernels.chain.linear import add_columns, dot
from erls.kernels.contract import Array, IntArray
from erls.kernels.jit import kernel, part

_SINGULAR = 1e-14  # inertia along a joint against what it was before the elimination of the rest


@part
def solve_six(a: Array, columns: int) -> None:
    """Replace the right sides in a (6, columns), behind its six first columns, by the solutions."""
    for k in range(6):
        row, largest = k, abs(a[k * columns + k])
        for i in range(k + 1, 6):
            if abs(a[i * columns + k]) > largest:
                row, largest = i, abs(a[i * columns + k])
        if row != k:
            for j in range(k, columns):
                a[k * columns + j], a[row * columns + j] = a[row * columns + j], a[k * columns + j]
        inverse = 1.0 / a[k * columns + k]
        for j in range(k + 1, columns):
            a[k * columns + j] *= inverse
        for i in range(6):
            factor = a[i * columns + k]
            if i != k:
                for j in range(k + 1, columns):
                    a[i * columns + j] -= factor * a[k * columns + j]


@part
def relax(reals: Array, integers: IntArray, scratch: Array, record: int, out: Array) -> None:
    """Take the elastic coordinates of a link out of its INERTIA and LOADING, as if nothing hung on it.

    ``out`` holds the forces on them and then M_ee⁻¹ times these; COLUMN gets M_ee⁻¹ (X_a q)_e for each axis.
    """
    e = integers[record + at.MODES]
    n = 6 + e
    memory, axes, axis = integers[record + at.MEMORY], integers[record + at.AXES], integers[record + at.AXIS]
    first = integers[record + at.FIRST_MODE]
    link = scratch[memory : memory + at.VECTORS]
    towards, share, inverse = (
        integers[record + at.TOWARDS],
        integers[record + at.RIGID_SHARE],
        integers[record + at.INVERSE],
    )
    inertia, loading = link[at.INERTIA : at.INERTIA + 81], link[at.LOADING : at.LOADING + 9]
    start = vector(memory, n, at.RELAXED)
    forces, relaxed = out[first : first + e], scratch[start : start + e]
    for i in range(6):
        for j in range(6):
            inertia[9 * i + j] -= reals[share + 6 * i + j]
        loading[i] += dot(reals[towards + i * e : towards + (i + 1) * e], forces, 0, e)
    if integers[at.FIRST_ORDER]:
        for a in range(axes):
            start, start_column = vector(memory, n, at.X_Q + a) + 6, vector(memory, n, at.COLUMN + a)
            xq, column = scratch[start : start + e], scratch[start_column : start_column + e]
            column[:] = 0.0
            add_columns(reals, inverse, e, xq, e, 1.0, column)
            load = dot(column, forces, 0, e)
            for j in range(3):
                loading[6 + j] += load * reals[axis + 3 * a + j]
            for i in range(6):
                both = dot(reals[towards + i * e : towards + (i + 1) * e], xq, 0, e)
                for j in range(3):
                    inertia[9 * i + 6 + j] -= both * reals[axis + 3 * a + j]
                    inertia[54 + 9 * j + i] -= both * reals[axis + 3 * a + j]
            for b in range(a + 1):
                start = vector(memory, n, at.X_Q + b) + 6
                both = dot(column, scratch[start : start + e], 0, e)
                for i in range(3):
                    for j in range(3):
                        turns = reals[axis + 3 * a + i] * reals[axis + 3 * b + j]
                        if b < a:
                            turns += reals[axis + 3 * b + i] * reals[axis + 3 * a + j]
                        inertia[60 + 9 * i + j] -= both * turns
    relaxed[:] = 0.0
    add_columns(reals, inverse, e, forces, e, 1.0, relaxed)
    for i in range(e):
        forces[i] = relaxed[i]


@part
def burden(reals: Array, integers: IntArray, scratch: Array, record: int, out: Array) -> None:
    """Add what hangs on a relaxed link, BORNE and PASSED, to its INERTIA and LOADING.

    Forces f_w on the outboard interface move it by G f_w more, G = C M_ee⁻¹ Cᵀ, so that O and o solve
    (1 + G Y) (O m + o) = o₀ - G_B m - G ((I m)_w + p_w), with Y the block of I and G_B = C M_ee⁻¹ B.
    """
    e = integers[record + at.MODES]
    n = 6 + e
    memory, axes, axis = integers[record + at.MEMORY], integers[record + at.AXES], integers[record + at.AXIS]
    first = integers[record + at.FIRST_MODE]
    link = scratch[memory : memory + at.VECTORS]
    share, cross, outward = (
        integers[record + at.OUT_SHARE],
        integers[record + at.CROSS_SHARE],
        integers[record + at.OUT],
    )
    inertia, loading = link[at.INERTIA : at.INERTIA + 81], link[at.LOADING : at.LOADING + 9]
    borne, passed = link[at.BORNE : at.BORNE + 81], link[at.PASSED : at.PASSED + 9]
    square, bound = link[at.SQUARE : at.SQUARE + 96], link[at.OUTPUT : at.OUTPUT + 54]
    product = link[at.PRODUCT : at.PRODUCT + 81]
    relaxed = out[first : first + e]
    # G_B, kept in bound
    for i in range(6):
        for j in range(6):
            bound[9 * i + j] = reals[cross + 6 * i + j]
        for j in range(3):
            bound[9 * i + 6 + j] = 0.0
        square[16 * i + 15] = 0.0
    for j in range(e):
        for i in range(6):
            square[16 * i + 15] += reals[outward + 6 * j + i] * relaxed[j]
    if integers[at.FIRST_ORDER]:
        for a in range(axes):
            start = vector(memory, n, at.COLUMN + a)
            for i in range(6):
                both = 0.0
                for j in range(e):
                    both += reals[outward + 6 * j + i] * scratch[start + j]
                for j in range(3):
                    bound[9 * i + 6 + j] += both * reals[axis + 3 * a + j]
    for i in range(6):
        for j in range(9):
            total = 0.0
            for m in range(6):
                total += reals[share + 6 * i + m] * borne[9 * m + j]
            square[16 * i + 6 + j] = -bound[9 * i + j] - total
            if j < 6:
                square[16 * i + j] = total + (1.0 if i == j else 0.0)
        for m in range(6):
            square[16 * i + 15] -= reals[share + 6 * i + m] * passed[m]
    solve_six(square, 16)
    # I Φ and I φ + p; then less G_Bᵀ of their first six rows
    for i in range(9):
        for j in range(9):
            total = borne[9 * i + j]
            for m in range(6):
                total += borne[9 * i + m] * square[16 * m + 6 + j]
            product[9 * i + j] = total
            inertia[9 * i + j] += total
        for m in range(6):
            passed[i] += borne[9 * i + m] * square[16 * m + 15]
        loading[i] += passed[i]
    for m in range(6):
        for i in range(9):
            for j in range(9):
                inertia[9 * i + j] -= bound[9 * m + i] * product[9 * m + j]
            loading[i] -= bound[9 * m + i] * passed[m]
    for i in range(6):
        for j in range(9):
            link[at.OUTPUT + 9 * i + j] = square[16 * i + 6 + j]
        link[at.OUTPUT_FREE + i] = square[16 * i + 15]


@part
def _quadratic(link: Array, start: int) -> float:
    """sᵀ I s for the inertia that starts there."""
    total = 0.0
    for i in range(9):
        for j in range(9):
            total += link[at.PATH + i] * link[start + 9 * i + j] * link[at.PATH + j]
    return total


@part
def _move_link(reals: Array, integers: IntArray, scratch: Array, k: int, out: Array) -> None:
    """Joint and elastic accelerations of a link whose predecessor's are known."""
    record = at.HEADER + k * at.RECORD
    e, first = integers[record + at.MODES], integers[record + at.FIRST_MODE]
    memory, axes, axis = integers[record + at.MEMORY], integers[record + at.AXES], integers[record + at.AXIS]
    link = scratch[memory : memory + at.VECTORS]
    move = link[at.MOVE : at.MOVE + 9]
    if k == 0:
        move[:] = 0.0
    else:
        start = integers[record - at.RECORD + at.MEMORY]
        before = scratch[start : start + at.VECTORS]
        for i in range(9):  # of the interface
            move[i] = before[at.MOVE + i]
        for i in range(6):
            move[i] += before[at.OUTPUT_FREE + i]
            for j in range(9):
                move[i] += before[at.OUTPUT + 9 * i + j] * before[at.MOVE + j]
        carry9(link, link, at.MOVE, link, at.MOVE)
    joint = integers[record + at.JOINT]
    if joint >= 0:
        left = out[joint]
        for i in range(9):
            left -= link[at.PULL + i] * move[i]
        left /= link[at.EFFECTIVE]
        out[joint] = left
        for i in range(9):
            move[i] += link[at.PATH + i] * left
    forces = out[first : first + e]
    towards = integers[record + at.TOWARDS]
    for i in range(6):
        row = reals[towards + i * e : towards + (i + 1) * e]
        for j in range(e):
            forces[j] -= move[i] * row[j]
    if integers[at.FIRST_ORDER]:
        for a in range(axes):
            turn = 0.0
            for i in range(3):
                turn += reals[axis + 3 * a + i] * move[6 + i]
            start = vector(memory, 6 + e, at.COLUMN + a)
            column = scratch[start : start + e]
            for j in range(e):
                forces[j] -= turn * column[j]
    if k + 1 < integers[at.LINKS]:
        lead = integers[record + at.OUT_TOWARDS]
        for i in range(6):  # f_w: what the links after it put on the interface
            load = link[at.PASSED + i]
            for j in range(9):
                load += link[at.PRODUCT + 9 * i + j] * move[j]
            row = reals[lead + i * e : lead + (i + 1) * e]
            for j in range(e):
                forces[j] -= load * row[j]


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f; see `erls.kernels.contract`."""
    residual(reals, integers, scratch, t, y, v, scratch[0:0], out)
    for i in range(len(out)):
        out[i] = -out[i]
    links = integers[at.LINKS]
    for k in range(links - 1, -1, -1):
        record = at.HEADER + k * at.RECORD
        memory = integers[record + at.MEMORY]
        link = scratch[memory : memory + at.VECTORS]
        joint = integers[record + at.JOINT]
        link[at.LOADING : at.LOADING + 9] = 0.0
        link_inertia(reals, integers, scratch, record)
        before_elimination = 0.0
        joint_path(reals, integers, record, link)
        if joint >= 0:
            before_elimination = _quadratic(link, at.INERTIA)
            if k + 1 < links:
                before_elimination += _quadratic(link, at.BORNE)
        relax(reals, integers, scratch, record, out)
        if k + 1 < links:
            burden(reals, integers, scratch, record, out)
        if joint >= 0:
            along = reals[integers[record + at.FORCES] + at.ROTOR]
            before_elimination += along
            left = out[joint]
            for i in range(9):
                total = 0.0
                for j in range(9):
                    total += link[at.INERTIA + 9 * i + j] * link[at.PATH + j]
                link[at.PULL + i] = total
            for i in range(9):
                along += link[at.PULL + i] * link[at.PATH + i]
                left -= link[at.LOADING + i] * link[at.PATH + i]
            if not along > _SINGULAR * before_elimination:
                return int(joint + 1)
            link[at.EFFECTIVE] = along
            out[joint] = left
            if k > 0:
                for i in range(9):
                    link[at.LOADING + i] += link[at.PULL + i] * (left / along)
                    for j in range(9):
                        link[at.INERTIA + 9 * i + j] -= link[at.PULL + i] * (link[at.PULL + j] / along)
        if k > 0:
            start = integers[record - at.RECORD + at.MEMORY]
            before = scratch[start : start + at.VECTORS]
            carry_inertia_back(link, at.INERTIA, before, at.BORNE)
            carry9_back(link, link, at.LOADING, 1, before, at.PASSED, 1)
    for k in range(links):
        _move_link(reals, integers, scratch, k, out)
    return 0

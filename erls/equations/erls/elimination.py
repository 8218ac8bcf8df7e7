"""Equations with the mass matrix solved link by link, at a cost that grows with the number of links.

What hangs on a link acts on it as an inertia I (9, 9) over the motion of its outboard interface and a force p. The
elastic coordinates of the link follow from its own motion m = (w, ω) as C ẍ_d = O m + o, so the interface moves with
Φ m + φ, Φ = 1 + O; eliminating them leaves Q I Φ on m. Then the joint goes.

`eliminate` does what depends on the matrix, from the tip inward; `erls.equations.erls.substitution` does the same to a
right side, inward and back. The matrix may be M + α C + β K with numbers α, β, also complex ones. Both work in the
coordinates z of each link with ẍ_d = V z in which M_ee is 1 and M_ee + α C + β K the diagonal D; what C has beside its
diagonal is left out. What belongs to one α, β lies in ``blocks``: the parts of `layout.block_size` for each link, which
start where the entry ``which`` of its record says. ``work`` has the layout of scratch, and may be it.
"""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.balance import residual
from erls.equations.erls.forces import vector
from erls.equations.erls.inertia import carry_inertia_back, joint_path, link_inertia
from erls.equations.erls.substitution import substitute
from erls.equations.serial.linear import add_columns, dot
from erls.maths.jit import kernel, part

_SINGULAR = 1e-14  # inertia along a joint against what it was before the elimination of the rest


@part
def invert_six(a: Array) -> float:
    """Replace the right half of a (6, 12) by the inverse of the left one; -1.0 where a real determinant is negative."""
    sign = 1.0
    for i in range(6):
        for j in range(6):
            a[12 * i + 6 + j] = 1.0 if i == j else 0.0
    for k in range(6):
        row, largest = k, abs(a[k * 12 + k])
        for i in range(k + 1, 6):
            if abs(a[i * 12 + k]) > largest:
                row, largest = i, abs(a[i * 12 + k])
        if row != k:
            sign = -sign
            for j in range(k, 12):
                a[k * 12 + j], a[row * 12 + j] = a[row * 12 + j], a[k * 12 + j]
        if a[k * 12 + k].real < 0.0:
            sign = -sign
        inverse = 1.0 / a[k * 12 + k]
        for j in range(k + 1, 12):
            a[k * 12 + j] *= inverse
        for i in range(6):
            factor = a[i * 12 + k]
            if i != k:
                for j in range(k + 1, 12):
                    a[i * 12 + j] -= factor * a[k * 12 + j]
    return sign


@part
def _relax_inertia(
    reals: Array, integers: IntArray, scratch: Array, work: Array, blocks: Array, block: int, record: int
) -> None:
    """Take the elastic coordinates of a link out of its INERTIA, as if nothing hung on it.

    COLUMN gets D⁻¹ Vᵀ (X_a q)_e for each axis.
    """
    e = integers[record + at.MODES]
    n = 6 + e
    memory, axes, axis = integers[record + at.MEMORY], integers[record + at.AXES], integers[record + at.AXIS]
    inertia = work[memory + at.INERTIA : memory + at.INERTIA + 81]
    towards, share, basis = block + at.towards(e), block + at.rigid_share(e), integers[record + at.BASIS]
    for i in range(6):
        for j in range(6):
            inertia[9 * i + j] -= blocks[share + 6 * i + j]
    if integers[at.FIRST_ORDER]:
        for a in range(axes):
            start, start_column = vector(memory, n, at.X_RATE + a), vector(memory, n, at.COLUMN + a)
            xq, column = scratch[start : start + e], work[start_column : start_column + e]
            start = vector(memory, n, at.X_Q + a) + 6
            xq[:] = 0.0
            add_columns(reals, basis, e, scratch[start : start + e], e, 1.0, xq)
            for i in range(e):
                column[i] = blocks[block + i] * xq[i]
            for i in range(6):
                both = dot(blocks[towards + i * e : towards + (i + 1) * e], xq, 0, e)
                for j in range(3):
                    inertia[9 * i + 6 + j] -= both * reals[axis + 3 * a + j]
                    inertia[54 + 9 * j + i] -= both * reals[axis + 3 * a + j]
            for b in range(a + 1):
                start = vector(memory, n, at.X_RATE + b)
                both = dot(column, scratch[start : start + e], 0, e)
                for i in range(3):
                    for j in range(3):
                        turns = reals[axis + 3 * a + i] * reals[axis + 3 * b + j]
                        if b < a:
                            turns += reals[axis + 3 * b + i] * reals[axis + 3 * a + j]
                        inertia[60 + 9 * i + j] -= both * turns


@part
def _burden_inertia(reals: Array, integers: IntArray, work: Array, blocks: Array, block: int, record: int) -> float:
    """Add what hangs on a relaxed link, BORNE, to its INERTIA; the sign of `invert_six`.

    Forces f_w on the outboard interface move it by G f_w more, G = C D⁻¹ Cᵀ, so that O and o solve
    (1 + G Y) (O m + o) = o₀ - G_B m - G ((I m)_w + p_w), with Y the block of I and G_B = C D⁻¹ B in BOUND.
    """
    e = integers[record + at.MODES]
    n = 6 + e
    memory, axes, axis = integers[record + at.MEMORY], integers[record + at.AXES], integers[record + at.AXIS]
    link = work[memory : memory + at.VECTORS]
    share, cross, outward = block + at.out_share(e), block + at.cross_share(e), integers[record + at.OUT_BASIS]
    inertia, borne = link[at.INERTIA : at.INERTIA + 81], link[at.BORNE : at.BORNE + 81]
    square, bound = link[at.SQUARE : at.SQUARE + 72], link[at.BOUND : at.BOUND + 54]
    product, output = link[at.PRODUCT : at.PRODUCT + 81], link[at.OUTPUT : at.OUTPUT + 54]
    for i in range(6):
        for j in range(6):
            bound[9 * i + j] = blocks[cross + 6 * i + j]
        for j in range(3):
            bound[9 * i + 6 + j] = 0.0
    if integers[at.FIRST_ORDER]:
        for a in range(axes):
            start = vector(memory, n, at.COLUMN + a)
            column = work[start : start + e]
            for i in range(6):
                both = 0.0
                for j in range(e):
                    both += reals[outward + 6 * j + i] * column[j]
                for j in range(3):
                    bound[9 * i + 6 + j] += both * reals[axis + 3 * a + j]
    for i in range(6):
        for j in range(9):
            total = blocks[share + 6 * i] * borne[j]
            for m in range(1, 6):
                total += blocks[share + 6 * i + m] * borne[9 * m + j]
            product[9 * i + j] = -bound[9 * i + j] - total
            if j < 6:
                square[12 * i + j] = total + (1.0 if i == j else 0.0)
    sign = invert_six(square)
    for i in range(6):
        for j in range(9):
            output[9 * i + j] = 0.0
            for m in range(6):
                output[9 * i + j] += square[12 * i + 6 + m] * product[9 * m + j]
    # I Φ; then less G_Bᵀ of its first six rows
    for i in range(9):
        for j in range(9):
            total = borne[9 * i + j]
            for m in range(6):
                total += borne[9 * i + m] * output[9 * m + j]
            product[9 * i + j] = total
            inertia[9 * i + j] += total
    for m in range(6):
        for i in range(9):
            for j in range(9):
                inertia[9 * i + j] -= bound[9 * m + i] * product[9 * m + j]
    return sign


@part
def _quadratic(link: Array, start: int) -> float:
    """sᵀ I s for the inertia that starts there."""
    total = 0.0
    for i in range(9):
        for j in range(9):
            total += link[at.PATH + i] * link[start + 9 * i + j] * link[at.PATH + j]
    return total


@part
def eliminate(
    reals: Array, integers: IntArray, scratch: Array, work: Array, blocks: Array, which: int, definite: bool
) -> int:
    """Inertias from the tip inward, RESISTANCE along joints included; in scratch the links are placed and deformed.

    0, or 1 + the number of a coordinate whose motion nothing resists; or, where the matrix should be positive
    ``definite``, whose motion the rest drives.
    """
    links = integers[at.LINKS]
    for k in range(links - 1, -1, -1):
        record = at.HEADER + k * at.RECORD
        memory, joint, block = integers[record + at.MEMORY], integers[record + at.JOINT], integers[record + which]
        link = work[memory : memory + at.VECTORS]
        link_inertia(reals, integers, scratch, record)
        joint_path(reals, integers, record, scratch[memory : memory + at.VECTORS])
        for i in range(12):
            link[at.TURN + i] = scratch[memory + at.TURN + i]
        for i in range(81):
            link[at.INERTIA + i] = scratch[memory + at.INERTIA + i]
        for i in range(9):
            link[at.PATH + i] = scratch[memory + at.PATH + i]
        resisting = 0.0  # before elimination
        if joint >= 0:
            resisting = abs(_quadratic(link, at.INERTIA))
            if k + 1 < links:
                resisting += abs(_quadratic(link, at.BORNE))
        _relax_inertia(reals, integers, scratch, work, blocks, block, record)
        if k + 1 < links:
            sign = _burden_inertia(reals, integers, work, blocks, block, record)
            if definite and sign < 0.0:
                return int(integers[record + at.FIRST_MODE] + 1)
        if joint >= 0:
            along = link[at.RESISTANCE] + reals[integers[record + at.FORCES] + at.ROTOR]
            resisting += abs(along)
            for i in range(9):
                total = 0.0
                for j in range(9):
                    total += link[at.INERTIA + 9 * i + j] * link[at.PATH + j]
                link[at.PULL + i] = total
            for i in range(9):
                along += link[at.PULL + i] * link[at.PATH + i]
            if not (abs(along) > _SINGULAR * resisting and (along.real > 0.0 or not definite)):
                return int(joint + 1)
            link[at.EFFECTIVE] = along
            if k > 0:
                for i in range(9):
                    for j in range(9):
                        link[at.INERTIA + 9 * i + j] -= link[at.PULL + i] * (link[at.PULL + j] / along)
        if k > 0:
            start = integers[record - at.RECORD + at.MEMORY]
            carry_inertia_back(link, at.INERTIA, work[start : start + at.VECTORS], at.BORNE)
    return 0


@kernel(contract.ACCELERATION, counted=False)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """M⁻¹ f; see `erls.equations.compiled_system`."""
    residual(reals, integers, scratch, t, y, v, scratch[0:0], out)
    for i in range(len(out)):
        out[i] = -out[i]
    status = eliminate(reals, integers, scratch, scratch, reals, at.BLOCK, True)
    if status == 0:
        substitute(reals, integers, scratch, reals, at.BLOCK, out)
    return int(status)

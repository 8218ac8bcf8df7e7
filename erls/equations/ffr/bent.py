"""Inertia of a link with second-order displacements, by a corrected twist of its frame: ν' = ν + M₀⁻¹ (C₂ η̇ + H ν).

Formulas of `erls.equations.ffr.second_order`; C₂ are the first six rows of BENDING, H = [0, -S̃; 0, ½ ηᵀ W η].
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.ffr import layout as at
from erls.equations.ffr.rows import add_rows, cross3, vector
from erls.equations.serial.linear import add_columns
from erls.maths.jit import part


@part
def _add_block(block: Array, x: Array, out: Array) -> None:
    """Add H x."""
    t0, t1, t2 = cross3(block[0], block[1], block[2], x[3], x[4], x[5])
    out[0] -= t0
    out[1] -= t1
    out[2] -= t2
    for i in range(3):
        out[3 + i] += block[3 + 3 * i] * x[3] + block[4 + 3 * i] * x[4] + block[5 + 3 * i] * x[5]


@part
def _add_block_back(block: Array, x: Array, out: Array) -> None:
    """Add Hᵀ x."""
    t0, t1, t2 = cross3(block[0], block[1], block[2], x[0], x[1], x[2])
    out[3] += t0 + block[3] * x[3] + block[6] * x[4] + block[9] * x[5]
    out[4] += t1 + block[4] * x[3] + block[7] * x[4] + block[10] * x[5]
    out[5] += t2 + block[5] * x[3] + block[8] * x[4] + block[11] * x[5]


@part
def _add_per_mass(reals: Array, start: int, x: Array, out: Array) -> None:
    """Add M₀⁻¹ x."""
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += reals[start + 6 * i + j] * x[j]
        out[i] += total


@part
def correct_frame(reals: Array, integers: IntArray, scratch: Array, record: int, rates: Array, moved: Array) -> None:
    """Put the corrected twist and its rate into FRAME, what was there into LINEAR."""
    e, memory = len(rates), integers[record + at.MEMORY]
    link = scratch[memory : memory + at.VECTORS]
    frame, linear = link[at.FRAME : at.FRAME + 12], link[at.LINEAR : at.LINEAR + 12]
    block, block_rate = link[at.BLOCK : at.BLOCK + 12], link[at.BLOCK + 12 : at.BLOCK + 24]
    more, more_rate = link[at.POINT : at.POINT + 6], link[at.OTHER : at.OTHER + 6]
    for i in range(12):
        linear[i] = frame[i]
    for i in range(6):
        more[i] = more_rate[i] = 0.0
    coupling = vector(memory, e, at.BENDING)
    add_rows(scratch, coupling, rates, 1.0, more)
    add_rows(scratch, vector(memory, e, at.BENDING_RATE), rates, 1.0, more_rate)
    if len(moved):
        add_rows(scratch, coupling, moved, 1.0, more_rate)
    _add_block(block, linear, more)
    _add_block(block, linear[6:], more_rate)
    _add_block(block_rate, linear, more_rate)
    _add_per_mass(reals, integers[record + at.PER_MASS], more, frame)
    _add_per_mass(reals, integers[record + at.PER_MASS], more_rate, frame[6:])


@part
def bent_forces(reals: Array, integers: IntArray, scratch: Array, record: int, rates: Array, forces: Array) -> None:
    """Forces of the corrected twist in WRENCH and MOMENTUM become those of FRAME, which is put back, and of η."""
    e, memory = len(rates), integers[record + at.MEMORY]
    link = scratch[memory : memory + at.VECTORS]
    frame, linear = link[at.FRAME : at.FRAME + 15], link[at.LINEAR : at.LINEAR + 12]
    block, block_rate = link[at.BLOCK : at.BLOCK + 12], link[at.BLOCK + 12 : at.BLOCK + 24]
    wrench, momentum = link[at.WRENCH : at.WRENCH + 6], link[at.MOMENTUM : at.MOMENTUM + 6]
    share, share_rate = link[at.SHARE : at.SHARE + 6], link[at.SHARE + 6 : at.SHARE + 12]
    for i in range(12):
        frame[i], link[at.SHARE + i] = linear[i], 0.0
    _add_per_mass(reals, integers[record + at.PER_MASS], momentum, share)
    _add_per_mass(reals, integers[record + at.PER_MASS], wrench, share_rate)
    _add_block_back(block, share, momentum)
    _add_block_back(block_rate, share, wrench)
    _add_block_back(block, share_rate, wrench)
    # on η: d/dt (C₂ᵀ λ) less the gradient of λ·(C₂ η̇ + H ν) at fixed λ, and the weight of ½ ηᵀ S_ab η
    pull = link[at.POINT : at.POINT + 6]
    pull[0], pull[1], pull[2] = cross3(share[0], share[1], share[2], frame[3], frame[4], frame[5])
    for i in range(3):
        pull[i] = share_rate[i] - pull[i] - frame[12 + i]
        pull[3 + i] = share_rate[3 + i]
    add_columns(scratch, vector(memory, e, at.BENDING), e, pull, 6, 1.0, forces)
    start = vector(memory, e, at.TURNED_RATE)
    turned = scratch[start : start + 3 * e]
    turned[:] = 0.0
    add_columns(reals, integers[record + at.SKEW], 3 * e, rates, e, 1.0, turned)
    add_columns(turned, 0, e, share[3:], 3, 1.0, forces)
    for i in range(3):
        add_columns(scratch, vector(memory, e, at.SPUN + 3 * i), e, frame[3:6], 3, -share[3 + i], forces)


@part
def bent_inertia(reals: Array, integers: IntArray, scratch: Array, record: int) -> None:
    """OWN and COUPLED of the corrected twist become those of the frame's; with CHANGE, CHANGED and UNCHANGED."""
    e, memory = integers[record + at.MODES], integers[record + at.MEMORY]
    link = scratch[memory : memory + at.VECTORS]
    own, factor, product = (
        link[at.OWN : at.OWN + 36],
        link[at.FACTOR : at.FACTOR + 36],
        link[at.INERTIA : at.INERTIA + 36],
    )
    x, y, per_mass = link[at.POINT : at.POINT + 6], link[at.OTHER : at.OTHER + 6], integers[record + at.PER_MASS]
    for j in range(6):
        for i in range(6):
            x[i], y[i] = (1.0 if i == j else 0.0), 0.0
        _add_block(link[at.BLOCK : at.BLOCK + 12], x, y)
        _add_per_mass(reals, per_mass, y, x)
        for i in range(6):
            factor[6 * i + j] = x[i]
    for i in range(6):
        for j in range(6):
            total = 0.0
            for m in range(6):
                total += own[6 * i + m] * factor[6 * m + j]
            product[6 * i + j] = total
    coupled, bending = vector(memory, e, at.COUPLED), vector(memory, e, at.BENDING)
    change, changed = vector(memory, e, at.CHANGE), vector(memory, e, at.CHANGED)
    unchanged = vector(memory, e, at.UNCHANGED)
    for i in range(6 * e):
        scratch[unchanged + i] = scratch[changed + i] = scratch[coupled + i]
        scratch[coupled + i] = scratch[change + i] = 0.0
    for i in range(6):
        row = scratch[change + i * e : change + (i + 1) * e]
        add_columns(scratch, bending, e, reals[per_mass + 6 * i : per_mass + 6 * i + 6], 6, 1.0, row)
    for i in range(6):
        row = scratch[changed + i * e : changed + (i + 1) * e]
        add_columns(scratch, change, e, own[6 * i : 6 * i + 6], 6, 1.0, row)
    for i in range(6):
        row = scratch[coupled + i * e : coupled + (i + 1) * e]
        for j in range(6):
            x[j] = factor[6 * j + i]
        add_columns(scratch, changed, e, x, 6, 1.0, row)
    for i in range(6):
        for j in range(6):
            total = 0.0
            for m in range(6):
                total += factor[6 * m + i] * product[6 * m + j]
            own[6 * i + j] = total

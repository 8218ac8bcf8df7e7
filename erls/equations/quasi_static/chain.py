"""The functions of `erls.equations.compiled_system` for a chain whose fast modes follow statically.

The formulas, and when iterations end, are those of `erls.equations.quasi_static.formulation`.
"""

from __future__ import annotations

import math

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import balance, composite
from erls.equations.erls import layout as chain
from erls.equations.quasi_static import layout as at
from erls.equations.quasi_static.dense import add_combined, combine, project
from erls.equations.serial import gains as chain_gains
from erls.maths.dense import backward, cholesky, forward
from erls.maths.jit import kernel, part

MOST = 6  # evaluations with everything
NEAR = 0.05  # of the first correction: what the last one may be
CORRECTIONS = 3  # of an acceleration


@part
def span(integers: IntArray, kind: int, number: int) -> slice:
    """Where a vector of the memory lies: ``number`` of those whose length is SIZE, SLOW or STATIC."""
    n, s, h = integers[at.SIZE], integers[at.SLOW], integers[at.STATIC]
    start, length = integers[at.MEMORY], n
    if kind != at.SIZE:
        start, length = start + at.FULL * n, h
    if kind == at.SLOW:
        start, length = start + at.STATICS * h, s
    return slice(start + number * length, start + (number + 1) * length)


@part
def correction(integers: IntArray, constants: Array, scratch: Array) -> float:
    """CHANGE of η towards balance of FORCE; its size, as the root of twice its strain energy."""
    n, s, h = integers[at.SIZE], integers[at.SLOW], integers[at.STATIC]
    change = scratch[span(integers, at.STATIC, at.CHANGE)]
    project(constants, s * n, n, scratch[span(integers, at.SIZE, at.FORCE)], change)
    size, kappa = 0.0, (s + h) * n
    for j in range(h):
        change[j] /= -constants[kappa + j]
        size += constants[kappa + j] * change[j] ** 2
    return math.sqrt(size)


@part
def set_motion(integers: IntArray, constants: Array, scratch: Array, y: Array, v: Array, a: Array) -> None:
    """PLACE, RATE and ACCELERATION of the slow coordinates; zero acceleration where ``a`` is empty."""
    n = integers[at.SIZE]
    combine(constants, 0, n, y, scratch[span(integers, at.SIZE, at.PLACE)])
    combine(constants, 0, n, v, scratch[span(integers, at.SIZE, at.RATE)])
    combine(constants, 0, n, a, scratch[span(integers, at.SIZE, at.ACCELERATION)])


@part
def weigh(reals: Array, integers: IntArray, scratch: Array, given: IntArray, t: float) -> float:
    """FORCE in the motion that is set, with integers of the chain; then `correction`."""
    place, rate = scratch[span(integers, at.SIZE, at.PLACE)], scratch[span(integers, at.SIZE, at.RATE)]
    acceleration = scratch[span(integers, at.SIZE, at.ACCELERATION)]
    balance.residual(reals, given, scratch, t, place, rate, acceleration, scratch[span(integers, at.SIZE, at.FORCE)])
    return correction(integers, reals[integers[at.CONSTANTS] :], scratch)


@part
def steps_around(integers: IntArray, constants: Array, t: float) -> tuple[float, float]:
    """Steps back and forth from a time, which do not reach over one at which forces jump."""
    n, s, h = integers[at.SIZE], integers[at.SLOW], integers[at.STATIC]
    start = (s + h) * n + h + 2 * s * s + s
    lapse, ends = constants[start], constants[start + 1 : start + 1 + integers[at.ENDS]]
    back = forth = lapse
    for end in ends:
        if end <= t:
            back = min(lapse, (t - end) / 2)
        if end >= t:
            forth = min(lapse, (end - t) / 2)
            break
    if back + forth < lapse / 2:
        return -lapse, lapse
    return -back, forth


@part
def estimate(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array) -> float:
    """FOUND η and its FOUND_RATE from the light chain; the size of the first correction."""
    n, s, h = integers[at.SIZE], integers[at.SLOW], integers[at.STATIC]
    constants, static = reals[integers[at.CONSTANTS] :], s * n
    light = integers[integers[at.LIGHT] : len(integers) - at.TAIL]
    change, guess = scratch[span(integers, at.STATIC, at.CHANGE)], scratch[span(integers, at.STATIC, at.ETA)]
    found, rate = scratch[span(integers, at.STATIC, at.FOUND)], scratch[span(integers, at.STATIC, at.FOUND_RATE)]
    near_y, near_v = scratch[span(integers, at.SLOW, at.NEAR_PLACE)], scratch[span(integers, at.SLOW, at.NEAR_RATE)]
    near_a = scratch[span(integers, at.SLOW, at.NEAR_ACCELERATION)]
    set_motion(integers, constants, scratch, y, v, a)
    first = weigh(reals, integers, scratch, light, t)
    for j in range(h):
        guess[j] = change[j]
    back, forth = steps_around(integers, constants, t)
    squares = (s + h) * n + h + 2 * s * s
    for side in range(2):
        step = back if side == 0 else forth
        for j in range(s):
            push = a[j] if len(a) > 0 else 0.0
            near_y[j] = y[j] + step * v[j] + step * step / 2 * push
            near_v[j] = v[j] + step * push
            near_a[j] = push - step * constants[squares + j] * v[j]
        set_motion(integers, constants, scratch, near_y, near_v, near_a)
        add_combined(constants, static, n, guess, scratch[span(integers, at.SIZE, at.PLACE)])
        weigh(reals, integers, scratch, light, t + step)
        for j in range(h):
            if side == 0:
                found[j] = guess[j] + change[j]
            else:
                rate[j] = (guess[j] + change[j] - found[j]) / (forth - back)
                found[j] -= back * rate[j]
    return first


@kernel(contract.RESIDUAL, counted=False)
def residual(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, a: Array, out: Array
) -> None:
    """Wᵀ (M a - f) where the static modes are in balance; an empty ``a`` stands for zeros."""
    n, static = integers[at.SIZE], integers[at.SLOW] * integers[at.SIZE]
    constants = reals[integers[at.CONSTANTS] :]
    first = 0.0
    if integers[at.STATIC] > 0:
        first = estimate(reals, integers, scratch, t, y, v, a)
    set_motion(integers, constants, scratch, y, v, a)
    place, rate = scratch[span(integers, at.SIZE, at.PLACE)], scratch[span(integers, at.SIZE, at.RATE)]
    add_combined(constants, static, n, scratch[span(integers, at.STATIC, at.FOUND)], place)
    add_combined(constants, static, n, scratch[span(integers, at.STATIC, at.FOUND_RATE)], rate)
    for _ in range(MOST):
        if weigh(reals, integers, scratch, integers, t) <= NEAR * first:
            break
        add_combined(constants, static, n, scratch[span(integers, at.STATIC, at.CHANGE)], place)
    project(constants, 0, n, scratch[span(integers, at.SIZE, at.FORCE)], out)


@part
def masses(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, result: Array) -> None:
    """result (s s,) = Wᵀ M W, row after row."""
    n, s, h = integers[at.SIZE], integers[at.SLOW], integers[at.STATIC]
    constants = reals[integers[at.CONSTANTS] :]
    place = scratch[span(integers, at.SIZE, at.PLACE)]
    start = integers[at.MEMORY] + at.FULL * n + at.STATICS * h + at.SLOWS * s
    full, half = scratch[start : start + n * n], scratch[start + n * n : start + n * n + n * s]
    combine(constants, 0, n, y, place)
    composite.mass_matrix(reals, integers, scratch, t, place, full.reshape(n, n))
    for j in range(s):  # M is symmetric
        project(full, 0, n, constants[j * n : (j + 1) * n], half[j * n : (j + 1) * n])
    for i in range(s):
        project(half, 0, n, constants[i * n : (i + 1) * n], result[i * s : (i + 1) * s])


@kernel(contract.MASS_MATRIX)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """Wᵀ M W."""
    s = integers[at.SLOW]
    result = scratch[len(scratch) - s * s :]
    masses(reals, integers, scratch, t, y, result)
    for i in range(s):
        for j in range(i + 1):
            out[i, j] = out[j, i] = result[i * s + j]


@kernel(contract.STIFFNESS_AND_DAMPING)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """Wᵀ K W and Wᵀ C W: constant for the links, and what joints add."""
    n, s, h = integers[at.SIZE], integers[at.SLOW], integers[at.STATIC]
    constants = reals[integers[at.CONSTANTS] :]
    place, rate = scratch[span(integers, at.SIZE, at.PLACE)], scratch[span(integers, at.SIZE, at.RATE)]
    combine(constants, 0, n, y, place)
    combine(constants, 0, n, v, rate)
    start = integers[at.MEMORY] + at.FULL * n + at.STATICS * h + at.SLOWS * s
    stiffness = scratch[start : start + n * n].reshape(n, n)
    damping = scratch[start + n * n : start + 2 * n * n].reshape(n, n)
    chain_gains.stiffness_and_damping(reals, integers, scratch, t, place, rate, stiffness, damping)
    start = (s + h) * n + h
    for i in range(s):
        for j in range(s):
            k[i, j] = constants[start + i * s + j]
            c[i, j] = constants[start + s * s + i * s + j]
    for link in range(integers[chain.LINKS]):
        joint = integers[chain.HEADER + link * chain.RECORD + chain.JOINT]
        if joint >= 0:
            for i in range(s):
                for j in range(s):
                    moved = constants[i * n + joint] * constants[j * n + joint]
                    k[i, j] += stiffness[joint, joint] * moved
                    c[i, j] += damping[joint, joint] * moved


@kernel(contract.ACCELERATION)
def acceleration(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> int:
    """Where the residual is zero; see `erls.equations.compiled_system`."""
    s, h = integers[at.SLOW], integers[at.STATIC]
    matrix, left = scratch[len(scratch) - s * s :], scratch[span(integers, at.SLOW, at.LEFT)]
    masses(reals, integers, scratch, t, y, matrix)
    start = integers[at.MEMORY] + at.FULL * integers[at.SIZE] + at.STATICS * h + at.SLOWS * s
    factor = scratch[start : start + s * s].reshape(s, s)  # where the chain's mass matrix was
    factor[:] = matrix.reshape(s, s)
    status = cholesky(factor, 0.0)
    if status != 0:
        return status
    out[:] = 0.0
    for _ in range(CORRECTIONS):
        residual(reals, integers, scratch, t, y, v, out, left)
        forward(factor, left)
        backward(factor, left)
        for j in range(s):
            out[j] -= left[j]
    return 0

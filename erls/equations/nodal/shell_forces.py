"""Four-node shells with nested helicoidal interpolation on SE(3).

The slides on local frames in finite elements: frames follow H_1(r) = H_A exp(r d_1), d_1 = log(H_A⁻¹ H_B), along one
side and H_2(r) likewise along the opposite one from H_D to H_C, then H(r, s) = H_1 exp(s d), d(r) = log(H_1⁻¹ H_2),
between them. The slopes of the surface in its own frames are

    f_s = d,   f_r = Ad(exp(s d))⁻¹ d_1 + s T(s d) d′,   d′ = T⁻¹(d) d_2 − T⁻¹(−d) d_1,

and strains what they are more than as built, along the local axes: of the surface, its curvature, shear across, and the
skew part γ_12 − γ_21, which a penalty holds. All depend on relative frames alone. Forces are those of virtual work at
2 × 2 points; a side that bends into an arc strains nothing else.
"""

from __future__ import annotations

from typing import TypeAlias

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.beam_forces import HALF
from erls.equations.nodal.contract import (
    ENERGIES,
    FORCES,
    Model,
    read_layout,
    read_model,
    read_work,
)
from erls.equations.nodal.shell import POINTS
from erls.maths.coefficients import inverse_coefficient, stumpff, tangent_coefficients
from erls.maths.jit import kernel, part
from erls.maths.motions import (
    bracket,
    change,
    cobracket,
    pair_minus,
    pair_plus,
    pair_scaled,
    series,
    series_transposed,
    transformed,
    transposed,
)
from erls.maths.rotations import exponential, logarithm, value
from erls.maths.vectors import (
    Rotation,
    Twist,
    Vector,
    add,
    back_product,
    dot,
    minus,
    nine,
    plus,
    product,
    times,
    turned,
    unit,
    vector,
)

Frame: TypeAlias = tuple[Vector, Rotation]
Frames: TypeAlias = tuple[Frame, Frame, Frame, Frame]
Nine: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]
Four: TypeAlias = tuple[Twist, Twist, Twist, Twist]


@part
def corner(model: Model, poses: Array, e: int, k: int) -> Frame:
    """Frame of the surface at a corner, in the world."""
    node, frames = model.shell_nodes[e, k], model.shell_frames
    turn = nine(poses, node, 3)
    place = plus(vector(poses, node, 0), times(turn, vector(frames, e, 12 * k)))
    return place, product(turn, nine(frames, e, 12 * k + 3))


@part
def corners(model: Model, poses: Array, e: int) -> Frames:
    """All four."""
    first, second = corner(model, poses, e, 0), corner(model, poses, e, 1)
    return first, second, corner(model, poses, e, 2), corner(model, poses, e, 3)


@part
def _log(a: Frame, b: Frame) -> Twist:
    """log(A⁻¹ B)."""
    psi = logarithm(back_product(a[1], b[1]))
    return value(-0.5, inverse_coefficient(dot(psi, psi))[0], psi, turned(a[1], minus(b[0], a[0]))), psi


@part
def _exp(d: Twist) -> Frame:
    """exp d."""
    c = stumpff(dot(d[1], d[1]))
    f, g = tangent_coefficients(c)
    return value(-f[0], g[0], d[1], d[0]), exponential(d[1], c[0], c[1])


@part
def _after(a: Frame, b: Frame) -> Frame:
    """A B."""
    return plus(a[0], times(a[1], b[0])), product(a[1], b[1])


@part
def _tangent(d: Twist, x: Twist) -> Twist:
    """T(d) x."""
    f, g = tangent_coefficients(stumpff(dot(d[1], d[1])))
    return series(f, g, d[0], d[1], x[0], x[1])


@part
def _tangent_transposed(d: Twist, p: Twist) -> Twist:
    """T(d)ᵀ p."""
    f, g = tangent_coefficients(stumpff(dot(d[1], d[1])))
    return series_transposed(f, g, d[0], d[1], p[0], p[1])


@part
def _inverse(d: Twist, x: Twist) -> Twist:
    """T⁻¹(d) x."""
    return series(HALF, inverse_coefficient(dot(d[1], d[1])), d[0], d[1], x[0], x[1])


@part
def _inverse_transposed(d: Twist, p: Twist) -> Twist:
    """T⁻¹(d)ᵀ p."""
    return series_transposed(HALF, inverse_coefficient(dot(d[1], d[1])), d[0], d[1], p[0], p[1])


@part
def _power(p: Twist, x: Twist) -> float:
    return dot(p[0], x[0]) + dot(p[1], x[1])


@part
def _gain(d: Twist, first: Twist, second: Twist) -> Twist:
    """d′: T⁻¹(−d) is T⁻¹(d) − ad d."""
    return pair_plus(_inverse(d, pair_minus(second, first)), bracket(d[0], d[1], first[0], first[1]))


@part
def _slope(s: float, d: Twist, first: Twist, gain: Twist) -> Twist:
    """f_r."""
    scaled_d = pair_scaled(s, d)
    p, r = _exp(scaled_d)
    return pair_plus(transformed(p, r, first[0], first[1]), pair_scaled(s, _tangent(scaled_d, gain)))


@part
def _strain(model: Model, e: int, point: int, along: Twist, across: Twist) -> Nine:
    """ε_11, ε_22, 2 ε_12, κ_11, κ_22, 2 κ_12, γ_1, γ_2, and γ_12 - γ_21."""
    built, rises = model.shell_built, model.shell_rises
    a = pair_minus(along, (vector(built, e, 12 * point), vector(built, e, 12 * point + 3)))
    b = pair_minus(across, (vector(built, e, 12 * point + 6), vector(built, e, 12 * point + 9)))
    one = pair_plus(pair_scaled(rises[e, 4 * point], a), pair_scaled(rises[e, 4 * point + 1], b))
    two = pair_plus(pair_scaled(rises[e, 4 * point + 2], a), pair_scaled(rises[e, 4 * point + 3], b))
    g, h, k, m = one[0], two[0], one[1], two[1]
    return g[0], h[1], g[1] + h[0], k[1], -m[0], m[1] - k[0], g[2], h[2], g[1] - h[0]


@part
def _stress(model: Model, e: int, strain: Nine) -> Nine:
    c = model.shell_stiffness
    return (
        _row(c, e, 0, strain), _row(c, e, 1, strain), _row(c, e, 2, strain), _row(c, e, 3, strain),
        _row(c, e, 4, strain), _row(c, e, 5, strain), _row(c, e, 6, strain), _row(c, e, 7, strain),
        c[e, 8, 8] * strain[8],
    )  # fmt: skip


@part
def _row(c: Array, e: int, i: int, x: Nine) -> float:
    first: float = c[e, i, 0] * x[0] + c[e, i, 1] * x[1] + c[e, i, 2] * x[2] + c[e, i, 3] * x[3]
    second: float = c[e, i, 4] * x[4] + c[e, i, 5] * x[5] + c[e, i, 6] * x[6] + c[e, i, 7] * x[7]
    return first + second


@part
def _on_slopes(model: Model, e: int, point: int, s: Nine) -> tuple[Twist, Twist]:
    """Wrenches on f_r and f_s of the stress at a point, times its area."""
    rises, area = model.shell_rises, model.shell_areas[e, point]
    one = (s[0], s[2] + s[8], s[6]), (-s[5], s[3], 0.0 * s[0])
    two = (s[2] - s[8], s[1], s[7]), (-s[4], s[5], 0.0 * s[0])
    along = pair_plus(pair_scaled(rises[e, 4 * point], one), pair_scaled(rises[e, 4 * point + 2], two))
    across = pair_plus(pair_scaled(rises[e, 4 * point + 1], one), pair_scaled(rises[e, 4 * point + 3], two))
    return pair_scaled(area, along), pair_scaled(area, across)


@part
def strains_at(model: Model, e: int, frames: Frames, point: int) -> Nine:
    """Strains at a point of the quadrature."""
    a, b, c, d = frames
    r, s = POINTS[point // 2], POINTS[point % 2]
    first, second = _log(a, b), _log(d, c)
    lower, upper = _after(a, _exp(pair_scaled(r, first))), _after(d, _exp(pair_scaled(r, second)))
    between = _log(lower, upper)
    return _strain(model, e, point, _slope(s, between, first, _gain(between, first, second)), between)


@part
def _by_direction(d: Twist, x: Twist, p: Twist, inverse: int) -> Twist:
    """Wrench on δd of p · (DT(d)[δd] x), or with T⁻¹."""
    psi = dot(d[1], d[1])
    f, g = tangent_coefficients(stumpff(psi))
    if inverse:
        f, g = HALF, inverse_coefficient(psi)
    found = pair_scaled(0.0, p)
    for k in range(6):
        way = unit(k), unit(k - 3)
        strength = _power(p, change(f, g, d[0], d[1], way[0], way[1], x[0], x[1]))
        found = pair_plus(found, pair_scaled(strength, way))
    return found


@part
def wrenches(model: Model, e: int, frames: Frames) -> Four:
    """Wrenches of the stresses on the frames of the corners, in these."""
    a, b, c, d = frames
    first, second = _log(a, b), _log(d, c)
    none = pair_scaled(0.0, first)
    on_a = on_d = on_first = on_second = none
    for point in range(4):
        r, s = POINTS[point // 2], POINTS[point % 2]
        part_first, part_second = pair_scaled(r, first), pair_scaled(r, second)
        step_first, step_second = _exp(part_first), _exp(part_second)
        between = _log(_after(a, step_first), _after(d, step_second))
        gain = _gain(between, first, second)
        part_between = pair_scaled(s, between)
        p, turn = _exp(part_between)
        carried = transformed(p, turn, first[0], first[1])
        along = pair_plus(carried, pair_scaled(s, _tangent(part_between, gain)))
        pull, push = _on_slopes(model, e, point, _stress(model, e, _strain(model, e, point, along, between)))
        # f_r, by d′ (through ``lever``), by d and by d_1
        lever = pair_scaled(s, _tangent_transposed(part_between, pull))
        back = _inverse_transposed(between, lever)
        on_second = pair_plus(on_second, back)
        direct = pair_minus(transposed(p, turn, pull[0], pull[1]), back)
        direct = pair_plus(direct, cobracket(between[0], between[1], lever[0], lever[1]))
        on_first = pair_plus(on_first, direct)
        swing = cobracket(carried[0], carried[1], pull[0], pull[1])
        push = pair_plus(push, pair_scaled(s, _tangent_transposed(part_between, swing)))
        push = pair_plus(push, pair_scaled(s * s, _by_direction(part_between, gain, pull, 0)))
        push = pair_plus(push, _by_direction(between, pair_minus(second, first), lever, 1))
        push = pair_minus(push, cobracket(first[0], first[1], lever[0], lever[1]))
        # d, by the frames of both sides
        upper = _inverse_transposed(between, push)
        lower = pair_minus(cobracket(between[0], between[1], push[0], push[1]), upper)
        on_d = pair_plus(on_d, transposed(step_second[0], step_second[1], upper[0], upper[1]))
        on_second = pair_plus(on_second, pair_scaled(r, _tangent_transposed(part_second, upper)))
        on_a = pair_plus(on_a, transposed(step_first[0], step_first[1], lower[0], lower[1]))
        on_first = pair_plus(on_first, pair_scaled(r, _tangent_transposed(part_first, lower)))
    on_b, on_c = _inverse_transposed(first, on_first), _inverse_transposed(second, on_second)
    on_a = pair_plus(on_a, pair_minus(cobracket(first[0], first[1], on_first[0], on_first[1]), on_b))
    on_d = pair_plus(on_d, pair_minus(cobracket(second[0], second[1], on_second[0], on_second[1]), on_c))
    return on_a, on_b, on_c, on_d


@part
def inward(model: Model, e: int, k: int, force: Twist) -> Twist:
    """Wrench on the frame of a corner as one on its node."""
    frames = model.shell_frames
    return transposed(vector(frames, e, 12 * k), nine(frames, e, 12 * k + 3), force[0], force[1])


@kernel(FORCES, counted=False)
def shell_forces(reals: Array, integers: IntArray, scratch: Array, last: Array) -> None:
    """Add internal forces to the force in `Work`."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    for e in range(len(model.shell_nodes)):
        forces = wrenches(model, e, corners(model, work.poses, e))
        for k in range(4):
            force = inward(model, e, k, forces[k])
            at = 6 * model.shell_nodes[e, k]
            add(work.force, at, force[0])
            add(work.force, at + 3, force[1])


@kernel(ENERGIES, counted=False)
def shell_energies(reals: Array, integers: IntArray, scratch: Array, out: Array) -> None:
    """Add elastic energy."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    model, work = read_model(reals, integers, known.model), read_work(scratch, integers, known.work)
    for e in range(len(model.shell_nodes)):
        frames = corners(model, work.poses, e)
        for point in range(4):
            x = strains_at(model, e, frames, point)
            y = _stress(model, e, x)
            total = x[0] * y[0] + x[1] * y[1] + x[2] * y[2] + x[3] * y[3] + x[4] * y[4]
            total += x[5] * y[5] + x[6] * y[6] + x[7] * y[7] + x[8] * y[8]
            out[1] += 0.5 * model.shell_areas[e, point] * total

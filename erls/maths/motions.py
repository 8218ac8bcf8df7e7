"""Rigid motions SE(3): adjoint, brackets, power series in ad ξ with derivatives, applied to twists and wrenches.

A twist ξ = [u; ψ] has the bracket ad ξ = [[ψ̃, ũ], [0, ψ̃]]: ψ̃ with a perturbation ũ above its diagonal. Every power
series in ad ξ is therefore [[A, B], [0, A]] with the same series A of rotations and its derivative B along u:

    T(ξ) = [[T(ψ), DT(ψ)·u], [0, T(ψ)]],    exp ξ = (exp ψ̃, T(ψ)ᵀ u)

(V. Sonneville, A. Cardona, O. Brüls, Comput. Methods Appl. Mech. Eng. 268 (2014) 451, app. A). With H = exp ξ moving,
H⁻¹ Ḣ = ν̃ and ν = T(ξ) ξ̇. Coefficients f, g of A are those of `erls.maths.rotations`. A motion is a position p and a
rotation R. One matrix for each of many motions: `erls.maths.motion_maps`.
"""

from __future__ import annotations

from erls.maths.coefficients import Three
from erls.maths.jit import part
from erls.maths.rotations import first, second, value
from erls.maths.vectors import Rotation, Twist, Vector, cross, minus, plus, scaled, times, turned


@part
def transformed(p: Vector, r: Rotation, v: Vector, w: Vector) -> Twist:
    """Ad⁻¹ [v; w] of the motion (p, R)."""
    return turned(r, minus(v, cross(p, w))), turned(r, w)


@part
def transposed(p: Vector, r: Rotation, n: Vector, m: Vector) -> Twist:
    """Ad⁻ᵀ [n; m]."""
    force = times(r, n)
    return force, plus(cross(p, force), times(r, m))


@part
def bracket(v: Vector, w: Vector, a: Vector, b: Vector) -> Twist:
    """ad([v; w]) [a; b]."""
    return plus(cross(w, a), cross(v, b)), cross(w, b)


@part
def cobracket(v: Vector, w: Vector, n: Vector, m: Vector) -> Twist:
    """ad([v; w])ᵀ [n; m]."""
    return cross(n, w), plus(cross(n, v), cross(m, w))


@part
def series(f: Three, g: Three, u: Vector, psi: Vector, a: Vector, b: Vector) -> Twist:
    """[[A, B], [0, A]] [a; b]."""
    return plus(value(f[0], g[0], psi, a), first(f[0], f[1], g[0], g[1], psi, u, b)), value(f[0], g[0], psi, b)


@part
def series_transposed(f: Three, g: Three, u: Vector, psi: Vector, n: Vector, m: Vector) -> Twist:
    """[[A, B], [0, A]]ᵀ [n; m]."""
    below = first(-f[0], -f[1], g[0], g[1], psi, u, n)
    return value(-f[0], g[0], psi, n), plus(below, value(-f[0], g[0], psi, m))


@part
def change(f: Three, g: Three, u: Vector, psi: Vector, du: Vector, dpsi: Vector, a: Vector, b: Vector) -> Twist:
    """Derivative of [[A, B], [0, A]] along [du; dψ], times [a; b]."""
    above = plus(second(f[1], f[2], g, psi, u, dpsi, b), first(f[0], f[1], g[0], g[1], psi, du, b))
    below = first(f[0], f[1], g[0], g[1], psi, dpsi, b)
    return plus(first(f[0], f[1], g[0], g[1], psi, dpsi, a), above), below


@part
def change_transposed(
    f: Three, g: Three, u: Vector, psi: Vector, du: Vector, dpsi: Vector, n: Vector, m: Vector
) -> Twist:
    """Derivative of [[A, B], [0, A]]ᵀ along [du; dψ], times [n; m]."""
    below = plus(second(-f[1], -f[2], g, psi, u, dpsi, n), first(-f[0], -f[1], g[0], g[1], psi, du, n))
    below = plus(below, first(-f[0], -f[1], g[0], g[1], psi, dpsi, m))
    return first(-f[0], -f[1], g[0], g[1], psi, dpsi, n), below


@part
def pair_plus(a: Twist, b: Twist) -> Twist:
    """a + b."""
    return plus(a[0], b[0]), plus(a[1], b[1])


@part
def pair_minus(a: Twist, b: Twist) -> Twist:
    """a - b."""
    return minus(a[0], b[0]), minus(a[1], b[1])


@part
def pair_scaled(s: float, a: Twist) -> Twist:
    """s a."""
    return scaled(s, a[0]), scaled(s, a[1])

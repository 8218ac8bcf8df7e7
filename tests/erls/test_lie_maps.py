"""Exponentials, logarithms and tangent operators of all groups: identities, expansions, angles up to and past π."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import factorial
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from hypothesis import given, settings
from hypothesis import strategies as st

from erls.maths import coefficients, motion_maps, rotation_maps, rotations
from erls.maths import vectors as vectors3
from erls.maths.groups import R3_SO3, SE3, SO3, Group, product, vectors
from erls.maths.jit import ENABLED, plain
from erls.maths.se3 import twist_cross, twist_transform
from erls.maths.so3 import Array, skew

GROUPS = {g.name: g for g in (SO3, SE3, R3_SO3)} | {"a product": product(vectors(2), SE3, SO3)}
TURNS = {
    "SO(3)": [slice(0, 3)],
    "SE(3)": [slice(3, 6)],
    "R^3×SO(3)": [slice(3, 6)],
    "a product": [slice(5, 8), slice(8, 11)],
}
H = 1e-30  # of complex steps
EPS = float(np.finfo(float).eps)
ANGLES = [0.0, 1e-300, 1e-160, 1e-9, 1e-5, 1e-3, 0.3, 1.0, 1.9, 2.1, 3.0, np.pi - 1e-3, np.pi - 1e-9, np.pi]
PAST = [np.pi + 1e-9, np.pi + 1e-3, 4.0, 4.4, 4.5, 6.0]
DERIVATIVES = {
    "rotation T": (rotation_maps.tangent, rotation_maps.tangent_derivative, 3),
    "rotation T⁻¹": (rotation_maps.tangent_inverse, rotation_maps.tangent_inverse_derivative, 3),
    "motion T": (motion_maps.tangent, motion_maps.tangent_derivative, 6),
    "motion T⁻¹": (motion_maps.tangent_inverse, motion_maps.tangent_inverse_derivative, 6),
}


def _close(a: Any, b: Any, tolerance: float) -> None:
    """Elements of any group."""
    if isinstance(a, tuple):
        for x, y in zip(a, b, strict=True):
            _close(x, y, tolerance)
    else:
        np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def _increment(group: str, angle: float, seed: int) -> Array:
    """An increment of size about one whose rotations all turn by ``angle``."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal(GROUPS[group].dimension)
    for at in TURNS[group]:
        x[at] *= angle / la.norm(x[at])
    return x


def _series(k: int, x: float) -> Fraction:
    """c_k(x) exactly, to 40 terms."""
    return sum((Fraction(-x) ** j / factorial(2 * j + k) for j in range(40)), Fraction(0))


COEFFICIENTS: dict[str, Callable[[Any], tuple[Any, Any, Any]]] = {
    "arrays": lambda x: (
        rotation_maps.stumpff(np.array(x)),
        rotation_maps.inverse_coefficient(np.array(x)),
        plain(coefficients.tangent_coefficients)(rotation_maps.stumpff(np.array(x))),
    ),
    "numbers": lambda x: (
        plain(coefficients.stumpff)(x),
        plain(coefficients.inverse_coefficient)(x),
        plain(coefficients.tangent_coefficients)(plain(coefficients.stumpff)(x)),
    ),
}


@pytest.mark.parametrize("kind", COEFFICIENTS)
@pytest.mark.parametrize("x", [0.0, 1e-12, 0.1, 0.2499, 0.2501, 1.0, 3.999, 4.001, np.pi**2, 19.0, 25.0])
def test_stumpff_functions_against_exact_series(x: float, kind: str) -> None:
    """A few roundings of 1/k! up to the switch at 4; past it, k of them upward from the cosine over x."""
    found, _, (f, g) = COEFFICIENTS[kind](x)
    for k in range(1, 8):
        limit = 8 if x < 4 else 8 * (1 + k)
        assert abs(found[k - 1] - float(_series(k, x))) <= limit * EPS / factorial(k), k
    for k, sign, (value, slope, bend) in ((2, -1, f), (3, 1, g)):
        first = (k * _series(k + 2, x) - _series(k + 1, x)) / 2
        second = (
            k * ((k + 2) * _series(k + 4, x) - _series(k + 3, x)) - ((k + 1) * _series(k + 3, x) - _series(k + 2, x))
        ) / 4
        assert value == sign * found[k - 1]
        assert slope == pytest.approx(sign * float(first), rel=50 * EPS)
        assert bend == pytest.approx(sign * float(second), rel=200 * EPS)


@pytest.mark.parametrize("kind", COEFFICIENTS)
@pytest.mark.parametrize("x", [1e-3, 0.1, 1.0, np.pi**2, 19.7, 19.8, 30.0, 39.0])
def test_coefficient_of_inverse_tangents_against_exact_series(x: float, kind: str) -> None:
    """b = (1 − c₁/(2 c₂))/x in rational arithmetic, and its differential equation for the derivatives."""
    b = (1 - _series(1, x) / (2 * _series(2, x))) / Fraction(x)
    first = (Fraction(1, 4) - 3 * b + Fraction(x) * b * b) / (2 * Fraction(x))
    second = (b * b - 5 * first + 2 * Fraction(x) * b * first) / (2 * Fraction(x))
    near = 39.478 / abs(39.478 - x)  # conditioning next to the pole
    for found, exact in zip(COEFFICIENTS[kind](x)[1], (b, first, second), strict=True):
        assert float(found) == pytest.approx(float(exact), rel=100 * EPS * near)
    zero = [float(v) for v in COEFFICIENTS[kind](0.0)[1]]
    assert zero == pytest.approx([1 / 12, 1 / 720, 1 / 15120], rel=4 * EPS)


@pytest.mark.parametrize("angle", ANGLES + PAST)
@pytest.mark.parametrize("group", GROUPS)
def test_logarithm_inverts_the_exponential(group: str, angle: float) -> None:
    """Up to π the increment returns; past it, the same element by the shorter way round."""
    g = GROUPS[group]
    for seed in range(5):
        x = _increment(group, angle, seed)
        element = g.exp(x)
        back = g.log(element)
        _close(g.exp(back), element, 1e-14)
        if angle < np.pi:
            np.testing.assert_allclose(back, x, rtol=0, atol=2e-14 + 1e-15 / max(1e-1, np.pi - angle))
        for at in TURNS[group]:
            assert la.norm(back[at]) <= np.pi * (1 + EPS)
            assert la.norm(back[at]) == pytest.approx(min(angle, 2 * np.pi - angle), rel=1e-14, abs=1e-300)


@pytest.mark.parametrize("axis", [[1.0, 0, 0], [0, -1.0, 0], [0.6, 0, -0.8], [1, -2, 2], [-1, -1, -1]])
def test_logarithm_at_half_a_turn(axis: list[float]) -> None:
    """At exactly π the component of largest magnitude is positive; both neighbours go their own way round."""
    n = np.array(axis) / la.norm(axis)
    half = 2 * np.outer(n, n) - np.eye(3)
    found = rotation_maps.log(half)
    assert la.norm(found) == pytest.approx(np.pi, rel=EPS)
    assert found[np.abs(found).argmax()] > 0
    np.testing.assert_allclose(rotation_maps.exp(found), half, atol=4 * EPS)
    before, after = (rotation_maps.log(rotation_maps.exp((np.pi + d) * n)) for d in (-1e-7, 1e-7))
    np.testing.assert_allclose(before, (np.pi - 1e-7) * n, atol=1e-14)
    np.testing.assert_allclose(after, -(np.pi - 1e-7) * n, atol=1e-14)


@pytest.mark.parametrize("group", GROUPS)
@given(seed=st.integers(0, 2**32 - 1), angle=st.floats(0, 6.0))
@settings(max_examples=40, deadline=None)
def test_tangent_operators(group: str, seed: int, angle: float) -> None:
    """T T⁻¹ = 1; T(−ξ) = Ad(exp ξ) T(ξ); T is (1 − exp(−ad))/ad; exp(ad ξ) = Ad(exp ξ)."""
    g = GROUPS[group]
    x = _increment(group, angle, seed)
    t, ad = g.tangent(x), g.bracket(x)
    size = la.norm(g.tangent_inverse(x))
    np.testing.assert_allclose(t @ g.tangent_inverse(x), np.eye(g.dimension), atol=1e-14 * size)
    transported = g.adjoint(g.exp(x))
    np.testing.assert_allclose(g.tangent(-x), transported @ t, atol=1e-12)
    np.testing.assert_allclose(ad @ t, np.eye(g.dimension) - la.inv(transported), atol=1e-12)
    np.testing.assert_allclose(la.expm(ad), transported, atol=1e-11)


@pytest.mark.parametrize("group", GROUPS)
@given(seed=st.integers(0, 2**32 - 1), angle=st.floats(0, 6.0))
@settings(max_examples=25, deadline=None)
def test_tangent_is_the_derivative_of_the_exponential(group: str, seed: int, angle: float) -> None:
    """log(exp(x − e)⁻¹ exp(x + e)) = 2 T e + O(e³): central differences, 1e-10 of the size."""
    g, e = GROUPS[group], 1e-5
    x = _increment(group, angle, seed)
    d = np.random.default_rng(seed + 1).standard_normal(g.dimension)
    found = g.log(g.compose(g.inverse(g.exp(x - e * d)), g.exp(x + e * d))) / (2 * e)
    np.testing.assert_allclose(g.tangent(x) @ d, found, atol=1e-8)


@pytest.mark.parametrize("name", DERIVATIVES)
@given(seed=st.integers(0, 2**32 - 1), angle=st.floats(0, 5.5))
@settings(max_examples=40, deadline=None)
def test_derivatives_of_tangents(name: str, seed: int, angle: float) -> None:
    """Fourth-order central differences: 1e-9 of the largest entry around."""
    operator, derivative, size = DERIVATIVES[name]
    rng = np.random.default_rng(seed)
    x, d = rng.standard_normal((2, size))
    x[-3:] *= angle / la.norm(x[-3:])
    d /= la.norm(d)
    e = 1e-3
    near, far = (operator(x + k * e * d) - operator(x - k * e * d) for k in (1, 2))
    expected = (8 * near - far) / (12 * e)
    size = max(1.0, np.abs(expected).max())
    np.testing.assert_allclose(derivative(x, d), expected, atol=1e-8 * size)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-5, 0.3, 1.9, 2.1, 3.0, np.pi - 1e-6, 4.4, 4.5, 6.0])
def test_complex_steps(angle: float) -> None:
    """Through the exponential and the logarithm of rotations and motions: T and T⁻¹, to rounding."""
    x, d = _increment("SE(3)", angle, 1), np.random.default_rng(2).standard_normal(6)
    moved = motion_maps.exp(x + 1j * H * d)
    h, change = moved.real, moved.imag / H
    rate = motion_maps.inverse(h) @ change
    twist = motion_maps.tangent(x) @ d
    np.testing.assert_allclose(rate[:3, :3], skew(twist[3:]), atol=1e-14)
    np.testing.assert_allclose(rate[:3, 3], twist[:3], atol=1e-14)
    back = motion_maps.log_near(moved, x)
    np.testing.assert_allclose(back.real, x, atol=1e-13)
    inverse = motion_maps.tangent_inverse(x)
    np.testing.assert_allclose(back.imag / H, d, atol=1e-13 * (1 + la.norm(inverse) ** 2))
    for operator, derivative in (
        (motion_maps.tangent, motion_maps.tangent_derivative),
        (motion_maps.tangent_inverse, motion_maps.tangent_inverse_derivative),
    ):
        expected = derivative(x, d)
        found = operator(x + 1j * H * d).imag / H
        np.testing.assert_allclose(found, expected, atol=1e-13 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("scalar", [1.0, 1.0 + 0j])
@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-5, 0.3, 1.9, 2.1, np.pi, 4.4])
def test_one_number_at_a_time_equals_many(angle: float, scalar: complex) -> None:
    """The functions with their branches, compiled for real and complex numbers, against the arrays."""
    psi = _increment("SO(3)", angle, 5)
    near = 3 * psi

    def turned(psi: Any, near: Any) -> Any:
        square = dot(psi, psi)
        c = stumpff(square)
        r = exponential(psi, c[0], c[1])
        return r, logarithm_near(r, near), inverse_coefficient(square)[0]

    dot, exponential, logarithm_near = vectors3.dot, rotations.exponential, rotations.logarithm_near
    stumpff, inverse_coefficient = coefficients.stumpff, coefficients.inverse_coefficient
    function = plain(turned)
    if ENABLED:
        import numba

        function = numba.njit(turned)
    r, log, b = function(tuple((scalar * psi).tolist()), tuple((scalar * near).tolist()))
    np.testing.assert_allclose(np.reshape(r, (3, 3)), rotation_maps.exp(psi), atol=1e-15)
    np.testing.assert_allclose(log, rotation_maps.log_near(rotation_maps.exp(psi), near), atol=4e-15)
    assert b == pytest.approx(float(rotation_maps.inverse_coefficient(psi @ psi)[0]), rel=1e-14)


def test_singularity_of_the_tangent_at_a_full_turn() -> None:
    """T loses the plane normal to the axis at 2π, and its inverse grows as π/(2π − θ)·2 there."""
    axis = np.array([0.0, 0.6, 0.8])
    assert la.svdvals(rotation_maps.tangent(2 * np.pi * axis))[1:] == pytest.approx([0, 0], abs=1e-15)
    for gap in (1e-3, 1e-6):
        assert la.norm(rotation_maps.tangent_inverse((2 * np.pi - gap) * axis), 2) == pytest.approx(
            2 * np.pi / gap, rel=2 * gap
        )
    with np.errstate(over="ignore"):
        assert la.norm(rotation_maps.tangent_inverse(2 * np.pi * axis), 2) > 1e15


def test_many_at_once_equal_one_by_one() -> None:
    """Leading axes are carried through every map, bit for bit; single ones equal those of so3 and se3."""
    rng = np.random.default_rng(3)
    x, d = rng.standard_normal((2, 4, 2, 6))
    x[0] *= 1e-4
    maps: list[tuple[Callable[..., Array], tuple[Array, ...]]] = [
        (m, (x,)) for m in (motion_maps.exp, motion_maps.tangent, motion_maps.tangent_inverse, motion_maps.bracket)
    ]
    maps += [(m, (x, d)) for m in (motion_maps.tangent_derivative, motion_maps.tangent_inverse_derivative)]
    h = motion_maps.exp(x)
    maps += [
        (m, (h,)) for m in (motion_maps.log, motion_maps.inverse, motion_maps.adjoint, motion_maps.adjoint_inverse)
    ]
    for function, arguments in maps:
        every = function(*arguments)
        for k in np.ndindex(4, 2):
            np.testing.assert_allclose(every[k], function(*(a[k] for a in arguments)), atol=1e-15)
    np.testing.assert_allclose(motion_maps.adjoint_inverse(h[1, 1]), twist_transform(h[1, 1]), atol=1e-15)
    np.testing.assert_allclose(motion_maps.bracket(x[1, 1]), twist_cross(x[1, 1]))
    np.testing.assert_allclose(rotation_maps.skews(x[1, 1, :3]), skew(x[1, 1, :3]))
    np.testing.assert_allclose(
        motion_maps.cobracket(d[1, 1]) @ x[1, 1], motion_maps.bracket(x[1, 1]).T @ d[1, 1], atol=1e-14
    )


def test_exponential_of_motions_is_that_of_matrices() -> None:
    """Against the matrix exponential; R³×SO(3) differs from SE(3) in the translation alone."""
    for angle in (0.0, 1e-6, 2.0, 5.0):
        x = _increment("SE(3)", angle, 7)
        hat = np.zeros((4, 4))
        hat[:3, :3], hat[:3, 3] = skew(x[3:]), x[:3]
        np.testing.assert_allclose(SE3.exp(x), la.expm(hat), atol=1e-14)
        other: Group = R3_SO3
        np.testing.assert_allclose(other.exp(x)[:3, :3], SE3.exp(x)[:3, :3], atol=1e-15)
        np.testing.assert_allclose(other.exp(x)[:3, 3], x[:3])

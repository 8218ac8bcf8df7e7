"""Functions of a squared angle x = θ² that rotations are made of, accurate from θ = 0 on.

Stumpff functions (K. Stumpff, Himmelsmechanik I, 1959, ch. V):

    c_k(x) = Σ_j (−x)^j / (2j + k)!,    c₀ = cos θ,  c₁ = sin θ / θ,  c₂ = (1 − cos θ)/θ²,  c₃ = (θ − sin θ)/θ³

with c_k = 1/k! − x c_{k+2} and dc_k/dx = (k c_{k+2} − c_{k+1})/2. The inverse of a tangent operator needs

    b(x) = (1 − (θ/2) cot(θ/2))/x = 2/(4π² − x) + Σ_k 2 (ζ(2k + 2) − 1) x^k / (2π)^(2k+2),

with its pole at θ = 2π set apart; it solves 2x b' = 1/4 − 3b + x b².
"""

from __future__ import annotations

from math import factorial, pi

import numpy as np

from erls.maths.so3 import Array

_SERIES_BELOW = 4.0  # no term of a Stumpff series exceeds the one before it there, for k ≥ 1
_TERMS = 12
_INVERSE_FACTORIALS = np.array([1 / factorial(k) for k in range(2 * _TERMS + 12)])
_SUFFICIENT = [  # squared angles up to which term 0, 1, ... may be the last one, for each highest function
    np.array([(1e-17 * factorial(2 * j + 1 + k) / factorial(max(k - 1, 0))) ** (1 / (j + 1)) for j in range(_TERMS)])
    for k in range(8)
]
_POLE = 4 * np.pi**2
_RATIO_BELOW = 0.5  # of x to the pole

# 2 ζ(s) - 2 of Riemann's function at s = 2, 4, 6, ..., which falls by four from term to term
_ZETA = 2 * np.array(
    [pi**2 / 6 - 1, pi**4 / 90 - 1, *((np.arange(2000.0, 1.0, -1.0) ** -s).sum() for s in range(6, 40, 2))]
)


def stumpff(x: Array, highest: int) -> Array:
    """(highest + 1, ...) c₀ to c_highest of the squared angles (...)."""
    found = np.empty((highest + 1, *np.shape(x)))
    inside = np.minimum(x, _SERIES_BELOW)
    last = np.zeros((2, *np.shape(x)))  # the two highest, from the smallest term on
    for j in range(int(np.searchsorted(_SUFFICIENT[highest], np.max(inside, initial=0.0))), -1, -1):
        first = 2 * j + highest - 1
        last = _INVERSE_FACTORIALS[first : first + 2].reshape(2, *(1,) * np.ndim(x)) - inside * last
    found[highest - 1 :] = last
    for k in range(highest - 2, -1, -1):
        found[k] = _INVERSE_FACTORIALS[k] - inside * found[k + 2]
    large = np.asarray(x > _SERIES_BELOW)
    if large.any():
        far = np.asarray(x)[large]
        angle = np.sqrt(far)
        found[0, large], found[1, large] = np.cos(angle), np.sin(angle) / angle
        for k in range(highest - 1):
            found[k + 2, large] = (_INVERSE_FACTORIALS[k] - found[k, large]) / far
    return found


def stumpff_derivative(c: Array, k: int) -> Array:
    """dc_k/dx from the first k + 3 functions ``c``."""
    first: Array = (k * c[k + 2] - c[k + 1]) / 2
    return first


def stumpff_second_derivative(c: Array, k: int) -> Array:
    """d²c_k/dx² from the first k + 5 functions ``c``."""
    second: Array = (k * stumpff_derivative(c, k + 2) - stumpff_derivative(c, k + 1)) / 2
    return second


def inverse_coefficient(x: Array) -> tuple[Array, Array, Array]:
    """b(x) and its first and second derivative, each (...); infinite at θ = 2π."""
    y = np.minimum(np.asarray(x) / _POLE, _RATIO_BELOW)
    value, slope, bend = np.zeros((3, *np.shape(x)))
    ratio = float(np.max(y, initial=0.0)) / 4  # of one term to the next
    last = len(_ZETA) - 1 if ratio > 0.1 else int(-37 / np.log(max(ratio, 1e-17))) + 2
    for k in range(last, -1, -1):
        bend = slope * 2 + y * bend
        slope = value + y * slope
        value = _ZETA[k] + y * value
    gap = 1 - y
    found = np.empty((3, *np.shape(x)))
    found[0] = (value + 2 / gap) / _POLE
    found[1] = (slope + 2 / gap**2) / _POLE**2
    found[2] = (bend + 4 / gap**3) / _POLE**3
    large = np.asarray(x > _RATIO_BELOW * _POLE)
    if large.any():
        far = np.asarray(x)[large]
        half = np.sqrt(far) / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            b = (1 - half * np.cos(half) / np.sin(half)) / far
            first = (0.25 - 3 * b + far * b * b) / (2 * far)
            second = (b * b - 5 * first + 2 * far * b * first) / (2 * far)
        found[:, large] = b, first, second
    return found[0], found[1], found[2]

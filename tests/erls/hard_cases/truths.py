"""Motions that are known: closed forms, and an integration of their own of equations that share nothing with ours."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy.integrate
import scipy.optimize
import scipy.special

from erls.maths.so3 import Array

_TIGHT = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}


def swinging(released: float, rate: float) -> Callable[[Array], Array]:
    """Angle from hanging of a pendulum released at rest: θ = 2 asin(k sn(K + ω₀ t)), k = sin(θ₀ / 2).

    Parameters
    ----------
    released : float
        θ₀ [rad].
    rate : float
        ω₀ of small swings, √(m g s / J) [rad/s].
    """
    k = np.sin(released / 2)
    quarter = scipy.special.ellipk(k**2)

    def angle(t: Array) -> Array:
        sn = scipy.special.ellipj(quarter + rate * np.asarray(t), k**2)[0]
        return 2 * np.arcsin(k * sn)

    return angle


def integrated(
    rate_of: Callable[[float, Array], Array], start: Sequence[float], end: float, stiff: bool = False
) -> Callable[[Array], Array]:
    """(n, k) of an ordinary differential equation, by SciPy's DOP853 to 1e-13, or Radau to 1e-12 where it is stiff."""
    settings = {"method": "Radau", "rtol": 1e-12, "atol": 1e-13} if stiff else _TIGHT
    found = scipy.integrate.solve_ivp(rate_of, (0.0, end), start, dense_output=True, **settings)
    return found.sol  # type: ignore[no-any-return]


def bars_in_a_plane(
    lengths: Sequence[float],
    masses: Sequence[float],
    start: Sequence[float],
    rates: Sequence[float],
    end: float,
    gravity: float = 9.81,
) -> Callable[[Array], Array]:
    """(n, k) angles from the horizontal of thin bars that hang on each other: M_ij cos(φ_i - φ_j) φ̈_j = ...

    A bar of mass m and length l has m l² / 3 about its end; all that it carries adds m l², and where i < j the
    coupling is l_i (m_j l_j / 2 + l_j Σ_{k > j} m_k).
    """
    l, m = np.array(lengths), np.array(masses)
    n = len(l)
    carried = np.array([m[k + 1 :].sum() for k in range(n)])
    first = l * (m / 2 + carried)  # moment of what turns with each bar
    c = np.array([[l[min(i, j)] * first[max(i, j)] for j in range(n)] for i in range(n)])
    c[np.diag_indices(n)] = l**2 * (m / 3 + carried)

    def rate_of(t: float, x: Array) -> Array:
        angles, speeds = x[:n], x[n:]
        between = angles[:, None] - angles
        forces = -gravity * first * np.cos(angles) - (c * np.sin(between)) @ speeds**2
        return np.concatenate([speeds, np.linalg.solve(c * np.cos(between), forces)])

    found = integrated(rate_of, [*start, *rates], end)
    return lambda t: found(t)[:n]


def ends_of_bars(lengths: Sequence[float], angles: Array) -> Array:
    """(k, n, 3) outer ends in the plane of x and z, of angles (n, k) from the horizontal."""
    steps = np.array(lengths)[:, None] * np.stack([np.cos(angles), 0 * angles, np.sin(angles)])
    return np.cumsum(steps, axis=1).transpose(2, 1, 0)


def falling_cantilever(
    length: float, bending: float, mass: float, load: float, modes: int = 24
) -> Callable[[Array], Array]:
    """Deflection (k,) of the tip of a clamped beam that a uniform load meets at once at t = 0: Σ over its modes.

    Parameters
    ----------
    length : float
        [m]
    bending : float
        E I [N m²].
    mass, load : float
        Per length [kg/m, N/m].
    """
    guesses = np.pi * (np.arange(modes) + 0.5)
    guesses[0] = 1.8751
    roots = [scipy.optimize.newton(lambda b: np.cos(b) + 1 / np.cosh(b), g, tol=1e-14) for g in guesses]

    def tip(t: Array) -> Array:
        total = np.zeros_like(np.asarray(t, dtype=float))
        for b in roots:
            s = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b)) if b < 30 else 1.0
            rate = (b / length) ** 2 * np.sqrt(bending / mass)
            # shapes of norm one over the length: ∫φ = 2 s / b, |φ(L)| = 2
            sign = 1 if len(roots) and round(b / np.pi - 0.5) % 2 == 0 else -1
            total += sign * 2 * (2 * s / b) * load / (mass * rate**2) * (1 - np.cos(rate * t))
        return total

    return tip


def top(
    inertia: Sequence[float],
    spin: Sequence[float],
    end: float,
    moment: Sequence[float] = (0.0, 0.0, 0.0),
    gravity: Sequence[float] = (0.0, 0.0, 0.0),
) -> Callable[[Array], Array]:
    """(k, 3, 3) rotations of a pinned body whose axes are at first those of the world: Euler's equations, quaternions.

    Parameters
    ----------
    inertia : three numbers
        About the fixed point, in its own axes [kg m²].
    spin : three numbers
        At first [rad/s].
    end : float
    moment : three numbers
        m s, of mass and place of the centre of mass in its own axes [kg m].
    gravity : three numbers
        [m/s²]
    """
    j = np.array(inertia)

    def rate_of(t: float, x: Array) -> Array:
        q, w = x[:4] / np.linalg.norm(x[:4]), x[4:]
        weight = np.cross(moment, rotation(q).T @ gravity)
        turn = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.concatenate([turn, (weight - np.cross(w, j * w)) / j])

    found = integrated(rate_of, [1.0, 0.0, 0.0, 0.0, *spin], end)
    return lambda t: np.array([rotation(q / np.linalg.norm(q)) for q in found(t)[:4].T])


def rotation(q: Array) -> Array:
    """(3, 3) of a unit quaternion."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )

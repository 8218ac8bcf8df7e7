"""What the steps of a run lose of vibrations that are too fast for the error equation to follow.

At some instants the modes of K φ = ω² M φ have amplitudes A = |φᵀM a|/ω², by the accelerations of the run. Over the run
a mode goes wrong by the part d = min(2, Σ μ(ωh)) of its amplitude (`erls.accuracy.phase`), a damped one for as long as
it lasts; errors of modes are independent, so that their squares add up. Points move by what their places make of φ.

Between knots that do not resolve it the interpolant swings farther than the vibration itself does: by h times its rate.
How far is seen in the middle between two knots, from the polynomial through the places at four.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la

from erls.accuracy.phase import lobatto_wrong, wrong_over_run
from erls.equations.quick import quick
from erls.equations.system import metre_scales
from erls.integrate.base import Solution, hermite
from erls.maths.so3 import Array
from fe_import.model import IntArray

_INSTANTS = 4
_NEAR = 12  # knots around an instant, of which the largest acceleration counts
_MOST = 8  # modes
_RIGID = 1e-9  # of the largest ω²
_LARGEST_PART = 2.0
_LASTING = 3.0  # time constants


class FastModes(NamedTuple):
    """Vibrations at an instant that count most.

    Attributes
    ----------
    knot : int
        Of the run.
    shapes : (k, n) array
        Displacements of the coordinates by which each is wrong at the end of the run.
    """

    knot: int
    shapes: Array


def wrong_table(solution: Solution, integrator: str) -> tuple[Array, Array] | None:
    """x and μ(x) of what integrated, `erls.integrate.lobatto`; None for others."""
    return lobatto_wrong() if (solution.choice.partition(":")[0] or integrator) == "lobatto" else None


def fast_modes(system: Any, solution: Solution, table: tuple[Array, Array], tau: float) -> list[FastModes]:
    """At some instants of a run.

    Parameters
    ----------
    system : SecondOrderSystem
    solution : Solution
        With all steps.
    table : (k,), (k,) arrays
        Of `wrong_table`.
    tau : float
        Of the filter before which the error equation follows vibrations [s].
    """
    s = solution
    if len(s.t) < 2 or not system.size:
        return []
    metres, span = metre_scales(system), float(s.t[-1] - s.t[0])
    ends = np.unique(s.t[:: s.nodes_per_step])
    steps = np.diff(ends)
    found = []
    for knot in np.unique(np.linspace(0, len(s.t) - 1, 2 * _INSTANTS + 1)[1::2].astype(int)).tolist():
        squares, modes, mass, damping = _modes(system, float(s.t[knot]), s.y[knot], s.v[knot])
        fast = squares > _RIGID * squares.max(initial=0.0)
        squares, modes = squares[fast], modes[:, fast]
        if not len(squares):
            continue
        omega = np.sqrt(squares)
        near = np.unique(np.linspace(*_around(knot, len(s.t)), _NEAR).astype(int))
        amplitude = np.abs(s.a[near] @ mass @ modes).max(axis=0) / squares
        decay = np.einsum("ij,ik,kj->j", modes, damping, modes) / 2
        lasting = np.minimum(1.0, _LASTING / np.maximum(decay * span, _LASTING))
        part = np.minimum(wrong_over_run(table, omega, steps) * lasting, _LARGEST_PART)
        followed = 1 / (1 + (omega * tau) ** 4)
        beyond = np.maximum(swing_between_knots(s, near, mass @ modes) - amplitude, 0.0)
        wrong = amplitude * part * (1 - followed) + beyond
        weight = wrong * np.abs(metres[:, None] * modes).max(axis=0)
        most = np.argsort(-weight)[:_MOST]
        rest = float(np.sqrt(np.maximum((weight**2).sum() - (weight[most] ** 2).sum(), 0.0)))
        scale = np.sqrt(1 + (rest / max(float(np.linalg.norm(weight[most])), 1e-300)) ** 2)
        found.append(FastModes(knot, scale * (wrong[most] * modes[:, most]).T))
    return found


def swing_between_knots(s: Solution, near: IntArray, weights: Array) -> Array:
    """(m,) how far modes swing between knots by what is interpolated, from what their places at four knots tell.

    Parameters
    ----------
    s : Solution
    near : (k,) int array
        Knots to look behind.
    weights : (n, m) array
        M φ.
    """
    around = np.unique(near.clip(1, max(len(s.t) - 3, 1)))[:, None] + np.arange(-1, 3)
    around = around[around[:, -1] < len(s.t)]
    around = around[(np.diff(s.t[around]) > 0).all(axis=1)]  # within a leg
    if not len(around):
        return np.zeros(weights.shape[1])
    t = s.t[around]
    middle = (t[:, 1] + t[:, 2]) / 2
    far = middle[:, None] - t
    weigh = [np.prod([far[:, j] / (t[:, i] - t[:, j]) for j in range(4) if j != i], axis=0) for i in range(4)]
    smooth = np.einsum("ik,kin->kn", np.stack(weigh), s.y[around])  # J. L. Lagrange's polynomial
    apart = hermite(s.t, s.y, s.v, s.a, middle)[0] - smooth
    return np.asarray(np.abs(apart @ weights).max(axis=0))


def _around(knot: int, count: int) -> tuple[int, int]:
    """First and last knot of the part of a run that an instant stands for."""
    half = max(count // (2 * _INSTANTS), 1)
    return max(knot - half, 0), min(knot + half, count - 1)


def _modes(system: Any, t: float, y: Array, v: Array) -> tuple[Array, Array, Array, Array]:
    """(m,) rising ω², (n, m) modes of unit modal mass, (n, n) mass and damping."""
    fast = quick(system)
    mass, (stiffness, damping) = fast.mass_matrix(t, y), fast.stiffness_and_damping(t, y, v)
    return *_of(stiffness, mass), mass, damping


def _of(stiffness: Array, mass: Array) -> tuple[Array, Array]:
    squares, modes = la.eigh((stiffness + stiffness.T) / 2, (mass + mass.T) / 2, check_finite=False)
    return squares, modes

"""What a step of an integrator does to a vibration: the factor between its amplitude and phase and the exact ones.

Of y″ = -ω² y a method makes (y, v/ω) → R(x) (y, v/ω), x = ωh. The eigenvalue λ(x) of R nearest to exp(ix) is wrong by
μ = |λ exp(-ix) - 1| in each step: phase, and what the method damps.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from erls.integrate.lobatto import NODES, tableau
from erls.maths.so3 import Array

_GRID = np.concatenate([np.geomspace(1e-3, 1.0, 60), np.linspace(1.05, 40.0, 780)])
_SMALL = 0.3  # rad per step below which rounding hides the error: its order carries it on
_ORDER = 7
_UNKNOWN = 2.0  # beyond the grid


def lobatto_steps(x: Array) -> Array:
    """(k, 2, 2) R(x) of `erls.integrate.lobatto`."""
    nodes, (rates, places) = np.array(NODES), tableau()
    x = x[:, None, None]
    ones = np.ones((len(x), len(nodes), 1))
    start = np.concatenate([ones, nodes[:, None] * x], axis=2)
    stages = np.linalg.solve(np.eye(len(nodes)) + x**2 * places, -start)
    change = np.stack([(x**2 * places[-1] @ stages)[:, 0], (x * rates[-1] @ stages)[:, 0]], axis=1)
    free = np.concatenate([np.concatenate([ones[:, :1], x], axis=2), np.concatenate([0 * x, ones[:, :1]], axis=2)], 1)
    return np.asarray(free + change)


@cache
def lobatto_wrong() -> tuple[Array, Array]:
    """x and μ(x) of `erls.integrate.lobatto`."""
    return _carried_on(np.abs(np.linalg.eigvals(lobatto_steps(_GRID)) * np.exp(-1j * _GRID)[:, None] - 1).min(axis=1))


def _carried_on(wrong: Array) -> tuple[Array, Array]:
    """The grid and μ, by its order where rounding hides it."""
    first = int(np.searchsorted(_GRID, _SMALL))
    wrong[:first] = wrong[first] * (_GRID[:first] / _GRID[first]) ** _ORDER
    return _GRID, wrong


def wrong_over_run(table: tuple[Array, Array], frequencies: Array, steps: Array) -> Array:
    """(k,) Σ μ(ωh) over steps (s,) [s], of vibrations at ω (k,) [rad/s].

    Steps of nearly equal length count together, so that long runs cost no more.
    """
    grid, wrong = table
    steps = steps[steps > 0]
    if not len(steps):
        return np.zeros(len(frequencies))
    edges = np.geomspace(steps.min(), steps.max() * (1 + 1e-12), 65)
    counts, _ = np.histogram(steps, edges)
    middle = np.sqrt(edges[1:] * edges[:-1])
    x = np.outer(frequencies, middle)
    found = np.interp(x, grid, wrong, right=_UNKNOWN)
    found = np.where(x < grid[0], wrong[0] * (np.maximum(x, 1e-300) / grid[0]) ** _ORDER, found)
    return np.asarray(found @ counts)

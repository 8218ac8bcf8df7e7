"""What steps of generalized-α (`erls.integrate.stepping.generalized_alpha`) are told, leave to each other and keep.

Records in flat memory (`erls.maths.records`), whose first integers are their places: `Settings`, `Course`, `Memory`.
"""

from __future__ import annotations

from typing import NamedTuple

from erls.maths.records import Indices, Stack, Vector, reader

DONE, FAILED, INACCURATE, TIMID, REFUSED = range(5)
"""Ends of a stretch: all steps made; Newton's method failed; too large a local error; a larger step would do; the
system refuses the knot."""

AUTO, UPDATE, FROZEN = range(3)  # iteration matrices, as in `erls.scene.integrators.MATRICES`
ZERO, LAST, EXTRAPOLATED = range(3)  # what accelerations and multipliers start from
SINGULAR, SLOW, NOT_FINITE = 1, 2, 3  # reasons of a failure

RATE, SPENT, BEFORE, SIZE, GOAL, ERROR = range(6)  # of `Course.rates`
FACTORED, USUAL, REASON, STEPS, EVALUATIONS, ITERATIONS, FACTORIZATIONS = range(7)  # of `Course.counts`


class Settings(NamedTuple):
    """Formulas and limits of steps of one size.

    Attributes
    ----------
    h, beta, gamma : float
        Step [s] and coefficients of Newmark's formulas.
    share, pull, keep : float
        Weights of v̇₁, v̇₀ and a₀ in a₁.
    to_v, to_a : float
        γ' and β'.
    last : float
        Last time for forces [s].
    tolerance, rounding, reach, balance : float
        Iterations end with an error below ``tolerance`` [m], or the rounding (a share) of the configuration, or a
        residual below ``balance`` times its terms with conditions open by no more than that share of ``reach`` [m];
        negative: residuals are not looked at.
    slowest, fastest : float
        Bounds on a rate of convergence carried over from earlier steps.
    patience, renewal, tolerated : float
        Cost of a fresh matrix in iterations, which calls for one between steps, and within a step; iterations beyond
        the fewest that do not.
    error_limit, error_factor, growth : float
        Largest local error [m], 0 for no limit; what turns |v̇₁ − v̇₀| into it; ratio of steps worth a change, or 0.
    iterations, over, fewest : int
        Most iterations; over how many of them a rate is taken (two where they rise and fall in turns); how many always
        count as few.
    matrix, guess : int
        What is said above.
    """

    h: float
    beta: float
    gamma: float
    share: float
    pull: float
    keep: float
    to_v: float
    to_a: float
    last: float
    tolerance: float
    rounding: float
    reach: float
    balance: float
    slowest: float
    fastest: float
    patience: float
    renewal: float
    tolerated: float
    error_limit: float
    error_factor: float
    growth: float
    iterations: int
    over: int
    fewest: int
    matrix: int
    guess: int


class Course(NamedTuple):
    """What steps leave to each other and to whoever called for them.

    Attributes
    ----------
    rates : (6,) array
        Rate of convergence; iterations spent beyond the few that a fresh matrix needs; the last two corrections and
        their goal [m]; local error of the last step [m].
    counts : (7,) array
        Whether there is an iteration matrix; fewest iterations with it; reason of a failure; steps made; evaluations,
        iterations, factorizations.
    """

    rates: Vector
    counts: Indices


class Memory(NamedTuple):
    """State and working memory of a run, of n velocities and m conditions.

    Attributes
    ----------
    v, alg, a : (n,), (n,), (n + m,) arrays
        Velocity, algorithmic acceleration, acceleration and multipliers of the last knot.
    increment, v1, a1 : arrays
        Those of the step that is tried.
    change, guess : (n,) arrays
        Of the acceleration over the last step, and as expected over the next.
    metres, per_metre : (n,) arrays
    right, correction : (n + m + 2,) or (n,), (n + m,) arrays
        Residual, and correction [m].
    factors : array
        Those of the system, or dense ones.
    matrices, pivots : (3, n, n), (n,) arrays
        Of dense factors; empty where the system has its own.
    """

    v: Vector
    alg: Vector
    a: Vector
    increment: Vector
    v1: Vector
    a1: Vector
    change: Vector
    guess: Vector
    metres: Vector
    per_metre: Vector
    right: Vector
    correction: Vector
    factors: Vector
    matrices: Stack
    pivots: Indices


read_settings, read_course, read_memory = reader(Settings), reader(Course), reader(Memory)

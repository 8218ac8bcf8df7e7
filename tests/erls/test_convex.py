"""Sequential convex programming on problems with closed-form answers, without any run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from erls.maths.so3 import Array
from erls.optimization.convex import Found, sequential_convex
from erls.optimization.evaluation import Evaluation, Rules
from erls.optimization.measures import Itself, Measure
from erls.optimization.objective import Quadratic
from erls.optimization.records import Settings


class Sum:
    """Σ x is minimized."""

    def quadratic(self, x: Array) -> Quadratic:
        return Quadratic(float(x.sum()), np.ones(len(x)), np.zeros((len(x),) * 2))

    def weighed(self, x: Array) -> float:
        return float(x.sum())

    def timed(self, components: Sequence[Array], measures: Sequence[Measure]) -> tuple[float, list[Array]]:
        return 0.0, [np.zeros_like(c) for c in components]


class Reciprocals:
    """Σ 1/x ≤ 1: best where all are as many as there are; ``power`` says in what it is taken as linear."""

    def __init__(self, count: int, power: float) -> None:
        one = (True,)
        self.rules = Rules(
            np.full(count, 0.5), np.full(count, 20.0), np.full(count, power), ("sum",), (1.0,), (Itself(),),
            (False,), one, (np.zeros(1, dtype=np.int64),), Sum(),  # type: ignore[arg-type]
        )  # fmt: skip

    def evaluate(self, x: Array) -> Evaluation:
        return self.rules.evaluation(x, [np.array([[(1 / x).sum()]])])

    def differentiate(self, found: Evaluation) -> Evaluation:
        return self.rules.differentiated(found, [-(1 / found.x**2)[None, None]])


def solved(count: int, power: float, start: Sequence[float]) -> Found:
    evaluator = Reciprocals(count, power)
    return sequential_convex(evaluator, np.array(start), Settings(design_tolerance=1e-5, optimality_tolerance=1e-5), 99)


@pytest.mark.parametrize(("power", "most"), [(-1, 3), (-4, 17)])
def test_steps_tell_where_approximations_curve_too_much(power: float, most: int) -> None:
    """In x^-1 the problem is its own approximation; in x^-4 that curves 2.5 times as much, and takes 24 alone."""
    found = solved(3, power, [2.0, 3.0, 6.0])
    assert found.status == "converged"
    assert found.best.x == pytest.approx(np.full(3, 3.0), rel=1e-4)
    assert found.evaluations <= most

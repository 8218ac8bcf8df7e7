"""SciPy's SLSQP and trust-constr on the true problem, in powers of the variables."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from erls.maths.so3 import Array
from erls.optimization.approximation import Approximation, Powers
from erls.optimization.convex import Found, relative_change
from erls.optimization.evaluation import Evaluation, Evaluator, aggregate
from erls.optimization.records import Settings


class _Enough(Exception):
    """All evaluations are used up."""


class _Scaled:
    """Objective and constraint values by ω about the start; every design is evaluated once."""

    def __init__(
        self, evaluator: Evaluator, x: Array, tolerance: float, most: int, told: Callable[[Evaluation, float], None]
    ) -> None:
        self._tolerance = tolerance
        self._evaluator, self.rules, self._most, self._told = evaluator, evaluator.rules, most, told
        self.powers, self.last = Powers(evaluator.rules, x), x
        self.known: dict[bytes, Evaluation] = {}
        self.best: Evaluation | None = None
        self.used = [k for k, limit in enumerate(self.rules.limits) if limit is not None]

    def at(self, omega: Array, slopes: bool) -> Evaluation:
        x = np.clip(self.powers.back(omega), self.rules.lower, self.rules.upper)
        key = x.tobytes()
        if key not in self.known:
            if len(self.known) >= self._most:
                raise _Enough
            self.known[key] = self._evaluator.evaluate(x)
            self._told(self.known[key], relative_change(self.last, x, self.rules.upper - self.rules.lower))
            self.last = x
        found = self.known[key]
        if slopes and found.quadratic is None:
            found = self.known[key] = self._evaluator.differentiate(found)
        if self.best is None or self._rank(found) <= self._rank(self.best):
            self.best = found
        return found

    def _rank(self, found: Evaluation) -> tuple[float, float]:
        """Of several designs the one with the least is best."""
        return max(found.violation - self._tolerance, 0.0), found.objective

    def objective(self, omega: Array) -> tuple[float, Array]:
        """Value and slope."""
        found = self.at(omega, True)
        value, slope = Approximation(self.rules, found).objective(np.ones(len(omega)))
        local = Powers(self.rules, found.x).rate(np.ones(len(omega)))
        return value, slope / local * self.powers.rate(omega)

    def shares(self, omega: Array) -> Array:
        """(n,) of the limits."""
        return self._rows(omega, False)[0]

    def slopes(self, omega: Array) -> Array:
        """(n, v)"""
        return self._rows(omega, True)[1]

    def _rows(self, omega: Array, slopes: bool) -> tuple[Array, Array]:
        found = self.at(omega, slopes)
        if not slopes:
            shares = self.rules.shares(found.components)
            return np.concatenate([self._one(shares[k], k) for k in self.used]), np.zeros(0)
        near, ones = Approximation(self.rules, found), np.ones(len(omega))
        local = Powers(self.rules, found.x).rate(ones)
        rows = [near.rows(ones, k, np.arange(len(found.components[k]))) for k in self.used]
        jacobian = np.concatenate([j for _, j in rows]) / local * self.powers.rate(omega)
        return np.concatenate([s for s, _ in rows]), jacobian

    def _one(self, shares: Array, k: int) -> Array:
        return aggregate(shares, self.rules.groups[k])[0] if self.rules.aggregated[k] else shares


def scipy_method(name: str) -> Callable[..., Found]:
    """``slsqp`` or ``trust-constr`` as an optimizer like `erls.optimization.convex.sequential_convex`."""

    def minimized(
        evaluator: Evaluator,
        x: Array,
        settings: Settings,
        most: int,
        told: Callable[[Evaluation, float], None] = lambda found, change: None,
    ) -> Found:
        scaled = _Scaled(evaluator, x, settings.violation_tolerance, most, told)
        rules, ones = evaluator.rules, np.ones(len(x))
        scale = max(abs(scaled.at(ones, False).objective), 1e-300)
        ends = np.sort([scaled.powers.to(rules.lower), scaled.powers.to(rules.upper)], axis=0)

        def cost(omega: Array) -> tuple[float, Array]:
            value, slope = scaled.objective(omega)
            return value / scale, slope / scale

        status = "converged"
        try:
            if name == "slsqp":
                rows = {"type": "ineq", "fun": lambda w: 1 - scaled.shares(w), "jac": lambda w: -scaled.slopes(w)}
                result = minimize(
                    cost,
                    ones,
                    jac=True,
                    method="SLSQP",
                    bounds=list(zip(*ends, strict=True)),
                    constraints=[rows] if scaled.used else [],
                    options={"maxiter": most, "ftol": 1e-3 * settings.design_tolerance},
                )
                status = "converged" if result.status == 0 else "stalled"
            else:
                limits = [NonlinearConstraint(scaled.shares, -np.inf, 1.0, jac=scaled.slopes)] if scaled.used else []
                result = minimize(
                    cost,
                    ones,
                    jac=True,
                    method="trust-constr",
                    bounds=Bounds(*ends),
                    constraints=limits,
                    options={"maxiter": most, "xtol": settings.design_tolerance, "gtol": 1e-5},
                )
                status = "converged" if result.status in (1, 2) else "stalled"
        except _Enough:
            status = "budget"
        assert scaled.best is not None
        best = scaled.best
        if best.quadratic is None:
            best = evaluator.differentiate(best)
        if status == "converged" and best.violation > settings.violation_tolerance:
            status = "infeasible" if Approximation(rules, best).solved(rules.lower, rules.upper).slack else "stalled"
        return Found(best, best.x, status, 0.0, len(scaled.known))

    return minimized

"""A convex problem about a design: components of constraints linear in powers of the variables, measures kept.

With ω = (x / x₀)^p, flexibilities of sections are linear in ω, and masses, which load them, in μ = (x / x₀)^q: near a
design the problem

    min f(x(ω)) + ½ δx B δx + ρ f₀ s   so that   measure(c₀ + J_s δω + J_m δμ) ≤ limit (1 + s),  s ≥ 0

hardly differs from the true one (p = -4, q = 2 for diameters). The slack s keeps it solvable; where it does not vanish,
no design within reach holds the constraints. B takes back what the last step has shown these approximations to curve
too much along it, so that steps along flat directions do not come short of their end again and again. With H d, the
change of the slope of the Lagrange function that a step d was to bring, and y what came beyond it,

    B = τ H d dᵀH / (dᵀH d),   τ = dᵀy / (dᵀH d), at least -0.8:

at -1 there would be no curvature left along d; elsewhere H + B stays convex as H is. Where a step goes back on the one
before and τ > 1/2, designs go to and fro, each swing being τ of the last: there B is kept as well, up to τ = 2, so that
they end at once. Smaller swings die out by themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize, nnls

from erls.maths.so3 import Array
from erls.optimization.evaluation import Evaluation, Rules, aggregate
from fe_import.model import IntArray

_SLACK = 50.0  # ρ
_NEAR, _MOST_ROWS, _ROUNDS = 0.7, 120, 6  # share of the limit from which on rows count; of one constraint at a time
_MET = 1e-8
_ACTIVE = 2e-3  # of the limit: rows that may hold a design
_BOUND = 1e-6  # of the distance of the bounds
_LEAST = 1e-9  # of the objective's slope: multipliers that are rounding
_SOFTEST, _SWINGING, _HARDEST = -0.8, 0.5, 2.0  # τ
_SEEN = 1e-8  # of slopes and steps: differences that tell nothing


class Powers:
    """ω of designs about one; of variables with power 1 their share of the bounds' distance, so that zero is
    allowed.
    """

    def __init__(self, rules: Rules, x: Array) -> None:
        self._x, self._plain = x, rules.powers == 1
        self._p = np.where(self._plain, 1.0, rules.powers)
        self._span = rules.upper - rules.lower
        self._q = np.where(self._p == -4, 2.0, 1.0)

    def to(self, x: Array) -> Array:
        """(v,) ω, 1 at the design."""
        with np.errstate(divide="ignore", invalid="ignore"):
            powered = (x / self._x) ** self._p
        return np.where(self._plain, 1 + (x - self._x) / self._span, powered)

    def back(self, omega: Array) -> Array:
        """(v,) x."""
        powered = self._x * np.maximum(omega, 1e-12) ** (1 / self._p)
        return np.where(self._plain, self._x + self._span * (omega - 1), powered)

    def rate(self, omega: Array) -> Array:
        """(v,) dx/dω."""
        powered = self._x / self._p * np.maximum(omega, 1e-12) ** (1 / self._p - 1)
        return np.where(self._plain, self._span, powered)

    def masses(self, omega: Array) -> tuple[Array, Array]:
        """(v,) changes of masses in shares of the variables, and their rates by ω: both as of the variables near 1."""
        omega, ratio = np.maximum(omega, 1e-12), self._q / self._p
        change, rate = (omega**ratio - 1) / self._q * self._x, omega ** (ratio - 1) / self._p * self._x
        return np.where(self._plain, self._span * (omega - 1), change), np.where(self._plain, self._span, rate)


class Held(NamedTuple):
    """What holds a design: constraint and row, or variable and -1 at its lower, -2 at its upper bound; value over
    limit; multiplier, per share of the limit or unit of the variable.
    """

    number: int
    row: int
    share: float
    multiplier: float


@dataclass(frozen=True)
class Step:
    """A solution of the convex problem.

    Attributes
    ----------
    x : (v,) array
    slack : float
        That remains.
    pressure : float
        Sum of the multipliers of constraints: by how much the objective falls per share by which limits are relaxed.
    """

    x: Array
    slack: float
    pressure: float


class Approximation:
    """About a differentiated design.

    Parameters
    ----------
    rules : Rules
    base : Evaluation
        Differentiated.
    bent : (v, v) array, optional
        B.
    gone : (v,) array, optional
        The step that led there.
    """

    def __init__(
        self, rules: Rules, base: Evaluation, bent: Array | None = None, gone: Array | None = None
    ) -> None:
        self.rules, self.base, self.powers, self._gone = rules, base, Powers(rules, base.x), gone
        self.bent = np.zeros((len(base.x),) * 2) if bent is None else bent
        self._ones = np.ones(len(base.x))
        rate = self.powers.rate(self._ones)
        self._flexible = [jacobian * rate for jacobian in base.flexible]
        self._loaded = [whole - own for whole, own in zip(base.jacobians, base.flexible, strict=True)]

    def _linear(self, omega: Array, k: int, rows: IntArray | slice) -> tuple[Array, Array]:
        """(n, q) components of constraint k and their slopes (n, q, v) by ω."""
        mass, rate = self.powers.masses(omega)
        flexible, loaded = self._flexible[k][rows], self._loaded[k][rows]
        return self.base.components[k][rows] + flexible @ (omega - 1) + loaded @ mass, flexible + loaded * rate

    def components(self, omega: Array) -> list[Array]:
        """(n, q) of every constraint."""
        return [self._linear(omega, k, slice(None))[0] for k in range(len(self._flexible))]

    def objective(self, omega: Array) -> tuple[float, Array]:
        """Value and slope by ω."""
        quadratic = self.base.quadratic
        assert quadratic is not None
        change = self.powers.back(omega) - self.base.x
        timed, slopes = self.rules.objective.timed(self.components(omega), self.rules.measures)
        value = quadratic.value(change) + float(change @ self.bent @ change) / 2
        slope = (quadratic.slope(change) + self.bent @ change) * self.powers.rate(omega)
        for k, own in enumerate(slopes):
            if own.any():
                slope = slope + np.einsum("nq,nqv->v", own, self._linear(omega, k, slice(None))[1])
        return value + timed, slope

    def rows(self, omega: Array, k: int, rows: IntArray) -> tuple[Array, Array]:
        """Shares (n,) of the limit of some rows of constraint k, with slopes (n, v); of each place where aggregated."""
        limit = self.rules.limits[k]
        assert limit is not None
        components, jacobian = self._linear(omega, k, rows)
        measure = self.rules.measures[k]
        shares = measure.value(components) / limit
        slopes = np.einsum("nq,nqv->nv", measure.slope(components), jacobian) / limit
        if not self.rules.aggregated[k]:
            return shares, slopes
        values, weights = aggregate(shares, self.rules.groups[k])
        return values, weights @ slopes

    def solved(self, lower: Array, upper: Array) -> Step:
        """Within bounds (v,) of the design."""
        ends = np.sort([self.powers.to(lower), self.powers.to(upper)], axis=0)
        chosen = [self._chosen(self._ones, k) for k in range(len(self.rules.limits))]
        omega, slack = self._ones, 0.0
        for _ in range(_ROUNDS):
            omega, slack = self._minimum(ends, chosen, self._ones)
            further = [np.union1d(rows, self._chosen(omega, k)) for k, rows in enumerate(chosen)]
            passed = [self._passed(omega, k, slack) for k in range(len(chosen))]
            if all(len(np.setdiff1d(p, rows)) == 0 for p, rows in zip(passed, chosen, strict=True)):
                break
            chosen = further
        x = np.clip(self.powers.back(omega), lower, upper)
        return Step(x, slack, sum(held.multiplier for held in self.held(omega)[0] if held.row >= 0))

    def held(self, omega: Array) -> tuple[list[Held], float]:
        """What holds a design, with multipliers, and what these leave of the objective's slope, over that."""
        _, slope = self.objective(omega)
        rate, columns, known = self.powers.rate(omega), [], []
        for k, limit in enumerate(self.rules.limits):
            if limit is None:
                continue
            shares = self._shares(omega, k)
            rows = np.arange(len(shares)) if self.rules.aggregated[k] else np.flatnonzero(shares >= 1 - _ACTIVE)
            if not len(rows):
                continue
            values, slopes = self.rows(omega, k, rows)
            for n, (share, column) in enumerate(zip(values.tolist(), slopes, strict=True)):
                if share >= 1 - _ACTIVE:
                    columns.append(column)
                    row = int(rows[n])
                    if self.rules.aggregated[k]:
                        own = np.flatnonzero(self.rules.groups[k] == n)
                        row = int(own[shares[own].argmax()])
                    known.append(Held(k, row, share, 0.0))
        span, x = self.rules.upper - self.rules.lower, self.powers.back(omega)
        for v in range(len(x)):
            for sign, row, bound in ((-1.0, -1, self.rules.lower[v]), (1.0, -2, self.rules.upper[v])):
                if abs(x[v] - bound) <= _BOUND * span[v]:
                    columns.append(sign * rate * np.eye(len(x))[v])
                    known.append(Held(v, row, 1.0, 0.0))
        size = float(np.linalg.norm(slope)) or 1.0
        if not columns:
            return [], float(np.linalg.norm(slope)) / size
        scales = np.array([float(np.linalg.norm(c)) or 1.0 for c in columns])
        multipliers, left = nnls(np.stack(columns, axis=1) / scales, -slope)
        found = [one._replace(multiplier=float(m / s)) for one, m, s in zip(known, multipliers, scales, strict=True)]
        kept = [one for one, m in zip(found, multipliers, strict=True) if m > _LEAST * size]
        return kept, float(left) / size

    def slope(self, omega: Array, held: Sequence[Held]) -> Array:
        """(v,) of the Lagrange function by the variables, at multipliers."""
        result = self.objective(omega)[1]
        for k in range(len(self.rules.limits)):
            own = [h for h in held if h.row >= 0 and h.number == k]
            if not own:
                continue
            at = np.array([h.row for h in own])
            if self.rules.aggregated[k]:
                places = self.rules.groups[k][at]
                slopes = self.rows(omega, k, np.arange(len(self.rules.groups[k])))[1][places]
            else:
                slopes = self.rows(omega, k, at)[1]
            result = result + np.array([h.multiplier for h in own]) @ slopes
        return np.asarray(result / self.powers.rate(omega))

    def next(self, found: Evaluation) -> Approximation:
        """About the differentiated design that a step from this one led to, with what the step tells of curvature."""
        gone = found.x - self.base.x
        there, plain = Approximation(self.rules, found, gone=gone), Approximation(self.rules, self.base)
        omega, held = self.powers.to(found.x), self.held(self.powers.to(found.x))[0]
        foreseen = plain.slope(omega, held)
        own = foreseen - plain.slope(self._ones, held)
        curvature = float(own @ gone)
        if curvature <= _SEEN * float(np.linalg.norm(own) * np.linalg.norm(gone)):
            return there
        beyond = float((there.slope(self._ones, held) - foreseen) @ gone)
        swings = self._gone is not None and float(own @ self._gone) < 0 and beyond > _SWINGING * curvature
        share = min(max(beyond / curvature, _SOFTEST), _HARDEST if swings else 0.0)
        return Approximation(self.rules, found, share / curvature * np.outer(own, own), gone)

    def _shares(self, omega: Array, k: int) -> Array:
        return self.rules.shares(self.components(omega))[k]

    def _chosen(self, omega: Array, k: int) -> IntArray:
        """Rows near their limits."""
        shares = self._shares(omega, k)
        if self.rules.aggregated[k] or self.rules.every[k] or not len(shares):
            return np.arange(len(shares))
        near = np.flatnonzero(shares >= _NEAR * max(1.0, float(shares.max())))
        near = np.union1d(near, [int(shares.argmax())])
        return np.sort(near[np.argsort(-shares[near])[:_MOST_ROWS]])

    def _passed(self, omega: Array, k: int, slack: float) -> IntArray:
        return np.flatnonzero(self._shares(omega, k) > 1 + slack + 1e-6)

    def _minimum(self, ends: Array, chosen: list[IntArray], start: Array) -> tuple[Array, float]:
        scale = max(abs(self.base.objective), 1e-300)
        used = [k for k, limit in enumerate(self.rules.limits) if limit is not None]

        def cost(z: Array) -> tuple[float, Array]:
            value, slope = self.objective(z[:-1])
            return value / scale + _SLACK * z[-1], np.append(slope / scale, _SLACK)

        def found(z: Array) -> tuple[Array, Array]:
            both = [self.rows(z[:-1], k, chosen[k]) for k in used]
            return np.concatenate([s for s, _ in both]), np.concatenate([j for _, j in both])

        rows = {
            "type": "ineq",
            "fun": lambda z: 1 + z[-1] - found(z)[0],
            "jac": lambda z: np.column_stack([-found(z)[1], np.ones(len(found(z)[0]))]),
        }
        worst = max(0.0, float((found(np.append(start, 0.0))[0] - 1).max())) if used else 0.0
        result = minimize(
            cost,
            np.append(start, worst),
            jac=True,
            method="SLSQP",
            bounds=[*zip(*ends, strict=True), (0.0, max(10.0, 2 * worst))],
            constraints=[rows] if used else [],
            options={"maxiter": 300, "ftol": 1e-12},
        )
        omega = np.clip(result.x[:-1], ends[0], ends[1])
        shares = found(np.append(omega, 0.0))[0] if used else np.zeros(0)
        slack = max(0.0, float((shares - 1).max(initial=0.0)))
        return omega, slack if slack > _MET else 0.0

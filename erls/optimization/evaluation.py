"""What optimizers see: designs with objective, constraint components and their derivatives.

`Evaluator` is what they call; a run of the motion or a static response stands behind it. What stiffness makes of
components of constraints depends nearly linearly on powers of the variables, what loads make of them on others, and
their `Measure` is convex: whoever approximates linearizes the components in these powers and keeps the measure.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from erls.maths.so3 import Array
from erls.optimization.measures import Measure
from erls.optimization.objective import Objective, Quadratic
from fe_import.model import IntArray


@dataclass(frozen=True)
class Evaluation:
    """A design.

    Attributes
    ----------
    x : (v,) array
    objective : float
    components : tuple of (n, q) arrays
        Of every constraint.
    violation : float
        Largest share by which a constraint passes its limit; negative where all hold.
    jacobians : tuple of (n, q, v) arrays
        Of components by the variables; empty until asked for.
    flexible : tuple of (n, q, v) arrays
        The parts of them that stiffness makes at held loads; all unless known apart.
    quadratic : Quadratic or None
        Of the part of masses, with the jacobians.
    """

    x: Array
    objective: float
    components: tuple[Array, ...]
    violation: float
    jacobians: tuple[Array, ...] = ()
    flexible: tuple[Array, ...] = ()
    quadratic: Quadratic | None = None


class Evaluator(Protocol):
    """Evaluates designs."""

    rules: Rules

    def evaluate(self, x: Array) -> Evaluation:
        """A design."""

    def differentiate(self, found: Evaluation) -> Evaluation:
        """The same with derivatives."""


@dataclass(frozen=True)
class Rules:
    """What is the same for all designs of a problem.

    Attributes
    ----------
    lower, upper, powers : (v,) arrays
    names : tuple of str
        Of the constraints.
    limits : tuple of float or None
    measures : tuple of Measure
    aggregated : tuple of bool
        Which constraints hold one smooth value over all times for each of their places.
    every : tuple of bool
        Which constraints keep all rows in approximations.
    groups : tuple of (n,) arrays
        Numbers of the places of rows: what deflects, an element, a drive.
    objective : Objective
    """

    lower: Array
    upper: Array
    powers: Array
    names: tuple[str, ...]
    limits: tuple[float | None, ...]
    measures: tuple[Measure, ...]
    aggregated: tuple[bool, ...]
    every: tuple[bool, ...]
    groups: tuple[IntArray, ...]
    objective: Objective

    def beside(self, x: Array, share: float) -> Iterator[tuple[Array, Array, float]]:
        """See `beside`."""
        return beside(x, self.upper - self.lower, share)

    def shares(self, components: Sequence[Array]) -> list[Array]:
        """(n,) values of each constraint over its limit; empty for those without one."""
        found = zip(self.measures, components, self.limits, strict=True)
        return [np.zeros(0) if limit is None else m.value(c) / limit for m, c, limit in found]

    def violation(self, components: Sequence[Array]) -> float:
        """Largest share by which a limit is passed."""
        return max((float(s.max()) - 1 for s in self.shares(components) if len(s)), default=-1.0)

    def evaluation(self, x: Array, components: Sequence[Array]) -> Evaluation:
        """Of a design with these components."""
        timed, _ = self.objective.timed(components, self.measures)
        objective = self.objective.weighed(x) + timed
        return Evaluation(x, objective, tuple(components), self.violation(components))

    def differentiated(
        self, found: Evaluation, jacobians: Sequence[Array], flexible: Sequence[Array] | None = None
    ) -> Evaluation:
        """With derivatives."""
        own = tuple(jacobians if flexible is None else flexible)
        quadratic = self.objective.quadratic(found.x)
        return replace(found, jacobians=tuple(jacobians), flexible=own, quadratic=quadratic)


def beside(x: Array, span: Array, share: float) -> Iterator[tuple[Array, Array, float]]:
    """Designs (v,) on both sides of one, variable by variable, and how far away: a share of the variable, or of a
    hundredth of the distance ``span`` of its bounds where that is larger.
    """
    for k in range(len(x)):
        step = share * max(abs(float(x[k])), 1e-2 * float(span[k]))
        way = step * np.eye(len(x))[k]
        yield x + way, x - way, step


_KS = 200.0  # of the Kreisselmeier-Steinhauser function of shares: ln(n)/200 above their largest


def aggregate(shares: Array, groups: IntArray) -> tuple[Array, Array]:
    """Smooth largest values (g,) of (n,) in groups that are numbered from 0, never below them, and slopes (g, n)."""
    member = groups == np.arange(int(groups.max()) + 1)[:, None]
    largest = np.where(member, shares, -np.inf).max(axis=1)
    weights = np.where(member, np.exp(np.minimum(_KS * (shares - largest[:, None]), 0.0)), 0.0)
    total = weights.sum(axis=1)
    return largest + np.log(total) / _KS, weights / total[:, None]

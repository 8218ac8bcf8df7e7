"""Constraints as a few smooth values, whose derivatives a run backward finds: for many variables.

The rows of a constraint (times, ends of elements) go into one value for each of its places, the Kreisselmeier-Steinhauser
function of their shares of the limit, which is never below the largest. A derivative of a value is that of a weighted
sum of components, so that the adjoint method needs one column for each, and no derivative of a component is formed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from erls.maths.so3 import Array
from erls.optimization.dynamics import Dynamics
from erls.optimization.evaluation import Evaluation, aggregate
from erls.optimization.measures import Itself


class Aggregates:
    """An `erls.optimization.evaluation.Evaluator` on runs, whose components are the values of places.

    Parameters
    ----------
    dynamics : Dynamics
        All of whose constraints are aggregated.
    """

    def __init__(self, dynamics: Dynamics) -> None:
        self._dynamics, rules = dynamics, dynamics.rules
        count = len(rules.limits)
        self.rules = replace(
            rules,
            measures=(Itself(),) * count,
            aggregated=(False,) * count,
            every=(True,) * count,
            groups=tuple(np.arange(int(own.max()) + 1) for own in rules.groups),
        )

    def evaluate(self, x: Array) -> Evaluation:
        """A design by its run."""
        return self._aggregated(self._dynamics.evaluate(x))

    def differentiate(self, found: Evaluation) -> Evaluation:
        """With derivatives, backward over the run."""
        of_rows = self._dynamics.evaluate(found.x)
        weights = self._weights(of_rows.components)
        whole, own = self._dynamics.derivatives(found.x, weights)
        ends = np.cumsum([len(c) for c in found.components])[:-1]
        parts = [[j[:, None, :] for j in np.split(each, ends)] for each in (whole, own)]
        return self.rules.differentiated(found, *parts)

    def excess(self, x: Array) -> list[float]:
        """By how much values are above the largest row, at most, in shares of the limit; of each constraint."""
        found = self._dynamics.evaluate(x)
        result = []
        for shares, groups in zip(self._dynamics.rules.shares(found.components), self._dynamics.rules.groups, strict=True):
            values, largest = aggregate(shares, groups)[0], np.full(int(groups.max()) + 1, -np.inf)
            np.maximum.at(largest, groups, shares)
            held = values >= values.max() - 1e-2  # those that may hold the design
            result.append(float((values - largest)[held].max()))
        return result

    def _aggregated(self, found: Evaluation) -> Evaluation:
        rules = self._dynamics.rules
        values = []
        for shares, groups, limit in zip(rules.shares(found.components), rules.groups, rules.limits, strict=True):
            assert limit is not None
            values.append(limit * aggregate(shares, groups)[0][:, None])
        return self.rules.evaluation(found.x, values)

    def _weights(self, components: Sequence[Array]) -> Array:
        """(m, n) of all components in the values of all places."""
        rules, blocks = self._dynamics.rules, []
        shares = rules.shares(components)
        for own, groups, measure, given in zip(shares, rules.groups, rules.measures, components, strict=True):
            _, by_row = aggregate(own, groups)
            blocks.append((by_row[:, :, None] * measure.slope(given)).reshape(len(by_row), -1))
        result = np.zeros((sum(len(b) for b in blocks), sum(b.shape[1] for b in blocks)))
        row = column = 0
        for block in blocks:
            result[row : row + len(block), column : column + block.shape[1]] = block
            row, column = row + len(block), column + block.shape[1]
        return result

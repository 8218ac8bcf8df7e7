"""Steps of integrators as linear maps of small changes: what their formulas do to derivatives of the motion.

A step from (y₀, v₀, a₀, α₀) to the accelerations a_i at its nodes c_i sets

    y_i = y₀ + c_i h v₀ + h² (p_i a₀ + r_i α₀ + Σ P_ij a_j)
    v_i = v₀ + h (q_i a₀ + s_i α₀ + Σ Q_ij a_j)

and the forces must balance there. α is the algorithmic acceleration of generalized-α, which moves on by
α₁ = w · (a₀, α₀, a₁); Lobatto collocation has none. Where the step changes within a leg, generalized-α moves α along,
α - a ∝ h (`erls.integrate.alpha_steps.Steps.set_step`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.integrate.alpha_rules import Formulas, Rules
from erls.integrate.lobatto import NODES, tableau
from erls.maths.so3 import Array

SAME_STEP = 1e-6
"""Relative change of a step that leaves α where it is, as in `erls.integrate.alpha_steps`."""


@dataclass(frozen=True)
class Scheme:
    """Coefficients of a method of s nodes, named as above.

    Attributes
    ----------
    nodes : (s,) array
        c.
    place_before, place_algorithmic, rate_before, rate_algorithmic : (s,) arrays
        p, r, q, s.
    places, rates : (s, s) arrays
        P, Q.
    algorithmic : (3,) array
        w.
    """

    nodes: Array
    place_before: Array
    place_algorithmic: Array
    places: Array
    rate_before: Array
    rate_algorithmic: Array
    rates: Array
    algorithmic: Array

    @property
    def count(self) -> int:
        """Nodes of a step."""
        return len(self.nodes)

    def history(self, h: Array) -> tuple[Array, Array]:
        """(j, s, 4) what (y, v, a, α) at the start of j steps h (j,) give to y_i, and to v_i."""
        one = np.ones((len(h), self.count))
        h = h[:, None]
        to_y = [one, h * self.nodes, h * h * self.place_before, h * h * self.place_algorithmic]
        to_v = [0 * one, one, h * self.rate_before, h * self.rate_algorithmic]
        return np.stack(to_y, axis=2), np.stack(to_v, axis=2)

    def rescaled(self, h: float, before: float | None) -> Array:
        """(4, 4) what a change of the step does to (y, v, a, α)."""
        result = np.eye(4)
        if before is not None and abs(h - before) > SAME_STEP * h and self.algorithmic.any():
            ratio = h / before
            result[3, 2:] = 1 - ratio, ratio
        return result

    def moved_on(self, h: Array) -> tuple[Array, Array]:
        """(j, 4, 4) what (y, v, a, α) at the start of j steps h (j,) give to those at their ends, and (j, 4, s) what
        their accelerations do.
        """
        to_y, to_v = self.history(h)
        before, nodes = np.zeros((len(h), 4, 4)), np.zeros((len(h), 4, self.count))
        before[:, 0], before[:, 1] = to_y[:, -1], to_v[:, -1]
        nodes[:, 0], nodes[:, 1] = np.outer(h * h, self.places[-1]), np.outer(h, self.rates[-1])
        nodes[:, 2, -1] = 1.0
        before[:, 3, 2:], nodes[:, 3, -1] = self.algorithmic[:2], self.algorithmic[2]
        return before, nodes


def generalized_alpha(spectral_radius: float) -> Scheme:
    """That of `erls.integrate.generalized_alpha`."""
    use = Formulas.of(Rules(spectral_radius, 0.0), 1.0)
    one = np.ones(1)
    return Scheme(
        nodes=one,
        place_before=use.beta * use.pull * one,
        place_algorithmic=(0.5 - use.beta + use.beta * use.keep) * one,
        places=use.beta * use.share * np.ones((1, 1)),
        rate_before=use.gamma * use.pull * one,
        rate_algorithmic=(1 - use.gamma + use.gamma * use.keep) * one,
        rates=use.gamma * use.share * np.ones((1, 1)),
        algorithmic=np.array([use.pull, use.keep, use.share]),
    )


def lobatto() -> Scheme:
    """That of `erls.integrate.lobatto`."""
    rates, places = tableau(NODES)
    none = np.zeros(len(NODES) - 1)
    return Scheme(
        nodes=np.array(NODES[1:]),
        place_before=places[1:, 0],
        place_algorithmic=none,
        places=places[1:, 1:],
        rate_before=rates[1:, 0],
        rate_algorithmic=none,
        rates=rates[1:, 1:],
        algorithmic=np.zeros(3),
    )

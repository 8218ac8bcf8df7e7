"""Equivalent static loads: the loads on a mechanism at rest that deform it as its motion does, at many times.

At a frozen configuration, small displacements u = Z r + w of a mechanism under loads f that are held obey

    w = C (f - Bᵀ λ),   Zᵀ (f - Bᵀ λ) = 0,   B (Z r + w) = 0

with the flexibility C of links that are clamped at their inboard nodes and the multipliers λ of the joints. The loads of a
run with shapes w₀ are f = K w₀ (E. Tromme, O. Brüls, J. Emonds-Alt, M. Bruyneel, G. Virlez, P. Duysinx, Struct.
Multidiscip. Optim. 48 (2013) 1167–1185, on Lie groups; B.-S. Kang, G.-J. Park, J. S. Arora, AIAA J. 43 (2005) 846–852,
for single links, λ = 0). What a design changes of w and r is added to the run's own components, so that at the design of
the run nothing is approximated.
"""

from __future__ import annotations


from functools import cached_property

import numpy as np

from erls.maths.so3 import Array
from erls.optimize.beams import assembled, clamped_flexibility, sections_of
from erls.optimize.design import scene_at
from erls.optimize.dynamics import Dynamics
from erls.optimize.evaluation import Evaluation, Rules
from erls.optimize.frozen import Frozen
from erls.optimize.limits import Motion

_STEP = 1e-4  # of variables: sections are polynomials of low order in them


class FrozenLoads:
    """Static response under the loads of a run; an `erls.optimize.evaluation.Evaluator`.

    Parameters
    ----------
    dynamics : Dynamics
    x : (v,) array
        Design of the run.
    motion : Motion
        Of the run.
    whole : bool
        The mechanism as a whole; otherwise each link alone, joints passing on how it moves, not what it bears.

    Attributes
    ----------
    evaluations : int
        Static analyses of all times so far.
    """

    def __init__(self, dynamics: Dynamics, x: Array, motion: Motion, whole: bool) -> None:
        self.rules: Rules = dynamics.rules
        self._dynamics, self._whole, self.evaluations = dynamics, whole, 0
        self._frozen: Frozen = motion.frozen
        self._motion, self._x = motion, x
        self._mechanism = dynamics.designs.at(x).mechanism
        stiffness = assembled(self._frozen, self._sections(x))
        self._loads = motion.shape.reshape(len(motion.frozen.times), -1) @ stiffness
        self._base = self._response(x)

    def _sections(self, x: Array) -> Array:
        return sections_of(self._mechanism, scene_at(self._dynamics.problem, x))

    @cached_property
    def _turned(self) -> Array:
        """(k, m, 6 L) B Z."""
        return np.asarray(self._frozen.rows @ self._frozen.carried)

    def _response(self, x: Array) -> tuple[Array, Array, Array]:
        """(k, 6 L), (k, 6 N) and (6 N, 6 N): r, w and C at a design."""
        flexibility = clamped_flexibility(self._frozen, self._sections(x))
        w = self._loads @ flexibility
        r, further = self._joined(flexibility, w, self._loads)
        return r, w + further, flexibility

    def _joined(self, flexibility: Array, w: Array, loads: Array | None) -> tuple[Array, Array]:
        """r, and what multipliers add to w, at deformations w of links alone."""
        rows, turned, links = self._frozen.rows, self._turned, self._turned.shape[2]
        gap = -np.einsum("kmn,kn->km", rows, w)
        if not self._whole:
            return np.einsum("klm,km->kl", np.linalg.pinv(turned, rcond=1e-9), gap), np.zeros_like(w)
        passed = rows @ flexibility  # (k, m, 6 N)
        between = passed @ np.swapaxes(rows, 1, 2)
        scale = float(np.abs(between).max(initial=0.0)) or 1.0
        m = rows.shape[1]
        matrix = np.zeros((len(rows), links + m, links + m))
        matrix[:, :links, links:] = np.swapaxes(turned, 1, 2)
        matrix[:, links:, :links], matrix[:, links:, links:] = turned, -between / scale
        right = np.zeros((len(rows), links + m))
        right[:, links:] = gap
        if loads is not None:
            right[:, :links] = loads @ self._frozen.carried
        solved = np.linalg.solve(matrix, right[..., None])[..., 0]
        multipliers = solved[:, links:] / scale
        return solved[:, :links], -np.einsum("kmn,km->kn", passed, multipliers)

    def evaluate(self, x: Array) -> Evaluation:
        """A design by its static response."""
        self.evaluations += 1
        r, w, _ = self._response(x)
        change = r - self._base[0], w - self._base[1]
        limits = self._dynamics.limits(x)
        components = [
            limit.exact(self._motion) + limit.increments(self._frozen, *change) for limit in limits
        ]
        return self.rules.evaluation(x, components)

    def differentiate(self, found: Evaluation) -> Evaluation:
        """With derivatives: dC = -C dK C."""
        x = found.x
        _, w, flexibility = self._response(x)
        limits, base = self._dynamics.limits(x), w - self._base[1]
        r_now = self._response(x)[0] - self._base[0]
        columns: list[list[Array]] = [[] for _ in limits]
        for v in range(len(x)):
            step = _STEP * max(abs(float(x[v])), 1e-2 * float(self.rules.upper[v] - self.rules.lower[v]))
            sides = [x + sign * step * np.eye(len(x))[v] for sign in (1.0, -1.0)]
            rate = (self._sections(sides[0]) - self._sections(sides[1])) / (2 * step)
            alone = -(w @ assembled(self._frozen, rate)) @ flexibility
            r, further = self._joined(flexibility, alone, None)
            beside = [self._dynamics.limits(side) for side in sides]
            for k, limit in enumerate(limits):
                own = [
                    other[k].exact(self._motion) + other[k].increments(self._frozen, r_now, base) for other in beside
                ]
                moved = limit.increments(self._frozen, r, alone + further)
                columns[k].append(moved + (own[0] - own[1]) / (2 * step))
        return self.rules.differentiated(found, [np.stack(column, axis=-1) for column in columns])

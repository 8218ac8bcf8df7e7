"""Runs with complex constants: a complex step through a whole scheme, iterated until its imaginary part stops changing.

The formulas of the methods stand here once more, as `erls.integrate.generalized_alpha` and `erls.integrate.lobatto`
print them, over residuals compiled for complex numbers; no derivative of `erls.sensitivity` takes part. The real parts
are those that the run left: what its own iterations stop at is a matter of the run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from erls.equations.registry import formulate
from erls.integrate.base import legs
from erls.integrate.lobatto import NODES, tableau
from erls.maths.jit import any_scalar
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism
from erls.sensitivity.parameters import Parameter, scene_with
from erls.simulation.chains import models_of

STEP = 1e-30
ENOUGH = 12  # iterations: each leaves a tenth or less
RICHARDSON = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))


@dataclass(frozen=True)
class Given:
    """Derivatives of what a run is made of by a parameter: its constants, and its start."""

    constants: np.ndarray
    y: np.ndarray
    v: np.ndarray


def given(run: ChainRun, parameter: Parameter, step: float) -> Given:
    """By differences of what is packed, of fourth order; the modal models stay as they are."""
    parts = []
    for at, _ in RICHARDSON:
        scene = scene_with(run.scene, parameter, parameter.value + at * step)
        chain: Any = formulate(
            build_mechanism(scene, lambda text: None, *models_of(run)).mechanism, run.scene.record.simulation
        )
        system = chain.compiled
        np.testing.assert_array_equal(system.integers, run.formulation.compiled.integers)  # type: ignore[attr-defined]
        limitless = np.where(np.isfinite(system.reals), system.reals, 0.0)  # a torque without limit, say
        parts.append((limitless, *chain.initial_state()))
    return Given(*(summed(part, step) for part in zip(*parts, strict=True)))


def summed(values: Sequence[np.ndarray], step: float) -> np.ndarray:
    """Derivative from values at steps of `RICHARDSON`: none of what does not change, as its weights add up to zero."""
    weights = [weight / step for _, weight in RICHARDSON]
    return np.asarray(sum(w * (value - values[0]) for w, value in zip(weights, values, strict=True)))


def differentiated(run: ChainRun, by: Given, spectral_radius: float | None) -> np.ndarray:
    """(k, 3, n) derivatives at the knots of a run, of generalized-alpha, or of Lobatto collocation without a radius."""
    chain: Any = run.formulation
    return _Complex(chain, by.constants).along(run, by, spectral_radius).imag / STEP


class _Complex:
    """Equations of motion with a constant moved."""

    def __init__(self, chain: Any, constants: np.ndarray) -> None:
        self.chain, self.system = chain, chain.compiled
        self.residual = any_scalar(self.system.residual, getattr(self.system, "called", None))
        self.reals = self.system.reals + 1j * STEP * constants
        self.scratch = self.system.scratch.astype(complex)

    def forces(self, t: float, y: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        out = np.zeros(len(y), dtype=complex)
        given = (np.ascontiguousarray(x) for x in (y, v, a))
        self.residual(self.reals, self.system.integers, self.scratch, t, *given, out)
        return out

    def balanced(self, t: list[float], at: np.ndarray, given: Any, rates: np.ndarray, places: np.ndarray) -> np.ndarray:
        """(s, 3, n) states ``at`` nodes with their imaginary parts: y = given + places a, v = given + rates a."""
        y, v = (np.imag(x) for x in given)
        count, n = at.shape[0], at.shape[2]
        matrices = []
        for i, time in enumerate(t):
            stiff, damp = self.chain.stiffness_and_damping(time, at[i, 0], at[i, 1])
            matrices.append((self.chain.mass_matrix(time, at[i, 0]), damp, stiff))
        whole = np.block(
            [
                [(i == j) * m + rates[i, j] * d + places[i, j] * k for j in range(count)]
                for i, (m, d, k) in enumerate(matrices)
            ]
        )
        a, moved = np.zeros((count, n)), np.empty((count, 3, n))
        for _ in range(ENOUGH):
            moved[:, 0], moved[:, 1], moved[:, 2] = y + places @ a, v + rates @ a, a
            found = [self.forces(time, *state) for time, state in zip(t, at + 1j * moved, strict=True)]
            a = a - np.linalg.solve(whole, np.concatenate(found).imag).reshape(count, n)
        return np.asarray(at + 1j * moved)

    def along(self, run: ChainRun, by: Given, radius: float | None) -> np.ndarray:
        s = run.solution
        result = np.zeros((len(s.t), 3, s.y.shape[1]), dtype=complex)
        real = np.stack([s.y, s.v, s.a], axis=1)
        y, v = s.y[0] + 1j * STEP * by.y, s.v[0] + 1j * STEP * by.v
        ends = [0, *(np.flatnonzero(np.diff(s.t) == 0) + 1).tolist(), len(s.t)]
        walks = zip(ends[:-1], ends[1:], legs(self.chain, (s.t[0], s.t[-1])), strict=True)
        for first, end, leg in walks:
            none = np.zeros((1, 1))
            state = self.balanced([leg.first], real[first : first + 1], ([y], [v]), none, none)[0]
            result[first] = state
            algorithmic = state[2]
            nodes = 1 if radius is not None else len(NODES) - 1
            for at in range(first + 1, end, nodes):
                h = s.t[at + nodes - 1] - s.t[at - 1]
                times = np.clip(s.t[at : at + nodes], leg.first, leg.last).tolist()
                knots = real[at : at + nodes]
                if radius is None:
                    found = self.balanced(times, knots, *collocation(h, state))
                else:
                    found, algorithmic = self._alpha(times, knots, h, radius, state, algorithmic)
                result[at : at + nodes] = found
                state = found[-1]
            y, v = state[0], state[1]
        return result

    def _alpha(self, t: list[float], knots: np.ndarray, h: float, radius: float, state: Any, old: Any) -> Any:
        """J. Chung and G. M. Hulbert; M. Arnold and O. Bruels."""
        alpha_m, alpha_f = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
        gamma = 0.5 + alpha_f - alpha_m
        beta = 0.25 * (gamma + 0.5) ** 2
        y, v, before = state
        new = (alpha_f * before - alpha_m * old) / (1 - alpha_m)  # less its share of the new acceleration
        share = (1 - alpha_f) / (1 - alpha_m)
        base = ([y + h * v + h * h * ((0.5 - beta) * old + beta * new)], [v + h * ((1 - gamma) * old + gamma * new)])
        one = np.ones((1, 1))
        found = self.balanced(t, knots, base, h * gamma * share * one, h * h * beta * share * one)
        return found, new + share * found[0, 2]


def collocation(h: float, state: np.ndarray) -> tuple[Any, np.ndarray, np.ndarray]:
    """What nodes have from the start of a step, and weights of their accelerations."""
    rates, places = tableau(NODES)
    y, v, a = state
    ys = [y + c * h * v + h * h * p * a for c, p in zip(NODES[1:], places[1:, 0], strict=True)]
    vs = [v + h * q * a for q in rates[1:, 0]]
    return (ys, vs), h * rates[1:, 1:], h * h * places[1:, 1:]

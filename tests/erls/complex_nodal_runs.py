"""Nodal runs with complex constants: a complex step through Lie-group generalized-alpha, iterated until its imaginary
part stops changing.

The formulas of the method stand here once more, as `erls.integrate.lie_generalized_alpha` prints them, over the
elements' own source compiled for complex numbers; iterations take the matrices of runs. No derivative of
`erls.sensitivity` and no exact tangent takes part.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from complex_runs import RICHARDSON, STEP, summed

from erls.equations.nodal import blocks, sums
from erls.equations.nodal.layout import Flat
from erls.equations.nodal.nodes import numbers_of
from erls.equations.registry import formulate
from erls.integrate.base import legs
from erls.maths import motion_maps as motions
from erls.maths.jit import any_scalar
from erls.maths.saddle import dense
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism
from erls.sensitivity.parameters import Parameter, scene_with
from erls.simulation.chains import models_of

ENOUGH = 20  # iterations at the most
_SETTLED = 1e-15  # of the largest: corrections


@dataclass(frozen=True)
class Given:
    """Derivatives of what a run is made of by a parameter: its constants, samples at its knots, places and twists of
    the start.
    """

    constants: np.ndarray
    samples: np.ndarray
    place: np.ndarray
    rate: np.ndarray


def given(run: ChainRun, parameter: Parameter, step: float) -> Given:
    """By differences of what is packed, of fourth order; the modal models stay as they are."""
    base: Any = run.formulation
    start = base.configuration(run.solution.y[0], run.solution.v[0])[0]
    times = _times(run)
    parts = []
    for at, _ in RICHARDSON:
        scene = scene_with(run.scene, parameter, parameter.value + at * step)
        mechanism = build_mechanism(scene, lambda text: None, *models_of(run)).mechanism
        other: Any = formulate(mechanism, run.scene.record.simulation)
        q, v = other.configuration(*other.initial_state())
        moved = motions.log(motions.inverse(start.poses) @ q.poses).ravel()
        reals = np.where(np.isfinite(other.system.flat.reals), other.system.flat.reals, 0.0)
        parts.append((reals, other.system.samples(times), moved, v))
    return Given(*(summed(part, step) for part in zip(*parts, strict=True)))


def _times(run: ChainRun) -> np.ndarray:
    """At which forces are asked for."""
    base: Any = run.formulation
    t = run.solution.t
    ends = [0, *(np.flatnonzero(np.diff(t) == 0) + 1).tolist(), len(t)]
    whole = legs(base.system, (t[0], t[-1]))
    parts = zip(ends[:-1], ends[1:], whole, strict=True)
    return np.concatenate([np.clip(t[a:b], leg.first, leg.last) for a, b, leg in parts])


class _Complex:
    """A system with constants and samples moved."""

    def __init__(self, run: ChainRun, by: Given) -> None:
        self.system = run.formulation.system  # type: ignore[attr-defined]
        flat = self.system.flat
        self._flat = Flat(flat.reals + 1j * STEP * by.constants, flat.integers, flat.scratch.astype(complex), 0)
        self.work, self.times = self._flat.work(), _times(run)
        self._samples = self.system.samples(self.times) + 1j * STEP * by.samples
        self._move, self._forces, self._conditions = map(any_scalar, (sums.move, sums.forces, blocks.conditions))

    def moved(self, k: int, q: np.ndarray, increment: np.ndarray) -> np.ndarray:
        """q ∘ exp(increment), which the work then holds."""
        memory = self._memory(k)
        self.work.increment[:] = increment
        self._move(*memory, q)
        return np.concatenate([x.ravel() for x in (self.work.poses, self.work.bent, self.work.turned, self.work.wound)])

    def forces(self, k: int, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """(n + m,) out of balance at the poses that the work holds."""
        n, work = self.system.size, self.work
        work.v[:], work.a[:], work.multipliers[:] = v, a[:n], a[n:]
        self._forces(*self._memory(k), q)
        return np.concatenate([work.force + work.reaction, work.violation])

    def curvature(self, k: int, a: np.ndarray) -> np.ndarray:
        """(m,) second derivative of the conditions by time."""
        self._conditions(*self._memory(k))
        work, rows = self.work, self.system.rows
        result = work.bias.copy()
        for row, joint in enumerate(rows.joint_of_row):
            for side in range(2):
                node = rows.nodes[joint, side]
                if node >= 0:
                    result[row] += work.gradient[row, 6 * side : 6 * side + 6] @ a[6 * node : 6 * node + 6]
        return result

    def _memory(self, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        self._flat.scratch[: self._samples.shape[1]] = self._samples[k]
        return self._flat.reals, self._flat.integers, self._flat.scratch


def differentiated(run: ChainRun, by: Given) -> np.ndarray:
    """(k, 2, n) derivatives of places, in the axes of the nodes, and of twists at the knots of a run."""
    base: Any = run.formulation
    system, s = base.system, run.solution
    n, m = system.size, system.constraints
    exact, radius = _Complex(run, by), run.scene.record.simulation.spectral_radius
    alpha_m, alpha_f = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
    gamma = 0.5 + alpha_f - alpha_m
    beta = 0.25 * (gamma + 0.5) ** 2
    share, pull, keep = (1 - alpha_f) / (1 - alpha_m), alpha_f / (1 - alpha_m), -alpha_m / (1 - alpha_m)
    states = [base.configuration(y, v) for y, v in zip(s.y, s.v, strict=True)]
    known = s.y[:, -(n + m) :]
    result = np.zeros((len(s.t), 2, n))
    q = exact.moved(0, numbers_of(states[0][0]).astype(complex), 1j * STEP * by.place)
    v = states[0][1] + 1j * STEP * by.rate
    a = algorithmic = np.zeros(n + m, dtype=complex)
    h = 0.0
    for k, t in enumerate(exact.times):
        at, real = states[k]
        mass = dense(system.mass_matrix(t, at))
        stiffness, damping = (dense(x) for x in system.stiffness_and_damping(t, at, real, known[k, :n], known[k, n:]))
        rows = dense(system.constraint_matrix(t, at))
        none = np.zeros((m, m))
        if k == 0 or s.t[k] == s.t[k - 1]:  # a leg begins

            def start(x: np.ndarray, k: int = k, q: np.ndarray = q, v: np.ndarray = v) -> np.ndarray:
                exact.moved(k, q, np.zeros(n))
                found = exact.forces(k, q, v, known[k] + 1j * STEP * x)[:n]
                return np.concatenate([found, exact.curvature(k, known[k, :n] + 1j * STEP * x[:n])])

            x = _settled(start, np.block([[mass, rows.T], [rows, none]]))
            a = algorithmic = known[k] + 1j * STEP * x
        else:
            before, h = h, s.t[k] - s.t[k - 1]
            if before and abs(h - before) > 1e-6 * h and s.t[k - 1] != s.t[max(k - 2, 0)]:
                algorithmic = a + (algorithmic - a) * (h / before)
            increment = motions.log(motions.inverse(states[k - 1][0].poses) @ at.poses).ravel()
            old = pull * a[:n] + keep * algorithmic[:n]
            base_d = (h * v + h * h * ((0.5 - beta) * algorithmic[:n] + beta * old)).imag / STEP
            base_v = (v + h * ((1 - gamma) * algorithmic[:n] + gamma * old)).imag / STEP
            tangent = dense(system.tangent(increment))
            to_d, to_v = h * h * beta * share, h * gamma * share

            def step(x: np.ndarray, k: int = k, q: np.ndarray = q) -> np.ndarray:
                exact.moved(k, q, increment + 1j * STEP * (base_d + to_d * x[:n]))  # noqa: B023
                moving = real + 1j * STEP * (base_v + to_v * x[:n])  # noqa: B023
                return exact.forces(k, q, moving, known[k] + 1j * STEP * x)

            block = mass + to_v * damping + to_d * stiffness @ tangent
            x = _settled(step, np.block([[block, rows.T], [to_d * rows @ tangent, none]]))
            q = exact.moved(k, q, increment + 1j * STEP * (base_d + to_d * x[:n]))
            v = real + 1j * STEP * (base_v + to_v * x[:n])
            a = known[k] + 1j * STEP * x
            algorithmic = a.copy()
            algorithmic[:n] = share * a[:n] + old
        result[k, 0] = _twists(q[: 12 * system.count].reshape(-1, 12))
        result[k, 1] = v.imag / STEP
    return result


def _settled(wrong: Any, matrix: np.ndarray) -> np.ndarray:
    """Where the imaginary part of what is wrong vanishes, by a matrix that need not be exact."""
    right = 1 / np.abs(matrix).max(axis=0)
    scaled = matrix * right
    left = 1 / np.abs(scaled).max(axis=1)
    inverse = np.linalg.inv(left[:, None] * scaled)
    x = np.zeros(len(matrix))
    for _ in range(ENOUGH):
        change = right * (inverse @ (left * wrong(x).imag / STEP))
        x = x - change
        if np.abs(change / right).max() <= _SETTLED * np.abs(x / right).max():
            break
    return x


def _twists(poses: np.ndarray) -> np.ndarray:
    """(n,) imaginary parts of poses (k, 12) as increments in the axes of the nodes."""
    turn, moved = (part.reshape(-1, 3, 3) for part in (poses[:, 3:].real, poses[:, 3:].imag / STEP))
    back = np.swapaxes(turn, 1, 2)
    spin = back @ moved
    place = back @ (poses[:, :3, None].imag / STEP)
    return np.concatenate([place[..., 0], spin[:, [2, 0, 1], [1, 2, 0]]], axis=1).ravel()

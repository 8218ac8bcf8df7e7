"""The knots of nodal runs in flat memory, for derivatives: all at once, or a stretch at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from erls.equations.nodal.nodes import numbers_of, poses_of, twists_of
from erls.integrate.alpha_rules import Formulas, Rules
from erls.integrate.base import Leg, walked
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.nodal_forces import Knots
from erls.sensitivity.schemes import SAME_STEP


class Walk(NamedTuple):
    """A leg: number of its first knot and the one after its last."""

    first: int
    end: int
    leg: Leg


class Motion:
    """Knots of a nodal run, all or some that follow one another, as kernels take them.

    Parameters
    ----------
    run : ChainRun
    rows : slice, optional
        Which.
    last : (c,) array, optional
        Configuration, in flat memory, of the first of them or of the one before: poses do not count turns. That of the
        start unless given.
    """

    def __init__(self, run: ChainRun, rows: slice = slice(None), last: Array | None = None) -> None:
        from erls.sensitivity.nodal_kernels import configurations  # here: it is compiled

        base: Any = run.formulation
        self.system, s = base.system, run.solution
        system, n = self.system, self.system.size
        kept = s.y.shape[1] - n - system.constraints
        frames = np.ascontiguousarray(s.y[rows, : 12 * system.count])
        self.poses = poses_of(frames.reshape(len(frames), system.count, 12))
        self.v = twists_of(self.poses[..., :3, :3], s.v[rows, : 12 * system.count].reshape(-1, system.count, 12))
        self.v = np.ascontiguousarray(self.v.reshape(len(frames), n))
        self.a = np.ascontiguousarray(s.y[rows, kept:])
        if last is None:
            near = replace(system.start, turned=s.y[0, 12 * system.count : kept].copy())
            last = numbers_of(system.at(self.poses[0], near))
        last = last.copy()
        self.q = np.empty((len(frames), len(last)))
        configurations(system.flat.reals, system.flat.integers, system.flat.scratch.copy(), frames, last, self.q)
        self.t = s.t[rows]

    def knots(self, walk: Walk, rows: Any) -> Knots:
        """Some of a leg."""
        t = np.clip(self.t[rows], walk.leg.first, walk.leg.last)
        return Knots(t, self.system.samples(t), self.q[rows], self.v[rows], self.a[rows])

    def increments(self, rows: slice) -> Array:
        """(k, n) that lead to knots from those before them."""
        before = self.poses[rows.start - 1 : rows.stop - 1]
        return np.asarray(motions.log(motions.inverse(before) @ self.poses[rows]).reshape(-1, self.system.size))

    def state(self, row: int) -> tuple[Any, Array]:
        """Configuration and twists of a knot."""
        near = self.system.start
        numbers = self.q[row, 12 * self.system.count :]
        ends = np.cumsum([near.bent.size, near.turned.size])
        bent, turned, wound = np.split(numbers.copy(), ends)
        known = replace(near, bent=bent.reshape(near.bent.shape), turned=turned, wound=wound.reshape(near.wound.shape))
        return replace(known, poses=self.poses[row]), self.v[row]


def walks_of(run: ChainRun) -> Iterator[Walk]:
    """Legs that were walked over."""
    base: Any = run.formulation
    for part in walked(base.system, run.solution.t):
        yield Walk(*part)


def rule_of(run: ChainRun) -> Array:
    """(5,) coefficients of the steps of a run, in the order of `erls.sensitivity.nodal_kernels`."""
    use = Formulas.of(Rules(run.scene.record.simulation.spectral_radius, 0.0), 1.0)
    return np.array([use.beta, use.gamma, use.share, use.pull, use.keep])


def ratios_of(sizes: Array) -> Array:
    """(k,) by how much each step of a leg is larger than the one before."""
    ratios = np.ones(len(sizes))
    ratios[1:] = sizes[1:] / sizes[:-1]
    ratios[np.abs(ratios - 1) <= SAME_STEP] = 1.0
    return ratios


def metres_of(base: Any) -> Array:
    """(N,) metres per unit of what a nodal run keeps of places; 0 of what goes with accelerations."""
    system = base.system
    result = np.zeros(base.size)
    frames = result[: 12 * system.count].reshape(-1, 12)
    frames[:, :3] = 1.0
    frames[:, 3:] = base.mechanism.reach
    result[12 * system.count : 12 * system.count + len(system.model.actuators)] = base.mechanism.reach
    return result

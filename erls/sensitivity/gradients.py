"""Derivatives of outputs by the states of a run that they ask for.

An output is a function of a run, and asks it for states at some times. At each of these the coordinates and rates are
moved one after the other, by as much as differences of fourth order want. Times of which no component of the output
asks two are moved together: places at hundred times cost as much as one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from erls.equations.linearization import WIDE, difference_steps, slopes
from erls.equations.registry import system_of
from erls.equations.serial.equilibrium import elastic_on_diagonal
from erls.equations.system import metre_scales
from erls.errors import Cause, SceneError
from erls.integrate.base import hermite, knots_after
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.nodal_motion import metres_of
from erls.sensitivity.outputs import EVALUATIONS, Output, value_of
from fe_import.model import IntArray

_MANY = 100  # coordinates, as nodes have: most outputs depend on some of these, and modes have fewer
_AGREES_NODES = 1e-7  # the same of nodes: what solves their equations beside a motion is no derivative along it
_AGREES = 1e-5  # of a derivative along a motion that is made up: what an output asks of a run by other ways is more


@dataclass(frozen=True)
class _Asked(ChainRun):
    """A run that notes what it is asked for, and answers with states that are moved.

    Attributes
    ----------
    noted : list of arrays
        Times [s].
    at : (m,) array
        Times at which states are moved, in rising order.
    moved : (m, 2, n) array
        Changes of coordinates and of rates there.
    """

    noted: list[Array] = field(default_factory=list)
    at: Array = field(default_factory=lambda: np.zeros(0))
    moved: Array = field(default_factory=lambda: np.zeros((0, 2, 0)))

    def _interpolated(self, t: ArrayLike) -> tuple[tuple[int, ...], Array, Array, Array]:
        shape, flat, y, v = super()._interpolated(t)
        self.noted.append(flat)
        if len(self.at):
            places = np.minimum(np.searchsorted(self.at, flat), len(self.at) - 1)
            known = self.at[places] == flat
            y, v = y.copy(), v.copy()
            y[known] += self.moved[places[known], 0]
            v[known] += self.moved[places[known], 1]
        return shape, flat, y, v


class Asking:
    """An output, and what it asks of a run.

    Parameters
    ----------
    output : callable
    name : str
        For messages.
    run : ChainRun
    weights : (m, size) array, optional
        Of sums of its components, whose derivatives are asked for in place of theirs.
    """

    def __init__(self, output: Output, name: str, run: ChainRun, weights: Array | None = None) -> None:
        self.output, self.name, self.run, self._weights = output, name, run, weights
        self._own = {f.name: getattr(run, f.name) for f in fields(ChainRun)}
        n = run.solution.y.shape[1]
        self.steps = _steps(run)
        noted: list[Array] = []
        self.value = self._asked(np.zeros(0), np.zeros((0, 2, n)), noted)
        self.times = np.unique(np.concatenate([np.zeros(0), *noted]))
        self.parts, self.groups = self._structure(n)

    @property
    def evaluations(self) -> int:
        """Of the output, that `by_knots` takes."""
        return EVALUATIONS * len(self.groups) * sum(len(own) for own in self.parts.values())

    @property
    def shape(self) -> tuple[int, ...]:
        """Of what is differentiated."""
        return self.value.shape if self._weights is None else (len(self._weights),)

    @property
    def count(self) -> int:
        """Of numbers that are differentiated."""
        return self.value.size if self._weights is None else len(self._weights)

    def summed(self, value: Array) -> Array:
        """What is differentiated of an output or of its derivative."""
        return value if self._weights is None else np.asarray(self._weights @ value.ravel())

    def by_knots(self) -> dict[int, Array]:
        """(3, n, c) derivatives of the c components, or sums, by the states at some knots, by number.

        Raises
        ------
        SceneError
            BAD_FIELD: the output knows the motion by other ways than the run's states at fixed times.
        """
        s = self.run.solution
        n = s.y.shape[1]
        found = np.zeros((len(self.times), 2, n, self.count))
        result: dict[int, Array] = {}
        for group in self.groups:
            for part, moving in self.parts.items():
                moved = partial(self._moved_together, group=group, part=part)
                whole = slopes(moved, np.eye(n)[:, moving], self.steps[moving])
                for time in group:
                    own = self.depends[time]
                    if self._weights is None:
                        found[time, part][np.ix_(moving, own)] = whole.T[:, own]
                    else:
                        found[time, part, moving] = whole.T[:, own] @ self._weights.T[own]
        for time, by_state in enumerate(found):
            right = int(knots_after(s.t, self.times[time : time + 1])[0])
            knots = np.array([right - 1, right])
            weights = _weights(s.t[knots], float(np.clip(self.times[time], s.t[0], s.t[-1])))
            for side, knot in enumerate(knots.tolist()):
                seed = np.einsum("po,pnc->onc", weights[:, side], by_state)
                result[knot] = result[knot] + seed if knot in result else seed
        self._check(result)
        return result

    def _moved_together(self, x: Array, group: Sequence[int], part: int) -> Array:
        """(k, c) values with coordinates or rates moved by (k, n) at the times of a group."""
        values = []
        for one in x:
            moved = np.zeros((len(self.times), 2, len(one)))
            moved[list(group), part] = one
            values.append(self._asked(self.times, moved, []).ravel())
        return np.array(values)

    def _structure(self, n: int) -> tuple[dict[int, IntArray], list[list[int]]]:
        """On which coordinates (0) and rates (1) it may depend, and groups of times that share no component."""
        way = self.steps * np.random.default_rng(0).choice([-1.0, 1.0], n)
        count = len(self.times)
        base = self.value.ravel()

        def acting(part: int, some: IntArray) -> IntArray:
            """Those of some coordinates, halved as long as they may be many."""
            moved = np.zeros((count, 2, n))
            moved[:, part, some] = way[some]
            if not len(some) or (self._asked(self.times, moved, []).ravel() == base).all():
                return some[:0]
            if n <= _MANY or len(some) == 1:
                return some
            return np.concatenate([acting(part, half) for half in np.array_split(some, 2)])

        parts = {part: moving for part in (0, 1) if len(moving := acting(part, np.arange(n)))}
        self.depends = np.zeros((count, base.size), dtype=bool)
        for time in range(count if parts else 0):
            moved = np.zeros((count, 2, n))
            moved[time] = way
            self.depends[time] = self._asked(self.times, moved, []).ravel() != base
        groups: list[list[int]] = []
        taken: list[Array] = []
        for time in np.flatnonzero(self.depends.any(axis=1)).tolist():
            for group, used in zip(groups, taken, strict=True):
                if not (used & self.depends[time]).any():
                    group.append(time)
                    used[self.depends[time]] = True
                    break
            else:
                groups.append([time])
                taken.append(self.depends[time].copy())
        return parts, groups

    def _asked(self, at: Array, moved: Array, noted: list[Array]) -> Array:
        return value_of(self.output, _Asked(**self._own, noted=noted, at=at, moved=moved), self.name)

    def _check(self, seeds: dict[int, Array]) -> None:
        """Against a change of the motion as a whole."""
        s = self.run.solution
        n = s.y.shape[1]
        if not n:
            return
        way = 1e-2 * self.steps * np.random.default_rng(1).uniform(-1, 1, (3, n))
        waves = np.sin(np.linspace(1.0, 60.0, len(s.t)))[:, None, None] * way

        def moved(share: float) -> Array:
            y, v, a = (x + share * waves[:, i] for i, x in enumerate((s.y, s.v, s.a)))
            return self._as_whole(y, v, a)

        found = (8 * (moved(1.0) - moved(-1.0)) - (moved(2.0) - moved(-2.0))) / 12
        expected = np.zeros(self.count)
        largest = np.zeros(self.count)
        for knot, seed in seeds.items():
            terms = seed * waves[knot][..., None]
            expected += terms.sum(axis=(0, 1))
            largest += np.abs(terms).sum(axis=(0, 1))
        rounding = 1e-12 * np.abs(self.value).max(initial=0.0)
        if self._weights is not None:
            rounding = rounding * np.abs(self._weights).sum(axis=1)
        agrees = _AGREES if n <= _MANY else _AGREES_NODES
        if (np.abs(found - expected) > agrees * np.maximum(largest, np.abs(found)) + rounding).any():
            raise SceneError(
                Cause.BAD_FIELD,
                "it knows the motion by other ways than what the run says at fixed times",
                where=f"output {self.name}",
                remedy="ask the run at times, or take method 'forward'",
            )

    def _as_whole(self, y: Array, v: Array, a: Array) -> Array:
        moved = replace(self.run, solution=replace(self.run.solution, y=y, v=v, a=a))
        return self.summed(value_of(self.output, moved, self.name)).ravel()


def _steps(run: ChainRun) -> Array:
    """(n,) of differences along what a run keeps."""
    formulation: Any = run.formulation
    if system_of(formulation.mechanism, run.scene.record.simulation) == "nodal":
        metres = metres_of(formulation)
        largest = 1 + np.abs(run.solution.y).max(axis=0)  # outputs are linear in accelerations and multipliers
        reach = WIDE * float(formulation.mechanism.reach)
        return np.asarray(np.where(metres > 0, reach / np.where(metres > 0, metres, 1.0), WIDE * largest))
    tree: Any = getattr(formulation, "bare", formulation)  # under the loops
    stiffness, _ = elastic_on_diagonal(tree)
    return difference_steps(metre_scales(formulation), float(formulation.mechanism.reach), stiffness, WIDE)


def _weights(ends: Array, t: float) -> Array:
    """(2, 2, 3) of y, v, a at two knots in (y, v) between them: result, knot, what of it."""
    units = np.eye(6).reshape(6, 2, 3)  # a coordinate for each
    by_y, by_v, by_a = (units[:, :, k].T for k in range(3))
    y, v = hermite(ends, by_y, by_v, by_a, np.array([t]))
    return np.stack([y[0], v[0]]).reshape(2, 2, 3)

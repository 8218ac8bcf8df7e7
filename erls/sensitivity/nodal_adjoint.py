"""The adjoint method for nodal runs: backward over the steps of Lie-group generalized-α, transposed one by one.

The transpose of `erls.sensitivity.nodal_forward`, so that both agree to rounding. Where a run bends and turns beyond
what poses tell depends on all of it before: configurations at the first knots of stretches are found forward and kept,
those within again a stretch at a time, so that memory does not grow with a motion's derivatives.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.nodal_forces import Residuals, Slope, slope_of
from erls.sensitivity.nodal_forward import singular
from erls.sensitivity.nodal_motion import Motion, Walk, ratios_of, rule_of, walks_of
from erls.sensitivity.nodal_seeds import NodeSeeds, Seeds
from erls.sensitivity.nodal_start import LegStart, start_changes
from erls.sensitivity.variants import Difference

_ROOM = 4_000_000
"""Numbers of a stretch that are held at a time."""


class _Stretch(NamedTuple):
    """Steps of a leg from the knot before ``first`` to that before ``end``, and its configuration in flat memory."""

    walk: Walk
    first: int
    end: int
    last: Array | None


def gradients(run: ChainRun, differences: Sequence[Difference], seeds: Seeds, count: int) -> Array:
    """(p, c) derivatives of ``count`` outputs by p parameters, through the motion.

    Parameters
    ----------
    run : ChainRun
        Of the formulation ``nodal``.
    differences : sequence of Difference
    seeds : mapping of int to (3, N, c) array
        Derivatives by what the run keeps of some knots, by number.
    count : int
        c.

    Raises
    ------
    SimulationError
        The linearized equations of a step are singular; tells when.
    """
    base: Any = run.formulation
    system = base.system
    n, asked = system.size, NodeSeeds(run, seeds, count)
    back, known = _Back(run), Residuals(system)
    slopes = [slope_of(known, difference) for difference in differences]
    total = np.zeros((len(differences), count))
    state = np.zeros((count, 4, n))
    for stretch, motion in _backward(run, count):
        begin = stretch.first - 1
        if len(motion.t) > 1:
            found = back.over(stretch, motion, asked.within(motion, begin, slice(1, None)), state)
            total += _through(known, slopes, stretch, motion, found)
        begins = begin == stretch.walk.first
        for knot in range(begin + (not begins), begin + len(motion.t)):
            if knot in seeds:
                total += [asked.own(motion, knot - begin, knot, difference) for difference in differences]
        if not begins:
            continue
        seed = asked.within(motion, begin, slice(0, 1))[0]
        for of in range(3):
            state[:, of] += seed[:, of * n : (of + 1) * n]
        start = LegStart(base, stretch.walk.leg.first, *motion.state(0), motion.a[0])
        by = np.concatenate([state[:, 2] + state[:, 3], seed[:, 3 * n :]], axis=1)
        multipliers, place, rate = start.transposed(by.T)
        total += [start.explicit(difference) @ multipliers for difference in differences]
        state[:, 0] += place.T
        state[:, 1] += rate.T
        state[:, 2:] = 0.0
        if begin == 0:
            changes = start_changes(run, differences, *motion.state(0))
            total += np.tensordot(changes, state[:, :2], ((1, 2), (1, 2)))
    return total


class _Back:
    """The transposed steps of a run."""

    def __init__(self, run: ChainRun) -> None:
        from erls.equations.nodal.tangents import addresses, room  # here: they are compiled

        base: Any = run.formulation
        self._system, self._rule, self._t = base.system, rule_of(run), run.solution.t
        model = self._system.model
        self._exact = addresses(len(model.beam_nodes), len(model.actuator_nodes))
        self._scratch = self._system.flat.scratch.copy()
        self._memory = np.zeros(self._system.flat.factors), *room(self._system.count)

    def over(self, stretch: _Stretch, motion: Motion, seeds: Array, state: Array) -> Array:
        """(k, c, n + m) multipliers of forces at the knots of a stretch; ``state`` moves to its start."""
        from erls.sensitivity.nodal_transposed import walk_back  # here: it is compiled

        flat, rows = self._system.flat, slice(1, len(motion.t))
        length = self._system.size + self._system.constraints
        knots, walk = motion.knots(stretch.walk, rows), stretch.walk
        sizes = np.diff(self._t[walk.first : stretch.end])
        made = slice(stretch.first - 1 - walk.first, None)
        out = np.empty((len(knots.q), len(state), length))
        failed = walk_back(
            self._exact,
            *(flat.reals, flat.integers, self._scratch),
            *self._memory,
            *(self._rule, sizes[made].copy(), ratios_of(sizes)[made].copy()),
            *(knots.samples, motion.increments(rows), knots.q, knots.v, knots.a),
            np.zeros((4, length + 2)),
            *(seeds, state, out),
        )
        if failed:
            raise singular(float(knots.t[failed - 1]))
        return out


def _through(
    known: Residuals, slopes: Sequence[Slope], stretch: _Stretch, motion: Motion, multipliers: Array
) -> Array:
    """(p, c) what parameters change of forces and conditions of a stretch, times their multipliers."""
    knots = motion.knots(stretch.walk, slice(1, len(motion.t)))
    own = known.at(known.reals, knots)
    return np.array([np.einsum("kf,kcf->c", slope.at(known, knots, own), multipliers) for slope in slopes])


def _backward(run: ChainRun, count: int) -> Iterator[tuple[_Stretch, Motion]]:
    """Stretches of all legs with their knots, the last one first."""
    base: Any = run.formulation
    each = (count + 3) * (3 * base.system.size + base.system.constraints)
    some = max(1, _ROOM // each)
    stretches: list[_Stretch] = []
    motion: Motion | None = None
    last: Array | None = None
    for walk in walks_of(run):
        for first in range(walk.first + 1, max(walk.end, walk.first + 2), some):
            end = min(first + some, walk.end)
            stretches.append(_Stretch(walk, first, end, last))
            motion = Motion(run, slice(first - 1, end), last)
            last = motion.q[-1].copy()
    for stretch in reversed(stretches):
        if motion is None:
            motion = Motion(run, slice(stretch.first - 1, stretch.end), stretch.last)
        yield stretch, motion
        motion = None


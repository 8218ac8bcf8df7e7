"""What an output asks of what a nodal run keeps, as derivatives by small changes of the nodes: the transpose of how
these move frames, joint coordinates, and the differences through which accelerations and multipliers are interpolated.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from erls.integrate.nodal_chain import slopes_in_time
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.nodal_motion import Motion
from erls.sensitivity.nodal_start import shares_of
from erls.sensitivity.outputs import ALONG
from erls.sensitivity.variants import Difference

Seeds = Mapping[int, Array]
"""(3, N, c) derivatives of c outputs by what a run keeps of some knots, by number."""

_REACH = 2  # knots on either side of one at which an acceleration's second difference is asked


class NodeSeeds:
    """Derivatives of c outputs by nodes.

    Parameters
    ----------
    run : ChainRun
    seeds : mapping of int to (3, N, c) array
    count : int
        c.
    """

    def __init__(self, run: ChainRun, seeds: Seeds, count: int) -> None:
        base: Any = run.formulation
        self.system, self._seeds, self._count = base.system, seeds, count
        self._frames = 12 * self.system.count + len(self.system.model.actuators)
        n, m = self.system.size, self.system.constraints
        self._slots: dict[int, Array] = {}
        for knot, seed in seeds.items():
            for other, own in _undifferenced(run.solution.t, knot, seed[:, self._frames :]):
                self._slots.setdefault(other, np.zeros((count, 3 * n + m)))[:, 2 * n :] += own.T

    def within(self, motion: Motion, first: int, rows: slice) -> Array:
        """(k, c, 3 n + m) at some rows of a motion whose first knot is ``first``."""
        n, m = self.system.size, self.system.constraints
        some = range(len(motion.t))[rows]
        found = np.zeros((len(some), self._count, 3 * n + m))
        for k, row in enumerate(some):
            if first + row in self._slots:
                found[k] += self._slots[first + row]
            seed = self._seeds.get(first + row)
            if seed is not None and seed[:, : self._frames].any():
                found[k, :, : 3 * n] += self._of_frames(motion, row, seed[:, : self._frames])
        return found

    def own(self, motion: Motion, row: int, knot: int, difference: Difference) -> Array:
        """(c,) through joint coordinates whose axes a parameter turns, the nodes held."""
        models = [variant.formulation.system for variant in difference.variants]
        first = models[0].model.actuator_frames
        if knot not in self._seeds or all(np.array_equal(x.model.actuator_frames, first) for x in models):
            return np.zeros(self._count)
        none = np.zeros((1, 3 * self.system.size))
        each = zip(difference.variants, models, strict=True)
        joints = sum(variant.weight * self._kept(motion, row, none, one.flat.reals)[0] for variant, one in each)
        start = 12 * self.system.count
        return np.asarray(np.tensordot(joints[:, start:], self._seeds[knot][:, start : self._frames], 2))

    def _of_frames(self, motion: Motion, row: int, seed: Array) -> Array:
        """(c, 3 n): frames go with their own node alone, so that those in no joint move together."""
        count, n = self.system.count, self.system.size
        joined = np.unique(self.system.model.actuator_nodes)
        groups = [[node] for node in joined[joined >= 0].tolist()]
        groups.append([node for node in range(count) if [node] not in groups])
        found = np.zeros((seed.shape[2], 3, count, 6))
        for group in groups:
            moved = np.zeros((3, 6, 3, count, 6))
            for of in range(3):
                for i in range(6):
                    moved[of, i, of, group, i] = 1.0
            change = moved.reshape(18, 3 * n)
            kept = self._slopes(motion, row, change)
            frames, joints = np.split(kept, [12 * count], axis=2)
            by_frame = seed[:, : 12 * count].reshape(3, count, 12, -1)
            own = np.einsum("xdge,dgec->cxg", frames.reshape(18, 3, count, 12)[:, :, group], by_frame[:, group])
            if len(group) == 1:  # all others are in no joint
                own[..., 0] += np.einsum("xdj,djc->cx", joints, seed[:, 12 * count :])
            found[:, :, group] = np.moveaxis(own.reshape(-1, 3, 6, len(group)), 2, 3)
        return found.reshape(-1, 3 * n)

    def _slopes(self, motion: Motion, row: int, change: Array) -> Array:
        """(k, 3, s) derivatives of what is kept of a knot along changes (k, 3 n)."""
        place, rate, gain = np.split(change, 3, axis=1)
        v, a = motion.v[row] + 0 * rate, motion.a[row, : self.system.size] + 0 * gain
        step = shares_of(self.system, place, (v, rate), (a, gain))[:, None]
        reals = self.system.flat.reals
        moved = [(weight, self._kept(motion, row, at * step * change, reals)) for at, weight in ALONG]
        return np.asarray(sum((weight / step)[..., None] * kept for weight, kept in moved))

    def _kept(self, motion: Motion, row: int, change: Array, reals: Array) -> Array:
        from erls.sensitivity.nodal_kernels import stored  # here: it is compiled

        place, rate, gain = np.split(change, 3, axis=1)
        out = np.empty((len(change), 3, self._frames))
        flat, n = self.system.flat, self.system.size
        moved = motion.v[row] + rate, motion.a[row, :n] + gain
        q = np.repeat(motion.q[row : row + 1], len(change), axis=0)
        stored(reals, flat.integers, flat.scratch.copy(), q, np.ascontiguousarray(place), *moved, out)
        return out


def _undifferenced(t: Array, knot: int, seed: Array) -> list[tuple[int, Array]]:
    """What (3, r, c) derivatives by values, slopes and slopes of these at a knot are by values at knots near it."""
    if not seed.any():
        return []
    first, last = max(0, knot - 2 * _REACH), min(len(t), knot + 2 * _REACH + 1)
    if not seed[1:].any():
        return [(knot, seed[0])]
    near = t[first:last]
    slope = slopes_in_time(near, np.eye(len(near)))
    row = knot - first
    weights = np.stack([np.eye(len(near))[row], slope[row], (slope @ slope)[row]])
    return [(first + k, np.tensordot(weights[:, k], seed, 1)) for k in np.flatnonzero(weights.any(axis=0)).tolist()]

"""Direct differentiation of nodal runs: small changes of nodes along the steps of Lie-group generalized-α.

The formulas are in `erls.sensitivity.nodal_kernels`. Tangents are exact (`erls.equations.nodal.tangents`), and one
factored band a step serves all parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from erls.equations.nodal.nodes import numbers_of, poses_of, twists_of
from erls.errors import Cause, SimulationError
from erls.integrate.alpha_rules import SINGULAR, Formulas, Rules
from erls.integrate.base import Leg, walked
from erls.integrate.nodal_chain import slopes_in_time
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.nodal_forces import Knots, Residuals, slope_of
from erls.sensitivity.nodal_start import LegStart, shares_of, start_changes
from erls.sensitivity.outputs import ALONG
from erls.sensitivity.schemes import SAME_STEP
from erls.sensitivity.variants import Difference

_ROOM = 4_000_000
"""Numbers of slopes of forces that are held at a time."""


class _Walk(NamedTuple):
    """A leg: number of its first knot and the one after its last."""

    first: int
    end: int
    leg: Leg


class _Motion:
    """The knots of a nodal run as kernels take them."""

    def __init__(self, run: ChainRun) -> None:
        from erls.sensitivity.nodal_kernels import configurations  # here: it is compiled

        base: Any = run.formulation
        self.system, s = base.system, run.solution
        system, n = self.system, self.system.size
        kept = s.y.shape[1] - n - system.constraints
        frames = np.ascontiguousarray(s.y[:, : 12 * system.count])
        self.poses = poses_of(frames.reshape(len(frames), system.count, 12))
        self.v = twists_of(self.poses[..., :3, :3], s.v[:, : 12 * system.count].reshape(-1, system.count, 12))
        self.v = np.ascontiguousarray(self.v.reshape(len(frames), n))
        self.a = np.ascontiguousarray(s.y[:, kept:])
        near = replace(system.start, turned=s.y[0, 12 * system.count : kept].copy())
        self.start = system.at(self.poses[0], near)
        last = numbers_of(self.start)
        self.q = np.empty((len(frames), len(last)))
        configurations(system.flat.reals, system.flat.integers, system.flat.scratch.copy(), frames, last, self.q)
        self.t = s.t
        self.walks = list(_walks(run))

    def knots(self, walk: _Walk, rows: Any) -> Knots:
        """Some of a leg."""
        t = np.clip(self.t[rows], walk.leg.first, walk.leg.last)
        return Knots(t, self.system.samples(t), self.q[rows], self.v[rows], self.a[rows])

    def state(self, row: int) -> tuple[Any, Array]:
        """Configuration and twists of a knot."""
        near = self.system.start
        numbers = self.q[row, 12 * self.system.count :]
        ends = np.cumsum([near.bent.size, near.turned.size])
        bent, turned, wound = np.split(numbers.copy(), ends)
        known = replace(near, bent=bent.reshape(near.bent.shape), turned=turned, wound=wound.reshape(near.wound.shape))
        return replace(known, poses=self.poses[row]), self.v[row]


def _walks(run: ChainRun) -> Iterator[_Walk]:
    """Legs that were walked over."""
    base: Any = run.formulation
    for part in walked(base.system, run.solution.t):
        yield _Walk(*part)


def differentiated(run: ChainRun, differences: Sequence[Difference]) -> Array:
    """(k, 3, N, p) derivatives of what a nodal run keeps of its knots, with rates and accelerations, by p parameters.

    Parameters
    ----------
    run : ChainRun
        Of the formulation ``nodal``.
    differences : sequence of Difference

    Raises
    ------
    SimulationError
        The linearized equations of a step are singular; tells when.
    """
    motion = _Motion(run)
    changes = changes_of(run, differences, motion)
    n = motion.system.size
    found = [_kept(motion, difference, changes[:, p], n) for p, difference in enumerate(differences)]
    return np.stack(found, axis=3)


def changes_of(run: ChainRun, differences: Sequence[Difference], motion: _Motion | None = None) -> Array:
    """(k, p, 3 n + m) of places, in the axes of the nodes, of twists, their rates and multipliers at all knots."""
    from erls.equations.nodal.tangents import addresses, room  # here: they are compiled
    from erls.sensitivity.nodal_kernels import ACCELERATION, ALGORITHMIC, PLACE, RATE, walk

    base: Any = run.formulation
    motion = motion or _Motion(run)
    system = motion.system
    n, m, count = system.size, system.constraints, len(differences)
    result = np.empty((len(motion.t), count, 3 * n + m))
    state = np.zeros((count, 4, n))
    state[:, :2] = start_changes(run, differences, *motion.state(0))
    use = Formulas.of(Rules(run.scene.record.simulation.spectral_radius, 0.0), 1.0)
    rule = np.array([use.beta, use.gamma, use.share, use.pull, use.keep])
    known, scratch = Residuals(system), system.flat.scratch.copy()
    slopes = [slope_of(known, difference) for difference in differences]
    model = system.model
    exact = addresses(len(model.beam_nodes), len(model.actuator_nodes))
    memory = np.zeros(system.flat.factors), *room(system.count)
    chunk = max(1, _ROOM // (count * (n + m) + 1))
    for part in motion.walks:
        start = LegStart(base, part.leg.first, *motion.state(part.first), motion.a[part.first])
        for p, difference in enumerate(differences):
            begun = start.changed(difference, state[p, PLACE], state[p, RATE])
            state[p, ACCELERATION] = state[p, ALGORITHMIC] = begun[:n]
            result[part.first, p, : 2 * n] = state[p, :2].ravel()
            result[part.first, p, 2 * n :] = begun
        sizes = np.diff(motion.t[part.first : part.end])
        ratios = np.ones(len(sizes))
        ratios[1:] = sizes[1:] / sizes[:-1]
        ratios[np.abs(ratios - 1) <= SAME_STEP] = 1.0
        for first in range(part.first + 1, part.end, chunk):
            rows = slice(first, min(first + chunk, part.end))
            knots, own = motion.knots(part, rows), np.zeros(0)
            own = known.at(known.reals, knots)
            forces = np.stack([slope.at(known, knots, own) for slope in slopes], axis=1)
            before = motion.poses[first - 1 : rows.stop - 1]
            increments = motions.log(motions.inverse(before) @ motion.poses[rows]).reshape(-1, n)
            steps = slice(first - 1 - part.first, rows.stop - 1 - part.first)
            made = walk(
                exact,
                *(system.flat.reals, system.flat.integers, scratch),
                *memory,
                *(rule, sizes[steps], ratios[steps]),
                *(knots.samples, increments, knots.q, knots.v, knots.a),
                np.zeros((5, n + m + 2)),
                *(np.ascontiguousarray(forces), state, result[rows]),
            )
            if made < len(knots.q):
                raise _singular(float(knots.t[made]))
    return result


def _singular(t: float) -> SimulationError:
    return SimulationError(
        Cause.NEWTON_FAILED,
        f"a step has no derivative: {SINGULAR}",
        where=f"t = {t:.9g} s",
        remedy="look for a position in which a loop or a joint locks; smaller steps may pass it",
    )


def _kept(motion: _Motion, difference: Difference, change: Array, n: int) -> Array:
    """(k, 3, N) what changes (k, 3 n + m) of the nodes are of what a run keeps, as differences along them."""
    from erls.sensitivity.nodal_kernels import stored  # here: it is compiled

    system = motion.system
    place, rate, gain = (change[:, i * n : (i + 1) * n] for i in range(3))
    size = 12 * system.count + len(system.model.actuators)
    flat, scratch = system.flat, system.flat.scratch.copy()
    count = len(change)

    def at(reals: Array, share: Array) -> Array:
        out, along = np.empty((count, 3, size)), share[:, None]
        moved = motion.v + along * rate, motion.a[:, :n] + along * gain
        stored(reals, flat.integers, scratch, motion.q, along * place, *moved, out)
        return out

    step = shares_of(system, place, (motion.v, rate), (motion.a[:, :n], gain))
    frames = np.asarray(sum((weight / step)[:, None, None] * at(flat.reals, far * step) for far, weight in ALONG))
    models = [variant.formulation.system for variant in difference.variants]
    if not all(np.array_equal(own.model.actuator_frames, models[0].model.actuator_frames) for own in models):
        none = np.zeros(count)
        weights = [variant.weight for variant in difference.variants]
        of_joints = sum(w * at(own.flat.reals, none) for w, own in zip(weights, models, strict=True))
        frames[..., 12 * system.count :] += np.asarray(of_joints)[..., 12 * system.count :]
    found = [change[:, 2 * n :]]
    for _ in range(2):
        found.append(slopes_in_time(motion.t, found[-1]))
    return np.concatenate([frames, np.stack(found, axis=1)], axis=2)


def metres_of(base: Any) -> Array:
    """(N,) metres per unit of what a nodal run keeps of places; 0 of what goes with accelerations."""
    system = base.system
    result = np.zeros(base.size)
    frames = result[: 12 * system.count].reshape(-1, 12)
    frames[:, :3] = 1.0
    frames[:, 3:] = base.mechanism.reach
    result[12 * system.count : 12 * system.count + len(system.model.actuators)] = base.mechanism.reach
    return result

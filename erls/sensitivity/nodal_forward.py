"""Direct differentiation of nodal runs: small changes of nodes along the steps of Lie-group generalized-α.

The formulas are in `erls.sensitivity.nodal_kernels`. Tangents are exact (`erls.equations.nodal.tangents`), and one
factored band a step serves all parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from erls.errors import Cause, SimulationError
from erls.integrate.alpha_rules import SINGULAR
from erls.integrate.nodal_chain import slopes_in_time
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.nodal_forces import Residuals, slope_of
from erls.sensitivity.nodal_motion import Motion, ratios_of, rule_of, walks_of
from erls.sensitivity.nodal_start import LegStart, shares_of, start_changes
from erls.sensitivity.outputs import ALONG
from erls.sensitivity.variants import Difference
from fe_import.model import IntArray

_ROOM = 4_000_000
"""Numbers of slopes of forces that are held at a time."""


def differentiated(
    run: ChainRun, differences: Sequence[Difference], rows: IntArray | slice = slice(None)
) -> Array:
    """(k, 3, N, p) derivatives of what a nodal run keeps of its knots, with rates and accelerations, by p parameters.

    Parameters
    ----------
    run : ChainRun
        Of the formulation ``nodal``.
    differences : sequence of Difference
    rows : array or slice, optional
        Numbers of the knots.

    Raises
    ------
    SimulationError
        The linearized equations of a step are singular; tells when.
    """
    motion = Motion(run)
    changes = changes_of(run, differences, motion)
    n = motion.system.size
    found = [_kept(motion, difference, changes[:, p], n, rows) for p, difference in enumerate(differences)]
    return np.stack(found, axis=3)


def changes_of(run: ChainRun, differences: Sequence[Difference], motion: Motion | None = None) -> Array:
    """(k, p, 3 n + m) of places, in the axes of the nodes, of twists, their rates and multipliers at all knots."""
    from erls.equations.nodal.tangents import addresses, room  # here: they are compiled
    from erls.sensitivity.nodal_kernels import ACCELERATION, ALGORITHMIC, PLACE, RATE, walk

    base: Any = run.formulation
    motion = motion or Motion(run)
    system = motion.system
    n, m, count = system.size, system.constraints, len(differences)
    result = np.empty((len(motion.t), count, 3 * n + m))
    state = np.zeros((count, 4, n))
    state[:, :2] = start_changes(run, differences, *motion.state(0))
    rule = rule_of(run)
    known, scratch = Residuals(system), system.flat.scratch.copy()
    slopes = [slope_of(known, difference) for difference in differences]
    model = system.model
    exact = addresses(len(model.beam_nodes), len(model.actuator_nodes))
    memory = np.zeros(system.flat.factors), *room(system.count)
    chunk = max(1, _ROOM // (count * (n + m) + 1))
    for part in walks_of(run):
        start = LegStart(base, part.leg.first, *motion.state(part.first), motion.a[part.first])
        for p, difference in enumerate(differences):
            begun = start.changed(difference, state[p, PLACE], state[p, RATE])
            state[p, ACCELERATION] = state[p, ALGORITHMIC] = begun[:n]
            result[part.first, p, : 2 * n] = state[p, :2].ravel()
            result[part.first, p, 2 * n :] = begun
        sizes = np.diff(motion.t[part.first : part.end])
        ratios = ratios_of(sizes)
        for first in range(part.first + 1, part.end, chunk):
            rows = slice(first, min(first + chunk, part.end))
            knots, own = motion.knots(part, rows), np.zeros(0)
            own = known.at(known.reals, knots)
            forces = np.stack([slope.at(known, knots, own) for slope in slopes], axis=1)
            increments = motion.increments(rows)
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
                raise singular(float(knots.t[made]))
    return result


def singular(t: float) -> SimulationError:
    """Why a step has no derivative."""
    return SimulationError(
        Cause.NEWTON_FAILED,
        f"a step has no derivative: {SINGULAR}",
        where=f"t = {t:.9g} s",
        remedy="look for a position in which a loop or a joint locks; smaller steps may pass it",
    )


def _kept(motion: Motion, difference: Difference, change: Array, n: int, rows: IntArray | slice) -> Array:
    """(k, 3, N) what changes (knots, 3 n + m) of the nodes are of what a run keeps of some knots, as differences along
    them.
    """
    from erls.sensitivity.nodal_kernels import stored  # here: it is compiled

    system = motion.system
    place, rate, gain = (np.ascontiguousarray(change[rows, i * n : (i + 1) * n]) for i in range(3))
    q, v, a = motion.q[rows], motion.v[rows], motion.a[rows, :n]
    size = 12 * system.count + len(system.model.actuators)
    flat, scratch = system.flat, system.flat.scratch.copy()
    count = len(place)

    def at(reals: Array, share: Array) -> Array:
        out, along = np.empty((count, 3, size)), share[:, None]
        stored(reals, flat.integers, scratch, q, along * place, v + along * rate, a + along * gain, out)
        return out

    step = shares_of(system, place, (v, rate), (a, gain))
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
    return np.concatenate([frames, np.stack([one[rows] for one in found], axis=1)], axis=2)

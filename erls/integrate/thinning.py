"""Which of many knots a run keeps: states at equal distances in time, each interpolated within the step it lies in."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from erls.integrate.base import hermite_knots
from erls.maths.so3 import Array
from erls.scene.settings import Simulation

FEWEST = 200
"""Stretches of a run, at the least, at whose ends states are stored: what looks along a run needs as many."""

_HAIR = 1e-9  # of the distance: a knot this near to an output time stands for it


def output_step(settings: Simulation) -> float | None:
    """Distance of the states that a run stores [s]: that of the scene, or a part of it that makes them enough."""
    if settings.output_step is None:
        return None
    longest = min(settings.output_step, settings.duration)
    return longest / max(1, math.ceil(FEWEST * longest / settings.duration * (1 - 1e-9)))


def thinned(
    t: Array, rows: Array, size: int, start: float, apart: float, whole: Sequence[float] = ()
) -> tuple[Array, Array]:
    """What to keep of adjacent knots.

    Parameters
    ----------
    t : (k,) array
        Times in rising order [s].
    rows : (k, 3 size + m) array
        y, v, a of each knot, and what is kept beside them, which is interpolated linearly.
    size : int
        Number of coordinates.
    start, apart : float
        Output times are ``start`` and every ``apart`` from there on [s].
    whole : sequence of float
        Times whose knots on either side are kept as they are.

    Returns
    -------
    t, rows : (j,) and (j, 3 size + m) arrays
        States at the output times after the first knot, up to the last one; of steps that hold several of them both
        ends, which say as much. Together with what was kept before, the ends may stand there already: the first knot is
        among them only where its step is kept whole.
    """
    hair = max(_HAIR, 4 * float(np.spacing(np.abs(t).max())) / apart)
    with np.errstate(over="ignore", invalid="ignore"):  # the smallest distances put an output time everywhere
        cells = np.floor((t - start) / apart + hair)
        passed = np.diff(cells)
    long = ~(passed <= 1)
    kept = np.zeros(len(t), dtype=bool)
    kept[1:] |= long
    kept[:-1] |= long
    for time in whole:
        end = int(np.clip(np.searchsorted(t, time), 1, len(t) - 1))
        kept[end - 1 : end + 1] = True
    right = np.flatnonzero(passed == 1) + 1
    at = start + cells[right] * apart
    met = np.abs(t[right] - at) <= hair * apart
    kept[right[met]] = True
    at = at[~met]
    if not len(at):
        return t[kept], rows[kept]
    y, v, a = (rows[:, k * size : (k + 1) * size] for k in range(3))
    found = hermite_knots(t, y, v, a, at)
    left = right[~met] - 1
    share = ((at - t[left]) / (t[left + 1] - t[left]))[:, None]
    beside = (1 - share) * rows[left, 3 * size :] + share * rows[left + 1, 3 * size :]
    times = np.concatenate([t[kept], at])
    order = np.argsort(times, kind="stable")
    return times[order], np.concatenate([rows[kept], np.hstack([*found, beside])])[order]

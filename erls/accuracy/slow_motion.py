"""The slow part of a motion, and the vibration about it.

Averages of rates and accelerations over a stretch of time follow from the places alone, ∫ w ÿ dt = ∫ ẅ y dt for a
window w that ends smoothly: accelerations of vibrations, which are large where they are fast, drop out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.accuracy.compared_links import Compared, Motion, embedded, in_joint_angles, states_of
from erls.equations.formulation import Formulation
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.integrate.base import Solution, hermite_knots
from erls.maths.full_turns import nearest
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun

_WINDOWS, _MOST_WINDOWS, _PER_WINDOW = 24, 384, 12  # windows overlap by half; instants in a half
_FEW_WINDOWS, _FEW = 12, 6  # the same where an instant costs more
_PER_RADIAN = 10  # windows, of the way of the joint that goes farthest


@dataclass(frozen=True)
class Parted:
    """A motion in two parts.

    Attributes
    ----------
    slow : Motion
        Averages over windows.
    start : Motion
        The first instant, without accelerations.
    t : (k,) array
        Instants [s].
    y, v : (k, n) arrays
        Coordinates that were run and their rates.
    vibration : three (k, n) arrays
        What the motion, its rates and its accelerations differ by from the slow part.
    """

    slow: Motion
    start: Motion
    t: Array
    y: Array
    v: Array
    vibration: tuple[Array, Array, Array]


def parted(run: ChainRun, moving: Formulation, compared: Compared) -> Parted | None:
    """The two parts of the motion of a run; None of one too short to tell them apart.

    Parameters
    ----------
    run : ChainRun
    moving : Formulation
        What was integrated.
    compared : Compared
    """
    few = isinstance(moving, QuasiStatic) or not in_joint_angles(run)
    s = run.solution
    windows, per = (_FEW_WINDOWS, _FEW) if few else (_windows(s, compared.free), _PER_WINDOW)
    if not s.t[-1] > s.t[0]:
        return None
    t = np.linspace(float(s.t[0]), run.end, per * (windows + 1) + 1)
    if not in_joint_angles(run):
        t, (y, v, a) = states_of(run, moving, compared, t)
    elif isinstance(moving, QuasiStatic):
        y, v, a = _with_static_modes(moving, t, hermite_knots(s.t, s.y, s.v, s.a, t))
    else:
        y, v, a = hermite_knots(s.t, s.y, s.v, s.a, t)
    vectors = compared.whole.mechanism.rotation_vector_places
    middles, means = averages(t, y, per, vectors)
    vibration = _vibration(t, (y, v, a), middles, means, vectors)
    slow, start = embedded(compared, middles, means), embedded(compared, t[:1], [y[:1], v[:1], 0 * a[:1]])
    return Parted(slow, start, t, y, v, (vibration[0], vibration[1], vibration[2]))


def averages(t: Array, y: Array, per: int, vectors: Sequence[int] = ()) -> tuple[Array, list[Array]]:
    """Middles (w,) of windows, and averages of places, rates and accelerations over them, (w, n) each.

    Rotation vectors, which a motion may exchange for others, are in each window like that of its middle.

    Parameters
    ----------
    t : (k,) array
        Even instants [s]; k - 1 is a multiple of ``per``.
    y : (k, n) array
        Places.
    per : int
        Instants in half a window.
    vectors : sequence of int
        Places of the first component of each rotation vector among the coordinates.
    """
    x = np.arange(-per, per + 1) / per
    weight = (1 - x**2) ** 3
    weight = np.pad(weight / weight.sum(), 1)
    step = float(t[1] - t[0])
    rate, twice = -np.gradient(weight, step)[1:-1], np.diff(weight, 2) / step**2
    spans = per * np.arange((len(t) - 1) // per - 1)[:, None] + np.arange(2 * per + 1)
    values = y[spans]
    for k in vectors:
        own = values[..., k : k + 3]
        for i in range(per):
            own[:, per + i + 1] = nearest(own[:, per + i + 1], own[:, per + i])
            own[:, per - i - 1] = nearest(own[:, per - i - 1], own[:, per - i])
    return t[spans[:, per]], [np.einsum("k,wkn->wn", own, values) for own in (weight[1:-1], rate, twice)]


def _windows(s: Solution, joints: int) -> int:
    """As many as the way of the joints asks for."""
    way = np.abs(np.diff(s.y[:, :joints], axis=0)).sum(axis=0).max(initial=0.0)
    return int(np.clip(_PER_RADIAN * way, _WINDOWS, _MOST_WINDOWS))


def _with_static_modes(moving: QuasiStatic, t: Array, states: tuple[Array, Array, Array]) -> list[Array]:
    every = [moving.all_modes(*at) for at in zip(t.tolist(), *states, strict=True)]
    return [np.array(part).reshape(len(t), -1) for part in zip(*every, strict=True)]


def _vibration(
    t: Array, states: Sequence[Array], middles: Array, means: Sequence[Array], vectors: Sequence[int]
) -> list[Array]:
    """(k, n) each: what a motion differs by from means of windows, linear in between and beyond. Of rotation vectors
    places alone tell it: rates of others are other ones.
    """
    left = (np.searchsorted(middles, t) - 1).clip(0, len(middles) - 2)
    share = ((t - middles[left]) / (middles[left + 1] - middles[left]))[:, None]
    result = []
    for order, (row, mean) in enumerate(zip(states, means, strict=True)):
        before, after = mean[left], mean[left + 1]
        for k in vectors if not order else ():
            after[:, k : k + 3] = nearest(after[:, k : k + 3], before[:, k : k + 3])
        between = before + share * (after - before)
        for k in vectors if not order else ():
            between[:, k : k + 3] = nearest(between[:, k : k + 3], row[:, k : k + 3])
        result.append(np.asarray(row - between))
    return result

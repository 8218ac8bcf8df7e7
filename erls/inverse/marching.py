"""Internal motion step by step, by the trapezoidal rule of `erls.inverse.two_point`: plain integration forward, and
multiple shooting, which integrates stretches beside each other and closes the gaps between them (O. Brüls, G. Bastos,
R. Seifried, J. Comput. Nonlinear Dyn. 9 (2014) 011014).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from erls.errors import Cause, SimulationError
from erls.inverse.internal import Internal
from erls.inverse.servoed import States
from erls.inverse.two_point import Ends, Solved, Sweep
from erls.maths.so3 import Array
from fe_import.model import IntArray

_ITERATIONS = 25
_TOLERANCE = 1e-12  # of the scales: change that ends the iterations of a step
_SLOW = 0.1  # ratio of changes beyond which tangents are made anew
_SHOTS = 25
_GROWTH = 30.0  # over a stretch: beyond it, errors of nodes carry stretches out of what is nearly linear
_LONGEST = 20  # steps of a stretch: those beside each other are taken together, long ones one by one
_AWAY = 10.0  # of a link: displacement at which nothing is left to integrate


class _Stepped(NamedTuple):
    """States (s, d) after a step, their slopes, and the derivatives (s, d, d) of the former by those before it."""

    x: Array
    slopes: Array
    by: Array


def _begun(part: Internal, x: Array) -> tuple[Array, Array]:
    """Slopes (s, d) and tangents (s, d, d) at states, with what belongs to their knots alone."""
    still = np.zeros_like(x)
    before = math.inf
    for _ in range(_ITERATIONS):
        part.look(x)
        part.learn(np.arange(len(x)))
        far = part.move(still)
        if far <= _TOLERANCE or far >= before:
            break
        before = far
    part.look(x)
    return part.slopes(x), part.tangents()


def _stepped(
    part: Internal, h: float, before: Array, slopes: Array, tangents: Array, guess: Array, scales: Array
) -> _Stepped:
    """One step of all stretches to the knots of ``part``.

    Raises
    ------
    SimulationError
        NEWTON_FAILED; OUT_OF_REACH, SINGULAR_SERVO.
    """
    unit = np.eye(before.shape[1])
    x: Array = guess
    far, fresh = math.inf, False
    for _ in range(_ITERATIONS):
        part.look(x)
        if not fresh:
            part.learn(np.arange(len(x)))
            fresh = True
        own, now = part.tangents(), part.slopes(x)
        open_ = x - before - h / 2 * (slopes + now)
        step = np.asarray(-np.linalg.solve(unit - h / 2 * own, open_[..., None])[..., 0], dtype=float)
        last, far = far, max(float(np.abs(step / scales).max(initial=0.0)), part.move(step))
        x = np.asarray(x + step)
        if not np.isfinite(far):
            break
        if far <= _TOLERANCE * max(1.0, float(np.abs(x / scales).max(initial=0.0))):
            part.look(x)
            part.learn(np.arange(len(x)))
            own = part.tangents()
            by = np.asarray(np.linalg.solve(unit - h / 2 * own, unit + h / 2 * tangents), dtype=float)
            return _Stepped(x, part.slopes(x), by)
        fresh = far <= _SLOW * last
    raise SimulationError(
        Cause.NEWTON_FAILED,
        "a step of the internal motion does not converge",
        where=f"t = {float(part.demand.t.max()):.6g} s",
        value=f"change {far:.3g} of its scale",
        limit=f"{_TOLERANCE:g}",
        remedy="take a smaller step (simulation.step), or --method collocation",
    )


def march(internal: Internal, scales: Array) -> tuple[States, int, str]:
    """Integrate forward from rest, as far as it goes.

    Returns
    -------
    States
        Up to where it came.
    int
        Steps.
    str
        Why no farther; empty at the end.
    """
    t, reason, done = internal.demand.t, "", 0
    part = internal.part(np.arange(1))
    x = np.zeros((1, internal.size))
    for _ in range(_ITERATIONS):
        slopes, tangents = _begun(part, x)
        change = np.linalg.solve(tangents, -slopes[..., None])[..., 0]
        x = x + change
        if np.abs(change / scales).max(initial=0.0) <= _TOLERANCE:
            break
    slopes, tangents = _begun(part, x)
    internal.put(np.arange(1), part)
    for k in range(1, len(t)):
        following = internal.part(np.array([k]), part)
        try:
            h = float(t[k] - t[k - 1])
            x, slopes, _ = _stepped(following, h, x, slopes, tangents, x + h * slopes, scales)
        except (SimulationError, np.linalg.LinAlgError) as problem:
            reason = str(getattr(problem, "message", problem))
            break
        tangents = following.tangents()
        if following.deflection() > _AWAY * internal.servoed.size:
            reason = "internal motions have left every meaning"
            break
        internal.put(np.array([k]), following)
        part, done = following, k
    states = States(*(part[: done + 1] for part in internal.states))
    return states, done, f"diverges at t = {float(t[done]):.4g} s: {reason}" if reason else ""


class _Flight(NamedTuple):
    """All stretches, integrated from their nodes.

    Attributes
    ----------
    x : (k, d) array
        At the knots.
    ends : (s, d) array
        Where stretches end.
    by : (s, d, d) array
        Derivatives of these by the nodes.
    slopes, tangents : (2, d), (2, d, d) arrays
        At the start and at the end of all.
    """

    x: Array
    ends: Array
    by: Array
    slopes: Array
    tangents: Array


def shoot(
    internal: Internal,
    t: Array,
    x: Array,
    ends: Callable[[Array, Array], Ends],
    scales: Array,
    tolerance: float,
    told: Callable[[int, float], None] = lambda iteration, change: None,
) -> tuple[Solved, Ends]:
    """As `erls.inverse.two_point.collocate`, by multiple shooting between evenly spaced knots."""
    h, last = float(t[1] - t[0]), len(t) - 1
    internal.look(x)
    internal.learn(np.array([0, last]))
    made = internal.tangents()
    conditions = ends(made[0], made[-1])
    starts = np.arange(0, last, _stretch(made[0], h, last))
    nodes = x[[*starts, last]]
    for iteration in range(1, _SHOTS + 1):
        flight = _flown(internal, h, nodes, x, starts, scales)
        step = _closing(flight, nodes, conditions, scales)
        worst = float(np.abs(step / scales).max(initial=0.0))
        told(iteration, worst)
        nodes, x = nodes + step, flight.x
        if worst <= tolerance:
            internal.look(flight.x)
            return Solved(flight.x, iteration), conditions
        if not np.isfinite(worst):
            break
    raise SimulationError(
        Cause.NEWTON_FAILED,
        "multiple shooting does not close its gaps",
        where="method = 'shooting'",
        value=f"change {worst:.3g} of its scale",
        limit=f"{tolerance:.3g}",
        remedy="use --method collocation, or demand a slower motion",
    )


def _stretch(tangent: Array, h: float, most: int) -> int:
    """Steps within which nothing grows by more than `_GROWTH`."""
    half = h / 2 * np.linalg.eigvals(tangent)
    growth = float(np.abs((1 + half) / np.where(half == 1, np.inf, 1 - half)).max(initial=1.0))
    return int(min(max(math.log(_GROWTH) / math.log(max(growth, 1 + 1e-12)), 1.0), most, _LONGEST))


def _flown(internal: Internal, h: float, nodes: Array, guess: Array, starts: IntArray, scales: Array) -> _Flight:
    last, d = len(internal.demand.t) - 1, nodes.shape[1]
    path, ends = np.empty((last + 1, d)), np.empty((len(starts), d))
    by = np.tile(np.eye(d), (len(starts), 1, 1))
    x, part = nodes[:-1], internal.part(starts)
    slopes, tangents = _begun(part, x)
    internal.put(starts, part)
    path[starts] = x
    begin, rows = (slopes[0], tangents[0]), starts
    for k in range(1, int(np.diff([*starts, last]).max()) + 1):
        rows = (starts + k)[: len(rows)]
        rows = rows[rows <= np.r_[starts[1:], last][: len(rows)]]
        count = len(rows)
        part = internal.part(rows)
        found = _stepped(part, h, x[:count], slopes[:count], tangents[:count], guess[rows], scales)
        x, slopes, tangents = found.x, found.slopes, part.tangents()
        by[:count] = found.by @ by[:count]
        ends[:count] = path[rows] = x
        internal.put(rows, part)
        if rows[-1] == last:
            finish = slopes[-1], tangents[-1]
    pairs = zip(begin, finish, strict=True)
    return _Flight(path, ends, by, *(np.stack(pair) for pair in pairs))


def _closing(flight: _Flight, nodes: Array, ends: Ends, scales: Array) -> Array:
    """(s + 1, d) changes of the nodes by which stretches meet."""
    sweep = Sweep(ends.start @ flight.tangents[0] * scales, -ends.start @ flight.slopes[0])
    unit = np.eye(nodes.shape[1])
    for by, gap in zip(flight.by * scales / scales[:, None], (flight.ends - nodes[1:]) / scales, strict=True):
        sweep.step(-by, unit, gap)
    slopes = flight.slopes[1] + flight.tangents[1] @ (nodes[-1] - flight.ends[-1])
    return sweep.back(ends.end @ flight.tangents[1] * scales, -ends.end @ slopes) * scales

"""How far off a link is that bends: what the orders of displacement beyond those of its model would do.

A link whose coordinates move it linearly lacks the second order u₂ of its displacement and the third; one with
second-order kinematics (u = Φq + ½ qᵀΨq) lacks the third, u₃ (`erls.run.deflection.orders`). What is left out does
three things, judged from the computed motion alone; no second-order data of the link are asked for.

- Points are elsewhere, by uₙ, and what stands on the link turns by θₙ.
- Loads F, those of inertia and weight included, do work on it. With W = Σ F·uₙ the stiffness in the shape that the link
  has changes relatively by

      r₂ = -2 W₂ / qᵀΩ²q,    r₃ = -(3 W₃ + 2 V) / qᵀΩ²q,

  q without what only stretches the link. V = Σ m a·u₂ is the work of the accelerations a that displacements get from
  the turning of the link, which second-order kinematics counts to lower order. A deflection δ is then wrong by δ |r|.
- Vibrations run ahead or behind by the time τ = ½ ∫ r dt, so that a point that they move at the rate δ̇ is off by
  |δ̇| |τ|. For r stands the mean so far, of work against energy. Both together are at most 2 max δ.
- Round a loop, what one of its links is off moves all of them, by levers that the linkage has: counted twice.
- A free joint carries on: the links that it bears swing with another lever, so that the path s that a point has gone is
  wrong by ½ ∫ |uₙ| / ℓ ds, ℓ being its distance from the joint.

Where the joint is free, δ, δ̇ and uₙ count against the frame that turns about it so that they carry no momentum: that of
the inboard interface would rock with every vibration. The parts add up in time; the largest sum is the error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from erls.maths.so3 import Array, cross_all
from erls.run.deflection.motion import Bending, BendingRun, Watched, freed
from erls.run.deflection.orders import Orders, orders

_SMALL = 1e-3  # of the largest strain energy: r means nothing below it
_ROUND_LOOPS = 2.0  # lever of a linkage: four-bar, five-bar and slider-crank of data/ lie between 1 and 3
_NEARBY = 7  # samples, odd
_UNSURE = 0.1  # of what second order does: how far second-order data of a link that is not made of beams may be off


@dataclass(frozen=True)
class LeftOut:
    """Orders that the model of a link leaves out.

    Attributes
    ----------
    loads : bool
        Whether loads do no work on second-order displacements.
    places : bool
        Whether points are not moved by them.
    turns : bool
        Whether links beyond are turned to first order alone.
    """

    loads: bool
    places: bool
    turns: bool


@dataclass(frozen=True)
class DeflectionError:
    """What the orders left out are estimated to make of a link's motion.

    Attributes
    ----------
    error : float
        Estimated error of the nodes that are judged [m].
    deflection : float
        Largest displacement of one of them by the bending of the link, levers of links beyond included [m].
    slope : float
        Largest rotation of a section of the link against its inboard interface [rad].
    shortening : float
        Largest displacement in the orders that points lack [m].
    load : float
        Largest change of stiffness by the orders that loads lack; 0.1 is 10 %.
    drift : float
        Largest phase by which vibrations run out of step [rad].
    second : bool
        Whether second order is left out, not third order alone.
    assumed : bool
        Whether it is assumed that the link bends as a beam between its interfaces.
    """

    error: float
    deflection: float
    slope: float
    shortening: float
    load: float
    drift: float
    second: bool
    assumed: bool


class LinkSeries(NamedTuple):
    """Error of one link at k times: at the nodes that stand on it or beyond, by their number among the watched ones,
    and, of a link within a loop, wherever its own interfaces are off.
    """

    told: DeflectionError
    at: dict[int, Array]
    loop: Array | None


class _Exit(NamedTuple):
    """A node as seen from a link: the station that carries it, and its arm from there (k, 3) in axes of the link."""

    station: int
    arm: Array
    watched: int | None


def link_series(run: BendingRun, number: int, left: LeftOut) -> LinkSeries | None:
    """Errors of a flexible link along a run; None where they mean nothing.

    Parameters
    ----------
    run : BendingRun
    number : int
        Of the link.
    left : LeftOut
    """
    bent, mechanism = run.links[number], run.mechanism
    found = orders(bent.lines, bent.turns)
    change, lag = changes(bent, found, left)
    swing = freed(mechanism, number) and not bent.floating
    relieve = _relief(bent, mechanism.joints[number].screw) if swing else None
    ends = {end.link for loop in mechanism.loops for end in (loop.inner, loop.outer)}
    closed = not ends.isdisjoint(mechanism.carried(number))
    share = 1.0 if left.places or left.loads else 0.0
    if not share and not bent.lines.beams:
        share = _UNSURE
    fields = [
        _relieved(part, relieve)
        for part in (
            (bent.moved, bent.turns),
            (bent.rates, bent.turn_rates),
            (share * found.second, share * found.second_turn),
            (found.third, found.third_turn),
        )
    ]
    lever = _ROUND_LOOPS if closed else 1.0
    at: dict[int, Array] = {}
    loop: Array | None = None
    sizes = np.zeros(3)
    phase = 0.0
    for exit_ in _exits(run, number, closed):
        moved, rate, second, third = (_at(field, exit_) for field in fields)
        turn = np.linalg.norm(bent.turns[:, exit_.station], axis=1)
        reach = np.linalg.norm(exit_.arm, axis=1)
        beyond = second + third + (reach * turn**2 / 2 if left.turns else 0.0)
        wrong = _peaks(moved * change) + _peaks(_peaks(rate) * lag)
        error = lever * (_peaks(beyond) + np.minimum(wrong, 2 * moved.max()))
        if swing:
            error = error + _swing(bent, run.watched, exit_, beyond)
        sizes = np.maximum(sizes, [error.max(), moved.max(), beyond.max()])
        phase = max(phase, float((rate * lag).max() / max(float(moved.max()), 1e-300)))
        if exit_.watched is None:
            loop = error if loop is None else np.maximum(loop, error)
        else:
            at[exit_.watched] = error
    if not np.isfinite(sizes).all():
        return None
    told = DeflectionError(
        float(sizes[0]),
        float(sizes[1]),
        float(np.linalg.norm(bent.turns, axis=2).max()),
        float(sizes[2]),
        float(change.max()),
        phase,
        left.loads or left.places,
        not bent.lines.beams,
    )
    return LinkSeries(told, at, loop)


def changes(bent: Bending, found: Orders, left: LeftOut) -> tuple[Array, Array]:
    """(k,) |r|, and (k,) |τ| [s]: relative change of stiffness, and time by which vibrations are early or late."""

    def work(displacement: Array, turn: Array) -> Array:
        return np.asarray((bent.forces * displacement + bent.moments * turn).sum(axis=(1, 2)))

    second = 1.0 if left.loads else 0.0 if bent.lines.beams else _UNSURE
    dragged = (bent.masses[:, None] * bent.dragged * found.second).sum(axis=(1, 2))
    parts = [
        2 * second * work(found.second, found.second_turn),
        3 * work(found.third, found.third_turn),
        2 * dragged,
    ]
    strain = bent.strain
    floor = np.maximum(strain, _SMALL * strain.max() + 1e-300)
    stored = np.maximum(_integral(strain, bent.times), 1e-300)
    gone = bent.times - bent.times[0]
    change = sum(np.abs(part) / floor for part in parts)
    lag = sum(np.abs(_integral(part, bent.times)) / stored for part in parts) * gone / 2
    return np.asarray(change), np.asarray(lag)


def _integral(values: Array, times: Array) -> Array:
    """(k,) from the first time to each."""
    return np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(times))])


def _peaks(values: Array) -> Array:
    """(k,) the largest values nearby: what vibrates is seen at any phase."""
    around = np.pad(values, _NEARBY // 2, mode="edge")
    return np.asarray(sliding_window_view(around, _NEARBY).max(axis=1))


def _exits(run: BendingRun, number: int, closed: bool) -> list[_Exit]:
    """Nodes that a link moves; of a link within a loop its own stations too, since what they do goes round the loop."""
    bent, mechanism = run.links[number], run.mechanism
    carried, result = mechanism.carried(number), list[_Exit]()
    none = np.zeros((len(bent.times), 3))
    for place, watched in enumerate(run.watched):
        if watched.link == number:
            result.append(_Exit(bent.lines.nodes[watched.node], none, place))
        elif watched.link in carried:
            branch = watched.link
            while mechanism.joints[branch].parent != number:
                branch = mechanism.joints[branch].parent
            seat = mechanism.joints[branch].seat
            if seat is not None:
                station = bent.lines.nodes[seat.node]
                arm = watched.places - bent.places[:, station]
                result.append(_Exit(station, np.einsum("kji,kj->ki", bent.axes, arm), place))
    if closed:
        others = [bent.lines.nodes[i.node] for i in bent.link.model.interface_nodes if i.node != bent.link.inboard.node]
        result += [_Exit(station, none, None) for station in sorted(set(others))]
    return result


def _at(field: tuple[Array, Array], exit_: _Exit) -> Array:
    """(k,) size of a displacement field, turning included, where a node is."""
    moved, turned = field
    return np.asarray(np.linalg.norm(moved[:, exit_.station] + cross_all(turned[:, exit_.station], exit_.arm), axis=1))


class _Relief(NamedTuple):
    """How a free joint turns to take the momentum out of a field: its motion of the stations (s, 3), its axis (3,), and
    what of a field it answers to.
    """

    motion: Array
    axis: Array
    masses: Array
    carried: Sequence[tuple[int, float, Array | None, Array]]
    inertia: Array


def _relief(bent: Bending, screw: Array) -> _Relief:
    motion = screw[:3] + np.cross(screw[3:], bent.lines.places)
    inertia = np.full(len(bent.times), float((bent.masses * (motion**2).sum(axis=1)).sum()))
    carried = []
    for station, mass, centre, turns in bent.carried:
        moves = screw[:3] + np.cross(screw[3:], centre)
        inertia = inertia + mass * (moves**2).sum(axis=1)
        carried.append((station, mass, centre - bent.lines.places[station] if turns else None, moves))
    return _Relief(motion, screw[3:], bent.masses, carried, np.maximum(inertia, 1e-300))


def _relieved(field: tuple[Array, Array], relief: _Relief | None) -> tuple[Array, Array]:
    if relief is None:
        return field
    moved, turned = field
    momentum = np.einsum("s,si,ksi->k", relief.masses, relief.motion, moved)
    for station, mass, arm, moves in relief.carried:
        at = moved[:, station] if arm is None else moved[:, station] + cross_all(turned[:, station], arm)
        momentum = momentum + mass * (at * moves).sum(axis=1)
    back = (momentum / relief.inertia)[:, None, None]
    return moved - back * relief.motion, turned - back * relief.axis


def _swing(bent: Bending, watched: Sequence[Watched], exit_: _Exit, beyond: Array) -> Array:
    """(k,) what a free joint makes of a wrong lever on the way that a node goes."""
    if exit_.watched is None:
        return np.zeros_like(beyond)
    node = watched[exit_.watched]
    lever = float(np.linalg.norm(node.places - bent.places[:, 0], axis=1).max())
    return _integral(beyond * node.speeds, bent.times) / (2 * max(lever, 1e-300))


def together(run: BendingRun, found: dict[int, LinkSeries]) -> float:
    """Largest error of a watched node at any time, of all links together [m]."""
    largest = 0.0
    for place in range(len(run.watched)):
        parts = [series.at.get(place, series.loop) for series in found.values()]
        known = [part for part in parts if part is not None]
        if known:
            largest = max(largest, float(np.sum(known, axis=0).max()))
    return largest

"""Flexible links along a run: how they bend and what loads them, at some times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.serial.state_series import StateSeries
from erls.equations.substructures import solved
from erls.integrate.base import hermite
from erls.maths.so3 import Array, cross_all
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link, link_mass_properties, node_shape6
from erls.mechanism.loads import CENTRE
from erls.run.chain.loads import pull, pushes, wrenches
from erls.run.chain.run import ChainRun
from erls.run.deflection.lines import Lines, lines

_SAMPLES, _SAMPLES_OF_LOOPS = 61, 31  # forces of loops are found time by time
_TURNING = 1e-8  # of the most that a unit of energy turns stations: rounding
_STEP = 1e-5  # s, of central differences


class Carried(NamedTuple):
    """Links that stand on a station: their mass [kg], their centre of mass (k, 3) in the mesh frame of the link that
    bears them [m], and whether they turn with the station.
    """

    station: int
    mass: float
    centre: Array
    turns: bool


@dataclass(frozen=True)
class Bending:
    """A link at k times, in axes fixed to its inboard interface; to the mean of the link where ``floating``.

    Attributes
    ----------
    link : Link
    lines : Lines
    times : (k,) array
        [s]
    moved, turns : (k, s, 3) arrays
        Elastic displacement [m] and rotation of the stations, to first order.
    rates, turn_rates : (k, s, 3) arrays
        Their rates.
    dragged : (k, s, 3) array
        What the turning of the axes adds to accelerations of the stations because they are displaced [m/s²].
    forces, moments : (k, s, 3) arrays
        Of joints, loads, weight and inertia [N, N m].
    masses : (s,) array
        [kg]
    strain : (k,) array
        Twice the elastic energy that the turns of its stations take [J].
    axes : (k, 3, 3) array
        To the world.
    places : (k, s, 3) array
        In the world [m].
    carried : list of Carried
    floating : bool
    """

    link: Link
    lines: Lines
    times: Array
    moved: Array
    turns: Array
    rates: Array
    turn_rates: Array
    dragged: Array
    forces: Array
    moments: Array
    masses: Array
    strain: Array
    axes: Array
    places: Array
    carried: list[Carried]
    floating: bool


class Watched(NamedTuple):
    """A node that errors are told of: its link, its number, its places in the world (k, 3) and its speeds (k,)."""

    link: int
    node: int
    places: Array
    speeds: Array


@dataclass(frozen=True)
class BendingRun:
    """What a run holds of its flexible links, by their numbers in ``mechanism``, and of the nodes to judge."""

    mechanism: Mechanism
    links: dict[int, Bending]
    watched: list[Watched]


class _Differences(NamedTuple):
    """What accelerations are found with: step of differences [s], gravity and other forces per mass (k, 3)."""

    step: float
    gravity: Array


class _Sums(NamedTuple):
    """Of what a joint carries, at k times, in the world: force, moment about the origin, mass, first moment of mass."""

    force: Array
    moment: Array
    mass: float
    place: Array


class _Seat(NamedTuple):
    """What a joint on a node carries, and whether it turns with the node."""

    node: int
    part: _Sums
    turns: bool


class _Given(NamedTuple):
    """Force (k, 3) of a closing joint or a load on a node of a link, and its moment (k, 3) about the origin; world."""

    link: int
    node: int
    force: Array
    moment: Array


def bending(run: ChainRun, nodes: Sequence[tuple[int, int]]) -> BendingRun:
    """Flexible links of a run with links of modes.

    Parameters
    ----------
    run : ChainRun
    nodes : sequence of (int, int)
        Link and node of the places to judge, in the mechanism that is solved: that of the pieces of split links.
    """
    formulation = solved(run.formulation)
    mechanism = formulation.mechanism
    step = min(_STEP, (run.end - float(run.solution.t[0])) / 4)
    times = run.looks(_SAMPLES_OF_LOOPS if isinstance(formulation, ClosedChain) else _SAMPLES, step)
    seen = replace(run, formulation=formulation).series(np.concatenate([times - step, times, times + step]))
    loads = _loop_loads(run, mechanism, times) + _given_loads(mechanism, seen, len(times))
    loads += _contact_loads(run, mechanism, seen, len(times))
    ends = {end.link for loop in mechanism.loops for end in (loop.inner, loop.outer)}
    sums: list[_Sums | None] = [None] * len(mechanism.links)
    found: dict[int, Bending] = {}
    for number in reversed(range(len(mechanism.links))):
        link = mechanism.links[number]
        differences = _Differences(step, pull(mechanism, number, seen)[len(times) : 2 * len(times)])
        beyond = [(mechanism.joints[k].seat, sums[k], not freed(mechanism, k)) for k in mechanism.standing_on(number)]
        seats = [_Seat(seat.node, part, turns) for seat, part, turns in beyond if seat is not None and part is not None]
        given = [load for load in loads if load.link == number]
        if link.elastic_modes:
            asked = [node for at, node in nodes if at == number] + [seat.node for seat in seats]
            asked += [load.node for load in given] + [payload.node for payload in link.payloads]
            asked += [interface.node for interface in link.model.interface_nodes]
            floating = not ends.isdisjoint(mechanism.carried(number)) and freed(mechanism, _whole(mechanism, number))
            held = link.once(("held lines", floating, *asked), partial(_held_lines, link, asked, floating))
            frames = seen.poses[number], seen.modal[number]
            found[number], sums[number] = _bent((link, held, floating), frames, times, differences, seats, given)
        else:
            sums[number] = _rigid(link, seen.poses[number], differences, seats, given)
    watched = [_watched(mechanism, seen, at, node, step) for at, node in nodes]
    return BendingRun(mechanism, found, watched)


def freed(mechanism: Mechanism, number: int) -> bool:
    """Whether nothing holds the joint of a link."""
    joint = mechanism.joints[number]
    return not joint.fixed and joint.drive.kind in ("free", "torque")


def _whole(mechanism: Mechanism, number: int) -> int:
    """The link that a link is joined to without any freedom, inward as far as that goes: the first piece of its own."""
    while mechanism.joints[number].fixed and mechanism.joints[number].parent >= 0:
        number = mechanism.joints[number].parent
    return number


class _HeldLines(NamedTuple):
    """Lines of a link, and per elastic coordinate, with the frame of `Bending` at rest: modal coordinates (m, e),
    displacements and rotations of the stations (s, 3, e), and what of the roots of strain energy turns stations (r, e).
    """

    lines: Lines
    modal: Array
    translation: Array
    rotation: Array
    turning: Array


def _held_lines(link: Link, asked: Sequence[int], floating: bool) -> _HeldLines:
    line = lines(link, asked)
    held = np.vstack([np.zeros((6, link.elastic_modes)), np.eye(link.elastic_modes)]) if floating else tangent(link)
    rotation = line.rotation @ held
    return _HeldLines(line, held, line.translation @ held, rotation, _turning(link, rotation))


def _bent(
    what: tuple[Link, _HeldLines, bool],
    motion: tuple[Array, Array],
    times: Array,
    differences: _Differences,
    seats: list[_Seat],
    given: list[_Given],
) -> tuple[Bending, _Sums]:
    (link, held, floating), (frames, q), (step, gravity) = what, motion, differences
    line = held.lines
    k, elastic = len(frames) // 3, q[:, 6:]
    here = slice(k, 2 * k)
    _, turn = node_shape6(link.model, link.inboard.node)
    frame_turn = (q - elastic @ held.modal.T) @ turn.T
    middle = frames[here, :3, :3]
    axes = middle + middle @ np.cross(np.eye(3), frame_turn[here, None])
    spin = _axial(middle, _rate(frames[:, :3, :3], step)) + _rate(frame_turn, step)
    alpha = _axial(middle, _acceleration(frames[:, :3, :3], step)) + _acceleration(frame_turn, step)
    rate = _rate(elastic, step)
    moved, rates = _shaped(elastic[here], held.translation), _shaped(rate, held.translation)
    places = _world(frames, line.places + _shaped(q, line.translation))
    masses = line.shares * link.model.full_mass_properties.mass
    for payload in link.payloads:
        masses[line.nodes[payload.node]] += payload.mass
    pulled = masses[:, None] * (gravity[:, None] - _acceleration(places, step))
    at = places[here]
    moments = np.zeros_like(pulled)
    force, moment = pulled.sum(axis=1), cross_all(at, pulled).sum(axis=1)
    mass, centre = float(masses.sum()), np.einsum("s,ksi->ki", masses, at)
    carried = []
    for node, part, turns in seats:
        station = line.nodes[node]
        pulled[:, station] += part.force
        moments[:, station] += part.moment - cross_all(at[:, station], part.force)
        force, moment = force + part.force, moment + part.moment
        if part.mass > 0:
            there = part.place / part.mass - frames[here, :3, 3]
            carried.append(Carried(station, part.mass, np.einsum("kji,kj->ki", axes, there), turns))
            mass, centre = mass + part.mass, centre + part.place
    for load in given:
        station = line.nodes[load.node]
        pulled[:, station] += load.force
        moments[:, station] += load.moment - cross_all(at[:, station], load.force)
        force, moment = force + load.force, moment + load.moment
    omega = spin[:, None]
    bent = Bending(
        link,
        line,
        times,
        moved,
        _shaped(elastic[here], held.rotation),
        rates,
        _shaped(rate, held.rotation),
        2 * cross_all(omega, rates) + cross_all(alpha[:, None], moved) + cross_all(omega, cross_all(omega, moved)),
        pulled @ axes,
        moments @ axes,
        masses,
        _bending_energy(link, held.turning, elastic[here]),
        axes,
        at,
        carried,
        floating,
    )
    return bent, _Sums(force, moment, mass, centre)


def _shaped(values: Array, shapes: Array) -> Array:
    """(k, s, 3) from coordinates (k, e) and shapes (s, 3, e)."""
    return np.asarray(np.tensordot(values, shapes, ([1], [2])))


def _turning(link: Link, rotation: Array) -> Array:
    """(r, e) orthonormal rows: what of √K q turns stations, whose rotations are (s, 3, e)."""
    turning = rotation.reshape(-1, link.elastic_modes) / np.sqrt(link.stiffness)
    _, sizes, rows = np.linalg.svd(turning, full_matrices=False)
    return np.asarray(rows[sizes > _TURNING * sizes.max(initial=0.0)])


def _bending_energy(link: Link, turning: Array, elastic: Array) -> Array:
    """(k,) twice the least elastic energy with the turns of the stations that elastic coordinates (k, e) make: that of
    a stretch, which no second order of displacements softens, is not in it.
    """
    return np.asarray(((elastic * np.sqrt(link.stiffness) @ turning.T) ** 2).sum(axis=1))


def _rigid(link: Link, frames: Array, differences: _Differences, seats: list[_Seat], given: list[_Given]) -> _Sums:
    step, gravity = differences
    k = len(frames) // 3
    force, moment, place, mass = np.zeros((k, 3)), np.zeros((k, 3)), np.zeros((k, 3)), 0.0
    if not link.intermediate:
        body = link_mass_properties(link)
        places = _world(frames, np.broadcast_to(body.centre_of_mass, (3 * k, 1, 3)))[:, 0]
        mass, place = float(body.mass), body.mass * places[k : 2 * k]
        force = body.mass * (gravity - _acceleration(places, step))
        middle = frames[k : 2 * k, :3, :3]
        alpha = _axial(middle, _acceleration(frames[:, :3, :3], step))
        moment = cross_all(places[k : 2 * k], force) - np.einsum("kij,kj->ki", middle, alpha @ body.inertia)
    for _, part, _ in seats:
        force, moment = force + part.force, moment + part.moment
        mass, place = mass + part.mass, place + part.place
    for load in given:
        force, moment = force + load.force, moment + load.moment
    return _Sums(force, moment, mass, place)


def tangent(link: Link) -> Array:
    """(m, n) modal coordinates per elastic one, with the inboard interface at rest."""
    rows = np.vstack(node_shape6(link.model, link.inboard.node))
    return np.vstack([-np.linalg.solve(rows[:, :6], rows[:, 6:]), np.eye(link.elastic_modes)])


def _rate(values: Array, step: float) -> Array:
    """Central difference of values at times less, at, and plus a step, one after the other."""
    before, _, after = np.split(values, 3)
    return np.asarray((after - before) / (2 * step))


def _acceleration(values: Array, step: float) -> Array:
    before, at, after = np.split(values, 3)
    return np.asarray((after - 2 * at + before) / step**2)


def _axial(turn: Array, change: Array) -> Array:
    """(k, 3) vector of the skew part of turnᵀ change, both (k, 3, 3)."""
    m = np.swapaxes(turn, 1, 2) @ change
    return np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1) / 2


def _world(frames: Array, local: Array) -> Array:
    """(k, s, 3) of places in frames (k, 4, 4)."""
    return np.asarray(local @ np.swapaxes(frames[:, :3, :3], 1, 2) + frames[:, None, :3, 3])


def _watched(mechanism: Mechanism, seen: StateSeries, link: int, node: int, step: float) -> Watched:
    """A node, to first order in its displacement."""
    model = mechanism.links[link].model
    local = model.nodes[node] + seen.modal[link] @ model.translation_shapes[node].T
    places = _world(seen.poses[link], local[:, None])[:, 0]
    return Watched(link, node, np.split(places, 3)[1], np.linalg.norm(_rate(places, step), axis=1))


def _loop_loads(run: ChainRun, mechanism: Mechanism, times: Array) -> list[_Given]:
    """What closing joints do to links."""
    formulation = solved(run.formulation)
    if not isinstance(formulation, ClosedChain):
        return []
    s = run.solution
    y_all, v_all = hermite(s.t, s.y, s.v, s.a, times)
    found = [formulation.loop_forces(*at) for at in zip(times.tolist(), y_all, v_all, strict=True)]
    result = []
    for number, loop in enumerate(mechanism.loops):
        force = np.array([every[number].force for every in found])
        place = np.array([every[number].place for every in found])
        moment = np.array([every[number].moment for every in found]) + cross_all(place, force)
        for end, sign in ((loop.outer, 1.0), (loop.inner, -1.0)):
            if end.link is not None:
                result.append(_Given(end.link, end.node, sign * force, sign * moment))
    return result


def _given_loads(mechanism: Mechanism, seen: StateSeries, k: int) -> list[_Given]:
    """Loads of the scene, at the k times in the middle of three rounds."""
    middle, result = slice(k, 2 * k), []
    for load in mechanism.loads:
        if load.node == CENTRE:
            continue
        found = wrenches(mechanism, load, seen)[middle]
        model = mechanism.links[load.link].model
        local = model.nodes[load.node] + seen.modal[load.link] @ model.translation_shapes[load.node].T
        at = _world(seen.poses[load.link], local[:, None])[middle, 0]
        result.append(_Given(load.link, load.node, found[:, 0], found[:, 1] + cross_all(at, found[:, 0])))
    return result


def _contact_loads(run: ChainRun, mechanism: Mechanism, seen: StateSeries, k: int) -> list[_Given]:
    """What contacts do to links, at the same times."""
    if not mechanism.contacts:
        return []
    s, middle = run.solution, slice(k, 2 * k)
    at = hermite(s.t, s.y, s.v, s.a, seen.times)
    found = solved(run.formulation).contact_series(seen.times, *at)
    return [
        _Given(link, node, force[middle], (moment + cross_all(place, force))[middle])
        for link, node, force, moment, place in pushes(mechanism, found, seen)
    ]

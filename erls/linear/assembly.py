"""A linear model put together: what plants, inputs and outputs give, in the coordinates that conditions leave.

With ξ = (z, s), s the places of the motions whose accelerations are inputs, displacements are x = W ξ, W = [N, P] of
`erls.equations.neighbours`, and everything that depends on (x, ẋ, ẍ) becomes rows times (ξ, ξ̇, ξ̈). What s and forces do
to the equations and to outputs themselves comes from the same state in changed equations, by differences: those by
rates, accelerations and forces are exact, since equations are quadratic in rates and linear in the others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from erls.equations.linearization import WIDE, slopes
from erls.equations.neighbours import (
    Moving,
    Neighbours,
    Split,
    States,
    kept,
    over_time,
    short_times,
    split,
    steps_along,
    tangents,
)
from erls.errors import Cause, SimulationError
from erls.linear.inputs import Input
from erls.linear.model import Channel, LinearModel
from erls.linear.outputs import Output
from erls.linear.plants import Plant
from erls.maths.so3 import Array

_WEIGHTS = ((1, 2 / 3), (-1, -2 / 3), (2, -1 / 12), (-2, 1 / 12))  # of differences of fourth order


def linear_model(
    plant: Plant, inputs: Sequence[Input], outputs: Sequence[Output], named: tuple[str, str], warnings: Sequence[str]
) -> LinearModel:
    """Of a plant at its state; ``named`` are the scene and the state.

    Raises
    ------
    SimulationError
        NOT_FINITE: the mechanism locks in this state, or its forces are beyond all numbers.
    """
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # of what is refused below
            model = _assembled(plant, inputs, outputs, named, warnings)
        matrices = model.mass, model.damping, model.stiffness, model.forces, model.seen, model.through
        fine = all(np.isfinite(matrix).all() for matrix in matrices)
    except np.linalg.LinAlgError:
        fine = False
    if not fine:
        message = "no small motions about this state: loops lock, or forces have no bounds"
        raise SimulationError(
            Cause.NOT_FINITE, message, where=f"{named[0]}, {named[1]}", remedy="choose another state"
        )
    return model


def _assembled(
    plant: Plant, inputs: Sequence[Input], outputs: Sequence[Output], named: tuple[str, str], warnings: Sequence[str]
) -> LinearModel:
    near, at = plant.near, _About.of(plant, inputs)
    ways = at.directions.now.shape[1] - int(at.moved.sum())
    found = tangents(near, at.directions)
    basis = at.directions.now[:, :ways]
    mass, damping, stiffness = (basis.T @ part for part in found)
    count = len(inputs)
    forces = np.zeros((3, ways, count))
    for k, given in enumerate(inputs):
        forces[:, :, k] = -_by_input(given, plant, _forces, given.kind.motion) @ basis
    for order, part in enumerate((stiffness, damping, mass)):
        forces[order][:, at.moved] -= part[:, ways:]
    seen, through = np.zeros((3, len(outputs), ways)), np.zeros((3, len(outputs), count))
    for group, look in ((True, _places), (False, _others)):
        own = [k for k, output in enumerate(outputs) if (output.kind.order is not None) == group]
        if own:
            rows, direct = look(at, [outputs[k] for k in own])
            seen[:, own], through[:, own] = rows[:, :, :ways], direct
            for k, column in enumerate(np.flatnonzero(at.moved), start=ways):
                through[:, own, column] += rows[:, :, k]
    return LinearModel(
        scene=named[0],
        at=named[1],
        time=near.time,
        inputs=tuple(Channel(x.name, x.unit) for x in inputs),
        outputs=tuple(Channel(x.name, x.unit) for x in outputs),
        mass=mass[:, :ways],
        damping=damping[:, :ways],
        stiffness=stiffness[:, :ways],
        ways=basis,
        coordinates=near.names,
        metres=near.metres,
        forces=forces,
        seen=seen,
        through=through,
        moved=at.moved,
        values=_values(at, outputs),
        steady=not (near.speed.any() or near.acceleration.any() or near.driven[1]),
        warnings=tuple(warnings),
    )


class _About(NamedTuple):
    """A plant with directions W; plants and W at short times along its motion."""

    plant: Plant
    inputs: Sequence[Input]
    moved: Array
    directions: Moving
    beside: tuple[tuple[Plant, Array], ...]
    times: tuple[float, ...]

    @classmethod
    def of(cls, plant: Plant, inputs: Sequence[Input]) -> _About:
        moved = np.array([given.kind.motion for given in inputs], dtype=bool)
        motions = [given for given in inputs if given.kind.motion]
        basis, times = split(plant.near), short_times(plant.near)
        now = _directions(plant, basis, motions)
        others = [plant.at(plant.near.later(tau)) for tau in times]
        beside = tuple((other, _directions(other, basis, motions)) for other in others)
        return cls(plant, inputs, moved, over_time(now, [w for _, w in beside], times), beside, times)


def _directions(plant: Plant, basis: Split, motions: Sequence[Input]) -> Array:
    """(n, f + s) W where conditions are those of a plant at its state."""
    rows = plant.near.rows()
    opened = np.zeros((len(rows), len(motions)))
    for k, given in enumerate(motions if len(rows) else ()):
        opened[:, k] = _by_place(given, plant, lambda other: other.near.violation())
    return kept(rows, basis, opened)


def _still(near: Neighbours) -> Array:
    return np.zeros((1, len(near.speed)))


def _forces(plant: Plant) -> Array:
    """(n,) out of balance."""
    still = _still(plant.near)
    return np.asarray(plant.near.forces(still, still, still)[0])


def _by_place(given: Input, plant: Plant, value: Callable[[Plant], Array]) -> Array:
    """Derivative by the place of a motion."""
    found = [weight * value(given.applied(plant, k * WIDE, 0.0, 0.0)) for k, weight in _WEIGHTS]
    return np.asarray(np.sum(found, axis=0) / WIDE)


def _by_input(given: Input, plant: Plant, value: Callable[[Plant], Array], motion: bool) -> Array:
    """(3, m) derivatives by place, rate, and by the input; of a force by the latter alone."""

    def change(rate: float, last: float) -> Array:
        ends = [value(given.applied(plant, 0.0, sign * rate, sign * last)) for sign in (1, -1)]
        return np.asarray((ends[0] - ends[1]) / 2)

    last = change(0.0, 1.0)
    if not motion:
        return np.array([0 * last, 0 * last, last])
    return np.array([_by_place(given, plant, value), change(1.0, 0.0), last])


def _look(plant: Plant, outputs: Sequence[Output], states: States) -> Array:
    """(k, p)"""
    sight = plant.seen(states)
    return np.array([output.value(sight) for output in outputs]).reshape(len(outputs), len(states.t)).T


def _by(plant: Plant, outputs: Sequence[Output], directions: Array, order: int) -> Array:
    """(p, c) derivatives along directions of displacements, rates or accelerations."""

    def look(moved: Array) -> Array:
        parts = [np.zeros_like(moved) for _ in range(3)]
        parts[order] = moved
        return _look(plant, outputs, plant.near.states(*parts))

    return slopes(look, directions, steps_along(plant.near, directions))


def _direct(at: _About, outputs: Sequence[Output], plant: Plant, places: bool) -> Array:
    """(3, p, r) what inputs do to outputs by themselves; of places by places alone."""

    def value(other: Plant) -> Array:
        still = _still(other.near)
        return np.asarray(_look(other, outputs, other.near.states(still, still, still))[0])

    result = np.zeros((3, len(outputs), len(at.inputs)))
    for k, given in enumerate(at.inputs):
        if not places:
            result[:, :, k] = _by_input(given, plant, value, given.kind.motion)
        elif given.kind.motion:
            result[0, :, k] = _by_place(given, plant, value)
    return result


def _places(at: _About, outputs: Sequence[Output]) -> tuple[Array, Array]:
    """Rows (3, p, f + s) and what inputs add (3, p, r), of outputs that are places, or differentiated as often as their
    order says.
    """

    def jacobian(plant: Plant, directions: Array) -> Array:
        own = _by(plant, outputs, directions, 0)
        own[:, own.shape[1] - int(at.moved.sum()) :] += _direct(at, outputs, plant, True)[0][:, at.moved]
        return own

    now = jacobian(at.plant, at.directions.now)
    beside = [jacobian(*other) for other in at.beside]
    moving = over_time(now, beside, at.times)
    rows = np.zeros((3, *now.shape))
    for k, output in enumerate(outputs):
        parts = ((moving.now,), (moving.rate, moving.now), (moving.second, 2 * moving.rate, moving.now))
        for order, part in enumerate(parts[output.kind.order or 0]):
            rows[order, k] = part[k]
    return rows, np.zeros((3, len(outputs), len(at.inputs)))


def _others(at: _About, outputs: Sequence[Output]) -> tuple[Array, Array]:
    """The same of other outputs."""
    plant, w = at.plant, at.directions
    by_place, by_rate, by_last = (_by(plant, outputs, w.now, order) for order in range(3))
    if at.times:
        by_place = by_place + _by(plant, outputs, w.rate, 1) + _by(plant, outputs, w.second, 2)
        by_rate = by_rate + 2 * _by(plant, outputs, w.rate, 2)
    return np.array([by_place, by_rate, by_last]), _direct(at, outputs, plant, False)


def _values(at: _About, outputs: Sequence[Output]) -> Array:
    """(p,) in the state; what is differentiated, along the motion."""
    result = np.zeros(len(outputs))

    def look(plant: Plant) -> Array:
        still = _still(plant.near)
        return np.asarray(_look(plant, outputs, plant.near.states(still, still, still))[0])

    now = look(at.plant)
    beside = [look(other) for other, _ in at.beside]
    moving = over_time(now, beside, at.times)
    for k, output in enumerate(outputs):
        result[k] = (moving.now, moving.rate, moving.second)[output.kind.order or 0][k]
    return result

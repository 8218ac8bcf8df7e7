"""How the mechanism moves at many times at once: states with their first and second derivatives in time.

Formulations whose equations hold the twists of link frames say them exactly (`MotionSeries` of a method of that name).
Of others, the state is looked at a little before and after, along the parabola y + h v + h² a / 2, by central
differences of fourth order: exact for what is quadratic in y, and to 1e-8 of accelerations for turns of 100 rad/s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.serial.state_series import StateSeries, state_series
from erls.maths.so3 import Array, cross_all

NUDGE = 2e-4
"""Of differences in time [s]: rounding leaves 3e-9 of a second derivative, of metres 3e-9 m/s²."""

_FIRST = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12 * NUDGE)
_SECOND = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12 * NUDGE**2)


@dataclass(frozen=True)
class Moving:
    """Values (k, ...) at k times, with their rates and accelerations."""

    place: Array
    rate: Array
    acceleration: Array


@dataclass(frozen=True)
class MotionSeries:
    """Motion at k times.

    Attributes
    ----------
    states : StateSeries
    twists, twist_rates : list of (k, 6) arrays
        Of each link frame [linear; angular], in its own axes, and the derivatives of these components.
    modal_rates, modal_accelerations : list of (k, m) arrays
        Of the modal coordinates of each link.
    angle_accelerations : (k, n) array
        Of the physical joint angles [rad/s² or m/s²].
    nodes, turns : list of Moving, or None
        Places (k, n, 3) and turns (k, n, 3, 3) of the nodes of each link's modal model in the world, where its
        coordinates only approximate them.
    """

    states: StateSeries
    twists: list[Array]
    twist_rates: list[Array]
    modal_rates: list[Array]
    modal_accelerations: list[Array]
    angle_accelerations: Array
    nodes: list[Moving] | None = None
    turns: list[Moving] | None = None


@runtime_checkable
class _MovesAtAll(Protocol):
    def motion_series(self, t: Array, y: Array, v: Array, a: Array) -> MotionSeries:
        """Motion at times (k,) with coordinates, rates and accelerations (k, n)."""


def motion_series(formulation: Formulation, t: Array, y: Array, v: Array, a: Array) -> MotionSeries:
    """Motion of a formulation at k times.

    Parameters
    ----------
    formulation : Formulation
        One with a method ``motion_series`` says it exactly.
    t : (k,) array
    y, v, a : (k, n) arrays
        Accelerations as `erls.equations.serial.state_series.accelerations` finds them, or others.
    """
    if isinstance(formulation, _MovesAtAll):
        return formulation.motion_series(t, y, v, a)
    return differenced(formulation, t, y, v, a)


def differenced(formulation: Formulation, t: Array, y: Array, v: Array, a: Array) -> MotionSeries:
    """By differences of states along the parabola; prescribed joints follow the time."""
    found = [state_series(formulation, t + h, y + h * v + h * h / 2 * a, v + h * a) for h in NUDGE * np.arange(-2, 3)]
    states, links = found[2], range(len(found[2].poses))

    def moving(values: list[Array]) -> Moving:
        return Moving(values[2], *(sum(w * x for w, x in zip(row, values, strict=True)) for row in (_FIRST, _SECOND)))

    modal = [moving([s.modal[k] for s in found]) for k in links]
    twists = [twist_of(moving([s.poses[k] for s in found])) for k in links]
    return MotionSeries(
        states,
        [twist for twist, _ in twists],
        [rate for _, rate in twists],
        [m.rate for m in modal],
        [m.acceleration for m in modal],
        moving([s.angles for s in found]).acceleration,
        nodes=None if states.nodes is None else [moving([s.nodes[k] for s in found if s.nodes]) for k in links],
        turns=None if states.turns is None else [moving([s.turns[k] for s in found if s.turns]) for k in links],
    )


def twist_of(frame: Moving) -> tuple[Array, Array]:
    """(k, 6) twist [linear; angular] of poses (k, 4, 4) in their own axes, and the derivative of its components."""
    spin, spin_rate = _spin(frame)
    speed = _own(frame.place, frame.rate[:, :3, 3])
    speeding = _own(frame.place, frame.acceleration[:, :3, 3]) - cross_all(spin, speed)
    return np.hstack([speed, spin]), np.hstack([speeding, spin_rate])


def _own(poses: Array, vectors: Array) -> Array:
    """(k, 3) world vectors in the axes of poses (k, 4, 4)."""
    return np.asarray(np.einsum("kji,kj->ki", poses[:, :3, :3], vectors))


def _spin(frame: Moving) -> tuple[Array, Array]:
    """(k, 3) angular velocity of poses (k, 4, 4) in their own axes, and its derivative."""
    turn, rate, acceleration = (x[:, :3, :3] for x in (frame.place, frame.rate, frame.acceleration))
    return spin_of(turn, rate, acceleration)


def spin_of(turn: Array, rate: Array, acceleration: Array) -> tuple[Array, Array]:
    """(..., 3) angular velocity in the turned axes, and its derivative, of a rotation (..., 3, 3) with its derivatives:
    Rᵀ Ṙ = [ω] and Rᵀ R̈ = [ω̇] + [ω]².
    """
    back = np.swapaxes(turn, -1, -2)
    return _vector(back @ rate), _vector(back @ acceleration)


def _vector(matrices: Array) -> Array:
    """(..., 3) of the skew parts of matrices (..., 3, 3)."""
    return np.asarray((matrices - np.swapaxes(matrices, -1, -2))[..., [2, 0, 1], [1, 2, 0]] / 2)

"""Constants of compiled equations, packed into the two flat arrays of `erls.equations.compiled_system`."""

from __future__ import annotations

import numpy as np

from erls.equations.compiled_system import IntArray
from erls.equations.erls import layout
from erls.equations.serial.curves import HARMONIC, PIECEWISE
from erls.maths.so3 import Array
from erls.mechanism.curves import Curve, Harmonic, Piecewise, Sum
from erls.mechanism.drives import Drive
from erls.mechanism.joints import JointForces


class Packer:
    """Two flat arrays that grow.

    Parameters
    ----------
    integers : (k,) array
        What the integers begin with.
    reals : (l,) array, optional
        What the reals begin with.
    """

    def __init__(self, integers: IntArray, reals: Array | None = None) -> None:
        self.integers: list[int] = [int(i) for i in integers]
        self._reals: list[Array] = [] if reals is None else [reals]
        self._size = sum(map(len, self._reals))

    @property
    def reals(self) -> Array:
        """What was put there."""
        return np.concatenate(self._reals)

    def put(self, values: Array) -> int:
        """Store numbers; where they start."""
        flat = np.asarray(values, dtype=float).ravel()
        self._reals.append(flat)
        self._size += len(flat)
        return self._size - len(flat)

    def put_columns(self, *matrices: Array) -> int:
        """Store matrices, column after column."""
        return self.put(np.concatenate([np.zeros(0), *(matrix.T.ravel() for matrix in matrices)]))

    def put_curve(self, curve: Curve | None) -> int:
        """Store a curve as `erls.equations.serial.curves` reads it; -1 for None."""
        if curve is None:
            return -1
        parts = _parts(curve)
        start = len(self.integers)
        self.integers.append(len(parts))
        for part in parts:
            if isinstance(part, Piecewise):
                place = self.put(np.concatenate([part.knots, part.coefficients.ravel()]))
                self.integers += [PIECEWISE, place, len(part.knots), part.coefficients.shape[1]]
            else:
                form = [part.amplitude, part.omega, part.phase, part.offset, part.before, part.after]
                place = self.put(np.array([*part.breakpoints, *form]))
                self.integers += [HARMONIC, place, len(part.breakpoints), len(form)]
        return start


def _parts(curve: Curve) -> list[Piecewise | Harmonic]:
    """The curves of a sum, of sums of sums too."""
    if isinstance(curve, Sum):
        return [part for some in curve.parts for part in _parts(some)]
    if isinstance(curve, Piecewise | Harmonic):
        return [curve]
    raise TypeError(f"no compiled form of the curve {type(curve).__name__}")


def joint_numbers(forces: JointForces, drive: Drive, rotor_inertia: float, position: float) -> Array:
    """Constants of what acts in a joint, in the order of `erls.equations.erls.layout`; ``position`` at the start."""
    result = np.zeros(layout.JOINT_REALS)
    result[layout.SPRING], result[layout.REST] = forces.stiffness, forces.rest
    result[layout.DAMPER], result[layout.FRICTION] = forces.damping, forces.friction
    result[layout.TRANSITION], result[layout.ROTOR] = forces.transition_rate, rotor_inertia
    result[layout.GAIN], result[layout.RATE_GAIN] = drive.gains
    result[layout.LIMIT], result[layout.HELD] = drive.torque_limit, position
    return result


def step_parts(before: Array, revolute: bool, after: Array) -> Array:
    """(3, 12) constant, cosine and sine part of the pose before · joint · after; constant and rising at a slide."""

    def part(middle: Array, shift: Array) -> Array:
        rotation = before[:3, :3] @ middle
        place = rotation @ after[:3, 3] + before[:3, :3] @ shift
        return np.concatenate([(rotation @ after[:3, :3]).ravel(), place])

    axis, none = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    if revolute:
        parts = [part(np.outer(axis, axis), none), part(-turn @ turn, none), part(turn, none)]
    else:
        parts = [part(np.eye(3), none), part(np.zeros((3, 3)), axis), np.zeros(12)]
    parts[0][9:] += before[:3, 3]
    return np.stack(parts)

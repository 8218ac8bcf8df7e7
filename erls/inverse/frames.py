"""Motion of frames on displaced nodes at many states, in one call: a tree says it of the ends of loops, so servo points
are such ends in a copy of the mechanism, of loops that nobody closes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import CompiledSystem
from erls.equations.loops.records import call_frames
from erls.maths.calls import handed
from erls.maths.jit import ENABLED, kernel
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, Point
from erls.mechanism.joint_types import JOINT_TYPES
from erls.mechanism.loops import Loop, LoopEnd
from fe_import.model import IntArray

if ENABLED:
    from numba import types as _t

    from erls.equations.compiled_system import INTEGERS, MATRIX, REALS

    _SERIES = _t.void(_t.int64, REALS, INTEGERS, REALS, REALS, MATRIX, MATRIX, _t.float64[:, :, ::1])
else:
    _SERIES = None

_ROWS = 24  # numbers of a frame before its rows


class PointMotion(NamedTuple):
    """Of e points at k states, in the world.

    Attributes
    ----------
    place, velocity : (k, e, 3) arrays
        [m], [m/s]
    acceleration : (k, e, 3) array
        At zero accelerations of the n independent coordinates [m/s²].
    rows : (k, e, 3, n) array
        Of velocities over the rates of these.
    """

    place: Array
    velocity: Array
    acceleration: Array
    rows: Array


def with_ends(mechanism: Mechanism, points: Sequence[Point]) -> Mechanism:
    """A copy whose tree says how points move; it is one of a tree alone."""
    ground, still = LoopEnd(None, 0, np.eye(4)), JOINT_TYPES["spherical"]
    ends = (Loop(p.name, still, ground, LoopEnd(p.link, p.node, np.eye(4))) for p in points)
    return replace(mechanism, loops=tuple(ends))


def point_motions(system: CompiledSystem, ends: int, joints: int, t: Array, y: Array, v: Array) -> PointMotion:
    """Of the points of `with_ends` at states (k, n); ``joints`` of them are prescribed."""
    n = system.size
    found = np.empty((len(t), ends, _ROWS + 6 * (n + joints)))
    if ends:
        assert system.frames is not None
        t, y, v = (np.ascontiguousarray(x, dtype=float) for x in (t, y, v))
        frames = handed(system.frames, contract.FRAMES)
        frame_series(frames, system.reals, system.integers, system.scratch, t, y, v, found)
    turn = found[..., :9].reshape(len(t), ends, 3, 3)
    rows = found[..., _ROWS:].reshape(len(t), ends, 6, n + joints)[:, :, :3, :n]
    twist, rate = found[..., 12:18], found[..., 18:24]
    speeding = rate[..., :3] + np.cross(twist[..., 3:], twist[..., :3])
    velocity, acceleration = ((turn @ x[..., None])[..., 0] for x in (twist[..., :3], speeding))
    return PointMotion(found[..., 9:12], velocity, acceleration, turn @ rows)


@kernel(_SERIES, counted=False)
def frame_series(
    function: Any, reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, v: Array, out: Array
) -> None:
    """Frames (k, e, ...) at states, by the function at an address."""
    for k in range(len(t)):
        call_frames(function, reals, integers, scratch, t[k], y[k], v[k], out[k])

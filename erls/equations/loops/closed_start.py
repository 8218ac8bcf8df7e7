"""Where the joints of rigid links begin in closed loops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.equations.loops.closed_chain import ClosedChain
from erls.maths.so3 import Array


@dataclass(frozen=True)
class ClosedStart:
    """How the joints of rigid links begin in closed loops, for formulations without joint coordinates of their own.

    Attributes
    ----------
    positions, rates : (joints,) arrays
        [rad, rad/s or m, m/s]
    coordinates : (loops,) array
        Of closing joints with one coordinate, turns counted; 0 of the others.
    held : tuple of int
        Joints that keep what they are given, prescribed ones included.
    """

    positions: Array
    rates: Array
    coordinates: Array
    held: tuple[int, ...]


def closed_start(chain: ClosedChain) -> ClosedStart:
    """The start of a chain of rigid links.

    Raises
    ------
    SimulationError
        LOOP_OPEN: the links do not reach.
    """
    found = chain.start
    rate = chain.start_velocity(found.y)
    state = chain.bare.state(0.0, found.y, rate)
    rates, free = state.rates.copy(), chain.bare.free_joints
    loops = [k for k, loop in enumerate(chain.mechanism.loops) if loop.freedom is not None]
    coordinates = np.zeros(len(chain.mechanism.loops))
    coordinates[loops] = [chain.loop_motion(0.0, found.y, rate, k)[0] for k in loops]
    held = np.setdiff1d(np.arange(len(rates)), free[found.following])
    return ClosedStart(state.angles.copy(), rates, coordinates, tuple(held.tolist()))

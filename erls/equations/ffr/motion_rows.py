"""Rows of the twists of floating frames over the rates of all joint and elastic coordinates, after a mass matrix."""

from __future__ import annotations

import numpy as np

from erls.equations.compiled_system import CompiledSystem
from erls.equations.ffr import records
from erls.equations.serial.records import Modes, Serial
from erls.equations.serial.segments import SEGMENT, Segment
from erls.maths.records import python_reader
from erls.maths.so3 import Array

read_serial, read_modes, read_segment = python_reader(Serial), python_reader(Modes), python_reader(Segment)
read_frames, read_body_state = python_reader(records.Frames), python_reader(records.BodyState)


def frame_rows(system: CompiledSystem, joints: int, modes: list[slice]) -> list[Array]:
    """(6, joints + elastic) twist of every floating frame per rate of (θ, η), after a mass matrix.

    Parameters
    ----------
    system : CompiledSystem
    joints : int
    modes : list of slice
        Elastic coordinates of each link within η.
    """
    constants = system.scratch, system.integers
    serial = read_serial(system.reals, system.integers, int(system.integers[0]))
    frames = read_frames(system.reals, system.integers, serial.own)
    behind: list[Array] = []  # of the frames behind the joints
    result: list[Array] = []
    for k, at in enumerate(modes):
        own = read_segment(*constants, frames.segments + k * SEGMENT)
        state = read_body_state(*constants, frames.body_states + k * records.BODY_STATE)
        rows = np.zeros((6, joints + modes[-1].stop))
        if own.parent >= 0:
            before = modes[own.parent]
            rows += own.lead @ behind[own.parent]
            rows[:, joints + before.start : joints + before.stop] += own.reach
        rows[:, k] = own.subspace
        behind.append(rows)
        moved = state.arrival @ rows
        moved[:, joints + at.start : joints + at.stop] += state.carried
        result.append(moved)
    return result

"""Stiffness and damping of a chain whose fast modes follow statically; see `erls.equations.compiled_system`."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.quasi_static.following import set_motion
from erls.equations.quasi_static.records import REDUCED, read_reduced, read_reduced_state
from erls.equations.serial import stiffness as serial_stiffness
from erls.equations.serial.records import JOINT, read_joint, read_serial
from erls.maths.jit import kernel
from erls.maths.products import copy_matrix
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """Wᵀ K W and Wᵀ C W: constant for the links, and what joints add."""
    given = read_reduced(reals, integers, len(integers) - REDUCED)
    state = read_reduced_state(scratch, integers, given.state)
    set_motion(given, state, y, v, y[0:0])
    serial_stiffness.stiffness_and_damping(
        reals, integers, scratch, t, state.place, state.rate, state.matrix, state.other
    )
    copy_matrix(given.stiffness, k)
    copy_matrix(given.damping, c)
    serial = read_serial(reals, integers, integers[0])
    for link in range(serial.links):
        joint = read_joint(reals, integers, serial.joints + link * JOINT).place
        if joint >= 0:
            for i in range(len(y)):
                for j in range(len(y)):
                    moved = given.slow[i, joint] * given.slow[j, joint]
                    k[i, j] += state.matrix[joint, joint] * moved
                    c[i, j] += state.other[joint, joint] * moved

"""Stiffness and damping of a chain: all on the diagonals."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.serial.drives import feed_forward, gains, wanted
from erls.maths.jit import kernel, part


@part
def joint_gains(
    reals: Array, integers: IntArray, scratch: Array, record: int, t: float, angle: float, rate: float
) -> tuple[float, float]:
    """Stiffness and damping along a joint on which forces act, after `feed_forward`."""
    stiffness, damping = gains(reals, integers, record, rate)
    memory, forces = integers[record + at.MEMORY], integers[record + at.FORCES]
    state = scratch[memory : memory + at.VECTORS]
    state[at.ANGLE], state[at.ANGLE + 1] = angle, rate
    if abs(wanted(reals, integers, record, t, state)) > reals[forces + at.LIMIT]:  # the motor gives no more
        stiffness -= reals[forces + at.GAIN]
        damping -= reals[forces + at.RATE_GAIN]
    return stiffness, damping


@kernel(contract.STIFFNESS_AND_DAMPING, counted=False)
def stiffness_and_damping(
    reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, k: Array, c: Array
) -> None:
    """Of modes, joint springs, dampers, friction and controllers; see `erls.equations.compiled_system`."""
    k[:, :] = 0.0
    c[:, :] = 0.0
    if integers[at.FEED_FORWARD]:
        feed_forward(reals, integers, scratch, t)
    for link in range(integers[at.LINKS]):
        record = at.HEADER + link * at.RECORD
        first = integers[record + at.FIRST_MODE]
        for i in range(integers[record + at.MODES]):
            k[first + i, first + i] = reals[integers[record + at.STIFFNESS] + i]
            c[first + i, first + i] = reals[integers[record + at.DAMPING] + i]
        joint = integers[record + at.JOINT]
        if joint >= 0 and integers[record + at.EFFORT]:
            stiffness, damping = joint_gains(reals, integers, scratch, record, t, y[joint], v[joint])
            k[joint, joint], c[joint, joint] = stiffness, damping

"""Motion of the three joints whose coordinates are a rotation vector."""

from __future__ import annotations

from typing import Any

from erls.equations.serial.joints import set_coordinate
from erls.equations.serial.records import JOINT, JOINT_STATE, TURN, JointState, read_joint, read_joint_state
from erls.maths.coefficients import stumpff, tangent_coefficients
from erls.maths.jit import kernel, part
from erls.maths.rotations import exponential, value
from erls.maths.rotations import first as rotations_first
from erls.maths.so3 import Array
from erls.maths.spatial import add_motion_cross, transform_motion
from erls.maths.vectors import dot, nine, product
from fe_import.model import IntArray


@part
def _turn_column(state: JointState, column: Any) -> None:
    """A turn about an axis, and the motion along it."""
    for i in range(3):
        state.screw[i] = 0.0
        state.screw[3 + i] = column[i]
    for i in range(6):
        state.twist[i] = state.screw[i] * state.coordinate[1]
        state.twist_rate[i] = state.screw[i] * state.coordinate[2]


@kernel(TURN, counted=False)
def turn_by_vector(
    joints: int, states: int, k: int, reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array,
    a: Array,
) -> None:  # fmt: skip
    """The three joints of a rotation vector ψ: the first turns by exp(ψ̃), and each moves with its column of T(ψ).

    The links between them do not turn against each other. What they carry is differentiated joint by joint; for that to
    be ω = T ψ̇ and ω̇ = T ψ̈ + Ṫ ψ̇ behind the last one, the second and the third take the Lie bracket of their own
    motion with those before as a part of their acceleration. The first `Joint` and `JointState` of the mechanism stand
    at ``joints`` and ``states``, ``k`` is the number of the first of the three.
    """
    first = read_joint_state(scratch, integers, states + k * JOINT_STATE)
    middle = read_joint_state(scratch, integers, states + (k + 1) * JOINT_STATE)
    last = read_joint_state(scratch, integers, states + (k + 2) * JOINT_STATE)
    before = read_joint(reals, integers, joints + k * JOINT).step
    second = read_joint(reals, integers, joints + (k + 1) * JOINT)
    third = read_joint(reals, integers, joints + (k + 2) * JOINT)
    set_coordinate(second, middle, reals, integers, t, y, v, a)
    set_coordinate(third, last, reals, integers, t, y, v, a)
    psi = first.coordinate[0], middle.coordinate[0], last.coordinate[0]
    rate = first.coordinate[1], middle.coordinate[1], last.coordinate[1]
    c = stumpff(dot(psi, psi))
    f, g = tangent_coefficients(c)
    turn = product(nine(before, 0, 0), exponential(psi, c[0], c[1]))
    for i in range(9):
        first.pose[i] = turn[i]
    for i in range(3):
        first.pose[9 + i] = before[0, 9 + i]
    for i in range(12):
        middle.pose[i], last.pose[i] = second.step[0, i], third.step[0, i]
    _turn_column(first, value(f[0], g[0], psi, (1.0, 0.0, 0.0)))
    _turn_column(middle, value(f[0], g[0], psi, (0.0, 1.0, 0.0)))
    _turn_column(last, value(f[0], g[0], psi, (0.0, 0.0, 1.0)))
    change = rotations_first(f[0], f[1], g[0], g[1], psi, rate, rate)
    for i in range(3):
        last.twist_rate[3 + i] += change[i]
    add_motion_cross(middle.twist, first.twist, 1.0, middle.twist_rate)
    add_motion_cross(last.twist, first.twist, 1.0, last.twist_rate)
    add_motion_cross(last.twist, middle.twist, 1.0, last.twist_rate)
    transform_motion(last.pose, last.screw, last.screw)
    transform_motion(last.pose, last.twist, last.twist)
    transform_motion(last.pose, last.twist_rate, last.twist_rate)

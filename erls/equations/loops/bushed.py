"""Bushings (`erls.mechanism.bushings`): what the frames of a closing joint without conditions do to each other.

The rates of d = [p; ψ] are ḋ = [Q η_v; T⁻¹(ψ) η_ω] with the relative twist η, in the outer frame's axes: the force s
along d is the wrench -[Qᵀ s_p; T⁻ᵀ(ψ) s_ψ] there. How these rows turn is left out of the derivatives.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.loops.records import COORDINATE, PUSH, ClosingJoint, LoopState
from erls.maths.coefficients import inverse_coefficient
from erls.maths.jit import part
from erls.maths.rotations import logarithm, value
from erls.maths.vectors import Rotation, Twist, Vector, dot, plus, put, scaled, three, times, turned


@part
def _turn(pose: Array) -> Rotation:
    return pose[0], pose[1], pose[2], pose[3], pose[4], pose[5], pose[6], pose[7], pose[8]


@part
def _half(matrix: Array, row: int, v: Vector, w: Vector) -> Vector:
    """Three rows of a matrix (6, 6) times [v; w]."""
    first = dot(three(matrix[row], 0), v) + dot(three(matrix[row], 3), w)
    second = dot(three(matrix[row + 1], 0), v) + dot(three(matrix[row + 1], 3), w)
    third = dot(three(matrix[row + 2], 0), v) + dot(three(matrix[row + 2], 3), w)
    return first, second, third


@part
def _pulled(turn: Rotation, psi: Vector, along: Vector, about: Vector) -> Twist:
    """Wrench in the outer frame's axes of a force along d."""
    return turned(turn, along), value(-0.5, inverse_coefficient(dot(psi, psi))[0], psi, about)


@part
def bush(joint: ClosingJoint, state: LoopState) -> None:
    """The wrench on the outer frame, elastic energy, and the power of the damper."""
    turn, place = _turn(state.pose), three(state.pose, 9)
    psi = logarithm(turn)
    spread = inverse_coefficient(dot(psi, psi))[0]
    fast, spin = times(turn, three(state.twist, 0)), value(0.5, spread, psi, three(state.twist, 3))
    held, twisted = _half(joint.spring, 0, place, psi), _half(joint.spring, 3, place, psi)
    damped, slowed = _half(joint.damper, 0, fast, spin), _half(joint.damper, 3, fast, spin)
    force, moment = _pulled(turn, psi, plus(held, damped), plus(twisted, slowed))
    put(state.wrench, 0, scaled(-1.0, force))
    put(state.wrench, 3, scaled(-1.0, moment))
    state.effort[COORDINATE] = 0.5 * (dot(held, place) + dot(twisted, psi))
    state.effort[PUSH] = -(dot(damped, fast) + dot(slowed, spin))


@part
def push_bushing(state: LoopState, out: Array) -> None:
    """Take its force from a residual."""
    for j in range(len(out)):
        for i in range(6):
            out[j] -= state.wrench[i] * state.moves[i, j]


@part
def bushing_gains(joint: ClosingJoint, state: LoopState, k: Array, c: Array) -> None:
    """Add stiffness and damping."""
    turn, moves = _turn(state.pose), state.moves
    psi = logarithm(turn)
    spread = inverse_coefficient(dot(psi, psi))[0]
    for j in range(len(k)):
        along = times(turn, (moves[0, j], moves[1, j], moves[2, j]))
        about = value(0.5, spread, psi, (moves[3, j], moves[4, j], moves[5, j]))
        held = _pulled(turn, psi, _half(joint.spring, 0, along, about), _half(joint.spring, 3, along, about))
        damped = _pulled(turn, psi, _half(joint.damper, 0, along, about), _half(joint.damper, 3, along, about))
        for i in range(len(k)):
            row, low = (moves[0, i], moves[1, i], moves[2, i]), (moves[3, i], moves[4, i], moves[5, i])
            k[i, j] += dot(row, held[0]) + dot(low, held[1])
            c[i, j] += dot(row, damped[0]) + dot(low, damped[1])

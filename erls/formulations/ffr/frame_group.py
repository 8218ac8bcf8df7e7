"""Increments of floating frames: the exponential of rigid motions and its tangent, in the frame's own axes.

A twist increment ξ = [ρ; φ] moves a frame to T exp(ξ). Blocks that mix translation and rotation are derivatives of
those of rotations in the direction ρ (J. M. Selig, Geometric Fundamentals of Robotics, ch. 4 and 7).
"""

from __future__ import annotations

import numpy as np

from erls.formulations.ffr.interface_motion import turn_factors
from erls.lie.so3 import Array, skew


def exponential(increment: Array) -> Array:
    """(4, 4) rigid motion exp(ξ)."""
    tilde = skew(increment[3:])
    square = tilde @ tilde
    s = float(increment[3:] @ increment[3:])
    a, _, b, _ = turn_factors(s)
    result = np.eye(4)
    result[:3, :3] += (1 - s * b) * tilde + a * square
    result[:3, 3] = increment[:3] + (a * tilde + b * square) @ increment[:3]
    return result


def tangent(increment: Array) -> Array:
    """(6, 6) twist of T exp(ξ), in its own axes, per variation of ξ."""
    turn, moved = skew(increment[3:]), skew(increment[:3])
    square = turn @ turn
    s, slope = float(increment[3:] @ increment[3:]), 2 * float(increment[3:] @ increment[:3])
    a, a_slope, b, b_slope = turn_factors(s)
    block = b * square - a * turn
    block.flat[::4] += 1.0
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = block
    result[:3, 3:] = b * (turn @ moved + moved @ turn) - a * moved + slope * (b_slope * square - a_slope * turn)
    return result

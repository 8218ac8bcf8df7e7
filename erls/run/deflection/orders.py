"""Second and third order of the displacement of lines that bend, from their first-order rotation.

With the curvature κ linear in the modal coordinates and stated in the turned axes (J. C. Simo, Comput. Methods Appl.
Mech. Eng. 49 (1985) 55-70), a section turns by exp ψ, ψ = θ + θ₂ + θ₃ + …, with ψ' = T⁻¹(ψ) κ, and the line runs along
exp(ψ) t. Order by order, θ' = κ,

    θ₂' = ½ θ × κ,      θ₃' = ½ θ₂ × κ + θ × (θ × κ) / 12,
    u₂' = θ₂ × t + ½ θ × (θ × t),
    u₃' = θ₃ × t + ½ (θ × (θ₂ × t) + θ₂ × (θ × t)) + θ × (θ × (θ × t)) / 6.

Shear and stretch, smaller by the square of the slenderness, are left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.maths.so3 import Array, cross_all
from erls.run.deflection.lines import Lines


class Orders(NamedTuple):
    """Displacement (k, s, 3) [m] and rotation vector (k, s, 3) of stations in second and in third order."""

    second: Array
    second_turn: Array
    third: Array
    third_turn: Array


def orders(lines: Lines, turns: Array) -> Orders:
    """Against the inboard interface, which turns to first order alone.

    Parameters
    ----------
    lines : Lines
    turns : (k, s, 3) array
        θ of the stations.
    """
    start, end = turns[:, lines.parents], turns[:, 1:]
    theta, kappa, along = (start + end) / 2, end - start, lines.segments

    def summed(rates: Array) -> tuple[Array, Array]:
        """At the stations, and in the middle of the segments."""
        at = lines.outward @ rates
        return at, at[:, lines.parents] + rates / 2

    across = cross_all(theta, along)
    twice = cross_all(theta, across)
    second_turn, second = summed(cross_all(theta, kappa) / 2)
    third_turn, third = summed(cross_all(second, kappa) / 2 + cross_all(theta, cross_all(theta, kappa)) / 12)
    moved = cross_all(second, along)
    return Orders(
        lines.outward @ (moved + twice / 2),
        second_turn,
        lines.outward
        @ (
            cross_all(third, along)
            + (cross_all(theta, moved) + cross_all(second, across)) / 2
            + cross_all(theta, twice) / 6
        ),
        np.asarray(third_turn),
    )

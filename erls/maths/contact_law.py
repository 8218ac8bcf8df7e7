"""The law of compliant contact: what a plane, or the stop of a joint, answers to being pressed in.

A depth δ, grown at the speed δ̇, gives the force

    F = k δⁿ (1 + d σ(δ̇ / w)),    σ(x) = x (15 - 10 x² + 3 x⁴) / 8 for |x| < 1, beyond ±1,

which never pulls, as 0 ≤ d ≤ 1. It multiplies elasticity and damping as K. Hunt and F. Crossley do (J. Appl. Mech. 42
(1975) 440-445; n = 3/2 after Hertz), with a factor that levels off instead of growing with speed: with theirs a body
rebounds the better the slower it comes. The motion of a free body of mass m, m v dv = -k δⁿ g(v) dδ with v = δ̇,
spends the same ∫ δⁿ dδ on its way in and out, whatever m, k and n, so that the speeds before and after, v₀ and e v₀,
fulfil

    ∫₀^v₀ v dv / g(v) = ∫₀^(e v₀) v dv / g(-v).

g being 1 + d and 1 - d but for speeds below w, d = (1 - e²) / (1 + e²) makes it rebound with e, but for terms of
(w / v₀)²; with e = 0 it leaves with less than w. At rest damping is linear in the speed, c = 15 d k δⁿ / (8 w), so that
bodies come to rest after some rebounds. The energy k δⁿ⁺¹ / (n + 1) is elastic; the rest is lost.

Friction is Coulomb's. Made smooth it is µ F tanh(|s| / r) against the velocity s along the plane. With exact sticking
it has modes that are constant until they are set anew (`erls.equations.switches.grips`): while a point slides µ F s/|s|
stands against it; through s = 0 it goes on with |s · e| in place of s · e along the direction e that the point began
with, so that nothing jumps within a step. A point that sticks is held where it came to rest, by µ F (x + τ s) / d at a
displacement x from there, with d so small against the mechanism that nobody sees it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.maths.contact_places import (
    AHEAD,
    ANCHOR,
    COEFFICIENT,
    EXPONENT,
    GIVE,
    LOSS,
    MODE,
    RATE,
    SETTLING,
    SLIDES,
    STICKS,
    STIFFNESS,
    TRANSITION,
)
from erls.maths.jit import part
from erls.maths.so3 import Array


@part
def _factor(x: Any) -> tuple[Any, Any]:
    """σ and its derivative."""
    if x.real >= 1.0:
        return 0.0 * x + 1.0, 0.0 * x
    if x.real <= -1.0:
        return 0.0 * x - 1.0, 0.0 * x
    s = x * x
    return x * (15.0 + s * (3.0 * s - 10.0)) / 8.0, 15.0 * (1.0 - s) * (1.0 - s) / 8.0


@part
def elastic_force(law: Array, depth: Any) -> Any:
    """k δⁿ; none above the surface."""
    if depth.real <= 0.0:
        return 0.0 * depth
    if law[EXPONENT] == 1.0:
        return law[STIFFNESS] * depth
    return law[STIFFNESS] * depth ** law[EXPONENT]


@part
def contact_force(law: Array, depth: Any, speed: Any) -> Any:
    """F at a depth and the speed of its growth."""
    return elastic_force(law, depth) * (1.0 + law[LOSS] * _factor(speed / law[TRANSITION])[0])


@part
def contact_gains(law: Array, depth: Any, speed: Any) -> tuple[Any, Any]:
    """∂F/∂δ and ∂F/∂δ̇."""
    if depth.real <= 0.0:
        return 0.0 * depth, 0.0 * depth
    elastic, (level, slope) = elastic_force(law, depth), _factor(speed / law[TRANSITION])
    stiffness = law[EXPONENT] * elastic / depth * (1.0 + law[LOSS] * level)
    return stiffness, elastic * law[LOSS] * slope / law[TRANSITION]


@part
def contact_energy(law: Array, depth: Any) -> Any:
    """Elastic energy at a depth."""
    if depth.real <= 0.0:
        return 0.0 * depth
    return elastic_force(law, depth) * depth / (law[EXPONENT] + 1.0)


@part
def friction_factor(slide: Any) -> tuple[Any, Any]:
    """tanh(x) / x and its derivative over x, divided by x, for x = |s| / r; ``slide`` is x²."""
    if slide.real < 1e-4:
        return 1.0 - slide / 3.0 + 2.0 * slide * slide / 15.0, -2.0 / 3.0 + 8.0 * slide / 15.0
    x = np.sqrt(slide)
    if x.real > 20.0:
        return 1.0 / x, -1.0 / (x * slide)
    level = np.tanh(x)
    return level / x, ((1.0 - level * level) - level / x) / slide


@part
def friction_force(law: Array, push: Any, along: Any, across: Any, first: Any, second: Any) -> tuple[Any, Any]:
    """Friction along two axes of the plane, by what presses, velocities and places along these axes."""
    strength = law[COEFFICIENT] * push
    if law[MODE] == STICKS:
        hold = strength / law[GIVE]
        x, y = first - law[ANCHOR], second - law[ANCHOR + 1]
        return -hold * (x + law[SETTLING] * along), -hold * (y + law[SETTLING] * across)
    slide = along * along + across * across
    if law[MODE] == SLIDES:
        if slide.real == 0.0:
            return -strength * law[AHEAD], -strength * law[AHEAD + 1]
        ahead = along * law[AHEAD] + across * law[AHEAD + 1]
        turned = -2.0 * ahead if ahead.real < 0.0 else 0.0 * ahead
        strength = strength / np.sqrt(slide)
        return -strength * (along + turned * law[AHEAD]), -strength * (across + turned * law[AHEAD + 1])
    strength = strength / law[RATE] * friction_factor(slide / (law[RATE] * law[RATE]))[0]
    return -strength * along, -strength * across


@part
def grip_force(law: Array, place: Any, rate: Any) -> Any:
    """The same along a coordinate, where the numbers hold a force in place of a coefficient."""
    none = 0.0 * rate
    return friction_force(law, 1.0, rate, none, place, none)[0]


@part
def friction_gains(law: Array, push: Any, along: Any, across: Any) -> tuple[Any, Any, Any]:
    """Friction per velocity along the motion, and across it; per displacement, whatever its direction."""
    strength, slide = law[COEFFICIENT] * push, along * along + across * across
    none = 0.0 * slide * push
    if law[MODE] == STICKS:
        hold = strength / law[GIVE]
        return hold * law[SETTLING], hold * law[SETTLING], hold
    if law[MODE] == SLIDES:
        if slide.real == 0.0 or (along * law[AHEAD] + across * law[AHEAD + 1]).real <= 0.0:
            return none, none, none
        return none, strength / np.sqrt(slide), none
    rate = law[RATE]
    factor, slope = friction_factor(slide / (rate * rate))
    return strength / rate * (factor + slope * slide / (rate * rate)), strength / rate * factor, none


@part
def grip_gains(law: Array, rate: Any) -> tuple[Any, Any]:
    """-∂/∂place and -∂/∂rate of `grip_force`."""
    _, damping, stiffness = friction_gains(law, 1.0, rate, 0.0 * rate)
    return stiffness, damping


@part
def stop_force(stops: Array, angle: Any, rate: Any) -> tuple[Any, Any]:
    """Force of the stops of a joint on its coordinate, and what of it is elastic; ``stops`` (6,) are the coordinates of
    the lower and of the upper one, then their law.
    """
    law, below, above = stops[2:], stops[0] - angle, angle - stops[1]
    force = contact_force(law, below, -rate) - contact_force(law, above, rate)
    return force, elastic_force(law, below) - elastic_force(law, above)


@part
def stop_gains(stops: Array, angle: Any, rate: Any) -> tuple[Any, Any]:
    """-∂/∂angle and -∂/∂rate of that force."""
    law = stops[2:]
    low, high = contact_gains(law, stops[0] - angle, -rate), contact_gains(law, angle - stops[1], rate)
    return low[0] + high[0], low[1] + high[1]


@part
def stop_energy(stops: Array, angle: Any) -> Any:
    """Elastic energy in the stops of a joint."""
    return contact_energy(stops[2:], stops[0] - angle) + contact_energy(stops[2:], angle - stops[1])

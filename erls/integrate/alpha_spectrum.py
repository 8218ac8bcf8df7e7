"""What generalized-α makes of a vibration: its factor per step against the exact one, by the phase θ = ω h of a step.

With v̇ = −ω² y at every knot, and y, h v and h² a of a knot as state,

    (1 + β s θ²) y₁ = (1 − β p θ²) y₀ + h v₀ + (½ − β + β k) h² a₀,   h² a₁ = −s θ² y₁ − p θ² y₀ + k h² a₀,

where a₁ = s v̇₁ + p v̇₀ + k a₀ is that of `erls.integrate.alpha_rules.Formulas`. Of the three factors of a step, the pair
that tends to exp(± i θ) carries the vibration (J. Chung, G. M. Hulbert, J. Appl. Mech. 60 (1993) 371–375).
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from erls.integrate.alpha_rules import Formulas, Rules
from erls.maths.so3 import Array

ComplexArray: TypeAlias = NDArray[np.complex128]


def step_errors(spectral_radius: float, phase: Array) -> ComplexArray:
    """Logarithm of the factor of a step over the exact one: loss of amplitude, and i times the error of phase.

    Parameters
    ----------
    spectral_radius : float
        ρ∞.
    phase : (k,) array
        θ [rad].

    Returns
    -------
    (k,) array
        About −i c θ³ for small θ.
    """
    use = Formulas.of(Rules(spectral_radius, 0.0), 1.0)
    square = phase**2
    first = np.stack(
        [1 - use.beta * use.pull * square, np.ones_like(square), np.full_like(square, 0.5 - use.beta * (1 - use.keep))],
        axis=1,
    ) / (1 + use.beta * use.share * square)[:, None]  # fmt: skip
    third = -(use.share * square)[:, None] * first
    third[:, 0] -= use.pull * square
    third[:, 2] += use.keep
    second = use.gamma * third
    second[:, 1] += 1
    second[:, 2] += 1 - use.gamma
    factors = np.linalg.eigvals(np.stack([first, second, third], axis=1)).astype(complex)
    upper = factors[np.arange(len(phase)), factors.imag.argmax(axis=1)]  # of three, one pair is complex
    return np.asarray(np.log(upper) - 1j * phase)

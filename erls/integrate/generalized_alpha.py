"""Generalized-α, the default: implicit, second order, with numerical damping of unresolved vibrations.

J. Chung and G. M. Hulbert, J. Appl. Mech. 60 (1993) 371–375, in the form of M. Arnold and O. Brüls, Multibody
Syst. Dyn. 18 (2007) 185–202: M(y, t) ÿ = f holds at every knot, and an algorithmic acceleration a with

    (1 − α_m) a₁ + α_m a₀ = (1 − α_f) ÿ₁ + α_f ÿ₀

enters Newmark's formulas y₁ = y₀ + h v₀ + h² ((½ − β) a₀ + β a₁) and v₁ = v₀ + h ((1 − γ) a₀ + γ a₁). With

    α_m = (2ρ − 1)/(ρ + 1),  α_f = ρ/(ρ + 1),  γ = ½ + α_f − α_m,  β = ¼ (γ + ½)²

the order is two and vibrations that the step does not resolve lose the factor ρ = ρ∞ in each step. From a
correction Δy follow Δÿ = β' Δy and Δv = γ' Δy with β' = (1 − α_m)/(h² β (1 − α_f)) and γ' = γ/(h β), hence
the iteration matrix S = β' M + γ' C + K. A run starts with a₀ = ÿ₀: that is wrong by O(h), once, and decays.

S is factored once and kept while it serves. A fresh one costs about as much as a few residuals, so it is
made when the iterations beyond those that a fresh one needed add up to that cost, and when iteration fails.
"""

from __future__ import annotations

import numpy as np

from erls.equations.system import SecondOrderSystem, metre_scales
from erls.integrate.alpha_rules import Formulas, Rules, Words
from erls.integrate.alpha_steps import Steps, equal_steps
from erls.integrate.base import Leg, Observer, Options, Solution
from erls.integrate.driver import Recorder, integrate_legs, recorder_for
from erls.maths.so3 import Array

_REFRESH_COST, _OWN_REFRESH_COST = 4.0, 1.0
"""Of a fresh iteration matrix, in iterations: with dense factors, and where the system has its own way of solving."""


def generalized_alpha(
    system: SecondOrderSystem,
    times: tuple[float, float],
    y: Array,
    v: Array,
    options: Options,
    observer: Observer | None = None,
) -> Solution:
    """Integrate with fixed steps ``options.step`` (default: a thousandth of the run, at most 1 ms).

    Steps are equal inside a leg and end on breakpoints. Where Newton's method fails they are halved for a
    while.
    """
    step = options.step or min((times[1] - times[0]) / 1000, 1e-3)
    capacity = int(min((times[1] - times[0]) / step, 1e6)) + 2 if times[1] > times[0] else 2
    capacity = 1024 if options.output_step else capacity + 2 * len(system.breakpoints)
    recorder = recorder_for(system, observer, options, capacity)
    if recorder.switching is not None:
        recorder.switching.coarse = True
    method = _Equal(system, steps_of(system, options, recorder), step, options, recorder) if system.size else None
    return integrate_legs(system, times, y, v, recorder, method, options.keeper)


class _Equal:
    """A `Method` of equal steps.

    Parameters
    ----------
    system : SecondOrderSystem
    steps : Steps
    step : float
        [s]
    options : Options
    recorder : Recorder
    """

    def __init__(
        self, system: SecondOrderSystem, steps: Steps, step: float, options: Options, recorder: Recorder
    ) -> None:
        self._system, self._steps, self._step, self._recorder = system, steps, step, recorder
        self._beta = Formulas.of(Rules(options.spectral_radius, 0.0), step).beta
        self.resumable, self.memory, self.restore = steps.resumable, steps.memory, steps.restore

    def begin(self, leg: Leg, y: Array, v: Array, a: Array) -> None:
        """Stand at the start of a leg."""
        switching = self._recorder.switching
        jumps = switching is not None and switching.system.jumps
        self._steps.begin(y, v, self._seen(leg, y, v, a) if jumps else a)

    def _seen(self, leg: Leg, y: Array, v: Array, a: Array) -> Array:
        """(n,) accelerations as steps see them, (M + β h² K)⁻¹ M a: the same to second order in the step; those of
        vibrations that it does not resolve, which would excite them at every switch, are left out.
        """
        stiffness, _ = self._system.stiffness_and_damping(leg.first, y, v)
        mass = self._system.mass_matrix(leg.first, y)
        return np.asarray(np.linalg.solve(mass + self._beta * self._step**2 * stiffness, mass @ a))

    def finish(self, leg: Leg) -> tuple[Array, Array]:
        """Equal steps over the rest of a leg."""
        equal_steps(self._steps, leg, self._step, True, self._recorder)
        return self._steps.end()


def steps_of(system: SecondOrderSystem, options: Options, recorder: Recorder) -> Steps:
    """Steps of a system; compiled ones where its equations are."""
    from erls.equations.independent import independent  # here: they import the compiler
    from erls.equations.uncompiled import steps_of as plain_steps

    compiled = system.compiled
    own = compiled is not None and compiled.factoring is not None
    cost = _OWN_REFRESH_COST if own else _REFRESH_COST
    rules = Rules(options.spectral_radius, options.newton_tolerance, patience=cost)
    known = plain_steps(system) if compiled is None else independent(compiled)
    return Steps(known, metre_scales(system), rules, Words(), recorder)

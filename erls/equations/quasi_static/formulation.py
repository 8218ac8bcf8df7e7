"""A formulation whose fast modes follow statically: modes above the bandwidth of a scene.

With y = W z + H η (`erls.equations.quasi_static.static_modes`) and r(t, y, ẏ, ÿ) = M ÿ - f the balance of forces
with all modes,

    Hᵀ r = 0 and Wᵀ r = 0 at y = W z + H η, ẏ = W ż + H η̇, ÿ = W z̈:

η carries its share of weight, inertia of the slow motion and loads at interfaces, with all nonlinear terms in η, and η̇
is the rate at which it follows, from η a little before and after. Only η̈ is left out. As W and H are modes (of the mean
mass matrix), it hardly acts on z, and of η the share (Ω/ω)² is wrong where loads change at Ω and ω is the mode's
frequency; the vibration of η about its static value, which a sudden load would start, is left out altogether
(`erls.run.watches.static_following` estimates both). Without η̇ the links would feel the static deflection, but not
that a turning link gives or takes angular momentum as it deflects, which is of the same order.

η follows from iterations η ← η - κ⁻¹ Hᵀ r with κ = Hᵀ K H, whose corrections shrink with the ratio ρ of the stiffness
that loads make to κ. As Hᵀ K W = 0, Wᵀ r does not feel the elastic forces of η: an error Δ of η leaves one of ρ κ Δ in
it. Forces without what deformation adds to inertia cost a fraction; from them come a first estimate of η, and from that
those a little earlier and later, with their mean and η̇. So, as a rule, one evaluation of r is left, after which the
correction may be 5 % of the first one. Where a state is asked for, iterations go on to the end.

Energy: that of all modes at (y, ẏ). Without drives and damping it is constant but for about (Ω/ω)² of the strain energy
of η, and does not drift.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from erls.equations.formulation import Energy, Reaction, State, TreeFormulation
from erls.equations.quasi_static.static_modes import StaticModes, static_modes
from erls.equations.serial.motion_series import MotionSeries, motion_series
from erls.equations.serial.state_series import (
    ReactionSeries,
    StateSeries,
    energy_series,
    reaction_series,
    single_energy,
    state_series,
)
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.without_effects import without

if TYPE_CHECKING:
    from erls.equations.compiled_system import CompiledSystem

MOST = 6  # evaluations of r
NEAR = 0.05  # of the first correction: what the last one may be
PER_PERIOD = 100  # steps of differences in time, of the period below
_EXACT, _MOST_EXACT = 1e-12, 30  # NEAR and MOST for states
_FOUND = 1e-6  # of η: what a state may lack
_CORRECTIONS = 3  # of an acceleration
_HAIR = 2e-12  # of a run, before its end
_LEFT_OUT = {"coriolis", "inertia_first_order", "inertia_second_order", "spin_softening"}


def quasi_static(
    formulated: Callable[[Mechanism], TreeFormulation], mechanism: Mechanism, duration: float
) -> TreeFormulation | QuasiStatic:
    """Equations of motion in which modes above the mechanism's bandwidth follow statically, or, without the effect
    ``static_correction``, are left out; the equations of all modes where none lies above it.

    Parameters
    ----------
    formulated : callable
        Makes the equations of motion of a mechanism with all modes.
    mechanism : Mechanism
        With a bandwidth.
    duration : float
        Of the run [s]: configurations of driven joints within it count.

    Raises
    ------
    SimulationError
        SINGULAR_MASS.
    """
    vibrating = replace(mechanism, bandwidth=None)
    equations = formulated(vibrating)
    if mechanism.bandwidth is None or not any(link.elastic_modes for link in mechanism.links):
        return equations
    static = "static_correction" in mechanism.effects
    modes = static_modes(equations, mechanism.bandwidth, duration, static)
    if modes.slow.shape[1] == equations.size:
        return equations
    return QuasiStatic(mechanism, equations, formulated(without(vibrating, _LEFT_OUT)), modes, duration)


class QuasiStatic:
    """A `Formulation` and `SecondOrderSystem` in the slow coordinates z.

    Parameters
    ----------
    mechanism : Mechanism
        With a bandwidth.
    inner : TreeFormulation
        With all modes.
    light : TreeFormulation
        The same in the same coordinates without what deformation adds to inertia, to estimate η.
    modes : StaticModes
    end : float, optional
        Of the run [s]: loads that change there do not deflect links any more.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        inner: TreeFormulation,
        light: TreeFormulation,
        modes: StaticModes,
        end: float = np.inf,
    ) -> None:
        self.mechanism, self.inner, self.light, self.modes = mechanism, inner, light, modes
        self.bandwidth = mechanism.bandwidth or np.inf
        self.length_scales = modes.length_scales
        stiffness = np.zeros(inner.size)
        elastic = np.concatenate([link.stiffness for link in self.mechanism.links])
        stiffness[inner.size - len(elastic) :] = elastic
        self.squares = np.einsum("ns,n,ns->s", modes.slow, stiffness, modes.slow)  # of the modes' frequencies [1/s²]
        self.squares[: len(inner.free_joints)] = 0.0
        self.last = end - _HAIR * max(1.0, end) if np.isfinite(end) else end
        slowest = float(modes.static_frequencies_hz.min(initial=np.inf))
        self.period = min(1 / slowest if slowest else np.inf, end)
        """Of the slowest static mode, but no longer than the run [s]; the same for any bandwidth below that mode."""
        self.ends = (0.0, *(b for b in inner.breakpoints if b > 0.0))

    @property
    def size(self) -> int:
        """Number of slow coordinates."""
        return int(self.modes.slow.shape[1])

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Those of all modes."""
        return self.inner.breakpoints

    @cached_property
    def compiled(self) -> CompiledSystem | None:
        """The same equations in compiled form; None where those of all modes have none of a chain, or all follow."""
        inner = self.inner.compiled
        if inner is None or not self.size:
            return None
        from erls.equations.quasi_static.compiled import compile_quasi_static  # here: it imports the compiler

        return compile_quasi_static(inner, self)

    def initial_state(self) -> tuple[Array, Array]:
        """(z, ż) of the initial state of all modes; what it holds of vibrations of the static ones is left out."""
        return self.modes.start.copy(), self.modes.start_rates.copy()

    @property
    def lapse(self) -> float:
        """Step of differences in time [s]."""
        return self.period / PER_PERIOD

    def around(self, t: float) -> tuple[float, float]:
        """Steps back and forth from a time, which do not reach over a breakpoint."""
        before, after = bisect_right(self.ends, t), bisect_left(self.ends, t)
        back = min(self.lapse, (t - self.ends[before - 1]) / 2) if before else self.lapse
        forth = min(self.lapse, (self.ends[after] - t) / 2) if after < len(self.ends) else self.lapse
        return (-back, forth) if back + forth >= self.lapse / 2 else (-self.lapse, self.lapse)

    def _estimate(self, t: float, z: Array, v: Array, a: Array) -> tuple[Array, Array, float]:
        """(h,) η and η̇ from light equations, and the size of the first correction."""
        modes = self.modes
        guess, first = self._correction(self._forces(self.light, t, z, v, a))
        steps = self.around(t)
        jerk = -self.squares * v
        found = []
        for h in steps:
            moved = z + h * v + h * h / 2 * a, v + h * a, a + h * jerk
            found.append(guess + self._correction(self._forces(self.light, t + h, *moved, guess))[0])
        rate = (found[1] - found[0]) / (steps[1] - steps[0])
        return found[0] - steps[0] * rate, rate, first if len(modes.stiffness) else 0.0

    def _forces(self, equations: TreeFormulation, t: float, z: Array, v: Array, a: Array, *eta: Array) -> Array:
        """(n,) r at η and η̇, zero unless given."""
        modes = self.modes
        place, rate = modes.slow @ z, modes.slow @ v
        if eta:
            place = place + modes.static @ eta[0]
        if len(eta) > 1:
            rate = rate + modes.static @ eta[1]
        return _residual(equations, t, place, rate, modes.slow @ a)

    def _balance(
        self, t: float, z: Array, v: Array, a: Array, most: int = MOST, near: float = NEAR
    ) -> tuple[Array, Array, Array]:
        """(h,) η in balance and η̇, and the forces r on all modes that the last correction came from."""
        eta, rate, first = self._estimate(t, z, v, a)
        for _ in range(most):
            force = self._forces(self.inner, t, z, v, a, eta, rate)
            change, size = self._correction(force)
            if size <= near * first:
                break
            eta = eta + change
        return eta, rate, force

    def _correction(self, force: Array) -> tuple[Array, float]:
        """(h,) change of η towards balance, and its size as the root of twice its strain energy."""
        change = -(self.modes.static.T @ force) / self.modes.stiffness
        return change, float(np.sqrt(self.modes.stiffness @ change**2))

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(s,) forces out of balance on the slow coordinates."""
        return np.asarray(self.modes.slow.T @ self._balance(t, y, v, a)[2])

    def mass_matrix(self, t: float, y: Array) -> Array:
        """(s, s) Wᵀ M W."""
        return np.asarray(self.modes.slow.T @ self.full_mass_matrix(t, y) @ self.modes.slow)

    def full_mass_matrix(self, t: float, z: Array) -> Array:
        """(n, n) M of all modes."""
        return _mass_matrix(self.inner, t, self.modes.slow @ z)

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(s,) z̈ from the equations of motion, by corrections with Wᵀ M W.

        Raises
        ------
        SimulationError
            SINGULAR_MASS.
        """
        a = np.zeros(self.size)
        if not self.size:
            return a
        mass = self.mass_matrix(t, y)
        try:
            for _ in range(_CORRECTIONS):
                a = a - np.linalg.solve(mass, self.residual(t, y, v, a))
        except np.linalg.LinAlgError:
            self.inner.acceleration(t, self.modes.slow @ y, self.modes.slow @ v)  # names the coordinate
            raise SimulationError(
                Cause.SINGULAR_MASS,
                "nothing resists a motion of the slow coordinates",
                where=f"t = {t:.6g} s",
                remedy="raise simulation.bandwidth, or give links mass and inertia",
            ) from None
        return a

    def _accelerated(self, t: float, z: Array, v: Array) -> Array:
        """`acceleration`, from the compiled form where there is one."""
        if self.compiled is not None:
            c, out = self.compiled, np.empty(self.size)
            if c.acceleration(c.reals, c.integers, c.scratch, t, z.copy(), v.copy(), out) == 0:
                return out
        return self.acceleration(t, z, v)

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """Wᵀ K W and Wᵀ C W."""
        slow = self.modes.slow
        stiffness, damping = self.inner.stiffness_and_damping(t, slow @ y, slow @ v)
        return slow.T @ stiffness @ slow, slow.T @ damping @ slow

    def all_modes(self, t: float, z: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """(n,) y, ẏ and ÿ of all modes.

        Raises
        ------
        SimulationError
            NO_EQUILIBRIUM.
        """
        eta, rate = self._exact(t, z, v, a)
        slow, static = self.modes.slow, self.modes.static
        return slow @ z + static @ eta, slow @ v + static @ rate, slow @ a

    def deflection(self, t: float, z: Array, v: Array) -> Array:
        """(h,) η; errors are those of `all_modes`."""
        return self._exact(t, z, v, self._accelerated(t, z, v))[0]

    def _exact(self, t: float, z: Array, v: Array, a: Array) -> tuple[Array, Array]:
        """η in balance, and η̇."""
        t = min(t, self.last)
        eta, rate, force = self._balance(t, z, v, a, _MOST_EXACT, _EXACT)
        left, size = self._correction(force)[1], float(np.sqrt(self.modes.stiffness @ eta**2))
        if left > _FOUND * size and left > _FOUND * self._correction(self._forces(self.light, t, z, v, a))[1]:
            raise SimulationError(
                Cause.NO_EQUILIBRIUM,
                f"modes above the bandwidth, {self.bandwidth:g} Hz, find no static equilibrium under their loads",
                where=f"t = {t:.6g} s",
                value=f"{left / size:.2g} of their deflection is left to go",
                remedy="raise simulation.bandwidth: loads, or fast turns, make these modes soft",
            )
        return eta, rate

    def stored(self, values: Array) -> Array:
        """(k, n) W z, or its rates, of (k, s) z: what does not depend on how modes are scaled."""
        return np.asarray(values @ self.modes.slow.T)

    def restored(self, values: Array) -> Array:
        """(k, s) z of W z."""
        return np.asarray(values @ np.linalg.pinv(self.modes.slow).T)

    def state(self, t: float, y: Array, v: Array) -> State:
        """Poses, modal coordinates and joint angles, with the static deflection."""
        return self.inner.state(t, *self.all_modes(t, y, v, self._accelerated(t, y, v))[:2])

    def series(self, t: Array, y: Array, v: Array) -> StateSeries:
        """The same at times (k,), with coordinates and rates (k, s)."""
        return state_series(self.inner, t, *self.all_modes_at(t, y, v)[:2])

    def all_modes_at(self, t: Array, y: Array, v: Array, a: Array | None = None) -> Array:
        """(3, k, n) coordinates, rates and accelerations of all modes at times (k,); ``a`` (k, s) from the equations of
        motion unless given.
        """
        found = np.zeros((3, len(t), self.inner.size))
        for k, at in enumerate(t.tolist()):
            found[:, k] = self.all_modes(at, y[k], v[k], self._accelerated(at, y[k], v[k]) if a is None else a[k])
        return found

    def motion_series(self, t: Array, y: Array, v: Array, a: Array) -> MotionSeries:
        """Motion at times (k,) with slow accelerations (k, s)."""
        return motion_series(self.inner, t, *self.all_modes_at(t, y, v, a))

    def reaction_series(self, t: Array, y: Array, v: Array, a: Array | None = None) -> ReactionSeries:
        """Joint reactions at times (k,), with all modes under load and their accelerations."""
        return reaction_series(self.inner, t, *self.all_modes_at(t, y, v, a))

    def energy_series(self, t: Array, y: Array, v: Array) -> Array:
        """(k, 4) energies at times (k,), with those of the static deflection."""
        return energy_series(self.inner, t, *self.all_modes_at(t, y, v)[:2])

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """The same at one time."""
        return single_energy(self.energy_series(np.array([t]), np.array([y]), np.array([v])))

    def load_power(self, t: Array, y: Array, v: Array) -> Array:
        """(k,) that of loads at times (k,) [W], with the rates of the static deflection."""
        return self.inner.load_power(t, *self.all_modes_at(t, y, v)[:2])

    def reactions(self, t: float, y: Array, v: Array) -> list[Reaction]:
        """Joint reactions, with all modes under load."""
        return self.reaction_series(np.array([t]), y[None], v[None]).reactions(0)

    def describe(self) -> dict[str, Any]:
        """Names and sizes for reports."""
        modes = self.modes
        return {
            **self.inner.describe(),
            "bandwidth_hz": self.bandwidth,
            "integrated_modes": len(modes.frequencies_hz),
            "static_modes": len(modes.stiffness),
            "highest_frequency_hz": float(modes.frequencies_hz.max(initial=0.0)),
        }


def _residual(equations: TreeFormulation, t: float, y: Array, v: Array, a: Array) -> Array:
    """(n,) M a - f, from the compiled form where there is one."""
    compiled = equations.compiled
    if compiled is None:
        return equations.residual(t, y, v, a)
    out = np.empty(len(y))
    compiled.residual(compiled.reals, compiled.integers, compiled.scratch, t, y, v, a, out)
    return out


def _mass_matrix(equations: TreeFormulation, t: float, y: Array) -> Array:
    """(n, n) M, from the compiled form where there is one."""
    compiled = equations.compiled
    if compiled is None:
        return equations.mass_matrix(t, y)
    out = np.empty((len(y), len(y)))
    compiled.mass_matrix(compiled.reals, compiled.integers, compiled.scratch, t, y, out)
    return out

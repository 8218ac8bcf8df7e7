"""Derivatives of a motion over a short time, whatever the steps of its run: through impacts, and to where modes switch.

Steps that are held know nothing of a time that moves: where forces change within less than a step, as those of a
contact do when it begins to give way, derivatives of the steps are wrong however small the error of the run is. So the
motion is made once more from where it stood, together with its derivatives δ,

    ÿ = a(t, y, ẏ; p),    δ̈ = ∂a/∂y δ + ∂a/∂ẏ δ̇ + ∂a/∂p,

by steps that are as small as the derivatives need them (E. Hairer, S. P. Nørsett, G. Wanner, Solving ODEs I, II.5).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from erls.equations.compiled_system import CompiledSystem
from erls.equations.system import metre_scales
from erls.equations.tangents import Knots
from erls.errors import Cause, SimulationError
from erls.integrate.base import Leg
from erls.maths.so3 import Array
from erls.sensitivity.equations import Equations
from erls.sensitivity.forces import ComplexForces
from fe_import.model import IntArray

_SMALL, _SLOW = 1e-7, 1e-7
"""Steps of differences along a derivative, of the size of the mechanism, and [m/s]."""
_RTOL, _ATOL = 1e-11, 1e-12  # within a contact rates change by a thousand times what is left of their derivatives
_MOST = 50_000  # states of one passage, whose accelerations and derivatives are found: a minute


class Passage:
    """Equations of a motion and of its derivatives.

    Forces are differentiated by complex steps, which have no size: those of a contact bend within any.

    Parameters
    ----------
    equations : Equations
        Of the run.
    bare : CompiledSystem
        Its equations without modes.
    held : callable
        (h,) coordinates whose joints stick now.
    reach : float
        Size of the mechanism [m].
    """

    def __init__(
        self, equations: Equations, bare: CompiledSystem, held: Callable[[], IntArray], reach: float
    ) -> None:
        self._equations, self._held, self._reach = equations, held, reach
        self._system = equations.system
        self._metres = metre_scales(self._system)
        self._forces = ComplexForces(bare)
        self._made = 0

    def over(self, times: Array, leg: Leg, y: Array, v: Array, changes: Array) -> Array:
        """(k, 3, n, c) derivatives of coordinates, rates and accelerations at times (k,), from (2, n, c) at a state.

        Parameters
        ----------
        times : (k + 1,) array
            That of the state first.
        leg : Leg
            Between whose first and last time forces are asked for.
        y, v : (n,) arrays
            The state.
        changes : (2, n, c) array
            The last p of them by the p parameters; those before are what becomes of changes of the state alone.

        Raises
        ------
        SimulationError
            BUDGET: too many steps.
        """
        from scipy.integrate import DOP853  # here: most derivatives need none of it

        self._made = 0
        n, shape = len(y), changes.shape[1:]
        start = np.concatenate([y, v, changes.ravel()])
        span = float(times[-1] - times[0])
        far, fast = np.abs(changes).max(axis=1)  # by each parameter
        sizes = np.maximum(far, span * fast), np.maximum(fast, far / span)
        tolerances = np.concatenate(
            [np.full(2 * n, _ATOL * self._reach), *(np.tile(_RTOL * np.maximum(size, _ATOL), n) for size in sizes)]
        )

        def slope(t: float, z: Array) -> Array:
            return self._slope(min(max(t, leg.first), leg.last), z, n, shape)

        first = float(times[1] - times[0])
        solver = DOP853(
            slope, float(times[0]), start, float(times[-1]), first_step=first, rtol=_RTOL, atol=tolerances
        )
        found, known = np.empty((len(times) - 1, 3, *shape)), 0
        while known < len(found):
            told = solver.step()
            if solver.status == "failed" or self._made > _MOST:
                raise _too_long(solver.t, told or f"{self._made} states")
            within = solver.dense_output()
            while known < len(found) and times[known + 1] <= solver.t:
                t = float(times[known + 1])
                z = within(t)
                found[known, :2] = z[2 * n :].reshape(2, *shape)
                found[known, 2] = slope(t, z)[2 * n :].reshape(2, *shape)[1]
                known += 1
        return found

    def _slope(self, t: float, z: Array, n: int, shape: tuple[int, ...]) -> Array:
        y, v = z[:n], z[n : 2 * n]
        changes = z[2 * n :].reshape(2, *shape)
        try:
            a = self._system.acceleration(t, y, v)
        except SimulationError:  # a step too far, which is rejected
            return np.full_like(z, np.nan)
        return np.concatenate([v, a, changes[1].ravel(), self.gains(t, y, v, a, changes).ravel()])

    def transition(self, times: Array, leg: Leg, y: Array, v: Array) -> Array:
        """(k, 3, n, 2n + p) derivatives at times (k,) by the coordinates and rates (n,) of a state, and by parameters.

        Parameters
        ----------
        times, leg, y, v
            As of `over`.
        """
        n, count = len(y), len(self._equations.derivatives)
        units = np.concatenate([np.eye(2 * n), np.zeros((2 * n, count))], axis=1)
        return self.over(times, leg, y, v, units.reshape(2, n, -1))

    def gains(self, t: float, y: Array, v: Array, a: Array, changes: Array) -> Array:
        """(n, c) derivatives of the accelerations (n,) of a state, from (2, n, c) of the state, as of `over`."""
        n, columns = changes.shape[1:]
        self._made += 1
        right = self.forces(t, y, v, a)
        right = np.concatenate([np.zeros((n, columns - right.shape[1])), right], axis=1)
        if columns > 2 * n:
            right += self.tangents(t, y, v, a) @ changes.reshape(2 * n, columns)
        else:
            right += np.stack([self._forces.slope(t, y, v, a, changes[:, :, k]) for k in range(columns)], axis=1)
        right[self._held()] = 0.0
        return np.asarray(-np.linalg.solve(self._system.mass_matrix(t, y), right))

    def forces(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n, p) ∂R/∂p of a state."""
        return np.asarray(self._equations.forces(Knots(np.array([t]), y[None], v[None], a[None]))[0])

    def tangents(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n, 2n) ∂R/∂(y, v) of a state."""
        n = len(y)
        return np.stack([self._forces.slope(t, y, v, a, unit.reshape(2, n)) for unit in np.eye(2 * n)], axis=1)

    def gains_back(self, t: float, y: Array, v: Array, a: Array, asked: Array) -> tuple[Array, Array]:
        """The transpose of `gains`: from derivatives (n, c) by accelerations, (2, n, c) by the state, (p, c) by
        parameters.
        """
        found = -np.linalg.solve(self._system.mass_matrix(t, y).T, asked)
        found[self._held()] = 0.0
        return (self.tangents(t, y, v, a).T @ found).reshape(2, len(y), -1), self.forces(t, y, v, a).T @ found

    def share(self, change: Array) -> float:
        """Step along a change (2, n) of a state for differences; 0 where there is none."""
        far, fast = np.abs(change * self._metres).max(axis=1, initial=0.0)
        most = max(far / (_SMALL * self._reach), fast / _SLOW)
        return 1 / most if most > 0 else 0.0


def _too_long(t: float, told: str) -> SimulationError:
    return SimulationError(
        Cause.BUDGET,
        f"derivatives through a contact take too many steps: {told}",
        where=f"t = {t:.9g} s",
        limit=f"{_MOST} states in one contact",
        remedy="end the run before contacts that last, or make links rigid whose vibrations are quick",
    )

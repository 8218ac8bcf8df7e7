"""SciPy's adaptive solvers of initial value problems, in the first-order form x = [y, v].

Explicit Runge-Kutta pairs RK45 (Dormand & Prince, 1980) and DOP853 (Hairer, Nørsett & Wanner, 1993); implicit
Radau IIA of order 5 (Hairer & Wanner, 1996), BDF (Shampine & Reichelt, 1997) and LSODA (Petzold, 1983).

Error weights: ``atol`` is in metres, so coordinate i gets ``atol / length_scales[i]``. Its velocity gets ten
times that per second: vibrations that matter are of 10 rad/s or faster, with velocities that much larger.

Knots: quintic Hermite interpolation between the ends of steps is more accurate than SciPy's own interpolants,
except in the long steps of DOP853. There the interpolant yields accelerations at three inner times, and the
polynomial of degree 8 that meets those and both ends yields y and v, consistent with one another as the
interpolant's are not. Positions of the multistep methods BDF and LSODA jitter by their local error, which
velocities between knots magnify: some ten times in smooth motion, more in stiff transients.

The implicit methods get the Jacobian of the stiff terms instead of 2n differences of right-hand sides. SciPy
does not tell their rejected steps and Newton iterations; these stay 0 in `Work`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from erls.equations.system import SecondOrderSystem, metre_scales
from erls.errors import Cause, SimulationError
from erls.integrate.base import Integrator, Leg, Observer, Options, Solution, hermite
from erls.integrate.driver import Recorder, integrate_legs, not_finite, recorder_for
from erls.integrate.memory import Memory, taken
from erls.maths.so3 import Array

VELOCITY_PER_METRE = 10.0  # 1/s, of the absolute tolerance
_WORST = np.array([0.5, 0.5 + 0.05**0.5])  # where quintic Hermite interpolation errs most in y and in v
MANY_STEPS = 20_000  # of an explicit method, beyond which it warns


_INNER = np.array([0.25, 0.5, 0.75])  # knots added to a step


def _rows(at: Array, order: int) -> Array:
    """(k, 9) derivative of the monomials up to degree 8."""
    powers = np.arange(9)
    factors = np.prod([np.maximum(powers - i, 0) for i in range(order)], axis=0)
    rows: Array = factors * at[:, None] ** np.maximum(powers - order, 0)
    return rows


_ENDS = np.array([0.0, 1.0])
_FILL = np.vstack([_rows(_INNER, 0), _rows(_INNER, 1)]) @ np.linalg.inv(
    np.vstack([_rows(_ENDS, 0), _rows(_ENDS, 1), _rows(_ENDS, 2), _rows(_INNER, 2)])
)  # (6, 9): y and v inside a step of length 1 from y, v, a at its ends and a inside

Knot = tuple[float, Array, Array, Array]


class _Method(NamedTuple):
    name: str  # in SciPy
    stable_to: float = math.inf  # largest y with |R(iy)| <= 1 for the stability function R, times ω h
    refine: bool = False  # the interpolant is as accurate as the steps
    has_rates: bool = False  # at the end of each step

    @property
    def solver(self) -> Any:
        """SciPy's class."""
        import scipy.integrate  # here: slow to import

        return getattr(scipy.integrate, self.name)


METHODS = {
    "rk45": _Method("RK45", stable_to=0.997, has_rates=True),
    "dop853": _Method("DOP853", stable_to=5.960, refine=True, has_rates=True),
    "radau": _Method("Radau", has_rates=True),
    "bdf": _Method("BDF"),
    "lsoda": _Method("LSODA"),
}


def explicit_step_limit(
    system: SecondOrderSystem, t: float, y: Array, v: Array, method: str
) -> tuple[float, float]:
    """Highest undamped frequency [Hz] of (K, M) at this state, and the largest stable step [s].

    Parameters
    ----------
    method : str
        A member of ``METHODS``; the step of an implicit one is infinite.
    """
    stiffness, _ = system.stiffness_and_damping(t, y, v)
    squares = np.linalg.eigvals(np.linalg.solve(system.mass_matrix(t, y), stiffness))
    omega = math.sqrt(float(np.abs(squares).max(initial=0.0)))
    return omega / (2 * math.pi), METHODS[method].stable_to / omega if omega > 0 else math.inf


def _warn_of_stiffness(
    name: str, system: SecondOrderSystem, times: tuple[float, float], y: Array, v: Array
) -> list[str]:
    """At most one warning; none when the system fails at the start, which the run itself will report."""
    try:
        frequency, limit = explicit_step_limit(system, times[0], y, v, name)
    except (np.linalg.LinAlgError, SimulationError):
        return []
    steps = (times[1] - times[0]) / limit
    if steps <= MANY_STEPS:
        return []
    return [
        f"{name} is explicit: the highest frequency, {frequency:.4g} Hz, limits its step to {limit:.3g} s, "
        f"so this run needs at least {steps:.3g} steps; the default integrator, generalized_alpha, is "
        "implicit and has no such limit"
    ]


def scipy_method(name: str) -> Integrator:
    """The integrator that runs SciPy's ``METHODS[name]``."""
    method = METHODS[name]

    def integrate(
        system: SecondOrderSystem,
        times: tuple[float, float],
        y: Array,
        v: Array,
        options: Options,
        observer: Observer | None = None,
    ) -> Solution:
        recorder = recorder_for(system, observer, options)
        run = _Run(method, system, options, recorder)
        if math.isfinite(method.stable_to):
            recorder.warnings.extend(_warn_of_stiffness(name, system, times, np.asarray(y), np.asarray(v)))
        return integrate_legs(system, times, y, v, recorder, run, options.keeper)

    integrate.__name__ = name
    integrate.__doc__ = f"Integrate with SciPy's {method.name}; ``options.step`` is its largest step."
    return integrate


def _acceleration_of(system: SecondOrderSystem) -> Callable[[float, Array, Array], Array]:
    """The accelerations of a system, from its compiled form where there is one."""
    compiled = system.compiled
    if compiled is None:
        return system.acceleration
    constants = (compiled.reals, compiled.integers, compiled.scratch)

    def acceleration(t: float, y: Array, v: Array) -> Array:
        out = np.empty(len(y))
        if compiled.acceleration(*constants, t, np.ascontiguousarray(y), np.ascontiguousarray(v), out):
            return system.acceleration(t, y, v)  # says which coordinate nothing resists
        return out

    return acceleration


class _Run:
    """A `Method`: one run with one of SciPy's solvers. Explicit ones can be resumed: their state is numbers and arrays.
    """

    def __init__(
        self, method: _Method, system: SecondOrderSystem, options: Options, recorder: Recorder
    ) -> None:
        self.method, self.system, self.recorder, self.work = method, system, recorder, recorder.work
        self.n, self.explicit = system.size, math.isfinite(method.stable_to)
        self.resumable = self.explicit
        self.solver: Any = None
        self.old: Knot
        self.resumable = self.explicit
        per_metre = 1 / metre_scales(system)
        self.settings: dict[str, Any] = {
            "rtol": options.rtol,
            "atol": options.atol * np.concatenate([per_metre, VELOCITY_PER_METRE * per_metre]),
            "max_step": options.step or np.inf,
        }
        if not self.explicit:
            self.settings["jac"] = self.jacobian
        self.leg = Leg(0.0, 0.0, 0.0, 0.0)
        self.accelerate = _acceleration_of(system)
        self.suspect: tuple[float, Array] | None = None  # last evaluation, when it was not finite

    def inside(self, t: float) -> float:
        """The time to ask for forces at (rule 3)."""
        return min(max(float(t), self.leg.first), self.leg.last)

    def derivative(self, t: float, x: Array) -> Array:
        """(2n,) rates of x = [y, v]."""
        self.work.rhs_calls += 1
        a = self.accelerate(self.inside(t), x[: self.n], x[self.n :])
        self.suspect = None if math.isfinite(a.sum()) else (t, a)
        return np.concatenate([x[self.n :], a])

    def jacobian(self, t: float, x: Array) -> Array:
        """(2n, 2n) ∂(rates)/∂x from the stiff terms, which is what a chord iteration needs."""
        n, t = self.n, self.inside(t)
        stiffness, damping = self.system.stiffness_and_damping(t, x[:n], x[n:])
        result = np.zeros((2 * n, 2 * n))
        result[:n, n:] = np.eye(n)
        result[n:] = -np.linalg.solve(self.system.mass_matrix(t, x[:n]), np.hstack([stiffness, damping]))
        return result

    def begin(self, leg: Leg, y: Array, v: Array, a: Array) -> None:
        """Stand at the start of a leg."""
        self.leg, self.old = leg, (leg.start, y, v, a)
        x = np.concatenate([y, v])
        self.solver = self.guarded(self.method.solver, self.derivative, leg.start, x, leg.end, **self.settings)

    def memory(self) -> Memory:
        """What an explicit solver knows between two steps."""
        solver = self.solver
        known = np.array([solver.t, solver.h_abs])
        return {"solver.leg": np.array(self.leg), "solver.known": known, "solver.y": solver.y, "solver.f": solver.f}

    def restore(self, memory: Memory) -> None:
        """As another run left it."""
        self.leg = leg = Leg(*taken(memory, "solver.leg", np.zeros(4)).tolist())
        y, f = (taken(memory, f"solver.{name}", np.zeros(2 * self.n)) for name in ("y", "f"))
        with_step = {**self.settings, "first_step": leg.end - leg.start}  # any: it asks for no trial
        self.solver = self.guarded(self.method.solver, self.derivative, leg.start, y, leg.end, **with_step)
        solver = self.solver
        (solver.t, solver.h_abs), solver.f = taken(memory, "solver.known", np.zeros(2)).tolist(), f
        solver.status = "running" if solver.t < leg.end else "finished"
        self.old = self.knot(solver)

    def finish(self, leg: Leg) -> tuple[Array, Array]:
        """Adaptive steps over the rest of a leg."""
        solver, recorder = self.solver, self.recorder
        while solver.status == "running":
            old = self.old
            calls, factored = self.work.rhs_calls, solver.nlu
            message = self.guarded(solver.step)
            self.work.factorizations += int(solver.nlu - factored)  # LSODA counts in its own type
            # LSODA does not stop by itself when its steps are lost in rounding
            stuck = solver.status == "running" and solver.t - old[0] < 10 * np.spacing(abs(old[0]))
            if stuck or solver.status == "failed" or not np.isfinite(solver.y).all():
                raise self.failure(solver, message)
            if self.explicit:
                self.work.rejected_steps += (self.work.rhs_calls - calls) // solver.n_stages - 1
            new = self.knot(solver)
            if self.method.refine:
                self.add_knots(solver.dense_output(), old, new, recorder)
            recorder.append(*new)
            self.old = new
            recorder.accept(new[0])
        return self.old[1], self.old[2]

    def knot(self, solver: Any) -> Knot:
        """The end of the last step."""
        t, y, v = float(solver.t), solver.y[: self.n], solver.y[self.n :]
        if self.method.has_rates:
            return t, y, v, solver.f[self.n :]
        return t, y, v, self.acceleration(t, y, v)

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """M⁻¹ f, counted."""
        self.work.rhs_calls += 1
        return self.accelerate(self.inside(t), y, v)

    def add_knots(self, dense: Any, old: Knot, new: Knot, recorder: Recorder) -> None:
        """Add three knots inside a step where quintic interpolation between its ends misses the tolerance."""
        t, y, v, a = (np.array(pair) for pair in zip(old, new, strict=True))
        h = t[1] - t[0]
        at = t[0] + h * _WORST
        found = np.concatenate(hermite(t, y, v, a, at), axis=1)
        miss = np.abs(found - dense(at).T) / (self.settings["atol"] + self.settings["rtol"] * np.abs(found))
        if miss.max() <= 1:
            return
        inner = t[0] + h * _INNER
        rates = np.array([self.acceleration(time, *np.split(dense(time), 2)) for time in inner])
        filled = _FILL @ np.concatenate([y, h * v, h * h * a, h * h * rates])
        for k, time in enumerate(inner):
            recorder.append(time, filled[k], filled[k + 3] / h, rates[k])

    def guarded(self, call: Callable[..., Any], *args: Any, **settings: Any) -> Any:
        """Call SciPy without its warnings, which repeat what it reports; explain what NaN makes it raise."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return call(*args, **settings)
        except (ValueError, np.linalg.LinAlgError):
            if self.suspect is None:
                raise
            raise not_finite(*self.suspect) from None

    def failure(self, solver: Any, message: str | None) -> SimulationError:
        """Why the solver stopped."""
        t = float(solver.t)
        if self.suspect is not None:
            return not_finite(*self.suspect)
        if not np.isfinite(solver.y).all():
            return not_finite(t, solver.y)
        a = solver.fun(t, solver.y)[self.n :]
        worst = int(np.abs(a * metre_scales(self.system)).argmax())
        return SimulationError(
            Cause.STEP_TOO_SMALL,
            "no step is small enough for the tolerances; "
            f"coordinate {worst} (counted from 0) accelerates most",
            where=f"t = {t:.9g} s",
            value=(message or "").strip() or "no progress",
            remedy="check forces that act on this coordinate, for jumps without breakpoint and growth "
            "without bound first; then try larger tolerances or the default integrator, generalized_alpha",
        )


rk45, dop853, radau, bdf, lsoda = map(scipy_method, ("rk45", "dop853", "radau", "bdf", "lsoda"))

"""Parameters that make a run follow a record: weighted least squares with exact gradients, and what they leave open.

    min Σ_c Σ_k ((m_ck - x_c(t_k, p)) / σ_c)²

over the columns c of a record and its times t_k. The noise σ_c of each column is not known: it is what a fit leaves,
and the fit is made again with it (iteratively weighted least squares). Gradients are those of `erls.sensitivities`, by
which scipy's trust-region method (M. A. Branch, T. F. Coleman, Y. Li, 1999) finds the least.

With the Jacobian J of the weighted residuals the covariance of the parameters is (JᵀJ)⁻¹, which for white noise is the
Cramér-Rao bound; half-widths of intervals are Student's at 95 %. Directions of parameters, each in units of its own
size, in which this is larger than one cannot be told from the record: they are named, and have no interval.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.optimize
import scipy.stats

from erls.errors import Cause, SceneError, SimulationError
from erls.identify.keys import fitted_keys
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.scene.build_joints import led_by_inversion
from erls.scene.chain import Scene
from erls.scene.read import load_chain
from erls.sensitivity.parameters import parameters_of
from erls.sensitivity.sensitivities import sensitivities
from erls.simulation.simulate import simulate
from erls.studies.overlay import Matched, matched
from erls.studies.sweep.quantities import histories
from fe_import.errors import ReportedError

LEVEL = 0.95
"""Of intervals."""

_ROUNDS, _SETTLED = 6, 0.01  # of weights, and their change at which they are settled
_STEPS = 60  # of a fit
_LEAST = 0.1  # of where a parameter began: the size of one that came below it
_OPEN = 1.0  # of the size of a parameter: a larger uncertainty is none
_ROUNDING = 1e-7  # of the largest singular value: gradients are right to 1e-8
_ALIKE = 0.2  # correlation of successive residuals that white noise has in one record of a thousand with 200 rows


@dataclass(frozen=True)
class Fitted:
    """A parameter.

    Attributes
    ----------
    start, value : float
        In the unit of its field.
    half_width : float or None
        Of its interval at 95 %, for white noise; None where the record does not tell it, or a bound stopped it.
    """

    start: float
    value: float
    half_width: float | None


@dataclass(frozen=True)
class Column:
    """A column of the record.

    Attributes
    ----------
    measured, simulated : (k,) arrays
    before : (k,) array
        Of the scene as it was.
    noise : float
        Standard deviation of what the fit leaves, in its unit.
    likeness : float
        Correlation of successive residuals; large ones say that the model, not noise, is what is left.
    """

    measured: Array
    simulated: Array
    before: Array
    noise: float
    likeness: float


@dataclass(frozen=True)
class Identification:
    """What came of a fit.

    Attributes
    ----------
    scene : Path
    record : Path
    parameters : dict of Fitted
    columns : dict of Column
        By their heads in the table of the run.
    times : (k,) array
        [s]
    covariance : (p, p) array
        Of the parameters; infinite entries where they are not told.
    not_told : tuple of tuple of str
        Groups of parameters of which only a combination, or nothing, is told by the record.
    warnings : tuple of str
    runs : int
    wall_s : float
    run : ChainRun
        With the values that were found.
    """

    scene: Path
    record: Path
    parameters: dict[str, Fitted]
    columns: dict[str, Column]
    times: Array
    covariance: Array
    not_told: tuple[tuple[str, ...], ...]
    warnings: tuple[str, ...]
    runs: int
    wall_s: float
    run: ChainRun


def identify(
    scene: Path | str,
    measured: Path | str,
    fit: Sequence[str],
    *,
    overrides: Sequence[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    progress: Callable[[float, float], None] = lambda done, total: None,
) -> Identification:
    """Fit numbers of a scene to a measured record.

    Parameters
    ----------
    scene : Path or str
        Of a chain. Its values are where the fit begins.
    measured : Path or str
        CSV: time in its first column, then columns with the heads of the run's table (``erls view -o RUN.csv``).
    fit : sequence of str
        Keys as ``--set`` takes them, or patterns of them.
    overrides : sequence of str
        ``KEY=VALUE``.
    bounds : mapping of str to (low, high), optional
        Of parameters; those that are not bounded keep the sign that they begin with.
    progress : callable
        Called with (steps, most).

    Raises
    ------
    SceneError, FEImportError
        Bad input; more parameters than rows.
    SimulationError
        The first run failed, or no step makes the fit better and it is not at its least.
    """
    begun = time.perf_counter()
    loaded = load_chain(scene, overrides)
    led = led_by_inversion(loaded.record)
    if led:
        message, remedy = "what is fed forward would follow what is fitted", "give its tables of torque and motion"
        raise SceneError(Cause.BAD_FIELD, message, where=f"{loaded.path}: joint {led[0]}", remedy=remedy)
    keys = fitted_keys(loaded, fit)
    first = simulate(loaded, verdict=False)
    held = matched(first, Path(measured), "--measured")
    if len(held.times) * len(held.columns) <= len(keys):
        message, limit = "more parameters than measured numbers", len(held.times) * len(held.columns)
        raise SceneError(Cause.BAD_FIELD, message, where="--fit", value=len(keys), limit=limit, remedy="fit fewer")
    problem = _Problem(Path(scene), tuple(overrides), loaded, keys, held, first, progress)
    limits = _limits(problem, bounds or {})
    shares, noise = problem.fitted(limits)
    stopped = problem.at_bound(shares, limits)
    parameters, covariance, not_told = _intervals(problem, shares, noise)
    parameters |= {key: replace(parameters[key], half_width=None) for key in stopped}
    after, before = problem.columns(shares), problem.of(first)
    columns = {
        name: Column(values, after[name], before[name], noise[name], _likeness(values - after[name]))
        for name, values in held.columns.items()
    }
    run = problem.run(shares)
    assert run is not None
    return Identification(
        scene=Path(scene),
        record=Path(measured),
        parameters=parameters,
        columns=columns,
        times=held.times,
        covariance=covariance,
        not_told=not_told,
        warnings=tuple(_warnings(held, columns, stopped)),
        runs=problem.runs,
        wall_s=time.perf_counter() - begun,
        run=run,
    )


class _Problem:
    """Residuals and their gradients, by shares: parameters over their sizes."""

    def __init__(
        self,
        path: Path,
        overrides: tuple[str, ...],
        scene: Scene,
        keys: list[str],
        held: Matched,
        first: ChainRun,
        progress: Callable[[float, float], None],
    ) -> None:
        found = parameters_of(scene, keys)
        zero = [one.key for one in found if one.value == 0]
        if zero:
            message, remedy = "a fit cannot begin at zero", f"--set {zero[0]}=..., about where it should be"
            raise SceneError(Cause.BAD_FIELD, message, where="--fit", value=zero[0], remedy=remedy)
        self.path, self.overrides, self.keys, self.held, self.progress = path, overrides, keys, held, progress
        self.start = np.array([one.value for one in found])
        self.names = {name: name.rpartition(" [")[0] for name in held.columns}
        self.weights = {name: float(np.std(values)) or 1.0 for name, values in held.columns.items()}
        self.runs, self.steps = 1, 0
        self._known: dict[bytes, ChainRun | None] = {np.ones(len(keys)).tobytes(): first}

    def run(self, shares: Array) -> ChainRun | None:
        """The run with these values; None where the scene or the run is refused."""
        name = shares.tobytes()
        if name not in self._known:
            values = zip(self.keys, (shares * self.start).tolist(), strict=True)
            try:
                scene = load_chain(self.path, [*self.overrides, *(f"{key}={value!r}" for key, value in values)])
                found: ChainRun | None = simulate(scene, verdict=False)
            except ReportedError as problem:
                if problem.cause == Cause.INTERRUPTED:
                    raise
                found = None
            self.runs += 1
            self._known = {name: found, **dict(list(self._known.items())[:1])}
        return self._known[name]

    def of(self, run: ChainRun) -> dict[str, Array]:
        """(k,) columns of a run."""
        found = histories(run, list(self.names.values()), self.held.times)
        return dict(zip(self.names, found, strict=True))

    def columns(self, shares: Array) -> dict[str, Array]:
        """(k,) columns with these values."""
        run = self.run(shares)
        assert run is not None
        return self.of(run)

    def residuals(self, shares: Array) -> Array:
        """(c k,) weighted; not numbers where there is no run, which a trust region takes for too long a step."""
        self.progress(min(self.steps, _STEPS - 1), _STEPS)
        run = self.run(shares)
        if run is None:
            return np.full(len(self.held.times) * len(self.names), math.nan)
        found = self.of(run)
        return np.concatenate([(found[n] - v) / self.weights[n] for n, v in self.held.columns.items()])

    def jacobian(self, shares: Array) -> Array:
        """(c k, p) of the residuals by the shares."""
        run = self.run(shares)
        assert run is not None
        self.steps += 1
        names, weights = list(self.names.values()), np.array([self.weights[head] for head in self.names])
        outputs = {"columns": lambda run: histories(run, names, self.held.times)}  # together: they share their table
        sizes = dict(zip(self.keys, np.abs(self.start).tolist(), strict=True))
        found = sensitivities(run, outputs, sizes).derivatives["columns"]
        columns = [
            (np.asarray(found[key]) / weights[:, None]).ravel() * start
            for key, start in zip(self.keys, self.start.tolist(), strict=True)
        ]
        return np.stack(columns, axis=1)

    def fitted(self, limits: tuple[Array, Array]) -> tuple[Array, dict[str, float]]:
        """Shares, and the noise of each column; weights settle on the way."""
        shares, noise = np.ones(len(self.keys)), dict(self.weights)
        for _ in range(_ROUNDS):
            found = scipy.optimize.least_squares(
                self.residuals, shares, self.jacobian, limits, xtol=1e-10, ftol=1e-12, gtol=1e-10, max_nfev=_STEPS
            )
            if found.status <= 0:
                message = f"the fit did not come to its least in {_STEPS} steps"
                remedy = "begin nearer (--set), fit fewer numbers, or bound them"
                raise SimulationError(Cause.NEWTON_FAILED, message, where="identify", remedy=remedy)
            shares, before = found.x, noise
            noise = self._noise(shares)
            if all(abs(noise[name] - before[name]) <= _SETTLED * before[name] for name in noise):
                break
            self.weights = dict(noise)
        return shares, noise

    def _noise(self, shares: Array) -> dict[str, float]:
        """Standard deviations of what is left, each column with its share of the parameters."""
        found, rows = self.columns(shares), len(self.held.times)
        free = max(rows - len(self.keys) / len(self.names), 1.0)
        left = {name: float(np.sqrt(((found[name] - v) ** 2).sum() / free)) for name, v in self.held.columns.items()}
        least = {name: 1e-9 * float(np.abs(v).max()) or 1e-12 for name, v in self.held.columns.items()}
        return {name: max(left[name], least[name]) for name in left}

    def at_bound(self, shares: Array, limits: tuple[Array, Array]) -> list[str]:
        """Parameters that stopped at a bound."""
        near = [np.isfinite(side) & (np.abs(shares - side) <= 1e-6) for side in limits]
        return [key for key, low, high in zip(self.keys, *near, strict=True) if low or high]


def _limits(problem: _Problem, bounds: Mapping[str, tuple[float, float]]) -> tuple[Array, Array]:
    """Of shares: those given, otherwise those that keep the sign."""
    low, high = np.full(len(problem.keys), 1e-6), np.full(len(problem.keys), np.inf)
    for key, ends in bounds.items():
        if key not in problem.keys:
            message, remedy = "not fitted", f"fitted are {', '.join(problem.keys)}"
            raise SceneError(Cause.BAD_REFERENCE, message, where="--bounds", value=key, remedy=remedy)
        k = problem.keys.index(key)
        low[k], high[k] = sorted(end / problem.start[k] for end in ends)
        if not low[k] < 1 < high[k]:
            message, remedy = "the start is not between the bounds", "change them, or --set the start"
            own = float(problem.start[k])
            raise SceneError(Cause.BAD_FIELD, message, where="--bounds", value=own, limit=list(ends), remedy=remedy)
    return low, high


def _intervals(
    problem: _Problem, shares: Array, noise: Mapping[str, float]
) -> tuple[dict[str, Fitted], Array, tuple[tuple[str, ...], ...]]:
    """Parameters with their intervals, their covariance, and what is not told."""
    problem.weights = dict(noise)
    sizes = np.maximum(shares, _LEAST)  # a fit may drift to nothing along what is not told
    found_values = sizes * problem.start
    jacobian = problem.jacobian(shares) * sizes  # by parameters over the sizes that were found
    _, strength, directions = np.linalg.svd(jacobian, full_matrices=False)
    strength = np.maximum(strength, _ROUNDING * strength[0])
    parts = np.abs(directions) > _OPEN * strength[:, None]  # relative uncertainty by each direction beyond the limit
    open_ = parts.any(axis=1)
    not_told = tuple(
        tuple(key for key, part in zip(problem.keys, row, strict=True) if part) for row in parts[open_].tolist()
    )
    lost = parts.any(axis=0)
    kept = directions[~open_] / strength[~open_, None]
    covariance = (kept.T @ kept) * np.outer(found_values, found_values)
    covariance[lost], covariance[:, lost] = math.inf, math.inf
    width = scipy.stats.t.ppf((1 + LEVEL) / 2, jacobian.shape[0] - jacobian.shape[1])
    found = {
        key: Fitted(start, share * start, None if none else float(width * math.sqrt(covariance[k, k])))
        for k, (key, start, share, none) in enumerate(
            zip(problem.keys, problem.start.tolist(), shares.tolist(), lost.tolist(), strict=True)
        )
    }
    return found, covariance, not_told


def _likeness(residuals: Array) -> float:
    """Correlation of successive ones."""
    apart = residuals - residuals.mean()
    power = float(apart @ apart)
    return float(apart[1:] @ apart[:-1]) / power if power > 0 else 0.0


def _warnings(held: Matched, columns: Mapping[str, Column], bound: Sequence[str]) -> list[str]:
    found = [f"column {name!r} is not one of the run: left out" for name in held.unknown]
    if held.outside:
        found.append(f"{held.outside} rows lie outside the run: left out")
    found += [f"{key} stopped at a bound: it has no interval, and those of the others hold it there" for key in bound]
    limit = max(_ALIKE, 3.3 / math.sqrt(len(held.times)))
    alike = [name for name, column in columns.items() if abs(column.likeness) > limit]
    if alike:
        found.append(f"what is left of {', '.join(alike)} is no white noise: the model lacks something, and intervals "
                     "say nothing of that")  # fmt: skip
    return found


def summary(found: Identification) -> dict[str, Any]:
    """The JSON of ``erls identify``."""
    return {
        "scene": str(found.scene),
        "record": str(found.record),
        "parameters": {
            key: {"start": one.start, "value": one.value, "half_width_95": one.half_width}
            for key, one in found.parameters.items()
        },
        "columns": {
            name: {
                "noise": column.noise,
                "rms_before": float(np.sqrt(np.mean((column.measured - column.before) ** 2))),
                "rms": float(np.sqrt(np.mean((column.measured - column.simulated) ** 2))),
                "correlation_of_residuals": column.likeness,
            }
            for name, column in found.columns.items()
        },
        "not_told": [list(group) for group in found.not_told],
        "warnings": list(found.warnings),
        "runs": found.runs,
        "wall_s": found.wall_s,
    }

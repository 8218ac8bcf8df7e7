"""Equilibria of a scene of bodies and beams at rising load, and what was found about the last one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from erls.equations.nodal.statics import Statics
from erls.errors import Cause, SceneError, SimulationError
from erls.maths.so3 import Array
from erls.run.bodies.run import BodyRun
from erls.run.record import Axis


@dataclass(frozen=True)
class Modes:
    """What a buckling or frequency analysis found about the last equilibrium.

    Attributes
    ----------
    quantity : str
        What is asked for: ``load`` or ``frequency_hz``.
    values : (k,) array
    moved, turned : (k, n, 3) array
        How the nodes move and turn, in the world; the largest displacement is 1 m.
    """

    quantity: str
    values: Array
    moved: Array
    turned: Array


@dataclass(frozen=True, repr=False)
class BodyRest(BodyRun):
    """Equilibria over the load parameter, known at the load steps.

    Attributes
    ----------
    statics : Statics
    modes : Modes or None
        Of a buckling or frequency analysis.
    tangents : dict
        Work of each tangent, if asked for.
    """

    axis: ClassVar[Axis] = Axis("load parameter", "load", "")
    statics: Statics
    modes: Modes | None = None
    tangents: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def failure(self) -> SimulationError | None:
        """Why there are no more equilibria."""
        return self.statics.failure

    @property
    def times(self) -> Array:
        """(k,) load parameters of the load steps."""
        return np.array([e.t for e in self.statics.path])

    def nearest(self, times: ArrayLike) -> Array:
        """(k,) load parameters of the nearest load steps."""
        known, wanted = self.times, np.asarray(times, dtype=float).ravel()
        if not len(known):
            return known
        return np.asarray(known[np.searchsorted((known[1:] + known[:-1]) / 2, wanted)])

    def within(self, t: ArrayLike) -> Array:
        """(k,) load parameters of load steps.

        Raises
        ------
        SceneError
            TIME_OUT_OF_RANGE: one at which there was no load step.
        """
        flat = np.asarray(t, dtype=float).ravel()
        known = self.nearest(flat)
        bad = np.abs(known - flat) > 1e-9 * max(self.end, 1e-300) if len(known) else np.ones(len(flat), dtype=bool)
        if bad.any():
            raise SceneError(
                Cause.TIME_OUT_OF_RANGE,
                f"no equilibrium was computed at this {self.axis.name}",
                where="t",
                value=float(flat[bad][0]),
                limit=", ".join(f"{x:g}" for x in self.spread(9)) or "none was",
                remedy="ask at a load step, or change simulation.load_steps",
            )
        return known

    def poses(self, t: ArrayLike, nodes: Sequence[int] | None = None) -> Array:
        """(k, n, 4, 4) poses of nodes, all unless given."""
        steps = self._steps(t)
        found = np.array([self.statics.path[k].q.poses for k in steps])
        found = found.reshape(len(steps), self.assembly.system.count, 4, 4)
        return found if nodes is None else found[:, list(nodes)]

    def velocities(self, t: Array) -> Array:
        """(k, 6 n) zeros."""
        return np.zeros((len(t), self.assembly.system.size))

    def multipliers(self, t: Array) -> Array:
        """(k, m) of the conditions of connections."""
        steps = self._steps(t)
        found = np.array([self.statics.path[k].multipliers for k in steps])
        return found.reshape(len(steps), self.assembly.system.constraints)

    def summary(self, times: Sequence[float] = ()) -> dict[str, Any]:
        """The JSON of ``erls simulate``; ``t`` is the load parameter, samples are of all load steps unless given."""
        asked = list(times) or self.times.tolist()
        path, steps = self.statics.path, self._steps(asked)
        samples = [
            {**sample, "iterations": path[k].iterations} for k, sample in zip(steps, self.samples(asked), strict=True)
        ]
        tangent = self.scene.record.simulation.tangent  # type: ignore[union-attr]
        found = {**self.facts(), "tangent": tangent, **work(self.statics), "wall_s": self.wall_s}
        if self.tangents:
            found["tangents"] = self.tangents
        if self.modes is not None:
            found["modes"] = [
                {
                    self.modes.quantity: value,
                    "points": {name: moved[self.assembly.numbers[name]].tolist() for name in self.point_names},
                }
                for value, moved in zip(self.modes.values.tolist(), self.modes.moved, strict=True)
            ]
        return {**found, **self.stated(), "samples": samples, "warnings": list(self.warnings)}

    def _steps(self, t: ArrayLike) -> list[int]:
        """Load steps at load parameters."""
        found: list[int] = np.searchsorted(self.times, self.within(t)).tolist()
        return found


@dataclass(frozen=True, repr=False)
class BodyPath(BodyRest):
    """Equilibria along their path, known at its steps; it goes along its length.

    Lengths are those of `erls.equations.nodal.bordered.Measure`: places by their root mean square over the nodes in
    sizes of the mechanism, the load parameter in shares of where the path ends.
    """

    axis: ClassVar[Axis] = Axis("arc length", "arc", "")

    @property
    def times(self) -> Array:
        """(k,) lengths of the path up to its equilibria."""
        return np.array([e.arc for e in self.statics.path])

    def loads(self, t: Array) -> Array:
        """(k,) load parameters."""
        return np.array([self.statics.path[k].t for k in self._steps(t)])

    def samples(self, times: Sequence[float]) -> list[dict[str, Any]]:
        """As of all runs, with the load parameter and the number of ways in which the equilibrium is unstable."""
        path, steps = self.statics.path, self._steps(times)
        return [
            {**sample, "load": path[k].t, "unstable": path[k].unstable}
            for k, sample in zip(steps, super().samples(times), strict=True)
        ]

    def columns(self, times: Array) -> dict[str, Array]:
        """As of all runs, with the load parameter."""
        (axis, along), *rest = super().columns(times).items()
        return {axis: along, "load [1]": self.loads(times), **dict(rest)}

    def summary(self, times: Sequence[float] = ()) -> dict[str, Any]:
        """With the limit points and bifurcations of the path."""
        turns = [{"kind": x.kind, "load": x.t, "arc": x.arc, "ways": x.ways} for x in self.statics.turns]
        return {**super().summary(times), "turns": turns}

    def displacements(self) -> dict[str, Array]:
        """(k,) how far each reported node is from where it is built [m], at all steps."""
        built = self.origin.poses
        found = {}
        for name in self.point_names:
            at = built[self.assembly.numbers[name], :3, 3]
            found[name] = np.linalg.norm(self.position(name, self.times) - at, axis=-1)
        return found


def work(statics: Statics) -> dict[str, Any]:
    """What equilibria took."""
    iterations = [e.iterations for e in statics.path]
    return {
        "load_steps": len(iterations),
        "iterations": sum(iterations),
        "iterations_per_load_step": iterations,
        "factorizations": statics.factorizations,
        "cut_steps": statics.cut_steps,
        "converged": statics.failure is None,
    }

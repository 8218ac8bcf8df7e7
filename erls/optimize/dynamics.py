"""Designs judged by their motion: an `erls.optimize.evaluation.Evaluator` whose evaluations are runs."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.equations import Nodal
from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.optimize.design import Design, Designs, Message, run_of
from erls.optimize.evaluation import Evaluation, Rules
from erls.optimize.frozen import Frozen, frozen, node_poses, nodal_of
from erls.optimize.gradients import derivatives
from erls.optimize.limits import Limit, Motion, limit_of
from erls.optimize.memory import Memory
from erls.optimize.objective import Objective
from erls.optimize.problem import Problem
from erls.run.chain.run import ChainRun

_STEP = 1e-4  # of variables: what they change of a measure by themselves


@dataclass(frozen=True)
class Place:
    """What does not depend on sections of beams: elements, frozen configurations; ``key`` tells geometries apart."""

    key: bytes
    nodal: Nodal
    frozen: Frozen


class Dynamics:
    """Runs of designs.

    Attributes
    ----------
    analyses : int
        Runs of the motion so far, those from memory included, and without those for derivatives.
    gradient_s, run_s : float
        Time that derivatives and runs took [s].
    gradient : str
        How derivatives were found.
    times : (k,) array
        At which constraints look.
    """

    def __init__(self, problem: Problem, memory: Memory, tell: Message = lambda text: None) -> None:
        self.problem, self._memory, self._tell = problem, memory, tell
        self.designs = Designs(problem, tell)
        self.analyses, self.gradient_s, self.run_s, self.gradient = 0, 0.0, 0.0, ""
        record = problem.record
        samples = [problem.times(c) for c in record.constraints]
        self.times = np.unique(np.concatenate([*samples, [0.0]]))
        self.at = [np.searchsorted(self.times, own) for own in samples]
        self._places: list[Place] = []
        start = self.designs.at(problem.start)
        self._limits_at(start)
        measures = tuple(limit.measure for limit in self._limits_at(start))
        self.rules = Rules(
            problem.lower,
            problem.upper,
            problem.powers,
            tuple(c.name for c in record.constraints),
            tuple(c.limit for c in record.constraints),
            measures,
            tuple(c.times == "aggregate" for c in record.constraints),
            tuple(c.times == "all" for c in record.constraints),
            Objective(problem),
        )

    def place(self, mechanism: Mechanism) -> Place:
        """Of a mechanism; found once for all of the same lengths."""
        key = geometry_key(mechanism)
        for place in self._places:
            if place.key == key:
                return place
        nodal = nodal_of(mechanism, self.problem.scene.record.simulation)
        self._places = [*self._places[-8:], Place(key, nodal, frozen(mechanism, nodal, self.times))]
        return self._places[-1]

    def _limits_at(self, design: Design) -> list[Limit]:
        nodal = self.place(design.mechanism).nodal
        given = zip(self.problem.record.constraints, self.at, strict=True)
        return [limit_of(c, at, self.problem, design.mechanism, design.scene, nodal) for c, at in given]

    def limits(self, x: Array) -> list[Limit]:
        """Constraints at a design."""
        return self._limits_at(self.designs.at(x))

    def motion(self, x: Array) -> Motion:
        """Of a design, at all times; it counts as an analysis."""
        self.analyses += 1
        design = self.designs.at(x)
        known = self._memory.get(x, "poses")
        place = self.place(design.mechanism)
        if known is not None and known.shape == (len(self.times), place.nodal.system.count, 4, 4):
            return Motion(place.frozen, known)
        begun = time.perf_counter()
        run = run_of(design)
        found = Motion(place.frozen, node_poses(run, self.times, place.nodal), run)
        self.run_s += time.perf_counter() - begun
        self._memory.put(x, poses=found.poses)
        return found

    def evaluate(self, x: Array) -> Evaluation:
        """A design by its run."""
        self.analyses += 1
        limits = self.limits(x)
        known = [self._memory.get(x, f"components{k}") for k in range(len(limits))]
        if all(c is not None for c in known) and known:
            return self.rules.evaluation(x, [c for c in known if c is not None])
        begun = time.perf_counter()
        design = self.designs.at(x)
        run = run_of(design)
        components = self._components(run, limits)
        self._last = x, run
        self.run_s += time.perf_counter() - begun
        poses = node_poses(run, self.times, self.place(design.mechanism).nodal)
        self._memory.put(x, poses=poses, **{f"components{k}": c for k, c in enumerate(components)})
        return self.rules.evaluation(x, components)

    _last: tuple[Array, ChainRun] | None = None

    def _components(self, run: ChainRun, limits: Sequence[Limit]) -> list[Array]:
        place = self.place(run.formulation.mechanism)
        nodal = run.formulation if isinstance(run.formulation, Nodal) else place.nodal
        motion = Motion(place.frozen, node_poses(run, self.times, nodal), run)
        return [limit.exact(motion) for limit in limits]

    def differentiate(self, found: Evaluation) -> Evaluation:
        """With derivatives along the run."""
        x, count = found.x, len(found.components)
        known = [self._memory.get(x, f"jacobian{k}") for k in range(count)]
        if all(j is not None for j in known):
            return self.rules.differentiated(found, [j for j in known if j is not None])
        begun = time.perf_counter()
        design, limits = self.designs.at(x), self.limits(x)
        run = self._last[1] if self._last is not None and np.array_equal(self._last[0], x) else run_of(design)
        asked = lambda other: self._components(other, limits)  # noqa: E731
        jacobians, self.gradient = derivatives(self.problem, self.designs, design, run, asked)
        for k, limit in enumerate(limits):
            if limit.of_shape:
                jacobians[k] = jacobians[k] + self._own(x, run, k)
        self.gradient_s += time.perf_counter() - begun
        self._memory.put(x, **{f"jacobian{k}": j for k, j in enumerate(jacobians)})
        return self.rules.differentiated(found, jacobians)

    def _own(self, x: Array, run: ChainRun, k: int) -> Array:
        """(n, q, v) what variables change of components at the same motion: sections have other sizes."""
        place = self.place(run.formulation.mechanism)
        motion = Motion(place.frozen, node_poses(run, self.times, place.nodal), run)
        columns = []
        for v in range(len(x)):
            step = _STEP * max(abs(float(x[v])), 1e-2 * float(self.rules.upper[v] - self.rules.lower[v]))
            sides = []
            for sign in (1.0, -1.0):
                other = x.copy()
                other[v] += sign * step
                sides.append(self._at_same_motion(other, motion, k))
            columns.append((sides[0] - sides[1]) / (2 * step))
        return np.stack(columns, axis=-1)

    def _at_same_motion(self, x: Array, motion: Motion, k: int) -> Array:
        return self.limits(x)[k].exact(motion)


def geometry_key(mechanism: Mechanism) -> bytes:
    """What rigid motions and nodes depend on."""
    parts = [a for joint in mechanism.joints for a in (joint.before, joint.after, [joint.position])]
    parts += [link.model.nodes for link in mechanism.links]
    parts += [end.frame for loop in mechanism.loops for end in (loop.inner, loop.outer)]
    parts += [[float(link.elastic_modes > 0)] for link in mechanism.links]
    return b"".join(np.round(np.asarray(part, dtype=float), 12).tobytes() for part in parts)


def refuse_moving(problem: Problem, dynamics: Dynamics, method: str) -> None:
    """Refuse variables that change where nodes are, and constraints on forces, which frozen loads cannot follow.

    Raises
    ------
    SceneError
    """
    base = geometry_key(dynamics.designs.at(problem.start).mechanism)
    for k, name in enumerate(problem.names):
        other = problem.start.copy()
        other[k] += 1e-3 * max(abs(float(other[k])), 1e-2 * float(problem.upper[k] - problem.lower[k]))
        if geometry_key(dynamics.designs.at(other).mechanism) != base:
            raise SceneError(
                Cause.BAD_FIELD,
                f"{method} holds the motion and its loads: a length that changes them is no variable for it",
                where=f"{problem.path}: variables.{name}",
                remedy='use methods = ["integrated"], or take the variable out',
            )
    for limit in dynamics.limits(problem.start):
        if not limit.of_shape:
            raise SceneError(
                Cause.BAD_FIELD,
                f"{method} holds all loads: it cannot limit them",
                where=f"{problem.path}: constraints.{limit.name}",
                remedy='use methods = ["integrated"], or take the constraint out',
            )

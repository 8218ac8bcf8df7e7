"""Designs judged by their motion: an `erls.optimization.evaluation.Evaluator` whose evaluations are runs."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from erls.equations.nodal.equations import Nodal
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.optimization.design import Design, Designs, Message, run_of, scene_at
from erls.optimization.equivalent_loads import FrozenLoads, flexible
from erls.optimization.evaluation import Evaluation, Rules
from erls.optimization.frozen import Frozen, frozen, nodal_of, node_poses
from erls.optimization.gradients import derivatives
from erls.optimization.limits import Bases, Limit, Motion, Vibration, limit_of
from erls.optimization.link_numbers import LinkNumbers
from erls.optimization.memory import Memory
from erls.optimization.objective import Objective
from erls.optimization.problem import Problem
from erls.optimization.records import FrequencyLimit, VibrationLimit
from erls.run.chain.run import ChainRun

_STEP = 1e-4  # of variables: what they change of a measure by themselves
_PLACES = 16  # mechanisms of other lengths that are kept: those beside a design


@dataclass(frozen=True)
class Place:
    """What does not depend on sections of beams: elements and frozen configurations of a mechanism; constraints of its
    shape alone, by number.
    """

    mechanism: Mechanism
    nodal: Nodal
    frozen: Frozen
    still: dict[int, Limit] = field(default_factory=dict)


class Dynamics:
    """Runs of designs.

    Parameters
    ----------
    problem : Problem
    memory : Memory
    tell : callable
    times : (k,) array, optional
        Samples of all constraints, in place of their own.

    Attributes
    ----------
    run_s, gradient_s : float
        Time that runs and derivatives took [s].
    gradient : str
        How derivatives were found.
    times : (k,) array
        At which constraints look.
    """

    def __init__(
        self, problem: Problem, memory: Memory, tell: Message = lambda text: None, times: Array | None = None
    ) -> None:
        self.problem, self._memory, self._tell = problem, memory, tell
        self.designs, self.numbers = Designs(problem, tell), LinkNumbers(problem)
        self.run_s, self.gradient_s, self.gradient = 0.0, 0.0, ""
        record = problem.record
        samples = [problem.times(c) for c in record.constraints]
        samples = [own if times is None or len(own) == 1 else times for own in samples]
        self.times = np.unique(np.concatenate([*samples, [0.0]]))
        self.at = [np.searchsorted(self.times, own) for own in samples]
        self._weighs = any(p.key.split(".")[0] in ("payloads", "joints") for p in problem.parameters) and any(
            isinstance(c, (FrequencyLimit, VibrationLimit)) for c in record.constraints
        )  # payloads and motors on links
        self._places: list[Place] = []
        self._ran: ChainRun | None = None
        self.start = self.designs.at(problem.start)
        limits = self.limits(self.start)
        self.rules = Rules(
            problem.lower,
            problem.upper,
            problem.powers,
            tuple(c.name for c in record.constraints),
            tuple(limit.limit for limit in limits),
            tuple(limit.measure for limit in limits),
            tuple(c.times == "aggregate" for c in record.constraints),
            tuple(c.times == "all" for c in record.constraints),
            tuple(limit.groups for limit in limits),
            Objective(problem, self.numbers),
        )

    def fresh(self) -> None:
        """Count from nothing."""
        self.run_s, self.gradient_s = 0.0, 0.0

    def keep(self) -> None:
        """Write what is known to the file of the memory."""
        self._memory.flush()

    def place(self, mechanism: Mechanism) -> Place:
        """Of a mechanism; of all designs the same unless variables move nodes."""
        for place in self._places:
            if place.mechanism is mechanism or not self.designs.moving:
                return place
        nodal = nodal_of(mechanism, self.problem.scene.record.simulation)
        made = Place(mechanism, nodal, frozen(mechanism, nodal, self.times))
        self._places = [*self._places[1 - _PLACES :], made]
        return made

    def limits(self, design: Design) -> list[Limit]:
        """Constraints at a design."""
        return self._limits(design.mechanism, design.x)

    def limits_at(self, x: Array) -> list[Limit]:
        """The same where variables move no node."""
        return self._beside(self.start, x)

    def _limits(self, mechanism: Mechanism, x: Array) -> list[Limit]:
        place = self.place(mechanism)
        given = zip(self.problem.record.constraints, self.at, strict=True)
        about = self.problem, mechanism, place.nodal, place.frozen, self.numbers
        found = [place.still.get(k) or limit_of(c, at, *about, x) for k, (c, at) in enumerate(given)]
        place.still.update({k: limit for k, limit in enumerate(found) if not limit.of_sections})
        return found

    def motion_of(self, run: ChainRun) -> Motion:
        """A run at all times."""
        place = self.place(run.formulation.mechanism)
        own = run.formulation if isinstance(run.formulation, Nodal) else place.nodal
        return Motion(place.frozen, node_poses(run, self.times, own), run)

    def evaluate(self, x: Array) -> Evaluation:
        """A design by its run."""
        return self.analysed(x)[0]

    def analysed(self, x: Array) -> tuple[Evaluation, Motion]:
        """A design by its run, and that."""
        count = len(self.problem.record.constraints)
        poses = self._memory.get(x, "poses")
        kept = [c for k in range(count) if (c := self._memory.get(x, f"components{k}")) is not None]
        if poses is not None and len(kept) == count and not self.designs.moving:
            return self.rules.evaluation(x, kept), Motion(self.place(self.start.mechanism).frozen, poses)
        begun = time.perf_counter()
        design = self.designs.at(x)
        self._ran = run_of(design, self._tell)
        motion = self.motion_of(self._ran)
        components = [limit.exact(motion) for limit in self.limits(design)]
        self.run_s += time.perf_counter() - begun
        self._memory.put(x, poses=motion.poses, **{f"components{k}": c for k, c in enumerate(components)})
        return self.rules.evaluation(x, components), motion

    def differentiate(self, found: Evaluation) -> Evaluation:
        """With derivatives along the run."""
        x, sizes = found.x, [c.size for c in found.components]
        ends = np.cumsum(sizes)[:-1]
        parts = [
            [j.reshape(*c.shape, len(x)) for j, c in zip(np.split(each, ends), found.components, strict=True)]
            for each in self.derivatives(x)
        ]
        return self.rules.differentiated(found, *parts)

    def derivatives(self, x: Array, weights: Array | None = None) -> tuple[Array, Array]:
        """(n, v) of all components, or (m, v) of weighted sums (m, n) of them, and what stiffness makes of these."""
        names = ("jacobian", "flexible") if weights is None else ("slopes of sums", "flexible slopes of sums")
        whole, own = (self._memory.get(x, name) for name in names)
        if whole is None or own is None:
            begun = time.perf_counter()
            whole, own = self._derivatives(x, weights)
            self.gradient_s += time.perf_counter() - begun
            self._memory.put(x, **dict(zip(names, (whole, own), strict=True)))
        return whole, own

    def _derivatives(self, x: Array, weights: Array | None) -> tuple[Array, Array]:
        last = self._ran
        known = last is not None and last.scene.record == scene_at(self.problem, x).record
        design = self.designs.at(x)
        run = last if last is not None and known else run_of(design)
        limits, motion = self.limits(design), self.motion_of(run)
        bases = [limit.basis(motion) for limit in limits]

        def asked(other: ChainRun) -> Array:
            motion = self.motion_of(other)
            return np.concatenate([one.exact(motion, b).ravel() for one, b in zip(limits, bases, strict=True)])

        def summed(rows: Array) -> Array:
            return rows if weights is None else weights @ rows

        whole, self.gradient = derivatives(self.problem, self.designs, design, run, asked, self.times, weights)
        whole = whole + summed(self._of_sections(design, motion, limits, bases))
        if self.designs.moving or not flexible(self.start.scene):
            return whole, whole
        static = FrozenLoads(self, x, motion, True)
        own = static.differentiate(static.evaluate(x)).jacobians
        return whole, summed(np.concatenate([j.reshape(-1, len(x)) for j in own]))

    def _of_sections(self, design: Design, motion: Motion, limits: list[Limit], bases: list[Bases | None]) -> Array:
        """(n, v) what variables change of components at the same motion: sections have other sizes."""
        x, columns = design.x, []
        still = [None if limit.of_sections else np.zeros(limit.exact(motion).size) for limit in limits]
        if all(own is not None for own in still):
            return np.zeros((sum(own.size for own in still if own is not None), len(x)))
        for side, other, step in self.rules.beside(x, _STEP):
            above, below = (
                [
                    one.exact(motion, basis).ravel() if own is None else own
                    for one, basis, own in zip(self._beside(design, at), bases, still, strict=True)
                ]
                for at in (side, other)
            )
            columns.append((np.concatenate(above) - np.concatenate(below)) / (2 * step))
        return np.stack(columns, axis=-1)

    def _beside(self, design: Design, x: Array) -> list[Limit]:
        """Constraints at values beside a design, for its motion; whole mechanisms vibrate at places of their own."""
        if self._weighs:
            return self._limits(self.designs.at(x).mechanism, x)
        found = self._limits(design.mechanism, x)
        if self.designs.moving and any(isinstance(limit, Vibration) for limit in found):
            own = self._limits(self.designs.at(x).mechanism, x)
            return [at if isinstance(at, Vibration) else limit for limit, at in zip(found, own, strict=True)]
        return found

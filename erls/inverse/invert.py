"""From a scene to its inversion: the one door."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from erls.equations.linearization import Linearization
from erls.errors import Cause, SceneError, SimulationError
from erls.inverse.conditions import Demand
from erls.inverse.internal import Basis, Internal, basis_of
from erls.inverse.marching import march, shoot
from erls.inverse.nature import Nature, nature_of
from erls.inverse.problem import Problem, followed, problem_of
from erls.inverse.servoed import Servoed, States
from erls.inverse.two_point import Ends, Solved, collocate, ends_of
from erls.maths.jit import announcing
from erls.maths.so3 import Array
from erls.scene.build import Message
from erls.scene.chain import Scene
from erls.scene.read import AnyScene, chain_alone, load_chain
from erls.sensitivity.tangents import Knots, tangents
from fe_import.files.toml import choose

METHODS = ("auto", "collocation", "shooting", "forward")
_TOLERANCE = 1e-11  # m: change that ends iterations
_ROUGH = 1e-4  # m: the same of those that give others a start
_PASSES = 3  # of fast ways, at most
_SAME = 1e-3  # of the largest effort: change that ends them
_FAST = 20.0  # times the slowest frequency of a demanded motion: internal motions that follow
_EXCITED = 6.0  # times the same: undamped internal motions that what is demanded makes
_STEEP = 0.1  # of the largest, the smallest metres that count


@dataclass(frozen=True)
class Inversion:
    """Drives that make a mechanism move as demanded, with the motion that they make.

    Attributes
    ----------
    problem : Problem
    method : str
        ``collocation``, ``shooting`` or ``forward``.
    nature : Nature
    states : States
        At the knots, of the mechanism with its unknown drives.
    rigid : States
        The same of rigid links: rigid feed-forward.
    iterations : int
        Of Newton's method over all steps, or of all steps.
    left : float
        Change of the efforts [1, of the largest] by the last pass in which fast motions got their accelerations.
    wall_s : float
    warnings : tuple of str
    """

    problem: Problem
    method: str
    nature: Nature
    states: States
    rigid: States
    iterations: int
    left: float
    wall_s: float
    warnings: tuple[str, ...] = ()

    @property
    def t(self) -> Array:
        """(k,) knots [s]."""
        return self.problem.t[: len(self.states.y)]

    @property
    def efforts(self) -> dict[str, Array]:
        """(k,) each, by joint [N m or N]."""
        return dict(zip(self.problem.drives, self.states.efforts.T, strict=True))

    @property
    def rigid_efforts(self) -> dict[str, Array]:
        """The same of rigid links."""
        return dict(zip(self.problem.drives, self.rigid.efforts.T, strict=True))

    @property
    def start(self) -> dict[str, float]:
        """Joint coordinates at the start, of joints whose motion is not prescribed."""
        return self._start_of(self.problem.flexible, self.states)

    @property
    def rigid_start(self) -> dict[str, float]:
        """The same of rigid links, those that were held included."""
        own = {joint.name: joint.position for joint in self.problem.flexible.tree.mechanism.joints}
        return {name: own[name] for name in self.start} | self._start_of(self.problem.rigid, self.rigid)

    def _start_of(self, servoed: Servoed, states: States) -> dict[str, float]:
        joints = servoed.tree.mechanism.joints
        return {joints[k].name: float(states.y[0, i]) for i, k in enumerate(servoed.tree.free_joints.tolist())}

    @cached_property
    def angles(self) -> dict[str, Array]:
        """(k,) joint coordinates by name [rad or m]."""
        servoed = self.problem.flexible
        found = servoed.joints(self.t, self.states.y, self.states.v).angles.T
        return {j.name: x for j, x in zip(servoed.tree.mechanism.joints, found, strict=True) if not j.fixed}

    @cached_property
    def deflection(self) -> Array:
        """(k,) largest displacement by an elastic coordinate against the joints that the links sit on [m]."""
        servoed = self.problem.flexible
        joints = len(servoed.tree.free_joints)
        moved = np.abs(self.states.y[:, joints:] * servoed.metres[joints:])
        return np.asarray(moved.max(axis=1, initial=0.0))

    def pre_actuation(self, threshold: float = 0.01) -> float:
        """How long before what is demanded begins to move drives do, by a share of their largest effort beyond that at
        the start [s].
        """
        begins = self.problem.conditions.breakpoints
        first = max(begins[0], float(self.t[0])) if begins else float(self.t[0])
        return max([0.0, *(first - self._moves(each, threshold) for each in self.states.efforts.T)])

    def _moves(self, effort: Array, threshold: float) -> float:
        beyond = np.abs(effort - effort[0])
        moving = np.flatnonzero(beyond > threshold * beyond.max(initial=0.0))
        return float(self.t[moving[0]]) if len(moving) else math.inf


class _Found(NamedTuple):
    """Efforts of an iteration over fast ways, and what it took."""

    iterations: int
    left: float


def invert(
    scene: AnyScene | Path | str,
    *,
    method: str = "auto",
    force: bool = False,
    tell: Message = lambda text: None,
    progress: Callable[[int, float], None] = lambda iteration, change: None,
) -> Inversion:
    """Find the drives by which a mechanism moves as the tables ``servo`` of its scene demand.

    Parameters
    ----------
    scene : Scene, Path or str
        A chain; ``simulation.step`` is the distance of knots, 1 ms unless given.
    method : str
        ``collocation`` over all steps at once; multiple ``shooting``; ``forward``: plain integration; ``auto``: forward
        where internal motions do not grow, else collocation.
    force : bool
        Integrate forward what grows, as far as it goes.
    tell : callable, optional
        Told about each preparation that takes time.
    progress : callable, optional
        Told the number of each iteration and its largest change.

    Returns
    -------
    Inversion

    Raises
    ------
    SceneError, FEImportError
        Bad input: names file, field, value and remedy; TOO_FEW_DRIVES.
    SimulationError
        OUT_OF_REACH, SINGULAR_SERVO: what is demanded cannot be; UNSTABLE_INVERSE, UNDAMPED_INVERSE: internal motions
        do not let it; NEWTON_FAILED. Says when, why and what to try.

    Examples
    --------
    >>> import erls
    >>> found = erls.invert("data/inverse/passive_arm.toml")
    >>> found.nature.minimum_phase
    False
    >>> bool(0.1 < found.pre_actuation() < 0.3)
    True
    """
    choose(method, METHODS, "method", SceneError)
    begun = time.perf_counter()
    loaded: Scene = load_chain(scene) if isinstance(scene, (Path, str)) else chain_alone(scene)
    with announcing(tell), np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # found and reported
        problem = problem_of(loaded, tell)
        rigid = _rigid(problem)
        work = _Work(problem, rigid)
        nature = work.nature
        plain = method == "forward" or (method == "auto" and nature.minimum_phase)
        nature.refuse(method == "forward", force)
        if plain and not nature.minimum_phase:
            states, steps, reason = march(work.solved, work.scales)
            warnings = (reason,) if reason else ()
            return work.inversion("forward", states, _Found(steps, 0.0), begun, warnings)
        chosen = "shooting" if method == "shooting" else "forward" if plain else "collocation"
        found = work.solve(chosen, progress)
        return work.inversion(chosen, work.solved.states, found, begun, _cut(problem, nature))


def _rigid(problem: Problem) -> States:
    """Motion and efforts of rigid links."""
    servoed, demand = problem.rigid, problem.conditions.demand(problem.t)
    y = followed(servoed, problem.conditions, problem.t)
    assert not servoed.count
    internal = Internal(servoed, demand, y, Basis(*(np.zeros((0, 0)),) * 4))
    every = np.arange(len(problem.t))
    internal.look(np.zeros((len(every), 0)))
    internal.learn(every)
    internal.move(np.zeros((len(every), 0)))
    internal.look(np.zeros((len(every), 0)))
    return internal.states


def _cut(problem: Problem, nature: Nature) -> tuple[str, ...]:
    """What the user should know about the ends of the interval."""
    found = [*problem.warnings, *nature.warnings]
    demand = problem.conditions.demand(problem.t[[0, -1]])
    for at, name in enumerate(("start", "end")):
        if np.abs(demand.rate[at]).max() or np.abs(demand.acceleration[at]).max():
            found.append(f"what is demanded moves at the {name} of the run: it is taken to go on as it does there")
    begins = [t for t in problem.conditions.breakpoints if problem.t[0] <= t <= problem.t[-1]]
    for room, name, roots in (
        (begins[0] - problem.t[0] if begins else 0.0, "before", nature.growing),
        (problem.t[-1] - begins[-1] if begins else 0.0, "after", np.zeros(0)),
    ):
        slowest = float(np.abs(roots.real).min(initial=math.inf))
        if slowest * room < math.log(1e4) and len(roots):
            share = math.exp(-slowest * room)
            text = f"only {room:.3g} s {name} the motion: drives that start from rest lose a share of {share:.1g}"
            found.append(f"{text} of what goes ahead of it; start it later")
    return tuple(found)


class _Work:
    """An inversion on its way."""

    def __init__(self, problem: Problem, rigid: States) -> None:
        self.problem, self.rigid = problem, rigid
        servoed = problem.flexible
        self.demand: Demand = problem.conditions.demand(problem.t)
        self.near = np.tile(servoed.tree.undeformed_start()[0], (len(problem.t), 1))
        self.near[:, servoed.dependent] = rigid.y[:, problem.rigid.dependent]
        m = servoed.count
        start = Internal(servoed, self.demand.part(slice(0, 1)), self.near[:1], self._whole())
        start.look(np.zeros((1, 2 * m)))
        start.learn(np.zeros(1, dtype=np.int64))
        first = start.tangents()[0]
        metres = servoed.metres[servoed.internal]
        units = 1 / np.maximum(metres, _STEEP * metres.max(initial=0.0))
        both = np.concatenate([units, units / problem.step])
        zeros = np.linalg.eigvals(first * both / both[:, None]).astype(complex) if m else np.zeros(0, dtype=complex)
        own = tangents(servoed.system, Knots(self.demand.t[:1], *(x for x in start.states[:3])), servoed.steps)
        motions = Linearization(own.mass[0], own.damping[0], own.stiffness[0], np.eye(servoed.tree.size))
        self._units = units
        self.nature = nature_of(zeros, motions, self._limit(), _EXCITED * self._slowest(), float(problem.t[-1]))
        self._take(basis_of(first[m:, :m], units, self.nature.limit))

    def _limit(self) -> float:
        """Internal motions faster than this follow [rad/s]."""
        given = self.problem.scene.record.inverse.bandwidth
        if given is not None:
            return 2 * math.pi * given
        return _FAST * self._slowest()

    def _slowest(self) -> float:
        """Frequency of the shortest demanded motion [rad/s]."""
        end = float(self.problem.t[-1])
        spans = np.diff([t for t in self.problem.conditions.breakpoints if t < end])
        return 2 * math.pi / float(spans.min(initial=end))

    def _whole(self) -> Basis:
        """All ways are slow."""
        m = self.problem.flexible.count
        return Basis(np.eye(m), np.zeros((m, 0)), np.eye(m), np.zeros((0, m)))

    def _take(self, basis: Basis, before: Internal | None = None) -> None:
        """Go on in other coordinates, from the first guess or from what is known."""
        slow = np.abs(basis.slow / self._units[:, None]).max(axis=0, initial=0.0)
        self.basis, self.scales = basis, np.concatenate([1 / slow, 1 / slow / self.problem.step])
        self.solved = Internal(self.problem.flexible, self.demand, self.near, basis)
        if before is not None:
            self.solved.begin(before.states)

    def _ends(self, first: Array, last: Array) -> Ends:
        return ends_of(first, last, self.scales)

    def solve(self, method: str, progress: Callable[[int, float], None]) -> _Found:
        """With fast ways that follow; then, where that leaves something and no bandwidth says so, as they move."""
        found = self._followed(method, progress)
        if found.left <= _SAME or self.problem.scene.record.inverse.bandwidth is not None:
            return found
        slow, states = self.solved, self.solved.states
        own = self.problem.flexible.internal
        self._take(self._whole(), slow)
        x = np.hstack([states.y[:, own], states.v[:, own]])
        try:
            more = self._solved(method, x, progress)
        except SimulationError as problem:
            if problem.cause != Cause.NEWTON_FAILED:
                raise
            self.solved = slow
            return found
        return _Found(found.iterations + more.iterations, 0.0)

    def _followed(self, method: str, progress: Callable[[int, float], None]) -> _Found:
        """Iterate, then let fast ways have their accelerations, as long as that changes less each time."""
        internal = self.solved
        x = np.zeros((len(self.problem.t), internal.size))
        iterations, before, left = 0, np.zeros(0), math.inf
        for number in range(_PASSES):
            found = self._solved(method, x, progress)
            x, iterations = found.x, iterations + found.iterations
            efforts = internal.states.efforts
            if not self.basis.fast.shape[1]:
                left = 0.0
            elif number:
                left = float(np.abs(efforts - before).max()) / max(float(np.abs(efforts).max()), 1e-300)
            before = efforts
            if left <= _SAME or number == _PASSES - 1:
                break
            internal.refine()
        return _Found(iterations, left)

    def _solved(self, method: str, x: Array, progress: Callable[[int, float], None]) -> Solved:
        """From a guess; of shooting, whose stretches are lost from far away, after a rough collocation."""
        if method != "shooting":
            return collocate(self.solved, self.problem.t, x, self._ends, self.scales, _TOLERANCE, progress)[0]
        rough = collocate(self.solved, self.problem.t, x, self._ends, self.scales, _ROUGH, progress)[0]
        return shoot(self.solved, self.problem.t, rough.x, self._ends, self.scales, _TOLERANCE, progress)[0]

    def inversion(
        self, method: str, states: States, found: _Found, begun: float, warnings: tuple[str, ...]
    ) -> Inversion:
        """What was found."""
        wall = time.perf_counter() - begun
        return Inversion(self.problem, method, self.nature, states, self.rigid, *found, wall, warnings)



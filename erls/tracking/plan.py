"""From a scene to its planned motion: the one door. A law is found by a model and run forward; where the run passes a
bound, what it does beyond the model belongs to the model of the next law.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from erls.errors import Cause, SceneError, SimulationError
from erls.maths.so3 import Array
from erls.mechanism.drives import MotionDrive
from erls.mechanism.motions import MotionTable
from erls.run.chain.run import ChainRun
from erls.scene.build import Message
from erls.scene.chain import Scene
from erls.scene.joints import Acting, JointInitial
from erls.scene.read import AnyScene, chain_alone, load_chain
from erls.simulation.simulate import simulate
from erls.tracking.forward import forward_scene
from erls.tracking.goal import Beyond, Goal, goal_of
from erls.tracking.laws import Law
from erls.tracking.optimal import least
from erls.tracking.shaped import shaped
from erls.tracking.vibration import seen
from fe_import.files.toml import choose

_PASSES = 6
_WITHIN = 0.97  # of bounds: what is aimed at, once more each time that a run has passed them
_SHORTER, _CLOSE = 0.88, 0.02  # of a duration that is kept: the next one that is tried, and how near the last ones lie
_TRIES, _AGAIN = 12, 3  # durations, and laws of each
_AFTER = 2.0  # longest periods that the run goes on once the joints rest
_SHORTEST = 0.05  # s that it does so at least
_LOOKED = 801  # times at which a run is looked at


@dataclass(frozen=True)
class Planned:
    """A planned motion and its forward run.

    Attributes
    ----------
    goal : Goal
    method : str
    law : Law
    run : ChainRun
    efforts : (k, j) array
        Of the run at the knots of the law.
    peaks : (j,) array
        Largest efforts of the run.
    swing : float
        Largest vibration of a point in the run once the joints rest [m].
    passes : int
        Laws that were found and run.
    wall_s : float
    """

    goal: Goal
    method: str
    law: Law
    run: ChainRun
    efforts: Array
    peaks: Array
    swing: float
    passes: int
    wall_s: float

    @property
    def t(self) -> Array:
        """(k,) knots in the scene's time [s]."""
        return np.asarray(self.law.t + self.goal.scene.record.plan.start)

    @property
    def rates(self) -> Array:
        """(j,) largest rates."""
        return np.asarray(np.abs(self.law.rate).max() * np.abs(self.goal.moved))

    @property
    def kept(self) -> bool:
        """Whether the run keeps all bounds."""
        return bool((self.peaks <= self.goal.efforts).all()) and self.swing <= self.goal.scene.record.plan.swing

    @property
    def angles(self) -> Array:
        """(k, j) joint coordinates at the knots."""
        return np.asarray(self.goal.first[self.goal.joints] + np.outer(self.law.place, self.goal.moved))


def plan(
    scene: AnyScene | Path | str,
    *,
    method: str = "shaped",
    formulation: str = "",
    tell: Message = lambda text: None,
    told: Callable[[Planned], None] = lambda planned: None,
) -> Planned:
    """Find a short motion between two poses, as the table ``plan`` of a scene says.

    Parameters
    ----------
    scene : Scene, Path or str
        A chain or tree.
    method : str
        ``shaped``: a polynomial, folded by shapers of slow vibrations; ``optimal``: from
        there on any law, as short as forward runs keep the bounds.
    formulation : str
        Of the forward runs; that of the scene unless given.
    tell : callable, optional
        Told about each preparation that takes time.
    told : callable, optional
        Told of each law that was run.

    Returns
    -------
    Planned
        The one that keeps the bounds in a forward run; the last one where none does.

    Raises
    ------
    SceneError, FEImportError
        Bad input: names file, field, value and remedy.
    SimulationError
        NO_PLAN: no motion keeps the bounds, and which; what forward runs raise.
    """
    choose(method, METHODS, "method", SceneError)
    begun = time.perf_counter()
    goal = goal_of(load_chain(scene) if isinstance(scene, (Path, str)) else chain_alone(scene), tell)
    if np.isinf(goal.efforts).all() and (method == "optimal" or np.isinf(goal.rates).all()):
        raise SceneError(
            Cause.BAD_FIELD,
            "nothing bounds how fast it may be",
            where=f"{goal.scene.path}: plan.joints",
            remedy="give the effort of a joint",
        )
    search = _Search(goal, formulation, tell, told, begun)
    found = METHODS[method](search)
    return replace(found, passes=search.passes, wall_s=time.perf_counter() - begun)


def _silent(text: str) -> None:
    """Preparations are told once."""


class _Search:
    """Laws that are run one after the other."""

    def __init__(
        self, goal: Goal, formulation: str, tell: Message, told: Callable[[Planned], None], begun: float
    ) -> None:
        self.goal, self._formulation, self._tell, self._told, self._begun = goal, formulation, tell, told, begun
        self.passes = 0

    def bounds(self, failed: int) -> tuple[Array, float]:
        """What is aimed at once as many runs have failed."""
        share = _WITHIN**failed
        return share * self.goal.efforts, share * self.goal.scene.record.plan.swing

    def run(self, method: str, law: Law) -> Planned:
        """Run a law, and know what it does beyond the model from then on."""
        tell = _silent if self.passes else self._tell
        ran, goal = run_law(self.goal, law, self._formulation, tell), self.goal
        self.passes += 1
        spent = time.perf_counter() - self._begun
        planned = Planned(goal, method, law, ran.run, ran.efforts, ran.peaks, ran.swing, self.passes, spent)
        self._told(planned)
        self.goal = replace(goal, beyond=_beyond(goal, law, ran))
        return planned


def _by_polynomials(search: _Search) -> Planned:
    """By shaped polynomials, until one is kept."""
    found = search.run("shaped", shaped(search.goal, *search.bounds(0)))
    for failed in range(1, _PASSES):
        if found.kept:
            break
        try:
            law = shaped(search.goal, *search.bounds(failed))
        except SimulationError:
            break  # what runs do beyond the model leaves no room: the last law is told with what it passes
        found = search.run("shaped", law)
    return found


def _by_least_efforts(search: _Search) -> Planned:
    """From the shaped polynomial to shorter laws, as long as runs keep the bounds."""
    best = _by_polynomials(search)
    if not best.kept:
        return best
    best, low = replace(best, method="optimal"), 0.0
    for _ in range(_TRIES):
        duration = max(_SHORTER * best.law.duration, (low + best.law.duration) / 2)
        found = _of_duration(search, duration)
        if found is None:
            low = duration
        else:
            best = found
        if best.law.duration - low < _CLOSE * best.law.duration:
            break
    return best


def _of_duration(search: _Search, duration: float) -> Planned | None:
    """A law of a duration that is kept by its run, if one is found."""
    before = search.goal
    for failed in range(_AGAIN):
        law = least(search.goal, duration, *search.bounds(failed))
        found = None if law is None else search.run("optimal", law)
        if found is None or found.kept:
            break
    if found is None or not found.kept:
        search.goal = before
        return None
    return found


METHODS: dict[str, Callable[[_Search], Planned]] = {"shaped": _by_polynomials, "optimal": _by_least_efforts}
"""How motions are found."""


def driven(goal: Goal, law: Law, formulation: str = "") -> Scene:
    """The scene with a law as motions of its joints, up to some periods after their end."""
    start = goal.scene.record.plan.start
    slowest = min((mode.omega for mode in goal.modes), default=np.inf)
    end = start + law.duration + max(_AFTER * 2 * np.pi / slowest, _SHORTEST)
    times = tuple((start + law.t).tolist())
    moving = dict(zip(goal.names, goal.joints.tolist(), strict=True))

    def change(name: str, own: Acting) -> Acting:
        if name not in moving:
            return own
        values = goal.first[moving[name]] + law.place * goal.change[moving[name]]
        drive = MotionDrive(motion=MotionTable(times=times, values=tuple(values.tolist())))
        return msgspec.structs.replace(own, drive=drive, initial=JointInitial())

    return forward_scene(goal.scene, goal.mechanism, change, formulation, duration=float(end))


class Ran(NamedTuple):
    """A forward run; its efforts at the knots, its largest ones; what modes and points swing on by."""

    run: ChainRun
    efforts: Array
    peaks: Array
    endings: Array
    swing: float


def run_law(goal: Goal, law: Law, formulation: str = "", tell: Message = lambda text: None) -> Ran:
    """Run a law forward."""
    run = simulate(driven(goal, law, formulation), tell=tell, verdict=False)
    start = goal.scene.record.plan.start
    every = np.linspace(0.0, run.end, _LOOKED)
    efforts, whole = (np.stack([run.joint_effort(n, t) for n in goal.names], 1) for t in (start + law.t, every))
    peaks = np.abs(np.concatenate([efforts, whole])).max(axis=0)
    after = np.linspace(start + law.duration, run.end, _LOOKED)
    places = np.stack([run.position(point.name, after) for point in goal.mechanism.points], axis=1)
    swing = float(np.linalg.norm(np.ptp(places, axis=0), axis=1).max()) / 2
    return Ran(run, efforts, peaks, seen(goal.modes, after, places), swing)


def _beyond(goal: Goal, law: Law, ran: Ran) -> Beyond:
    """What the model of a law leaves out."""
    plain = replace(goal, beyond=Beyond(0 * goal.beyond.efforts, 0 * goal.beyond.endings))
    known = [mode.ending(law.step, len(law.t)) @ law.acceleration for mode in goal.modes]
    share = min(1.0, goal.swing(law) / max(ran.swing, np.finfo(float).tiny))
    return Beyond(ran.efforts - plain.needed(law), ran.endings - np.array(known), share)

"""Forward runs of a scene with the drives that were found, and how far they miss what is demanded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import msgspec
import numpy as np

from erls.inverse.conditions import Joints
from erls.inverse.feed import load_table
from erls.inverse.frames import PointMotion
from erls.inverse.inversion import Inversion
from erls.inverse.problem import Problem
from erls.maths.so3 import Array
from erls.mechanism.drives import TorqueDrive
from erls.run.chain.run import ChainRun
from erls.scene.build import Message
from erls.scene.chain import Scene
from erls.scene.integrators import FIXED_STEP
from erls.scene.joints import Acting, JointInitial
from erls.simulation.simulate import Progress, simulate
from erls.tracking.forward import forward_scene

FINER = 4
"""Steps of a forward run between two knots."""


@dataclass(frozen=True)
class Confirmation:
    """A forward run, from rest.

    Attributes
    ----------
    problem : Problem
    run : ChainRun
    t : (k,) array
        Its steps [s].
    missed : (k, p) array
        What conditions miss, each in its unit.
    distance : (k,) array
        Of all points from where they are demanded, the farthest [m]; of conditions on joints alone zero.
    """

    problem: Problem
    run: ChainRun
    t: Array
    missed: Array
    distance: Array

    @property
    def error(self) -> float:
        """Largest distance [m]."""
        return float(self.distance.max(initial=0.0))

    @property
    def largest(self) -> list[float]:
        """(p,) what each condition misses at most, in its unit."""
        return [float(x) for x in np.abs(self.missed).max(axis=0)]


def confirmed(
    inversion: Inversion,
    efforts: Mapping[str, Array],
    start: Mapping[str, float],
    formulation: str = "",
    tell: Message = lambda text: None,
    progress: Progress | None = None,
) -> Confirmation:
    """Run the scene with efforts of its unknown drives, cubic between knots, from rest.

    Parameters
    ----------
    inversion : Inversion
    efforts : mapping of str to (k,) array
        By joint, at the knots.
    start : mapping of str to float
        Joint coordinates [rad or m].
    formulation : str
        That of the scene unless given.

    Raises
    ------
    SceneError, SimulationError
        As `erls.simulate`.
    """
    scene = driven_scene(inversion.problem, inversion.t, efforts, start, formulation)
    run = simulate(scene, tell=tell, progress=progress, verdict=False)
    return Confirmation(inversion.problem, run, *missed(inversion.problem, run))


def driven_scene(
    problem: Problem, t: Array, efforts: Mapping[str, Array], start: Mapping[str, float], formulation: str = ""
) -> Scene:
    """The scene with efforts as tables in place of the unknown drives, steps of a quarter of the distance of knots, at
    rest where the inversion starts.
    """

    def driven(name: str, own: Acting) -> Acting:
        """With efforts over time and an initial coordinate."""
        changes: dict[str, object] = {}
        if name in efforts:
            changes["drive"] = TorqueDrive(profiles=(load_table(t, efforts[name]),))
        if name in start:
            changes["initial"] = JointInitial(position=start[name])
        return msgspec.structs.replace(own, **changes)

    steps = {"step": problem.step / FINER, "integrator": FIXED_STEP}
    return forward_scene(problem.scene, problem.mechanism, driven, formulation, **steps)


def missed(problem: Problem, run: ChainRun) -> tuple[Array, Array, Array]:
    """Times of a run, what conditions miss then, and the largest distance of a point from where it is demanded."""
    conditions, t = problem.conditions, run.times
    series = run.series(t)
    places = [run.position(point.name, t) for point in conditions.points]
    place = np.stack(places, 1) if places else np.zeros((len(t), 0, 3))
    points = PointMotion(place, np.zeros_like(place), np.zeros_like(place), np.zeros((*place.shape, 0)))
    still, none = np.zeros_like(series.angles), np.zeros((series.angles.shape[1], 0))
    held = conditions.held(conditions.demand(t), points, Joints(series.angles, still, still, none))
    distances = held.gap * held.metres
    ends = [getattr(each.measure, "end", -1) for each in conditions.every]
    each = [np.linalg.norm(distances[:, [e == k for e in ends]], axis=1) for k in range(len(places))]
    return t, held.gap, np.max(each, axis=0) if each else np.zeros(len(t))

"""What is planned: which joints go where within which bounds, and what links do when they go."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from erls.equations.registry import TREES
from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.place import Place
from erls.mechanism.rigid_dynamics import inverse_dynamics
from erls.scene.build import Message, build_mechanism
from erls.scene.chain import Scene
from erls.tracking.laws import Law
from erls.tracking.straight import Straight, Table, beside_end, straight
from erls.tracking.vibration import Mode, swing
from fe_import.model import IntArray

_LEAST = 0.02  # of the bound on vibration: modes that no law can make swing by more are left out
_STILL = 1e-6  # of the largest frequency: a mode that does not swing


class Beyond(NamedTuple):
    """What a forward run did that the model of a law did not.

    Attributes
    ----------
    efforts : (k, j) array
        At even shares of the duration.
    endings : (m,) complex array
        Of the modes, as `erls.tracking.vibration.Mode.ending` [m].
    share : float
        Vibration of the model over that of the run.
    """

    efforts: Array
    endings: Array
    share: float = 1.0

    def at(self, knots: int) -> Array:
        """(knots, j) efforts."""
        own = np.linspace(0.0, 1.0, len(self.efforts))
        return np.stack([np.interp(np.linspace(0.0, 1.0, knots), own, each) for each in self.efforts.T], axis=1)


@dataclass(frozen=True)
class Goal:
    """A motion that is looked for.

    Attributes
    ----------
    scene : Scene
    mechanism : Mechanism
    names : tuple of str
    joints : (j,) int array
        Numbers of those that go.
    first, change : (n,) arrays
        Coordinates of all joints at the start, and by how much they go.
    efforts, rates : (j,) arrays
        Bounds; infinite without.
    modes : tuple of Mode
    beyond : Beyond
    table : Table or None
        Efforts of rigid links in loops.
    """

    scene: Scene
    mechanism: Mechanism
    names: tuple[str, ...]
    joints: IntArray
    first: Array
    change: Array
    efforts: Array
    rates: Array
    modes: tuple[Mode, ...]
    beyond: Beyond
    table: Table | None = None

    @property
    def moved(self) -> Array:
        """(j,) by how much planned joints go."""
        return self.change[self.joints]

    @property
    def fastest(self) -> float:
        """Largest rate of s that the bounds on rates allow."""
        return float((self.rates / np.maximum(np.abs(self.moved), np.finfo(float).tiny)).min())

    def needed(self, law: Law) -> Array:
        """(k, j) efforts by a law, of rigid links and of the vibrations about the end."""
        found = self.rigid(law.place, law.rate, law.acceleration)
        for mode in self.modes:
            found = found + np.outer(mode.accelerations(law.step, law.acceleration), mode.efforts)
        return found + self.beyond.at(len(law.t))

    def rigid(self, place: Array, rate: Array, acceleration: Array) -> Array:
        """(k, j) those of rigid links."""
        if self.table is not None:
            return self.table.efforts(place, rate, acceleration)
        parts = (self.first + np.outer(place, self.change), *(np.outer(x, self.change) for x in (rate, acceleration)))
        return inverse_dynamics(self.mechanism, *parts)[:, self.joints]

    def swing(self, law: Law) -> float:
        """What points swing on by after a law, by the model, frequencies off by the uncertainty [m]."""
        return swing(self.modes, law, self.scene.record.plan.uncertainty)


def goal_of(scene: Scene, tell: Message = lambda text: None) -> Goal:
    """Read the table ``plan`` of a scene.

    Raises
    ------
    SceneError, FEImportError
        Bad input, or a scene that cannot be planned.
    """
    plan, place = scene.record.plan, Place(scene.folder, str(scene.path))
    if not plan.joints:
        raise place.error("plan.joints", "nothing is planned", remedy="add [plan.joints.NAME] and where it goes")
    place.not_negative("plan.start", plan.start)
    if scene.record.simulation.formulation not in TREES:
        given, remedy = scene.record.simulation.formulation, f"plan with {', '.join(TREES)}, and --confirm nodal"
        raise place.error("simulation.formulation", "not one of modes", given, remedy=remedy)
    if not scene.record.points:
        raise place.error("points", "no point whose vibration counts", remedy="name the tip in [[points]]")
    mechanism = build_mechanism(scene, tell).mechanism
    names = [joint.name for joint in mechanism.joints]
    numbers = np.array([names.index(name) for name in plan.joints], dtype=np.int64)
    first = np.array([joint.position for joint in mechanism.joints])
    change, efforts, rates = np.zeros(len(names)), np.full(len(numbers), math.inf), np.full(len(numbers), math.inf)
    for i, (name, one) in enumerate(plan.joints.items()):
        own = place.at(f"plan.joints.{name}")
        own = replace(own, revolute=bool(mechanism.joints[numbers[i]].freedom.turns))
        change[numbers[i]] = own.quantity("to", one.to, one.to_deg) - first[numbers[i]]
        if one.effort is not None:
            efforts[i] = own.positive("effort", one.effort)
        if one.rate is not None or one.rate_deg is not None:
            rates[i] = own.positive("rate", own.quantity("rate", one.rate, one.rate_deg))
    if not change.any():
        raise place.error("plan.joints", "a motion of no length", remedy="go elsewhere than where the scene starts")
    way = straight(scene, mechanism, numbers, first[numbers], change[numbers])
    modes = _modes(scene, way)
    beyond = Beyond(np.zeros((2, len(numbers))), np.zeros(len(modes), dtype=complex))
    table = Table(way) if mechanism.loops else None
    return Goal(scene, mechanism, tuple(plan.joints), numbers, first, change, efforts, rates, modes, beyond, table)


def _modes(scene: Scene, way: Straight) -> tuple[Mode, ...]:
    """Vibrations about the end of a way with planned joints held, as far as the law can make them count."""
    mass, damping, stiffness, ways, moves, points = beside_end(way)
    if not ways.shape[1]:
        return ()
    inner = ways.T @ mass @ ways
    bent, slowed = ways.T @ (stiffness + stiffness.T) @ ways / 2, ways.T @ damping @ ways
    squares, shapes = la.eigh(bent, (inner + inner.T) / 2)
    if squares.min() <= _STILL**2 * squares.max():
        raise SceneError(
            Cause.BAD_FIELD,
            "something moves freely, or falls, when the planned joints are held at the end",
            where=f"{scene.path}: plan.joints",
            value=f"stiffness {squares.min():.3g} 1/s² of a mode",
            remedy="plan that joint, too, or give it a spring",
        )
    coupling, rows = ways.T @ mass @ moves, points @ ways
    found = []
    for square, shape in zip(squares, shapes.T, strict=True):
        omega = float(np.sqrt(square))
        ratio = min(float(shape @ slowed @ shape) / (2 * omega), 0.99)
        found.append(Mode(omega, ratio, float(shape @ coupling @ way.change), rows @ shape, coupling.T @ shape))
    return tuple(mode for mode in found if mode.most > _LEAST * scene.record.plan.swing)

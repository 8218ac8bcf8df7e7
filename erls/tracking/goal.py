"""What is planned: which joints go where within which bounds, and what links do when they go."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la

from erls.equations.registry import TREES
from erls.equations.serial.equilibrium import elastic_on_diagonal, size_of
from erls.equations.serial.formulation import SerialFormulation
from erls.equations.system import metre_scales
from erls.equations.tangents import Evaluation, Knots, steps_of
from erls.errors import Cause, SceneError
from erls.inverse.frames import point_motions, with_ends
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.drives import Drive
from erls.mechanism.place import Place
from erls.mechanism.rigid_dynamics import inverse_dynamics
from erls.scene.build import Message, build_mechanism
from erls.scene.chain import Scene
from erls.tracking.laws import Law
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
    if scene.record.loops:
        raise place.error("loops", "a mechanism with loops cannot be planned yet", remedy="plan chains and trees")
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
    modes = _modes(scene, mechanism, numbers, first + change, change)
    beyond = Beyond(np.zeros((2, len(numbers))), np.zeros(len(modes), dtype=complex))
    return Goal(scene, mechanism, tuple(plan.joints), numbers, first, change, efforts, rates, modes, beyond)


def _modes(scene: Scene, mechanism: Mechanism, planned: IntArray, pose: Array, change: Array) -> tuple[Mode, ...]:
    """Vibrations about a pose with planned joints held, as far as the law can make them count."""
    joints = tuple(
        replace(joint, position=float(pose[k]), drive=Drive() if k in planned else joint.drive)
        for k, joint in enumerate(mechanism.joints)
    )
    there = replace(mechanism, joints=joints, static_start=False)
    tree: Any = TREES[scene.record.simulation.formulation](with_ends(there, mechanism.points), scene.record.simulation)
    assert isinstance(tree, SerialFormulation)
    y = tree.undeformed_start()[0]
    size, metres = size_of(mechanism) or 1.0, metre_scales(tree)
    still = np.zeros((1, tree.size))
    knots = Knots(np.zeros(1), y[None], still, still)
    steps = steps_of(metres, size, elastic_on_diagonal(tree)[0])
    mass, damping, stiffness = (x[0] for x in Evaluation(steps).tangents(tree.compiled, knots))
    driven = np.searchsorted(tree.free_joints, planned)
    own = np.setdiff1d(np.arange(tree.size), driven)
    if not len(own):
        return ()
    inner = np.ix_(own, own)
    squares, shapes = la.eigh((stiffness[inner] + stiffness[inner].T) / 2, mass[inner])
    if squares.min() <= _STILL**2 * squares.max():
        raise SceneError(
            Cause.BAD_FIELD,
            "something moves freely, or falls, when the planned joints are held at the end",
            where=f"{scene.path}: plan.joints",
            value=f"stiffness {squares.min():.3g} 1/s² of a mode",
            remedy="plan that joint, too, or give it a spring",
        )
    count = len(tree.prescribed_joints)
    rows = point_motions(tree.compiled, len(mechanism.points), count, np.zeros(1), y[None], still).rows[0][:, :, own]
    coupling = mass[np.ix_(own, driven)]
    found = []
    for square, shape in zip(squares, shapes.T, strict=True):
        omega = float(np.sqrt(square))
        ratio = min(float(shape @ damping[inner] @ shape) / (2 * omega), 0.99)
        found.append(Mode(omega, ratio, float(shape @ coupling @ change[planned]), rows @ shape, coupling.T @ shape))
    return tuple(mode for mode in found if mode.most > _LEAST * scene.record.plan.swing)

"""Poles over something that changes: a Campbell diagram over the speed of a joint, a root locus over a parameter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.neighbours import Linearizable, Neighbours, Spinnable
from erls.equations.registry import formulate
from erls.equations.substructures import solved
from erls.linear.assembly import linear_model
from erls.linear.linearize import EQUILIBRIUM, Message, linearize, with_all_modes
from erls.linear.model import LinearModel
from erls.linear.plants import ChainPlant, unknown
from erls.linear.rest import at_rest
from erls.maths.jit import announcing
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.curves import piecewise
from erls.mechanism.drives import Drive
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene
from erls.scene.read import load_chain

_LEVEL = 1e-9  # of gravity across an axis: none


@dataclass(frozen=True)
class Diagram:
    """Models over a number.

    Attributes
    ----------
    scene : str
    over, unit : str
        What changes.
    values : (k,) array
    models : tuple of LinearModel
        One at each value; of the state ``at``.
    speed : bool
        Whether it is a Campbell diagram.
    warnings : tuple of str
    """

    scene: str
    over: str
    unit: str
    values: Array
    models: tuple[LinearModel, ...]
    speed: bool
    warnings: tuple[str, ...] = ()

    @property
    def poles(self) -> Array:
        """(k, n) complex [1/s], at each value those of pairs above the real axis, by size, NaN behind the last."""
        own = [sorted((mode.pole for mode in model.modes), key=abs) for model in self.models]
        result = np.full((len(own), max(map(len, own), default=0)), np.nan, dtype=complex)
        for row, found in zip(result, own, strict=True):
            row[: len(found)] = found
        return result


def campbell(
    scene: Scene | Path | str, joint: str, speeds: Sequence[float], tell: Message = lambda text: None
) -> Diagram:
    """Poles of a mechanism in steady rotation about one of its joints, which is driven, over the speed.

    At each speed links and the other joints are in equilibrium as they are seen from the turning axes, with centrifugal
    forces; motions about that are damped, gyroscopic and stiffened by it.

    Parameters
    ----------
    scene : Scene, Path or str
    joint : str
        Whatever drives it is replaced by a motion of even speed.
    speeds : sequence of float
        [rad/s, of a joint that slides m/s]
    tell : callable, optional

    Raises
    ------
    SceneError
        BAD_REFERENCE: there is no such joint.
    SimulationError
        NO_EQUILIBRIUM: there is none at a speed.
    """
    loaded = load_chain(scene) if isinstance(scene, (str, Path)) else scene
    own = with_all_modes(loaded)
    with announcing(tell):
        built = build_mechanism(own, tell)
        mechanism, models = replace(built.mechanism, static_start=False), list[LinearModel]()
        names = [each.name for each in mechanism.joints if not each.freedom.vector and not each.fixed]
        if joint not in names:
            raise unknown("joint", joint, names)
        warnings = (*built.warnings, *_gravity_across(mechanism, joint))
        for speed in speeds:
            equations = formulate(_spun(mechanism, joint, speed), own.record.simulation)
            near = at_rest(_turning(solved(equations), joint, speed))
            named = loaded.name, f"{joint} at {speed:g}"
            models.append(linear_model(ChainPlant(equations, own.record.simulation, near), (), (), named, ()))
    unit = next(each.freedom.units[0] for each in mechanism.joints if each.name == joint)
    return Diagram(loaded.name, f"speed of {joint}", f"{unit}/s", np.array(speeds), tuple(models), True, warnings)


def _turning(equations: Formulation, joint: str, speed: float) -> Neighbours:
    """States beside the start of a steady motion, as its axes see them."""
    if isinstance(equations, Spinnable):
        return equations.spinning(joint, speed)
    assert isinstance(equations, Linearizable)
    return equations.neighbours(0.0, *equations.initial_state())


def _spun(mechanism: Mechanism, name: str, speed: float) -> Mechanism:
    """With a joint that turns evenly from where it starts."""
    joints = [
        replace(joint, drive=Drive("motion", motion=piecewise([0.0], [[joint.position, speed]] * 2)))
        if joint.name == name
        else joint
        for joint in mechanism.joints
    ]
    return replace(mechanism, joints=tuple(joints))


def _gravity_across(mechanism: Mechanism, name: str) -> tuple[str, ...]:
    """A warning where weight turns as seen from the turning axes: no state is steady then."""
    number = [joint.name for joint in mechanism.joints].index(name)
    joint = mechanism.joints[number]
    frames = poses(mechanism, np.array([each.position for each in mechanism.joints]))
    axis = frames[number][:3, :3] @ joint.screw[3:]
    across = float(np.linalg.norm(np.cross(axis, mechanism.gravity)))
    if across <= _LEVEL * max(1.0, float(np.linalg.norm(mechanism.gravity))):
        return ()
    return (f"gravity acts across the axis of joint {name!r}: weight is taken as it is at the start of the turn",)


def root_locus(
    scene: Path | str,
    key: str,
    values: Sequence[float],
    at: float | str = EQUILIBRIUM,
    changes: Sequence[str] = (),
    tell: Message = lambda text: None,
) -> Diagram:
    """Poles over a field of a scene.

    Parameters
    ----------
    scene : Path or str
    key : str
        As of ``--set``: ``joints.elbow.drive.proportional_gain``.
    values : sequence of float
    at : float or str
        As of `erls.linear.linearize.linearize`.
    changes : sequence of str
        ``KEY=VALUE`` of other fields.
    tell : callable, optional

    Raises
    ------
    SceneError, FEImportError, SimulationError
        As `erls.linear.linearize.linearize`.
    """
    models, name = list[LinearModel](), ""
    for value in values:
        loaded = load_chain(scene, [*changes, f"{key}={value!r}"])
        name = loaded.name
        models.append(linearize(loaded, at=at, inputs=(), outputs=(), tell=tell))
    return Diagram(name, key, "", np.array(values), tuple(models), False, models[0].warnings if models else ())

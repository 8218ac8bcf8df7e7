"""What goes into a co-simulation unit and what comes out: numbers with names and units, in a fixed order.

Inputs are those of a `erls.simulation.stepper.Stepper`, added to what the scene says. Outputs are the places of points,
angles and rates of joints, and what the sensors of the scene read, by the names of a run's table.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.place import Place
from erls.mechanism.sensors.base import Sensor
from erls.mechanism.sensors.joint_angle import JointAngle
from erls.mechanism.sensors.joint_rate import JointRate
from erls.mechanism.sensors.position import Position
from erls.run.chain.sensors import ChainFinder, sensors_of
from erls.run.readings import output_names, outputs
from erls.simulation.stepper import Stepper


class Channel(NamedTuple):
    """A number that a unit takes or gives: its name, its unit (``1`` for none), and what it is."""

    name: str
    unit: str
    text: str


class Channels:
    """Those of a stepper.

    Parameters
    ----------
    stepper : Stepper

    Attributes
    ----------
    inputs, outputs : tuple of Channel

    Raises
    ------
    SceneError
        BAD_FIELD: two of them have one name.
    """

    def __init__(self, stepper: Stepper) -> None:
        self._stepper = stepper
        own, texts = _readers(stepper)
        self._sensors = own
        heads = [head.rpartition(" [") for head in output_names(own)]
        self.outputs = tuple(
            Channel(name, unit.rstrip("]"), text) for (name, _, unit), text in zip(heads, texts, strict=True)
        )
        self.inputs = tuple(_input(stepper, name) for name in stepper.input_names)
        names = [channel.name for channel in (*self.inputs, *self.outputs)]
        twice = sorted({name for name in ("time", *names) if ("time", *names).count(name) > 1})
        if twice:
            message, remedy = "two variables of the unit have this name", "rename the sensor, the point or the joint"
            raise SceneError(Cause.BAD_FIELD, message, where=str(stepper.scene.path), value=twice[0], remedy=remedy)

    def read(self) -> Array:
        """(m) outputs of the mechanism as it stands."""
        found: Array = outputs(self._sensors, self._stepper.seen(), 1)[0]
        return found

    def step(self, t: float, h: float, values: Array) -> None:
        """Move on to t + h with (i) inputs that are held on the way, in equal steps no longer than the scene's own.

        Raises
        ------
        SceneError
            BAD_FIELD: the mechanism does not stand at t.
        SimulationError
            A step fails.
        """
        stepper = self._stepper
        if not abs(stepper.time - t) <= 1e-9 * max(1.0, h):
            message, remedy = "the mechanism stands at another time", "steps follow each other, or a state is set"
            raise SceneError(Cause.BAD_FIELD, message, where="step", value=t, limit=stepper.time, remedy=remedy)
        parts = max(1, int(np.ceil(h / stepper.step_size * (1 - 1e-9))))
        given = dict(zip(stepper.input_names, values.tolist(), strict=True))
        for _ in range(parts):
            stepper.step(given, h / parts, held=True, added=True)


def _input(stepper: Stepper, name: str) -> Channel:
    mechanism = stepper.formulation.mechanism
    units = {joint.name: joint.freedom.units[1] for joint in mechanism.joints}
    for loop in mechanism.loops:
        if loop.freedom is not None:
            units[loop.circuit.joint if loop.circuit else loop.name] = loop.freedom.freedom.units[1]
    if name not in units:
        return Channel(f"{name}.added_factor", "1", f"added to the factor of {name}")
    return Channel(f"{name}.added_effort", units[name], f"added to what the scene drives {name} with")


def _readers(stepper: Stepper) -> tuple[list[Sensor], list[str]]:
    """Sensors of all outputs, and a text on each column."""
    scene, mechanism = stepper.scene, stepper.formulation.mechanism
    finder, place = ChainFinder(scene, mechanism), Place(scene.folder, str(scene.path))
    found, texts = [], []
    for point in mechanism.points:
        found.append(Position(name=point.name, point=point.name).bind(finder, place))
        texts += [f"place of {point.name} in the world, {axis}" for axis in "xyz"]
    for joint in mechanism.joints:
        if joint.fixed or joint.freedom.vector:
            continue
        found.append(JointAngle(name=f"{joint.name}.angle", joint=joint.name).bind(finder, place))
        found.append(JointRate(name=f"{joint.name}.rate", joint=joint.name).bind(finder, place))
        texts += [f"coordinate of {joint.name}, as an encoder reads it", f"rate of {joint.name}"]
    for sensor in sensors_of(scene, mechanism):
        found.append(sensor)
        texts += [f"sensor {sensor.name} {part}".rstrip() for part, _ in sensor.columns]
    return found, texts

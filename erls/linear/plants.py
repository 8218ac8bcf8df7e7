"""What is linearized: equations at a state, with what acts on it and what is seen of it by name.

Rules for a further kind of scene:

1. A plant changes by what its ``with_...`` give: the same state, in equations of a mechanism that is pushed or moved.
2. A sight answers for many states at once, (k, ...) arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol, cast

import numpy as np

from erls.equations.formulation import Formulation, LoopFormulation
from erls.equations.neighbours import Neighbours, States
from erls.equations.registry import formulate
from erls.equations.serial.state_series import StateSeries, state_series
from erls.equations.substructures import solved
from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.curves import Curve, Sum, piecewise
from erls.mechanism.drives import Drive
from erls.mechanism.loads import PointLoad
from erls.mechanism.sensors.base import Sensor
from erls.run.chain.instants import Instants
from erls.run.chain.places import point_position
from erls.scene.settings import Simulation


class Sight(Protocol):
    """What is seen of states."""

    def place(self, point: str) -> Array:
        """(k, 3) of a point in the world [m]."""

    def angle(self, joint: str) -> Array:
        """(k,) what an encoder reads [rad or m]."""

    def effort(self, joint: str) -> Array:
        """(k,) of drive, spring, damper and friction; for a prescribed motion what its motor must give [N m or N]."""

    def reading(self, name: str) -> Array:
        """(k,) of a sensor, or of its component."""


class Plant(Protocol):
    """A mechanism at a state."""

    @property
    def near(self) -> Neighbours:
        """The states beside it."""

    @property
    def points(self) -> tuple[str, ...]:
        """Named points."""

    @property
    def turning(self) -> tuple[str, ...]:
        """Points that take a moment."""

    @property
    def joints(self) -> dict[str, str]:
        """Joints that can be seen, with what moves them: ``free``, ``torque``, ``pd``, ``motion`` or ``fixed``."""

    @property
    def readings(self) -> dict[str, str]:
        """What sensors read, component by component, with units."""

    @property
    def loads(self) -> tuple[str, ...]:
        """Numbers of the loads of the scene."""

    def units(self, joint: str) -> tuple[str, str]:
        """Of coordinate and effort."""

    def with_factor(self, load: str, more: float) -> Plant:
        """With this added to the factor of a load."""

    def with_effort(self, joint: str, effort: float) -> Plant:
        """Pushed by a drive."""

    def with_motion(self, joint: str, place: float, rate: float, acceleration: float) -> Plant:
        """With this added to the prescribed or wanted motion at the time of the state."""

    def with_wrench(self, point: str, wrench: Array) -> Plant:
        """With a force and a moment (6,) on a point, in the world."""

    def at(self, near: Neighbours) -> Plant:
        """At another state."""

    def seen(self, states: States) -> Sight:
        """Of states of these equations."""


@dataclass(frozen=True)
class ChainPlant:
    """Of a chain.

    Attributes
    ----------
    formulation : Formulation
    settings : Simulation
        By which it is formulated.
    sensors : tuple of Sensor
        Of the scene.
    """

    formulation: Formulation
    settings: Simulation
    near: Neighbours
    sensors: tuple[Sensor, ...] = ()
    _made: dict[object, Formulation] = field(default_factory=dict, repr=False, compare=False)

    @property
    def mechanism(self) -> Mechanism:
        """Whole, links in pieces or not."""
        return self.formulation.mechanism

    @cached_property
    def points(self) -> tuple[str, ...]:
        """See `Plant`."""
        return tuple(point.name for point in self.mechanism.points)

    @cached_property
    def turning(self) -> tuple[str, ...]:
        """See `Plant`."""
        links = self.mechanism.links
        return tuple(p.name for p in self.mechanism.points if p.node in links[p.link].model.rotation_nodes)

    @cached_property
    def joints(self) -> dict[str, str]:
        """See `Plant`."""
        found = {joint.name: "fixed" if joint.fixed else joint.drive.kind for joint in self.mechanism.joints}
        own = ((loop.name, loop.freedom) for loop in self.mechanism.loops if loop.coupling is None)
        return {**found, **{name: free.drive.kind for name, free in own if free is not None}}

    @cached_property
    def readings(self) -> dict[str, str]:
        """See `Plant`."""
        return {name: sensor.columns[k][1] for name, (sensor, k) in parts_of(self.sensors).items()}

    @cached_property
    def loads(self) -> tuple[str, ...]:
        """See `Plant`."""
        return tuple(dict.fromkeys(str(load.number) for load in self.mechanism.loads))

    def units(self, joint: str) -> tuple[str, str]:
        """See `Plant`."""
        tree = {each.name: each.freedom for each in self.mechanism.joints}
        if joint in tree:
            return tree[joint].units
        loop = self.mechanism.loops[self._loop(joint)]
        assert loop.freedom is not None
        return loop.freedom.freedom.units

    def _loop(self, joint: str) -> int:
        return [loop.name for loop in self.mechanism.loops].index(joint)

    def _changed(self, key: object, change: Callable[[Mechanism], Mechanism]) -> ChainPlant:
        """In equations of a changed mechanism, which plants of the same one at other states share by a key."""
        if key not in self._made:
            self._made[key] = formulate(change(self.mechanism), self.settings)
        formulation = self._made[key]
        return replace(self, formulation=formulation, near=self.near.of(solved(formulation)), _made={})

    def with_effort(self, joint: str, effort: float) -> ChainPlant:
        """See `Plant`."""

        def pushed(drive: Drive) -> Drive:
            kind = "torque" if drive.kind == "free" else drive.kind
            return replace(drive, kind=kind, load=_added(drive.load, 0.0, effort, 0.0, 0.0))

        return self._changed(("effort", joint, effort), lambda own: _driven(own, joint, pushed))

    def with_motion(self, joint: str, place: float, rate: float, acceleration: float) -> ChainPlant:
        """See `Plant`."""
        more = self.near.time if rate or acceleration else 0.0, place, rate, acceleration

        def moved(drive: Drive) -> Drive:
            return replace(drive, motion=_added(drive.motion, *more))

        return self._changed(("motion", joint, *more), lambda own: _driven(own, joint, moved))

    def with_wrench(self, point: str, wrench: Array) -> ChainPlant:
        """See `Plant`."""
        found = self.mechanism.points[self.points.index(point)]
        load = PointLoad(found.link, found.node, wrench)
        key = "wrench", point, *wrench.tolist()
        return self._changed(key, lambda own: replace(own, loads=(*own.loads, load)))

    def with_factor(self, load: str, more: float) -> ChainPlant:
        """See `Plant`."""

        def changed(own: Mechanism) -> Mechanism:
            def multiplied(x: PointLoad) -> PointLoad:
                return replace(x, factor=_added(x.factor, 0.0, more + float(x.factor is None), 0.0, 0.0))

            return replace(own, loads=tuple(multiplied(x) if str(x.number) == load else x for x in own.loads))

        return self._changed(("factor", load, more), changed)

    def at(self, near: Neighbours) -> ChainPlant:
        """See `Plant`."""
        return replace(self, near=near)

    def seen(self, states: States) -> ChainSight:
        """See `Plant`."""
        return ChainSight(self.formulation, states, self.sensors)


def _driven(mechanism: Mechanism, name: str, change: Callable[[Drive], Drive]) -> Mechanism:
    """With another drive in a joint, or in a closing one."""
    joints = tuple(
        replace(joint, drive=change(joint.drive)) if joint.name == name else joint for joint in mechanism.joints
    )
    loops = tuple(
        replace(loop, freedom=replace(loop.freedom, drive=change(loop.freedom.drive)))
        if loop.name == name and loop.freedom is not None
        else loop
        for loop in mechanism.loops
    )
    return replace(mechanism, joints=joints, loops=loops)


def _added(curve: Curve | None, t: float, place: float, rate: float, acceleration: float) -> Curve:
    """A curve with a parabola added that has these derivatives at a time."""
    row = [place, rate, acceleration / 2]
    more = piecewise([t], [row, row])
    return more if curve is None else Sum((curve, more))


@dataclass(frozen=True)
class ChainSight:
    """Of a chain."""

    formulation: Formulation
    states: States
    sensors: tuple[Sensor, ...]

    @cached_property
    def _instants(self) -> Instants:
        return Instants(self.formulation, *self.states)

    def reading(self, name: str) -> Array:
        """See `Sight`."""
        sensor, column = parts_of(self.sensors)[name]
        if sensor.name not in self._read:
            self._read[sensor.name] = sensor.read(self._instants)
        return np.asarray(self._read[sensor.name][:, column])

    @cached_property
    def _read(self) -> dict[str, Array]:
        return {}

    @cached_property
    def series(self) -> StateSeries:
        """Poses, angles."""
        return state_series(self.formulation, self.states.t, self.states.y, self.states.v)

    def place(self, point: str) -> Array:
        """See `Sight`."""
        mechanism = self.formulation.mechanism
        return point_position(mechanism, self.series, [p.name for p in mechanism.points].index(point))

    def angle(self, joint: str) -> Array:
        """See `Sight`."""
        number = self._number(joint)
        if number is not None:
            return np.asarray(self.series.angles[:, number])
        return self._of_loop(lambda chain, *at: chain.loop_motion(*at)[0], joint)

    def effort(self, joint: str) -> Array:
        """See `Sight`."""
        number = self._number(joint)
        if number is not None:
            return np.asarray(self._instants.reactions.effort[:, number])
        return self._of_loop(lambda chain, *at: chain.loop_effort(*at), joint)

    def _number(self, joint: str) -> int | None:
        names = [each.name for each in self.formulation.mechanism.joints]
        return names.index(joint) if joint in names else None

    def _of_loop(self, what: Callable[..., float], joint: str) -> Array:
        number = [loop.name for loop in self.formulation.mechanism.loops].index(joint)
        chain, (t, y, v, _) = cast(LoopFormulation, solved(self.formulation)), self.states
        return np.array([what(chain, *at, number) for at in zip(t.tolist(), y, v, strict=True)])


def parts_of(sensors: Sequence[Sensor]) -> dict[str, tuple[Sensor, int]]:
    """Sensors and their components by name, with the number of the component."""
    return {
        f"{sensor.name}.{part}" if part else sensor.name: (sensor, k)
        for sensor in sensors
        for k, (part, _) in enumerate(sensor.columns)
    }


def unknown(what: str, name: str, known: tuple[str, ...] | list[str]) -> SceneError:
    """An input or output that there is not."""
    remedy = "known: " + (", ".join(known) or "none")
    return SceneError(Cause.BAD_REFERENCE, f"there is no such {what}", where=what, value=name, remedy=remedy)

"""Scenes of bodies and beams as plants: nodes that are seen and pushed, in the state of a motion or at rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from erls.equations.consistency import consistent_velocity
from erls.equations.neighbours import Neighbours, States
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.loads import NodalLoad, NodalLoads
from erls.equations.nodal.neighbours import NodalNeighbours, names_of_nodes, nodal_neighbours
from erls.equations.nodal.nodes import Nodes
from erls.equations.nodal.scenes.build import Assembly
from erls.errors import Cause, SceneError
from erls.linear.plants import unknown
from erls.maths.so3 import Array
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.rest import BodyRest


@dataclass(frozen=True)
class BodyPlant:
    """Of a scene of bodies and beams; its connections have no drives.

    Attributes
    ----------
    assembly : Assembly
    """

    assembly: Assembly
    near: Neighbours

    @property
    def points(self) -> tuple[str, ...]:
        """Nodes and bodies that are reported."""
        return self.assembly.reported

    @property
    def turning(self) -> tuple[str, ...]:
        """All of them."""
        return self.assembly.reported

    @property
    def joints(self) -> dict[str, str]:
        """None."""
        return {}

    @property
    def readings(self) -> dict[str, str]:
        """None."""
        return {}

    @property
    def loads(self) -> tuple[str, ...]:
        """See `erls.linear.plants.Plant`."""
        return tuple(str(k) for k in range(len(self._loads)))

    @property
    def _loads(self) -> tuple[NodalLoad, ...]:
        return self.assembly.system.kinds.loads.loads

    def units(self, joint: str) -> tuple[str, str]:
        """There are no joints."""
        raise unknown("joint", joint, ())

    def _loaded(self, loads: tuple[NodalLoad, ...]) -> BodyPlant:
        own = self.assembly.system
        elements = [x for x in own.elements if not isinstance(x, NodalLoads)]
        system = NodalSystem(own.start.poses, [*elements, NodalLoads(loads)], own.rows.joints, own.group)
        assembly = replace(self.assembly, system=system)
        assert isinstance(self.near, NodalNeighbours)
        return replace(self, assembly=assembly, near=replace(self.near, system=system))

    def with_factor(self, load: str, more: float) -> BodyPlant:
        """See `erls.linear.plants.Plant`."""
        own = self._loads[int(load)].factor
        changed: Callable[[float], float] = lambda t: own(t) + more  # noqa: E731  # read at many times
        return self._loaded(
            tuple(replace(x, factor=changed) if str(k) == load else x for k, x in enumerate(self._loads))
        )

    def with_wrench(self, point: str, wrench: Array) -> BodyPlant:
        """See `erls.linear.plants.Plant`."""
        load = NodalLoad(self.assembly.numbers[point], wrench[:3], wrench[3:], factor=lambda t: 1.0)
        return self._loaded((*self._loads, load))

    def with_effort(self, joint: str, effort: float) -> BodyPlant:
        """There are no drives."""
        raise unknown("joint", joint, ())

    def with_motion(self, joint: str, place: float, rate: float, acceleration: float) -> BodyPlant:
        """There are no drives."""
        raise unknown("joint", joint, ())

    def at(self, near: Neighbours) -> BodyPlant:
        """See `erls.linear.plants.Plant`."""
        return replace(self, near=near)

    def seen(self, states: States) -> BodySight:
        """See `erls.linear.plants.Plant`."""
        return BodySight(self.assembly, states)


@dataclass(frozen=True)
class BodySight:
    """Of a scene of bodies and beams."""

    assembly: Assembly
    states: States

    @cached_property
    def _places(self) -> Array:
        return self.assembly.system.places(self.states.y)

    def place(self, point: str) -> Array:
        """See `erls.linear.plants.Sight`."""
        return np.asarray(self._places[:, self.assembly.numbers[point]])

    def angle(self, joint: str) -> Array:
        """There are no joints."""
        raise unknown("joint", joint, ())

    def effort(self, joint: str) -> Array:
        """There are no joints."""
        raise unknown("joint", joint, ())

    def reading(self, name: str) -> Array:
        """There are none."""
        raise unknown("sensor", name, ())


def started(assembly: Assembly) -> BodyPlant:
    """At the start of a motion."""
    system, q = assembly.system, assembly.system.start
    return _plant(assembly, 0.0, q, consistent_velocity(system, 0.0, q, assembly.velocity))


def reached(run: BodyMotion, t: float) -> BodyPlant:
    """In the state of a motion at a time.

    Raises
    ------
    SceneError
        TIME_OUT_OF_RANGE.
    """
    before = np.flatnonzero(run.solution.t <= t)
    passed = run.configurations_at(before)[0]  # one after the other: what turns is wound up as far as it is
    q = run.assembly.system.at(run.poses([t])[0], passed[-1] if passed else run.assembly.system.start)
    return _plant(run.assembly, t, q, run.velocities(np.array([t]))[0])


def rested(run: BodyRest) -> BodyPlant:
    """In its last equilibrium, under all of the load."""
    if not run.statics.path:
        message, remedy = "the run holds no equilibrium", "mend what stopped it"
        raise SceneError(Cause.BAD_FIELD, message, where="at", value=run.failure, remedy=remedy)
    last, still = run.statics.path[-1], np.zeros(run.assembly.system.size)
    near = NodalNeighbours(
        run.assembly.system, last.t, last.q, still, still, last.multipliers, _stored, _names(run.assembly)
    )
    return BodyPlant(run.assembly, near)


def _plant(assembly: Assembly, t: float, q: Nodes, v: Array) -> BodyPlant:
    return BodyPlant(assembly, nodal_neighbours(assembly.system, t, q, v, _stored, _names(assembly)))


def _names(assembly: Assembly) -> tuple[str, ...]:
    return names_of_nodes([f"node {name}" for name in sorted(assembly.numbers, key=lambda x: assembly.numbers[x])])


def _stored(
    system: NodalSystem, t: float, q: Nodes, v: Array, a: Array, multipliers: Callable[[], Array]
) -> tuple[Array, Array, Array]:
    return system.stored(t, q, v, a)

"""The motion of a chain at any time: states, places, joint angles, modal coordinates."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from erls.equations.formulation import Formulation, State
from erls.equations.serial.state_series import StateSeries, state_series
from erls.errors import Cause, SceneError, SimulationError
from erls.integrate.base import Solution, hermite
from erls.maths.so3 import Array
from erls.mechanism.effects import Certificate
from erls.mechanism.sensors.base import Node
from erls.run.accuracy import Accuracy, Trust
from erls.run.chain.instants import Instants
from erls.run.chain.places import point_position
from erls.run.record import Run
from erls.scene.chain import Scene
from fe_import.files.toml import choose


@dataclass(frozen=True, repr=False)
class ChainMotion(Run):
    """The part of `erls.run.chain.run.ChainRun` that needs no forces."""

    scene: Scene
    formulation: Formulation
    solution: Solution
    wall_s: float = 0.0
    warnings: tuple[str, ...] = field(default=())
    certificate: Certificate | None = None
    second_order_error: float | None = None
    accuracy: Accuracy | None = None
    trust: Trust | None = None

    @property
    def failure(self) -> SimulationError | None:
        """Why the run ended early; None for a complete one."""
        return self.solution.failure

    @property
    def start(self) -> float:
        """First time [s]."""
        return float(self.solution.t[0])

    @property
    def end(self) -> float:
        """Last time that was computed [s]."""
        return float(self.solution.t[-1])

    @cached_property
    def times(self) -> Array:
        """(k,) times of the integrator's steps, or of the states that ``output_step`` keeps, each once."""
        return np.unique(self.solution.t)

    def looks(self, count: int, margin: float = 0.0) -> Array:
        """(k,) times, up to ``count``, to look along the run at, ``margin`` [s] away from its ends: even ones; or,
        where ``output_step`` left out steps, those of the stored states nearest to them.
        """
        t = self.solution.t
        times = np.linspace(float(t[0]) + margin, self.end - margin, count)
        if self.scene.record.simulation.output_step is None:
            return times
        stored = np.unique(t[(t >= times[0]) & (t <= times[-1])])
        if not len(stored):
            return times
        return np.asarray(np.unique(stored[np.searchsorted((stored[1:] + stored[:-1]) / 2, times)]))

    @property
    def point_names(self) -> tuple[str, ...]:
        """Named points of the scene."""
        return tuple(p.name for p in self.formulation.mechanism.points)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints, from the ground outward; of a joint of several coordinates each one, ``joint/coordinate``."""
        return tuple(j.name for j in self.formulation.mechanism.joints)

    @property
    def link_names(self) -> tuple[str, ...]:
        """Links, from the ground outward."""
        links = self.formulation.mechanism.links
        return tuple(links[k].name for k in self.formulation.mechanism.bodies)

    def link_number(self, link: str) -> int:
        """Number of a link in the mechanism.

        Raises
        ------
        SceneError
            BAD_REFERENCE.
        """
        choose(link, self.link_names, "link", SceneError)
        return self.formulation.mechanism.bodies[self.link_names.index(link)]

    def instants(self, t: ArrayLike) -> Instants:
        """What is asked of the motion at times, which it finds once."""
        return Instants(self.formulation, *self._interpolated(t)[1:])

    def velocity(self, point: str, t: ArrayLike) -> Array:
        """(..., 3) of a named point against the world [m/s]."""
        return self._of_node(self._point(point), t, "velocity")

    def acceleration(self, point: str, t: ArrayLike) -> Array:
        """(..., 3) of a named point [m/s²]; where forces jump, that after the jump."""
        return self._of_node(self._point(point), t, "acceleration")

    def angular_velocity(self, name: str, t: ArrayLike) -> Array:
        """(..., 3) of what a named point sits on, or of a link at its inboard interface; world axes [rad/s]."""
        return self._of_node(self._turning(name), t, "spin")

    def angular_acceleration(self, name: str, t: ArrayLike) -> Array:
        """(..., 3) of the same; world axes [rad/s²]."""
        return self._of_node(self._turning(name), t, "spin_rate")

    def _point(self, point: str) -> Node:
        choose(point, self.point_names, "point", SceneError)
        found = self.formulation.mechanism.points[self.point_names.index(point)]
        return Node(found.link, found.node)

    def _turning(self, name: str) -> Node:
        """A node that turns."""
        links = self.formulation.mechanism.links
        if name not in self.point_names:
            choose(name, (*self.point_names, *self.link_names), "point or link", SceneError)
            number = self.link_number(name)
            return Node(number, links[number].inboard.node)
        at = self._point(name)
        if at.node not in links[at.link].model.rotation_nodes:
            raise SceneError(
                Cause.BAD_FIELD,
                "this node has no rotation",
                where="point",
                value=name,
                remedy="ask at an interface, or of the link",
            )
        return at

    def _of_node(self, at: Node, t: ArrayLike, what: str) -> Array:
        found: Array = getattr(self.instants(t).node(at), what)
        return found.reshape(*np.shape(t), 3)

    def _interpolated(self, t: ArrayLike) -> tuple[tuple[int, ...], Array, Array, Array]:
        """Shape of ``t``; flat times, y and v."""
        flat = self.within(t)
        s = self.solution
        y, v = hermite(s.t, s.y, s.v, s.a, np.clip(flat, s.t[0], self.end))
        return np.shape(t), flat, y, v

    def coordinates(self, t: ArrayLike) -> tuple[Array, Array]:
        """(k, n) coordinates of the equations and their rates at times (k,)."""
        return self._interpolated(t)[2:]

    def states(self, t: ArrayLike) -> list[State]:
        """The mechanism at each time."""
        return self.series(t).states()

    def series(self, t: ArrayLike) -> StateSeries:
        """The same as arrays, of all times together."""
        _, flat, y, v = self._interpolated(t)
        return state_series(self.formulation, flat, y, v)

    def position(self, point: str, t: ArrayLike) -> Array:
        """(..., 3) world position of a named point [m]."""
        choose(point, self.point_names, "point", SceneError)
        number = self.point_names.index(point)
        return self.point_position(self.series(t), number).reshape(*np.shape(t), 3)

    def point_position(self, state: State | StateSeries, number: int) -> Array:
        """(..., 3) world position of point ``number`` in a state, or in all of a series."""
        return point_position(self.formulation.mechanism, state, number)

    def joint_angle(self, joint: str, t: ArrayLike) -> Array:
        """(...) physical joint angle, what an encoder reads [rad or m]."""
        return self._of_joint(joint, t, "angles")

    def joint_coordinate(self, joint: str, t: ArrayLike) -> Array:
        """(...) coordinate θ of the Equivalent Rigid Link System [rad or m]; gauge-dependent."""
        return self._of_joint(joint, t, "coordinates")

    def joint_rate(self, joint: str, t: ArrayLike) -> Array:
        """(...) rate of the physical joint angle [rad/s or m/s]."""
        return self._of_joint(joint, t, "rates")

    def _of_joint(self, joint: str, t: ArrayLike, what: str) -> Array:
        choose(joint, self.joint_names, "joint", SceneError)
        number = self.joint_names.index(joint)
        return np.asarray(getattr(self.series(t), what)[:, number]).reshape(np.shape(t))

    def elastic_coordinates(self, link: str, t: ArrayLike) -> Array:
        """(..., n) elastic modal coordinates of a link [m √kg]."""
        return np.asarray(self.modal_coordinates(link, t)[..., 6:])

    def modal_coordinates(self, link: str, t: ArrayLike) -> Array:
        """(..., 6 + n) modal coordinates of a link, rigid-body ones first [m √kg]."""
        number = self.link_number(link)
        modes = self.formulation.mechanism.links[number].model.modes
        return self.series(t).modal[number].reshape(*np.shape(t), modes)

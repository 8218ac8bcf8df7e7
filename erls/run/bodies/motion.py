"""The motion of a scene of bodies and beams."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from erls.equations.nodal.nodes import Nodes
from erls.errors import SceneError, SimulationError
from erls.integrate.base import hermite_knots
from erls.integrate.constrained import ConstrainedSolution
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array
from erls.mechanism.sensors.base import Sensor
from erls.run.bodies.run import BodyRun
from erls.run.bodies.sensors import BodyInstants, body_sensors, node_motion
from erls.run.readings import reading, reading_columns, reading_curves, reading_samples
from erls.run.record import Curve
from fe_import.files.toml import choose
from fe_import.model import IntArray

_MOST_ENERGIES = 2001


@dataclass(frozen=True, repr=False)
class BodyMotion(BodyRun):
    """A motion with dense output.

    Attributes
    ----------
    solution : ConstrainedSolution
        Places and rotation matrices of the nodes at the knots, multipliers of the connections.
    """

    solution: ConstrainedSolution

    @property
    def failure(self) -> SimulationError | None:
        """Why the run ended early."""
        return self.solution.failure

    @cached_property
    def times(self) -> Array:
        """(k,) times of the steps, each once."""
        return np.unique(self.solution.t)

    def poses(self, t: ArrayLike, nodes: Sequence[int] | None = None) -> Array:
        """(k, n, 4, 4) poses of nodes, all unless given."""
        y, v = self._interpolated(self.within(t), nodes)
        return frames_and_twists(y, v)[0]

    def velocities(self, t: Array) -> Array:
        """(k, 6 n) velocities of all nodes, as the system's group has them."""
        poses, twists = frames_and_twists(*self._interpolated(self.within(t), None))
        return self._of_group(poses, twists)

    def multipliers(self, t: Array) -> Array:
        """(k, m) between steps in proportion."""
        s = self.solution
        found = np.empty((len(t), s.multipliers.shape[1]))
        for k, values in enumerate(s.multipliers.T):
            found[:, k] = np.interp(t, s.t, values)
        return found

    def energies(self) -> tuple[Array, Array]:
        """Times (k,) of knots, and total energy (k,) there [J]."""
        s = self.solution
        pick = np.unique(np.linspace(0, len(s.t) - 1, min(len(s.t), _MOST_ENERGIES)).astype(np.int64))
        return s.t[pick], self.energies_at(pick).sum(axis=1)

    def energies_at(self, knots: IntArray) -> Array:
        """(k, 2) kinetic and potential energy at some knots [J]."""
        system, t, kinds = self.assembly.system, self.solution.t[knots].tolist(), []
        for at, q, velocity in zip(t, *self.configurations_at(knots), strict=True):
            kinds.append(system.energy(at, q, velocity))
        return np.array(kinds).reshape(len(t), 2)

    def configurations_at(self, knots: IntArray) -> tuple[list[Nodes], Array]:
        """Configurations and velocities (k, 6 n) at some knots."""
        s, system, found = self.solution, self.assembly.system, list[Nodes]()
        stored = (x[knots, : 12 * system.count].reshape(len(knots), -1, 12) for x in (s.y, s.v))
        poses, twists = frames_and_twists(*stored)
        q = system.start
        for pose in poses:
            q = system.at(pose, q)
            found.append(q)
        return found, self._of_group(poses, twists)

    @property
    def conservative(self) -> bool:
        """Whether total energy should stay constant."""
        record = self.scene.record
        damped = any(s.damping for s in record.springs)
        damped = damped or any(c.friction or c.restitution < 1.0 for c in record.contacts)
        return not record.loads and not damped and all(c.motion is None for c in record.connections)

    def summary(self, times: Sequence[float] = ()) -> dict[str, Any]:
        """The JSON of ``erls simulate``."""
        _, totals = self.energies()
        work = self.solution.work
        return {
            **self.facts(),
            "integrator": "lie_generalized_alpha",
            "duration": self.end,
            "steps": work.steps,
            "rhs_calls": work.rhs_calls,
            "newton_iterations": work.newton_iterations,
            "iterations_per_step": work.newton_iterations / max(work.steps, 1),
            "factorizations": work.factorizations,
            "wall_s": self.wall_s,
            "energy": {
                "initial": float(totals[0]),
                "final": float(totals[-1]),
                "max_drift": float(np.ptp(totals)) if self.conservative else None,
            },
            **self.stated(),
            "samples": self.samples(times),
            "warnings": list(self.warnings),
        }

    def _interpolated(self, times: Array, nodes: Sequence[int] | None) -> tuple[Array, Array]:
        """(k, n, 12) places and rotation matrices of nodes, and their rates."""
        place, rate, _ = self.moving(times, nodes)
        return place, rate

    def moving(self, times: Array, nodes: Sequence[int] | None = None) -> tuple[Array, Array, Array]:
        """The same with their second derivatives."""
        s, count = self.solution, self.assembly.system.count
        own = np.arange(count) if nodes is None else np.asarray(nodes)
        columns = (12 * own[:, None] + np.arange(12)).ravel()
        own_knots = s.y[:, columns], s.v[:, columns], s.a[:, columns]
        y, v, a = hermite_knots(s.t, *own_knots, np.clip(times, s.t[0], self.end))
        place, rate, acceleration = (x.reshape(len(times), len(own), 12) for x in (y, v, a))
        return place, rate, acceleration

    def velocity(self, point: str, t: ArrayLike) -> Array:
        """(..., 3) of a node or body against the world [m/s]."""
        return self._of_node(point, t, "velocity")

    def acceleration(self, point: str, t: ArrayLike) -> Array:
        """(..., 3) of a node or body [m/s²]."""
        return self._of_node(point, t, "acceleration")

    def angular_velocity(self, point: str, t: ArrayLike) -> Array:
        """(..., 3) of a node or body, world axes [rad/s]."""
        return self._of_node(point, t, "spin")

    def angular_acceleration(self, point: str, t: ArrayLike) -> Array:
        """(..., 3) of a node or body, world axes [rad/s²]."""
        return self._of_node(point, t, "spin_rate")

    def _of_node(self, point: str, t: ArrayLike, what: str) -> Array:
        choose(point, self.assembly.numbers, "node", SceneError)
        found: Array = getattr(node_motion(*self.moving(self.within(t), [self.assembly.numbers[point]])), what)
        return found.reshape(*np.shape(t), 3)

    @cached_property
    def sensors(self) -> tuple[Sensor, ...]:
        """Those of the scene."""
        return body_sensors(self.scene, self.assembly)

    def sensor(self, name: str, t: ArrayLike) -> Array:
        """(...) reading of a sensor with one component, (..., c) of others."""
        return reading(self.sensors, name, BodyInstants(self, self.within(t)), np.shape(t))

    def columns(self, times: Array) -> dict[str, Array]:
        """What all runs of bodies give, and what sensors read before the energies."""
        found = super().columns(times)
        energies = {name: found.pop(name) for name in [name for name in found if name.startswith("energy.")]}
        return {**found, **reading_columns(self.sensors, BodyInstants(self, times), len(times)), **energies}

    def curves(self, times: Array) -> dict[str, Curve]:
        """Points, coordinates of connections, sensors."""
        return {**super().curves(times), **reading_curves(self.sensors, BodyInstants(self, times), len(times))}

    def samples(self, times: Sequence[float]) -> list[dict[str, Any]]:
        """What all runs of bodies give, and what sensors read."""
        found = super().samples(times)
        if not self.sensors:
            return found
        read = reading_samples(self.sensors, BodyInstants(self, np.asarray(times, dtype=float)), len(times))
        return [{**sample, "sensors": sensors} for sample, sensors in zip(found, read, strict=True)]

    def _of_group(self, poses: Array, twists: Array) -> Array:
        """(k, 6 n) velocities from twists in node axes."""
        if not self.assembly.system.local:
            twists = twists.copy()
            twists[..., :3] = (poses[..., :3, :3] @ twists[..., :3, None])[..., 0]
        return twists.reshape(len(twists), -1)


def frames_and_twists(place: Array, rate: Array) -> tuple[Array, Array]:
    """Poses (k, n, 4, 4) and twists (k, n, 6) in node axes, from stored places and rotation matrices (k, n, 12) and
    their rates; rotations made orthogonal.
    """
    shape = (*place.shape[:2], 3, 3)
    left, _, right = np.linalg.svd(place[..., 3:].reshape(shape))
    turn = left @ right
    back = np.swapaxes(turn, -1, -2)
    spin = back @ rate[..., 3:].reshape(shape)
    twist = np.empty((*shape[:2], 6))
    twist[..., :3] = (back @ rate[..., :3, None])[..., 0]
    twist[..., 3:] = (spin - np.swapaxes(spin, -1, -2))[..., [2, 0, 1], [1, 2, 0]] / 2
    return motions.poses(turn, place[..., :3]), twist

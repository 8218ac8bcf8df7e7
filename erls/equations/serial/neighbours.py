"""States beside one of a tree of links (`erls.equations.neighbours`): its coordinates add."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from erls.equations.formulation import Formulation, TreeFormulation
from erls.equations.neighbours import States
from erls.equations.serial.equilibrium import elastic_on_diagonal
from erls.equations.series import residual_series
from erls.equations.system import metre_scales
from erls.maths.so3 import Array
from erls.mechanism.drives import Drive
from erls.mechanism.joint_types import Freedom


@dataclass(frozen=True)
class TreeNeighbours:
    """Of a state with coordinates ``y``, rates ``v`` and accelerations ``a``, (n,) each; friction holds those at the
    places ``stuck``.
    """

    equations: TreeFormulation
    time: float
    y: Array
    v: Array
    a: Array
    stuck: tuple[int, ...] = ()

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Joints, then modes by link."""
        mechanism = self.equations.mechanism
        joints = (f"joint {mechanism.joints[k].name}" for k in self.equations.free_joints)
        modes = (f"link {link.name}, mode {k + 1}" for link in mechanism.links for k in range(link.elastic_modes))
        return (*joints, *modes)

    @cached_property
    def metres(self) -> Array:
        """See `Neighbours`."""
        return metre_scales(self.equations)

    @cached_property
    def stiffness(self) -> Array:
        """See `Neighbours`."""
        return elastic_on_diagonal(self.equations)[0]

    @property
    def size(self) -> float:
        """See `Neighbours`."""
        return self.reach

    @property
    def reach(self) -> float:
        """See `Neighbours`: of its largest link."""
        return self.equations.mechanism.reach

    @property
    def speed(self) -> Array:
        """See `Neighbours`."""
        return self.v

    @property
    def acceleration(self) -> Array:
        """See `Neighbours`."""
        return self.a

    @property
    def driven(self) -> tuple[float, float]:
        """See `Neighbours`."""
        joints = [joint for joint in self.equations.mechanism.joints if joint.drive.prescribed]
        return fastest([(joint.drive, joint.freedom) for joint in joints], self.time, self.reach)

    @property
    def multipliers(self) -> Array:
        """Friction that sticks is left out of the forces."""
        return np.zeros(len(self.stuck))

    def forces(self, x: Array, w: Array, b: Array) -> Array:
        """See `Neighbours`."""
        system = self.equations.compiled
        assert system is not None
        return residual_series(system, *self.states(x, w, b))

    def mass(self) -> Array:
        """See `Neighbours`."""
        return self.equations.mass_matrix(self.time, self.y)

    def rows(self) -> Array:
        """Joints that stick."""
        return np.eye(len(self.y))[list(self.stuck)]

    def violation(self) -> Array:
        """None."""
        return np.zeros(len(self.stuck))

    def states(self, x: Array, w: Array, b: Array) -> States:
        """See `Neighbours`."""
        return States(np.full(len(x), self.time), self.y + x, self.v + w, self.a + b)

    def later(self, tau: float) -> TreeNeighbours:
        """See `Neighbours`."""
        y = self.y + tau * self.v + tau**2 / 2 * self.a
        return replace(self, time=self.time + tau, y=y, v=self.v + tau * self.a)

    def at_rest(self, x: Array, multipliers: Array) -> TreeNeighbours:
        """See `Neighbours`."""
        still = np.zeros_like(self.v)
        return replace(self, y=self.y + x, v=still, a=still)

    def of(self, formulation: Formulation) -> TreeNeighbours:
        """See `Neighbours`."""
        return replace(self, equations=formulation)  # type: ignore[arg-type]  # a tree like this one


def fastest(motions: Sequence[tuple[Drive, Freedom]], t: float, reach: float) -> tuple[float, float]:
    """Largest speed [m/s] and acceleration [m/s²] of prescribed motions, of a turn at the end of a link."""
    found = [(0.0, 0.0)]
    for drive, freedom in motions:
        assert drive.motion is not None
        _, rate, acceleration = drive.motion.derivatives(t)
        arm = reach if freedom.turns else 1.0
        found.append((arm * abs(rate), arm * abs(acceleration)))
    fast, faster = zip(*found, strict=True)
    return max(fast), max(faster)

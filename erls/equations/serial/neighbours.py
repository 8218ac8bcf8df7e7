"""States beside one of a tree of links (`erls.equations.neighbours`): its coordinates add."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from erls.equations.formulation import Formulation, TreeFormulation
from erls.equations.neighbours import States
from erls.equations.serial.equilibrium import elastic_on_diagonal
from erls.equations.series import residual_series
from erls.equations.system import metre_scales
from erls.maths.so3 import Array


@dataclass(frozen=True)
class TreeNeighbours:
    """Of a state with coordinates ``y``, rates ``v`` and accelerations ``a``, (n,) each."""

    equations: TreeFormulation
    time: float
    y: Array
    v: Array
    a: Array

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
    def multipliers(self) -> Array:
        """None."""
        return np.zeros(0)

    def forces(self, x: Array, w: Array, b: Array) -> Array:
        """See `Neighbours`."""
        system = self.equations.compiled
        assert system is not None
        return residual_series(system, *self.states(x, w, b))

    def mass(self) -> Array:
        """See `Neighbours`."""
        return self.equations.mass_matrix(self.time, self.y)

    def rows(self) -> Array:
        """None."""
        return np.zeros((0, len(self.y)))

    def violation(self) -> Array:
        """None."""
        return np.zeros(0)

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

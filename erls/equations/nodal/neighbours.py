"""States beside one of a nodal system (`erls.equations.neighbours`): its nodes are displaced on their group.

A motion q(t) ∘ exp(x(t)) has the velocity v + ad(v) x + ẋ and the acceleration a + ad(a) x + ad(v) ẋ + ẍ, to first
order in x: a turned node sees its own velocity from other axes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from erls.equations.consistency import consistent_acceleration
from erls.equations.formulation import Formulation
from erls.equations.neighbours import States
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.nodes import Nodes
from erls.equations.system import metre_scales
from erls.errors import Cause, SceneError
from erls.maths.saddle import dense
from erls.maths.so3 import Array

SystemOf = Callable[[Any], NodalSystem]
Stored = Callable[[NodalSystem, float, Nodes, Array, Array, Callable[[], Array]], tuple[Array, Array, Array]]


def system_in(formulation: Any) -> NodalSystem:
    """The system of a formulation of nodes."""
    return formulation.system  # type: ignore[no-any-return]


@dataclass(frozen=True)
class NodalNeighbours:
    """Of a configuration with velocity and acceleration (n,) and multipliers (m,).

    Attributes
    ----------
    stored : callable
        What a run stores of a state: coordinates, rates and accelerations. It may ask for the multipliers (m,) that
        go with them.
    names : tuple of str
        (n,)
    system_of : callable
        What of a formulation is a system like this one.
    """

    system: NodalSystem
    time: float
    q: Nodes
    v: Array
    a: Array
    multipliers: Array
    stored: Stored
    names: tuple[str, ...]
    system_of: SystemOf = field(default=system_in, kw_only=True)

    @cached_property
    def metres(self) -> Array:
        """See `Neighbours`."""
        return metre_scales(self.system)

    @cached_property
    def stiffness(self) -> Array:
        """See `Neighbours`: nodes are all displaced as far."""
        return np.zeros(self.system.size)

    @property
    def size(self) -> float:
        """See `Neighbours`: of an element, since those of beams are stiff along their axes."""
        return float(self.metres.reshape(-1, 6)[:, 3:].min())

    @property
    def reach(self) -> float:
        """See `Neighbours`: of the farthest nodes, or of what turns about the only one."""
        return max(self.size, float(np.linalg.norm(np.ptp(self.q.poses[:, :3, 3], axis=0))))

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
        """See `Neighbours`: nodes leave nothing out."""
        return 0.0, 0.0

    def _moved(self, x: Array, w: Array, b: Array) -> tuple[Nodes, Array, Array]:
        q = self.system.compose(self.q, x)
        if not self.v.any() and not self.a.any():
            return q, w, b
        seen, faster = (self.system.group.bracket(part.reshape(-1, 6)) for part in (self.v, self.a))

        def turned(by: Array, part: Array) -> Array:
            return np.asarray(np.einsum("nij,nj->ni", by, part.reshape(-1, 6)).ravel())

        return q, self.v + turned(seen, x) + w, self.a + turned(faster, x) + turned(seen, w) + b

    def forces(self, x: Array, w: Array, b: Array) -> Array:
        """See `Neighbours`."""
        found = []
        for each in zip(x, w, b, strict=True):
            q, v, a = self._moved(*each)
            rows = self.system.constraint_matrix(self.time, q)
            found.append(self.system.residual(self.time, q, v, a) + rows.T @ self.multipliers)
        return np.array(found)

    def mass(self) -> Array:
        """See `Neighbours`."""
        return dense(self.system.mass_matrix(self.time, self.q))

    def rows(self) -> Array:
        """See `Neighbours`."""
        return dense(self.system.constraint_matrix(self.time, self.q))

    def violation(self) -> Array:
        """See `Neighbours`."""
        return self.system.constraint(self.time, self.q)

    def states(self, x: Array, w: Array, b: Array) -> States:
        """See `Neighbours`."""
        found = []
        for each in zip(x, w, b, strict=True):
            q, v, a = self._moved(*each)
            found.append(self.stored(self.system, self.time, q, v, a, partial(self._balancing, q, v, a)))
        y, v, a = (np.array(parts) for parts in zip(*found, strict=True))
        return States(np.full(len(x), self.time), y, v, a)

    def _balancing(self, q: Nodes, v: Array, a: Array) -> Array:
        """(m,) multipliers that go with accelerations."""
        rows = dense(self.system.constraint_matrix(self.time, q)) / self.metres
        force = self.system.residual(self.time, q, v, a) / self.metres
        return np.asarray(np.linalg.lstsq(rows.T, -force, rcond=None)[0])

    def later(self, tau: float) -> NodalNeighbours:
        """See `Neighbours`."""
        q = self.system.compose(self.q, tau * self.v + tau**2 / 2 * self.a)
        return replace(self, time=self.time + tau, q=q, v=self.v + tau * self.a)

    def at_rest(self, x: Array, multipliers: Array) -> NodalNeighbours:
        """See `Neighbours`."""
        if self.system.constraint_rate(self.time, self.q).any():
            message = "a joint moves as prescribed, so that its nodes are never at rest"
            remedy = "use formulation = 'erls' or 'ffr', whose coordinates are relative, or a time at which it rests"
            raise SceneError(Cause.BAD_FIELD, message, where="formulation", value="nodal", remedy=remedy)
        still = np.zeros(self.system.size)
        return replace(self, q=self.system.compose(self.q, x), v=still, a=still, multipliers=multipliers)

    def of(self, formulation: Formulation) -> NodalNeighbours:
        """See `Neighbours`."""
        return replace(self, system=self.system_of(formulation))


def nodal_neighbours(
    system: NodalSystem, t: float, q: Nodes, v: Array, stored: Stored, names: tuple[str, ...],
    system_of: SystemOf = system_in,
) -> NodalNeighbours:  # fmt: skip
    """Of a state with the acceleration and the multipliers of the equations of motion."""
    known = consistent_acceleration(system, t, q, v)
    return NodalNeighbours(system, t, q, v, *known, stored, names, system_of=system_of)


def names_of_nodes(owners: Sequence[str]) -> tuple[str, ...]:
    """(6 k,) of the motions of nodes, in their axes."""
    return tuple(f"{owner}, {way}" for owner in owners for way in ("x", "y", "z", "turn x", "turn y", "turn z"))

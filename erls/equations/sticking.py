"""A system some of whose joints stick: equations of motion with modes that are constant until they are set anew.

Modes say of each joint whether it slides on (1) or back (-1) or sticks (0). Whoever integrates asks for `Sticking.left`
along the motion; where it falls below zero a joint comes to rest or breaks away, and `Sticking.settle` sets the modes
that follow (`erls.equations.dry_friction`). In between the equations are smooth.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, Protocol

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import CompiledSystem
from erls.equations.dry_friction import DryFriction, Settled
from erls.equations.series import residual_series
from erls.equations.system import SecondOrderSystem
from erls.maths.calls import address_of, handed
from erls.maths.records import Memory, python_reader
from erls.maths.so3 import Array
from fe_import.model import IntArray


class Rubbing(SecondOrderSystem, Protocol):
    """Equations of motion that leave out friction that sticks, and know it."""

    @property
    def dry(self) -> DryFriction | None:
        """Friction that sticks."""

    def settled(self, t: float, y: Array, v: Array, released: Array) -> Settled:
        """What the set-valued law says at a state."""


class Sticking:
    """A `SecondOrderSystem` with modes.

    Parameters
    ----------
    system : Rubbing
        Compiled; ``dry`` is not None.
    """

    def __init__(self, system: Rubbing) -> None:
        assert system.dry is not None
        assert system.compiled is not None
        self._system, self._bare, self.dry = system, system.compiled, system.dry
        self.size, self.length_scales, self.breakpoints = system.size, system.length_scales, system.breakpoints

    @cached_property
    def compiled(self) -> CompiledSystem:
        """The equations; their working memory holds the modes."""
        from erls.equations import sticking_kernels as own  # here: it imports the compiler

        bare, integers = self._bare, [int(i) for i in self._bare.integers]
        constants, scratch = Memory(integers, bare.reals), Memory(integers, bare.scratch)
        room = own.Room(np.zeros(len(self.dry.places)), np.zeros((self.size, self.size)))
        whole = own.Frictions(
            residual=address_of(bare.residual, contract.RESIDUAL),
            mass_matrix=address_of(bare.mass_matrix, contract.MASS_MATRIX),
            stiffness_and_damping=address_of(bare.stiffness_and_damping, contract.STIFFNESS_AND_DAMPING),
            room=scratch.put(room),
            places=self.dry.places,
            sliding=self.dry.sliding,
        )
        integers.append(constants.put(whole))
        return CompiledSystem(
            size=self.size,
            reals=constants.numbers,
            integers=np.array(integers, dtype=np.int64),
            scratch=scratch.numbers,
            residual=own.residual,
            mass_matrix=own.mass_matrix,
            stiffness_and_damping=own.stiffness_and_damping,
            load_acceleration=lambda: own.acceleration,
        )

    @cached_property
    def modes(self) -> Array:
        """(m,) which equations read; see the module's docstring."""
        from erls.equations import sticking_kernels as own

        system = self.compiled
        frictions = python_reader(own.Frictions)(system.reals, system.integers, int(system.integers[-1]))
        return python_reader(own.Room)(system.scratch, system.integers, frictions.room).modes

    def settle(self, t: float, y: Array, v: Array, released: Array) -> Array:
        """Set the modes that the law gives a state; its accelerations (n,). ``released`` as of `settled`."""
        found = self._system.settled(t, y, v, released)
        self.modes[:] = found.modes
        return found.accelerations

    def brought_to_rest(self, t: float, y: Array, v: Array, joints: IntArray) -> Array:
        """(n,) rates when some joints come to rest, by what rates they have left: an impulse along each, and along
        those that stick, so that momentum along all other coordinates stays as it is.
        """
        if not len(joints):
            return v
        held = self.dry.places[np.union1d(np.flatnonzero(self.modes == 0.0), joints)]
        answers = np.linalg.solve(self._system.mass_matrix(t, y), np.eye(self.size)[:, held])
        result = np.array(v - answers @ np.linalg.solve(answers[held], v[held]))
        result[held] = 0.0
        return result

    def left(self, t: Array, y: Array, v: Array, a: Array) -> Array:
        """(k, m) of states of a motion with these modes: rate in the direction of one that slides, static force less
        friction of one that sticks. A mode ends where it falls below zero.
        """
        rates = self.modes * v[:, self.dry.places]
        if self.modes.all():
            return np.asarray(rates)
        return np.asarray(np.where(self.modes == 0.0, self.dry.static - np.abs(self.holding(t, y, v, a)), rates))

    def holding(self, t: Array, y: Array, v: Array, a: Array) -> Array:
        """(k, m) friction that balances each joint at states of a motion."""
        return np.asarray(residual_series(self._bare, t, y, v, a, self._address)[:, self.dry.places])

    @cached_property
    def _address(self) -> Any:
        """Of the bare residual: asking for it takes longer than most calls."""
        return handed(self._bare.residual, contract.RESIDUAL)

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n,) M a - f; of a joint that sticks, its acceleration."""
        return np.asarray(residual_series(self.compiled, np.array([t]), y[None], v[None], a[None])[0])

    def mass_matrix(self, t: float, y: Array) -> Array:
        """(n, n), with the unit matrix for joints that stick."""
        system, out = self.compiled, np.empty((self.size, self.size))
        place = np.ascontiguousarray(y, dtype=float)
        system.mass_matrix(system.reals, system.integers, system.scratch, t, place, out)
        return out

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """(n, n) twice, with zeros for joints that stick."""
        system, both = self.compiled, np.empty((2, self.size, self.size))
        state = np.ascontiguousarray(y, dtype=float), np.ascontiguousarray(v, dtype=float)
        system.stiffness_and_damping(system.reals, system.integers, system.scratch, t, *state, both[0], both[1])
        return both[0], both[1]

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) with the present modes.

        Raises
        ------
        SimulationError
            SINGULAR_MASS, naming the coordinate.
        """
        system, out = self.compiled, np.empty(self.size)
        state = np.ascontiguousarray(y, dtype=float), np.ascontiguousarray(v, dtype=float)
        if system.acceleration(system.reals, system.integers, system.scratch, t, *state, out):
            return self._system.acceleration(t, y, v)  # which names it
        return out

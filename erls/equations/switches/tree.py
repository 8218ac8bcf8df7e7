"""A tree of links some of whose joints stick, or whose motors come to their limits (`erls.equations.switches.base`)."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from erls.equations.switches.base import NO_FRICTION, Switches
from erls.equations.switches.law import Freely, Settled, settled
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.compiled_system import CompiledSystem
    from erls.equations.serial.formulation import SerialFormulation
    from erls.equations.switches.kernels import Room


class SwitchedTree(Switches):
    """A `SecondOrderSystem` with modes.

    Parameters
    ----------
    system : SerialFormulation
    """

    def __init__(self, system: SerialFormulation) -> None:
        from erls.equations.switches.gripped import grips_in  # here, as below: they import the compiler
        from erls.equations.switches.motors import Asked, acting_in, motors_among

        self._system, self._bare = system, system.compiled
        self.size, self.length_scales, self.breakpoints = system.size, system.length_scales, system.breakpoints
        acting = acting_in(self._bare)
        joints = system.mechanism.joints
        motors = motors_among([joint.drive for joint in joints], [joint.name for joint in joints], acting)
        super().__init__(system.dry or NO_FRICTION, motors, system.size)
        self.grips = grips_in(system.mechanism, self.compiled, self._bare.residual)
        self._asked = Asked(motors, self._bare, self._bare.residual)

    @cached_property
    def compiled(self) -> CompiledSystem:
        """The equations, with constants and working memory of their own, which hold the modes."""
        from dataclasses import replace

        from erls.equations import compiled_system as contract  # here: they import the compiler
        from erls.equations.switches import kernels as own
        from erls.maths.calls import address_of
        from erls.maths.records import Memory

        bare, integers = self._bare, [int(i) for i in self._bare.integers]
        constants, scratch = Memory(integers, bare.reals.copy()), Memory(integers, bare.scratch)
        rubs = len(self.rubbing.places)
        if not rubs:  # all functions of the tree are as they were
            return replace(bare, reals=constants.numbers, scratch=scratch.numbers)
        whole = own.Frictions(
            residual=address_of(bare.residual, contract.RESIDUAL),
            mass_matrix=address_of(bare.mass_matrix, contract.MASS_MATRIX),
            stiffness_and_damping=address_of(bare.stiffness_and_damping, contract.STIFFNESS_AND_DAMPING),
            room=scratch.put(own.Room(np.zeros(self.size), self.modes[:rubs], np.zeros((self.size, self.size)))),
            places=self.rubbing.places,
            sliding=self.rubbing.sliding,
        )
        integers.append(constants.put(whole))
        return contract.CompiledSystem(
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
    def _room(self) -> Room:
        """Which coordinates do not move, and modes, as the equations read them."""
        from erls.equations.switches import kernels as own  # here: it imports the compiler
        from erls.maths.records import python_reader

        system = self.compiled
        frictions = python_reader(own.Frictions)(system.reals, system.integers, int(system.integers[-1]))
        return python_reader(own.Room)(system.scratch, system.integers, frictions.room)

    def put(self, y: Array) -> None:
        """Into constants and memory of the equations."""
        system, rubs = self.compiled, len(self.rubbing.places)
        self.motors.put(self.modes[rubs:], system.reals, system.integers)
        if rubs:
            self._room.held[:] = 0.0
            self._room.held[self.fixed] = 1.0
            self._room.modes[:] = self.modes[:rubs]

    def freely(self, t: float, y: Array, v: Array) -> Freely:
        """See `Switches`."""
        with self._lent():
            return self._system.freely(t, y, v)

    def settled(self, t: float, y: Array, v: Array, released: Array) -> Settled:
        """See `Switches`."""
        with self._lent():
            return settled(self._system, t, y, v, released)

    def _lent(self) -> AbstractContextManager[None]:
        from erls.equations.switches.gripped import lent  # here: it imports the compiler

        return lent(self.grips, self._system.mechanism, self._bare)

    def asked(self, t: Array, y: Array, v: Array) -> Array:
        """See `Switches`."""
        return self._asked(t, y, v)

    def holding(self, t: Array, y: Array, v: Array, a: Array) -> Array:
        """See `Switches`: what is out of balance without this friction."""
        from erls.equations.series import residual_series  # here: it imports the compiler

        return np.asarray(residual_series(self._bare, t, y, v, a, self._address)[:, self.rubbing.places])

    @cached_property
    def _address(self) -> Any:
        """Of the bare residual: asking for it takes longer than most calls."""
        from erls.equations.compiled_system import RESIDUAL  # here: they import the compiler
        from erls.maths.calls import handed

        return handed(self._bare.residual, RESIDUAL)

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n,) M a - f; of a joint that sticks, its acceleration."""
        from erls.equations.series import residual_series  # here: it imports the compiler

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

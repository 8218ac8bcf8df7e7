"""What a motion with modes offers to whoever looks for their ends.

Modes are constant until they are set anew: of each joint with dry friction whether it slides on (1) or back (-1) or
sticks (0), then of each motor with a limit whether it follows what it is asked for (0) or gives its limit either way
(1, -1). Those of contacts whose points may stick come after them, and are kept elsewhere
(`erls.equations.switches.grips`). Whoever integrates asks for `Switches.left` along the motion; where it falls below
zero a joint comes to rest or breaks away, or a motor comes to its limit or leaves it, and `Switches.settle` sets the
modes that follow (`erls.equations.switches.law`). In between the equations are smooth.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from erls.equations.switches.grips import NO_GRIPS, Accelerate, Grips
from erls.equations.switches.law import DryFriction, Freely, Settled
from erls.equations.switches.shares import Shares, following, independent, shared
from erls.maths.so3 import Array
from fe_import.model import IntArray

if TYPE_CHECKING:  # it imports the compiler
    from erls.equations.switches.motors import Motors

_AT_ONCE = 1e-9  # of what a joint holds: who breaks away together
_AT_REST = 1e-9  # 1/s, of the size of the mechanism, or 1 s of a turn: what rounding leaves of a rate

NO_FRICTION = DryFriction(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0), ())


class Switches:
    """Modes of m joints with dry friction and c motors.

    Parameters
    ----------
    rubbing : DryFriction
        Of the m joints.
    motors : Motors
    size : int
        Number of coordinates n.
    grips : Grips, optional
        Of q contacts; none unless given.

    Attributes
    ----------
    modes : (m + c,) array
        See the module's docstring; change them by `set`.
    sees : bool
        See `seen`.
    seen_by : float
        β h² of steps that do not resolve all vibrations [s²]: accelerations are then those of M + β h² K, where a
        system knows how.
    fixed : int array
        Coordinates that do not move in the equations: of those that rest as many as are independent.
    """

    sees = False

    def __init__(self, rubbing: DryFriction, motors: Motors, size: int, grips: Grips = NO_GRIPS) -> None:
        self.rubbing, self.motors, self.grips = rubbing, motors, grips
        self.modes = np.zeros(len(rubbing.places) + len(motors.limits))
        self._rubs = len(rubbing.places)
        self.seen_by = 0.0
        self._still, self.fixed = np.zeros(size, dtype=bool), np.zeros(0, dtype=np.int64)

    @property
    def names(self) -> tuple[str, ...]:
        """What switches, for messages."""
        rub = (f"friction of joint {name!r} switches between sticking and sliding" for name in self.rubbing.names)
        limits = (f"the motor of joint {name!r} comes to its limit and leaves it" for name in self.motors.names)
        return (*rub, *limits, *self.grips.told)

    @property
    def count(self) -> int:
        """Modes: m + c + q."""
        return len(self.modes) + len(self.grips.names)

    @property
    def jumps(self) -> bool:
        """Whether accelerations jump where modes end."""
        return bool(len(self.rubbing.places) or self.grips.names)

    @property
    def slides(self) -> Array:
        """(m + c + q,) which modes are those of a joint that slides."""
        result = np.zeros(self.count, dtype=bool)
        result[: self._rubs] = self.modes[: self._rubs] != 0.0
        return result

    @property
    def begins_at_zero(self) -> Array:
        """(m + c + q,) which modes begin where they end: of joints that slide from rest, of motors, of contacts."""
        result = self.slides
        result[self._rubs :] = True
        return result

    @property
    def steady(self) -> bool:
        """Whether all modes are those of joints that slide."""
        return bool(self.slides.all())

    @property
    def still(self) -> Array:
        """(n,) which coordinates rest since friction holds them, or others by which they rest."""
        return self._still

    @abstractmethod
    def freely(self, t: float, y: Array, v: Array) -> Freely:
        """A state without dry friction, and with motors at their limits as they are asked."""

    @abstractmethod
    def settled(self, t: float, y: Array, v: Array, released: Array) -> Settled:
        """What the law says of a state; see `erls.equations.switches.law.settled`."""

    @abstractmethod
    def asked(self, t: Array, y: Array, v: Array) -> Array:
        """(k, c) what motors are asked for at states."""

    @abstractmethod
    def holding(self, t: Array, y: Array, v: Array, a: Array) -> Array:
        """(k, m) friction that holds each joint that sticks at states of a motion."""

    @abstractmethod
    def put(self, y: Array) -> None:
        """Say to the equations what modes are, and which coordinates do not move from where they are in ``y``."""

    @abstractmethod
    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) with the present modes."""

    def closed(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """The nearest state that a motion may have."""
        return y, v

    def set(self, modes: Array, fixed: IntArray, y: Array) -> None:
        """Set modes (m + c,), and which coordinates do not move, at a state (n,)."""
        self.modes[:] = modes
        self._still[:] = False
        self._still[self.rubbing.places[modes[: self._rubs] == 0.0]] = True
        self.fixed = np.array(fixed, dtype=np.int64)
        self.put(y)

    @property
    def undecided(self) -> Array:
        """(m + c,) for `settle`: nothing is known of any."""
        return np.full(len(self.modes), np.nan)

    def settle(self, t: float, y: Array, v: Array, decided: Array) -> Array:
        """Set the modes that follow at a state; its accelerations (n,).

        Parameters
        ----------
        decided : (m + c,) array
            Of joints that have broken away, and of motors that have come to their limit or left it, what they do; NaN
            of others. What moves at all is not asked.
        """
        rubs, given = decided[: self._rubs], decided[self._rubs :]
        self.grips.begin(t, y, v)
        motors = self.motors.by_value(self.asked(np.array([t]), y[None], v[None])[0])
        motors = np.where(np.isnan(given), motors, given)
        if not self._rubs:
            self.set(motors, self.rubbing.places, y)
        else:
            found = self.settled(t, y, v, np.where(np.isnan(rubs), 0.0, rubs))
            self.set(np.concatenate([found.modes, motors]), self.rubbing.places[found.held], y)
        self.grips.grasp(t, y, v, self.acceleration)
        return self.acceleration(t, y, v)

    def holding_at(self, t: float, y: Array, v: Array, a: Array) -> Shares:
        """Friction that holds the joints that stick, in their order, at a state, and the motion that would begin."""
        free, modes = self.freely(t, y, v), self.modes[: self._rubs]
        rest = np.flatnonzero(modes == 0.0)
        along = free.along - free.compliance @ (modes * self.rubbing.sliding)
        own, static = free.compliance[np.ix_(rest, rest)], self.rubbing.static[rest]
        return shared(own, along[rest], static, free.alone[rest])

    def brought_to_rest(self, t: float, y: Array, v: Array, joints: IntArray) -> Array:
        """(n,) rates when some joints come to rest, by what rates they have left: an impulse along each, and along
        those that stick, so that momentum along all other coordinates stays as it is. Who rests because they do has no
        rate either.
        """
        if not len(joints):
            return v
        free, rates = self.freely(t, y, v), v[self.rubbing.places]
        at_rest = np.union1d(np.flatnonzero(self.modes[: self._rubs] == 0.0), joints)
        held = at_rest[independent(free.compliance[np.ix_(at_rest, at_rest)], free.alone[at_rest])]
        impulses = np.linalg.solve(free.compliance[np.ix_(held, held)], rates[held])
        rates = rates - free.compliance[:, held] @ impulses
        others = np.setdiff1d(np.arange(self._rubs), at_rest)
        follow = others[following(free.compliance, free.alone, held, others)]
        at_rest = np.append(at_rest, follow[np.abs(rates[follow]) < _AT_REST])
        result = self.pushed(t, y, v, -free.answers[:, held] @ impulses)
        result[self.rubbing.places[at_rest]] = 0.0
        return result

    def pushed(self, t: float, y: Array, v: Array, change: Array) -> Array:
        """(n,) rates after a change of velocities (n,), of those that `freely` has accelerations of."""
        return np.asarray(v + change)

    def knot(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """(3, n) y, v and a at a state with the present modes, and what is kept beside them."""
        return np.array([y, v, self.acceleration(t, y, v)]), np.zeros(0)

    def seen(self, knots: Array, beside: Array) -> Array:
        """(k, 3, n) knots as modes are looked for in: where `sees` is set, friction that holds joints that stick stands
        in place of their accelerations, as steps have found it.
        """
        return knots

    def seen_at_start(self, knot: Array) -> Array:
        """(3, n) that of a leg, of which no step has found anything."""
        return knot

    def left(self, t: Array, y: Array, v: Array, a: Array) -> Array:
        """(k, m + c + q) of states of a motion with these modes: rate in the direction of a joint that slides, static
        force less friction of one that sticks; of a motor how far it is from its limit, or beyond; of contacts see
        `Grips.left`. A mode ends where it falls below zero.
        """
        modes = self.modes[: self._rubs]
        result = modes * v[:, self.rubbing.places]
        if not modes.all():
            result = np.where(modes == 0.0, self.rubbing.static - np.abs(self.holding(t, y, v, a)), result)
        parts = [result]
        if len(self.motors.limits):
            parts.append(self.motors.left(self.modes[self._rubs :], self.asked(t, y, v)))
        if self.grips.names:
            parts.append(self.grips.left(t, y, v, self._exactly))
        return np.concatenate(parts, axis=1)

    @property
    def _exactly(self) -> Accelerate | None:
        """What tells the friction of points that stick, where steps do not."""
        return None if self.sees else self.acceleration

    def after(self, t: float, y: Array, v: Array, a: Array, ended: IntArray) -> Array:
        """(m + c,) what is decided by modes that have ended at a state, see `settle` and `left`; those of contacts are
        set.
        """
        decided = self.undecided
        for k in ended[ended >= len(self.modes)].tolist():
            self.grips.end(k - len(self.modes), t, y, v, self._exactly)
        ended = ended[ended < len(self.modes)]
        sticks = ended[(ended < self._rubs) & (self.modes[ended] == 0.0)]
        if len(sticks):
            motion = self._begun(self.holding_at(t, y, v, a), sticks)
            decided[np.flatnonzero(motion)] = motion[motion != 0]
        for k in ended[ended >= self._rubs].tolist():
            asked = self.asked(np.array([t]), y[None], v[None])[0]
            decided[k] = np.sign(asked[k - self._rubs]) if self.modes[k] == 0.0 else 0.0
        return decided

    def _begun(self, found: Shares, ended: IntArray) -> Array:
        """(m,) -1, 1 of joints at rest that begin to move, 0 of others, where friction can no longer hold some."""
        rest = np.flatnonzero(self.modes[: self._rubs] == 0.0)
        result = np.zeros(self._rubs)
        result[rest] = found.motion
        full = np.abs(found.forces) >= self.rubbing.static[rest] * (1 - _AT_ONCE)
        alone = np.setdiff1d(ended, rest[found.motion != 0])
        for k in alone.tolist():  # others at the same time, whose share has no choice
            at = int(np.flatnonzero(rest == k)[0])
            result[k] = -np.sign(found.forces[at]) if full[at] else 0.0
        return result

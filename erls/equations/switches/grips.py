"""Modes of the friction of contacts: whether a point slides along its plane, and which way, or is held where it rests.

Joints that close loops, whose coordinates are none of the equations', have the same modes, and so have the other joints
there, which may rest since those do: a joint is a point that always presses, and moves along the first axis only. Modes
stand among the constants of a system (`erls.maths.contact_law`). While a point slides its mode ends where it comes to
rest, or where it has turned by more than 60° from the way that it began with; another one begins there. Those that come
to rest together are looked at together. A point that sticks is held by a spring and a damper so stiff that nothing is
seen of them, whose force is that which leaves it at rest, as far as µ F can: hence forces that hold several points are
one, also where rigid bodies would leave a choice. Its mode ends where that takes more, or where the point leaves the
plane.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from erls.maths.contact_places import AHEAD, ANCHOR, GIVE, MODE, SETTLING, SLIDES, SMOOTH, STICKS
from erls.maths.so3 import Array
from erls.mechanism.contacts import PointContact
from fe_import.model import IntArray

_TURNED = 0.5  # cosine of the angle by which a point may turn from the way that it began with
_SLOW = 0.5  # of d / τ: as slow as that a point rests
_JUST = 1e-9  # of what holds a point, that is left where it just does
_ALIKE = 1e-9  # of the largest answer to friction: points whose answers are more alike share it
_NEAR = 0.5  # of what holds a point, that is left where it is looked at more closely
_APART = 1e-6  # s, of states whose difference is an acceleration

Accelerate = Callable[[float, Array, Array], Array]


class Hold(NamedTuple):
    """What may stick.

    Attributes
    ----------
    name : str
    most : float
        What holds it, of what acts while it slides.
    told : str
        What switches, for messages.
    closely : bool
        Whether what holds it is always found from accelerations, since mechanisms of points have no size to speak of,
        and interpolated places say nothing of springs that give way by a billionth of it.
    """

    name: str
    most: float
    told: str
    closely: bool = False


def held_point(contact: PointContact) -> Hold:
    """A point of a contact."""
    most = contact.static_friction / max(contact.friction, 1e-300)
    return Hold(contact.name, most, f"the point of contact {contact.name!r} comes to rest and slides")


class Touch(NamedTuple):
    """Points against planes at k states.

    Attributes
    ----------
    gap : (k, q) array
        Negative where they press [m].
    slip, place : (k, q, 2) arrays
        Velocity along the axes of the plane [m/s], and place there [m].
    """

    gap: Array
    slip: Array
    place: Array

    @classmethod
    def of(cls, numbers: Array) -> Touch:
        """Of (k, q, 5): the gap, then velocity and place."""
        return cls(numbers[..., 0], numbers[..., 1:3], numbers[..., 3:5])


class Grips:
    """Modes of q contacts whose points may stick.

    Parameters
    ----------
    holds : sequence of Hold
    laws : list of (9,) arrays
        Views of their friction among the constants of a system, see `erls.maths.contact_law`.
    look : callable
        Of times (k,), coordinates and rates (k, n).
    """

    def __init__(
        self,
        holds: Sequence[Hold],
        laws: Sequence[Array],
        look: Callable[[Array, Array, Array], Touch],
    ) -> None:
        self.names, self.told = tuple(hold.name for hold in holds), tuple(hold.told for hold in holds)
        self.laws, self.look = list(laws), look
        self._most = np.array([hold.most for hold in holds])
        self._closely = np.array([hold.closely for hold in holds], dtype=bool)
        self._loose: list[int] = []  # those that have come to rest, whose force is still to be found

    @property
    def sticking(self) -> IntArray:
        """Numbers of those that stick."""
        return np.array([k for k, law in enumerate(self.laws) if law[MODE] == STICKS], dtype=np.int64)

    @property
    def kept(self) -> Array:
        """(q, 5) modes with what belongs to them."""
        return np.array([law[MODE:GIVE] for law in self.laws]).reshape(-1, GIVE - MODE)

    def restore(self, kept: Array) -> None:
        """As `kept` was."""
        for law, numbers in zip(self.laws, kept, strict=True):
            law[MODE:GIVE] = numbers

    def at(self, t: float, y: Array, v: Array) -> Touch:
        """Gap (q,), slip and place (q, 2) at one state."""
        found = self.look(np.array([t]), y[None], v[None])
        return Touch(*(part[0] for part in found))

    def held(self, touch: Touch) -> Array:
        """(..., q) whether points press, and are so slow that they rest."""
        rates = np.array([law[GIVE] / law[SETTLING] for law in self.laws])
        speed = np.linalg.norm(touch.slip, axis=-1)
        return np.asarray((touch.gap < 0.0) & (speed <= _SLOW * rates))

    def forget(self) -> None:
        """Nothing is known of any."""
        for law in self.laws:
            law[MODE] = SMOOTH

    def begin(self, t: float, y: Array, v: Array) -> list[int]:
        """Say of those of which nothing is known whether they stick; their numbers."""
        new = [k for k, law in enumerate(self.laws) if law[MODE] == SMOOTH]
        if new:
            touch = self.at(t, y, v)
            for k in new:
                self._decide(k, touch)
        return new

    @contextmanager
    def settled(self, t: float, y: Array, v: Array, accelerate: Accelerate) -> Iterator[None]:
        """Meanwhile have the modes that the law asks for at a state, where they are not known; ``accelerate`` gives
        accelerations (n,) with the modes as they are.
        """
        new = self.begin(t, y, v)
        try:
            self.grasp(t, y, v, accelerate)
            yield
        finally:
            for k in new:
                self.laws[k][MODE] = SMOOTH

    def _decide(self, k: int, touch: Touch) -> None:
        law = self.laws[k]
        if self.held(touch)[k]:
            law[MODE], law[ANCHOR : ANCHOR + 2] = STICKS, touch.place[k]
            self._loose.append(k)
            return
        speed = float(np.linalg.norm(touch.slip[k]))
        law[MODE] = SLIDES
        if speed > 0.0:
            law[AHEAD : AHEAD + 2] = touch.slip[k] / speed

    def end(self, k: int, t: float, y: Array, v: Array, accelerate: Accelerate | None) -> None:
        """Set the mode that follows where that of a contact has ended; see `left`."""
        law, touch = self.laws[k], self.at(t, y, v)
        if law[MODE] == STICKS and touch.gap[k] < 0.0:  # it goes the way that it is pushed
            pushed = self._pushed(k, touch.place[k], touch.slip[k])
            if accelerate is not None:
                pushed = self._holding(t, y, v, accelerate)[self.sticking == k][0]
            law[MODE], law[AHEAD : AHEAD + 2] = SLIDES, pushed / np.linalg.norm(pushed)
            return
        slow = self.held(touch)
        for other in range(len(self.laws)):  # those that come to rest together hold together
            if other == k or (slow[k] and slow[other] and self.laws[other][MODE] == SLIDES):
                self._decide(other, touch)

    def _pushed(self, k: int, place: Array, slip: Array) -> Array:
        """(..., 2) how far a point is pushed that sticks, of what acts while it slides."""
        law = self.laws[k]
        return np.asarray((place - law[ANCHOR : ANCHOR + 2] + law[SETTLING] * slip) / law[GIVE])

    def left(self, t: Array, y: Array, v: Array, accelerate: Accelerate | None) -> Array:
        """(k, q) of states of a motion: a mode ends where this falls below zero.

        ``accelerate`` gives accelerations (n,) with the modes as they are: what holds points is found from it where
        little is left, as steps need not be as exact as the way that points give. None where they are.
        """
        touch, result = self.look(t, y, v), np.ones((len(t), len(self.laws)))
        presses, near = touch.gap < 0.0, np.zeros(len(t), dtype=bool)
        for k, law in enumerate(self.laws):
            slip = touch.slip[:, k]
            if law[MODE] == STICKS:
                room = self._most[k] - np.linalg.norm(self._pushed(k, touch.place[:, k], slip), axis=1)
                result[:, k] = np.where(presses[:, k], room, -1.0)
                near |= presses[:, k] & ((room < _NEAR * self._most[k]) | self._closely[k])
            else:
                ahead = slip @ law[AHEAD : AHEAD + 2] - _TURNED * np.linalg.norm(slip, axis=1)
                result[presses[:, k], k] = ahead[presses[:, k]]
        if accelerate is None:
            return result
        sticking = self.sticking
        for i in np.flatnonzero(near).tolist():
            room = self._most[sticking] - np.linalg.norm(self._holding(t[i], y[i], v[i], accelerate), axis=1)
            result[i, sticking] = np.where(presses[i, sticking], room, -1.0)
        return result

    def _holding(self, t: float, y: Array, v: Array, accelerate: Accelerate) -> Array:
        """(s, 2) the same of all that stick, of what must push them back at a state."""
        kept = self.kept
        try:
            return self._needed(float(t), y, v, accelerate, self.sticking.tolist())
        finally:
            self.restore(kept)

    def grasp(self, t: float, y: Array, v: Array, accelerate: Accelerate) -> None:
        """Let those that have just come to rest be held by what leaves them at rest; those that this is too much for
        slide on, and the others are asked again.
        """
        loose, self._loose = sorted(set(self._loose)), []
        while loose:
            needed = self._needed(t, y, v, accelerate, loose)
            sizes = np.linalg.norm(needed, axis=1)
            gone = sizes > self._most[loose] * (1 + _JUST)
            for k, way, size in zip(loose, needed, sizes.tolist(), strict=True):
                law = self.laws[k]
                if size > self._most[k] * (1 + _JUST):
                    law[MODE], law[AHEAD : AHEAD + 2] = SLIDES, way / size
                else:
                    law[ANCHOR : ANCHOR + 2] -= law[GIVE] * way * (1 - _JUST)
            loose = [k for k, slides in zip(loose, gone, strict=True) if not slides] if gone.any() else []

    def _needed(self, t: float, y: Array, v: Array, accelerate: Accelerate, some: list[int]) -> Array:
        """(s, 2) the part of what acts while they slide that must push some points back, so that they stay at rest."""
        touch, laws = self.at(t, y, v), [self.laws[k] for k in some]
        for k, law in zip(some, laws, strict=True):
            law[ANCHOR : ANCHOR + 2] = touch.place[k] + law[SETTLING] * touch.slip[k]  # nothing pushes
        a = accelerate(t, y, v)
        ways = np.empty((2 * len(some), 2 * len(some)))
        for row in range(2 * len(some)):
            law, axis = laws[row // 2], ANCHOR + row % 2
            law[axis] -= law[GIVE]
            ways[:, row] = self._gained(t, y, v, accelerate(t, y, v) - a, some)
            law[axis] += law[GIVE]
        found = np.linalg.lstsq(ways, -self._accelerated(t, y, v, a, some), rcond=_ALIKE)[0]
        return np.asarray(found.reshape(-1, 2))

    def _gained(self, t: float, y: Array, v: Array, a: Array, some: list[int]) -> Array:
        """(2 s,) acceleration along planes that additional accelerations (n,) give."""
        size = float(np.abs(a).max())
        if size == 0.0:
            return np.zeros(2 * len(some))
        both = self.look(np.array([t, t]), np.array([y, y]), np.array([v, v + a / size])).slip[:, some]
        return np.asarray(size * (both[1] - both[0]).ravel())

    def _accelerated(self, t: float, y: Array, v: Array, a: Array, some: list[int]) -> Array:
        """(2 s,) acceleration along planes."""
        times = np.array([_APART, -_APART])
        places, rates = y + times[:, None] * v, v + times[:, None] * a
        found = self.look(t + times, places, rates).slip[:, some]
        return np.asarray(((found[0] - found[1]) / (2 * _APART)).ravel())


NO_GRIPS = Grips((), (), lambda t, y, v: Touch.of(np.zeros((len(t), 0, 5))))

"""Where the modes of joints that stick and slide change: pieces of a run, and what a time that moves does there.

At the time of a switch, g(t, y, ẏ; p) = 0: the rate of a joint that slides, or what is left of the static friction of
one that sticks. With the parameter it moves by δt = -δg / ġ, and as accelerations change from a⁻ to a⁺ there,

    δy⁺ = δy⁻,    δẏ⁺ = δẏ⁻ + (a⁻ - a⁺) δt

at a fixed time right after it (S. Galán, W. F. Feehery, P. I. Barton, Appl. Numer. Math. 31 (1999) 17-47).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from erls.equations.switches.tree import SwitchedTree
from erls.errors import Cause, SceneError
from erls.integrate.base import Leg, walked
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.outputs import ALONG
from erls.sensitivity.passages import Passage
from erls.sensitivity.variants import Difference, Variant
from fe_import.model import IntArray

_HELD = 1e-6  # of the static friction: what is left of it where a joint breaks away
_GRAZES = 1e-3  # of how fast g came down to zero on the whole


class Piece(NamedTuple):
    """Part of a leg with the same modes.

    Attributes
    ----------
    first, end : int
        Number of its first knot, and the one after its last.
    leg : Leg
        From where it begins.
    modes : (m,) array
        As of `SwitchedTree`; empty where nothing sticks.
    switched : bool
        Whether it ends where modes switch, rather than with the leg.
    """

    first: int
    end: int
    leg: Leg
    modes: Array
    switched: bool


class Switch(NamedTuple):
    """What a switch makes of small changes of a state: δẏ⁺ = δẏ⁻ - (a⁻ - a⁺) δg / ġ.

    Attributes
    ----------
    jump : (n,) array
        (a⁻ - a⁺) / ġ.
    slope : (2, n) array
        ∂g/∂(y, ẏ).
    own : (p,) array
        ∂g/∂p.
    stuck : (h,) array of int
        Coordinates that stick from then on.
    """

    jump: Array
    slope: Array
    own: Array
    stuck: IntArray

    def through(self, state: Array) -> Array:
        """(2, n, p) right after it, from those before."""
        result = state.copy()
        result[1] -= np.outer(self.jump, self.own + np.tensordot(self.slope, state, 2))
        result[1, self.stuck] = 0.0
        return result

    def back(self, state: Array) -> tuple[Array, Array]:
        """(2, n, c) derivatives of outputs by the state before, and (p, c) by parameters, from those by it after."""
        result = state.copy()
        result[1, self.stuck] = 0.0
        later = -self.jump @ result[1]
        return result + np.multiply.outer(self.slope, later), np.outer(self.own, later)


class StuckDifference(Difference):
    """The same derivative of equations with modes."""

    def __init__(self, own: Difference, wrap: Callable[[Any], SwitchedTree]) -> None:
        self.parameter, self._own, self._wrap = own.parameter, own, wrap
        self.few = self._wrapped(own.few)

    @property
    def variants(self) -> tuple[Variant, ...]:
        """All of them."""
        return self._wrapped(self._own.variants)

    def _wrapped(self, variants: Sequence[Variant]) -> tuple[Variant, ...]:
        return tuple(replace(variant, formulation=self._wrap(variant.formulation)) for variant in variants)


def _put(system: SwitchedTree, modes: Array) -> None:
    system.set(modes, system.rubbing.places[modes == 0.0], system.still)  # whatever the place


class Modes:
    """Equations with modes, of a run and of variants beside it, which all have the same ones."""

    def __init__(self, run: ChainRun) -> None:
        formulation: Any = run.formulation
        self._made: dict[int, tuple[Any, SwitchedTree]] = {}
        self._now = np.zeros(0)
        sticks = formulation.mechanism.sticks and formulation.dry is not None
        self.system: Any = self.of(formulation) if sticks else formulation
        self.sticking: SwitchedTree | None = self.system if sticks else None

    def of(self, formulation: Any) -> SwitchedTree:
        """Equations with modes over those of a formulation."""
        key = id(formulation)
        if key not in self._made:
            made = SwitchedTree(formulation)
            if len(self._now):
                _put(made, self._now)
            self._made[key] = formulation, made
        return self._made[key][1]

    def differences(self, given: Sequence[Difference]) -> list[Difference]:
        """By parameters, of equations with modes where there are any."""
        return [StuckDifference(one, self.of) for one in given] if self.sticking is not None else list(given)

    def set(self, modes: Array) -> None:
        """In all equations, those to come included."""
        self._now = modes
        for _, one in self._made.values():
            _put(one, modes)

    def held(self) -> IntArray:
        """(h,) coordinates of joints that stick now."""
        if self.sticking is None:
            return np.zeros(0, dtype=np.int64)
        return np.asarray(self.sticking.rubbing.places[self.sticking.modes == 0.0])

    def pieces(self, run: ChainRun) -> list[Piece]:
        """Of a run, in their order.

        Raises
        ------
        SceneError
            NO_DERIVATIVE: the run was made in parts.
        """
        t, v = run.solution.t, run.solution.v
        found = []
        for first, end, leg in walked(self.system, t):
            modes, switched = np.zeros(0), end < len(t) and bool(t[end - 1] < leg.end)
            if self.sticking is not None:
                rates = v[first:end, self.sticking.rubbing.places]
                modes = np.sign(rates[np.abs(rates).argmax(axis=0), np.arange(rates.shape[1])])
            elif switched:
                message = "derivatives of a run in parts are not known yet"
                raise SceneError(Cause.NO_DERIVATIVE, message, where=str(run.scene.path), remedy="run it in one piece")
            found.append(Piece(first, end, leg, modes, switched))
        return found

    def switch(
        self, run: ChainRun, piece: Piece, after: Piece, passage: Passage, differences: Sequence[Difference]
    ) -> Switch:
        """That at the end of a piece, whose modes are set.

        Raises
        ------
        SceneError
            BAD_FIELD: the switch grazes, so that its time has no derivative; or two joints switch at once.
        """
        assert self.sticking is not None
        s, last = run.solution, piece.end - 1
        t, y, v = float(s.t[last]), s.y[last], s.v[last]
        before, later = s.a[last], s.a[after.first]
        joint = self._joint(t, y, v, before, piece, after)
        length = max(t - piece.leg.start, 1e-300)
        tau = 1e-4 * length

        def left(system: SwitchedTree, time: float, y: Array, v: Array) -> float:
            a = system.acceleration(time, y, v)
            return float(system.left(np.array([time]), y[None], v[None], a[None])[0, joint])

        falling = sum(
            weight / tau * left(self.sticking, t + at * tau, y + at * tau * v, v + at * tau * before)
            for at, weight in ALONG
        )
        rows = slice(piece.first, piece.end)
        highest = float(np.abs(self.sticking.left(s.t[rows], s.y[rows], s.v[rows], s.a[rows])[:, joint]).max())
        if not abs(falling) * length > _GRAZES * highest:
            name, does = self.sticking.rubbing.names[joint], "comes to rest" if piece.modes[joint] else "breaks away"
            raise SceneError(
                Cause.BAD_FIELD,
                f"joint {name!r} only just {does} at t = {t:.9g} s: when it does so has no derivative",
                where=f"joint {name}: friction",
                remedy="end the run before, or change what makes it do so only just",
            )
        own = [
            float(one.of(lambda x: np.array(left(x.formulation, t, x.placed(y), x.placed(v))))) for one in differences
        ]
        slope = np.zeros(2 * len(y))
        for k, unit in enumerate(np.eye(2 * len(y)).reshape(-1, 2, len(y))):
            step = passage.share(unit)
            above, below = (left(self.sticking, t, y + x * unit[0], v + x * unit[1]) for x in (step, -step))
            slope[k] = (above - below) / (2 * step) if step else 0.0
        stuck = self.sticking.rubbing.places[after.modes == 0.0]
        return Switch((before - later) / falling, slope.reshape(2, -1), np.array(own), stuck)

    def _joint(self, t: float, y: Array, v: Array, a: Array, piece: Piece, after: Piece) -> int:
        """Number of the joint that switches."""
        assert self.sticking is not None
        dry = self.sticking.rubbing
        left = self.sticking.left(np.array([t]), y[None], v[None], a[None])[0]
        ended = np.where(piece.modes == 0.0, left <= _HELD * dry.static, v[dry.places] == 0.0)
        found = np.flatnonzero(ended & (piece.modes != after.modes))
        if len(found) == 1:
            return int(found[0])
        names = ", ".join(dry.names[k] for k in found) or "none that is known"
        raise SceneError(
            Cause.BAD_FIELD,
            f"joints switch at one instant, t = {t:.9g} s: {names}: derivatives through that are not known",
            where="joints: friction",
            remedy="end the run before",
        )

"""Exact tangents of forces out of balance, from a tape of their own source: link by link, eight states side by side.

The residual of a system is run once as plain Python on numbers that note what is done with them
(`erls.maths.tracing`); the derivatives of what was noted are a program (`erls.maths.linearized`), in which a link's
coordinates act on other links by the motion of its interface alone. That takes about a second for a kind of system,
whose constants may be any others then; the program takes about as long a state as a step of a run.

Curves over time (`erls.equations.serial.time_curves`) are inputs, so that their pieces make no tapes of their own.
Where forces go another way (a contact that touches, a motor at its limit), a tape is made of that way, too.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from erls.equations import side_by_side
from erls.equations.compiled_system import CompiledSystem
from erls.equations.serial.curve_series import curves_at
from erls.equations.serial.time_curves import curve
from erls.maths.jit import ENABLED, plain
from erls.maths.linearized import Program, jacobian
from erls.maths.so3 import Array
from erls.maths.tracing import Tape, Traced
from fe_import.model import IntArray

_KINDS = 16  # of systems that are remembered
_WAYS = 8  # of forces of a system
_LONGEST = 500_000  # numbers of a tape, ten seconds
_LOOPS = 10  # times as many evaluations of loops as of chains: conditions couple all coordinates, a tape takes as long


class _Noting:
    """A tape in the making, and the curves that were asked for."""

    def __init__(self, system: CompiledSystem, t: float) -> None:
        self.tape, self.curves = Tape(), dict[int, Any]()
        self._system, self._t = system, t

    def curve(self, at: int) -> Any:
        """Value, rate and acceleration of a curve, as leaves."""
        if at not in self.curves:
            system = self._system
            self.curves[at] = self.tape.leaves(curves_at(system.reals, system.integers, at, np.array([self._t]))[0])
        return tuple(self.curves[at])


_now: list[_Noting] = []


def _noted_curve(integers: IntArray, at: int, t: Any) -> Any:
    return _now[-1].curve(int(at))


@dataclass(frozen=True)
class _Way:
    """Derivatives of forces that go one way.

    Attributes
    ----------
    program : Program
        Of ∂R/∂(y, v, a).
    places : (o, 2) array of int
        By which of these each result is, of which force: force, coordinate.
    values : (l,) array
        Of leaves of the program that are numbers of the formulas.
    constants : (2, c) array of int
        Leaves of the program that are constants of the system, and which.
    inputs : (2, i) array of int
        Leaves that are inputs, and their numbers among time, coordinates, rates, accelerations and curves.
    curves : tuple of int
        Places of these.
    """

    program: Program
    places: IntArray
    values: Array
    constants: IntArray
    inputs: IntArray
    curves: tuple[int, ...]


@dataclass
class _Ways:
    """Those that are known of a kind of system; ``closed`` where no more are noted."""

    known: list[_Way] = field(default_factory=list)
    closed: bool = False


def worth_taping(evaluations: int) -> bool:
    """Whether tapes of loops are worth their making, against so many evaluations of forces."""
    return ENABLED and evaluations >= _LOOPS * side_by_side.WORTH


def _noted(system: CompiledSystem, t: float, y: Array, v: Array, a: Array) -> _Way | None:
    """The way of forces at a state; None where formulas do more with a number than a tape can note, or too much."""
    noting = _Noting(system, t)
    tape = noting.tape
    reals = tape.leaves(system.reals)
    now, *state = (tape.leaves(x) for x in ([t], y, v, a))
    out = np.zeros(system.size, dtype=object)
    called = {**getattr(system, "called", {}), curve: _noted_curve}
    _now.append(noting)
    try:
        residual = plain(system.residual, called=called)
        residual(reals, system.integers, system.scratch.astype(object), now[0], *state, out)
    except (TypeError, AttributeError, ArithmeticError):
        return None
    finally:
        _now.pop()
    if len(tape) > _LONGEST:
        return None
    moved = np.concatenate([_places(tape, x) for x in state])
    zeros = np.flatnonzero(system.reals == 0)  # constants come first
    program, places = jacobian(tape, moved.tolist(), _places(tape, out).tolist(), zeros.tolist())
    inputs = np.concatenate([_places(tape, now), moved, *(_places(tape, x) for x in noting.curves.values())])
    number = np.full(len(tape), -1)
    number[inputs] = np.arange(len(inputs))
    asked, leaves = number[program.leaves], program.leaves
    constants, given = np.flatnonzero(leaves < len(reals)), np.flatnonzero(asked >= 0)
    return _Way(
        program,
        places,
        np.array(tape.values)[leaves],
        np.stack([constants, leaves[constants]]),
        np.stack([given, asked[given]]),
        tuple(noting.curves),
    )


def _places(tape: Tape, numbers: Any) -> IntArray:
    return np.array([x.place if isinstance(x, Traced) else tape.literal(float(x)) for x in numbers], dtype=np.int64)


_known: OrderedDict[tuple[Any, bytes, bytes], _Ways] = OrderedDict()


def taped_tangents(system: CompiledSystem, t: Array, y: Array, v: Array, a: Array) -> Array | None:
    """(k, n, 3 n) ∂R/∂(y, v, a) at k states; None where forces cannot be noted, or go too many ways.

    Of systems that call others by their addresses alone where these are told (`CompiledLoops.called`).
    """
    key = system.residual, system.integers.tobytes(), (system.reals == 0).tobytes()
    ways = _known.setdefault(key, _Ways())
    _known.move_to_end(key)
    if len(_known) > _KINDS:
        _known.popitem(last=False)
    n = system.size
    found, left = np.zeros((len(t), n, 3 * n)), np.arange(len(t))
    for number in range(_WAYS):
        if number == len(ways.known):
            k = left[0]
            made = None if ways.closed else _noted(system, float(t[k]), y[k], v[k], a[k])
            if made is None:
                ways.closed = True
                return None
            ways.known.append(made)
        own = ways.known[number]
        results, held = _run(own, system, *(x[left] for x in (t, y, v, a)))
        some = left[held]
        found[some[:, None], own.places[:, 0], own.places[:, 1]] = results[held]
        left = left[~held]
        if not len(left):
            return found
    return None


def _run(own: _Way, system: CompiledSystem, t: Array, y: Array, v: Array, a: Array) -> tuple[Array, NDArray[np.bool_]]:
    from erls.maths.programs import run  # here: compiled when it is needed

    values = own.values.copy()
    values[own.constants[0]] = system.reals[own.constants[1]]
    curves = [curves_at(system.reals, system.integers, at, t) for at in own.curves]
    given = np.hstack([t[:, None], y, v, a, *curves])
    return run(own.program, values, own.inputs[0], given[:, own.inputs[1]])

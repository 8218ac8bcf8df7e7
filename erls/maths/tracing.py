"""Numbers that note what is done with them: formulas of any scalar as a tape of operations.

Equations are written once, for any scalar; as plain Python (`erls.maths.jit.plain`) they take these, too. What is noted
is a list of numbers, each a leaf or made of earlier ones by one operation, of which derivatives are found by rule
(`erls.maths.linearized`). A tape holds for all values that lead the same way through the formulas: comparisons are
noted as well, with their outcomes, as guards.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

LEAF, SUM, PRODUCT = range(3)
"""Kinds of numbers; those beyond are functions of one number, `FUNCTIONS`."""


class Function(NamedTuple):
    """Of one number: what it is called, itself, and its slope from the number and its value, in their scalars."""

    name: str
    value: Callable[[Any], Any]
    slope: Callable[[Any, Any], Any]


FUNCTIONS = (
    Function("reciprocal", lambda x: 1.0 / x, lambda x, f: -(f * f)),
    Function("sqrt", np.sqrt, lambda x, f: 0.5 / f),
    Function("sin", np.sin, lambda x, f: np.cos(x)),
    Function("cos", np.cos, lambda x, f: -np.sin(x)),
    Function("tan", np.tan, lambda x, f: 1.0 + f * f),
    Function("exp", np.exp, lambda x, f: f),
    Function("log", np.log, lambda x, f: 1.0 / x),
    Function("tanh", np.tanh, lambda x, f: 1.0 - f * f),
    Function("sinh", np.sinh, lambda x, f: np.cosh(x)),
    Function("cosh", np.cosh, lambda x, f: np.sinh(x)),
    Function("arctan", np.arctan, lambda x, f: 1.0 / (1.0 + x * x)),
    Function("sign", np.sign, lambda x, f: 0.0),
    Function("fabs", np.fabs, lambda x, f: x.sign()),
    Function("floor", np.floor, lambda x, f: 0.0),
)
_NUMBER = {function.name: PRODUCT + 1 + k for k, function in enumerate(FUNCTIONS)}
COMPARISONS = (operator.lt, operator.le, operator.gt, operator.ge, operator.eq, operator.ne)


class Tape:
    """What was done with numbers.

    Attributes
    ----------
    kinds, firsts, seconds : lists of int
        Of each number: its kind, and of which it was made.
    values : list of float
        At which it was noted.
    literals : dict of float to int
        Leaves that are numbers of the formulas.
    guards : list of (comparison, first, second, outcome)
        Comparisons as numbers of `COMPARISONS`.
    """

    def __init__(self) -> None:
        self.kinds: list[int] = []
        self.firsts: list[int] = []
        self.seconds: list[int] = []
        self.values: list[float] = []
        self.literals: dict[float, int] = {}
        self.guards: list[tuple[int, int, int, bool]] = []

    def __len__(self) -> int:
        return len(self.kinds)

    def made(self, kind: int, first: int, second: int, value: float) -> Traced:
        """A number of an operation."""
        self.kinds.append(kind)
        self.firsts.append(first)
        self.seconds.append(second)
        self.values.append(value)
        return Traced(self, len(self.kinds) - 1, value)

    def leaves(self, values: Any) -> Any:
        """(k,) numbers that come from outside, in an array of objects."""
        found = np.empty(len(values), dtype=object)
        found[:] = [self.made(LEAF, -1, -1, float(value)) for value in values]
        return found

    def literal(self, value: float) -> int:
        """The leaf of a number of the formulas."""
        if value not in self.literals:
            self.literals[value] = self.made(LEAF, -1, -1, value).place
        return self.literals[value]

    def slope(self, place: int) -> int:
        """The number that is the slope of a function of one number; noted now."""
        function, first = FUNCTIONS[self.kinds[place] - PRODUCT - 1], self.firsts[place]
        found = function.slope(*(Traced(self, k, self.values[k]) for k in (first, place)))
        return found.place if isinstance(found, Traced) else self.literal(float(found))


class Traced:
    """A number on a tape."""

    __slots__ = ("place", "tape", "value")
    __hash__ = None  # type: ignore[assignment]  # numbers that compare as values

    def __init__(self, tape: Tape, place: int, value: float) -> None:
        self.tape, self.place, self.value = tape, place, value

    def __add__(self, other: Any) -> Any:
        if type(other) is Traced:
            return self.tape.made(SUM, self.place, other.place, self.value + other.value)
        return self if other == 0.0 else self.tape.made(SUM, self.place, self._of(other), self.value + other)

    __radd__ = __add__

    def __mul__(self, other: Any) -> Any:
        if type(other) is Traced:
            return self.tape.made(PRODUCT, self.place, other.place, self.value * other.value)
        if other == 0.0:
            return 0.0
        return self if other == 1.0 else self.tape.made(PRODUCT, self.place, self._of(other), self.value * other)

    __rmul__ = __mul__

    def __neg__(self) -> Any:
        return self * -1.0

    def __sub__(self, other: Any) -> Any:
        return self + -other

    def __rsub__(self, other: Any) -> Any:
        return -self + other

    def __truediv__(self, other: Any) -> Any:
        return self * (other._function("reciprocal") if type(other) is Traced else 1.0 / other)

    def __rtruediv__(self, other: Any) -> Any:
        return self._function("reciprocal") * other

    def __pow__(self, exponent: Any) -> Any:
        if exponent != int(exponent) or exponent < 1:
            if not self._compare(COMPARISONS.index(operator.gt), 0.0):
                raise TypeError("such a power of no positive number")
            return 1.0 if exponent == 0 else (self._function("log") * exponent)._function("exp")
        found = self
        for _ in range(int(exponent) - 1):
            found = found * self
        return found

    def __abs__(self) -> Any:
        return self._function("fabs")

    def arctan2(self, other: Any) -> Any:
        """The angle of a point, by that of half of it on the side where this does not cancel; NumPy calls it."""
        length = (self * self + other * other)._function("sqrt")
        if other >= 0.0:
            return 2.0 * (self / (length + other))._function("arctan")
        turned = np.pi if self._compare(COMPARISONS.index(operator.ge), 0.0) else -np.pi
        return turned - 2.0 * (self / (length - other))._function("arctan")

    def __floor__(self) -> Any:
        return self._function("floor")

    def __bool__(self) -> bool:
        return self._compare(COMPARISONS.index(operator.ne), 0.0)

    def __float__(self) -> float:
        raise TypeError("a number on a tape is no single value")

    @property
    def real(self) -> Any:
        """Itself."""
        return self

    @property
    def imag(self) -> float:
        """None."""
        return 0.0

    def _of(self, value: Any) -> int:
        return self.tape.literal(float(value))

    def _function(self, name: str) -> Any:
        kind = _NUMBER[name]
        value = FUNCTIONS[kind - PRODUCT - 1].value(self.value)
        return self.tape.made(kind, self.place, -1, float(value))

    def _compare(self, which: int, other: Any) -> bool:
        second = other.place if type(other) is Traced else self._of(other)
        outcome = bool(COMPARISONS[which](self.value, self.tape.values[second]))
        self.tape.guards.append((which, self.place, second, outcome))
        return outcome


def _comparison(which: int) -> Any:
    def compare(self: Traced, other: Any) -> bool:
        return self._compare(which, other)

    return compare


def _function(name: str) -> Any:
    def call(self: Traced) -> Any:
        return self._function(name)

    return call


for _which, _name in enumerate(("lt", "le", "gt", "ge", "eq", "ne")):
    setattr(Traced, f"__{_name}__", _comparison(_which))
for _name in _NUMBER:  # NumPy's functions call these of objects
    setattr(Traced, _name, _function(_name))

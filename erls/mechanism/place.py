"""Checks of a record's fields, with errors that name scene file, field, value and remedy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from erls.errors import Cause, SceneError

T = TypeVar("T")

LARGEST = 1e30
"""Numbers beyond this are typing errors; below it no intermediate result overflows."""
SHORTEST = 1e-9
"""Shortest interval of time, in s, that a profile resolves; 0 stands for a jump where a jump is meant."""
LATEST = 1e9
"""Latest time, in s."""


@dataclass(frozen=True)
class Place:
    """Where a record stands.

    Parameters
    ----------
    folder : Path
        Folder of the scene file; relative table paths start there.
    where : str
        ``<scene file>: <field path>`` of the record, or the scene file alone.
    revolute : bool
        Whether the joint's coordinate is an angle (rad) or a length (m).
    """

    folder: Path
    where: str
    revolute: bool = True

    def field(self, name: str) -> str:
        """File and path of a field of the record."""
        return f"{self.where}.{name}" if ": " in self.where else f"{self.where}: {name}"

    def at(self, name: str) -> Place:
        """Place of a record inside this one."""
        return replace(self, where=self.field(name))

    def error(
        self, name: str, message: str, value: Any = None, limit: Any = None, *, remedy: str
    ) -> SceneError:
        """A bad field, ready to raise."""
        return SceneError(
            Cause.BAD_FIELD, message, where=self.field(name), value=value, limit=limit, remedy=remedy
        )

    def number(self, name: str, value: float, *, limit: float = LARGEST) -> float:
        """A finite number of plausible size."""
        if not abs(value) <= limit:
            remedy = f"give a number between {-limit:g} and {limit:g}"
            raise self.error(name, "not a finite number of plausible size", value, remedy=remedy)
        return value

    def time(self, name: str, value: float) -> float:
        """A time in s; it may be negative."""
        return self.number(name, value, limit=LATEST)

    def positive(self, name: str, value: float) -> float:
        """A finite number above zero."""
        if not self.number(name, value) > 0.0:
            raise self.error(name, "must be positive", value, remedy="give a number above 0")
        return value

    def not_negative(self, name: str, value: float) -> float:
        """A finite number, zero included."""
        if self.number(name, value) < 0.0:
            raise self.error(name, "must not be negative", value, remedy="give 0 or a number above it")
        return value

    def span(self, name: str, value: float, *, zero: bool = False) -> float:
        """A length of time in s, at least `SHORTEST`, or 0 where ``zero`` allows it."""
        if self.time(name, value) < SHORTEST and not (zero and value == 0.0):
            remedy = f"give {'0 (a jump) or ' if zero else ''}at least {SHORTEST:g} s"
            raise self.error(name, "not a length of time", value, remedy=remedy)
        return value

    def choice(self, name: str, value: T, options: Sequence[T]) -> T:
        """One of a few options."""
        if value not in options:
            remedy = "known: " + ", ".join(str(o) for o in options)
            raise self.error(name, "not one of the options", value, remedy=remedy)
        return value

    def quantity(self, name: str, plain: float | None, degrees: float | None) -> float:
        """A coordinate in rad or m, from ``name`` or ``name_deg``, of which exactly one is given."""
        used, value, factor = self.one_of(name, plain, degrees)
        return self.number(used, value) * factor

    def quantities(
        self, name: str, plain: Sequence[float] | None, degrees: Sequence[float] | None
    ) -> NDArray[np.float64]:
        """Like `quantity`, for a list."""
        used, values, factor = self.one_of(name, plain, degrees)
        return np.array([self.number(f"{used}[{i}]", v) for i, v in enumerate(values)], dtype=float) * factor

    def one_of(self, name: str, plain: T | None, degrees: T | None) -> tuple[str, T, float]:
        """Name, value and factor to rad of whichever of ``name`` and ``name_deg`` is given."""
        if degrees is not None:
            self.angular(f"{name}_deg", name)
            if plain is not None:
                remedy = f"keep {name!r} or '{name}_deg'"
                raise self.error(name, "given twice, plain and in degrees", _scalar(plain), remedy=remedy)
            return f"{name}_deg", degrees, math.pi / 180.0
        if plain is None:
            remedy = f"give {name!r}" + (f" (rad) or '{name}_deg'" if self.revolute else " in m")
            raise self.error(name, "missing", remedy=remedy)
        return name, plain, 1.0

    def angular(self, name: str, instead: str) -> None:
        """Refuse a field in degrees at a prismatic joint."""
        if not self.revolute:
            remedy = f"use {instead!r}, in metres"
            raise self.error(
                name, "degrees at a prismatic joint, whose coordinate is a length", remedy=remedy
            )

    def rising(self, name: str, times: Sequence[float], least: int = 2) -> NDArray[np.float64]:
        """A list of strictly rising times."""
        if len(times) < least:
            remedy = f"give at least {least} times"
            raise self.error(name, "too few times", len(times), least, remedy=remedy)
        for i, t in enumerate(times):
            self.time(f"{name}[{i}]", t)
            if i and t - times[i - 1] < SHORTEST:
                remedy = (
                    f"let times rise strictly, by at least {SHORTEST:g} s; the one before is {times[i - 1]}"
                )
                raise self.error(f"{name}[{i}]", "times do not rise", t, remedy=remedy)
        return np.array(times, dtype=float)


def _scalar(value: object) -> object:
    return value if isinstance(value, (int, float)) else None

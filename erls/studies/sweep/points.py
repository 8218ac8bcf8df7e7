"""Points of a space of parameters: grids, samples, tables.

Rules for a further kind of points:

1. It has ``keys`` as ``--set`` takes them, a length, and ``row(number)``: a value for each key. Rows are made when they
   are asked for: there may be a million.
2. The same words give the same points on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from erls.errors import Cause, SceneError
from erls.files.csv_table import read_rows
from erls.maths.so3 import Array
from erls.scene.overrides import value_of

MOST = 10_000_000
"""Points of one sweep."""


class Points(Protocol):
    """See the rules of this module."""

    @property
    def keys(self) -> tuple[str, ...]: ...

    def __len__(self) -> int: ...

    def row(self, number: int) -> tuple[Any, ...]:
        """A value for each key."""


@dataclass(frozen=True)
class Grid:
    """All combinations of the values of each key; the last key changes fastest.

    Attributes
    ----------
    axes : dict of str to tuple
        Values by key.
    """

    axes: Mapping[str, tuple[Any, ...]]

    @property
    def keys(self) -> tuple[str, ...]:
        """In the order in which they were given."""
        return tuple(self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each key."""
        return tuple(len(values) for values in self.axes.values())

    def __len__(self) -> int:
        return math.prod(self.shape)

    def row(self, number: int) -> tuple[Any, ...]:
        """A value for each key."""
        places = np.unravel_index(number, self.shape)
        return tuple(values[int(k)] for values, k in zip(self.axes.values(), places, strict=True))


@dataclass(frozen=True)
class Listed:
    """Rows one by one.

    Attributes
    ----------
    keys : tuple of str
    rows : sequence of sequences
        A value for each key.
    """

    keys: tuple[str, ...]
    rows: Sequence[Sequence[Any]] | Array

    def __len__(self) -> int:
        return len(self.rows)

    def row(self, number: int) -> tuple[Any, ...]:
        """A value for each key."""
        row = self.rows[number]
        return tuple(row.tolist() if isinstance(row, np.ndarray) else row)


def grid_of(points: Mapping[str, Sequence[Any]]) -> Grid:
    """Values by key, as Python gives them.

    Raises
    ------
    SceneError
        BAD_FIELD: no values, or one that is no list.
    """
    axes = {}
    for key, values in points.items():
        if np.isscalar(values) or getattr(values, "shape", None) == ():
            message, remedy = "not a list of values", "put a single value into brackets, too"
            raise SceneError(Cause.BAD_FIELD, message, where=f"points[{key!r}]", value=values, remedy=remedy)
        axes[key] = tuple(_plain(value) for value in values)
    if not axes or not all(axes.values()):
        message, remedy = "a sweep needs at least one point", "give values by key"
        raise SceneError(Cause.BAD_FIELD, message, where="points", value=points, remedy=remedy)
    return Grid(axes)


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value.tolist() if isinstance(value, np.ndarray) else value


def sampled(ranges: Mapping[str, Sequence[float]], method: str, count: int, seed: int = 0) -> Listed:
    """Points spread over ranges.

    Parameters
    ----------
    ranges : dict of str to (low, high)
    method : str
        A name from `SAMPLERS`.
    count : int
    seed : int
        Of the same scrambling or drawing.
    """
    from scipy.stats import qmc

    low, high = (np.array([limits[k] for limits in ranges.values()], dtype=float) for k in (0, 1))
    unit = SAMPLERS[method](qmc, len(ranges), count, seed)
    return Listed(tuple(ranges), low + unit * (high - low))


def _sobol(qmc: Any, size: int, count: int, seed: int) -> Array:
    whole = max(count - 1, 0).bit_length()  # the sequence is balanced at powers of two
    return np.asarray(qmc.Sobol(size, rng=seed).random_base2(whole)[:count])


SAMPLERS: dict[str, Callable[[Any, int, int, int], Array]] = {
    "latin-hypercube": lambda qmc, size, count, seed: qmc.LatinHypercube(size, rng=seed).random(count),
    "sobol": _sobol,
    "random": lambda qmc, size, count, seed: np.random.default_rng(seed).random((count, size)),
}
"""How samples are drawn: one line each."""


def points_of(vary: Sequence[str], sample: str = "", seed: int = 0, table: Path | None = None) -> Points:
    """The points that a command line asks for.

    Parameters
    ----------
    vary : sequence of str
        ``KEY=A:B:N`` for N even values, ``KEY=V,W`` for a list, with ``sample`` ``KEY=A:B`` for a range.
    sample : str
        ``METHOD:COUNT``, a method from `SAMPLERS`; a full grid unless given.
    seed : int
        Of the sample.
    table : Path or None
        CSV table whose head holds keys, instead.

    Raises
    ------
    SceneError
        Not of this form, or no points.
    """
    if table is not None:
        if vary or sample:
            raise _bad("--points", str(table), "a table gives all points", "leave --vary and --sample out")
        head, rows = read_rows(table)
        return _checked(Listed(head, [[value_of(cell) for cell in row] for row in rows]), str(table))
    axes = dict(_axis(text, bool(sample)) for text in vary)
    if len(axes) < len(vary) or not axes:
        remedy = "e.g. --vary joints.hip.damping=0:1:5"
        raise _bad("--vary", ", ".join(vary), "each key is varied once" if axes else "nothing is varied", remedy)
    if not sample:
        return _checked(Grid(axes), "--vary")
    method, _, count = sample.partition(":")
    if method not in SAMPLERS or not count.isdecimal():
        raise _bad("--sample", sample, "not METHOD:COUNT", f"methods are {', '.join(SAMPLERS)}")
    if int(count) > MOST:
        raise _bad("--sample", count, f"more than {MOST} points", "ask for fewer")
    return _checked(sampled(axes, method, int(count), seed), "--sample")


def _axis(text: str, as_range: bool) -> tuple[str, tuple[Any, ...]]:
    key, equals, said = text.partition("=")
    parts = said.split(":")
    try:
        if not equals or not key.strip() or not said.strip():
            raise ValueError
        if as_range:
            low, high = (_number(part) for part in parts)
            return key.strip(), (low, high)
        if len(parts) == 3:
            low, high, count = _number(parts[0]), _number(parts[1]), int(parts[2])
            if 1 <= count <= MOST:
                return key.strip(), tuple(np.linspace(low, high, count).tolist())
            raise _bad("--vary", text, f"a key has 1 to {MOST} values", "ask for more, or for fewer")
    except ValueError:
        form = "KEY=A:B with a sample" if as_range else "KEY=A:B:N or KEY=V,W"
        raise _bad("--vary", text, f"not of the form {form}", "e.g. --vary gravity.2=-9.81:0:5") from None
    return key.strip(), tuple(value_of(part) for part in _split(said))


def _number(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError
    return value


def _split(text: str) -> list[str]:
    """At commas that stand within no brackets."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def _checked(points: Points, where: str) -> Points:
    if not 0 < len(points) <= MOST:
        raise _bad(where, len(points), f"a sweep has 1 to {MOST} points", "ask for more, or for fewer")
    return points


def _bad(where: str, value: object, message: str, remedy: str) -> SceneError:
    return SceneError(Cause.BAD_FIELD, message, where=where, value=value, remedy=remedy)

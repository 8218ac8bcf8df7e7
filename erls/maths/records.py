"""Typed records in flat memory: constants and working memory of equations, with named fields instead of offsets.

A record is a NamedTuple whose fields are annotated `int`, `float`, `Vector`, `Matrix`, `Stack` or `Pile` (arrays of
one to four axes), `Indices` or `Pairs` (whole numbers, of one and two axes); or, where it is working memory, with the
shape itself, ``Annotated[Array, "6 6+n"]``, of which `room` makes zeros. Compiled functions are handed flat arrays,
since those alone fit every system behind one function pointer; where they begin they make records of them, which are
views: nothing is copied. A table in ``integers`` says where in the flat numbers each array lies and what its shape is;
it is made here from the record's declaration, as is the function that reads it. Plain Python looks all fields up when
a record is read, compiled code when they are used (`erls.maths.record_code`).

1. Declare the record, with shapes and units of its fields.
2. ``read = reader(Record)`` beside it.
3. ``at = memory.put(Record(...))`` when a system is made; one `Memory` for constants, one for working memory.
4. ``record = read(numbers, integers, at)`` in a compiled function, and in Python.

The numbers may be real or complex: a record of complex numbers is read by the same function.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import cache, lru_cache, partial
from typing import Annotated, Any, NamedTuple, TypeVar, get_type_hints

import numpy as np

from erls.maths.jit import ENABLED
from erls.maths.so3 import Array
from erls.maths.views import plain_at
from fe_import.model import IntArray

Vector = Annotated[Array, 1]
Matrix = Annotated[Array, 2]
Stack = Annotated[Array, 3]
Pile = Annotated[Array, 4]
Indices = Annotated[IntArray, 1]
Pairs = Annotated[IntArray, 2]

R = TypeVar("R", bound=NamedTuple)


def _axes(kind: Any) -> int | None:
    """Axes of an array, 0 of a real number, None of an integer."""
    if kind in (int, float):
        return None if kind is int else 0
    said = kind.__metadata__[0]
    return len(said.split()) if isinstance(said, str) else int(said)


# evaluated once: that takes a millisecond
_hints: Callable[[Any], dict[str, Any]] = cache(partial(get_type_hints, include_extras=True))


@cache
def _fields(record: Hashable) -> tuple[tuple[str, int | None, bool], ...]:
    """Name, axes, and whether it lies in the integers, of each field."""
    return tuple((name, _axes(kind), kind in (Indices, Pairs)) for name, kind in _hints(record).items())


@cache
def _shapes(record: Hashable) -> tuple[tuple[str, tuple[tuple[str, ...], ...] | None], ...]:
    """Name, and of arrays their axes as said in words, each a sum of numbers and sizes; None of whole numbers."""
    return tuple((name, None if kind is int else _said(kind)) for name, kind in _hints(record).items())


def _said(kind: Any) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(axis.split("+")) for axis in kind.__metadata__[0].split())


def room(record: type[R], **sizes: int) -> R:
    """Working memory: a record of zeros whose fields are annotated with their shapes, in these sizes.

    Whole numbers are given beside the sizes, by the names of their fields.
    """
    make: Callable[..., R] = record
    given = tuple(sizes.items())
    return make(*(each if isinstance(each, int) else np.zeros(each) for each in _sized(record, given)))


@lru_cache(maxsize=4096)
def _sized(record: Any, given: tuple[tuple[str, int], ...]) -> tuple[int | tuple[int, ...], ...]:
    """Whole numbers and shapes of arrays."""
    sizes = dict(given)
    return tuple(sizes[name] if axes is None else _shape(axes, sizes) for name, axes in _shapes(record))


def _shape(axes: tuple[tuple[str, ...], ...], sizes: dict[str, int]) -> tuple[int, ...]:
    """That axes tell."""
    return tuple(sum(int(part) if part.isdigit() else sizes[part] for part in axis) for axis in axes)


def table_size(record: type[Any]) -> int:
    """Integers that say where a record lies: of records put one after the other, the distance of their tables."""
    fields: tuple[tuple[str, int | None, bool], ...] = _fields(record)  # type: ignore[arg-type]  # classes can be hashed
    return sum(1 if axes is None else 1 + axes for _, axes, _ in fields)


def reader(record: type[R]) -> Callable[[Any, IntArray, int], R]:
    """The function that makes a record of flat numbers and a table.

    Parameters
    ----------
    record : NamedTuple class

    Returns
    -------
    callable
        ``read(numbers, integers, at)`` with the place of the table.
    """
    plain = python_reader(record)
    if not ENABLED:
        return plain
    from erls.maths import record_code

    read: Any = record_code.reader(record, _fields(record))
    read.in_python = plain
    return read  # type: ignore[no-any-return]


def python_reader(record: type[R]) -> Callable[[Any, IntArray, int], R]:
    """The same for Python: what compiled functions left in working memory is seen through it."""
    parts, place = [], 0
    for _, axes, whole in _fields(record):
        if axes is None:
            parts.append(f"integers[at + {place}]")
            place += 1
            continue
        start = f"integers[at + {place}]"
        dims = [f"integers[at + {place + 1 + k}]" for k in range(axes)]
        flat = "integers" if whole else "numbers"
        if axes == 0:
            parts.append(f"{flat}[{start}]")
        else:
            parts.append(f"plain_at({flat}, {', '.join([start, *dims])})")
        place += 1 + axes
    source = f"def read(numbers, integers, at):\n    return {record.__name__}({', '.join(parts)})\n"
    names: dict[str, Any] = {record.__name__: record, "__name__": __name__, "plain_at": plain_at}
    exec(compile(source, f"<reader of {record.__qualname__}>", "exec"), names)
    read: Callable[[Any, IntArray, int], R] = names["read"]
    return read


def place_of(record: type[Any], field: str, integers: IntArray, at: int) -> int:
    """Where in the numbers a field lies, or its first entry, of the record whose table stands at ``at``."""
    fields: tuple[tuple[str, int | None, bool], ...] = _fields(record)  # type: ignore[arg-type]  # classes can be hashed
    place = at
    for name, axes, _ in fields:
        if name == field:
            return int(integers[place])
        place += 1 if axes is None else 1 + axes
    raise ValueError(f"{record.__name__} has no field {field}")


def overwrite(record: NamedTuple, numbers: Array, integers: IntArray, at: int) -> None:
    """Put a record of single numbers in the place of the one at ``at``."""
    for place, (value, (_, axes, _)) in enumerate(zip(record, _fields(type(record)), strict=True), at):
        if axes is None:
            integers[place] = value
        else:
            numbers[integers[place]] = value


class Laid(NamedTuple):
    """A record as `Memory` lays it, for those that many memories hold: its numbers are gathered once.

    Attributes
    ----------
    record : NamedTuple
        Nothing in it changes any more.
    table : tuple of int
        As if its numbers began at 0.
    starts : tuple of int
        Places in the table of what says where in the numbers something lies.
    whole : tuple of (int, array)
        Places in the table of what lies in the integers themselves, and that.
    numbers : (k,) array
    """

    record: Any
    table: tuple[int, ...]
    starts: tuple[int, ...]
    whole: tuple[tuple[int, IntArray], ...]
    numbers: Array


def laid(record: NamedTuple) -> Laid:
    """A record that is put into memory more than once."""
    table: list[int] = []
    starts: list[int] = []
    whole: list[tuple[int, IntArray]] = []
    parts: list[Array] = []
    size = 0
    for value, (name, axes, is_whole) in zip(record, _fields(type(record)), strict=True):
        if axes is None:
            table.append(int(value))
            continue
        array = np.asarray(value)
        if array.ndim != axes:
            raise ValueError(f"{type(record).__name__}.{name} has {array.ndim} axes instead of {axes}")
        if is_whole:
            whole.append((len(table), array))
            table += [0, *array.shape]
            continue
        starts.append(len(table))
        table += [size, *array.shape]
        parts.append(np.ascontiguousarray(array, dtype=float).ravel())
        size += array.size
    numbers = parts[0] if len(parts) == 1 else np.concatenate([np.zeros(0), *parts])
    return Laid(record, tuple(table), tuple(starts), tuple(whole), numbers)


class Memory:
    """Flat numbers that grow by records, whose tables go to integers shared with other memories.

    Parameters
    ----------
    integers : list of int
        Where tables go.
    numbers : (k,) array, optional
        What is there already.
    """

    def __init__(self, integers: list[int], numbers: Array | None = None) -> None:
        self.integers = integers
        self._parts: list[Array] = [] if numbers is None else [numbers]
        self._size = sum(map(len, self._parts))

    def put(self, record: NamedTuple) -> int:
        """Store a record, laid already or not; the place of its table."""
        return self.put_all([record])

    def put_all(self, records: Sequence[NamedTuple]) -> int:
        """Store records of one type, laid already or not; the place of the first table, -1 without any.

        Tables follow each other, as long as that of one record each, and what lies in the integers themselves follows
        the last of them: functions find the k-th table by that length.
        """
        known = [record if isinstance(record, Laid) else laid(record) for record in records]
        if len({type(each.record) for each in known}) > 1:
            raise ValueError("records that follow each other are of one type")
        at, integers = len(self.integers), self.integers
        whole: list[tuple[int, IntArray]] = []
        for each in known:
            first = len(integers)
            integers += each.table
            for place in each.starts:
                integers[first + place] += self._size
            whole += [(first + place, array) for place, array in each.whole]
            self._parts.append(each.numbers)
            self._size += len(each.numbers)
        for place, array in whole:
            integers[place] = len(integers)
            integers += [int(i) for i in array.ravel()]
        return at if records else -1

    @property
    def numbers(self) -> Array:
        """What was put there."""
        return np.concatenate([np.zeros(0), *self._parts])

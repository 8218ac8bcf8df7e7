"""What compiled functions read and write of arrays and records, against the same functions in Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from erls.maths.jit import ENABLED, helper, plain
from erls.maths.records import Indices, Matrix, Memory, Pairs, Pile, Stack, Vector, reader, table_size

pytestmark = pytest.mark.skipif(not ENABLED, reason="nothing is compiled with ERLS_JIT=0")

SHAPES = ((7,), (3, 4), (2, 3, 4), (2, 3, 2, 4))
DTYPES = (np.float64, np.complex128, np.int64)


def _numbers(shape: tuple[int, ...], dtype: Any) -> Any:
    """Different ones throughout."""
    flat = np.arange(1.0, 1.0 + np.prod(shape))
    return (flat * (1 + 0.5j) if dtype is np.complex128 else flat).astype(dtype).reshape(shape)


@helper
def _elements(x: Any, i: int, j: int, k: int, l: int, out: Any) -> None:
    if x.ndim == 1:
        out[0], out[1], out[2] = x[i], x[-2], x[np.uint64(3)]
    elif x.ndim == 2:
        out[0], out[1], out[2] = x[i, j], x[-1, 2], x[1][j]
    elif x.ndim == 3:
        out[0], out[1], out[2] = x[i, j, k], x[-1, -2, -3], x[i, j][k]
    else:
        out[0], out[1], out[2] = x[i, j, k, l], x[0, -1, 1, -4], x[i][j, k][l]
    out[3], out[4] = len(x), x.shape[x.ndim - 1]


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("shape", SHAPES)
def test_elements(shape: tuple[int, ...], dtype: Any) -> None:
    """Of any position, counted from either end, given or computed, at once or through rows."""
    x = _numbers(shape, dtype)
    most = (*shape, 1, 1, 1)
    for i, j, k, l in [(0, 0, 0, 0), (1, 1, 1, 0), (-1, -1, -1, -1), (-2, -1, -2, -1), tuple(n - 1 for n in most[:4])]:
        got, wanted = np.zeros(5, dtype), np.zeros(5, dtype)
        _elements(x, i, j, k, l, got)
        plain(_elements)(x, i, j, k, l, wanted)
        assert np.array_equal(got, wanted)


@helper
def _put(x: Any, i: int, j: int, number: Any) -> None:
    if x.ndim == 1:
        x[i], x[-1], x[2] = number, 3, True
    elif x.ndim == 2:
        x[i, j], x[-1, 0] = number, 3
        x[1][j] += number
    elif x.ndim == 3:
        x[i, j, 1], x[-1, -1, -1] = number, 3
        x[i, j][0] *= number
    else:
        x[i, j, 1, -2], x[-1, -1, 0, 0] = number, 3
        x[i][j, 0][1] -= number


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("shape", SHAPES)
def test_elements_are_written(shape: tuple[int, ...], dtype: Any) -> None:
    """Numbers of other types are turned into those of the array."""
    numbers: tuple[Any, ...] = (5, 2.5) if dtype is not np.complex128 else (5, 2.5, 1 - 2j)
    if dtype is np.int64:
        numbers = (5, True)
    for number in numbers:
        for i, j in [(0, 1), (1, -1), (-2, 0)]:
            got, wanted = _numbers(shape, dtype), _numbers(shape, dtype)
            _put(got, i, j, number)
            plain(_put)(wanted, i, j, number)
            assert np.array_equal(got, wanted)


@helper
def _piece(x: Any, i: int, start: int, stop: int) -> Any:
    if x.ndim == 1:
        return x[start:stop]
    if x.ndim == 2:
        return x[i, start:stop]
    if x.ndim == 3:
        return x[i, -1, start:stop]
    return x[1, 0, i, start:stop]


@helper
def _open_pieces(x: Any, start: int) -> Any:
    return x[start:], x[:start], x[:], x[1:3], x[-3:], x[:-2], x[2:100]


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("shape", SHAPES)
def test_pieces(shape: tuple[int, ...], dtype: Any) -> None:
    """Slices end where the array does and may be empty; they are views that know whose memory it is."""
    x = _numbers(shape, dtype)
    for i in (0, 1, -1):
        for start in range(-9, 10):
            for stop in range(-9, 10):
                got, wanted = _piece(x, i, start, stop), plain(_piece)(x, i, start, stop)
                assert got.shape == wanted.shape
                assert np.array_equal(got, wanted)
    line = np.ascontiguousarray(x.reshape(-1)[:7])
    for start in range(-9, 10):
        for a, b in zip(_open_pieces(line, start), plain(_open_pieces)(line, start), strict=True):
            assert np.array_equal(a, b)
    piece = _piece(x, 0, 1, 3)
    piece[:] = 0
    assert np.count_nonzero(x == 0) == 2
    del x, line
    assert np.array_equal(piece, [0, 0])


@helper
def _rows(x: Any, i: int) -> Any:
    total = 0.0
    for row in range(len(x)):
        part = x[row]
        for k in range(part.shape[0]):
            total += abs(part[k])
    x[i][:] = 2
    return total, x[i]


def test_rows() -> None:
    """They are views, of whatever they are rows of."""
    for i in (0, 2, -1, -3):
        got, wanted = _numbers((3, 4), float), _numbers((3, 4), float)
        for mine, its in zip(_rows(got, i), plain(_rows)(wanted, i), strict=True):
            assert np.array_equal(mine, its)
        assert np.array_equal(got, wanted)


class Everything(NamedTuple):
    """A record with a field of each kind."""

    count: int
    size: float
    line: Vector
    table: Matrix
    stack: Stack
    pile: Pile
    places: Indices
    pairs: Pairs
    last: int


read = reader(Everything)


@helper
def _second(numbers: Any, integers: Any, at: int) -> Any:
    return _sum(read(numbers, integers, at))


@helper
def _sum(record: Any) -> Any:
    total = record.count + record.size + record.last
    for i in range(len(record.line)):
        total += record.line[i] * record.places[i] + record.pairs[1, i % 2]
    record.table[1, 2] += 1.0
    return total + record.table[1, 2] + record.stack[1, 0, -1] + record.pile[0, 1, 1, 0] + record.pile.shape[3]


def _record(k: int) -> Everything:
    line, table, stack, pile = (k + 0.1 * _numbers(shape, float) for shape in ((3,), (2, 3), (2, 1, 2), (1, 2, 2, 5)))
    return Everything(k, 0.5 * k, line, table, stack, pile, np.array([k, 2, 5]), np.array([[1, 2], [k, 4]]), 9 * k)


@pytest.mark.parametrize("turn", [lambda x: x, lambda x: x * (1 + 1j)], ids=["real", "complex"])
def test_records(turn: Callable[[Any], Any]) -> None:
    """The fields of records one after the other in memory, handed from function to function, in compiled code."""
    integers: list[int] = [7, 7]
    memory = Memory(integers, np.zeros(5))
    places = [memory.put(_record(k)) for k in (3, 4)]
    table = np.array(integers)
    assert table_size(Everything) == 1 + 1 + 2 + 3 + 4 + 5 + 2 + 3 + 1
    got, wanted = turn(memory.numbers), turn(memory.numbers)
    for at in places:
        assert np.isclose(_second(got, table, at), plain(_second)(wanted, table, at), rtol=1e-15)
    assert np.array_equal(got, wanted)
    assert not np.array_equal(got, turn(memory.numbers))

"""Seeded damage of files: bits, bytes, blocks, lines, numbers."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

_NUMBER = re.compile(rb"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?(?![\w.])")
_NUMBERS = (b"nan", b"inf", b"1e400", b"1e30", b"-1", b"0", b"7.5", b"2147483648", b"123456789012345678901234567890")
_MARKS = [*b', * ** % $ = " - . 1_0 \xff \0 #'.split(b" "), b" ", b"\n", b"\r\n"]


@dataclass(frozen=True)
class Damage:
    """One mutated file: how it was made, and its bytes."""

    kind: str
    content: bytes


def _flip(data: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(data)))
    return data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]


def _byte(data: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(data)))
    return data[:at] + bytes([int(rng.integers(256))]) + data[at + 1 :]


def _letter(data: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(data)))
    return data[:at] + bytes(rng.choice(list(b"0123456789-+eEDxX. ,;\n*$#")) for _ in "x") + data[at + 1 :]


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: int(rng.integers(len(data)))]


def _cut_behind_a_line(data: bytes, rng: np.random.Generator) -> bytes:
    ends = [k + 1 for k, byte in enumerate(data[:-1]) if byte == 10]
    return data[: int(rng.choice(ends))] if ends else data[: len(data) // 2]


def _span(data: bytes, rng: np.random.Generator, most: int = 64) -> slice:
    begin = int(rng.integers(len(data)))
    return slice(begin, min(len(data), begin + int(rng.integers(1, most))))


def _lines(data: bytes, rng: np.random.Generator) -> tuple[list[bytes], slice]:
    lines = data.splitlines(keepends=True)
    begin = int(rng.integers(len(lines)))
    return lines, slice(begin, begin + int(rng.integers(1, 4)))


def _delete(data: bytes, rng: np.random.Generator) -> bytes:
    span = _span(data, rng)
    return data[: span.start] + data[span.stop :]


def _repeat(data: bytes, rng: np.random.Generator) -> bytes:
    span = _span(data, rng)
    return data[: span.stop] + data[span] + data[span.stop :]


def _swap(data: bytes, rng: np.random.Generator) -> bytes:
    length = int(rng.integers(1, 1 + min(64, len(data) // 2)))
    a, b = sorted(int(k) for k in rng.integers(0, len(data) - length + 1, 2))
    if b < a + length:
        return data
    return data[:a] + data[b : b + length] + data[a + length : b] + data[a : a + length] + data[b + length :]


def _delete_lines(data: bytes, rng: np.random.Generator) -> bytes:
    lines, span = _lines(data, rng)
    return b"".join(lines[: span.start] + lines[span.stop :])


def _repeat_lines(data: bytes, rng: np.random.Generator) -> bytes:
    lines, span = _lines(data, rng)
    return b"".join(lines[: span.stop] + lines[span] + lines[span.stop :])


def _swap_lines(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.splitlines(keepends=True)
    a, b = (int(k) for k in rng.integers(0, len(lines), 2))
    lines[a], lines[b] = lines[b], lines[a]
    return b"".join(lines)


def _insert(data: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(data) + 1))
    return data[:at] + rng.bytes(int(rng.integers(1, 17))) + data[at:]


def _insert_token(data: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(data) + 1))
    return data[:at] + _MARKS[int(rng.integers(len(_MARKS)))] + data[at:]


def _number(data: bytes, rng: np.random.Generator) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return _byte(data, rng)
    chosen = found[int(rng.integers(len(found)))]
    return data[: chosen.start()] + _NUMBERS[int(rng.integers(len(_NUMBERS)))] + data[chosen.end() :]


def _overwrite(data: bytes, rng: np.random.Generator) -> bytes:
    span = _span(data, rng, 17)
    block = rng.choice([0, 127, 128, 240, 255], span.stop - span.start).astype(np.uint8).tobytes()
    return data[: span.start] + block + data[span.stop :]


_EVERYWHERE = {
    "flip a bit": _flip,
    "change a byte": _byte,
    "cut": _cut,
    "delete a block": _delete,
    "repeat a block": _repeat,
    "swap two blocks": _swap,
    "insert random bytes": _insert,
}
IN_BINARY: Mapping[str, Callable[[bytes, np.random.Generator], bytes]] = {**_EVERYWHERE, "overwrite": _overwrite}
IN_TEXT: Mapping[str, Callable[[bytes, np.random.Generator], bytes]] = {
    **_EVERYWHERE,
    "change a character": _letter,
    "cut behind a line": _cut_behind_a_line,
    "delete lines": _delete_lines,
    "repeat lines": _repeat_lines,
    "swap two lines": _swap_lines,
    "insert a mark": _insert_token,
    "replace a number": _number,
}


def damaged(data: bytes, rng: np.random.Generator, *, binary: bool) -> Damage:
    """One mutation of a file."""
    kinds = IN_BINARY if binary else IN_TEXT
    name = list(kinds)[int(rng.integers(len(kinds)))]
    return Damage(name, kinds[name](data, rng))

"""Damaged files by the thousand: seeded mutations, and what a reader may make of them.

A reader may refuse a damaged file with an error of the package. What it accepts must be one of:

- unchanged: everything that it read is as in the sound file;
- value: the damage put one number or word in the place of another of equal syntax (same lines, same fields; a swap of
  two blocks some of them), which no reader can tell from an intended one; nothing else about the file changed;
- told: a set of a mesh cannot be followed any more, and the mesh says so;
- lines: of a text format that states no counts, whole lines are gone or moved (its other lines are as they were, but
  for one of the same syntax or cut short), or what was read is part of what was there.

Anything else is a silent acceptance: entries lost by a cut, shifted fields, garbage read as numbers, numbers that are
not finite. Another exception than the package's own, and a case that takes longer than its time limit, are faults too.
"""

from __future__ import annotations

import contextlib
import faulthandler
import math
import re
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fe_import.errors import ReportedError

Facts = frozenset[Any]
_NUMBER = re.compile(rb"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?(?![\w.])")
_FORTRAN = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+))([-+]\d+)")  # Nastran's 1.5+3
_FIELDS = tuple(re.compile(rf"[\s,;{more}]+") for more in ("", r"=\"'<>\[\]{}"))  # of tables, of keywords and records
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


def _kind(word: str) -> str:
    try:
        int(word)
        return "integer"
    except ValueError:
        pass
    text = word.upper().replace("D", "E")
    if match := _FORTRAN.fullmatch(text):
        text = f"{match[1]}E{match[2]}"
    try:
        return "real" if math.isfinite(float(text)) else "not finite"
    except ValueError:
        return "word"


def same_syntax(before: str, after: str) -> bool:
    """Whether two lines have the same fields, one number in the place of another, or one word."""
    if before == after:
        return True
    number = {"integer", "real"}
    for fields in _FIELDS:
        old, new = (fields.split(line.strip()) for line in (before, after))
        pairs = [(_kind(a), _kind(b)) for a, b in zip(old, new, strict=False)]
        if len(old) == len(new) and all(a == b or {a, b} <= number for a, b in pairs):
            return True
    return False


def _texts(data: bytes) -> list[str]:
    return [line for line in data.decode("utf-8", errors="replace").splitlines() if line.strip()]


def replaces_a_value(before: bytes, after: bytes, *, binary: bool) -> bool:
    """Whether the damage put values in the place of others, and did nothing else to the file."""
    if binary:
        return len(before) == len(after)
    old, new = _texts(before), _texts(after)
    changed = [(a, b) for a, b in zip(old, new, strict=False) if a != b]
    return len(old) == len(new) and len(changed) <= 4 and all(same_syntax(a, b) for a, b in changed)


def keeps_lines(before: bytes, after: bytes) -> bool:
    """Whether the file has lines of the sound one only, but for one of the same syntax, cut short, or of labels."""
    old = _texts(before)
    known = set(old)
    new = [line for line in _texts(after) if line not in known]
    if len(new) > 1:
        return False
    one = new[0] if new else ""
    return not re.search(r"[^\d,;\s]", one) or any(line.startswith(one) or same_syntax(line, one) for line in old)


@dataclass(frozen=True)
class Reader:
    """A reader with sound files.

    Attributes
    ----------
    name : str
    files : dict of bytes
        By name.
    targets : tuple of str
        Files to damage.
    read : callable
        What a folder with the files holds.
    facts : callable
        Everything that was read, as a set; equal sets mean equal content.
    binary : bool
    counts : bool
        Whether lost lines must be noticed: the format states how much it holds, or what it holds must fit together.
    ends : bool
        Whether a cut must be noticed.
    damage : callable, optional
        ``damage(content, rng)`` in place of `damaged`.
    exact : bool
        Whether every change must be noticed: the format has checksums.
    judge : callable, optional
        ``judge(content, found)`` in place of the comparison of facts, for formats in which any sound text is legal:
        whether all that stands in the file was taken as it stands.
    told : callable, optional
        Names of the sets that the content says are lost; their facts are tuples that begin with ``set``.
    """

    name: str
    files: Mapping[str, bytes]
    targets: tuple[str, ...]
    read: Callable[[Path], Any]
    facts: Callable[[Any], Facts]
    binary: bool = False
    counts: bool = True
    ends: bool = True
    damage: Callable[[bytes, np.random.Generator], Damage] | None = None
    exact: bool = False
    judge: Callable[[bytes, Any], bool] | None = None
    told: Callable[[Any], Facts] | None = None


@dataclass
class Report:
    """What became of the cases of one reader."""

    cases: int = 0
    accepted: Counter[str] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    slowest: float = 0.0
    faults: list[str] = field(default_factory=list)


class TimedOut(BaseException):
    """A case took too long; no handler of a reader may swallow it."""


@contextlib.contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise `TimedOut` in the main thread behind so many seconds (Unix; elsewhere no limit)."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def stop(*_: Any) -> None:
        raise TimedOut

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def attempt(read: Callable[[], Any], report: Report, limit: float) -> Any:
    """What was read; None when it was refused, or failed otherwise, which the report then says."""
    report.cases += 1
    begin = time.perf_counter()
    try:
        with time_limit(limit):
            return read()
    except ReportedError as error:
        if not (error.remedy and error.where and "\n" not in str(error) and len(str(error)) < 1000):
            report.faults.append(f"a poor message: {error!s:.600}")
        report.refused[str(error.cause)] += 1
    except TimedOut:
        report.faults.append(f"took longer than {limit} s")
    except Exception as problem:
        place = problem.__traceback__
        while place is not None and place.tb_next is not None:
            place = place.tb_next
        spot = "" if place is None else f" ({Path(place.tb_frame.f_code.co_filename).name}:{place.tb_lineno})"
        report.faults.append(f"{type(problem).__name__}: {problem!s:.200}{spot}")
    finally:
        report.slowest = max(report.slowest, time.perf_counter() - begin)
    return None


def fuzz(reader: Reader, seeds: Sequence[int], folder: Path, limit: float = 5.0, keep: Path | None = None) -> Report:
    """Damage the files of a reader once for each seed, and judge what it makes of them.

    Parameters
    ----------
    reader : Reader
    seeds : sequence of int
    folder : Path
        Empty; holds the files.
    limit : float
        Of a case [s].
    keep : Path, optional
        Folder for the files of faulty cases.
    """
    for name, data in reader.files.items():
        (folder / name).write_bytes(data)
    expected = reader.facts(reader.read(folder))
    report = Report()
    for seed in seeds:
        rng = np.random.default_rng(seed)
        target = reader.targets[int(rng.integers(len(reader.targets)))]
        before = reader.files[target]
        damage = reader.damage(before, rng) if reader.damage else damaged(before, rng, binary=reader.binary)
        (folder / target).write_bytes(damage.content)
        count = len(report.faults)
        found = attempt(lambda: reader.read(folder), report, limit)
        if found is not None:
            verdict = _verdict(reader, before, damage, found, expected)
            if verdict:
                report.accepted[verdict] += 1
            else:
                report.faults.append("silently accepted")
        if len(report.faults) > count:
            report.faults[-1] = f"{reader.name}, {target}, seed {seed} ({damage.kind}): {report.faults[-1]}"
            if keep is not None:
                (keep / f"{seed}-{target}").write_bytes(damage.content)
        (folder / target).write_bytes(before)
    return report


def _verdict(reader: Reader, before: bytes, damage: Damage, found: Any, expected: Facts) -> str:
    """``unchanged``, ``value``, ``told`` or ``lines``; empty for what must not be."""
    facts = reader.facts(found)
    if reader.judge is not None:
        taken = reader.judge(damage.content, found)
        return "" if not taken else "unchanged" if facts == expected else "value"
    if facts == expected:
        return "unchanged"
    if reader.exact:
        return ""
    if replaces_a_value(before, damage.content, binary=reader.binary):
        return "value"
    if reader.told is not None:
        lost = reader.told(found)
        if facts == frozenset(f for f in expected if not (f[0] == "set" and f[1] in lost)):
            return "told"
    if reader.counts or (reader.ends and damage.kind.startswith("cut")):
        return ""
    return "lines" if facts < expected or keeps_lines(before, damage.content) else ""


def fuzz_group(
    group: Iterable[Reader], cases: int, first_seed: int = 0, limit: float = 5.0, keep: Path | None = None
) -> dict[str, Report]:
    """Reports by reader, ``cases`` of each. A hang that no signal ends (inside HDF5) ends the process."""
    reports = {}
    for reader in group:
        faulthandler.dump_traceback_later(60 + cases * limit, exit=True)
        try:
            with tempfile.TemporaryDirectory() as folder:
                reports[reader.name] = fuzz(
                    reader, range(first_seed, first_seed + cases), Path(folder), limit, keep
                )
        finally:
            faulthandler.cancel_dump_traceback_later()
    return reports


def check_reports(reports: Mapping[str, Report], cases: int) -> None:
    """No fault; most of the damage refused, some of it harmless: otherwise the cases test nothing."""
    assert not [fault for report in reports.values() for fault in report.faults]
    for name, report in reports.items():
        assert report.cases == cases
        assert report.refused.total() > cases / 4, name
        assert report.refused.total() + report.accepted.total() == cases

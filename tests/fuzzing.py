"""Damaged files by the thousand: seeded mutations, and what a reader may make of them.

A reader may refuse a damaged file with an error of the package. What it accepts must be one of:

- unchanged: everything that it read is as in the sound file;
- value: the damage put one number or word in the place of another of equal syntax (same lines, same fields; a swap of
  two blocks some of them), which no reader can tell from an intended one; nothing else about the file changed;
- told: a set of a mesh cannot be followed any more, and the mesh says so;
- lines: of a text format that states no counts, whole lines are gone or moved (its other lines are as they were, but
  for one: broken in two, cut short, of labels only, or of the same syntax), or what was read is part of what was there.

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
from fuzzing_damage import Damage, damaged

from fe_import.errors import ReportedError

Facts = frozenset[Any]
_FORTRAN = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+))([-+]\d+)")  # Nastran's 1.5+3
_FIELDS = tuple(map(re.compile, (r"[\s,;]+", r"[\s,;=\"'<>\[\]{}]+", r"[,;]+")))  # of tables, keywords, headers


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
        old, new = (fields.split(line.strip(" \t\r,;")) for line in (before, after))
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
    return len(old) == len(new) and len(changed) <= 12 and all(same_syntax(a, b) for a, b in changed)


def keeps_lines(before: bytes, after: bytes) -> bool:
    """Whether the file has lines of the sound one only, but for one: broken in two, cut short, with other values."""
    old = _texts(before)
    known = set(old)
    new = [line for line in _texts(after) if line not in known]
    if len(new) == 2:
        return "".join(new) in known
    one = new[0].partition("#")[0] if new else ""
    labels_only = not re.search(r"[^\d,;\s]", one)
    return len(new) < 2 and (labels_only or any(line.startswith(one) or same_syntax(line, one) for line in old))


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

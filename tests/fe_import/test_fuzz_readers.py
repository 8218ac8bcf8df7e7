"""Damaged files of every kind: refused with an error of the package, or read for what they still say."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest
from fuzz_readers import GROUPS
from fuzzing import Facts, Reader, check_reports, fuzz, fuzz_group

from fe_import.errors import Cause, FEImportError

CASES = {"modal files": 60, "descriptions": 150}


@pytest.mark.parametrize("group", GROUPS)
def test_damaged_files(group: str) -> None:
    """Cut, flipped, repeated, swapped, with other numbers and marks; HDF5 files edited as well. See `fuzzing`."""
    cases = CASES.get(group, 80)
    check_reports(fuzz_group(GROUPS[group](), cases), cases)


def _lax(folder: Path) -> list[str]:
    return (folder / "a.txt").read_text(encoding="utf-8", errors="replace").split()


def _careless(folder: Path) -> list[float]:
    return [float(word) for word in _lax(folder)]


def _slow(folder: Path) -> list[str]:
    words = _lax(folder)
    while len(words) != 40:
        time.sleep(0.001)
    return words


def _mute(folder: Path) -> list[str]:
    words = _lax(folder)
    if len(words) != 40:
        raise FEImportError(Cause.SYNTAX, "wrong")
    return words


def _facts(words: list[Any]) -> Facts:
    return frozenset(enumerate(words))


@pytest.mark.parametrize(
    ("read", "fault"),
    [(_lax, "silently accepted"), (_careless, "ValueError"), (_slow, "took longer"), (_mute, "a poor message")],
)
def test_bad_readers_are_found(tmp_path: Path, read: Any, fault: str) -> None:
    """One that takes what comes, one that crashes, one that hangs, one that does not say where."""
    text = "".join(f"{k} {0.5 * k}\n" for k in range(20)).encode()
    report = fuzz(Reader("bad", {"a.txt": text}, ("a.txt",), read, _facts), range(30), tmp_path, limit=0.02)
    assert any(fault in found for found in report.faults)

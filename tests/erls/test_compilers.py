"""Compiled functions from disk: what other processes compiled is linked with what is compiled here."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from erls.maths import jit

PART = """
from typing import NamedTuple
from numba import float64, int64
from erls.maths.jit import kernel, part
from erls.maths.records import reader

class Record(NamedTuple):
    {fields}

read = reader(Record)

@part
def last(numbers, integers, at):
    return read(numbers, integers, at).last + read(numbers, integers, at).last

@kernel(float64(float64[::1], int64[::1], int64), counted=False)
def compiled(numbers, integers, at):
    return last(numbers, integers, at)
"""
BOTH = """
import numpy as np
from numba import float64, int64
import one, other
from erls.maths.jit import kernel
from erls.maths.records import Memory

one_last, other_last = one.last, other.last

@kernel(float64(float64[::1], int64[::1], int64, int64), counted=False)
def both(numbers, integers, first, second):
    return one_last(numbers, integers, first) + 10.0 * other_last(numbers, integers, second)

integers = []
memory = Memory(integers)
first, second = memory.put(one.Record(1.0)), memory.put(other.Record(0.1, 0.2, 2.0))
print(both(memory.numbers, np.array(integers), first, second))
print(sum(one.last.stats.cache_hits.values()), sum(other.last.stats.cache_hits.values()))
"""


@pytest.mark.skipif(not jit.ENABLED, reason="nothing is compiled with ERLS_JIT=0")
def test_functions_of_one_name_from_several_processes(tmp_path: Path) -> None:
    """Readers of records have one name; those of two records are numbered alike in processes of the same course."""
    (tmp_path / "one.py").write_text(PART.format(fields="last: float"))
    (tmp_path / "other.py").write_text(PART.format(fields="first: float; middle: float; last: float"))
    (tmp_path / "both.py").write_text(BOTH)
    for name in ("one", "other", "both"):
        found = subprocess.run(
            [sys.executable, "-c", f"import {name}"],
            env={**os.environ, "ERLS_KERNELS": str(tmp_path)},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert not found.returncode, found.stderr
    value, *from_disk = found.stdout.split()
    assert from_disk == ["1", "1"]
    assert float(value) == 2.0 + 10.0 * 4.0

"""Fixtures that every test shares."""

from __future__ import annotations

import os
import re
import tempfile
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path

import pytest

# links are small matrices: threads of the linear algebra cost more than they bring, most of all on a busy machine
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

# commands that tests start find the byte code of those before them
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# reductions made by tests go to a cache of their own, shared by the workers of one session
os.environ.setdefault("ERLS_CACHE", os.path.join(tempfile.gettempdir(), f"erls-test-cache-{os.getuid()}"))
# compiled code lies there even for tests that give reductions an empty cache
os.environ.setdefault("ERLS_KERNELS", os.environ["ERLS_CACHE"])


_COMPILED = re.compile(r"^@kernel\(|= lane_kernel\(", re.MULTILINE)


def pytest_configure(config: pytest.Config) -> None:
    """Compile before the workers of a session start, so that no test pays for it or tells of it."""
    if hasattr(config, "workerinput") or config.option.collectonly:
        return
    names = _modules()

    def lead(take: Callable[[], str]) -> None:
        with ProcessPoolExecutor(1, get_context("spawn")) as process, suppress(IndexError):
            while True:
                process.submit(exec, f"import {take()}").result()

    with ThreadPoolExecutor(2) as leads:
        list(leads.map(lead, (names.popleft, names.pop)))  # from both ends: what neighbours share is compiled once


@pytest.fixture(scope="session", autouse=True)
def _data_stays() -> Iterator[None]:
    """Tests run beside each other and copy the shipped data: one that writes there makes another fail by chance."""
    before = _folders()
    yield
    assert _folders() == before, "a test wrote, if only for a moment, into data/"


def _folders() -> dict[Path, int]:
    """When a file was last made or removed in each folder of the shipped data."""
    data = Path(__file__).parents[1] / "data"
    return {folder: folder.stat().st_mtime_ns for folder in (data, *data.rglob("*")) if folder.is_dir()}


def _modules() -> deque[str]:
    """Those whose functions are compiled when they are imported, packages together."""
    root = Path(__file__).parents[1]
    every = sorted([*(root / "erls").rglob("*.py"), *(root / "fe_import").rglob("*.py")])
    files = [f for f in every if _COMPILED.search(f.read_text(encoding="utf-8"))]
    return deque(".".join(f.relative_to(root).with_suffix("").parts) for f in files)

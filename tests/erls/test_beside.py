"""Compilation by two processes: what is done where, and what becomes of it when something goes wrong."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from erls.maths import beside
from erls.maths.beside import compiling_beside

Modules = Callable[..., list[str]]


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Modules:
    """Makes modules that note who imports them, after they have done what they are given."""
    monkeypatch.setattr(beside, "compiled_before", lambda module: False)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(os, "cpu_count", lambda: 2)

    def make(*bodies: str) -> list[str]:
        names = [f"{tmp_path.name}_{k}" for k in range(len(bodies))]
        for name, body in zip(names, bodies, strict=True):
            note = f"with open(r'{tmp_path / name}.txt', 'a') as file: file.write(f'{{os.getpid()}}\\n')"
            (tmp_path / f"{name}.py").write_text(f"import os, time\n{note}\n{body}\n")
        return names

    return make


def _importers(folder: Path, names: list[str]) -> list[list[int]]:
    texts = [folder / f"{name}.txt" for name in names]
    return [[int(line) for line in text.read_text().split()] if text.exists() else [] for text in texts]


def test_either_takes_what_the_other_has_not_begun(modules: Modules, tmp_path: Path) -> None:
    names = modules("while not os.path.exists(__file__ + '.go'): time.sleep(0.01)", "", "", "")
    here = os.getpid()
    with compiling_beside(*names):
        while not _importers(tmp_path, names)[0]:
            time.sleep(0.01)
        release = f"with open(r'{tmp_path / names[0]}.py.go', 'w'): pass"
        (tmp_path / f"{names[1]}.py").write_text((tmp_path / f"{names[1]}.py").read_text() + release)
    first, *others = _importers(tmp_path, names)
    assert len(first) == 1
    assert first != [here]
    assert others == [[here]] * 3
    assert [name in sys.modules for name in names] == [False, True, True, True]


def test_blocks_within_blocks_share_a_process(modules: Modules, tmp_path: Path) -> None:
    names = modules("", "", "")
    with compiling_beside(names[0]):
        while not _importers(tmp_path, names)[0]:
            time.sleep(0.01)
        with compiling_beside(*names[1:]):
            while not all(_importers(tmp_path, names)):
                time.sleep(0.01)
    found = _importers(tmp_path, names)
    assert len({pid for pids in found for pid in pids}) == 1
    assert [len(pids) for pids in found] == [1, 1, 1]
    assert found[0] != [os.getpid()]


@pytest.mark.parametrize("body", ["os._exit(3)", "raise ValueError('no such equation')", "os.close(1)"])
def test_a_process_that_fails_holds_nobody_up(body: str, modules: Modules, tmp_path: Path) -> None:
    """What it leaves undone is compiled where it is called."""
    names = modules(body, "")
    with compiling_beside(*names):
        while not _importers(tmp_path, names)[0]:
            time.sleep(0.01)
    assert _importers(tmp_path, names)[1] != []


def test_an_error_ends_it_at_once(modules: Modules, tmp_path: Path) -> None:
    names = modules("time.sleep(60)", "")
    begun = time.monotonic()

    def interrupted() -> None:
        with compiling_beside(*names):
            while not _importers(tmp_path, names)[0]:
                time.sleep(0.01)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert time.monotonic() - begun < 30
    assert _importers(tmp_path, names)[1] == []
    assert beside._at_work == []

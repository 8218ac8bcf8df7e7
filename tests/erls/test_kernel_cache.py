"""Compiled code on disk: whatever happens to it, the next use compiles anew, or keeps nothing, and says so once."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pytest

from erls.maths import jit
from fe_import.compiled import address_space, kernel_cache

pytestmark = pytest.mark.skipif(not jit.ENABLED, reason="nothing is compiled with ERLS_JIT=0")


def _twice(x: float) -> float:
    return 2.0 * x


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What the user is told."""
    texts: list[str] = []
    monkeypatch.setattr(jit, "_listeners", [texts.append])
    monkeypatch.setattr(jit, "_told", {jit._EQUATIONS})
    return texts


def _compiled(monkeypatch: pytest.MonkeyPatch, folder: Path) -> Any:
    """The function, from disk if it is there."""
    from numba import float64

    monkeypatch.setattr(jit, "folder", lambda module: folder / "kernels")
    return jit.kernel(float64(float64), counted=False)(_twice)


def _flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


DAMAGE: dict[str, Callable[[Path], object]] = {
    "empty": lambda path: path.write_bytes(b""),
    "cut off": lambda path: path.write_bytes(path.read_bytes()[:-100]),
    "one bit": _flip,
    "something else": lambda path: path.write_bytes(os.urandom(1000)),
}


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_code_is_compiled_anew(
    damage: str, ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: list[str]
) -> None:
    """Index or code; told once, and what was compiled anew is read the next time."""
    _compiled(monkeypatch, tmp_path)
    (file,) = tmp_path.rglob(f"*.{ending}")
    DAMAGE[damage](file)
    again = _compiled(monkeypatch, tmp_path)
    assert again(3.0) == 6.0
    assert sum(again.stats.cache_hits.values()) == 0
    assert told == [f"compiled code in {tmp_path} is damaged: compiled anew"]
    assert sum(_compiled(monkeypatch, tmp_path).stats.cache_hits.values()) == 1
    assert len(told) == 1


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="nobody knows how much is taken")
@pytest.mark.parametrize("left", [2**22, 2**25])
def test_little_room(left: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: list[str]) -> None:
    """LLVM would end the process: with 32 MB code is read, and nothing compiled; damage is not suspected."""
    first = left < address_space.TO_LOAD
    if not first:
        _compiled(monkeypatch, tmp_path)
    taken = int(Path("/proc/self/statm").read_bytes().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    monkeypatch.setattr(address_space, "address_space", lambda: taken + left)
    if not first:
        assert _compiled(monkeypatch, tmp_path)(3.0) == 6.0
        for file in tmp_path.rglob("*.nb?"):
            file.unlink()
    with pytest.raises(MemoryError, match="MB of address space are left"):
        _compiled(monkeypatch, tmp_path)
    monkeypatch.setattr(address_space, "address_space", lambda: None)
    assert _compiled(monkeypatch, tmp_path)(3.0) == 6.0
    assert told == []


def test_a_folder_that_cannot_be_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: list[str]) -> None:
    """Nothing is kept, least of all beside the source, where it would be found after what it calls has changed."""
    (tmp_path / "file").write_text("", encoding="utf-8")
    beside = set(Path(__file__).parent.glob("__pycache__/*.nb?"))
    for _ in range(2):
        assert _compiled(monkeypatch, tmp_path / "file")(3.0) == 6.0
    assert len(told) == 1
    assert "cannot be kept" in told[0]
    assert "ERLS_KERNELS" in told[0]
    assert set(Path(__file__).parent.glob("__pycache__/*.nb?")) == beside


def test_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: list[str]) -> None:
    """Nothing half-written stays; what was there before is still read where nothing can be written."""

    def full(*names: str, **more: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", full)
        assert _compiled(patched, tmp_path)(3.0) == 6.0
        assert [path for path in tmp_path.rglob("*") if path.is_file()] == []
    assert len(told) == 1
    assert "No space left on device" in told[0]
    _compiled(monkeypatch, tmp_path)
    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", full)
        patched.setattr(os, "makedirs", full)
        assert sum(_compiled(patched, tmp_path).stats.cache_hits.values()) == 1


def test_code_is_found_wherever_the_source_lies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two checkouts of the same source share what is compiled: the folder is named by content."""
    for place in ("one", "two"):
        source = tmp_path / place / "package" / "numbers.py"
        source.parent.mkdir(parents=True)
        source.write_text("def thrice(x):\n    return 3.0 * x\n", encoding="utf-8")
    hits = [_hits_of(tmp_path / place / "package" / "numbers.py", tmp_path, monkeypatch) for place in ("one", "two")]
    assert hits == [0, 1]


def test_code_of_a_version_that_knows_more_is_no_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: list[str]
) -> None:
    """An index that names a module which is not here: compiled anew, kept, nothing told."""
    _compiled(monkeypatch, tmp_path)
    (file,) = tmp_path.rglob("*.nbi")
    content = b"cerls.maths.of_a_later_version\nKind\n."  # a pickle: a name to import
    file.write_bytes(content + kernel_cache._sum(content))
    assert _compiled(monkeypatch, tmp_path)(3.0) == 6.0
    assert told == []
    assert sum(_compiled(monkeypatch, tmp_path).stats.cache_hits.values()) == 1


def _hits_of(source: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> int:
    from numba import float64

    specification = spec_from_file_location("numbers_of_test", source)
    assert specification is not None
    assert specification.loader is not None
    module = module_from_spec(specification)
    specification.loader.exec_module(module)
    monkeypatch.setattr(jit, "folder", lambda module: folder / "kernels")
    made: Any = jit.kernel(float64(float64), counted=False)(module.thrice)
    assert made(2.0) == 6.0
    return sum(made.stats.cache_hits.values())

"""Writing HDF5: sealed, equal bytes for equal content, completely or not at all."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from fe_import.errors import Cause, FEImportError
from fe_import.files.hdf5.files import (
    open_for_reading,
    write_array,
    write_atomically,
    write_attribute,
    write_strings,
)

FAULT, UNWRITABLE = Cause.MODAL_FILE, Cause.NOT_WRITABLE


def fill(group: h5py.Group) -> None:
    write_array(group, "a/b/x", np.arange(1000.0), "m", "numbers")
    write_strings(group, "a/names", ("one", "two"), "names")
    write_attribute(group.create_group("c"), "text", "é")


def _unsealed(change: Callable[[h5py.File], None]) -> Callable[[h5py.File], None]:
    """Without the seal."""

    def apply(file: h5py.File) -> None:
        change(file)
        del file.attrs["content_sha256"]

    return apply


def _set_value(file: h5py.File) -> None:
    file["a/values"][1] = 7.0


def _set_attribute(file: h5py.File) -> None:
    file["a"].attrs["note"] = "other"


SEALED: dict[str, tuple[Callable[[h5py.File], None], bool]] = {
    "nothing": (lambda file: None, True),
    "a value": (_set_value, False),
    "an attribute": (_set_attribute, False),
    "a dataset dropped that nobody reads": (lambda file: file.__delitem__("a/texts"), False),
    "a dataset renamed that nobody reads": (lambda file: file.move("a/texts", "a/text"), False),
    "a dataset more": (lambda file: file.create_dataset("more", data=1.0) and None, False),
    "another seal": (lambda file: file.attrs.modify("content_sha256", b"0" * 64), False),
    "no seal": (_unsealed(_set_value), True),
}


@pytest.mark.parametrize("name", SEALED)
def test_the_seal_holds_for_content_as_it_was_written(tmp_path: Path, name: str) -> None:
    """Any change is refused when the file has been read; a file of another program has no seal."""
    change, accepted = SEALED[name]
    path = tmp_path / "a.h5"

    def write(group: h5py.Group) -> None:
        write_array(group, "a/values", np.arange(5.0), "m", "values")
        write_strings(group, "a/texts", ("x", "ü"), "texts")
        write_attribute(group["a"], "note", "as it was")

    write_atomically(path, write, FEImportError, UNWRITABLE)
    with h5py.File(path, "r+") as file:
        change(file)

    def read() -> float:
        with open_for_reading(path, FEImportError, FAULT) as reader:
            return float(reader.subgroup("a").array("values", (5,))[1])

    if accepted:
        assert read() == (7.0 if name == "no seal" else 1.0)
        return
    with pytest.raises(FEImportError, match="not what was written") as caught:
        read()
    assert caught.value.cause is FAULT
    assert str(path) in caught.value.where


def test_equal_content_gives_equal_bytes(tmp_path: Path) -> None:
    write_atomically(tmp_path / "a.h5", fill, FEImportError, UNWRITABLE)
    time.sleep(1.1)  # time stamps in HDF5 count seconds
    write_atomically(tmp_path / "b.h5", fill, FEImportError, UNWRITABLE)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


@pytest.mark.parametrize("problem", [KeyboardInterrupt, ValueError, MemoryError, SystemExit])
@pytest.mark.parametrize("existing", [None, b"precious"])
def test_interrupted_write_leaves_nothing(
    tmp_path: Path, problem: type[BaseException], existing: bytes | None
) -> None:
    path = tmp_path / "a.h5"
    if existing is not None:
        path.write_bytes(existing)

    def stop(group: h5py.Group) -> None:
        fill(group)
        raise problem

    with pytest.raises(problem):
        write_atomically(path, stop, FEImportError, UNWRITABLE)
    assert os.listdir(tmp_path) == ([] if existing is None else ["a.h5"])
    assert existing is None or path.read_bytes() == existing


def test_replaces_and_follows_links(tmp_path: Path) -> None:
    (tmp_path / "real.h5").write_bytes(b"old")
    (tmp_path / "link.h5").symlink_to("real.h5")
    write_atomically(tmp_path / "link.h5", fill, FEImportError, UNWRITABLE)
    assert (tmp_path / "link.h5").is_symlink()
    assert h5py.is_hdf5(tmp_path / "real.h5")
    assert sorted(os.listdir(tmp_path)) == ["link.h5", "real.h5"]


@pytest.mark.parametrize("target", ["missing/a.h5", "folder", "pipe", "file/a.h5"])
def test_not_writable_is_known_before_work(tmp_path: Path, target: str) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FEImportError) as caught:
        write_atomically(tmp_path / target, lambda group: pytest.fail("called"), FEImportError, UNWRITABLE)
    assert caught.value.cause == UNWRITABLE
    assert caught.value.where == str(tmp_path / target)
    assert caught.value.remedy


def test_no_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.h5"
    write_atomically(path, fill, FEImportError, UNWRITABLE)
    monkeypatch.setattr(os, "access", lambda *args: False)  # the tests may run as root, who may do anything
    with pytest.raises(FEImportError, match="permission") as caught:
        write_atomically(path, lambda group: pytest.fail("called"), FEImportError, UNWRITABLE)
    assert caught.value.cause == UNWRITABLE
    with (
        pytest.raises(FEImportError, match="permission") as caught,
        open_for_reading(path, FEImportError, FAULT),
    ):
        pass
    assert caught.value.cause == Cause.NOT_READABLE


FULL_DISK = """
import resource, signal, sys
import numpy as np
from fe_import.errors import Cause, FEImportError
from fe_import.files.hdf5.files import write_array, write_atomically
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))
try:
    write_atomically(sys.argv[1], lambda g: [write_array(g, f"x{k}", np.ones(int(sys.argv[2])), "m", "")
                     for k in range(100)], FEImportError, Cause.NOT_WRITABLE)
except FEImportError as problem:
    sys.exit(42 if problem.cause == Cause.NOT_WRITABLE and problem.remedy else 1)
"""


@pytest.mark.parametrize("size", ["30", "100", "10000"])
def test_full_disk(tmp_path: Path, size: str) -> None:
    """Raw data, or only metadata at closing, do not fit (a limit on file size stands for the full disk)."""
    root = Path(__file__).parents[2]
    command = [sys.executable, "-c", FULL_DISK, str(tmp_path / "a.h5"), size]
    result = subprocess.run(command, cwd=root, capture_output=True, timeout=60, check=False)
    assert (result.returncode, result.stderr.decode()) == (42, "")
    assert os.listdir(tmp_path) == []

"""The HDF5 layer: what it refuses before reading, how it reads, and that it writes all or nothing."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from fe_import.errors import Cause, FEImportError
from fe_import.files.hdf5.files import (
    Reader,
    open_for_reading,
    write_array,
    write_atomically,
    write_attribute,
    write_strings,
)

FAULT, UNWRITABLE = Cause.MODAL_FILE, Cause.NOT_WRITABLE


def soft_link(file: h5py.File) -> None:
    file["bad"] = h5py.SoftLink("/x")


def external_link(file: h5py.File) -> None:
    file["bad"] = h5py.ExternalLink("elsewhere.h5", "/x")


def external_storage(file: h5py.File) -> None:
    file.create_dataset("bad", shape=(4,), dtype="f8", external=[("elsewhere.bin", 0, 32)])


def virtual_dataset(file: h5py.File) -> None:
    layout = h5py.VirtualLayout((4,), dtype="f8")
    layout[:] = h5py.VirtualSource("elsewhere.h5", "x", shape=(4,))
    file.create_virtual_dataset("bad", layout)


def reference(file: h5py.File) -> None:
    file.create_dataset("bad", data=[file.ref], dtype=h5py.ref_dtype)


def variable_length(file: h5py.File) -> None:
    file.create_dataset("bad", shape=(2,), dtype=h5py.vlen_dtype(np.float64))


def opaque(file: h5py.File) -> None:
    file.create_dataset("bad", data=np.array([b"ab"], dtype="V2"))


def compound(file: h5py.File) -> None:
    file.create_dataset("bad", data=np.zeros(2, dtype=[("a", "f8")]))


def half_precision(file: h5py.File) -> None:
    file["bad"] = np.zeros(2, dtype=np.float16)


def unsigned(file: h5py.File) -> None:
    file["bad"] = np.zeros(2, dtype=np.uint64)


def named_type(file: h5py.File) -> None:
    file["bad"] = np.dtype("f8")


def null_space(file: h5py.File) -> None:
    file["bad"] = h5py.Empty("f8")


def other_filter(file: h5py.File) -> None:
    file.create_dataset("bad", data=np.zeros(1000), compression="lzf")


def huge_chunked(file: h5py.File) -> None:
    dataset = file.create_dataset("bad", shape=(10**8,), dtype="f8", chunks=(1000,), compression="gzip")
    dataset[:1000] = 1.0


def huge_chunk(file: h5py.File) -> None:
    file.create_dataset("bad", shape=(1,), maxshape=(None,), dtype="f8", chunks=(10**7,), compression="gzip")
    file["bad"][0] = 1.0


def never_stored(file: h5py.File) -> None:
    file.create_dataset("bad", shape=(10**12,), dtype="f8")


def many_dimensions(file: h5py.File) -> None:
    file["bad"] = np.zeros((1,) * 7)


def deep(file: h5py.File) -> None:
    file.create_group("bad/" + "/".join("g" * 20))


def cycle(file: h5py.File) -> None:
    inner = file.create_group("bad/inner")
    inner["again"] = file["bad"]


def root_again(file: h5py.File) -> None:
    file["bad"] = file["/"]


def linked_twice(file: h5py.File) -> None:
    file.move("x", "bad")
    file["bad too"] = file["bad"]


def reference_attribute(file: h5py.File) -> None:
    file.create_group("bad").attrs["r"] = file.ref


def many_strings(file: h5py.File) -> None:
    file.create_dataset("bad", shape=(200_000,), dtype=h5py.string_dtype())[0] = "a"


REFUSED = [
    (soft_link, "links"),
    (external_link, "links"),
    (external_storage, "external"),
    (virtual_dataset, "virtual"),
    (reference, "type"),
    (variable_length, "type"),
    (opaque, "type"),
    (compound, "type"),
    (half_precision, "type"),
    (unsigned, "type"),
    (named_type, "neither"),
    (null_space, "no value"),
    (other_filter, "filter"),
    (huge_chunked, "far more data"),
    (huge_chunk, "chunks"),
    (never_stored, "declares more data"),
    (many_dimensions, "dimensions"),
    (deep, "nested"),
    (cycle, "twice"),
    (root_again, "twice"),
    (linked_twice, "twice"),
    (reference_attribute, "type"),
    (many_strings, "strings"),
]


@pytest.mark.parametrize(("spoil", "message"), REFUSED, ids=[f.__name__ for f, _ in REFUSED])
def test_refused_before_reading(tmp_path: Path, spoil: Callable[[h5py.File], None], message: str) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w", libver="latest") as file:
        file["x"] = np.eye(3)
        spoil(file)
    with pytest.raises(FEImportError, match=message) as caught, open_for_reading(path, FEImportError, FAULT):
        pass
    assert caught.value.cause == FAULT
    assert caught.value.where.startswith(f"{path}: /bad")
    assert caught.value.remedy


def test_too_many_objects(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w", libver="latest") as file:
        for k in range(20_001):
            file.create_group(str(k))
    with pytest.raises(FEImportError, match="too many objects"), open_for_reading(path, FEImportError, FAULT):
        pass


def test_sizes_within_the_limit_only(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["x"] = np.ones(1000)
    with open_for_reading(path, FEImportError, FAULT, max_bytes=8000) as file:
        assert file.array("x", (1000,)).sum() == 1000
    with (
        pytest.raises(FEImportError, match="more data than is allowed"),
        open_for_reading(path, FEImportError, FAULT, max_bytes=7999),
    ):
        pass


def test_compressed_and_filtered_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    values = np.zeros((300, 500))
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=values, compression="gzip", shuffle=True, fletcher32=True)
    with open_for_reading(path, FEImportError, FAULT) as file:
        assert np.array_equal(file.array("x", (None, 500)), values)


def _text(path: Path) -> None:
    path.write_text("nodes = 3\n" * 100)


def _empty(path: Path) -> None:
    path.touch()


def _truncated(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["x"] = np.ones(1000)
    path.write_bytes(path.read_bytes()[:-3000])


def _pipe(path: Path) -> None:
    os.mkfifo(path)


@pytest.mark.parametrize(
    ("make", "cause"),
    [
        (lambda path: None, Cause.FILE_NOT_FOUND),
        (lambda path: path.mkdir(), Cause.NOT_READABLE),
        (_pipe, Cause.NOT_READABLE),
        (_text, Cause.NOT_READABLE),
        (_empty, Cause.NOT_READABLE),
        (_truncated, Cause.NOT_READABLE),
    ],
    ids=["missing", "folder", "pipe", "text", "empty", "truncated"],
)
def test_not_openable(tmp_path: Path, make: Callable[[Path], None], cause: Cause) -> None:
    path = tmp_path / "a.h5"
    make(path)
    with pytest.raises(FEImportError) as caught, open_for_reading(path, FEImportError, FAULT):
        pass
    assert caught.value.cause == cause
    assert caught.value.where == str(path)
    assert caught.value.remedy


@pytest.mark.parametrize("path", ["a\0b", "x" * 5000, "file/below"])
def test_impossible_path(tmp_path: Path, path: str) -> None:
    (tmp_path / "file").touch()
    target = f"{tmp_path}/{path}"
    with pytest.raises(FEImportError) as caught, open_for_reading(target, FEImportError, FAULT):
        pass
    assert caught.value.cause in (Cause.FILE_NOT_FOUND, Cause.NOT_READABLE)
    with pytest.raises(FEImportError) as caught:
        write_atomically(target, lambda group: None, FEImportError, UNWRITABLE)
    assert caught.value.cause == UNWRITABLE


READS: list[tuple[Callable[[Reader], object], str, str]] = [
    (lambda f: f.array("none", (3,)), "/none", "missing"),
    (lambda f: f.array("g", (3,)), "/g", "must be a dataset"),
    (lambda f: f.subgroup("x"), "/x", "must be a group"),
    (lambda f: f.array("x", (3,)), "/x", "expected .3."),
    (lambda f: f.array("x", (None, 2)), "/x", "expected .any, 2."),
    (lambda f: f.array("i", (3,)), "/i", "data type"),
    (lambda f: f.integers("x", (2, 3)), "/x", "data type"),
    (lambda f: f.array("s", (2,)), "/s", "data type"),
    (lambda f: f.array("nan", (2, 2)), "/nan", r"\[1, 0\] is not finite"),
    (lambda f: f.integers("i", (3,), 1), "/i", r"\[0\] is too small"),
    (lambda f: f.integers("i", (3,), 0, 2), "/i", r"\[2\] is too large"),
    (lambda f: f.scalar("x"), "/x", "expected ..;"),
    (lambda f: f.names("x"), "/x", "data type"),
    (lambda f: f.names("s", 3), "/s", "expected .3."),
    (lambda f: f.text("s"), "/s", "expected"),
    (lambda f: f.names("latin"), "/latin", "UnicodeDecodeError"),
    (lambda f: f.names("long"), "/long", "too much text"),
    (lambda f: f.attribute("none", str), "/@none", "missing"),
    (lambda f: f.attribute("version", str), "/@version", "type str"),
    (lambda f: f.attribute("version", float), "/@version", "type float"),
    (lambda f: f.attribute("name", int), "/@name", "type int"),
    (lambda f: f.attribute("nan", float), "/@nan", "type float"),
    (lambda f: f.subgroup("g").array("none", ()), "/g/none", "missing"),
]


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with one item of each kind."""
    path = tmp_path_factory.mktemp("hdf5") / "a.h5"
    with h5py.File(path, "w", libver="latest") as file:
        write_array(file, "x", np.arange(6.0).reshape(2, 3), "m", "floats")
        write_array(file, "i", [0, 1, 2], "1", "integers")
        write_array(file, "scalar", 2.5, "kg", "one number")
        write_array(file, "none_of_them", np.zeros((0, 3)), "m", "no rows")
        write_strings(file, "s", ("é", "long name"), "names")
        write_strings(file, "t", "some text", "text")
        write_strings(file, "no_names", (), "no names")
        file["variable"] = ["é", "long name"]
        file.create_dataset("big_endian", data=np.arange(3), dtype=">i8")
        file.create_group("g")
        file["nan"] = [[1.0, 2.0], [np.nan, np.inf]]
        file["latin"] = np.array([b"\xe9"], dtype=h5py.string_dtype("utf-8", 1))
        file["long"] = ["a" * 10_000_000] * 2
        write_attribute(file, "version", 3)
        write_attribute(file, "name", "é")
        write_attribute(file, "ratio", 0.5)
        write_attribute(file, "large", "é" * 100_000)
        write_attribute(file, "not UTF-8", "a\udce9")
        write_attribute(file, "nan", float("nan"))
        file.attrs["variable"] = "é"
    return path


@pytest.mark.parametrize(("read", "place", "message"), READS, ids=[p + m for _, p, m in READS])
def test_faulty_read(mixed: Path, read: Callable[[Reader], object], place: str, message: str) -> None:
    with open_for_reading(mixed, FEImportError, FAULT) as file:
        with pytest.raises(FEImportError, match=message) as caught:
            read(file)
        assert caught.value.where == f"{mixed}: {place}"
        assert caught.value.cause == FAULT


def test_reads_what_was_written(mixed: Path) -> None:
    with open_for_reading(mixed, FEImportError, FAULT) as file:
        assert file.array("x", (None, 3)).tolist() == [[0, 1, 2], [3, 4, 5]]
        assert file.array("none_of_them", (None, 3)).shape == (0, 3)
        assert file.integers("i", (3,), 0, 3).dtype == np.int64
        assert file.integers("big_endian", (3,)).dtype == np.dtype("=i8")
        assert file.scalar("scalar") == 2.5
        assert file.names("s", 2) == file.names("variable") == ("é", "long name")
        assert file.names("no_names") == ()
        assert file.text("t") == "some text"
        assert file.attribute("version", int) == 3
        assert file.attribute("ratio", float) == 0.5
        assert file.attribute("large", str) == "é" * 100_000
        assert file.attribute("not UTF-8", str) == r"a\udce9"
        assert file.attribute("name", str) == file.attribute("variable", str) == "é"
        assert file.subgroup("g").names_inside() == ()
        assert file.group["x"].attrs["unit"] == b"m"

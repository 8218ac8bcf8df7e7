"""Nastran OUTPUT4 and DMIG: a Craig-Bampton reduction of known frequencies, other writers, coordinate systems, faults.

The files tests/data/llink_cb_* hold one reduction (12 interface dofs, 20 modes) of the matrices in data/calculix,
written by the public packages pyyeti (binary) and pyNastran (text), not by Nastran itself.
"""

from __future__ import annotations

import gzip
import importlib
import shutil
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from link_files import merged, write_toml
from nastran_files import BINARY, DATA, DMIG, OP4, TEXT, check_message, own_frequencies, reduced, small
from superelements import condensed, description, frame_model, punch

from fe_import.errors import Cause, FEImportError
from fe_import.exports.nastran_op4 import Op4Options, read_op4
from fe_import.exports.nastran_op4_layout import op4_layout
from fe_import.reduce import reduce_link


@pytest.mark.parametrize("name", [BINARY, TEXT])
def test_op4_has_our_own_frequencies(tmp_path: Path, name: str) -> None:
    """To 2e-8: the file's constraint modes carry rounding, its stiffness resists rigid-body motion by 1.7e-6."""
    modal = reduced(tmp_path, merged(OP4, {"matrices": {"files": {"stiffness": name}}}))
    np.testing.assert_allclose(modal.frequencies_hz[6:], own_frequencies(), rtol=2e-8)
    op4 = importlib.import_module("pyyeti.nastran.op4")
    raw = op4.read(str(DATA / BINARY))
    squares = la.eigh(raw["kaax"], raw["maax"], eigvals_only=True)[6:]
    np.testing.assert_allclose(modal.frequencies_hz[6:], np.sqrt(squares) / (2 * np.pi), rtol=1e-9)
    assert "20 modal coordinates without nodes" in modal.provenance["source: superelement"]
    assert "1.7e-06" in modal.provenance["source: grounding"]
    assert modal.mass_properties.mass == pytest.approx(2.355, rel=1e-6)


def test_reduction_on_top_of_a_reduction(tmp_path: Path) -> None:
    """Craig-Bampton with all modes spans what no reduction keeps; with fewer its frequencies are upper bounds."""
    none = reduced(tmp_path, OP4).frequencies_hz
    every = reduced(tmp_path, OP4, reduction={"method": "craig-bampton", "fixed_interface_modes": 20}).frequencies_hz
    np.testing.assert_allclose(every[6:], none[6:], rtol=1e-9)
    fewer = reduced(tmp_path, OP4, reduction={"method": "craig-bampton", "fixed_interface_modes": 8}).frequencies_hz
    assert len(fewer) == 20
    assert (fewer[6:] >= none[6:20] * (1 - 1e-12)).all()


def test_separate_files(tmp_path: Path) -> None:
    """The mass from another file than the stiffness."""
    shutil.copy(DATA / TEXT, tmp_path)
    files = {"stiffness": BINARY, "mass": TEXT}
    both = reduced(tmp_path, merged(OP4, {"matrices": {"files": files}}))
    assert both.frequencies_hz.tolist() == reduced(tmp_path, OP4).frequencies_hz.tolist()


@pytest.mark.parametrize("endian", ["<", ">"])
@pytest.mark.parametrize("sparse", ["dense", "bigmat", "nonbigmat"])
@pytest.mark.parametrize("binary", [True, False])
def test_every_layout_of_op4(tmp_path: Path, binary: bool, sparse: str, endian: str) -> None:
    """Written by pyyeti in each layout, beside a complex and a rectangular matrix: read back to the last digit."""
    op4 = importlib.import_module("pyyeti.nastran.op4")
    parts = condensed(frame_model(tmp_path), (0, 3, 6), 4)
    others = {"cplx": parts.mass[:4, :3] * (1 + 2j), "rect": parts.mass[:, :7]}
    matrices = {**others, "kgg": parts.stiffness, "mgg": parts.mass}
    op4.write(tmp_path / "m.op4", matrices, binary=binary, digits=16, sparse=sparse, endian=endian)
    positions = {str(label): tuple(p) for label, p in zip(parts.labels, parts.positions.tolist(), strict=True)}
    options = Op4Options(stiffness="KGG", mass="mgg", boundary=parts.labels, positions=positions)
    export = read_op4({"stiffness": tmp_path / "m.op4"}, options, "link.toml")
    np.testing.assert_allclose(export.mass.toarray(), parts.mass, rtol=1e-15)
    np.testing.assert_allclose(export.stiffness.toarray(), parts.stiffness, rtol=1e-15)
    assert export.modal_rows.tolist() == [18, 19, 20, 21]


def test_rows_of_op4_from_a_file(tmp_path: Path) -> None:
    """The dofs of a text file, in any order of rows, with nodes and sets of text files."""
    op4 = importlib.import_module("pyyeti.nastran.op4")
    parts = condensed(frame_model(tmp_path), (0, 6), 3)
    order = np.random.default_rng(4).permutation(len(parts.mass))
    op4.write(
        tmp_path / "m.op4", {"kaax": parts.stiffness[np.ix_(order, order)], "maax": parts.mass[np.ix_(order, order)]}
    )
    named = ["modal" if c == 0 else f"{n} {c}" for n, c in parts.rows]
    (tmp_path / "rows.txt").write_text("\n".join(named[k] for k in order), encoding="utf-8")
    places = "".join(f"{n} {x} {y} {z}\n" for n, (x, y, z) in zip(parts.labels, parts.positions.tolist(), strict=True))
    (tmp_path / "nodes.txt").write_text(places, encoding="utf-8")
    files = {"stiffness": "m.op4", "dofs": "rows.txt", "nodes": "nodes.txt"}
    found = reduce_link(description(tmp_path, "nastran-op4", files, parts)).frequencies_hz
    (tmp_path / "k.pch").write_text(punch(parts), encoding="utf-8")
    expected = reduce_link(description(tmp_path, "nastran-dmig", {"stiffness": "k.pch"}, parts)).frequencies_hz
    np.testing.assert_allclose(found[6:], expected[6:], rtol=1e-9)


def wide(text: str) -> str:
    """The headers of a text file with integers of sixteen columns, as Nastran writes large ones."""
    lines = []
    for line in text.splitlines():
        if "1P,3E23.16" in line:
            line = f"{line[:8]:>16s}{line[8:16]:>16s}{line[16:]}|I16"
        lines.append(line)
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("closing", [" 1.000000000000000E+00", " 1.0000000000000000D+00", " 1.00000000000000000-001"])
def test_other_text_files(tmp_path: Path, closing: str) -> None:
    """Wide integers in headers, and closing numbers of another width than the values."""
    parts = small()
    text = wide(TEXT_OP4).replace(f"{14:8d}{1:8d}{1:8d}\n {1:.16E}", f"{14:8d}{1:8d}{1:8d}\n{closing}")
    (tmp_path / "m.op4").write_text(text, encoding="utf-8")
    positions = {str(label): tuple(p) for label, p in zip(parts.labels, parts.positions.tolist(), strict=True)}
    options = Op4Options(boundary=parts.labels, positions=positions)
    export = read_op4({"stiffness": tmp_path / "m.op4"}, options, "link.toml")
    np.testing.assert_allclose(export.stiffness.toarray(), parts.stiffness, rtol=1e-15)


def test_a_file_of_nastran_with_wide_integers(tmp_path: Path) -> None:
    """Of pyyeti's tests: headers of a matrix of ten million rows, columns of 19 and 7 values."""
    path = tmp_path / "large.op4"
    path.write_bytes(gzip.decompress((DATA / "large_dim_bigmat.op4.gz").read_bytes()))
    found = {header.name: header for header in op4_layout(path, "large.op4")}
    assert (found["matdt"].columns, found["matdt"].rows) == (19, 10_000_001)
    assert (found["matd22a"].columns, found["matd22a"].rows) == (10_000_001, 10_000_001)


# ---- faults ----------------------------------------------------------------------------------------------------------


def packed_binary(matrix: np.ndarray, name: str, form: int = 6, size: tuple[int, int] | None = None) -> bytes:
    """A binary OUTPUT4 matrix, full columns, written here."""

    def record(*parts: bytes) -> bytes:
        body = b"".join(parts)
        return struct.pack("<i", len(body)) + body + struct.pack("<i", len(body))

    columns, rows = size or matrix.shape[::-1]
    result = record(struct.pack("<4i", columns, rows, form, 2), name.ljust(8).encode())
    for k, column in enumerate(matrix.T, start=1):
        result += record(struct.pack("<3i", k, 1, 2 * len(column)), column.astype("<f8").tobytes())
    return result + record(struct.pack("<3i", columns + 1, 1, 2), struct.pack("<d", 1.0))


def op4_bytes(**changes: Any) -> bytes:
    """Both matrices of `small`, with changes of the stiffness."""
    parts = small()
    stiffness = changes.pop("stiffness", parts.stiffness)
    return packed_binary(stiffness, changes.pop("name", "KAAX"), **changes) + packed_binary(parts.mass, "MAAX")


def spoiled_op4(edit: Callable[[np.ndarray], None]) -> bytes:
    matrix = small().stiffness
    edit(matrix)
    return op4_bytes(stiffness=matrix)


def _unsymmetric(m: np.ndarray) -> None:
    m[0, 6] *= 1.01


def _not_a_number(m: np.ndarray) -> None:
    m[3, 3] = np.nan


def _grounded(m: np.ndarray) -> None:
    m[0, 0] *= 1.5


def text_op4(matrix: np.ndarray, name: str) -> str:
    """A text OUTPUT4 matrix, full columns, written here."""
    count = len(matrix)
    lines = [f"{count:8d}{count:8d}{6:8d}{2:8d}{name:8s}1P,3E23.16"]
    for k, column in enumerate([*matrix.T, [1.0]], start=1):
        texts = [f"{x:23.16E}" for x in column]
        lines += [f"{k:8d}{1:8d}{len(texts):8d}", *("".join(texts[at : at + 3]) for at in range(0, len(texts), 3))]
    return "\n".join(lines) + "\n"


TEXT_OP4 = text_op4(small().stiffness, "KAAX") + text_op4(small().mass, "MAAX")
GOOD = op4_bytes()
OP4_FAULTS: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "the file is empty"),
    "cut within a column": (GOOD[:400], "does not fit its length or the file"),
    "cut within the second matrix": (GOOD[:-200], "does not fit its length or the file"),
    "cut behind the first matrix": (GOOD[: len(GOOD) // 2], "no matrix MAAX for the mass"),
    "other names": (op4_bytes(name="KGG"), "no matrix KAAX for the stiffness"),
    "twice": (GOOD + GOOD, "more than one matrix KAAX"),
    "giant header": (op4_bytes(size=(2_000_000_000, 2_000_000_000)), "no room for"),
    "negative header": (op4_bytes(size=(-5, 13)), "absurd size"),
    "more columns than rows": (op4_bytes(size=(14, 13)), "not square"),
    "not symmetric": (spoiled_op4(_unsymmetric), "declared symmetric, but is not"),
    "not a number": (spoiled_op4(_not_a_number), "not finite"),
    "grounded": (spoiled_op4(_grounded), "resists rigid-body motion"),
    "another file": (b"\x00" + bytes(range(1, 100)), "not an OUTPUT4 file"),
    "text, another file": (b"not an OUTPUT4 file at all\n" * 9, "whole numbers in columns of 8"),
    "text, cut": (TEXT_OP4[: TEXT_OP4.rindex("       9")].encode(), "ends within"),
    "text, short line": (TEXT_OP4.replace("000E+00", "E+00", 1).encode(), "another length"),
    "text, columns do not rise": (TEXT_OP4.replace(f"{2:8d}{1:8d}", f"{1:8d}{1:8d}").encode(), "must rise"),
    "text, no format": (TEXT_OP4.replace("1P,3E23.16", "1P,XE23.16").encode(), "format of the numbers"),
    "text, closing record": (TEXT_OP4.replace(f"{14:8d}{1:8d}{1:8d}\n 1.00", f"{14:8d}{1:8d}{1:8d}\n hello").encode(),
                             "not one number"),
    "text, no number": (TEXT_OP4.replace("0000E+04", "x000E+04", 1).encode(), "cannot be read"),
    "gzip, cut": (gzip.compress(GOOD)[:-30], "cannot be read"),
}  # fmt: skip


@pytest.mark.parametrize("name", OP4_FAULTS)
def test_faulty_op4(tmp_path: Path, name: str) -> None:
    content, words = OP4_FAULTS[name]
    (tmp_path / "m.op4").write_bytes(content)
    options = {"boundary": [1, 2], "positions": {"1": [0.0, 0.0, 0.0], "2": [1.0, 0.0, 0.0]}}
    table = merged(OP4, {"matrices": {"files": {"stiffness": "m.op4"}, "options": options}})
    with pytest.raises(FEImportError) as caught:
        reduce_link(write_toml(tmp_path / "link.toml", table))
    check_message(caught.value, words, tmp_path)


@pytest.mark.parametrize("content", [GOOD, TEXT_OP4.encode()])
def test_files_written_here_are_read(tmp_path: Path, content: bytes) -> None:
    """What the faults start from is sound."""
    (tmp_path / "m.op4").write_bytes(content)
    options = {"boundary": [1, 2], "positions": {"1": [0.0, 0.0, 0.0], "2": [1.0, 0.0, 0.0]}}
    table = merged(OP4, {"matrices": {"files": {"stiffness": "m.op4"}, "options": options}})
    assert reduce_link(write_toml(tmp_path / "link.toml", table)).elastic_modes == 7
    (tmp_path / "m.pch").write_text(punch(small()), encoding="utf-8")
    assert reduce_link(description(tmp_path, "nastran-dmig", {"stiffness": "m.pch"}, small())).elastic_modes == 7


def with_zeros() -> bytes:
    """A matrix of zeros, far larger than the file, before the others; closing records that count a double as 1 word."""
    header = struct.pack("<iiiii8si", 24, 100_000, 100_000, 2, 2, b"PHI     ", 24)
    closing = struct.pack("<iiiidi", 20, 100_001, 1, 1, 1.0, 20)
    last = struct.pack("<iii", 14, 1, 2)
    assert GOOD.count(last) == 2
    return header + closing + GOOD.replace(last, struct.pack("<iii", 14, 1, 1))


def without_format() -> bytes:
    """Text whose headers end with the name: numbers as 5E16.9; a closing record that counts a double as 2 words."""
    rows = []
    for matrix, name in ((small().stiffness, "KAAX"), (small().mass, "MAAX")):
        count = len(matrix)
        rows.append(f"{count:8d}{count:8d}{6:8d}{2:8d}{name}")
        for k, column in enumerate(matrix.T, start=1):
            texts = [f"{x:16.9E}" for x in column]
            rows += [f"{k:8d}{1:8d}{count:8d}", *("".join(texts[at : at + 5]) for at in range(0, count, 5))]
        rows += [f"{count + 1:8d}{1:8d}{2:8d}", f"{1.0:16.9E}"]
    return "\n".join([*rows, ""]).encode()


@pytest.mark.parametrize("content", [with_zeros(), without_format()], ids=["zeros", "no format"])
def test_habits_of_real_files(tmp_path: Path, content: bytes) -> None:
    """As Nastran and others write them: the matrices of `small`, the text to its ten digits."""
    (tmp_path / "m.op4").write_bytes(content)
    export = read_op4({"stiffness": tmp_path / "m.op4"}, Op4Options(boundary=[1, 2], positions=TWO_POINTS), "link.toml")
    np.testing.assert_allclose(export.stiffness.toarray(), small().stiffness, rtol=1e-9)
    np.testing.assert_allclose(export.mass.toarray(), small().mass, rtol=1e-9)


TWO_POINTS = {"1": (0.0, 0.0, 0.0), "2": (1.0, 0.0, 0.0)}
OPTION_FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "no boundary": ({"options": {"boundary": []}}, "need the grid points they belong to"),
    "boundary too long": ({"options": {"boundary": [1, 2, 3, 4, 5, 6]}}, "need the grid points they belong to"),
    "boundary twice": ({"options": {"boundary": [1, 1]}}, "stands twice"),
    "node without position": ({"options": {"boundary": [1, 3]}}, "1 nodes of the matrices have no position"),
    "position of no node": ({"options": {"positions": {"tip": [0.0, 0.0, 0.0]}}}, "needs the number of its node"),
    "positions of two kinds": ({"files": {"nodes": BINARY}}, "more than one place"),
    "sets without nodes": ({"files": {"sets": BINARY}}, "goes with file 'nodes'"),
    "unknown option": ({"options": {"bondary": [1]}}, "did you mean 'boundary'"),
    "wrong order": ({"options": {"positions": {"1": [0.5, 0.5, 0.0], "2": [0.0, 0.0, 0.0]}}}, "resists rigid-body"),
}


@pytest.mark.parametrize("name", OPTION_FAULTS)
def test_faulty_options(tmp_path: Path, name: str) -> None:
    changes, words = OPTION_FAULTS[name]
    with pytest.raises(FEImportError) as caught:
        reduced(tmp_path, merged(OP4, {"matrices": changes}))
    assert words in str(caught.value)
    assert caught.value.remedy


def test_without_pyyeti(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names the extra; DMIG files need no other package."""
    for name in [n for n in sys.modules if n.partition(".")[0] == "pyyeti"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "pyyeti", None)
    with pytest.raises(FEImportError, match=r"pip install 'erls\[nastran\]'") as caught:
        reduced(tmp_path, OP4)
    assert caught.value.cause is Cause.NOT_READABLE
    assert reduced(tmp_path, DMIG).elastic_modes == 26


def test_gzip_bomb(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that unpacks to far more than its size is given up."""
    (tmp_path / "m.op4").write_bytes(gzip.compress(bytes(25_000_000)))
    with pytest.raises(FEImportError, match="unpacks to far more"):
        read_op4({"stiffness": tmp_path / "m.op4"}, Op4Options(boundary=[1]), "link.toml")

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
from link_files import merged, random_rotation, write_toml
from superelements import Reduced, condensed, description, dmig, frame_model, grid_cards, punch

from fe_import.description.link import load_link
from fe_import.errors import Cause, FEImportError
from fe_import.exports.nastran_cards import read_cards
from fe_import.exports.nastran_dmig import DmigOptions, read_dmig
from fe_import.exports.nastran_grid import CARDS, grid_points
from fe_import.exports.nastran_op4 import Op4Options, read_op4
from fe_import.modal.model import ModalModel
from fe_import.reduce import reduce_link

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data"
BINARY, TEXT, PUNCH = "llink_cb_pyyeti_bin.op4", "llink_cb_pynastran_ascii.op4.gz", "llink_cb_dmig.pch.gz"
ENDS = {"1": [0.0, 0.0, 0.0], "2": [0.5, 0.5, 0.0]}
OP4: dict[str, Any] = {
    "matrices": {
        "format": "nastran-op4",
        "files": {"stiffness": BINARY},
        "options": {"boundary": [1, 2], "positions": ENDS},
    },
    "interfaces": [{"name": "root", "node": "1"}, {"name": "tip", "node": "2"}],
    "reduction": {"method": "none"},
}
DMIG: dict[str, Any] = {
    **OP4,
    "matrices": {"format": "nastran-dmig", "files": {"stiffness": PUNCH}, "options": {"positions": ENDS}},
}


@pytest.fixture(scope="module")
def own() -> np.ndarray:
    """Frequencies of our own Craig-Bampton reduction of the CalculiX matrices, 20 fixed-interface modes [Hz]."""
    link = load_link(ROOT / "data" / "calculix" / "l_hex20.toml", {"fixed_interface_modes": 20, "elastic_modes": 26})
    return reduce_link(link).frequencies_hz[6:]


def reduced(folder: Path, base: dict[str, Any], **changes: Any) -> ModalModel:
    """The link of a table, its files from tests/data, reduced."""
    for name in base["matrices"]["files"].values():
        shutil.copy(DATA / name, folder)
    return reduce_link(write_toml(folder / "link.toml", merged(base, changes)))


@pytest.mark.parametrize("name", [BINARY, TEXT])
def test_op4_has_our_own_frequencies(tmp_path: Path, own: np.ndarray, name: str) -> None:
    """To 2e-8: the file's constraint modes carry rounding, its stiffness resists rigid-body motion by 1.7e-6."""
    modal = reduced(tmp_path, merged(OP4, {"matrices": {"files": {"stiffness": name}}}))
    np.testing.assert_allclose(modal.frequencies_hz[6:], own, rtol=2e-8)
    op4 = importlib.import_module("pyyeti.nastran.op4")
    raw = op4.read(str(DATA / BINARY))
    squares = la.eigh(raw["kaax"], raw["maax"], eigvals_only=True)[6:]
    np.testing.assert_allclose(modal.frequencies_hz[6:], np.sqrt(squares) / (2 * np.pi), rtol=1e-9)
    assert "20 modal coordinates without nodes" in modal.provenance["source: superelement"]
    assert "1.7e-06" in modal.provenance["source: grounding"]
    assert modal.mass_properties.mass == pytest.approx(2.355, rel=1e-6)


def test_dmig_has_our_own_frequencies(tmp_path: Path, own: np.ndarray) -> None:
    """Ten digits in the file: the 15 lowest frequencies to 2e-8, the highest, small differences, to 1e-6."""
    found = reduced(tmp_path, DMIG).frequencies_hz[6:]
    np.testing.assert_allclose(found[:15], own[:15], rtol=2e-8)
    np.testing.assert_allclose(found, own, rtol=1e-6)


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


@pytest.mark.parametrize("form", [1, 6])
def test_dmig_of_our_own_frame(tmp_path: Path, form: int) -> None:
    """All nodes kept, square and symmetric: the frame itself."""
    model = frame_model(tmp_path)
    parts = condensed(model, range(7))
    text = grid_cards(parts) + "".join(
        dmig(name, m, parts.rows, form) for name, m in (("KAAX", parts.stiffness), ("MAAX", parts.mass))
    )
    (tmp_path / "k.pch").write_text("$ title\n" + text, encoding="utf-8")
    export = read_dmig({"stiffness": tmp_path / "k.pch"}, DmigOptions(), "link.toml")
    rows = np.concatenate([model.dof_map[k] for k in range(7)])
    assert abs(export.stiffness.toarray() - model.stiffness.toarray()[np.ix_(rows, rows)]).max() == 0
    np.testing.assert_array_equal(export.nodes, model.nodes)
    assert export.labels.tolist() == parts.labels
    assert export.lines.tolist() == [[k, k + 1] for k in range(6)]
    assert "superelement" not in export.notes


def turned(parts: Reduced, frames: list[np.ndarray]) -> Reduced:
    """The matrices with each node's components counted along the columns of its frame."""
    turn = la.block_diag(*(f.T for frame in frames for f in (frame, frame)))
    turn = la.block_diag(turn, np.eye(len(parts.mass) - len(turn)))
    return Reduced(turn @ parts.mass @ turn.T, turn @ parts.stiffness @ turn.T, parts.positions)


def coordinate_system(number: int, reference: int, origin: np.ndarray, axes: np.ndarray) -> str:
    """CORD2R from origin and axes (columns), both in the frame of reference."""
    points = (origin, origin + 2 * axes[:, 2], origin + 3 * axes[:, 0] + 0.5 * axes[:, 2])
    numbers = [repr(x) for p in points for x in p.tolist()]
    return f"CORD2R,{number},{reference},{','.join(numbers[:6])}\n,{','.join(numbers[6:])}\n"


def test_coordinate_systems(tmp_path: Path) -> None:
    """Each node in a displacement frame of its own, positions in nested frames: the same link."""
    parts = condensed(frame_model(tmp_path), (0, 3, 6), 4)
    frames = [random_rotation(seed) for seed in (1, 2, 3)]
    spun = turned(parts, frames)
    outer, inner = random_rotation(8), random_rotation(9)
    shift, place = np.array([0.3, -0.2, 1.0]), np.array([-0.7, 0.1, 0.4])
    local = ((parts.positions - shift) @ outer - place) @ inner
    systems = coordinate_system(7, 0, shift, outer) + coordinate_system(8, 7, place, inner)
    systems += "".join(coordinate_system(k + 1, 0, np.array([k, 2.0, 1.0]), f) for k, f in enumerate(frames))
    grids = "".join(
        f"GRID,{n},8,{x!r},{y!r},{z!r},{k}\n"
        for k, (n, (x, y, z)) in enumerate(zip(parts.labels, local.tolist(), strict=True), start=1)
    )
    for name, text in (
        ("k.pch", punch(parts)),
        ("m.bdf", "SOL 103\nCEND\nBEGIN BULK\n" + grids + systems + "ENDDATA\n"),
    ):
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "s.pch").write_text(punch(spun), encoding="utf-8")
    straight = reduce_link(description(tmp_path, "nastran-dmig", {"stiffness": "k.pch"}, parts))
    files = {"stiffness": "s.pch", "mesh": "m.bdf"}
    found = reduce_link(description(tmp_path, "nastran-dmig", files, parts))
    np.testing.assert_allclose(found.frequencies_hz[6:], straight.frequencies_hz[6:], rtol=1e-9)
    np.testing.assert_allclose(found.nodes, straight.nodes, atol=1e-14)
    np.testing.assert_allclose(found.mass_properties.inertia, straight.mass_properties.inertia, rtol=1e-9, atol=1e-9)


def fixed(width: int, head: str, *fields: str) -> str:
    """A line of fields in columns."""
    return head.ljust(8) + "".join(f.ljust(width) for f in fields) + "\n"


CARD_TEXTS = {
    "small": fixed(8, "GRID", "12", "", "1.5", "-2.5+1", "3.D-1")
    + fixed(8, "DMIG", "K", "1", "1", "", "2", "3", "1.5+3"),
    "large": fixed(16, "GRID*", "12", "", "1.5", "-2.5+1", "CONT") + fixed(16, "*CONT", "3.D-1")
    + fixed(16, "DMIG*", "K", "1", "1") + fixed(16, "*", "2", "3", "1.5E3"),
    "free": "GRID,12,,1.5,-2.5E1,0.3\nDMIG,K,1,1,,2,3,1500.0\n",
    "free, wide": "grid*,12,,1.5,-25.\n*,.3\ndmig*,k,1,1,\n*,2,3,1.5d+03 $ comment\n",
}  # fmt: skip


@pytest.mark.parametrize("text", CARD_TEXTS.values(), ids=CARD_TEXTS)
def test_fields_of_cards(text: str) -> None:
    """Small, large and free fields, continuations, Nastran's exponents."""
    grid, entry = read_cards(text.splitlines(), frozenset({"GRID", "DMIG"}), "m.bdf")
    assert grid_points([grid]).positions[12].tolist() == [1.5, -25.0, 0.3]
    assert [*(entry.integer(k) for k in (2, 3, 5, 6)), entry.real(7)] == [1, 1, 2, 3, 1500.0]
    before = text[: text.upper().index("DMIG")].count("\n")
    assert entry.where == f"m.bdf: line {before + 1}"


def test_lines_and_scalar_points() -> None:
    """PLOTEL cards are the lines of the picture; SPOINT in both forms."""
    text = "PLOTEL,1,11,21\nSPOINT,5,6\nSPOINT,8,THRU,10\nGRID,11\nGRID,21,,1.\nCQUAD4,1,1,1,2\n,3,4\n"
    points = grid_points(read_cards(text.splitlines(), CARDS, "m.bdf"))
    assert points.lines == [(11, 21)]
    assert points.scalar_points == {5, 6, 8, 9, 10}
    assert points.positions[21].tolist() == [1.0, 0.0, 0.0]


# ---- faults ----------------------------------------------------------------------------------------------------------


def small() -> Reduced:
    """Two kept nodes and a mode, numbers that are easy to spoil: a free rigid bar with a sprung mass."""
    mass = np.diag([2.0, 2, 2, 1, 1, 1] * 2 + [1.0])
    arm = np.array([1.0, 0.0, 0.0])
    rigid = np.eye(6)
    rigid[:3, 3:] = -np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
    relative = np.hstack([-rigid, np.eye(6)])
    stiffness = la.block_diag(1e4 * relative.T @ relative, 9e6)
    return Reduced(mass, stiffness, np.array([[0.0, 0, 0], arm]))


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
    "negative header": (op4_bytes(size=(-5, 13)), "no room for"),
    "more columns than rows": (op4_bytes(size=(14, 13)), "not square"),
    "not symmetric": (spoiled_op4(_unsymmetric), "declared symmetric, but is not"),
    "not a number": (spoiled_op4(_not_a_number), "not finite"),
    "grounded": (spoiled_op4(_grounded), "resists rigid-body motion"),
    "another file": (b"\x00" + bytes(range(1, 100)), "not an OUTPUT4 file"),
    "text, another file": (b"not an OUTPUT4 file at all\n" * 9, "whole numbers in columns of eight"),
    "text, cut": (TEXT_OP4[: TEXT_OP4.rindex("       9")].encode(), "ends within"),
    "text, short line": (TEXT_OP4.replace("000E+00", "E+00", 1).encode(), "another length"),
    "text, columns do not rise": (TEXT_OP4.replace(f"{2:8d}{1:8d}", f"{1:8d}{1:8d}").encode(), "must rise"),
    "text, no format": (TEXT_OP4.replace("1P,3E23.16", "1P,XE23.16").encode(), "format of the numbers"),
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


def check_message(error: FEImportError, words: str, folder: Path) -> None:
    """One line that says what is wrong, where and what to do."""
    assert words in str(error)
    assert error.cause in (Cause.EXPORT, Cause.GROUNDED, Cause.NOT_READABLE, Cause.BAD_REFERENCE, Cause.BAD_FIELD)
    assert str(folder) in error.where
    assert error.remedy
    assert error.exit_code == 2
    assert len(str(error)) < 600
    assert "\n" not in str(error)


@pytest.mark.parametrize("content", [GOOD, TEXT_OP4.encode()])
def test_files_written_here_are_read(tmp_path: Path, content: bytes) -> None:
    """What the faults start from is sound."""
    (tmp_path / "m.op4").write_bytes(content)
    options = {"boundary": [1, 2], "positions": {"1": [0.0, 0.0, 0.0], "2": [1.0, 0.0, 0.0]}}
    table = merged(OP4, {"matrices": {"files": {"stiffness": "m.op4"}, "options": options}})
    assert reduce_link(write_toml(tmp_path / "link.toml", table)).elastic_modes == 7
    (tmp_path / "m.pch").write_text(punch(small()), encoding="utf-8")
    assert reduce_link(description(tmp_path, "nastran-dmig", {"stiffness": "m.pch"}, small())).elastic_modes == 7


PCH = punch(small())


def without(start: str) -> str:
    """The punch file without the cards that start so."""
    return "".join(line for line in PCH.splitlines(keepends=True) if not line.startswith(start))


DMIG_FAULTS: dict[str, tuple[str, str]] = {
    "cut within a line": (PCH[:-3], "the last line does not end"),
    "no matrix": (PCH.replace("MAAX", "MGG"), "no DMIG matrix MAAX for the mass"),
    "no header": (PCH.replace("DMIG,KAAX,0,6,2,0,,,\n", ""), "no header before its first column"),
    "two headers": (PCH + "DMIG,KAAX,0,6,2,0\n", "two headers"),
    "complex": (PCH.replace("DMIG,KAAX,0,6,2", "DMIG,KAAX,0,6,4"), "complex"),
    "rectangular": (PCH.replace("DMIG,KAAX,0,6,2", "DMIG,KAAX,0,9,2"), "form 9 (rectangular)"),
    "wrong count": (PCH.replace("DMIG,KAAX,0,6,2,0,,,", "DMIG,KAAX,0,6,2,0,,,99"), "another number of columns"),
    "cut off": (PCH[: PCH.rindex("DMIG*")], "a modal coordinate without mass"),
    "duplicate": (PCH + "DMIG*,MAAX,11,1,\n*,11,1,2.0\n", "stands at"),
    "both triangles": (PCH + "DMIG*,MAAX,21,1,\n*,11,1,0.5\n*,21,2,0.5\nDMIG*,MAAX,11,1,\n*,21,1,0.5\n", "stands at"),
    "not finite": (PCH.replace("9000000.0", "NaN"), "finite real number"),
    "overflow": (PCH.replace("9000000.0", "9.0D999"), "finite real number"),
    "component": (PCH.replace("*,11,1,10000.0", "*,11,7,10000.0"), "component out of range"),
    "component of a grid point": (PCH + "DMIG*,MAAX,11,0,\n*,11,0,1.\n", "grid point 11 has component 0"),
    "point out of range": (PCH + "DMIG*,MAAX,-4,1,\n*,11,1,1.\n", "out of range"),
    "missing grid": (
        without("GRID,21"),
        "1 nodes of the matrices have no",
    ),
    "no grids": (without("GRID"), "2 nodes of the matrices have no"),
    "grid twice": ("GRID,21\n" + PCH, "stands twice"),
    "GRDSET": ("GRDSET,,,,,,3\n" + PCH, "defaults for GRID"),
    "unknown coordinate system": (PCH.replace("GRID,21,,", "GRID,21,5,"), "coordinate system 5 is not there"),
    "cylindrical": (
        PCH.replace("GRID,21,,", "GRID,21,5,") + "CORD2C,5,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n",
        "5 is a CORD2C",
    ),
    "CORD1R": (PCH.replace("GRID,21,,", "GRID,21,5,") + "CORD1R,5,11,21,11\n", "5 is a CORD1R"),
    "circular": (
        PCH.replace("GRID,21,,", "GRID,21,5,") + "CORD2R,5,6,,,,,,1.\n,1.\nCORD2R,6,5,,,,,,1.\n,1.\n",
        "defined by itself",
    ),
    "too deep": (
        PCH.replace("GRID,21,,", "GRID,21,5,") + "".join(f"CORD2R,{k},{k + 1},,,,,,1.\n,1.\n" for k in range(5, 5000)),
        "nested too deeply",
    ),
    "axes on a line": (PCH.replace("GRID,21,,", "GRID,21,5,") + "CORD2R,5,,,,,,,1.\n,0.,0.,2.\n", "on one line"),
    "INCLUDE": ("INCLUDE 'other.pch'\n" + PCH, "INCLUDE is not followed"),
    "grounded": (PCH.replace("*,11,1,10000.0", "*,11,1,30000.0"), "resists rigid-body motion"),
    "directed mass": (
        PCH.replace("DMIG*,MAAX,11,1,\n*,11,1,2.0", "DMIG*,MAAX,11,1,\n*,11,1,5.0"),
        "differs by direction",
    ),
    "a line that is no card": (PCH.replace("*,11,1,10000.0", "*,11,1,10000.0\n72"), "neither a card nor"),
    "a comment in a number": (PCH.replace("*,11,1,10000.0", "*,11,1,100$00.0"), "a comment begins within a field"),
    "imaginary part": (PCH.replace("*,11,1,10000.0", "*,11,1,10000.0,1.0"), "imaginary part"),
}


@pytest.mark.parametrize("name", DMIG_FAULTS)
def test_faulty_dmig(tmp_path: Path, name: str) -> None:
    text, words = DMIG_FAULTS[name]
    assert text != PCH
    (tmp_path / "k.pch").write_text(text, encoding="utf-8")
    with pytest.raises(FEImportError) as caught:
        reduce_link(description(tmp_path, "nastran-dmig", {"stiffness": "k.pch"}, small()))
    check_message(caught.value, words, tmp_path)


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

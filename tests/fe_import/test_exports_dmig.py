"""DMIG cards of Nastran: a reduction of known frequencies, coordinate systems, cards, faults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
from link_files import random_rotation
from nastran_files import DMIG, check_message, own_frequencies, reduced, small
from superelements import Reduced, condensed, description, dmig, frame_model, grid_cards, punch

from fe_import.errors import FEImportError
from fe_import.exports.nastran_dmig import DmigOptions, read_dmig
from fe_import.nastran.cards import read_cards
from fe_import.nastran.grid import CARDS, grid_points
from fe_import.reduce import reduce_link


def test_dmig_has_our_own_frequencies(tmp_path: Path) -> None:
    """Ten digits in the file: the 15 lowest frequencies to 2e-8, the highest, small differences, to 1e-6."""
    found = reduced(tmp_path, DMIG).frequencies_hz[6:]
    np.testing.assert_allclose(found[:15], own_frequencies()[:15], rtol=2e-8)
    np.testing.assert_allclose(found, own_frequencies(), rtol=1e-6)


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


PCH = punch(small())


def test_curved_displacement_frames() -> None:
    """Axes of a cylindrical frame at 90 degrees: outward y, around -x; of a spherical one on the equator: -z first."""
    frames = "CORD2C,5,,,,,,,1.\n,1.,0.,0.\nCORD2S,6,,,,,,,1.\n,1.,0.,0.\n"
    text = frames + "GRID,1,5,2.,90.,3.,5\nGRID   *               2               6              2.             90.\n"
    text += "*                    90.               6\n"
    points = grid_points(read_cards(text.splitlines(), CARDS, "m.bdf"))
    np.testing.assert_allclose(points.positions[1], [0.0, 2.0, 3.0], atol=1e-15)
    np.testing.assert_allclose(points.axes[1].T, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(points.positions[2], [0.0, 2.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(points.axes[2].T, [[0, 1, 0], [0, 0, -1], [-1, 0, 0]], atol=1e-15)


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
    "GRDSET": ("GRDSET,,,,,,3\n" + PCH, "coordinate system 3 is not there"),
    "unknown coordinate system": (PCH.replace("GRID,21,,", "GRID,21,5,"), "coordinate system 5 is not there"),
    "CORD1R": (PCH.replace("GRID,21,,", "GRID,21,5,") + "CORD1R,5,11,21,11\n", "defined by itself"),
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

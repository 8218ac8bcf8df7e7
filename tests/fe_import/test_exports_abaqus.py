"""Abaqus: matrices of frames and solids whose figures are known, in every text format, and faulty files.

The layouts are those of files that Abaqus wrote (public examples of *MATRIX OUTPUT and *SUBSTRUCTURE MATRIX OUTPUT).
"""

from __future__ import annotations

import gzip
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported_files import deck as solid_deck
from exported_files import link_matrices
from link_files import frame_link, write_toml
from superelements import (
    MODAL_POINT,
    Reduced,
    condensed,
    coordinate,
    deck,
    description,
    frame_model,
    matrix_input,
    substructure,
)

from fe_import.errors import Cause, FEImportError
from fe_import.exports.abaqus import AbaqusOptions, read_abaqus
from fe_import.exports.abaqus_substructure import read_substructure
from fe_import.reduce import reduce_link

ROOT = Path(__file__).parents[2]
FILES = {"stiffness": "k.mtx", "mass": "m.mtx", "mesh": "k.inp"}
REDUCED = {"stiffness": "k.mtx", "mesh": "k.inp"}


def write(folder: Path, **texts: str) -> None:
    """Files k.mtx, m.mtx, k.inp ... of the given texts."""
    for name, text in texts.items():
        (folder / name.replace("_", ".")).write_text(text, encoding="utf-8")


def formats(parts: Reduced) -> dict[str, dict[str, str]]:
    """The link in every text format: files by name."""
    k, m, rows = parts.stiffness, parts.mass, parts.rows
    own = {
        name: {"k_mtx": matrix_input(k, rows, triangle), "m_mtx": matrix_input(m, rows, triangle)}
        for name, triangle in (("lower", "lower"), ("upper", "upper"), ("both triangles", "both"))
    }
    own["blanks"] = {key: text.replace(",", "  ") for key, text in own["lower"].items()}
    own["fortran"] = {key: text.replace("e", "D") for key, text in own["lower"].items()}
    shuffled = own["lower"]["k_mtx"].splitlines()[1:]
    np.random.default_rng(2).shuffle(shuffled)
    own["any order"] = {**own["lower"], "k_mtx": "\n".join(shuffled) + "\n"}
    own["coordinate"] = {"k_mtx": coordinate(k), "m_mtx": coordinate(m)}
    own["substructure"] = {"k_mtx": substructure(parts)}
    own["unsymmetric substructure"] = {"k_mtx": substructure(parts, whole=True)}
    return {name: {**texts, "k_inp": deck(parts)} for name, texts in own.items()}


@pytest.mark.parametrize("name", formats(Reduced(np.eye(6), np.eye(6), np.zeros((1, 3)))))
def test_frame_through_every_format(tmp_path: Path, name: str) -> None:
    """All nodes kept, so the matrices are those of the frame: the same modes as without the detour, to 1e-9."""
    parts = condensed(frame_model(tmp_path), range(7))
    texts = formats(parts)[name]
    write(tmp_path, **texts)
    files = FILES if "m_mtx" in texts else REDUCED
    if name == "coordinate":
        files = {**files, "dofs": "rows.txt"}
        write(tmp_path, rows_txt="".join(f"{node} {dof}\n" for node, dof in parts.rows))
    modal = reduce_link(description(tmp_path, "abaqus", files, parts))
    direct = reduce_link(frame_link(tmp_path, reduction={"method": "none"}))
    np.testing.assert_allclose(modal.frequencies_hz[6:], direct.frequencies_hz[6:], rtol=1e-9)
    np.testing.assert_allclose(modal.nodes, direct.nodes, atol=1e-15)
    first, other = modal.translation_shapes[:, :, 6:12], direct.translation_shapes[:, :, 6:12]
    signs = np.sign(np.einsum("nam,nam->m", first, other))
    np.testing.assert_allclose(first * signs, other, atol=1e-6 * np.abs(other).max())


def test_solid_with_faces(tmp_path: Path) -> None:
    """*MATRIX GENERATE of hexahedra: entries, node sets and surface of the deck, to the last digit."""
    mesh, mass, stiffness = link_matrices()
    rows = [(10 * (n + 1), c) for n in range(len(mesh.nodes)) for c in (1, 2, 3)]
    write(
        tmp_path,
        k_mtx=matrix_input(stiffness.toarray(), rows),
        m_mtx=matrix_input(mass.toarray(), rows),
        k_inp=solid_deck(mesh),
    )
    export = read_abaqus({k: tmp_path / v for k, v in FILES.items()}, AbaqusOptions(), "link.toml")
    lower = np.tril(stiffness.toarray())
    assert abs(export.stiffness.toarray() - lower - np.tril(lower, -1).T).max() == 0
    np.testing.assert_array_equal(export.nodes, mesh.nodes)
    np.testing.assert_array_equal(export.node_sets["X1"], mesh.node_sets["x1"])
    assert len(export.triangles) == 2 * 14
    assert "superelement" not in export.notes
    assert "grounding" not in export.notes
    interfaces = [{"name": "hub", "face": "X0"}, {"name": "hand", "face": "X1"}]
    table = {"matrices": {"format": "abaqus", "files": FILES}, "interfaces": interfaces}
    modal = reduce_link(write_toml(tmp_path / "link.toml", table))
    assert modal.mass_properties.mass == pytest.approx(2700 * 0.3 * 0.02 * 0.03, rel=1e-9)


def test_substructure_with_eigenmodes(tmp_path: Path) -> None:
    """Retained eigenmodes at a node of their own, as modal coordinates; with all of them the frame itself, to 1e-9."""
    parts = condensed(frame_model(tmp_path), (0, 3, 6), 24)
    write(tmp_path, k_mtx=substructure(parts), k_inp=deck(parts))
    options = {"options": {"modal_nodes": [MODAL_POINT]}}
    modal = reduce_link(description(tmp_path, "abaqus", REDUCED, parts, matrices=options))
    direct = reduce_link(frame_link(tmp_path, reduction={"method": "none"}))
    np.testing.assert_allclose(modal.frequencies_hz[6:], direct.frequencies_hz[6:], rtol=1e-9)
    assert "24 modal coordinates" in modal.provenance["source: superelement"]
    with pytest.raises(FEImportError, match="has a component out of range") as caught:
        reduce_link(description(tmp_path, "abaqus", REDUCED, parts))
    assert "modal_nodes" in caught.value.remedy


def test_mass_in_a_file_of_its_own(tmp_path: Path) -> None:
    """Two substructure files, and positions in the description instead of a deck."""
    parts = condensed(frame_model(tmp_path), (0, 3, 6))
    head, stiffness, mass = substructure(parts).split("*MATRIX")
    write(tmp_path, k_mtx=f"{head}*MATRIX{stiffness}", m_mtx=f"{head}*MATRIX{mass}")
    files = {"stiffness": "k.mtx", "mass": "m.mtx"}
    places = {str(n): p for n, p in zip(parts.labels, parts.positions.tolist(), strict=True)}
    link = description(tmp_path, "abaqus", files, parts, matrices={"options": {"positions": places}})
    two = reduce_link(link).frequencies_hz
    write(tmp_path, k_mtx=substructure(parts))
    one = reduce_link(
        description(tmp_path, "abaqus", {"stiffness": "k.mtx"}, parts, matrices={"options": {"positions": places}})
    )
    np.testing.assert_array_equal(two, one.frequencies_hz)


def test_dofs_that_change_from_node_to_node(tmp_path: Path) -> None:
    """As Abaqus states them: a line for the first node, one for each place from which on they differ."""
    text = """**
** GENERATION OF SUBSTRUCTURE Z1001
*USER ELEMENT, NODES=         4, LINEAR
** ELEMENT NODES
**          5,          6,
**          9,         12
          1,          2,          3
          3,          1,          2,          3,          4,          5,          6
          4,          1,          2,          3
*MATRIX,TYPE=STIFFNESS
"""
    values = [f"{k}." for k in range(1, 15 * 16 // 2 + 1)]
    text += "\n".join(", ".join(values[at : at + 4]) for at in range(0, len(values), 4)) + "\n"
    write(tmp_path, k_mtx=text)
    found = read_substructure(tmp_path / "k.mtx")
    nodes = [5] * 3 + [6] * 3 + [9] * 6 + [12] * 3
    assert found.dofs.tolist() == [
        [n, d] for n, d in zip(nodes, [1, 2, 3, 1, 2, 3, 1, 2, 3, 4, 5, 6, 1, 2, 3], strict=True)
    ]
    matrix = found.matrices["STIFFNESS"].toarray()
    assert matrix[2].tolist()[:4] == [4.0, 5.0, 6.0, 9.0]
    assert (matrix == matrix.T).all()


def test_substructure_of_calculix_is_refused(tmp_path: Path) -> None:
    """CalculiX 2.20 wrote the block of the kept dofs, which holds the link, as if the rest were clamped."""
    shutil.copy(ROOT / "tests" / "data" / "l_hex20_sub.mtx.gz", tmp_path)
    shutil.copy(ROOT / "data" / "calculix" / "l_hex20.inp.gz", tmp_path)
    table: dict[str, Any] = {
        "matrices": {"format": "abaqus", "files": {"stiffness": "l_hex20_sub.mtx.gz", "mesh": "l_hex20.inp.gz"}},
        "interfaces": [{"name": "root", "face": "IFA"}, {"name": "tip", "face": "IFB"}],
    }
    with pytest.raises(FEImportError, match="block of the kept dofs of a larger matrix") as caught:
        reduce_link(write_toml(tmp_path / "link.toml", table))
    assert caught.value.cause is Cause.GROUNDED
    assert caught.value.value > 0.1


# ---- faults ----------------------------------------------------------------------------------------------------------

BAR = Reduced(
    np.diag([2.0, 2, 2, 1, 1, 1] * 2),
    np.kron([[1.0, -1.0], [-1.0, 1.0]], np.diag([1e4] * 6)),
    np.array([[0.0, 0, 0], [0.0, 0, 1e-9]]),
)
K, M, SUB, DECK = matrix_input(BAR.stiffness, BAR.rows), matrix_input(BAR.mass, BAR.rows), substructure(BAR), deck(BAR)
LINE = "11,1, 11,1, 10000.0\n"
Files = dict[str, str]
FAULTS: dict[str, tuple[Files, Files, str]] = {
    "empty": (FILES, {"k_mtx": ""}, "not a matrix of *MATRIX OUTPUT"),
    "comments only": (FILES, {"k_mtx": "** nothing\n"}, "not a matrix of *MATRIX OUTPUT"),
    "four columns": (FILES, {"k_mtx": "1,1,1,2.0\n"}, "not a matrix of *MATRIX OUTPUT"),
    "cut within a line": (FILES, {"k_mtx": K[:-16]}, "the last line does not end"),
    "cut mass": (FILES, {"m_mtx": M[: M.index("21,3")]}, "the file is cut off"),
    "cut mass, a node less": (FILES, {"m_mtx": M[: M.index("21,1")]}, "the file is cut off"),
    "mass lacks a node": (FILES, {"m_mtx": "".join(k for k in M.splitlines(True) if "11,1" not in k)}, "by direction"),
    "static moment one way": (FILES, {"m_mtx": M + "21,5, 21,1, 0.5\n"}, "static moments of the link differ"),
    "twice": (FILES, {"k_mtx": K + LINE}, "stands at"),
    "both triangles, one twice": (FILES, {"k_mtx": matrix_input(BAR.stiffness, BAR.rows, "both") + LINE}, "stands at"),
    "not finite": (FILES, {"k_mtx": K.replace("10000.0", "nan", 1)}, "not finite"),
    "not a number": (FILES, {"k_mtx": K.replace("10000.0", "1.0x4", 1)}, "not a number"),
    "fraction of a node": (FILES, {"k_mtx": K.replace("11,1", "11.5,1", 1)}, "whole number"),
    "fixed": (FILES, {"k_mtx": K.replace("11,1, 11,1, 10000.0", "11,1, 11,1, 1e36")}, "1 dofs are fixed"),
    "internal nodes": (FILES, {"k_mtx": K + "-3,1, -3,1, 5.\n-4,1,-4,1,5.\n"}, "2 nodes of the matrix are internal"),
    "internal nodes, high": (FILES, {"k_mtx": K + "1000000001,1, 1000000001,1, 5.\n"}, "are internal to Abaqus"),
    "warping": (FILES, {"k_mtx": K + "11,7, 11,7, 5.\n"}, "no displacement or rotation"),
    "missing node": (FILES, {"k_inp": DECK.replace("21, ", "22, ", 1).replace("11, 21", "11")}, "1 nodes of the"),
    "no deck": ({"stiffness": "k.mtx", "mass": "m.mtx"}, {}, "2 nodes of the matrices"),
    "no mass": ({"stiffness": "k.mtx", "mesh": "k.inp"}, {}, "no mass matrix"),
    "asymmetric": (
        FILES,
        {"k_mtx": matrix_input(BAR.stiffness, BAR.rows, "both").replace("21,1, 11,1, -10000", "21,1, 11,1, -10010")},
        "is not symmetric",
    ),
    "grounded": (FILES, {"k_mtx": K.replace(LINE, LINE.replace("10000.0", "20000.0"))}, "resists rigid-body motion"),
    "turned dofs": (FILES, {"k_inp": DECK + "*TRANSFORM, NSET=ENDS\n0.,1.,0.,-1.,0.,0.\n"}, "*TRANSFORM turns"),
    "coordinate without dofs": (FILES, {"k_mtx": coordinate(BAR.stiffness)}, "does not say which node"),
    "coordinate, other dofs": (
        {**FILES, "dofs": "rows.txt"},
        {"k_mtx": coordinate(BAR.stiffness), "m_mtx": coordinate(BAR.mass), "rows_txt": "11 ux\n11 uy\n"},
        "outside of the matrix",
    ),
    "substructure, cut": (REDUCED, {"k_mtx": SUB[: SUB.rindex("*MATRIX")] + "*MATRIX,TYPE=MASS\n 2.,\n"}, "another"),
    "substructure, one number more": (REDUCED, {"k_mtx": SUB + " 3.0,\n"}, "another count of numbers"),
    "substructure, no mass": (REDUCED, {"k_mtx": SUB[: SUB.rindex("*MATRIX")]}, "no mass matrix"),
    "substructure, no stiffness": (REDUCED, {"k_mtx": SUB.replace("STIFFNESS", "VISCOUS")}, "no stiffness matrix"),
    "substructure, mass twice": (REDUCED, {"k_mtx": SUB + "*MATRIX,TYPE=MASS\n"}, "a second matrix"),
    "substructure twice": (REDUCED, {"k_mtx": SUB + SUB}, "a second element"),
    "substructure, infinite": (REDUCED, {"k_mtx": SUB.replace("10000.0", "inf", 1)}, "not finite"),
    "substructure, not a number": (REDUCED, {"k_mtx": SUB.replace("10000.0", "1*3", 1)}, "numbers expected"),
    "substructure, node count": (REDUCED, {"k_mtx": SUB.replace("NODES= 2", "NODES= 20000000")}, "another length than"),
    "substructure, no nodes": (REDUCED, {"k_mtx": SUB.replace("** 11, 21\n", "")}, "another length than"),
    "substructure, no dofs": (REDUCED, {"k_mtx": SUB.replace("1, 2, 3, 4, 5, 6\n", "")}, "no dofs are stated"),
    "substructure, dofs of no node": (REDUCED, {"k_mtx": SUB.replace("5, 6\n", "5, 6\n7, 1\n")}, "belongs to no node"),
    "substructure, component": (REDUCED, {"k_mtx": SUB.replace("5, 6\n", "5, 8\n")}, "component out of range"),
    "substructure, twins": (REDUCED, {"k_mtx": SUB.replace("** 11, 21\n", "** 11, 11\n")}, "stands twice"),
    "substructure, nodes no numbers": (REDUCED, {"k_mtx": SUB.replace("** 11, 21\n", "** 11, B1\n")}, "whole numbers"),
    "substructure of other nodes": (FILES, {"m_mtx": SUB.replace("** 11, 21", "** 21, 11") + "\n"}, "different nodes"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_faulty_files(tmp_path: Path, name: str) -> None:
    """One typed error that names a file and a remedy."""
    files, spoiled, words = FAULTS[name]
    start = {"k_mtx": SUB if name.startswith("substructure") else K, "m_mtx": M, "k_inp": DECK}
    assert all(start.get(key) != text for key, text in spoiled.items())
    write(tmp_path, **{**start, **spoiled})
    with pytest.raises(FEImportError) as caught:
        reduce_link(description(tmp_path, "abaqus", files, BAR))
    error = caught.value
    assert words in str(error)
    assert error.exit_code == 2
    assert str(tmp_path) in error.where
    assert error.remedy
    assert len(str(error)) < 600
    assert "\n" not in str(error)


def test_compressed_files(tmp_path: Path) -> None:
    """Files whose names end in .gz."""
    parts = condensed(frame_model(tmp_path), (0, 3, 6))
    files = {"stiffness": "k.mtx.gz", "mesh": "k.inp.gz"}
    (tmp_path / "k.mtx.gz").write_bytes(gzip.compress(substructure(parts).encode()))
    (tmp_path / "k.inp.gz").write_bytes(gzip.compress(deck(parts).encode()))
    assert reduce_link(description(tmp_path, "abaqus", files, parts)).elastic_modes == 12

"""CalculiX results (.frd) as the mesh of exported matrices: against the deck of the same job, and faulty files."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from exported_files import CALCULIX, FRD, Fault, Files, check_fault, frd_files, link_matrices, written

from fe_import.description.link import load_link
from fe_import.errors import Cause
from fe_import.exports.frd_mesh import read_frd
from fe_import.exports.inp_elements import picture
from fe_import.exports.inp_mesh import read_inp
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link

ROOT = Path(__file__).parents[2]
EXPORTS = ROOT.parent / "shared" / "fe_exports"
LINK = ROOT / "data" / "calculix" / "l_hex20.toml"


def test_results_of_calculix_give_the_model_of_the_deck(tmp_path: Path) -> None:
    """Elements as with the deck, positions to half of their sixth digit; mended they give the same reduced link.

    Frequencies to 3e-7: nodes of the interfaces, 0.03 m wide, are right to 1e-8 m.
    """
    results = EXPORTS / "l_hex20_freq.frd.gz"
    if not results.is_file():
        pytest.skip("needs the results of CalculiX, which are not part of the repository")
    deck = read_inp(LINK.parent / "l_hex20.inp.gz")
    found = read_frd(results)
    np.testing.assert_array_equal(found.labels, deck.labels)
    np.testing.assert_array_equal(found.elements["C3D20"], deck.elements["C3D20"])
    np.testing.assert_allclose(found.nodes, deck.nodes, rtol=1e-12, atol=0.5e-6 * (1 + 1e-6))
    sets = [f"{name} {' '.join(str(deck.labels[k]) for k in deck.node_sets[name])}\n" for name in ("IFA", "IFB")]
    (tmp_path / "sets.txt").write_text("".join(sets), encoding="utf-8")
    text = LINK.read_text(encoding="utf-8").replace('"l_hex20.', f'"{LINK.parent}/l_hex20.')
    text = text.replace(f'mesh = "{LINK.parent}/l_hex20.inp.gz"', f'mesh = "{results}"\nsets = "sets.txt"')
    (tmp_path / "link.toml").write_text(text, encoding="utf-8")
    a, b = reduce_link(tmp_path / "link.toml"), reduce_link(LINK)
    assert all(check.ok for check in a.health)
    np.testing.assert_array_equal(a.triangles, b.triangles)
    np.testing.assert_allclose(a.frequencies_hz[6:], b.frequencies_hz[6:], rtol=3e-7)
    np.testing.assert_allclose(a.nodes, b.nodes, atol=2e-8)


def test_a_written_file_gives_the_model_of_the_deck(tmp_path: Path) -> None:
    """Matrices, and positions to rounding; numbers of ten digits and of five, packed, exponents of three digits."""
    expected = build_model(written(tmp_path, CALCULIX))
    long = frd_files()["k.frd"]
    wide = long.replace(b"E+00", b"E+000").replace(b"E-0", b"E-00").replace(b" 0.", b"0.")
    short = long.decode().splitlines()
    short = [line[:3] + line[8:] if line[:3] == " -1" and "E" in line else line for line in short]
    narrow = "\n".join(short).replace(" " * 37 + "1", " " * 37 + "0", 1).encode() + b"\n"
    for content in (long, wide, narrow, gzip.compress(long)):
        model = build_model(written(tmp_path, FRD, {**frd_files(), "k.frd": content}))
        assert abs(model.stiffness - expected.stiffness).max() == 0
        assert abs(model.mass - expected.mass).max() == 0
        np.testing.assert_allclose(model.nodes, expected.nodes, atol=1e-12)
        np.testing.assert_array_equal(model.triangles, expected.triangles)


def test_wedges_come_in_the_order_of_decks(tmp_path: Path) -> None:
    """CalculiX writes a C3D15 with the upright edges before the upper ones (frd.c); its faces must close."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]], dtype=float)
    edges = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]  # in the order of decks
    nodes = np.concatenate([corners, [(corners[a] + corners[b]) / 2 for a, b in edges]])
    order = [*range(9), *range(12, 15), *range(9, 12)]
    lines = [f"    2C{15:30d}{1:38d}", *(node(k + 1, p) for k, p in enumerate(nodes)), " -3", f"    3C{1:30d}{1:38d}"]
    lines += [" -1         1    5    0    1", *(" -2" + "".join(f"{k + 1:10d}" for k in order[a:b])
                                               for a, b in ((0, 10), (10, 15))), " -3"]  # fmt: skip
    path = tmp_path / "wedge.frd"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    mesh = read_frd(path)
    assert mesh.elements["C3D15"].tolist() == [list(range(15))]
    triangles = picture(mesh.elements)[1]
    a, b, c = (mesh.nodes[triangles[:, k]] for k in range(3))
    assert np.einsum("ti,ti->", np.cross(b - a, c - a) / 2, (a + b + c) / 3) / 3 == pytest.approx(0.5, rel=1e-14)


def node(label: int, position: np.ndarray) -> str:
    return f" -1{label:10d}" + "".join(f"{x:12.5E}" for x in position)


def fault(name: str, change: Callable[[list[str]], list[str]], words: str, cause: Cause = Cause.EXPORT) -> Fault:
    def spoiled() -> Files:
        lines = change(frd_files()["k.frd"].decode().splitlines())
        return {**frd_files(), "k.frd": ("\n".join(lines) + "\n").encode()}

    return Fault(name, FRD, spoiled, {}, cause, words)


def swapped(old: str, new: str) -> Callable[[list[str]], list[str]]:
    def change(lines: list[str]) -> list[str]:
        text = "\n".join(lines)
        assert old in text
        return text.replace(old, new, 1).split("\n")

    return change


def bent(lines: list[str]) -> list[str]:
    """Coordinates that are wrong in their fifth digit."""
    return [line.replace("00E", "07E") if line[:3] == " -1" else line for line in lines]


COUNT = len(link_matrices()[0].nodes)
FAULTS = [
    fault("cut in the nodes", lambda lines: lines[:7], "the file is cut off"),
    fault("cut in the elements", lambda lines: lines[: COUNT + 6], "the file is cut off"),
    fault("cut between", lambda lines: lines[: COUNT + 3], "no elements in this file"),
    fault("cut in a line", lambda lines: [*lines[:6], lines[6][:40]], "not a node with three coordinates"),
    fault("no nodes", lambda lines: lines[:1], "no nodes in this file"),
    fault("a node twice", lambda lines: [*lines[:3], lines[2], *lines[3:]], "this node stands twice"),
    fault("a node lost", lambda lines: [*lines[:4], *lines[5:]], f"got {COUNT - 1}, limit {COUNT}"),
    fault("an element lost", lambda lines: [*lines[:-3], lines[-1]], "got 2, limit 3"),
    fault("a node of an element lost", swapped(f" -2{10:10d}", " -2"), "another number of nodes"),
    fault("an unknown node", swapped(f" -2{10:10d}", f" -2{11:10d}"), "names a node that is not there"),
    fault("a word", swapped(" -2", " -2 abc"), "neither an element nor its nodes"),
    fault("no number", swapped("0.00000E+00", "        NaN"), "not a node with three coordinates"),
    fault("binary", swapped(" " * 37 + "1", " " * 37 + "3"), "not the head of a block in text form"),
    fault("other positions", bent, "positions have six digits", Cause.GROUNDED),
]  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f.name)
def test_faulty_results_are_named(tmp_path: Path, fault: Fault) -> None:
    check_fault(fault, tmp_path)


def test_a_deck_has_its_own_sets(tmp_path: Path) -> None:
    changes = {"matrices": {"files": {"sets": "sets.txt"}}}
    check_fault(Fault("sets", CALCULIX, frd_files, changes, Cause.BAD_FIELD, "a deck holds its own sets"), tmp_path)
    assert load_link(tmp_path / "link.toml").description.matrices is not None

"""Matrices for other programs: written, read back here and by pyyeti and SciPy, to the digits that the format has."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.linalg as la
from link_files import FRAME, frame_link, merged, solid_link, write_toml

from fe_import.description.link import LinkFile, load_link
from fe_import.errors import Cause, FEImportError
from fe_import.modal.model import ModalModel
from fe_import.models.matrices import read_export
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link
from fe_import.writers import WRITERS, WrittenLink
from fe_import.writers.links import of_modal_model, of_model
from fe_import.writers.write import chosen_format, write_link

READABLE = [name for name in WRITERS if name != "mat"]
DIGITS = {"nastran-dmig": 2e-9}  # of ten digits; the others have all
REDUCTIONS: dict[str, dict[str, Any]] = {
    "orthonormal": {"fixed_interface_modes": 5},
    "physical": {"fixed_interface_modes": 5, "form": "physical"},
    "free": {"method": "craig-chang", "free_modes": 9},
    "truncated": {"fixed_interface_modes": 12, "elastic_modes": 14, "static_correction": True},
}


def superelement(folder: Path, reduction: str = "orthonormal") -> tuple[ModalModel, WrittenLink]:
    model = reduce_link(frame_link(folder, reduction=REDUCTIONS[reduction]))
    return model, of_modal_model(model, "l.modal.h5")


def written(folder: Path, link: WrittenLink, name: str) -> LinkFile:
    """Its files, read by the description beside them."""
    form = WRITERS[name]
    return load_link(write_link(link, folder / f"out{form.suffix or '.mtx'}", form)[-1])


def frequencies(link: WrittenLink) -> np.ndarray:
    squares = la.eigh(link.stiffness.toarray(), link.mass.toarray(), eigvals_only=True)
    return np.sqrt(squares[6:]) / (2 * np.pi)


@pytest.mark.parametrize("reduction", REDUCTIONS)
def test_superelements_keep_the_span(tmp_path: Path, reduction: str) -> None:
    """Craig-Bampton form of any basis: its free frequencies, and no stiffness between interfaces and modes."""
    model, link = superelement(tmp_path, reduction)
    free = reduce_link(frame_link(tmp_path, reduction={**REDUCTIONS[reduction], "form": "orthonormal"}))
    np.testing.assert_allclose(frequencies(link), free.frequencies_hz[6:], rtol=1e-9)
    stiffness, mass = link.stiffness.toarray(), link.mass.toarray()
    assert link.modal == len(mass) - 12 == model.modes - 12
    assert not stiffness[:12, 12:].any()
    np.testing.assert_array_equal(mass[12:, 12:], np.eye(link.modal))
    rigid = np.zeros((len(mass), 6))
    for k, (x, y, z) in enumerate(link.positions):
        rigid[6 * k : 6 * k + 6] = np.eye(6)
        rigid[6 * k : 6 * k + 3, 3:] = -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    assert np.abs(stiffness @ rigid).max() < 1e-9 * (abs(stiffness) @ abs(rigid)).max()
    if reduction == "orthonormal":
        np.testing.assert_allclose(
            np.sqrt(np.diag(stiffness)[12:]) / (2 * np.pi), model.fixed_interface.frequencies_hz, rtol=1e-9
        )


@pytest.mark.parametrize("name", READABLE)
@pytest.mark.parametrize("full", [False, True])
def test_round_trip(tmp_path: Path, name: str, full: bool) -> None:
    """Every entry, row, node and interface comes back."""
    if full:
        link = of_model(build_model(frame_link(tmp_path)), "l.toml")
    else:
        _, link = superelement(tmp_path)
    description = written(tmp_path, link, name)
    assert description.description.matrices is not None
    export = read_export(description, description.description.matrices)
    rows = np.full(len(link.node), -1)
    modal = link.component < 0
    place = {int(label): k for k, label in enumerate(export.labels)}
    for k in np.flatnonzero(~modal):
        rows[k] = export.dof_map[place[int(link.labels[link.node[k]])], link.component[k]]
    rows[modal] = export.modal_rows
    assert sorted(rows) == list(range(len(rows)))
    for ours, theirs in ((link.mass, export.mass), (link.stiffness, export.stiffness)):
        found = theirs.toarray()[np.ix_(rows, rows)]
        np.testing.assert_allclose(found, ours.toarray(), rtol=DIGITS.get(name, 0.0), atol=0.0)
    for label, position in zip(link.labels, link.positions, strict=True):
        np.testing.assert_allclose(export.nodes[place[int(label)]], position, rtol=DIGITS.get(name, 0.0), atol=1e-12)
    again = reduce_link(description)
    np.testing.assert_allclose(again.frequencies_hz[6:16], frequencies(link)[:10], rtol=1e-7)
    assert [i.name for i in again.interface_nodes] == ["hub", "hand"]
    assert "written by erls" in description.path.read_text(encoding="utf-8")


def test_a_solid_goes_out_and_comes_back(tmp_path: Path) -> None:
    """Faces on their interface nodes: rows of three dofs and of six."""
    link = solid_link(tmp_path, reduction={"fixed_interface_modes": 6})
    full = of_model(build_model(link), "l.toml")
    assert sorted(set(np.bincount(full.node))) == [3, 6]
    found = reduce_link(written(tmp_path, full, "matrix-market"))
    ours = reduce_link(link)
    exact = frequencies(full)
    np.testing.assert_allclose(found.frequencies_hz[6:9], exact[:3], rtol=1e-7)
    assert found.mass_properties.mass == pytest.approx(ours.mass_properties.mass, rel=1e-12)


def test_pyyeti_reads_output4(tmp_path: Path) -> None:
    _, link = superelement(tmp_path)
    write_link(link, tmp_path / "l.op4", WRITERS["nastran-op4"])
    found = importlib.import_module("pyyeti.nastran.op4").read(str(tmp_path / "l.op4"))
    np.testing.assert_array_equal(found["kaax"], link.stiffness.toarray())
    np.testing.assert_array_equal(found["maax"], link.mass.toarray())


def test_pyyeti_reads_entries(tmp_path: Path) -> None:
    """DMIG by another reader: matrices by grid point and component."""
    _, link = superelement(tmp_path)
    write_link(link, tmp_path / "l.pch", WRITERS["nastran-dmig"])
    found = importlib.import_module("pyyeti.nastran.bulk").rddmig(str(tmp_path / "l.pch"))
    table = found["kaax"]
    matrix = np.asarray(table)
    matrix = np.tril(matrix) + np.tril(matrix, -1).T
    np.testing.assert_allclose(matrix, link.stiffness.toarray(), rtol=1e-9, atol=1e-9 * np.abs(matrix).max())
    assert [tuple(map(int, row)) for row in table.index[:3]] == [(1, 1), (1, 2), (1, 3)]


def test_scipy_reads_matlab(tmp_path: Path) -> None:
    _, link = superelement(tmp_path)
    assert write_link(link, tmp_path / "l.mat", WRITERS["mat"]) == [tmp_path / "l.mat"]
    found = scipy.io.loadmat(tmp_path / "l.mat")
    np.testing.assert_array_equal(found["K"].toarray(), link.stiffness.toarray())
    np.testing.assert_array_equal(found["nodes"][:, 1:], link.positions)
    assert found["rows"][[0, 5, 6, 11]].tolist() == [[1, 1], [1, 6], [2, 1], [2, 6]]
    assert (found["rows"][12:, 1] == 0).all()


def test_nothing_is_half_written(tmp_path: Path) -> None:
    """A file that must not be replaced: none is put in place, and nothing is left behind."""
    _, link = superelement(tmp_path)
    before = sorted(p.name for p in tmp_path.iterdir())

    def refuse(path: Path) -> None:
        if path.suffix == ".toml":
            raise FEImportError(Cause.NOT_WRITABLE, "kept")

    with pytest.raises(FEImportError, match="kept"):
        write_link(link, tmp_path / "l.op4", WRITERS["nastran-op4"], refuse)
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_what_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(FEImportError, match=r"names no format.*\.op4"):
        chosen_format(Path("l.xyz"))
    with pytest.raises(FEImportError, match="nastran-op4"):
        chosen_format(Path("l.xyz"), "nastran-op5")
    assert chosen_format(Path("l.xyz"), "abaqus") is WRITERS["abaqus"]
    few = reduce_link(load_link(write_toml(tmp_path / "l.toml", merged(FRAME, {"reduction": {"elastic_modes": 4}}))))
    with pytest.raises(FEImportError, match="'10 modes', limit 12 interface dofs"):
        of_modal_model(few, "l.modal.h5")
    averaged = solid_link(tmp_path, interfaces=[{"name": "hub", "face": "x0", "coupling": "averaged"}])
    with pytest.raises(FEImportError, match="averaged interfaces"):
        of_model(build_model(averaged), "link.toml")

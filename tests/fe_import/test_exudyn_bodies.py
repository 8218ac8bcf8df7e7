"""Bodies for exudyn: their constants against sums over masses, the points around interfaces, exudyn's own reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from link_files import frame_link, solid_link
from numpy.typing import NDArray

from fe_import.errors import Cause, FEImportError
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link
from fe_import.writers.exudyn import AROUND, exudyn_body, write_exudyn

Array = NDArray[np.float64]


def skew(vectors: Array) -> Array:
    """(3 n, 3 k) matrices v × of the n vectors in each of k columns, beside each other."""
    count = len(vectors) // 3
    parts = [np.concatenate([np.cross(v, np.eye(3)).T for v in column.reshape(count, 3)]) for column in vectors.T]
    return np.concatenate(parts, axis=1)


def test_constants_are_sums_over_masses(tmp_path: Path) -> None:
    """A solid whose faces are averaged has translations alone: exudyn's own formulas over its full mass matrix, to
    rounding.
    """
    link = solid_link(tmp_path, reduction={"fixed_interface_modes": 3}, interfaces=[
        {"name": "hub", "face": "x0", "coupling": "averaged"}, {"name": "hand", "face": "x1", "coupling": "averaged"},
    ])  # fmt: skip
    full = build_model(link)
    model = reduce_link(link)
    found = exudyn_body(model)
    kept = np.flatnonzero((full.dof_map[:, :3] >= 0).all(axis=1))
    rows = full.dof_map[kept, :3].ravel()
    mass = full.mass[rows][:, rows].toarray()
    assert np.abs(full.mass).sum() == pytest.approx(np.abs(mass).sum(), rel=1e-12)  # nothing else has mass
    nodes, shapes = (found[name].reshape(-1, 3, k) for name, k in (("xRef", 1), ("modeBasis", found["infoList"][0])))
    place, psi = nodes[kept].reshape(-1, 1), shapes[kept].reshape(len(rows), -1)
    whole, x, turned = np.kron(np.ones(len(kept)), np.eye(3)).T, skew(place), skew(psi)
    expected = {
        "massMatrixReduced": psi.T @ mass @ psi,
        "Mtt": whole.T @ mass @ whole,
        "inertiaLocal": x.T @ mass @ x,
        "mPsiTildePsi": turned.T @ mass @ psi,
        "mPsiTildePsiTilde": turned.T @ mass @ turned,
        "mPhitTPsi": whole.T @ mass @ psi,
        "mPhitTPsiTilde": whole.T @ mass @ turned,
        "mXRefTildePsi": x.T @ mass @ psi,
        "mXRefTildePsiTilde": x.T @ mass @ turned,
    }
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, rtol=0, atol=1e-10 * np.abs(value).max(), err_msg=name)
    np.testing.assert_allclose(found["chiU"] * found["totalMass"], (whole.T @ mass @ place)[:, 0], rtol=1e-10)
    np.testing.assert_allclose(found["chiUtilde"], skew(found["chiU"][:, None]), atol=0)


@pytest.mark.parametrize("form", ["orthonormal", "physical"])
def test_modes_rest_at_the_first_interface(form: str, tmp_path: Path) -> None:
    """They are those of the link clamped there; points around the other interface move as a rigid piece."""
    link = frame_link(tmp_path, reduction={"fixed_interface_modes": 8, "form": form})
    found = exudyn_body(reduce_link(link))
    shapes = found["modeBasis"].reshape(-1, 3, found["infoList"][0])
    hub, hand = (shapes[found["interfaces"][name]] for name in ("hub", "hand"))
    assert np.abs(hub).max() < 1e-9 * np.abs(hand).max()
    np.testing.assert_allclose(found["massMatrixReduced"], np.eye(shapes.shape[2]), atol=1e-9)
    clamped = reduce_link(frame_link(tmp_path, reduction={"fixed_interface_modes": 8}, interfaces=[
        {"name": "hub", "node": "root"}
    ]))  # fmt: skip
    first = np.sqrt(found["stiffnessMatrixReduced"][0, 0]) / (2 * np.pi)
    assert first == pytest.approx(clamped.fixed_interface.frequencies_hz[0], rel=1e-4)
    offsets = found["xRef"].reshape(-1, 3)[found["interfaces"]["hand"]]
    offsets = offsets - offsets.mean(axis=0)
    turn = np.einsum("nab,nbk->ak", np.stack([skew(o[:, None]) for o in offsets]), hand) / (2 * (offsets**2).sum() / 3)
    middle = hand.mean(axis=0)
    for offset, moved in zip(offsets, hand, strict=True):
        np.testing.assert_allclose(moved, middle + np.cross(turn.T, offset).T, atol=1e-9 * np.abs(hand).max())
    assert len(offsets) == AROUND


def test_files_are_those_of_exudyn(tmp_path: Path) -> None:
    """By its own reader, where it is installed; its bodies then have our numbers."""
    fem = pytest.importorskip("exudyn.FEM", reason="exudyn is not installed")
    content = write_exudyn(tmp_path / "l.hdf5", reduce_link(frame_link(tmp_path)))
    read = fem.ObjectFFRFreducedOrderInterface(None)
    read.LoadFromFile(str(tmp_path / "l.hdf5"), "HDF5")
    for name, value in read.GetDictionary().items():
        if name not in ("rigidBodyNodeType", "postProcessingModes"):
            np.testing.assert_array_equal(value, np.asarray(content[name]).reshape(np.shape(value)), err_msg=name)


def test_bodies_need_a_mode(tmp_path: Path) -> None:
    """And leave nothing where they have none."""
    link = frame_link(tmp_path, reduction={"elastic_modes": 0})
    with pytest.raises(FEImportError) as refused:
        write_exudyn(tmp_path / "l.hdf5", reduce_link(link))
    assert refused.value.cause == Cause.MODE_COUNT
    assert not (tmp_path / "l.hdf5").exists()

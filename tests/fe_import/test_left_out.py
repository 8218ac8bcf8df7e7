"""What a reduced link leaves out: closed forms, the full model, other formulas, files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from link_files import Array, frame_link, solid_link, straight_link

from fe_import import cache
from fe_import.cache import left_out_cached
from fe_import.description.link import LinkFile
from fe_import.errors import Cause, FEImportError
from fe_import.modal.left_out import LeftOut, extended
from fe_import.modal.left_out_file import read_left_out_file, write_left_out_file
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.models.refined import on_refined, refined_frame
from fe_import.reduce import reduce_link
from fe_import.reduction import left_out as module
from fe_import.reduction.left_out import left_out, left_out_of

NO_NODES = np.zeros(0, dtype=np.int64)
SHARE = module.NEGLIGIBLE**2  # of the flexibility under a load that fields dropped may hold


def elastic_modes(model: FEModel) -> tuple[Array, Array]:
    """Squared frequencies and mass-orthonormal modes of the full free model, dense."""
    values, modes = la.eigh(model.stiffness.toarray(), model.mass.toarray())
    return values[6:], modes[:, 6:]


def interface_rows(modal: ModalModel) -> Array:
    """(6 n_interfaces, m) displacements and rotations of the interfaces."""
    return np.vstack([np.vstack(modal.node_shape(i.node)) for i in modal.interface_nodes])


def both(link: LinkFile, **options: Any) -> tuple[ModalModel, LeftOut]:
    """A reduction and what it leaves out of the model's own mesh."""
    modal = reduce_link(link)
    return modal, left_out(build_model(link), modal, **options)


@pytest.mark.parametrize("modes", [1, 3, 5])
def test_a_cantilever_with_few_modes_bends_as_it_should(tmp_path: Path, modes: int) -> None:
    """Held at its hub, under a force on its tip: F L³ / (3 E I) of Euler and Bernoulli."""
    length, force = 0.8, 2.0
    options = {"method": "mode-displacement", "free_modes": 12, "elastic_modes": modes}
    link = straight_link(tmp_path, length, 8, frame={"theory": "euler-bernoulli"}, reduction=options)
    modal = reduce_link(link)
    whole = extended(modal, left_out_of(link, modal), NO_NODES)
    deflection = force * length**3 / (3 * 7e10 * 0.01**3 * 0.02 / 12)  # width 0.01 along y, the direction of the force

    def tip(model: ModalModel) -> float:
        rows = interface_rows(model)
        hub, hand = rows[:6], rows[6:]
        free = la.null_space(hub)
        answer = free @ np.linalg.solve(free.T @ model.stiffness @ free, free.T @ hand[1] * force)
        return float(hand[1] @ answer)

    assert tip(whole) == pytest.approx(deflection, rel=10 * SHARE)
    assert tip(modal) < (0.999 if modal.elastic_modes > 3 else 0.95) * deflection


def test_nothing_is_left_out_with_all_modes(tmp_path: Path) -> None:
    modal, left = both(frame_link(tmp_path, reduction={"method": "none"}))
    assert left.fields == 0
    assert left.invariants.m.shape == (modal.modes, modal.modes)


def test_a_finer_mesh_has_more_to_leave_out(tmp_path: Path) -> None:
    """All modes of the coarse mesh: what is left moves within elements, as statics of beams are exact at nodes."""
    link = frame_link(tmp_path, reduction={"method": "none"})
    modal = reduce_link(link)
    left = left_out_of(link, modal)
    assert left.refined
    assert left.fields > 0
    held = left.translation_shapes - np.tensordot(modal.translation_shapes, coupling(modal, left), ([2], [0]))
    assert np.abs(held).max() < 1e-6 * np.abs(left.translation_shapes).max()


def coupling(modal: ModalModel, left: LeftOut) -> Array:
    """(m, x) motions of the modes that come nearest to the fields at the nodes."""
    shapes = np.concatenate([modal.translation_shapes, modal.rotation_shapes]).reshape(-1, modal.modes)
    fields = np.concatenate([left.translation_shapes, left.rotation_shapes]).reshape(len(shapes), -1)
    return np.asarray(np.linalg.lstsq(shapes, fields, rcond=None)[0])


@pytest.mark.parametrize("method", ["craig-bampton", "mode-displacement", "craig-chang", "guyan"])
def test_flexibility_left_out_is_that_of_the_other_modes(tmp_path: Path, method: str) -> None:
    """Σ φ φᵀ / ω² of all modes of the full model, less that of the modes kept; symmetric, as Maxwell says."""
    link = frame_link(tmp_path, reduction={"method": method, "elastic_modes": 5})
    model = build_model(link)
    modal, left = both(link)
    values, modes = elastic_modes(model)
    rows = modes[model.interface_dofs]
    kept = interface_rows(modal)[:, 6:]
    expected = (rows / values) @ rows.T - (kept / np.diag(modal.stiffness)[6:]) @ kept.T
    own = interface_rows(extended(modal, left, NO_NODES))[:, modal.modes :]
    found = (own / left.stiffness) @ own.T
    size = np.sqrt(np.diag((rows / values) @ rows.T))
    assert np.allclose(found, found.T)
    assert np.abs((found - expected) / np.outer(size, size)).max() < 10 * SHARE
    assert np.abs(expected / np.outer(size, size)).max() > 100 * SHARE  # else there were nothing to find


def test_fields_are_orthogonal_to_the_modes_and_to_each_other(tmp_path: Path) -> None:
    link = frame_link(tmp_path, reduction={"method": "craig-bampton", "elastic_modes": 4})
    model = build_model(link)
    modal, left = both(link)
    whole = extended(modal, left, NO_NODES)
    fields = np.zeros((model.mass.shape[0], whole.modes))
    fields[model.dof_map[:, :3]] = whole.translation_shapes
    fields[model.dof_map[:, 3:]] = whole.rotation_shapes
    stiffness, mass = fields.T @ model.stiffness @ fields, fields.T @ model.mass @ fields
    size = np.sqrt(np.diag(whole.stiffness) + whole.stiffness[6, 6])
    # rounding of the solutions, times the condition of the stiffness of a slender link
    assert np.abs((stiffness - whole.stiffness) / np.outer(size, size)).max() < 1e-8
    assert np.allclose(mass, whole.invariants.m, atol=1e-8)
    assert np.allclose(mass[modal.modes :, modal.modes :], np.eye(left.fields), atol=1e-8)


@pytest.mark.parametrize("modes", [1, 4, 9])
def test_frequencies_come_near_those_of_the_finer_mesh(tmp_path: Path, modes: int) -> None:
    """The error of the first one falls by far more than 100 in one Krylov step; the link's first frequencies are apart
    by factors of 2 to 10, so that what the step leaves of the next ones is a hundredth and less.
    """
    link = frame_link(tmp_path, reduction={"method": "craig-bampton", "elastic_modes": modes})
    modal = reduce_link(link)
    whole = extended(modal, left_out_of(link, modal), NO_NODES)
    values = elastic_modes(refined_frame(link, module.REFINED))[0]
    found = la.eigvalsh(whole.stiffness[6:, 6:], whole.invariants.m[6:, 6:])
    assert found[0] == pytest.approx(values[0], rel=1e-3)
    assert np.allclose(found[1:3], values[1:3], rtol=0.05)
    assert (found[:3] >= values[:3] * (1 - 1e-9)).all()  # Rayleigh: from above


def test_coarse_matrices_are_those_of_the_fine_mesh(tmp_path: Path) -> None:
    """Over the fields of the coarse mesh, with consistent masses: to rounding."""
    link = frame_link(tmp_path)
    coarse, fine = build_model(link), refined_frame(link, 3)
    fields = on_refined(fine, np.eye(coarse.mass.shape[0]))
    for ours, other in ((fine.mass, coarse.mass), (fine.stiffness, coarse.stiffness)):
        expected = other.toarray()
        assert np.abs(fields.T @ (ours @ fields) - expected).max() < 1e-10 * np.abs(expected).max()
    assert np.array_equal(fine.nodes[: len(coarse.nodes)], coarse.nodes)


def test_a_solid_has_no_finer_mesh(tmp_path: Path) -> None:
    left = left_out_of(link := solid_link(tmp_path, reduction={"elastic_modes": 6}), reduce_link(link))
    assert not left.refined
    assert left.fields > 0


def test_a_file_gives_back_what_was_written(tmp_path: Path) -> None:
    warm = {"temperature_change": 50.0, "materials": {"m": {"thermal_expansion": 2e-5}}}
    modal, left = both(frame_link(tmp_path, reduction={"method": "craig-bampton", "elastic_modes": 4}, **warm))
    assert left.thermal.any()
    write_left_out_file(tmp_path / "a.h5", left)
    found = read_left_out_file(tmp_path / "a.h5", modal)
    assert found.refined == left.refined
    for name in ("stiffness", "translation_shapes", "rotation_shapes", "thermal"):
        assert np.array_equal(getattr(found, name), getattr(left, name))
    for name in ("m", "X", "Z", "rigid"):
        assert np.array_equal(getattr(found.invariants, name), getattr(left.invariants, name))


def test_what_was_found_once_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    link = frame_link(tmp_path, reduction={"method": "craig-bampton", "elastic_modes": 4})
    modal, folder, asked = reduce_link(link), tmp_path / "cache", list[int]()

    def described() -> LinkFile:
        asked.append(1)
        return link

    first = left_out_cached(described, modal, folder)
    assert left_out_cached(described, modal, folder) is first
    monkeypatch.setattr(cache, "_lately", {})  # another process
    again = left_out_cached(described, modal, folder)
    assert np.array_equal(again.invariants.m, first.invariants.m)
    assert asked == [1]
    next(folder.glob("*.h5")).write_bytes(b"damaged")
    monkeypatch.setattr(cache, "_lately", {})
    left_out_cached(described, modal, folder)
    assert asked == [1, 1]


def test_a_changed_description_is_refused(tmp_path: Path) -> None:
    modal = reduce_link(frame_link(tmp_path))
    changed = frame_link(tmp_path, sections={"s": {"width": 0.011}})
    with pytest.raises(FEImportError, match="not the one") as caught:
        left_out_cached(lambda: changed, modal, tmp_path / "cache")
    assert caught.value.cause == Cause.MODAL_FILE


def test_modes_of_another_mesh_are_refused(tmp_path: Path) -> None:
    modal = reduce_link(frame_link(tmp_path))
    with pytest.raises(FEImportError, match="not those of the finite-element model") as caught:
        left_out(build_model(straight_link(tmp_path, 0.5, 3)), modal)
    assert caught.value.cause == Cause.MODAL_FILE



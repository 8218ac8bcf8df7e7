"""Static correction: after truncation the modes still hold the static response to interface loads and to inertia."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from link_files import SOLID, Array, boundary, dense, frame_link, interface_shapes, straight_link
from link_table import LINKS, held_flexibility, modal_flexibility, nodal_fields, relative

from fe_import.description.link import LinkFile
from fe_import.errors import Cause, FEImportError
from fe_import.modal.file import read_modal_file, write_modal_file
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link, reduce_model
from fe_import.reduction.free_body import free_body

METHODS: list[dict[str, Any]] = [
    {"method": "craig-bampton", "fixed_interface_modes": 9},
    {"method": "craig-chang", "free_modes": 9},
    {"method": "none"},
]
TRUNCATIONS = pytest.mark.parametrize("truncation", ["free-free", "clamped"])


def corrected(name: str, folder: Path, **options: Any) -> tuple[FEModel, LinkFile, ModalModel]:
    link = LINKS[name](folder, reduction={"static_correction": True, **options})
    model = build_model(link)
    return model, link, reduce_model(model, link)


def held_response(model: FEModel, interface: int, loads: Array) -> Array:
    """(f, n) static response to loads over the independent dofs, one interface clamped."""
    _, stiffness, _ = dense(model)
    free = np.setdiff1d(np.arange(len(stiffness)), boundary(model)[6 * interface : 6 * interface + 6])
    response = np.zeros_like(loads)
    scale = 1 / np.sqrt(np.diag(stiffness)[free])
    inner = stiffness[np.ix_(free, free)] * np.outer(scale, scale)
    response[free] = scale[:, None] * la.solve(inner, scale[:, None] * loads[free], assume_a="pos")
    return response


def missing(model: FEModel, modal: ModalModel, fields: Array) -> float:
    """Largest part of static fields, in the energy norm, that no modal coordinates give."""
    mass, stiffness, _ = dense(model)
    shapes = nodal_fields(model, modal)[model.independent]
    rigid, elastic = shapes[:, :6], shapes[:, 6:]
    fields = fields - rigid @ (rigid.T @ mass @ fields)  # whose rounding would weigh more than what is looked for
    rest = fields - elastic @ ((elastic.T @ stiffness @ fields) / (2 * np.pi * modal.frequencies_hz[6:, None]) ** 2)
    energies = [np.einsum("fn,fn->n", x, stiffness @ x) for x in (rest, fields)]
    return float(np.sqrt((energies[0] / energies[1]).max().clip(min=0)))


@TRUNCATIONS
@pytest.mark.parametrize("options", METHODS, ids=lambda o: o["method"])
@pytest.mark.parametrize("name", LINKS)
def test_static_fields_survive_truncation(tmp_path: Path, name: str, options: dict[str, Any], truncation: str) -> None:
    """Loads at every interface with any other one held, and the inertia of rigid-body accelerations: to 1e-7 in the
    energy norm (1e-14 of the flexibility), with six elastic modes per interface and two more."""
    count = len(build_model(LINKS[name](tmp_path)).interface_nodes)
    kept = 6 * count + 2
    model, _, modal = corrected(name, tmp_path, **options, elastic_modes=kept, truncation=truncation)
    assert modal.elastic_modes == kept
    assert all(c.ok for c in modal.health), modal.health
    mass, _, rigid = dense(model)
    loads = np.zeros((len(mass), 6 * count))
    loads[boundary(model), np.arange(6 * count)] = 1.0
    for held in range(count):
        others = np.delete(np.arange(6 * count), 6 * held + np.arange(6))
        fields = held_response(model, held, np.hstack([loads[:, others], mass @ rigid]))
        assert missing(model, modal, fields) < 1e-7
    path = tmp_path / "l.modal.h5"
    write_modal_file(path, modal)
    assert read_modal_file(path).modes == modal.modes


@TRUNCATIONS
def test_truncation_loses_what_the_correction_keeps(tmp_path: Path, truncation: str) -> None:
    """Craig-Bampton cut to 14 of 18: the held flexibility is off by more than 1e-3 unless corrected (1e-10)."""
    for correction, exact in ((False, False), (True, True)):
        link = frame_link(
            tmp_path, reduction={"elastic_modes": 14, "truncation": truncation, "static_correction": correction}
        )
        model = build_model(link)
        error = relative(modal_flexibility(reduce_model(model, link)), held_flexibility(model))
        assert error < 1e-10 if exact else error > 1e-3


def test_the_rest_is_filled_with_the_lowest_modes(tmp_path: Path) -> None:
    """Free-free: the lowest k of 12 + k elastic frequencies are those of the whole basis to 1e-9; frequencies fall as
    modes are added (Ritz)."""
    model = build_model(frame_link(tmp_path))

    def frequencies(**options: Any) -> Array:
        link = frame_link(tmp_path, reduction={"fixed_interface_modes": 24, **options})
        return reduce_model(model, link).frequencies_hz[6:]

    whole = frequencies(static_correction=True)
    assert len(whole) == 36  # 6 constraint, 24 fixed-interface, 6 for the inertia
    last = np.full(12, np.inf)
    for extra in (0, 3, 6, 12, 24):
        found = frequencies(static_correction=True, elastic_modes=12 + extra)
        np.testing.assert_allclose(found[:extra], whole[:extra], rtol=1e-9)
        assert (found[:12] < last * (1 + 1e-9)).all()
        last = found[:12]


def test_nothing_left_to_correct(tmp_path: Path) -> None:
    """All fixed-interface modes: inertia fields are in the basis already and not added twice."""
    link = frame_link(tmp_path, reduction={"fixed_interface_modes": 30, "static_correction": True})
    model = build_model(link)
    assert reduce_model(model, link).modes == 42 == len(model.independent)


def test_links_with_few_dofs(tmp_path: Path) -> None:
    """Static fields that depend on each other count once: no inner node 6 fields, one inner node 12, and all modes."""
    for elements, fields in ((1, 6), (2, 12)):
        interfaces = [{"name": "hub", "node": "root"}, {"name": "hand", "node": "tip"}]
        for kept in (fields, fields - 1):
            options = {"method": "none", "static_correction": True, "elastic_modes": kept}
            link = straight_link(tmp_path, 0.5, elements, interfaces=interfaces, reduction=options)
            model = build_model(link)
            if kept == fields:
                assert relative(modal_flexibility(reduce_model(model, link)), held_flexibility(model)) < 1e-9
                continue
            with pytest.raises(FEImportError, match="static correction takes more elastic modes") as caught:
                reduce_model(model, link)
            assert caught.value.cause is Cause.MODE_COUNT
            assert caught.value.where.endswith("reduction.elastic_modes")
            assert (caught.value.value, caught.value.limit) == (kept, fields)
            assert caught.value.remedy


def test_rotations_without_mass_are_reported(tmp_path: Path) -> None:
    """Lumped mass without rotary inertia: what turns under a moment has no mass, no mode holds it, health fails."""
    massless = {"mass": "lumped", "rotary_inertia": False}
    link = frame_link(tmp_path, frame=massless, reduction={"static_correction": True})
    model = build_model(link)
    modal = reduce_model(model, link)
    check = next(c for c in modal.health if c.name == "static flexibility between the interfaces")
    assert not check.ok
    assert relative(modal_flexibility(modal), held_flexibility(model)) > 0.1
    sound = frame_link(tmp_path, frame={"mass": "lumped"}, reduction={"static_correction": True})
    assert all(c.ok for c in reduce_model(build_model(sound), sound).health)


@pytest.mark.parametrize("truncation", ["free-free", "clamped"])
@pytest.mark.parametrize("method", ["craig-bampton", "guyan", "none"])
def test_what_truncation_loses_is_reported(tmp_path: Path, method: str, truncation: str) -> None:
    """The flexibility of all modes of the basis less that of the modes kept; of ``none`` that is the full model's."""
    link = frame_link(tmp_path, reduction={"method": method, "truncation": truncation, "elastic_modes": 5})
    model = build_model(link)
    modal, every = (reduce_model(model, x) for x in (link, frame_link(tmp_path, reduction={"method": method})))
    exact = kept_flexibility(every)
    if method == "none":
        body = free_body(model, "x")
        assert relative(exact, body.static(body.interface_loads())[body.interfaces]) < 1e-9
    check = next(c for c in modal.health if c.name == "static flexibility between the interfaces")
    assert not any(c.name == check.name for c in every.health)
    lost = np.abs(kept_flexibility(modal) - exact) / np.sqrt(np.outer(np.diag(exact), np.diag(exact)))
    assert check.value == pytest.approx(lost.max(), rel=1e-6)
    assert check.ok
    assert not check.judged


def kept_flexibility(modal: ModalModel) -> Array:
    """(12, 12) static flexibility between the interfaces that the elastic modes hold."""
    elastic = interface_shapes(modal)[:, 6:] / (2 * np.pi * modal.frequencies_hz[6:])
    return np.asarray(elastic @ elastic.T)


def test_component_without_flexibility(tmp_path: Path) -> None:
    """All inertia about the line of a straight link sits on the hand: under balanced moments that does not turn."""
    frame = {"mass": "lumped", "rotary_inertia": False}
    ends = [{"node": "tip", "inertia": [1e-5, 1e-5, 1e-5]}]
    modal = reduce_link(straight_link(tmp_path, 1.0, 8, frame=frame, masses=ends))
    check = next(c for c in modal.health if c.name == "static flexibility between the interfaces")
    assert check.value == pytest.approx(1.0, rel=1e-9)  # the root turns without mass, which no mode holds


def test_mass_on_the_interfaces_only(tmp_path: Path) -> None:
    """Inner nodes of next to no mass: the inertia of the inner nodes is a millionth, and still held."""
    heavy = [{"node": i["name"], "mass": 1e4, "inertia": [1e2, 1e2, 1e2]} for i in SOLID["interfaces"]]
    link = frame_link(tmp_path, masses=heavy, reduction={"static_correction": True, "elastic_modes": 13})
    model = build_model(link)
    modal = reduce_model(model, link)
    assert relative(modal_flexibility(modal), held_flexibility(model)) < 1e-8
    mass, _, rigid = dense(model)
    assert missing(model, modal, held_response(model, 0, mass @ rigid)) < 1e-7

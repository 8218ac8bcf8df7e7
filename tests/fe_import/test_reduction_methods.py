"""Every reduction on every link of one table: all modes are the full model, statics, rigid bodies, repeated pairs."""

from __future__ import annotations

import functools
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from link_files import Array, dense, frame_link, free_frequencies, straight_link
from link_table import LINKS, every_mode, held_flexibility, modal_flexibility, nodal_fields, relative

import fe_import.solver.sparse
from fe_import.description.link import load_link
from fe_import.description.reduction import Reduction
from fe_import.errors import Cause, FEImportError
from fe_import.modal.file import read_modal_file, write_modal_file
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link, reduce_model
from fe_import.reduction import REDUCTIONS
from fe_import.reduction.free_body import free_body

STATIC = "static flexibility between the interfaces"
SOLID_L = Path(__file__).parents[2] / "data" / "l_shape" / "links" / "solid.toml"
METHODS = sorted(REDUCTIONS)
FEW: dict[str, dict[str, Any]] = {
    "craig-bampton": {"fixed_interface_modes": 5},
    "craig-chang": {"free_modes": 5},
    "mode-displacement": {"free_modes": 12},
    "guyan": {},
    "none": {},
}


@functools.cache
def full(name: str) -> tuple[FEModel, Array]:
    """A model of the table and its lowest 8 free frequencies."""
    with tempfile.TemporaryDirectory() as folder:
        model = build_model(LINKS[name](Path(folder)))
    return model, free_frequencies(model, 8)


def reduced(name: str, folder: Path, **options: Any) -> tuple[FEModel, ModalModel]:
    model = full(name)[0]
    return model, reduce_model(model, LINKS[name](folder, reduction=options))


def sound(modal: ModalModel) -> bool:
    """Every check passed, but the one that mode displacement exists to fail."""
    return all(c.ok for c in modal.health if c.name != STATIC)


@pytest.mark.parametrize("method", sorted(set(METHODS) - {"guyan"}))
@pytest.mark.parametrize("name", LINKS)
def test_every_mode_kept_is_the_full_model(tmp_path: Path, method: str, name: str) -> None:
    """Count of modes, lowest 8 frequencies and static flexibility to 1e-8 (1e-9 seen)."""
    model, exact = full(name)
    model, modal = reduced(name, tmp_path, **every_mode(method, model))
    assert modal.modes == len(model.independent)
    np.testing.assert_allclose(modal.frequencies_hz[6:14], exact, rtol=1e-8)
    if len(model.interface_nodes) > 1:
        assert relative(modal_flexibility(modal), held_flexibility(model)) < 1e-8
    assert all(c.ok for c in modal.health), modal.health


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", LINKS)
def test_static_flexibility(tmp_path: Path, method: str, name: str) -> None:
    """First interface held, unit loads at the others, few modes: 1e-8 of the full model. Free modes alone: 1 % and more
    missing, and the health report says so."""
    model, modal = reduced(name, tmp_path, method=method, **FEW[method])
    verdicts = {c.name: c.ok for c in modal.health}
    assert verdicts.get(STATIC) is (False if method == "mode-displacement" else None)
    assert sound(modal), modal.health
    if len(model.interface_nodes) > 1:
        error = relative(modal_flexibility(modal), held_flexibility(model))
        assert error > 1e-2 if method == "mode-displacement" else error < 1e-8


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", LINKS)
def test_rigid_body_properties(tmp_path: Path, method: str, name: str) -> None:
    """Mass, centre of mass, inertia and rigid motions of the full model to 1e-9; the file is legal."""
    model, modal = reduced(name, tmp_path, method=method, **FEW[method])
    exact, found = modal.full_mass_properties, modal.mass_properties
    assert found.mass == pytest.approx(exact.mass, rel=1e-9)
    np.testing.assert_allclose(found.centre_of_mass, exact.centre_of_mass, atol=1e-9)
    np.testing.assert_allclose(found.inertia, exact.inertia, atol=1e-9 * np.abs(exact.inertia).max())
    motions = nodal_fields(model, modal) @ modal.invariants.rigid
    np.testing.assert_allclose(motions, model.rigid_body_modes(), atol=1e-9)
    path = tmp_path / "l.modal.h5"
    write_modal_file(path, modal)
    assert read_modal_file(path).modes == modal.modes


@pytest.mark.parametrize("method", ["craig-chang", "mode-displacement"])
@pytest.mark.parametrize("name", LINKS)
def test_free_modes_are_those_of_the_full_model(tmp_path: Path, method: str, name: str) -> None:
    """Eight modes kept: all eight frequencies to 1e-8, whatever else is in the basis."""
    _, modal = reduced(name, tmp_path, method=method, free_modes=8)
    np.testing.assert_allclose(modal.frequencies_hz[6:14], full(name)[1], rtol=1e-8)


def test_the_solid_l() -> None:
    """First six free frequencies of the hex20 L, against 40 free modes with static completion (1e-8 of the full model).

    Guyan: the first to 0.3 %, the others 36 % to 95 % too high. Craig-Bampton with 8 modes below 1 %, with 20 below
    0.06 %: what an earlier prototype found.
    """
    link = load_link(SOLID_L)
    model = build_model(link)

    def frequencies(**options: Any) -> Array:
        modal = reduce_model(model, load_link(SOLID_L, {"elastic_modes": None, **options}))
        return np.asarray(modal.frequencies_hz[6:12])

    guyan = {"method": "guyan", "fixed_interface_modes": None}
    exact = frequencies(method="craig-chang", fixed_interface_modes=None, free_modes=8)
    errors = frequencies(**guyan) / exact - 1
    assert errors[0] < 3e-3
    assert ((errors[1:] > 0.36) & (errors[1:] < 0.96)).all()
    assert errors.max() > 0.95
    for count, limit, seen in ((8, 1e-2, 5e-3), (20, 6e-4, 3e-4)):
        errors = frequencies(fixed_interface_modes=count) / exact - 1
        assert (errors > 0).all()
        assert seen < errors.max() < limit


# ----- free modes of a singular stiffness


@pytest.mark.parametrize("elements", [20, 110])  # LAPACK, Lanczos (666 dofs)
def test_both_of_every_pair(tmp_path: Path, elements: int) -> None:
    """A straight bar of square section: bending pairs, closed form (βL)² √(EI/ρA) / 2πL² to 1e-5, each twice to 1e-8.

    1e-4 with 20 elements (order 4).
    """
    changes = {"frame": {"theory": "euler-bernoulli", "rotary_inertia": False}}
    link = straight_link(tmp_path, 1.0, elements, sections={"s": {"width": 0.02, "height": 0.02}}, **changes)
    body = free_body(build_model(link), "l")
    omega, modes = body.modes(8)
    roots = np.repeat([4.73004074, 7.85320462, 10.9956078, 14.1371655], 2)
    expected = roots**2 * math.sqrt(7e10 * 0.02**2 / 12 / 2700)
    np.testing.assert_allclose(omega, expected, rtol=1e-5 if elements > 100 else 2e-4)
    np.testing.assert_allclose(omega[::2], omega[1::2], rtol=1e-8)
    np.testing.assert_allclose(modes.T @ (body.mass @ modes), np.eye(8), atol=1e-9)
    np.testing.assert_allclose(body.rigid.T @ (body.mass @ modes), 0, atol=1e-9)


def test_a_missed_mode_of_a_free_link_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A solver that loses the second of the first pair: seven are found below where the full model has eight."""
    body = free_body(build_model(straight_link(tmp_path, 1.0, 110)), "l")
    true = fe_import.solver.sparse.lowest_eigenpairs

    def lazy(*arguments: Any) -> tuple[Array, Array]:
        mu, modes = true(*arguments)
        return np.delete(mu, 1), np.delete(modes, 1, axis=1)

    monkeypatch.setattr(fe_import.solver.sparse, "lowest_eigenpairs", lazy)
    with pytest.raises(FEImportError, match="modes of the free link were missed") as caught:
        body.modes(12)
    assert caught.value.cause is Cause.EIGENSOLVER
    assert int(str(caught.value.limit).split()[-1]) == int(str(caught.value.value).split()[0]) + 1


@pytest.mark.parametrize("method", ["craig-chang", "mode-displacement"])
@pytest.mark.parametrize(("slenderness", "elements"), [(1000, 40), (1000, 120), (10_000, 20), (10_000, 40)])
def test_slender_links(tmp_path: Path, method: str, slenderness: int, elements: int) -> None:
    """Bending of a free bar, length over height 1000 and 10 000: (βL)² √(EI/ρA) / L², both of every pair.

    The fourth pair to 5e-6 (60 / n)⁴, the order of beam elements with its constant of 2.1e-6; sound health.
    """
    height = 1.0 / slenderness
    changes: dict[str, Any] = {"frame": {"theory": "euler-bernoulli", "rotary_inertia": False}}
    changes |= {"reduction": {"method": method, "free_modes": 8}}
    changes |= {"sections": {"s": {"width": height, "height": height}}}
    modal = reduce_link(straight_link(tmp_path, 1.0, elements, **changes))
    roots = np.repeat([4.730040744862704, 7.853204624095838, 10.995607838001671, 14.137165491257464], 2)
    expected = roots**2 * math.sqrt(7e10 * height**2 / 12 / 2700) / (2 * math.pi)
    np.testing.assert_allclose(modal.frequencies_hz[6:14], expected, rtol=5e-6 * (60 / elements) ** 4)
    assert sound(modal)


def test_a_slender_inclined_link(tmp_path: Path) -> None:
    """Length over height 1000, 200 elements along no axis: the lowest pair of the free bar to 1e-6."""
    link = straight_link(tmp_path, 1.0, 200, frame={"theory": "euler-bernoulli", "rotary_inertia": False,
                         "nodes": {"tip": [2 / 3, 2 / 3, 1 / 3]}}, sections={"s": {"width": 1e-3, "height": 1e-3}},
                         reduction={"method": "craig-chang", "free_modes": 4})  # fmt: skip
    expected = 4.730040744862704**2 * math.sqrt(7e10 * 1e-6 / 12 / 2700) / (2 * math.pi)
    np.testing.assert_allclose(reduce_link(link).frequencies_hz[6:8], expected, rtol=1e-6)


def test_inertia_relief(tmp_path: Path) -> None:
    """K u = f - M R Rᵀf and RᵀM u = 0, against the pseudo-inverse by eigenmodes; the support does not matter."""
    model = build_model(frame_link(tmp_path))
    mass, stiffness, _ = dense(model)
    body = free_body(model, "l")
    loads = np.random.default_rng(0).standard_normal((len(mass), 3))
    found = body.static(loads)
    squared, modes = la.eigh(stiffness, mass)
    expected = modes[:, 6:] @ (modes[:, 6:].T @ loads / squared[6:, None])
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())
    np.testing.assert_allclose(body.rigid.T @ mass @ found, 0, atol=1e-12 * np.abs(expected).max())
    force = stiffness @ found
    np.testing.assert_allclose(force, body.balanced(loads), atol=1e-9 * np.abs(stiffness).max() * np.abs(found).max())


def test_distant_origin_of_free_modes(tmp_path: Path) -> None:
    """1 km from the origin: same frequencies to 1e-8."""
    nodes = {"root": [0.1, 0.0, 0.0], "elbow": [0.5, 0.1, 0.05], "tip": [0.6, 0.5, -0.1]}
    far = {k: [v[0] + 600.0, v[1] - 500.0, v[2] + 700.0] for k, v in nodes.items()}
    near, moved = (
        reduce_link(frame_link(tmp_path, frame={"nodes": n}, reduction={"method": "craig-chang"})) for n in (nodes, far)
    )
    np.testing.assert_allclose(moved.frequencies_hz[6:], near.frequencies_hz[6:], rtol=1e-8)


# ----- clamped truncation


@pytest.mark.parametrize("method", ["craig-chang", "none", "guyan", "mode-displacement"])
def test_clamped_truncation_of_every_basis(tmp_path: Path, method: str) -> None:
    """Four elastic modes of those with the hub held: the frequencies then are those of the whole basis, to 1e-8."""
    model, held = full("frame")[0], []
    for kept in (None, 4):
        options = {"method": method, **FEW[method], "elastic_modes": kept, "truncation": "clamped"}
        given = {k: v for k, v in options.items() if v is not None}
        modal = reduce_model(model, frame_link(tmp_path, reduction=given))
        held.append(_held_frequencies(modal))
    np.testing.assert_allclose(held[1], held[0][:4], rtol=1e-8)


def _held_frequencies(modal: ModalModel) -> Array:
    """Frequencies with the first interface at rest: the rigid-body coordinates follow the elastic ones."""
    rows = np.vstack(modal.node_shape(modal.interface_nodes[0].node))
    follow = np.vstack([-np.linalg.solve(rows[:, :6], rows[:, 6:]), np.eye(modal.elastic_modes)])
    mass = follow.T @ modal.invariants.m @ follow
    mu = la.eigh(mass, np.diag((2 * np.pi * modal.frequencies_hz[6:]) ** 2), eigvals_only=True)
    return np.asarray(1 / np.sqrt(mu[::-1]) / (2 * np.pi))


def test_registry_is_documented() -> None:
    """Each method stands in the description of the table ``reduction``, and its module cites a source or says why."""
    documented = Reduction.__doc__ or ""
    for name in REDUCTIONS:
        assert f"``{name}``" in documented
    poor: Callable[..., Any] = REDUCTIONS["mode-displacement"]
    assert "do not use it for mechanisms" in (__import__(poor.__module__, fromlist=["x"]).__doc__ or "")

"""Thermal expansion of links made of beams: closed forms, on every reduction, in files; what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.linalg as la
from link_files import (
    FRAME,
    Array,
    frame_link,
    held,
    interface_shapes,
    merged,
    solid_link,
    straight_link,
    write_toml,
)
from modal_models import same

from fe_import.description.link import LinkFile, load_link
from fe_import.errors import Cause, FEImportError
from fe_import.modal.file import read_modal_file, write_modal_file
from fe_import.modal.model import ModalModel
from fe_import.modal.thermal import ThermalExpansion
from fe_import.models.model import build_model
from fe_import.models.substructures import split_link
from fe_import.recovery.recover import mode_acceleration, mode_displacement
from fe_import.reduce import reduce_link
from fe_import.reduction import REDUCTIONS

EXPANSION, CHANGE = 23e-6, 40.0
WARM: dict[str, Any] = {
    "materials": {"m": {"thermal_expansion": EXPANSION}},
    "temperature_change": CHANGE,
    "recovery": {"all": True},
}
LENGTH, AXIAL = 0.8, 7e10 * 0.01 * 0.02  # E A of the section of `FRAME`
PULL = AXIAL * EXPANSION * CHANGE
HUB, HAND, ELBOW = {"name": "hub", "node": "root"}, {"name": "hand", "node": "tip"}, {"name": "mid", "node": "elbow"}


def warm_link(folder: Path, **changes: Any) -> LinkFile:
    """The bent frame without symmetry, warmed."""
    return frame_link(folder, **merged(WARM, changes))


def thermal_of(modal: ModalModel) -> ThermalExpansion:
    """What the link description asked for."""
    assert modal.thermal is not None
    return modal.thermal


def at_rest(modal: ModalModel, clamped: Array) -> tuple[Array, Array]:
    """Modal coordinates of the warm link at rest, its interface components ``clamped`` held; forces on all interfaces.

    Ω² q = ΔT f + Φ_bᵀ λ with Φ_b q = 0 in the clamped rows.
    """
    thermal, rows = thermal_of(modal), interface_shapes(modal)
    load = thermal.change * thermal.force
    basis = held(rows[clamped]) if len(clamped) else np.eye(modal.modes)[:, 6:]
    q = basis @ la.solve(basis.T @ modal.stiffness @ basis, basis.T @ load, assume_a="sym")
    forces = np.zeros(len(rows))
    forces[clamped] = la.lstsq(rows[clamped].T, modal.stiffness @ q - load)[0]
    return q, forces


def section_forces(modal: ModalModel, q: Array, forces: Array) -> tuple[Array, Array]:
    """(p, 6) by mode displacement and by mode acceleration."""
    modes, warm = mode_displacement(modal)
    static, loads, _, more = mode_acceleration(modal)
    return modes @ q + warm, static @ q + loads @ forces + more


NOTHING, INBOARD, BOTH = np.arange(0), np.arange(6), np.arange(12)


@pytest.mark.parametrize("method", REDUCTIONS)
@pytest.mark.parametrize("interfaces", [[HUB], [HUB, HAND], [ELBOW]])
def test_a_free_link_expands_without_stress(tmp_path: Path, method: str, interfaces: list[dict[str, str]]) -> None:
    """Every length grows by α ΔT, nothing turns, no section feels a force: with any basis, seated anywhere."""
    modal = reduce_link(warm_link(tmp_path, interfaces=interfaces, reduction={"method": method}))
    assert all(c.ok for c in modal.health if c.name.startswith("thermal"))
    q, forces = at_rest(modal, INBOARD)
    start = modal.interface_nodes[0].node
    moved = modal.translation_shapes @ q
    expected = EXPANSION * CHANGE * (modal.nodes - modal.nodes[start])
    np.testing.assert_allclose(moved, expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(modal.rotation_shapes @ q, 0.0, atol=1e-9 * EXPANSION * CHANGE)
    for found in section_forces(modal, q, forces):
        np.testing.assert_allclose(found, 0.0, atol=1e-8 * PULL)


@pytest.mark.parametrize(
    "options",
    [
        {"elastic_modes": 2},
        {"elastic_modes": 4, "truncation": "clamped"},
        {"elastic_modes": 14, "static_correction": True},
        {"elastic_modes": 3, "method": "craig-chang", "free_modes": 8},
    ],
)
def test_few_modes_expand_too(tmp_path: Path, options: dict[str, Any]) -> None:
    """The modes that are kept hold the expanded shape, however few they are."""
    modal = reduce_link(warm_link(tmp_path, reduction=options))
    assert modal.elastic_modes == options["elastic_modes"]
    (check,) = (c for c in modal.health if c.name.startswith("thermal"))
    assert check.ok
    assert check.value < 1e-9
    q, _ = at_rest(modal, NOTHING)
    hub, hand = (modal.translation_shapes[i.node] @ q for i in modal.interface_nodes)
    grown = EXPANSION * CHANGE * (modal.interface_nodes[1].position - modal.interface_nodes[0].position)
    turned = np.linalg.norm(modal.rotation_shapes @ q)
    assert turned < 1e-9
    np.testing.assert_allclose(hand - hub, grown, atol=1e-9 * np.abs(grown).max())


@pytest.mark.parametrize("method", ["craig-bampton", "craig-chang", "guyan", "none"])
@pytest.mark.parametrize("theory", ["timoshenko", "euler-bernoulli"])
def test_a_clamped_bar_is_pressed(tmp_path: Path, method: str, theory: str) -> None:
    """Both ends held: N = -E A α ΔT at every section and at the clamps, and nothing else."""
    changes = merged(WARM, {"reduction": {"method": method}, "frame": {"theory": theory}})
    modal = reduce_link(straight_link(tmp_path, LENGTH, 5, **changes))
    q, forces = at_rest(modal, BOTH)
    np.testing.assert_allclose(modal.translation_shapes @ q, 0.0, atol=1e-12 * LENGTH)
    np.testing.assert_allclose(forces, PULL * np.eye(12)[0] - PULL * np.eye(12)[6], atol=1e-7 * PULL)
    for found in section_forces(modal, q, forces):
        np.testing.assert_allclose(found, np.tile([-PULL, 0, 0, 0, 0, 0], (10, 1)), atol=1e-7 * PULL)


@pytest.mark.parametrize("method", ["craig-bampton", "craig-chang", "guyan"])
def test_a_clamped_bar_of_two_materials(tmp_path: Path, method: str) -> None:
    """N = -ΔT (α₁L₁ + α₂L₂) / (L₁/E₁A + L₂/E₂A), and the joint of the materials moves: interior static answer."""
    steel = {"youngs_modulus": 2.1e11, "poissons_ratio": 0.3, "density": 7850.0, "thermal_expansion": 12e-6}
    nodes = {"root": [0.0, 0.0, 0.0], "seam": [0.3, 0.0, 0.0], "tip": [LENGTH, 0.0, 0.0]}
    members = [
        {"from": a, "to": b, "elements": 2, "material": m, "section": "s"}
        for a, b, m in (("root", "seam", "m"), ("seam", "tip", "steel"))
    ]
    modes = {"fixed_interface_modes": 0} if method == "craig-bampton" else {}
    own = {"materials": {"steel": steel}, "reduction": {"method": method, **modes}}
    two = {**merged(merged(FRAME, WARM), own), "frame": {"nodes": nodes, "members": members}}
    modal = reduce_link(load_link(write_toml(tmp_path / "two.toml", two)))
    q, forces = at_rest(modal, BOTH)
    stiff = AXIAL * np.array([1.0, 3.0])
    pull = -CHANGE * (EXPANSION * 0.3 + 12e-6 * 0.5) / (0.3 / stiff[0] + 0.5 / stiff[1])
    for found in section_forces(modal, q, forces):
        np.testing.assert_allclose(found, np.tile([pull, 0, 0, 0, 0, 0], (8, 1)), atol=1e-7 * abs(pull))
    seam = 0.3 * (EXPANSION * CHANGE + pull / stiff[0])
    moved = modal.translation_shapes[modal.node_names["seam"]] @ q
    np.testing.assert_allclose(moved, [seam, 0, 0], atol=1e-7 * abs(seam))


THICK, MODULI, ALPHAS = (1e-3, 2e-3), (2.1e11, 7e10), (12e-6, 23e-6)  # steel below, aluminium above
RUNGS, ARM = 20, 0.2


def bimetal(folder: Path, **changes: Any) -> LinkFile:
    """Two strips at the distance of their middle planes, joined by short stiff rungs; root and tip between them."""
    z = (-THICK[0] / 2, THICK[1] / 2)
    nodes: dict[str, list[float]] = {"root": [0.0, 0.0, 0.0], "tip": [ARM, 0.0, 0.0]}
    members: list[dict[str, Any]] = []
    for k in range(RUNGS + 1):
        for strip in (0, 1):
            nodes[f"{'ab'[strip]}{k}"] = [ARM * k / RUNGS, 0.0, z[strip]]
    for strip in "ab":
        members += [
            {"from": f"{strip}{k}", "to": f"{strip}{k + 1}", "material": strip, "section": strip} for k in range(RUNGS)
        ]
    rung = {"material": "stiff", "section": "rung"}
    members += [{"from": f"a{k}", "to": f"b{k}", **rung} for k in range(1, RUNGS)]
    for k, name in ((0, "root"), (RUNGS, "tip")):
        members += [{"from": f"a{k}", "to": name, **rung}, {"from": name, "to": f"b{k}", **rung}]
    base = {"poissons_ratio": 0.3, "density": 5000.0}
    data = {
        "temperature_change": CHANGE,
        "units": {"unusual": True},  # rungs nearly without mass
        "materials": {
            **{
                strip: {**base, "youngs_modulus": e, "thermal_expansion": a}
                for strip, e, a in zip("ab", MODULI, ALPHAS, strict=True)
            },
            "stiff": {"poissons_ratio": 0.3, "density": 100.0, "youngs_modulus": 2e12, "thermal_expansion": 0.0},
        },
        "sections": {
            **{s: {"shape": "rectangular", "width": 0.01, "height": t} for s, t in zip("ab", THICK, strict=True)},
            "rung": {"shape": "rectangular", "width": 0.02, "height": 0.02},
        },
        "frame": {"nodes": nodes, "members": members},
        "interfaces": [{"name": "hub", "node": "root"}, {"name": "hand", "node": "tip"}],
    }
    return load_link(write_toml(folder / "bimetal.toml", merged(data, changes)))


def timoshenko_curvature() -> float:
    """κ of a bimetal strip (S. Timoshenko, J. Optical Soc. America 11 (1925) 233-255, eq. 4)."""
    m, n, h = THICK[0] / THICK[1], MODULI[0] / MODULI[1], sum(THICK)
    strain = (ALPHAS[1] - ALPHAS[0]) * CHANGE
    return 6 * strain * (1 + m) ** 2 / (h * (3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n))))


@pytest.mark.parametrize(
    "options", [{}, {"elastic_modes": 8}, {"method": "craig-chang"}, {"method": "guyan"}], ids=str
)
def test_a_bimetal_arm_bends_as_timoshenko_says(tmp_path: Path, options: dict[str, Any]) -> None:
    """Tip deflection κ L²/2 within 1 % in the full model; the reduced one gives the same to 1e-6."""
    link = bimetal(tmp_path, reduction=options)
    model = build_model(link)
    assert model.thermal is not None
    clamped = model.dof_map[model.interface_nodes[0].node]
    free = np.setdiff1d(np.arange(len(model.thermal.force)), clamped)
    stiffness = model.stiffness.toarray()[np.ix_(free, free)]
    full = np.zeros(len(model.thermal.force))
    full[free] = la.solve(stiffness, CHANGE * model.thermal.force[free], assume_a="pos")
    tip = full[model.dof_map[model.interface_nodes[1].node]]
    curvature = timoshenko_curvature()
    np.testing.assert_allclose(tip[2], -curvature * ARM**2 / 2, rtol=0.01)
    np.testing.assert_allclose(tip[4], curvature * ARM, rtol=0.01)
    modal = reduce_link(link)
    q, _ = at_rest(modal, INBOARD)
    reduced = interface_shapes(modal)[6:] @ q
    np.testing.assert_allclose(reduced, tip, atol=1e-6 * np.abs(tip).max())


def test_units_of_the_description(tmp_path: Path) -> None:
    """The same link in mm, t and s has the same modal model; kelvin are kelvin."""
    metres = reduce_link(warm_link(tmp_path))
    small = {
        "units": {"length": "mm", "mass": "t"},
        "materials": {"m": {"youngs_modulus": 7e4, "density": 2.7e-9}},
        "sections": {"s": {"width": 10.0, "height": 20.0}},
        "frame": {"nodes": {"root": [100.0, 0.0, 0.0], "elbow": [500.0, 100.0, 50.0], "tip": [600.0, 500.0, -100.0]}},
    }
    millimetres = reduce_link(warm_link(tmp_path, **small))
    a, b = thermal_of(metres), thermal_of(millimetres)
    assert a.change == b.change == CHANGE
    np.testing.assert_allclose(np.abs(b.force), np.abs(a.force), atol=1e-6 * np.abs(a.force).max())
    np.testing.assert_allclose(b.restrained, a.restrained, rtol=1e-9)
    np.testing.assert_allclose(a.restrained[:, 0] * CHANGE, -PULL, rtol=1e-12)


def test_without_a_temperature_change_nothing_changes(tmp_path: Path) -> None:
    """A material may have its coefficient: the modal model is that of a link that has none."""
    plain = reduce_link(frame_link(tmp_path))
    known = reduce_link(frame_link(tmp_path, materials=WARM["materials"]))
    assert known.thermal is None
    np.testing.assert_array_equal(plain.translation_shapes, known.translation_shapes)


def test_no_change_prepares_the_modal_file_for_one(tmp_path: Path) -> None:
    """The forces per kelvin are those of any change."""
    warm, ready = (thermal_of(reduce_link(warm_link(tmp_path, temperature_change=t))) for t in (CHANGE, 0.0))
    assert ready.change == 0.0
    np.testing.assert_array_equal(ready.force, warm.force)


def test_in_a_modal_file(tmp_path: Path) -> None:
    """Read as written; some modes of it."""
    modal = reduce_link(warm_link(tmp_path))
    write_modal_file(tmp_path / "a.modal.h5", modal)
    assert same(read_modal_file(tmp_path / "a.modal.h5"), modal)
    thermal = thermal_of(modal)
    assert not thermal.force[:6].any()
    some = np.array([*range(6), 8, 7])
    np.testing.assert_array_equal(thermal.truncated(some).force, thermal.force[some])


@pytest.mark.parametrize(
    ("item", "change"),
    [
        ("change", {"change": np.inf}),
        ("force", {"force": np.zeros(5)}),
        ("force", {"force": np.full(24, 1.0)}),
        ("force", {"force": np.full(24, np.nan)}),
        ("restrained", {"restrained": np.zeros((3, 6))}),
        ("relaxed", {"relaxed": np.zeros((12, 6), dtype=np.int64)}),
    ],
)
def test_a_faulty_one_is_not_written(tmp_path: Path, item: str, change: dict[str, Any]) -> None:
    modal = reduce_link(warm_link(tmp_path, reduction={"elastic_modes": 18}))
    with pytest.raises(FEImportError) as caught:
        write_modal_file(tmp_path / "a.modal.h5", replace(modal, thermal=replace(thermal_of(modal), **change)))
    assert caught.value.cause is Cause.MODAL_FILE
    assert caught.value.where.endswith(f"/thermal/{item}")
    assert not (tmp_path / "a.modal.h5").exists()


def test_a_faulty_one_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "a.modal.h5"
    write_modal_file(path, reduce_link(warm_link(tmp_path)))
    with h5py.File(path, "r+") as file:
        del file["thermal/force"]
    with pytest.raises(FEImportError, match="missing") as caught:
        read_modal_file(path)
    assert caught.value.where.endswith("/thermal/force")


def test_pieces_of_a_link_expand_together(tmp_path: Path) -> None:
    """Substructures carry the change of the whole."""
    pieces = split_link(warm_link(tmp_path), 2, "hub", "hand", "here")
    grown = []
    for piece in pieces:
        modal = reduce_link(piece)
        q, _ = at_rest(modal, INBOARD)
        grown.append(interface_shapes(modal)[6:9] @ q)
    np.testing.assert_allclose(sum(grown), EXPANSION * CHANGE * np.array([0.5, 0.5, -0.1]), rtol=1e-8)


@pytest.mark.parametrize(
    ("changes", "place", "says"),
    [
        ({"temperature_change": float("nan")}, "temperature_change", "no solid is that hot"),
        ({"temperature_change": 5000.0}, "temperature_change", "no solid is that hot"),
        ({"materials": {"m": {"thermal_expansion": float("inf")}}}, "thermal_expansion", "must be finite"),
        ({"materials": {"m": {"thermal_expansion": 23.0}}}, "thermal_expansion", "a unit slipped"),
        ({"reduction": {"elastic_modes": 0}}, "reduction.elastic_modes", "thermal expansion takes more elastic modes"),
    ],
)
def test_faulty_requests(tmp_path: Path, changes: dict[str, Any], place: str, says: str) -> None:
    with pytest.raises(FEImportError, match=says) as caught:
        reduce_link(warm_link(tmp_path, **changes))
    assert place in caught.value.where
    assert caught.value.remedy


def test_a_change_needs_a_coefficient(tmp_path: Path) -> None:
    """It is not taken for zero."""
    with pytest.raises(FEImportError, match="needs the expansion of the materials") as caught:
        frame_link(tmp_path, temperature_change=CHANGE)
    assert caught.value.cause is Cause.BAD_FIELD
    assert caught.value.where.endswith("materials.m.thermal_expansion")


def test_what_does_not_expand(tmp_path: Path) -> None:
    """Refused, not ignored."""
    with pytest.raises(FEImportError, match="the physical form carries no thermal expansion"):
        frame_link(tmp_path, materials=WARM["materials"], temperature_change=CHANGE, reduction={"form": "physical"})
    with pytest.raises(FEImportError, match="only links made of beams expand"):
        solid_link(tmp_path, temperature_change=CHANGE, materials=WARM["materials"])
